//! The oracle's own tests: answers known by hand, so that it can be trusted to judge the program.

mod common;

use common::folder::NONE;
use common::mesh::Mesh;
use common::naive::{self, Answer, Orient};
use common::npy::Npy;
use common::random::Random;
use common::{surfaces, zoo};
use std::collections::BTreeSet;

fn solve(mesh: &Mesh, orient: Orient) -> Answer {
    naive::solve(mesh, true, orient, &|t| {
        panic!("unclear sign at triangle {t}")
    })
}

fn outward(mesh: &Mesh) -> Answer {
    solve(mesh, Orient::Outward)
}

/// The one component of a mesh that has just one.
fn only(mesh: &Mesh) -> naive::Component {
    let mut components = outward(mesh).components;
    assert_eq!(components.len(), 1, "{}", mesh.name);
    components.remove(0)
}

fn animal(name: &str) -> Mesh {
    let found = zoo::all().into_iter().find(|m| m.name == name);
    found.unwrap_or_else(|| panic!("no {name} in the zoo"))
}

#[test]
fn opposites_of_two_triangles() {
    let p = surfaces::tetrahedron().positions;
    let answer = outward(&Mesh::new("two", vec![[0, 1, 2], [2, 1, 3]], p));
    // Corner 0 faces {1, 2}, and so does corner 5.
    assert_eq!(answer.o, [5, NONE, NONE, NONE, NONE, 0]);
    assert_eq!(answer.component, [0, 0]);
    assert_eq!(
        (
            answer.counts["border_edges"],
            answer.counts["inconsistent_edges"]
        ),
        (4, 0)
    );
}

#[test]
fn opposites_of_the_unit_tetrahedron() {
    let answer = outward(&surfaces::tetrahedron());
    // Written down from the drawing: triangles [0 2 1], [0 1 3], [1 2 3], [0 3 2].
    assert_eq!(answer.o, [8, 5, 10, 7, 11, 1, 9, 3, 0, 6, 2, 4]);
    assert_eq!(answer.flipped, [false; 4]);
}

#[test]
fn the_unit_tetrahedron_encloses_a_sixth() {
    let inside_out = surfaces::tetrahedron().inverted();
    for mesh in [surfaces::tetrahedron(), inside_out.clone()] {
        let c = only(&mesh);
        assert_eq!(
            (c.six_volume, c.closed, c.watertight, c.outward),
            (1.0, true, true, true)
        );
        assert!((c.area - (1.5 + 3f64.sqrt() / 2.0)).abs() < 1e-12);
        assert_eq!(c.bounds, Some([[0.0; 3], [1.0; 3]]));
    }
    assert_eq!(outward(&inside_out).flipped, [true; 4]);
    assert_eq!(solve(&inside_out, Orient::Majority).flipped, [false; 4]);
    assert_eq!(
        solve(&inside_out, Orient::Majority).components[0].six_volume,
        -1.0
    );
    assert_eq!(outward(&inside_out).counts["flipped_components"], 1);
}

#[test]
fn volumes_of_octahedron_and_cube() {
    assert_eq!(only(&surfaces::octahedron()).six_volume, 8.0);
    assert_eq!(only(&surfaces::cube()).six_volume, 6.0);
    assert_eq!(only(&animal("closed and flat")).six_volume, 0.0);
    assert!(!only(&animal("closed and flat")).outward);
}

#[test]
fn a_cavity_is_turned_outward_unless_told_otherwise() {
    let cavity = animal("a cavity");
    assert_eq!(outward(&cavity).flipped, [[false; 4], [true; 4]].concat());
    assert_eq!(outward(&cavity).components[1].six_volume, 1.0);
    assert_eq!(flips_of(&cavity, Orient::Majority), [false; 8]);
    assert_eq!(outward(&animal("nested shells")).flipped, [false; 8]);
}

#[test]
fn euler_characteristics_are_those_of_the_surfaces() {
    let cases = [
        (surfaces::tetrahedron(), 2, true, true),
        (surfaces::octahedron(), 2, true, true),
        (surfaces::cube(), 2, true, true),
        (surfaces::torus(5, 4), 0, true, true),
        (surfaces::klein_bottle(4, 3), 0, true, false),
        (surfaces::klein_bottle(5, 5), 0, true, false),
        (surfaces::projective_plane(), 1, true, false),
        (surfaces::moebius(4), 0, false, false),
        (surfaces::moebius(7), 0, false, false),
        (surfaces::disk(3), 1, false, true),
        (animal("octahedron without one triangle"), 1, false, true),
    ];
    for (mesh, euler, closed, orientable) in cases {
        let answer = naive::solve(&mesh, true, Orient::Keep, &|_| panic!());
        let c = &answer.components[0];
        assert_eq!(
            (answer.components.len(), c.closed, c.orientable),
            (1, closed, orientable),
            "{}",
            mesh.name
        );
        let found = mesh.positions.len() as i64 - c.edges as i64 + c.members.len() as i64;
        assert_eq!(found, euler, "{}", mesh.name);
        assert_eq!(answer.counts["distinct_edges"], c.edges, "{}", mesh.name);
    }
}

