//! What the unit tests of the readers share: a workspace, and a mesh read back into memory.

use super::reader::ByteReader;
use super::{CoordKind, IndexKind, Mesh, Request};
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use crate::error::{Error, Result};
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

/// What a mesh decodes to: triangles, bits and type of the coordinates, polygons fanned.
#[derive(Debug, PartialEq)]
pub struct Decoded {
    pub triangles: Vec<[u64; 3]>,
    pub bits: Vec<u64>,
    pub kind: CoordKind,
    pub fanned: u64,
}

/// A reader of one of the formats.
pub type Read = fn(&Workspace, ByteReader, &Request) -> Result<Mesh>;

/// Decodes `data`, coming `step` bytes at a time, and sees that nothing stays leased.
pub fn decode(read: Read, data: &[u8], step: usize, coords: Option<CoordKind>) -> Result<Decoded> {
    decode_as(read, data, step, |request| request.coords = coords)
}

/// As [`decode`], by a changed request.
pub fn decode_as(
    read: Read,
    data: &[u8],
    step: usize,
    change: impl FnOnce(&mut Request),
) -> Result<Decoded> {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(dir.path(), 200 << 10);
    let source = Dripping(std::io::Cursor::new(data.to_vec()), step);
    let reader = ByteReader::new(&ws, Box::new(source), "mesh".into(), None)?;
    let mut request = request(dir.path(), dir.path());
    change(&mut request);
    let result = read(&ws, reader, &request).map(|mesh| {
        assert_eq!(mesh.entry.files[0].bytes, data.len() as u64);
        Decoded {
            triangles: triangles(&mesh),
            bits: bits(&mesh),
            kind: mesh.g.as_ref().unwrap().kind,
            fanned: mesh.polygons_fanned,
        }
    });
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    result
}

/// Gives at most so many bytes at a time.
pub struct Dripping(pub std::io::Cursor<Vec<u8>>, pub usize);

impl std::io::Read for Dripping {
    fn read(&mut self, buf: &mut [u8]) -> std::io::Result<usize> {
        let n = buf.len().min(self.1);
        self.0.read(&mut buf[..n])
    }
}

/// The message of a failed decoding, which must hold every one of `parts`.
pub fn refused(read: Read, data: &[u8], parts: &[&str]) {
    let message = match decode(read, data, usize::MAX, None) {
        Ok(decoded) => panic!("{} gave {decoded:?}", String::from_utf8_lossy(data)),
        Err(Error::Input(bad)) => bad.to_string(),
        Err(other) => panic!("{other}"),
    };
    for part in parts {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

/// Cuts `data` at every byte: an error of the input, or from byte `whole` on the whole mesh.
pub fn truncated(read: Read, data: &[u8], whole: usize) {
    let right = decode(read, data, usize::MAX, None).unwrap();
    assert_eq!(decode(read, data, 1, None).unwrap(), right, "byte by byte");
    for len in 0..data.len() {
        match decode(read, &data[..len], 7, None) {
            Ok(mesh) => {
                assert!(len >= whole, "cut at {len} of {} is accepted", data.len());
                assert_eq!(mesh, right, "cut at {len}");
            }
            Err(Error::Input(_)) => assert!(len < whole, "cut at {len} is refused"),
            Err(other) => panic!("cut at {len}: {other}"),
        }
    }
}
