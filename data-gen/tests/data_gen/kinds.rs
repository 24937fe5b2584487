//! The closed forms of every kind against naive counts, at many small sizes.

use std::collections::{BTreeMap, BTreeSet};

use crate::naive;
use data_gen::blobs::Blobs;
use data_gen::defects::Defects;
use data_gen::grid::{Grid, Shape};
use data_gen::loose::{Form, Loose};
use data_gen::sphere::Sphere;
use data_gen::turned::Turned;
use data_gen::{Mesh, Truth};

/// Checks everything that a mesh claims of itself.
fn check(name: &str, mesh: &dyn Mesh) {
    let truth = mesh.truth();
    let triangles = naive::gather(mesh);
    assert_eq!(truth, naive::count(&triangles, truth.vertices), "{name}");
    check_neighbours(name, mesh, &triangles);
    check_positions(name, mesh, &truth);
    let across: BTreeSet<u64> = (0..truth.triangles).map(|i| mesh.across(i)).collect();
    assert_eq!(
        across.len() as u64,
        truth.triangles,
        "{name}: across is no bijection"
    );
    assert_eq!(
        across.last(),
        Some(&(truth.triangles - 1)),
        "{name}: across leaves the mesh"
    );
}

/// Neighbours share the edge that the corner faces, and regular edges are exactly those with one.
fn check_neighbours(name: &str, mesh: &dyn Mesh, triangles: &[[u64; 3]]) {
    let mut sides = 0;
    for (t, corners) in triangles.iter().enumerate() {
        for (k, link) in mesh.neighbours(t as u64).into_iter().enumerate() {
            let Some(link) = link else { continue };
            sides += 1;
            let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let other = triangles[link.triangle as usize];
            let along = (0..3).any(|k| (other[k], other[(k + 1) % 3]) == (a, b));
            let against = (0..3).any(|k| (other[k], other[(k + 1) % 3]) == (b, a));
            assert!(
                if link.reversed { along } else { against },
                "{name}: corner {k} of {t}"
            );
            let back = mesh.neighbours(link.triangle);
            assert!(
                back.iter().flatten().any(|l| l.triangle == t as u64),
                "{name}: {t}"
            );
        }
    }
    let truth = mesh.truth();
    let regular = truth.distinct_edges - truth.border_edges - truth.nonmanifold_edges;
    assert_eq!(sides, 2 * regular, "{name}: sides with a neighbour");
}

/// Positions are finite and distinct, also in f4 where the mesh says so.
fn check_positions(name: &str, mesh: &dyn Mesh, truth: &Truth) {
    let bits = |v| mesh.position(v).map(|c| (c as f32 + 0.0).to_bits());
    let places: BTreeSet<_> = (0..truth.vertices).map(bits).collect();
    assert!((0..truth.vertices).all(|v| mesh.position(v).iter().all(|c| c.is_finite())));
    if mesh.survives_welding() {
        assert_eq!(
            places.len() as u64,
            truth.vertices,
            "{name}: positions coincide"
        );
    }
}

/// Checks a mesh whose every component is closed and must face outward.
fn check_outward(name: &str, mesh: &dyn Mesh) {
    check(name, mesh);
    let volumes = naive::volumes(mesh);
    assert!(volumes.iter().all(|v| *v > 0.0), "{name}: {volumes:?}");
}

#[test]
fn spheres() {
    for n in 1..14 {
        check_outward(&format!("sphere {n}"), &Sphere::new(n, n));
    }
}

#[test]
fn spheres_with_turned_diagonals() {
    for n in 4..14 {
        for (share, seed) in [(0.0, 1), (0.5, n), (0.5, 100 + n), (0.9, n), (1.0, 1)] {
            let mesh = Turned::new(n, share, seed).unwrap();
            check_outward(&format!("sphere {n}, {share} turned"), &mesh);
        }
    }
    assert!(Turned::new(3, 0.5, 1).is_err(), "too small");
}

