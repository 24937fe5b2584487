//! The closed forms of every kind against naive counts, at many small sizes.

mod naive;

use std::collections::BTreeSet;

use data_gen::sphere::Sphere;
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
