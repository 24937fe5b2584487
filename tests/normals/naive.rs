//! Normals by brute force: for each triangle in turn, its cross product is added at its vertices.

use crate::common::folder::Folder;

/// What the folder's normals must be.
pub struct Expected {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[f64; 3]>,
    /// Vertices whose sum is zero.
    pub zero: u64,
    /// Triangles with three different vertices of which one is not finite.
    pub nonfinite: u64,
}

pub fn expected(folder: &Folder) -> Expected {
    let triangles = folder.v.shape[0];
    sum(folder, 0..triangles)
}

impl Expected {
    /// The same, added from the last triangle to the first: not what is to be computed.
    pub fn backward(folder: &Folder) -> Expected {
        let triangles = folder.v.shape[0];
        sum(folder, (0..triangles).rev())
    }
}

fn sum(folder: &Folder, order: impl Iterator<Item = usize>) -> Expected {
    let v: Vec<usize> = folder.v.ids().iter().map(|&id| id as usize).collect();
    let g = positions(folder);
    let mut sums = vec![[0f64; 3]; g.len()];
    let mut triangles = vec![[0f64; 3]; v.len() / 3];
    let mut nonfinite = 0;
    for t in order {
        let corner = &v[3 * t..3 * t + 3];
        let [a, b, c] = [g[corner[0]], g[corner[1]], g[corner[2]]];
        if corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0] {
            continue;
        }
        if [a, b, c].iter().flatten().any(|x| !x.is_finite()) {
            nonfinite += 1;
            continue;
        }
        let side = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
        let (p, q) = (side(b), side(c));
        let cross = [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ];
        triangles[t] = direction(cross);
        for &id in corner {
            for k in 0..3 {
                sums[id][k] += cross[k];
            }
        }
    }
    let zero = sums.iter().filter(|sum| **sum == [0.0; 3]).count() as u64;
    let vertices = sums.into_iter().map(direction).collect();
    Expected {
        vertices,
        triangles,
        zero,
        nonfinite,
    }
}

fn direction(x: [f64; 3]) -> [f64; 3] {
    let length = x[0].hypot(x[1]).hypot(x[2]);
    if length == 0.0 {
        [0.0; 3]
    } else {
        x.map(|x| x / length)
    }
}

fn positions(folder: &Folder) -> Vec<[f64; 3]> {
    let g = folder.g.as_ref().expect("coordinates");
    let number = |b: &[u8]| match b.len() {
        4 => f64::from(f32::from_le_bytes(b.try_into().unwrap())),
        _ => f64::from_le_bytes(b.try_into().unwrap()),
    };
    let size = g.row_bytes();
    let numbers: Vec<f64> = g.data.chunks_exact(size).map(number).collect();
    numbers.chunks(3).map(|p| [p[0], p[1], p[2]]).collect()
}
