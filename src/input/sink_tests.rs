//! The sink at its limits.

use super::*;
use crate::input::testing;

fn digest() -> InputDigest {
    InputDigest {
        bytes: 0,
        xxh3: String::new(),
    }
}

#[test]
fn widens_once_by_id_or_by_number_of_corners() {
    let dir = tempfile::tempdir().unwrap();
    // A tight budget, so that widening takes many blocks.
    let ws = testing::workspace(dir.path(), 100 << 10);
    for (limit, big, kind) in [
        (u64::MAX, 0, IndexKind::U4),
        (u64::MAX, 1 << 40, IndexKind::U8),
        (u64::MAX, NARROW_IDS - 1, IndexKind::U4),
        (u64::MAX, NARROW_IDS, IndexKind::U8),
        (4999, 0, IndexKind::U8),
        (5000, 0, IndexKind::U4),
    ] {
        let request = testing::request(dir.path(), dir.path());
        let mut sink = MeshSink::new(&ws, &request, dir.path(), CoordKind::F4).unwrap();
        sink.narrow_triangles = sink.narrow_triangles.min(limit);
        let mesh: Vec<[u64; 3]> = (0..5000u64)
            .map(|t| [t, t * 7, if t == 4000 { big } else { 1 }])
            .collect();
        mesh.iter().for_each(|&t| sink.triangle(t).unwrap());
        sink.flush_v().unwrap();
        let mesh_back = sink.into_mesh("test", digest()).unwrap();
        assert_eq!(mesh_back.v.kind, kind, "{limit} {big}");
        assert_eq!(testing::triangles(&mesh_back), mesh);
        assert!(testing::bits(&mesh_back).is_empty());
    }
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
}

#[test]
fn coordinates_keep_their_bits_or_are_converted_on_request() {
    let dir = tempfile::tempdir().unwrap();
    let ws = testing::workspace(dir.path(), 100 << 10);
    let signalling = f32::from_bits(0x7fa0_1234);
    let make = |coords, at: [f64; 3]| {
        let mut request = testing::request(dir.path(), dir.path());
        request.coords = coords;
        let mut sink = MeshSink::new(&ws, &request, dir.path(), CoordKind::F4)?;
        for _ in 0..3000 {
            sink.vertex4([signalling, -0.0, 1.0])?;
        }
        sink.vertex8(at)?;
        sink.finish(&ws, "test", digest())
    };
    let mesh = make(None, [0.1, f64::INFINITY, 1.0]).unwrap();
    let bits = testing::bits(&mesh);
    assert_eq!(bits[8997..9000], [0x7fa0_1234, 0x8000_0000, 0x3f80_0000]);
    assert_eq!(bits[9000], u64::from(0.1f32.to_bits()));
    let mesh = make(Some(CoordKind::F8), [0.1, f64::INFINITY, 1.0]).unwrap();
    assert_eq!(testing::bits(&mesh)[9000], 0.1f64.to_bits());
    let mut request = testing::request(dir.path(), dir.path());
    request.weld = Some(true);
    let mut sink = MeshSink::new(&ws, &request, dir.path(), CoordKind::F4).unwrap();
    sink.vertex4([signalling, 2.0, 3.0]).unwrap();
    let mesh = sink.finish(&ws, "test", digest()).unwrap();
    assert_eq!(testing::bits(&mesh)[0], 0x7fa0_1234);
    assert!(!mesh.g.unwrap().placed && !request.g_path.exists());
    let error = make(None, [0.0, 1e39, 1.0]).unwrap_err().to_string();
    assert!(
        error.contains("vertex 3000") && error.contains("1e39"),
        "{error}"
    );
}

#[test]
fn fans_polygons_and_names_faces_too_small() {
    let dir = tempfile::tempdir().unwrap();
    let ws = testing::workspace(dir.path(), 1 << 20);
    let request = testing::request(dir.path(), dir.path());
    let mut sink = MeshSink::new(&ws, &request, dir.path(), CoordKind::F4).unwrap();
    for face in [&[5, 6, 7][..], &[1, 2, 3, 4, 9], &[0, 0, 0, 0]] {
        sink.begin_face();
        face.iter().for_each(|&v| sink.corner(v).unwrap());
        sink.end_face(String::new).unwrap();
    }
    sink.begin_face();
    sink.corner(1).unwrap();
    let error = sink.end_face(|| "line 7".into()).unwrap_err().to_string();
    assert!(error.contains("line 7: expected a face of at least 3 corners, found 1 corner"));
    for _ in 0..10 {
        sink.vertex4([0.0; 3]).unwrap();
    }
    let mesh = sink.finish(&ws, "test", digest()).unwrap();
    assert_eq!(mesh.polygons_fanned, 2);
    let (a, b) = ([0, 0, 0], [5, 6, 7]);
    let fan = [b, [1, 2, 3], [1, 3, 4], [1, 4, 9], a, a];
    assert_eq!(testing::triangles(&mesh), fan);
}

#[test]
fn the_first_index_without_vertex_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let ws = testing::workspace(dir.path(), 100 << 10);
    for big in [3, u64::from(u32::MAX), 1 << 40] {
        let request = testing::request(dir.path(), dir.path());
        let mut sink = MeshSink::new(&ws, &request, dir.path(), CoordKind::F4).unwrap();
        (0..3).for_each(|_| sink.vertex4([0.0; 3]).unwrap());
        (0..5000).for_each(|_| sink.triangle([0, 1, 2]).unwrap());
        sink.triangle([0, big, 2]).unwrap();
        sink.triangle([0, 1, big + 1]).unwrap();
        let error = sink.finish(&ws, "test", digest()).unwrap_err().to_string();
        assert!(
            error.contains("triangle 5000, corner 1: expected"),
            "{error}"
        );
        assert!(error.contains(&format!("found {big};")), "{error}");
    }
}