#[test]
fn half_of_the_diagonals_are_turned_and_valences_irregular() {
    let (n, sphere) = (60, Sphere::new(60, 1));
    let mesh = Turned::new(n, 0.5, 1).unwrap();
    let mut valence = vec![0; mesh.truth().vertices as usize];
    let mut changed = 0;
    for t in 0..mesh.truth().triangles {
        changed += u64::from(mesh.triangle(t) != sphere.triangle(t));
        for v in mesh.triangle(t) {
            valence[v as usize] += 1;
        }
    }
    let quads = (8 * n * n - 8 * n) / 2;
    let share = changed as f64 / 2.0 / quads as f64;
    assert!((0.47..0.53).contains(&share), "{share} of {quads} turned");
    let regular = valence.iter().filter(|v| **v == 6).count();
    assert!(2 * regular < valence.len(), "{regular} of valence 6");
    assert!(valence.iter().all(|v| (3..=10).contains(v)));
}

#[test]
fn grids() {
    for shape in [Shape::Terrain, Shape::Torus, Shape::Moebius, Shape::Klein] {
        let least = Grid::least(shape);
        for columns in least.0..least.0 + 6 {
            for rows in least.1..least.1 + 6 {
                let name = format!("{shape:?} {columns}x{rows}");
                let grid = Grid::new(shape, columns, rows, 9);
                match shape {
                    Shape::Torus => check_outward(&name, &grid),
                    _ => check(&name, &grid),
                }
            }
        }
    }
}

#[test]
fn blobs() {
    for (blobs, triangles) in [(1, 8), (1, 700), (2, 16), (7, 1000), (40, 4000), (100, 800)] {
        let mesh = Blobs::new(blobs, triangles, 3).unwrap();
        check_outward(&format!("{blobs} blobs"), &mesh);
        assert_eq!(mesh.truth().components, blobs);
    }
    assert!(Blobs::new(11, 87, 3).is_err(), "7.9 triangles each");
}

#[test]
fn blobs_are_disjoint_and_of_power_law_sizes() {
    let mesh = Blobs::new(300, 30_000, 4).unwrap();
    let mut cells: BTreeMap<u64, BTreeSet<[i64; 3]>> = BTreeMap::new();
    let mut sizes: BTreeMap<u64, u64> = BTreeMap::new();
    for t in 0..mesh.truth().triangles {
        let blob = mesh.component(t);
        *sizes.entry(blob).or_default() += 1;
        let corners = mesh
            .triangle(t)
            .map(|v| mesh.position(v).map(|c| c.floor() as i64));
        cells.entry(blob).or_default().extend(corners);
    }
    assert_eq!(cells.len(), 300);
    assert!(
        cells.values().all(|c| c.len() == 1),
        "a blob leaves its cell"
    );
    let different: BTreeSet<_> = cells.values().flatten().collect();
    assert_eq!(different.len(), 300, "two blobs share a cell");
    // The sixteenth after the second largest has an eighth of its triangles, but for rounding.
    let mut sizes: Vec<u64> = sizes.into_values().collect();
    sizes.sort_by(|a, b| b.cmp(a));
    let ratio = sizes[1] as f64 / sizes[16] as f64;
    assert!((6.0..10.0).contains(&ratio), "{ratio}");
}

#[test]
fn blobs_come_near_the_size_that_is_asked_for() {
    for (blobs, triangles) in [(1_000, 1_000_000), (50_000, 10_000_000), (9, 3_000_000_000)] {
        let made = Blobs::new(blobs, triangles, 1).unwrap().truth().triangles;
        assert!(
            made.abs_diff(triangles) < triangles / 100,
            "{blobs} {triangles}: {made}"
        );
    }
}

#[test]
fn loose_forms() {
    for form in [Form::Soup, Form::Fan, Form::Cone, Form::Book, Form::Stack] {
        for triangles in [1, 2, 3, 4, 5, 6, 7, 50, 333] {
            let mesh = Loose::new(form, triangles, 5);
            let name = format!("{form:?} {triangles}");
            if form == Form::Cone {
                check_outward(&name, &mesh);
            } else {
                check(&name, &mesh);
            }
        }
    }
}

#[test]
fn a_rim_of_many_vertices_keeps_them_apart_in_f4() {
    let mesh = Loose::new(Form::Fan, 400_000_000, 5);
    for start in [1, 50_000_000, 399_980_000] {
        let bits = |v| mesh.position(v).map(|c| (c as f32 + 0.0).to_bits());
        let places: BTreeSet<_> = (start..start + 20_000).map(bits).collect();
        assert_eq!(places.len(), 20_000, "from {start}");
    }
}

