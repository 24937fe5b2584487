//! Writers of meshes in the formats that the program reads.

use super::mesh::Mesh;
use super::npy;
use std::path::{Path, PathBuf};

/// Writes `V.npy` and `G.npy` (u4, f4) into `dir` and gives their paths.
pub fn write_npy(mesh: &Mesh, dir: &Path) -> (PathBuf, PathBuf) {
    let (v, g) = (dir.join("V.npy"), dir.join("G.npy"));
    npy::write(
        &v,
        "<u4",
        mesh.triangles.len(),
        3,
        &indices(mesh, |i| i.to_le_bytes().into()),
    );
    npy::write(
        &g,
        "<f4",
        mesh.positions.len(),
        3,
        &coordinates(mesh, |x| x.to_le_bytes().into()),
    );
    (v, g)
}

/// The triangles' indices in a row, each as `encode` writes it.
pub fn indices(mesh: &Mesh, encode: fn(u32) -> Vec<u8>) -> Vec<u8> {
    mesh.triangles
        .as_flattened()
        .iter()
        .flat_map(|&i| encode(i))
        .collect()
}

/// The coordinates in a row, each as `encode` writes it.
pub fn coordinates(mesh: &Mesh, encode: fn(f32) -> Vec<u8>) -> Vec<u8> {
    mesh.positions
        .as_flattened()
        .iter()
        .flat_map(|&x| encode(x))
        .collect()
}
