//! Surfaces by formula, of the sizes that a test asks for.

use super::mesh::Mesh;
use super::random::Random;

/// Corners (0,0,0), x, y, z; counterclockwise seen from outside, six times the volume is 1.
pub fn tetrahedron() -> Mesh {
    let positions = vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    Mesh::new(
        "tetrahedron",
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        positions,
    )
}

/// Vertices +x, -x, +y, -y, +z, -z; outward, six times the volume is 8.
pub fn octahedron() -> Mesh {
    let p = vec![
        [1., 0., 0.],
        [-1., 0., 0.],
        [0., 1., 0.],
        [0., -1., 0.],
        [0., 0., 1.],
        [0., 0., -1.],
    ];
    let top = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
    let bottom = top.map(|[a, b, _]| [b, a, 5]);
    Mesh::new("octahedron", [top, bottom].concat(), p)
}

/// The unit cube, outward, two triangles a side, vertex `x + 2y + 4z`.
pub fn cube() -> Mesh {
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2].map(|x| x as f32);
    Mesh::new("cube", triangles, (0..8).map(corner).collect())
}

/// A grid of `m` by `n` quads closed in both directions; with `twist` the second closing mirrors
/// the first direction, which makes a Klein bottle.
fn closed_grid(name: &str, m: u32, n: u32, twist: bool) -> Mesh {
    let id = |i: u32, j: u32| match twist && j == n {
        true => (m - i % m) % m,
        false => i % m + m * (j % n),
    };
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..m {
            let (a, b, c, d) = (id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let turn = std::f32::consts::TAU;
    let point = |v: u32| {
        let (u, w) = (
            turn * (v % m) as f32 / m as f32,
            turn * (v / m) as f32 / n as f32,
        );
        let r = 2.0 + u.cos();
        [r * w.cos(), r * w.sin(), u.sin()]
    };
    Mesh::new(name, triangles, (0..m * n).map(point).collect())
}

/// A torus of `2mn` triangles.
pub fn torus(m: u32, n: u32) -> Mesh {
    closed_grid("torus", m, n, false)
}

/// A closed surface without a consistent orientation, `2mn` triangles.
pub fn klein_bottle(m: u32, n: u32) -> Mesh {
    closed_grid("klein bottle", m, n, true)
}

/// A strip of `2n` triangles whose ends meet turned over.
pub fn moebius(n: u32) -> Mesh {
    let id = |i: u32, side: u32| if i == n { 1 - side } else { 2 * i + side };
    let quad = |i| {
        [
            [id(i, 0), id(i + 1, 0), id(i + 1, 1)],
            [id(i, 0), id(i + 1, 1), id(i, 1)],
        ]
    };
    let point = |v: u32| {
        let angle = std::f32::consts::TAU * (v / 2) as f32 / n as f32;
        let out = (v % 2) as f32 - 0.5;
        let r = 2.0 + out * (angle / 2.0).cos();
        [r * angle.cos(), r * angle.sin(), out * (angle / 2.0).sin()]
    };
    Mesh::new(
        "moebius strip",
        (0..n).flat_map(quad).collect(),
        (0..2 * n).map(point).collect(),
    )
}

/// The projective plane with 6 vertices and 10 triangles: closed, every two vertices joined.
pub fn projective_plane() -> Mesh {
    let ring = |i: u32| 1 + i % 5;
    let inner = (0..5).map(|i| [0, ring(i), ring(i + 1)]);
    let outer = (0..5).map(|i| [ring(i), ring(i + 1), ring(i + 3)]);
    let mut random = Random::new(6);
    let positions = (0..6)
        .map(|_| [0; 3].map(|_| random.coordinate()))
        .collect();
    Mesh::new("projective plane", inner.chain(outer).collect(), positions)
}

/// `n` triangles that share the edge from 0 to 1.
pub fn fan_on_edge(n: u32) -> Mesh {
    let mut positions = vec![[0., 0., 0.], [0., 0., 1.]];
    let angle = |i: u32| std::f32::consts::TAU * i as f32 / n as f32;
    positions.extend((0..n).map(|i| [angle(i).cos(), angle(i).sin(), 0.5]));
    let triangles = (0..n).map(|i| [0, 1, 2 + i]).collect();
    Mesh::new(&format!("{n} triangles on an edge"), triangles, positions)
}

/// `n` triangles around vertex 0, closed: a disk of valence `n`.
pub fn disk(n: u32) -> Mesh {
    let mut positions = vec![[0., 0., 0.]];
    let angle = |i: u32| std::f32::consts::TAU * i as f32 / n as f32;
    positions.extend((0..n).map(|i| [angle(i).cos(), angle(i).sin(), 0.]));
    Mesh::new(
        "disk",
        (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect(),
        positions,
    )
}

/// `n` triangles that share nothing.
pub fn soup(n: u32) -> Mesh {
    let mut random = Random::new(u64::from(n));
    let positions = (0..3 * n)
        .map(|_| [0; 3].map(|_| random.coordinate()))
        .collect();
    Mesh::new(
        "soup",
        (0..n).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        positions,
    )
}

/// Any number of tetrahedra on the edge from 0 to 1: `2n` corners there, each pair cancelling.
pub fn tetrahedra_on_edge(n: u32) -> Mesh {
    let mut positions = vec![[0., 0., 0.], [0., 0., 1.]];
    let mut triangles = Vec::new();
    for i in 0..n {
        let angle = |k: u32| std::f32::consts::TAU * (2 * i + k) as f32 / (2 * n + 1) as f32;
        positions.extend([0, 1].map(|k| [angle(k).cos(), angle(k).sin(), 0.5]));
        let (a, b) = (2 + 2 * i, 3 + 2 * i);
        triangles.extend([[0, 1, a], [1, 0, b], [0, a, b], [1, b, a]]);
    }
    Mesh::new(&format!("{n} tetrahedra on an edge"), triangles, positions)
}