#[test]
fn a_nonorientable_component_keeps_its_input() {
    let mut strip = surfaces::moebius(5);
    strip.flip_some(&mut Random::new(1), 40);
    for orient in Orient::ALL {
        let answer = solve(&strip, orient);
        assert_eq!(answer.flipped, [false; 10]);
        assert!(!answer.components[0].orientable);
    }
    assert_eq!(outward(&strip).counts["border_edges"], 10);
}

#[test]
fn three_on_an_edge_are_cut_there() {
    let answer = outward(&surfaces::fan_on_edge(3));
    assert_eq!(answer.o, [NONE; 9]);
    assert_eq!(answer.nonmanifold_edges, [((0, 1), vec![2, 5, 8])]);
    assert_eq!(answer.component, [0, 1, 2]);
    let c = &answer.components[0];
    assert_eq!((c.edges, c.border_edges, c.cut_edges), (3, 2, 1));
    assert_eq!(
        (
            answer.counts["components_joined"],
            answer.counts["distinct_edges"]
        ),
        (1, 7)
    );
}

#[test]
fn tetrahedra_on_an_edge_are_watertight_though_not_closed() {
    let answer = outward(&surfaces::tetrahedra_on_edge(2));
    assert_eq!(answer.nonmanifold_edges.len(), 1);
    assert_eq!(answer.nonmanifold_edges[0].1.len(), 4);
    for c in &answer.components {
        assert_eq!((c.closed, c.watertight, c.outward), (false, true, true));
        assert_eq!((c.edges, c.border_edges, c.cut_edges), (7, 0, 2));
        assert!(c.six_volume > 0.0);
    }
    assert_eq!(
        (
            answer.counts["components"],
            answer.counts["components_joined"]
        ),
        (2, 1)
    );
    assert_eq!(answer.counts["closed_components"], 0);
}

#[test]
fn a_fin_is_not_watertight_its_tetrahedron_is() {
    let answer = outward(&animal("tetrahedron with a fin"));
    let verdicts: Vec<_> = answer
        .components
        .iter()
        .map(|c| (c.watertight, c.cut_edges))
        .collect();
    assert_eq!(verdicts, [(true, 2), (false, 1)]);
}

#[test]
fn the_glued_tube_cancels_only_when_its_ends_run_against_each_other() {
    let torus = &outward(&animal("torus with fins")).components[0];
    assert_eq!(
        (torus.border_edges, torus.cut_edges, torus.watertight),
        (0, 6, true)
    );
    let mirrored = &outward(&animal("tube, ends glued mirrored, with fins")).components[0];
    assert_eq!((mirrored.border_edges, mirrored.cut_edges), (0, 6));
    assert!(mirrored.orientable && !mirrored.watertight && !mirrored.outward);
}

#[test]
fn a_hourglass_is_two_components() {
    let answer = outward(
        &zoo::all()
            .into_iter()
            .find(|m| m.name.starts_with("hourglass"))
            .unwrap(),
    );
    assert_eq!(
        (
            answer.counts["components"],
            answer.counts["components_joined"]
        ),
        (2, 2)
    );
    assert_eq!(answer.flipped, [[false; 4], [true; 4]].concat());
    assert_eq!(answer.counts["unreferenced_vertices"], 1);
}

#[test]
fn duplicates_count_like_any_other() {
    let twice = outward(&animal("a triangle twice"));
    assert_eq!(
        (
            twice.counts["regular_edges"],
            twice.counts["inconsistent_edges"]
        ),
        (3, 3)
    );
    assert_eq!(twice.components[0].flipped, 1);
    assert!(twice.components[0].closed && !twice.components[0].outward);
    // A tie of the majority: the first triangle decides.
    assert_eq!(twice.flipped, [false, true]);
    let thrice = outward(&animal("a triangle three times"));
    assert_eq!(
        (
            thrice.counts["nonmanifold_edges"],
            thrice.counts["nonmanifold_corners"]
        ),
        (3, 9)
    );
    assert_eq!(thrice.counts["components"], 3);
}

#[test]
fn degenerates_face_nothing_and_have_no_label() {
    let answer = outward(&animal("degenerate on an edge"));
    assert_eq!(answer.degenerate, [4, 5, 6]);
    assert_eq!(answer.component, [0, 0, 0, 0, NONE, NONE, NONE]);
    assert_eq!(answer.o[12..], [NONE; 9]);
    assert_eq!(
        (
            answer.counts["distinct_edges"],
            answer.counts["border_edges"]
        ),
        (6, 0)
    );
    let none = outward(&animal("only degenerate"));
    assert_eq!(
        (
            none.counts["components"],
            none.counts["unreferenced_vertices"]
        ),
        (0, 0)
    );
}

