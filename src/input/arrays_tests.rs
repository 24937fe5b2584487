//! Arrays made byte by byte, good and bad.

use super::*;
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers};
use std::path::PathBuf;
use std::sync::Arc;

fn workspace(dir: &Path) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(8 << 20),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io).unwrap(),
        io,
        workers: Workers::new(1).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

fn npy_mesh(ws: &Workspace, request: &Request) -> Result<Mesh> {
    digested(ws, finish(ws, request, super::npy(ws, request)?, "npy")?)
}

fn raw_mesh(ws: &Workspace, request: &Request) -> Result<Mesh> {
    digested(ws, finish(ws, request, super::raw(ws, request)?, "raw")?)
}

fn request(path: PathBuf) -> Request {
    Request {
        path,
        positions: None,
        weld: None,
        coords: None,
        raw_index: None,
        endian: None,
        vertices: None,
        format: None,
        wide: false,
        g_path: PathBuf::from("unused"),
    }
}

/// A `.npy` file as NumPy writes it: version 1.0, header padded to 64 bytes.
/// With the digests, as if all passes were done.
fn digested(ws: &Workspace, mut mesh: Mesh) -> Result<Mesh> {
    mesh.entry = mesh.input_entry(ws)?;
    Ok(mesh)
}

fn npy(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let fortran = if fortran { "True" } else { "False" };
    let mut dict =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
    while !(10 + dict.len() + 1).is_multiple_of(64) {
        dict.push(' ');
    }
    dict.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dict.len() as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.extend(data);
    bytes
}

struct Bench {
    dir: tempfile::TempDir,
    ws: Workspace,
}

impl Bench {
    fn new() -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path());
        Bench { dir, ws }
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Opens V (and G) and returns the mesh or the message.
    fn npy(&self, v: &[u8], g: Option<&[u8]>, vertices: Option<u64>) -> Result<Mesh, String> {
        let mut request = request(self.file("v.npy", v));
        request.positions = g.map(|g| self.file("g.npy", g));
        request.vertices = vertices;
        npy_mesh(&self.ws, &request).map_err(|e| e.to_string())
    }

    fn raw(
        &self,
        v: usize,
        g: Option<usize>,
        vertices: Option<u64>,
        coords: Option<CoordKind>,
    ) -> Result<Mesh, String> {
        let mut request = request(self.file("v.bin", &vec![0; v]));
        request.raw_index = Some(IndexKind::I4);
        request.endian = Some(Endian::Big);
        request.positions = g.map(|g| self.file("g.bin", &vec![0; g]));
        request.vertices = vertices;
        request.coords = coords;
        raw_mesh(&self.ws, &request).map_err(|e| e.to_string())
    }
}

#[test]
fn npy_is_used_where_it_lies() {
    let bench = Bench::new();
    for (descr, kind, endian) in [
        ("<u4", IndexKind::U4, Endian::Little),
        (">u4", IndexKind::U4, Endian::Big),
        ("<u8", IndexKind::U8, Endian::Little),
        (">i4", IndexKind::I4, Endian::Big),
        ("<i8", IndexKind::I8, Endian::Little),
    ] {
        for shape in ["(2, 3)", "(6,)"] {
            let v = npy(descr, false, shape, &vec![1; 6 * kind.bytes() as usize]);
            let mesh = bench.npy(&v, None, None).unwrap();
            assert_eq!(
                (mesh.v.triangles, mesh.v.kind, mesh.v.endian),
                (2, kind, endian)
            );
            assert_eq!(mesh.v.at, v.len() as u64 - 6 * kind.bytes());
            assert!(matches!(mesh.v.source, Source::Named(_)));
            assert!(mesh.g.is_none() && mesh.vertices.is_none());
            assert_eq!(mesh.entry.files.len(), 1);
            assert_eq!(mesh.entry.files[0].bytes, v.len() as u64);
        }
    }
    assert_eq!(bench.ws.budget.used(), 0);
}

#[test]
fn npy_with_coordinates() {
    let bench = Bench::new();
    let v = npy("<u4", false, "(1, 3)", &[0; 12]);
    let g = npy(">f8", false, "(4, 3)", &[0; 96]);
    let mesh = bench.npy(&v, Some(&g), Some(4)).unwrap();
    let coords = mesh.g.unwrap();
    assert_eq!((coords.vertices, coords.kind), (4, CoordKind::F8));
    assert_eq!((coords.endian, coords.placed), (Endian::Big, false));
    assert_eq!(coords.at, g.len() as u64 - 96);
    assert_eq!(mesh.entry.files.len(), 2);
    assert_eq!(mesh.entry.format, "npy");
    let bad = bench.npy(&v, Some(&g), Some(5)).unwrap_err();
    assert!(
        bad.contains("5 vertices") && bad.contains("those of 4"),
        "{bad}"
    );
}

#[test]
fn empty_and_single_rows_have_no_order() {
    let bench = Bench::new();
    for shape in ["(0, 3)", "(0,)"] {
        let mesh = bench.npy(&npy("<u4", false, shape, &[]), None, None);
        assert_eq!(mesh.unwrap().v.triangles, 0);
    }
    let one = npy("<u4", true, "(1, 3)", &[0; 12]);
    assert_eq!(bench.npy(&one, None, None).unwrap().v.triangles, 1);
}

