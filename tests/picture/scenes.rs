//! Meshes to be looked at.

use crate::common::mesh::Mesh;
use crate::common::surfaces;

/// A sphere of radius 1 around (0, 0, 4): rings of `n` vertices each, outward.
pub fn sphere(n: u32) -> Mesh {
    let rings = n / 2;
    let mut positions = vec![[0.0, 1.0, 4.0], [0.0, -1.0, 4.0]];
    for i in 1..rings {
        let (sin, cos) = (f64::from(i) / f64::from(rings) * std::f64::consts::PI).sin_cos();
        for j in 0..n {
            let (y, x) = (f64::from(j) / f64::from(n) * std::f64::consts::TAU).sin_cos();
            positions.push([(sin * x) as f32, cos as f32, (4.0 - sin * y) as f32]);
        }
    }
    let at = |i: u32, j: u32| 2 + i * n + j % n;
    let mut triangles = Vec::new();
    for j in 0..n {
        triangles.push([0, at(0, j), at(0, j + 1)]);
    }
    for i in 0..rings - 2 {
        for j in 0..n {
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    for j in 0..n {
        triangles.push([1, at(rings - 2, j + 1), at(rings - 2, j)]);
    }
    Mesh::new("sphere", triangles, positions)
}

/// Two cubes that share an edge, and nothing else.
pub fn cubes_on_an_edge() -> Mesh {
    let one = surfaces::cube();
    let two = one.clone().moved([1.0, 1.0, 0.0]);
    let mut both = one.plus(&two);
    both.name = "cubes on an edge".into();
    // The second cube's (1,1,z) are the first one's.
    let shared = |v: u32| match v {
        8 => 3,
        12 => 7,
        other => other,
    };
    for triangle in &mut both.triangles {
        *triangle = triangle.map(shared);
    }
    both
}

/// Triangles at random in a box, each turned as it comes.
pub fn random_triangles(seed: u64, count: usize) -> Mesh {
    let mut random = crate::common::random::Random::new(seed);
    let mut number = || random.below(10_000) as f32 / 1000.0;
    let mut positions: Vec<[f32; 3]> = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..count as u32 {
        let middle = [number(), number(), number()];
        for _ in 0..3 {
            positions.push(middle.map(|x| x + number() / 2.0));
        }
        triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    Mesh::new(&format!("{count} random triangles"), triangles, positions)
}