/// A mesh of each kind, large enough for some faults of each sort.
fn one_of_each() -> Vec<(&'static str, Box<dyn Mesh>)> {
    vec![
        ("sphere", Box::new(Sphere::new(13, 2))),
        ("turned sphere", Box::new(Turned::new(14, 0.5, 2).unwrap())),
        ("torus", Box::new(Grid::new(Shape::Torus, 17, 31, 2))),
        ("terrain", Box::new(Grid::new(Shape::Terrain, 25, 24, 2))),
        ("moebius", Box::new(Grid::new(Shape::Moebius, 14, 40, 2))),
        ("klein", Box::new(Grid::new(Shape::Klein, 16, 40, 2))),
        ("blobs", Box::new(Blobs::new(20, 3000, 2).unwrap())),
        ("soup", Box::new(Loose::new(Form::Soup, 500, 2))),
        ("fan", Box::new(Loose::new(Form::Fan, 500, 2))),
        ("cone", Box::new(Loose::new(Form::Cone, 500, 2))),
        ("book", Box::new(Loose::new(Form::Book, 500, 2))),
        ("stack", Box::new(Loose::new(Form::Stack, 500, 2))),
    ]
}

#[test]
fn defects_add_up() {
    for each in [0, 1, 2, 5] {
        for seed in 0..12 {
            for (name, mesh) in one_of_each() {
                let name = format!("{name} with {each} faults, seed {seed}");
                let before = mesh.truth();
                let cut = mesh.can_be_cut();
                let mesh = Defects::new(mesh, each, seed).unwrap();
                check(&name, &mesh);
                let after = mesh.truth();
                assert_eq!(after.degenerate, before.degenerate + each, "{name}");
                assert_eq!(after.unreferenced, before.unreferenced + each, "{name}");
                let cuts = if cut { each } else { 0 };
                assert_eq!(after.duplicate, before.duplicate + cuts, "{name}");
                assert_eq!(
                    after.nonmanifold_edges,
                    before.nonmanifold_edges + 4 * cuts,
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn a_mesh_without_room_for_faults_is_refused() {
    for n in 1..4 {
        let error = Defects::new(Box::new(Sphere::new(n, 1)), 4, 1)
            .err()
            .map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.contains("larger mesh")), "n = {n}");
    }
}

#[test]
fn closed_forms_hold_at_sizes_that_no_disk_holds() {
    let large: Vec<(&str, Box<dyn Mesh>)> = vec![
        ("sphere", Box::new(Sphere::new(1 << 25, 1))),
        (
            "sphere of odd size",
            Box::new(Sphere::new((1 << 24) - 1, 1)),
        ),
        (
            "torus",
            Box::new(Grid::new(Shape::Torus, (1 << 25) + 1, 1 << 24, 1)),
        ),
        (
            "moebius",
            Box::new(Grid::new(Shape::Moebius, 1 << 25, (1 << 24) + 1, 1)),
        ),
        (
            "blobs",
            Box::new(Blobs::new(1_000_000, 1 << 42, 1).unwrap()),
        ),
        ("cone", Box::new(Loose::new(Form::Cone, 1 << 40, 1))),
    ];
    for (name, mesh) in large {
        let truth = mesh.truth();
        // Spread over the mesh, and the places where a half ends or begins.
        let spread = (0..1000).map(|i| truth.triangles / 1000 * i);
        let edges = [truth.triangles / 2, truth.triangles];
        let edges = edges
            .into_iter()
            .flat_map(|end| end - 3..(end + 3).min(truth.triangles));
        for t in spread.chain(edges).chain(0..3) {
            let corners = mesh.triangle(t);
            for (k, link) in mesh.neighbours(t).into_iter().enumerate() {
                let Some(link) = link else { continue };
                let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
                let other = mesh.triangle(link.triangle);
                assert!(other.contains(&a) && other.contains(&b), "{name}: {t}");
                assert!(!other.contains(&corners[k]), "{name}: {t}");
                let back = mesh.neighbours(link.triangle);
                assert!(
                    back.iter().flatten().any(|l| l.triangle == t),
                    "{name}: {t}"
                );
            }
            assert!(mesh.across(t) < truth.triangles, "{name}: {t}");
            for v in corners {
                assert!(v < truth.vertices, "{name}: {t}");
                assert!(
                    mesh.position(v).iter().all(|c| c.is_finite()),
                    "{name}: {v}"
                );
            }
        }
    }
}
