//! Entries of V, O and the labels that are at odds with the rest.

use crate::breaks::{broken, hinge, notice, pair, strip, torus};
use crate::naive::{NONE, Parts, parts};
use crate::{meshes, said, verdict_of};
use cornermill::folder::Orient;
use cornermill::verify::{At, Check};

#[test]
fn notices_wrong_vertices() {
    notice(&broken(
        "a vertex beyond N",
        torus(),
        |p| p.v[5] = 20,
        (Check::VertexRange, At::Corner(5)),
        "V.npy: corner 5: V[5] is 20; expected a vertex below 20",
    ));
    notice(&broken(
        "NONE as a vertex",
        torus(),
        |p| p.v[7] = NONE,
        (Check::VertexRange, At::Corner(7)),
        "V.npy: corner 7: V[7] is NONE; expected a vertex below 20",
    ));
    notice(&broken(
        "a vertex of another triangle",
        torus(),
        |p| p.v[0] = 13,
        (Check::Opposite, At::Corner(1)),
        "O.npy: corner 1: O[1] is 5; \
         expected NONE (no other corner faces edge {5, 13})",
    ));
    notice(&broken(
        "a triangle turned in V alone",
        pair(),
        |p| p.v.swap(4, 5),
        (Check::Orientation, At::Corner(1)),
        "V.npy: corner 1: its edge runs the same way in both triangles (3 such edges in component 0); \
         expected opposite ways",
    ));
}

#[test]
fn notices_wrong_opposites() {
    notice(&broken(
        "another corner",
        torus(),
        |p| p.o[31] = 7,
        (Check::Opposite, At::Corner(31)),
        "O.npy: corner 31: O[31] is 7; \
         expected 35 (the only other corner that faces edge {5, 10})",
    ));
    notice(&broken(
        "NONE inside",
        torus(),
        |p| p.o[9] = NONE,
        (Check::Opposite, At::Corner(9)),
        "O.npy: corner 9: O[9] is NONE; \
         expected 14 (the only other corner that faces edge {2, 6})",
    ));
    notice(&broken(
        "two pairs crossed",
        torus(),
        |p| {
            let (a, b) = (p.o[0], p.o[1]);
            p.o.swap(0, 1);
            p.o.swap(a as usize, b as usize);
        },
        (Check::Opposite, At::Corner(0)),
        "O.npy: corner 0: O[0] is 5; \
         expected 28 (the only other corner that faces edge {4, 5})",
    ));
    notice(&broken(
        "an opposite at a border",
        strip(),
        |p| {
            p.o[1] = 14;
            p.o[14] = 1;
        },
        (Check::Opposite, At::Corner(1)),
        "O.npy: corner 1: O[1] is 14; \
         expected NONE (no other corner faces edge {0, 2})",
    ));
    notice(&broken(
        "beyond the last corner",
        torus(),
        |p| p.o[2] = 120,
        (Check::OppositeRange, At::Corner(2)),
        "O.npy: corner 2: O[2] is 120; expected NONE or a corner below 120",
    ));
    notice(&broken(
        "itself",
        torus(),
        |p| p.o[31] = 31,
        (Check::OppositeRange, At::Corner(31)),
        "O.npy: corner 31: O[31] is 31, in the same triangle 10; \
         expected a corner of another triangle",
    ));
    notice(&broken(
        "across a non-manifold edge",
        hinge(),
        |p| {
            let (a, b) = (p.corners[0], p.corners[1]);
            p.o[a as usize] = b;
            p.o[b as usize] = a;
        },
        (Check::Opposite, At::Corner(1)),
        "O.npy: corner 1: O[1] is 5; \
         expected NONE (three or more corners face edge {0, 1})",
    ));
    notice(&broken(
        "at a degenerate triangle",
        strip(),
        |p| p.o[7] = 0,
        (Check::Opposite, At::Corner(7)),
        "O.npy: corner 7: O[7] is 0; expected NONE (triangle 2 is degenerate)",
    ));
}

#[test]
fn notices_wrong_labels() {
    notice(&broken(
        "another component",
        pair(),
        |p| p.label[2] = 1,
        (Check::Label, At::Triangle(2)),
        "component.npy: triangle 2: label 1; \
         expected 0, as triangle 0 across corner 8",
    ));
    notice(&broken(
        "a label beyond the last",
        pair(),
        |p| p.label[6] = 2,
        (Check::Label, At::Triangle(6)),
        "component.npy: triangle 6: label 2; expected a component below 2",
    ));
    notice(&broken(
        "NONE on a sound triangle",
        pair(),
        |p| p.label[3] = NONE,
        (Check::Label, At::Triangle(3)),
        "component.npy: triangle 3: label NONE; expected a component below 2",
    ));
    notice(&broken(
        "a label on a degenerate triangle",
        strip(),
        |p| p.label[2] = 0,
        (Check::Label, At::Triangle(2)),
        "component.npy: triangle 2: label 0; expected NONE (the triangle is degenerate)",
    ));
    notice(&broken(
        "numbered by another triangle",
        pair(),
        |p| {
            p.label.iter_mut().for_each(|l| *l = 1 - *l);
            p.rows.swap(0, 1);
        },
        (Check::Label, At::Component(1)),
        "component.npy: component 1: its first triangle is 0; \
         expected one after 4, that of component 0",
    ));
    notice(&broken(
        "two components under one label",
        pair(),
        one_label,
        (Check::Connected, At::Triangle(4)),
        "component.npy: triangle 4: label 0, but no path over regular edges leads to triangle 0 (2 pieces); \
         expected one label for one component",
    ));
    notice(&broken(
        "a label that no triangle has",
        pair(),
        |p| {
            p.rows.push(p.rows[1]);
            p.counts.components = 3;
        },
        (Check::Label, At::Component(2)),
        "component.npy: component 2: no triangle has label 2; expected each label below 3",
    ));
}

/// Makes two components one in every array and count.
fn one_label(p: &mut Parts) {
    p.label.fill(0);
    let (a, b) = (p.rows[0], p.rows[1]);
    let mut row = a;
    row.triangles = a.triangles + b.triangles;
    row.edges = a.edges + b.edges;
    row.six_volume = a.six_volume + b.six_volume;
    row.area = a.area + b.area;
    row.bbox_max = b.bbox_max;
    p.rows = vec![row];
    p.counts.components = 1;
    p.counts.closed_components = 1;
    p.counts.watertight_components = 1;
}

/// Whatever entry of O, the labels and the lists is changed, and to whatever id.
#[test]
fn notices_any_single_change() {
    for seed in 1..150 {
        let mut random = meshes::generator(seed);
        let triangles = 5 + random(40) as usize;
        let vertices = 4 + random(30);
        let mut parts = parts(&meshes::random(seed, triangles, vertices), Orient::Outward);
        parts.wide = seed % 2 == 0;
        let most = 3 * triangles as u64 + 2;
        let value = match random(most) {
            id if id + 1 == most => NONE,
            id => id,
        };
        let measured = parts.measured.as_mut().unwrap();
        let arrays = [
            &mut parts.o,
            &mut parts.label,
            &mut parts.degenerate,
            &mut parts.corners,
            &mut measured.vertices,
            &mut measured.duplicate,
        ];
        let mut arrays: Vec<_> = arrays.into_iter().filter(|a| !a.is_empty()).collect();
        let which = random(arrays.len() as u64) as usize;
        let place = random(arrays[which].len() as u64) as usize;
        let same = arrays[which][place] == value;
        arrays[which][place] = value;
        let verdict = verdict_of(&parts);
        assert_eq!(verdict.ok(), same, "seed {seed}: {}", said(&verdict));
    }
}