#[test]
fn refusals_say_what_was_found_and_how_to_convert() {
    let bench = Bench::new();
    let good = npy("<u4", false, "(1, 3)", &[0; 12]);
    let refuse = |v: &[u8], g: Option<&[u8]>, words: &[&str]| {
        let message = bench.npy(v, g, None).unwrap_err();
        for word in words {
            assert!(message.contains(word), "{message} lacks {word}");
        }
    };
    let v = |descr, fortran, shape, bytes: usize| npy(descr, fortran, shape, &vec![0; bytes]);
    refuse(
        &v("<u4", true, "(2, 3)", 24),
        None,
        &["Fortran", "np.ascontiguousarray"],
    );
    refuse(
        &v("<f4", false, "(2, 3)", 24),
        None,
        &["coordinates (G)", "--positions"],
    );
    refuse(
        &v("<i2", false, "(2, 3)", 12),
        None,
        &["type <i2 of shape (2,3)", "astype"],
    );
    refuse(&v("|O", false, "(2, 3)", 48), None, &["|O", "astype"]);
    refuse(
        &v("<u4", false, "(2, 4)", 32),
        None,
        &["(2,4)", "cut into triangles"],
    );
    refuse(
        &v("<u4", false, "(7,)", 28),
        None,
        &["7 is no multiple of 3"],
    );
    refuse(&v("<u4", false, "()", 4), None, &["shape ()"]);
    refuse(
        &v("<u4", false, "(1, 2, 3)", 24),
        None,
        &["(1,2,3)", "reshape"],
    );
    refuse(
        &v("<u4", false, "(2, 3)", 23),
        None,
        &["only 23 bytes", "cut short"],
    );
    let huge = v("<u8", false, "(9223372036854775807, 3)", 24);
    refuse(&huge, None, &["cut short"]);
    refuse(b"not numpy", None, &["NUMPY"]);
    refuse(b"", None, &["NUMPY"]);
    refuse(
        &good,
        Some(&v("<u4", false, "(2, 3)", 24)),
        &["(N,3)", "astype"],
    );
    refuse(
        &good,
        Some(&v("<f4", false, "(6,)", 24)),
        &["(6)", "reshape"],
    );
    refuse(
        &good,
        Some(&v("<f4", true, "(2, 3)", 24)),
        &["np.ascontiguousarray(G)"],
    );
    let mut nowhere = request(PathBuf::from("-"));
    let message = npy_mesh(&bench.ws, &nowhere).unwrap_err().to_string();
    assert!(message.contains("standard input"), "{message}");
    nowhere.path = bench.dir.path().to_owned();
    let message = npy_mesh(&bench.ws, &nowhere).unwrap_err().to_string();
    assert!(message.contains("a folder"), "{message}");
}

#[test]
fn truncated_npy_never_opens() {
    let bench = Bench::new();
    let whole = npy("<u4", false, "(2, 3)", &[7; 24]);
    for len in 0..whole.len() {
        assert!(
            bench.npy(&whole[..len], None, None).is_err(),
            "{len} bytes opened"
        );
    }
    bench.npy(&whole, None, None).unwrap();
}

#[test]
fn raw_lengths_decide() {
    let bench = Bench::new();
    let mesh = bench.raw(24, None, None, None).unwrap();
    assert_eq!((mesh.v.triangles, mesh.v.kind), (2, IndexKind::I4));
    assert_eq!((mesh.v.endian, mesh.v.at), (Endian::Big, 0));
    assert_eq!(
        bench.raw(24, None, Some(9), None).unwrap().vertices,
        Some(9)
    );
    let kind = |bytes, n, coords| {
        let mesh = bench.raw(12, Some(bytes), n, coords)?;
        Ok::<_, String>(mesh.g.map(|g| (g.kind, g.vertices, g.endian)).unwrap())
    };
    let (f4, f8, big) = (CoordKind::F4, CoordKind::F8, Endian::Big);
    assert_eq!(kind(48, None, Some(f4)), Ok((f4, 4, big)));
    assert_eq!(kind(48, None, Some(f8)), Ok((f8, 2, big)));
    assert_eq!(kind(48, Some(4), Some(f8)), Ok((f4, 4, big)));
    assert_eq!(kind(48, Some(2), None), Ok((f8, 2, big)));
    assert_eq!(kind(0, Some(0), None), Ok((f4, 0, big)));
    for (bytes, n, coords) in [
        (47, None, Some(f4)),
        (36, None, Some(f8)),
        (48, Some(3), None),
        (48, Some(0), None),
        (48, Some(u64::MAX), None),
    ] {
        let message = kind(bytes, n, coords).unwrap_err();
        assert!(message.contains(&format!("{bytes} bytes")), "{message}");
    }
    // 48 bytes are four vertices or two.
    let message = kind(48, None, None).unwrap_err();
    assert!(message.contains("--coords f4 or f8"), "{message}");
    let message = bench.raw(25, None, None, None).unwrap_err();
    assert!(
        message.contains("byte 24") && message.contains("--raw-index i4"),
        "{message}"
    );
    let untyped = raw_mesh(&bench.ws, &request(bench.file("v", b""))).unwrap_err();
    assert!(matches!(untyped, Error::Usage(_)));
}
