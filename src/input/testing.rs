//! What the unit tests of the readers share: a workspace, and a mesh read back into memory.

use super::{CoordKind, IndexKind, Mesh, Request};
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A workspace in `dir` with `memory` bytes.
pub fn workspace(dir: &Path, memory: u64) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.to_owned()], 1 << 40, &io).unwrap(),
        io,
        workers: Workers::new(2).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

/// A plain request for `path`, whose G goes to a file in `dir` that does not exist yet.
pub fn request(dir: &Path, path: &Path) -> Request {
    let fresh = |n: u32| dir.join(format!("G{n}.npy"));
    let free: Option<PathBuf> = (0..).map(fresh).find(|p| !p.exists());
    Request {
        path: path.to_owned(),
        positions: None,
        weld: None,
        coords: None,
        raw_index: None,
        endian: Default::default(),
        vertices: None,
        format: None,
        wide: false,
        g_path: free.unwrap(),
    }
}

/// The indices of a mesh decoded by us (little-endian).
pub fn triangles(mesh: &Mesh) -> Vec<[u64; 3]> {
    let width = match mesh.v.kind {
        IndexKind::U4 | IndexKind::I4 => 4,
        IndexKind::U8 | IndexKind::I8 => 8,
    };
    let mut bytes = vec![0; mesh.v.triangles as usize * 3 * width];
    mesh.v.source.data().read_at(&mut bytes, mesh.v.at).unwrap();
    let ids: Vec<u64> = bytes
        .chunks_exact(width)
        .map(|b| b.iter().rev().fold(0, |v, &b| v << 8 | u64::from(b)))
        .collect();
    ids.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect()
}

/// The bits of the coordinates of a mesh decoded by us (little-endian).
pub fn bits(mesh: &Mesh) -> Vec<u64> {
    let g = mesh.g.as_ref().unwrap();
    let width = match g.kind {
        CoordKind::F4 => 4,
        CoordKind::F8 => 8,
    };
    let mut bytes = vec![0; g.vertices as usize * 3 * width];
    g.source.data().read_at(&mut bytes, g.at).unwrap();
    assert_eq!(g.source.data().len().unwrap(), g.at + bytes.len() as u64);
    bytes
        .chunks_exact(width)
        .map(|b| b.iter().rev().fold(0, |v, &b| v << 8 | u64::from(b)))
        .collect()
}

/// The coordinates of a mesh decoded by us, as f64.
pub fn coords(mesh: &Mesh) -> Vec<f64> {
    let kind = mesh.g.as_ref().unwrap().kind;
    let value = |&b: &u64| match kind {
        CoordKind::F4 => f64::from(f32::from_bits(b as u32)),
        CoordKind::F8 => f64::from_bits(b),
    };
    bits(mesh).iter().map(value).collect()
}