#[test]
fn the_majority_and_the_first_decide_what_has_a_border() {
    let mut disk = surfaces::disk(7);
    for t in [0, 1, 2, 4] {
        disk.triangles[t].swap(1, 2);
    }
    let flips = |orient| solve(&disk, orient).flipped;
    let minority = [false, false, false, true, false, true, true];
    assert_eq!(flips(Orient::Outward), minority);
    assert_eq!(flips(Orient::Majority), minority);
    assert_eq!(flips(Orient::First), minority);
    assert_eq!(flips(Orient::Keep), [false; 7]);
    disk.triangles[2].swap(1, 2);
    assert_eq!(
        flips_of(&disk, Orient::Majority),
        [true, true, false, false, true, false, false]
    );
    assert_eq!(
        flips_of(&disk, Orient::First),
        [false, false, true, true, false, true, true]
    );
}

fn flips_of(mesh: &Mesh, orient: Orient) -> Vec<bool> {
    solve(mesh, orient).flipped
}

#[test]
fn what_is_not_finite_or_too_small_goes_by_majority() {
    let nan = outward(&animal("tetrahedron with a NaN, and another"));
    assert!(nan.components[0].six_volume.is_nan() && nan.components[0].area.is_nan());
    let outwards: Vec<bool> = nan.components.iter().map(|c| c.outward).collect();
    assert_eq!(
        (outwards, nan.counts["nonfinite_vertices"]),
        (vec![false, true], 1)
    );
    let small = outward(&animal("small beside far out"));
    let outwards: Vec<bool> = small.components.iter().map(|c| c.outward).collect();
    assert_eq!(outwards, [false, true]);
    assert_eq!(small.flipped, [false; 8]);
}

#[test]
fn flip_as_the_conventions_state_it_is_what_the_search_finds() {
    for seed in 0..50 {
        let mesh = zoo::random(seed);
        let answer = naive::solve(&mesh, false, Orient::Majority, &|_| panic!());
        let input: Vec<[u64; 3]> = mesh.triangles.iter().map(|t| t.map(u64::from)).collect();
        let before = naive::opposites(&naive::incident_corners(&input));
        // flip(t) exchanges the corners 3t + 1 and 3t + 2, and every reference to them.
        let moved = |c: usize| match (answer.flipped[c / 3], c % 3) {
            (true, 1) => c + 1,
            (true, 2) => c - 1,
            _ => c,
        };
        for (c, d) in before.iter().enumerate() {
            let expected = d.map_or(NONE, |d| moved(d) as u64);
            assert_eq!(answer.o[moved(c)], expected, "{}", mesh.name);
        }
    }
}

#[test]
fn the_random_meshes_have_what_is_hard() {
    let mut seen = BTreeSet::new();
    for seed in 0..100 {
        let mesh = zoo::random(seed);
        assert!(
            mesh.triangles.len() < 800,
            "{} triangles",
            mesh.triangles.len()
        );
        let answer = naive::solve(&mesh, true, Orient::Outward, &|_| (false, false));
        seen.extend(
            answer
                .counts
                .into_iter()
                .filter(|(_, n)| *n > 0)
                .map(|(name, _)| name),
        );
        for c in &answer.components {
            seen.extend((c.watertight && !c.closed && c.outward).then_some("a cut one outward"));
            seen.extend(
                (c.cut_edges > 0 && !c.watertight && c.border_edges == 0).then_some("uneven"),
            );
        }
        seen.extend((answer.unclear > 0).then_some("unclear"));
    }
    let counts = outward(&surfaces::tetrahedron()).counts;
    let wanted = counts
        .keys()
        .copied()
        .filter(|name| *name != "polygons_fanned");
    for name in wanted.chain(["a cut one outward", "uneven"]) {
        assert!(seen.contains(name), "no random mesh with {name}");
    }
}

#[test]
fn the_reader_reads_what_numpy_wrote() {
    // np.save of np.arange(3, dtype='<u4').
    let mut file = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    let dict = "{'descr': '<u4', 'fortran_order': False, 'shape': (3,), }";
    file.extend(format!("{dict:<117}\n").bytes());
    file.extend([0, 0, 0, 0, 1, 0, 0, 0, 255, 255, 255, 255]);
    let npy = Npy::parse(&file).expect("NumPy's own header");
    assert_eq!(
        (npy.ids(), npy.dtype(), npy.start),
        (vec![0, 1, NONE], "u4".into(), 128)
    );
    assert!(Npy::parse(&file[..file.len() - 1]).is_err());
}

#[test]
fn the_reader_reads_structured_arrays() {
    let dict = "{'descr': [('n', '<u8'), ('ok', '|u1'), ('at', '<f8', (3,))], \
                'fortran_order': False, 'shape': (2,), }";
    let mut file = b"\x93NUMPY\x01\x00\xb6\x00".to_vec();
    file.extend(format!("{dict:<181}\n").bytes());
    for (n, ok, at) in [(7u64, 1u8, [1.5f64, 2.0, 3.0]), (u64::MAX, 0, [0.0; 3])] {
        file.extend(n.to_le_bytes());
        file.push(ok);
        file.extend(at.iter().flat_map(|x| x.to_le_bytes()));
    }
    let npy = Npy::parse(&file).expect("a structured header");
    assert_eq!((npy.row_bytes(), npy.counts("n")), (33, vec![7, u64::MAX]));
    assert_eq!(npy.counts("ok"), [1, 0]);
    assert_eq!(npy.floats("at"), [[1.5, 2.0, 3.0], [0.0; 3]]);
}
