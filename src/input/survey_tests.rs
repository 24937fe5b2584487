//! Surveys against what the same files decode to.

use super::*;
use crate::input::{Endian, IndexKind, open, testing};

/// The survey of a file of this name and content, and what is opened of it.
fn both(name: &str, data: &[u8], change: fn(&mut Request)) -> (Survey, [u64; 2]) {
    let dir = tempfile::tempdir().unwrap();
    let ws = testing::workspace(dir.path(), 4 << 20);
    let path = dir.path().join(name);
    std::fs::write(&path, data).unwrap();
    let mut request = testing::request(dir.path(), &path);
    change(&mut request);
    let surveyed = survey(&request).unwrap();
    assert_eq!(surveyed.input_bytes, data.len() as u64);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    let mesh = open(&ws, &request).unwrap();
    assert_eq!(mesh.welded, surveyed.welded);
    assert_eq!(mesh.entry.format, surveyed.format.name());
    assert_eq!(mesh.g.as_ref().map(|g| g.kind), surveyed.coords);
    let vertices = mesh.g.as_ref().map_or(0, |g| g.vertices);
    (surveyed, [mesh.v.triangles, vertices])
}

fn refused(name: &str, data: &[u8]) -> Error {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, data).unwrap();
    survey(&testing::request(dir.path(), &path)).unwrap_err()
}

const ROWS: &str = "element vertex 5\nproperty float x\nproperty double y\nproperty float z\n\
    element face 2\nproperty list uchar short vertex_index\nend_header\n";

fn ply(format: &str, rows: &str, data: &[u8]) -> Vec<u8> {
    let mut file = format!("ply\nformat {format} 1.0\n{rows}").into_bytes();
    file.extend(data);
    file
}

/// Five vertices, a quad and a triangle.
fn binary_rows() -> Vec<u8> {
    let mut data = vec![0; 5 * 16];
    data.extend([4, 0, 0, 1, 0, 2, 0, 3, 0, 3, 0, 0, 1, 0, 4, 0]);
    data
}

#[test]
fn binary_ply_is_exact_with_polygons_too() {
    let file = ply("binary_little_endian", ROWS, &binary_rows());
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!(
        (opened, surveyed.triangles, surveyed.exact),
        ([3, 5], 3, true)
    );
    assert_eq!(surveyed.vertices, Some(5));
    assert_eq!((surveyed.v_row, surveyed.rows), (12, Some([12, 24])));
    assert_eq!(surveyed.least, [3, 5]);
    // A second list: nobody knows whose bytes they are, but some rows tell.
    let rows = ROWS.replace("end_h", "property list uchar uchar flags\nend_h");
    let mut data = binary_rows();
    data.insert(5 * 16 + 9, 0);
    data.push(0);
    let file = ply("binary_little_endian", &rows, &data);
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!(
        (opened, surveyed.triangles, surveyed.exact),
        ([3, 5], 3, false)
    );
}

#[test]
fn strips_are_estimated() {
    let rows = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let file = ply("ascii", rows, b"0 0 0\n1 0 0\n0 1 0\n5 0 1 2 0 1\n");
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!(opened, [3, 3]);
    assert!(!surveyed.exact && surveyed.triangles.abs_diff(3) <= 40);
    let mut data = vec![0; 36];
    for word in [5, 0, 1, 2, 0, 1] {
        data.extend(u32::to_le_bytes(word));
    }
    let file = ply("binary_little_endian", rows, &data);
    let (surveyed, _) = both("a", &file, |_| {});
    assert_eq!((surveyed.triangles, surveyed.exact), (3, false));
}

#[test]
fn faces_among_other_rows_are_counted() {
    let rows = "element face 2\nproperty list uchar short vertex_index\n\
        element vertex 5\nproperty float x\nproperty double y\nproperty float z\nend_header\n";
    let mut data = binary_rows();
    data.rotate_left(5 * 16);
    let file = ply("binary_little_endian", rows, &data);
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!(
        (opened, surveyed.triangles, surveyed.exact),
        ([3, 5], 3, true)
    );
    let text = b"4 0 1 2 3\n3 0 1 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n";
    let (surveyed, opened) = both("a", &ply("ascii", rows, text), |_| {});
    assert_eq!((opened, surveyed.triangles), ([3, 5], 3));
    // Strips too.
    let strips = "element tristrips 1\nproperty list int short vertex_index\nend_header\n";
    let rows = rows.replace("end_header\n", strips);
    data.extend([4, 0, 0, 0, 0, 0, 1, 0, 2, 0, 3, 0]);
    let file = ply("binary_little_endian", &rows, &data);
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!(opened, [5, 5]);
    assert!(
        !surveyed.exact && surveyed.triangles.abs_diff(5) <= 1,
        "{surveyed:?}"
    );
    assert_eq!(surveyed.least, [2, 5]);
}

