//! The stars of small meshes, known by hand.

use super::pair::Pairs;
use super::star::*;
use super::swirl::Swirl;

#[derive(Default)]
struct Found {
    valences: Vec<u32>,
    shared: Vec<u32>,
    parts: Vec<Part>,
    twins: Vec<[u32; 2]>,
    candidates: Vec<u32>,
}

impl Sink for Found {
    type Error = std::convert::Infallible;
    fn valence(&mut self, corners: u32) {
        self.valences.push(corners);
    }
    fn shared(&mut self, corner: u32) -> Result<(), Self::Error> {
        self.shared.push(corner);
        Ok(())
    }
    fn part(&mut self, part: &Part) -> Result<(), Self::Error> {
        self.parts.push(*part);
        Ok(())
    }
    fn twins(&mut self, a: u32, b: u32) -> Result<(), Self::Error> {
        self.twins.push([a, b]);
        Ok(())
    }
    fn candidate(&mut self, triangle: u32) -> Result<(), Self::Error> {
        self.candidates.push(triangle);
        Ok(())
    }
}

/// Settles a mesh in one chunk, with these vertices open.
fn settle(mesh: &[u32], open: &[u32]) -> (Vec<StarCount>, Found) {
    let span = mesh.iter().max().map_or(0, |&v| v as usize + 1);
    let open: Vec<bool> = (0..span as u32).map(|v| open.contains(&v)).collect();
    let (mut pairs, mut swirl) = (Pairs::default(), Swirl::default());
    let (mut stars, mut found) = (Stars::default(), Found::default());
    // A used state must not leak into the next chunk.
    let before = [0, 1, 2, 0, 1, 3, 0, 1, 4, 5, 0, 6];
    for (local, open) in [(&before[..], &[false; 7][..]), (mesh, &open)] {
        found = Found::default();
        pairs.pair(local, open);
        swirl.walk(&pairs.opposite);
        let of = Settled {
            local,
            span: open.len(),
            label: &swirl.label,
            open,
        };
        let components = swirl.components.len();
        let Ok(()) = stars.settle(&of, &pairs, components, &mut found);
    }
    (stars.counts, found)
}

const TETRAHEDRON: [u32; 12] = [0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0];

#[test]
fn rings_and_loops_are_counted_by_component() {
    let (counts, found) = settle(&TETRAHEDRON, &[]);
    assert_eq!(counts, [StarCount { rings: 4, loops: 0 }]);
    assert_eq!(found.valences, [3; 4]);
    // One triangle turned, then one left out.
    let mut turned = TETRAHEDRON;
    turned.swap(4, 5);
    assert_eq!(settle(&turned, &[]).0[0].rings, 4);
    let (counts, found) = settle(&TETRAHEDRON[..9], &[]);
    assert_eq!(counts, [StarCount { rings: 1, loops: 1 }]);
    assert_eq!(found.valences, [2, 3, 2, 2]);
    assert!(found.shared.is_empty() && found.parts.is_empty());
}

#[test]
fn moebius_strip_has_one_loop() {
    let strip: Vec<u32> = (0..5).flat_map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
    let (counts, found) = settle(&strip, &[]);
    assert_eq!(counts, [StarCount { rings: 0, loops: 1 }]);
    assert_eq!(found.valences, [3; 5]);
}

#[test]
fn a_vertex_with_two_fans_is_shared() {
    let mut two = TETRAHEDRON.to_vec();
    two.extend([0, 4, 5, 0, 6, 4, 4, 6, 5, 5, 6, 0]);
    let (counts, found) = settle(&two, &[]);
    assert_eq!(counts, [StarCount { rings: 4, loops: 0 }; 2]);
    assert_eq!(found.shared, [0, 12]);
    assert_eq!(found.valences, [6, 3, 3, 3, 3, 3, 3]);
}

#[test]
fn parts_at_open_vertices_name_what_is_not_decided() {
    // Vertices 0 and 1 are open: the edge between them is not decided.
    let (counts, found) = settle(&[0, 1, 2, 0, 2, 3], &[0, 1]);
    assert_eq!(found.valences.len(), 2);
    let at = |vertex| found.parts.iter().find(|p| p.vertex == vertex).unwrap();
    let edge = End { to: 1, corner: 2 };
    // The border 1 2, 2 3, 3 0 is one chain, named by its smallest corner.
    let border = End {
        to: NOTHING,
        corner: 0,
    };
    assert_eq!(at(0).corners, 2);
    assert!(at(0).ends.contains(&edge) && at(0).ends.contains(&border));
    assert_eq!(at(1).corners, 1);
    assert!(at(1).ends.contains(&border));
    assert_eq!(counts, [StarCount { rings: 0, loops: 0 }]);
}

#[test]
fn twins_are_told_by_one_edge_and_more_of_them_are_candidates() {
    // Two triangles back to back are a closed surface.
    let (counts, found) = settle(&[0, 1, 2, 1, 0, 2], &[]);
    assert_eq!(found.twins, [[0, 1]]);
    assert_eq!(counts, [StarCount { rings: 3, loops: 0 }]);
    let (counts, found) = settle(&[0, 1, 2, 1, 0, 2, 2, 1, 0], &[]);
    assert!(found.twins.is_empty());
    assert_eq!(found.candidates, [0, 1, 2]);
    assert_eq!(counts, [StarCount { rings: 0, loops: 1 }; 3]);
    assert!(settle(&TETRAHEDRON, &[]).1.candidates.is_empty());
    assert_eq!(settle(&TETRAHEDRON, &[0, 1, 2]).1.candidates, [0]);
}
