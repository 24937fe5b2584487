//! PLY files that must be refused, and by what message.

use super::tests::{AT, FACES, XYZ, ascii_tetra, binary_tetra, good, header};
use super::*;
use crate::input::testing::{decode, refused};

#[test]
fn text_rows_are_held_to_their_lines() {
    let text = ascii_tetra();
    for (from, to, parts) in [
        (
            "1 0 0\n",
            "1 0\n",
            &["line 11", "a coordinate", "the end of the line"][..],
        ),
        ("1 0 0\n", "1 0 0 7\n", &["line 11", "vertex 1 of 4", "`7`"]),
        ("1 0 0\n", "1 zero 0\n", &["line 11", "`zero`"]),
        (
            "1 0 0\n",
            "1 1e39 0\n",
            &["line 11", "`1e39`", "--coords f8"],
        ),
        ("3 0 3 1\n", "3 0 -3 1\n", &["line 15", "found -3"]),
        (
            "3 0 3 1\n",
            "2 0 3\n",
            &["line 15", "at least 3", "2 corners"],
        ),
        (
            "3 0 3 1\n",
            "-3 0 3 1\n",
            &["line 15", "corners, not negative"],
        ),
        (
            "3 0 3 1\n",
            "4 0 3 1\n",
            &["line 15", "the end of the line"],
        ),
        ("3 0 3 1\n", "3 0 3 1 1\n", &["line 15", "`1`"]),
        ("3 0 3 1\n", "3 0 3.5 1\n", &["line 15", "`3.5`"]),
        (
            "3 1 3 2\n",
            "3 1 3 2\n3 1 2 0\n",
            &["line 18", "the end of the file", "`3`"],
        ),
        (
            "3 1 3 2\n",
            "",
            &["expected face 3 of 4", "the end of the input"],
        ),
    ] {
        assert!(text.contains(from));
        refused(read, text.replace(from, to).as_bytes(), parts);
    }
    let unused = text
        .replace("element face", "property uchar red\nelement face")
        .replace("0 0\n", "0 0 1 2 3\n")
        .replace("1.5 0\n", "1.5 0 1\n")
        .replace("-2\n", "-2 1\n");
    assert_eq!(good(unused.as_bytes()), good(text.as_bytes()));
    let spaced = text.replace("1 0 0\n", "\n \n\t1  0 0 \n") + "\n \n";
    assert_eq!(good(spaced.as_bytes()), good(text.as_bytes()));
    let wide = decode(read, text.as_bytes(), 5, Some(CoordKind::F8)).unwrap();
    let right: Vec<u64> = AT
        .as_flattened()
        .iter()
        .map(|&c| f64::from(c).to_bits())
        .collect();
    assert_eq!((wide.bits, wide.kind), (right, CoordKind::F8));
}

#[test]
fn binary_faces_that_cannot_be() {
    let data = binary_tetra(false, false, false);
    let faces = data.len() - 52;
    let with = |at: usize, bytes: &[u8]| {
        let mut data = data.clone();
        data[at..at + bytes.len()].copy_from_slice(bytes);
        data
    };
    let byte = format!("byte {}", faces + 13);
    refused(
        read,
        &with(faces + 13, &[2]),
        &[&byte, "face 1 of 4", "2 corners"],
    );
    refused(read, &with(faces + 13, &[0]), &[&byte, "0 corners"]);
    refused(
        read,
        &with(faces + 13, &[200]),
        &["face 1 of 4", "cut short"],
    );
    let byte = format!("byte {}", faces + 14);
    refused(read, &with(faces + 14, &[255; 4]), &[&byte, "found -1"]);
    for tail in [&[0][..], b"\n\n\0"] {
        let data = [&data[..], tail].concat();
        let byte = format!("byte {}", data.len() - 1);
        refused(read, &data, &[&byte, "the end of the file", "counts"]);
    }
    let data_and_space = [&data[..], b"\r\n \n"].concat();
    assert_eq!(good(&data_and_space), good(&data));
}

