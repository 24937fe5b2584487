//! The readers of mesh files. What they accept must name no vertex that is not there.

use super::place::{Place, sane};
use super::whole;
use cornermill::input::{self, CoordKind, Format, IndexKind, Mesh, Request};
use std::cell::OnceCell;
use std::path::Path;

/// Bytes of budget: enough for every buffer, not for a header's claim.
const MEMORY: u64 = 2 << 20;
/// The first bytes of an `.npy` file.
const NUMPY: &[u8] = b"\x93NUMPY";

/// PLY, ascii and binary.
pub fn ply(data: &[u8]) {
    read(Format::Ply, data);
}

/// STL, ascii and binary.
pub fn stl(data: &[u8]) {
    read(Format::Stl, data);
}

/// OBJ.
pub fn obj(data: &[u8]) {
    read(Format::Obj, data);
}

/// OFF.
pub fn off(data: &[u8]) {
    read(Format::Off, data);
}

/// `.npy` arrays: V, and G from where a second array begins; bytes that begin otherwise are a raw
/// V of a type that the first byte tells. Arrays are read by the build, so all of it runs.
pub fn npy(data: &[u8]) {
    let second = data.windows(NUMPY.len()).skip(1).position(|w| w == NUMPY);
    let (v, g) = match second {
        Some(at) => data.split_at(at + 1),
        None => (data, &[][..]),
    };
    whole::build_with(
        "V.npy",
        v,
        Some(g).filter(|g| !g.is_empty()),
        |builder| match v.split_first() {
            Some((first, _)) if !v.starts_with(&NUMPY[..1]) => {
                let kinds = [IndexKind::U4, IndexKind::U8, IndexKind::I4, IndexKind::I8];
                let builder = builder.raw_index(kinds[usize::from(first % 4)]);
                builder.format(Format::Raw)
            }
            _ => builder.format(Format::Npy),
        },
    );
}

thread_local! {
    static PLACE: OnceCell<Place> = const { OnceCell::new() };
}

/// Reads a file of this format, by options that its length tells.
fn read(format: Format, data: &[u8]) {
    PLACE.with(|place| {
        let place = place.get_or_init(|| Place::new(MEMORY));
        let path = place.put("mesh", data);
        let request = request(&path, format, data.len(), place.path("G.npy").as_path());
        if let Err(error) = input::survey(&request) {
            sane(&error);
        }
        match input::open(&place.ws, &request) {
            Ok(mesh) => check(&mesh, data.len()),
            Err(error) => sane(&error),
        }
        place.clear("G.npy");
        place.settled();
    });
}

fn request(path: &Path, format: Format, length: usize, g: &Path) -> Request {
    Request {
        path: path.to_owned(),
        positions: None,
        weld: (length % 4 == 2).then_some(true),
        coords: (length % 4 == 1).then_some(CoordKind::F8),
        raw_index: None,
        endian: Default::default(),
        vertices: None,
        format: Some(format),
        wide: length % 4 == 3,
        g_path: g.to_owned(),
    }
}

/// Holds what was read to itself.
fn check(mesh: &Mesh, length: usize) {
    let width = match mesh.v.kind {
        IndexKind::U4 | IndexKind::I4 => 4,
        IndexKind::U8 | IndexKind::I8 => 8,
    };
    let vertices = mesh.g.as_ref().map(|g| g.vertices).or(mesh.vertices);
    let vertices = vertices.expect("a file says how many vertices it has");
    assert_eq!(mesh.entry.files[0].bytes, length as u64);
    assert!(
        mesh.v.triangles <= length as u64,
        "more triangles than bytes"
    );
    let mut ids = vec![0; mesh.v.triangles as usize * 3 * width];
    let file = mesh.v.source.data();
    file.read_at(&mut ids, mesh.v.at).expect("V reads back");
    for id in ids.chunks_exact(width) {
        let id = id.iter().rev().fold(0u64, |v, &b| v << 8 | u64::from(b));
        assert!(id < vertices, "index {id} of {vertices} vertices");
    }
    if let Some(g) = &mesh.g {
        let row = if g.kind == CoordKind::F8 { 24 } else { 12 };
        let end = g.at + g.vertices * row;
        assert!(g.source.data().len().expect("a length") >= end, "G is cut");
    }
}
