//! Formats, and options that do not go together.

use super::*;
use crate::input::{CoordKind, IndexKind, testing};

/// What becomes of a file of this name and content, under a changed request.
fn opened(name: &str, data: &[u8], change: fn(&mut Request)) -> Result<Mesh> {
    let dir = tempfile::tempdir().unwrap();
    let ws = testing::workspace(dir.path(), 1 << 20);
    let path = dir.path().join(name);
    std::fs::write(&path, data).unwrap();
    let mut request = testing::request(dir.path(), &path);
    change(&mut request);
    open(&ws, &request)
}

fn message(name: &str, data: &[u8], change: fn(&mut Request)) -> String {
    opened(name, data, change).unwrap_err().to_string()
}

const PLY: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n\
    property float y\nproperty float z\nelement face 0\nproperty list int int vertex_index\n\
    end_header\n";
const OBJ: &[u8] = b"# c\n\nv 0 0 0\nf 1 1 1\n";
const OFF: &[u8] = b"OFF 1 1 0\n0 0 0\n3 0 0 0\n";

#[test]
fn formats_by_name_and_by_content() {
    for (name, data, format) in [
        ("a.ply", PLY, "ply"),
        ("a.PLY", PLY, "ply"),
        ("a.obj", PLY, "ply"),
        ("a", PLY, "ply"),
        ("a.obj", OBJ, "obj"),
        ("a.txt", OBJ, "obj"),
        ("a.obj", &[b"\xef\xbb\xbf", OBJ].concat(), "obj"),
        ("a", &[b"\xef\xbb\xbf", OBJ].concat(), "obj"),
        ("a.off", OFF, "off"),
        ("a", OFF, "off"),
        ("a", b"STCNOFF 0 0 0\n", "off"),
    ] {
        let mesh = opened(name, data, |_| {}).unwrap();
        assert_eq!(mesh.entry.format, format, "{name}");
        assert_eq!(mesh.entry.files[0].bytes, data.len() as u64);
    }
    let mesh = opened("a.ply", OBJ, |r| r.format = Some(Format::Obj)).unwrap();
    assert_eq!(mesh.entry.format, "obj");
    let wide = |r: &mut Request| (r.wide, r.coords) = (true, Some(CoordKind::F8));
    let mesh = opened("a.obj", OBJ, wide).unwrap();
    assert_eq!(mesh.v.kind, IndexKind::U8);
    assert_eq!(mesh.g.unwrap().kind, CoordKind::F8);
}

#[test]
fn what_is_no_mesh_is_said_plainly() {
    let none = |_: &mut Request| {};
    for name in ["a.ply", "a.obj", "a.off", "a.stl", "a"] {
        assert!(message(name, b"", none).contains("found an empty file"));
    }
    let text = message("a.glb", b"glTF\x02\0\0\0", none);
    assert!(text.contains("PLY, STL, OBJ, OFF") && text.contains("`glTF\\u{2}\\u{0}"));
    assert!(message("a.ply", OBJ, none).contains("expected the word `ply`"));
    for data in [&b"\xfe\xff\0v"[..], b"\xff\xfev\0"] {
        assert!(message("a.obj", data, none).contains("found UTF-16"));
    }
    let folder = message("a", b"", |r| {
        r.path.pop();
    });
    assert!(folder.contains("directory"), "{folder}");
}

#[test]
fn options_that_do_not_go_together() {
    let usage = |name: &str, data: &[u8], change: fn(&mut Request), part: &str| match opened(
        name, data, change,
    ) {
        Err(Error::Usage(text)) => assert!(text.contains(part), "{text}"),
        other => panic!("{other:?}"),
    };
    let stl = b"solid\nendsolid\n";
    usage(
        "a.stl",
        stl,
        |r| r.weld = Some(false),
        "three points of its own",
    );
    usage(
        "a",
        stl,
        |r| r.weld = Some(false),
        "three points of its own",
    );
    usage(
        "a.obj",
        OBJ,
        |r| r.positions = Some("x".into()),
        "--positions",
    );
    usage("a.obj", OBJ, |r| r.vertices = Some(3), "--vertices");
    usage("a", b"", |r| r.format = Some(Format::Raw), "--raw-index");
    let both = |r: &mut Request| {
        (r.format, r.raw_index) = (Some(Format::Ply), Some(IndexKind::U4));
    };
    usage("a.ply", PLY, both, "--raw-index is for raw");
    let raw = |r: &mut Request| {
        (r.path, r.raw_index) = ("-".into(), Some(IndexKind::U4));
    };
    usage("a", b"", raw, "standard input");
    let npy = |r: &mut Request| {
        (r.path, r.format) = ("-".into(), Some(Format::Npy));
    };
    usage("a", b"", npy, "standard input");
}

/// Every byte changed to what hurts most: any end is right that is no panic.
#[test]
fn damage_at_every_byte_never_panics() {
    let binary = b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty char x\n\
        property char y\nproperty double z\nelement face 1\n\
        property list uchar int vertex_index\nproperty list char char l\nend_header\n\
        ab12345678\x04\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x01x";
    let stl = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
        vertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let dir = tempfile::tempdir().unwrap();
    let ws = testing::workspace(dir.path(), 4 << 20);
    let path = dir.path().join("mesh");
    for data in [&binary[..], PLY, OBJ, OFF, stl] {
        let request = testing::request(dir.path(), &path);
        std::fs::write(&path, data).unwrap();
        open(&ws, &request).unwrap();
        for at in 0..data.len() {
            for byte in *b"\xff-9\n\\" {
                let mut data = data.to_vec();
                data[at] = byte;
                std::fs::write(&path, &data).unwrap();
                std::fs::remove_file(&request.g_path).ok();
                open(&ws, &request).ok();
            }
        }
    }
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
}