#[test]
fn claims_of_billions_end_with_the_file() {
    let mut data = header(&[
        "format binary_little_endian 1.0",
        "element nothing 18446744073709551615",
        "element vertex 18446744073709551615",
        XYZ,
        "element face 1",
        "property list uint int vertex_indices",
    ]);
    data.extend([0; 100]);
    refused(
        read,
        &data,
        &["vertex 8 of 18446744073709551615", "cut short"],
    );
    let mut data = header(&[
        "format binary_little_endian 1.0",
        "element vertex 0",
        XYZ,
        "element face 1",
        "property list uint int vertex_indices",
    ]);
    data.extend([0xff; 4]);
    data.extend([0; 100]);
    refused(read, &data, &["face 0 of 1", "cut short"]);
}

#[test]
fn what_is_no_surface_or_no_header() {
    let head = |lines: &[&str]| header(&[&["format ascii 1.0"], lines].concat());
    let vertex = format!("element vertex 1\n{XYZ}");
    let cloud = [head(&[&vertex]), b"0 0 0\n".to_vec()].concat();
    refused(read, &cloud, &["a point cloud", "vertex: 1"]);
    let grid = head(&[
        &vertex,
        "element range_grid 1\nproperty list uchar int vertex_indices",
    ]);
    refused(read, &grid, &["a range grid"]);
    refused(
        read,
        &head(&["element point 1\nproperty int x"]),
        &["no vertices and no faces", "point: 1"],
    );
    refused(read, &head(&[]), &["no element at all"]);
    let faces = format!("element face 1\n{FACES}");
    let both = |v: &str, f: &str| head(&[v, f]);
    let no_z = "element vertex 0\nproperty float x\nproperty float y";
    refused(read, &both(no_z, &faces), &["element vertex", "x, y and z"]);
    let twice = format!("{vertex}\nproperty float x");
    refused(
        read,
        &both(&twice, &faces),
        &["each property once", "`x` again"],
    );
    let both_lists = format!("{faces}\nproperty list uchar int vertex_index");
    refused(read, &both(&vertex, &both_lists), &["each property once"]);
    refused(
        read,
        &both(&vertex, "element face 1"),
        &["a list vertex_indices"],
    );
    let floats = "element face 1\nproperty list uchar float vertex_indices";
    refused(
        read,
        &both(&vertex, floats),
        &["list of integers", "of type list uint8 float32"],
    );
    let one = "element face 1\nproperty int vertex_indices";
    refused(read, &both(&vertex, one), &["list of integers"]);

    refused(read, b"plyx\n", &["line 1", "`ply`", "`plyx`"]);
    refused(read, b"", &["`ply`"]);
    let line = |text: &str| header(&["format ascii 1.0", text]);
    for (text, part) in [
        ("format ascii 1.0", "one line `format`"),
        ("format ascii", "one line `format`"),
        ("property float x", "an element before"),
        ("element vertex", "`element NAME COUNT`"),
        ("element vertex -1", "not negative"),
        ("element vertex 99999999999999999999", "not negative"),
        ("element a 1\nelement a 2", "each element once"),
        ("element a 1\nproperty float", "`property TYPE NAME`"),
        ("element a 1\nproperty flaot x", "a type of"),
        ("element a 1\nproperty list float int x", "integer type"),
        ("element a 1\nproperty \x01\0\n", "`property TYPE NAME`"),
    ] {
        refused(read, &line(text), &["line", part]);
    }
    refused(read, b"ply\nformat ascii 1.0\n", &["`end_header`"]);
    refused(read, b"ply\nend_header\n", &["a line `format`"]);
    refused(
        read,
        &[b"ply\n", &b"comment\n".repeat(200_000)[..]].concat(),
        &["first MiB"],
    );
    refused(
        read,
        &[b"ply\n", &[b'x'; 2_000_000][..]].concat(),
        &["first MiB"],
    );
}