#[test]
fn texts_are_estimated_by_their_faces() {
    let quads = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n4 0 1 2 3\n4 0 1 2 4\n";
    let file = ply("ascii", ROWS, quads.as_bytes());
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!(
        (opened, surveyed.triangles, surveyed.exact),
        ([4, 5], 4, false)
    );
    let off = format!("\u{feff}OFF\n5 2 0\n{quads}");
    let (surveyed, opened) = both("a", off.as_bytes(), |_| {});
    assert_eq!((opened, surveyed.triangles), ([4, 5], 4));
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nv 0 1 0\nf 1 2/1 3//1 4\nfo 1 2 3\n";
    let (surveyed, opened) = both("a", obj.as_bytes(), |_| {});
    assert_eq!((opened, surveyed.triangles), ([3, 4], 3));
    assert_eq!(surveyed.vertices, Some(4));
    let (surveyed, _) = both("a", obj.as_bytes(), |r| {
        (r.weld, r.coords, r.wide) = (Some(true), Some(CoordKind::F8), true);
    });
    assert_eq!((surveyed.v_row, surveyed.rows), (24, Some([24, 24])));
}

#[test]
fn meshes_without_faces_have_no_triangles() {
    let rows = "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
        element face 0\nproperty list uchar int vertex_index\nend_header\n";
    let (surveyed, opened) = both("a", &ply("ascii", rows, b""), |_| {});
    assert_eq!((opened, surveyed.triangles), ([0, 0], 0));
    let file = ply("binary_big_endian", rows, &[]);
    let (surveyed, opened) = both("a", &file, |_| {});
    assert_eq!((opened, surveyed.triangles), ([0, 0], 0));
    assert!(surveyed.exact);
}

#[test]
fn stl_in_both_forms() {
    let facet = "facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n \
        endloop\nendfacet\n";
    let text = format!("solid\n{facet}{facet}endsolid\n");
    let mut binary = vec![b' '; 80];
    binary.extend(2u32.to_le_bytes());
    binary.resize(184, 0);
    for data in [text.as_bytes(), &binary] {
        let (surveyed, opened) = both("a.stl", data, |_| {});
        assert_eq!((opened[0], surveyed.triangles), (2, 2));
        assert!(surveyed.welded && surveyed.rows.is_none() && !surveyed.exact);
    }
}

#[test]
fn arrays_are_exact() {
    let ids: Vec<u8> = [0u64, 1, 2, 2, 1, 3].map(u64::to_be_bytes).concat();
    let raw = |r: &mut Request| {
        (r.raw_index, r.endian) = (Some(IndexKind::I8), Some(Endian::Big));
        r.vertices = Some(9);
    };
    let (surveyed, opened) = both("v", &ids, raw);
    assert_eq!((opened[0], surveyed.triangles), (2, 2));
    assert_eq!((surveyed.vertices, surveyed.exact), (Some(9), true));
    assert_eq!((surveyed.v_row, surveyed.rows), (24, Some([24, 0])));
    assert!(!surveyed.decoded && surveyed.coords.is_none());
}

#[test]
fn what_cannot_be_is_refused() {
    for (name, data, part) in [
        ("a", &b""[..], "an empty file"),
        ("a.ply", b"solid", "the word `ply`"),
        (
            "a.off",
            b"OFF\n353535235358 6 0\n0 0 0\n",
            "2121211412196 bytes",
        ),
        (
            "a.off",
            b"OFF\n0 18446744073709551615 0\n",
            "the number of faces",
        ),
        ("a.obj", b"\xff\xfev\0", "UTF-16"),
    ] {
        let text = refused(name, data).to_string();
        assert!(text.contains(part), "{text}");
    }
    for format in ["ascii", "binary_big_endian"] {
        let rows = ROWS.replace("vertex 5", "vertex 18446744073709551615");
        let text = refused("a", &ply(format, &rows, &binary_rows())).to_string();
        assert!(text.contains("at least 184467440737095516"), "{text}");
        let whole = ply(format, ROWS, &binary_rows()[..12]);
        assert!(refused("a", &whole).to_string().contains("found 12 bytes"));
    }
    let request = testing::request(Path::new("."), Path::new("-"));
    assert!(matches!(survey(&request), Err(Error::Usage(_))));
}
