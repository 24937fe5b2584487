//! PLY files made byte by byte that are meshes, whole and cut short.

use super::*;
use crate::input::testing::{self, Decoded, decode};

pub(super) const TETRA: [[u64; 3]; 4] = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
pub(super) const AT: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1.5, 0.], [0., 0., -2.]];

/// A binary face whose corners all name vertex 0: vertices alone would be a point cloud.
const ONE_FACE: [u8; 13] = [3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

pub(super) fn good(data: &[u8]) -> Decoded {
    decode(read, data, usize::MAX, None).unwrap()
}

fn f4(coords: &[f32]) -> Vec<u64> {
    coords.iter().map(|c| c.to_bits().into()).collect()
}

fn tetra_bits() -> Vec<u64> {
    f4(AT.as_flattened())
}

/// A header with these lines between "ply" and "end_header".
pub(super) fn header(lines: &[&str]) -> Vec<u8> {
    format!("ply\n{}\nend_header\n", lines.join("\n")).into_bytes()
}

pub(super) const XYZ: &str = "property float x\nproperty float y\nproperty float z";
pub(super) const FACES: &str = "property list uchar int vertex_indices";

pub(super) fn ascii_tetra() -> String {
    let head = header(&[
        "format ascii 1.0",
        "element vertex 4",
        XYZ,
        "element face 4",
        FACES,
    ]);
    let mut text = String::from_utf8(head).unwrap();
    for [x, y, z] in AT {
        text += &format!("{x} {y} {z}\n");
    }
    for [a, b, c] in TETRA {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

fn word(out: &mut Vec<u8>, little: &[u8], big: bool) {
    let begin = out.len();
    out.extend_from_slice(little);
    if big {
        out[begin..].reverse();
    }
}

/// The tetrahedron with the elements in either order, and what no mesh needs around it.
pub(super) fn binary_tetra(big: bool, faces_first: bool, clutter: bool) -> Vec<u8> {
    let format = if big {
        "format binary_big_endian 1.0"
    } else {
        "format binary_little_endian 1.0"
    };
    let (mut vertex, mut face) = (vec!["element vertex 4", XYZ], vec!["element face 4", FACES]);
    if clutter {
        vertex.insert(1, "property uchar red");
        vertex.push("property double quality");
        face.insert(1, "property short group");
        face.push("property uchar red");
    }
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for at in AT {
        vertices.extend_from_slice(&[10; 1][..usize::from(clutter)]);
        at.iter()
            .for_each(|c| word(&mut vertices, &c.to_le_bytes(), big));
        vertices.extend_from_slice(&[13; 8][..if clutter { 8 } else { 0 }]);
    }
    for t in TETRA {
        faces.extend_from_slice(&[3; 2][..if clutter { 2 } else { 0 }]);
        faces.push(3);
        t.iter()
            .for_each(|&v| word(&mut faces, &(v as u32).to_le_bytes(), big));
        faces.extend_from_slice(&[4; 1][..usize::from(clutter)]);
    }
    let (lines, parts) = if faces_first {
        ([face, vertex].concat(), [faces, vertices])
    } else {
        ([vertex, face].concat(), [vertices, faces])
    };
    let mut data = header(&[&[format][..], &lines].concat());
    data.extend(parts.concat());
    data
}

#[test]
fn every_encoding_order_and_clutter_gives_the_same_mesh() {
    let whole = good(ascii_tetra().as_bytes());
    assert_eq!(whole.triangles, TETRA);
    assert_eq!(whole.bits, tetra_bits());
    assert_eq!((whole.kind, whole.fanned), (CoordKind::F4, 0));
    for choice in 0..8 {
        let data = binary_tetra(choice & 1 > 0, choice & 2 > 0, choice & 4 > 0);
        assert_eq!(good(&data), whole, "{choice}");
        assert_eq!(decode(read, &data, 1, None).unwrap(), whole, "{choice}");
    }
}

#[test]
fn truncation_at_every_byte_is_an_error_or_harmless() {
    for choice in 0..8 {
        let data = binary_tetra(choice & 1 > 0, choice & 2 > 0, choice & 4 > 0);
        testing::truncated(read, &data, data.len());
    }
    let text = ascii_tetra();
    // The last line is whole without its end.
    testing::truncated(read, text.as_bytes(), text.len() - 1);
}

#[test]
pub(super) fn headers_end_their_lines_in_three_ways() {
    let whole = good(ascii_tetra().as_bytes());
    for end in ["\r\n", "\r"] {
        let text = ascii_tetra().replace('\n', end);
        assert_eq!(good(text.as_bytes()), whole);
        assert_eq!(decode(read, text.as_bytes(), 1, None).unwrap(), whole);
    }
    // Data that begins like the end of a line is data.
    for first in [b'\n', b'\r', b' '] {
        for end in ["\n", "\r\n", "\r"] {
            let lines = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n\
                         property uchar x\nproperty uchar y\nproperty uchar z\n\
                         element face 1\nproperty list uchar int vertex_index\nend_header\n";
            let mut data = lines.replace('\n', end).into_bytes();
            data.extend([first, b'\n', 3]);
            data.extend(ONE_FACE);
            let mesh = good(&data);
            assert_eq!(mesh.bits, f4(&[first.into(), 10., 3.]), "{first} {end:?}");
        }
    }
    // One CR LF at the end of a header of LF, blank lines before and in it.
    let text = ascii_tetra()
        .replace("end_header\n", "end_header\r\n")
        .replace("element face", "\n  \nelement face");
    assert_eq!(good(format!("\n \n{text}").as_bytes()), whole);
}

#[test]
fn comments_and_unknown_words_of_the_header() {
    let whole = good(ascii_tetra().as_bytes());
    let long = "x".repeat(10_000);
    let text = ascii_tetra().replace(
        "element vertex",
        &format!("comment {long}\nobj_info a b\nCreated by some writer\nelement vertex"),
    );
    assert_eq!(good(text.as_bytes()), whole);
}

#[test]
fn all_scalar_types_and_what_they_are_stored_as() {
    for (name, bytes, kind) in [
        ("char", vec![0xfe, 1, 2], CoordKind::F4),
        ("uint8", vec![0xfe, 1, 2], CoordKind::F4),
        ("short", vec![0xfe, 0xff, 1, 0, 2, 0], CoordKind::F4),
        ("uint16", vec![0xfe, 0xff, 1, 0, 2, 0], CoordKind::F4),
        (
            "int",
            [-2i32, 1, 2].map(i32::to_le_bytes).concat(),
            CoordKind::F8,
        ),
        (
            "uint32",
            [u32::MAX, 1, 2].map(u32::to_le_bytes).concat(),
            CoordKind::F8,
        ),
        (
            "float32",
            [-2f32, 1., 2.].map(f32::to_le_bytes).concat(),
            CoordKind::F4,
        ),
        (
            "double",
            [-2f64, 1., 2.].map(f64::to_le_bytes).concat(),
            CoordKind::F8,
        ),
    ] {
        let head = |extra: &str| {
            header(&[
                "format binary_little_endian 1.0",
                "element vertex 1",
                &format!("property {name} x\nproperty {name} y\nproperty {name} z{extra}"),
                "element face 1",
                FACES,
            ])
        };
        let x: f64 = match name {
            "uint8" => 254.,
            "uint16" => 65534.,
            "uint32" => u32::MAX.into(),
            _ => -2.,
        };
        // Gathered in bulk, and step by step because of a list.
        for (extra, tail) in [("", &[][..]), ("\nproperty list char float l", &[0])] {
            let data = [&head(extra), &bytes[..], tail, &ONE_FACE].concat();
            let mesh = good(&data);
            assert_eq!(mesh.kind, kind, "{name}");
            let bits = |c: f64| match kind {
                CoordKind::F4 => u64::from((c as f32).to_bits()),
                CoordKind::F8 => c.to_bits(),
            };
            assert_eq!(mesh.bits, [x, 1., 2.].map(bits), "{name}");
            let asked = decode(read, &data, 3, Some(CoordKind::F8)).unwrap();
            assert_eq!(asked.bits, [x, 1., 2.].map(f64::to_bits), "{name}");
        }
    }
}

#[test]
fn nan_payloads_survive() {
    let bits = [0x7fa0_0001u32, 0xff80_1234, 0x8000_0000];
    for extra in ["", "\nproperty list uchar uchar l"] {
        let mut data = header(&[
            "format binary_little_endian 1.0",
            "element vertex 1",
            &format!("{XYZ}{extra}"),
            "element face 1",
            FACES,
        ]);
        bits.iter().for_each(|b| data.extend(b.to_le_bytes()));
        data.extend(&[0][..usize::from(!extra.is_empty())]);
        data.extend(ONE_FACE);
        assert_eq!(good(&data).bits, bits.map(u64::from));
    }
}

#[test]
fn mixed_types_in_any_order_among_other_properties() {
    let mut data = header(&[
        "format binary_big_endian 1.0",
        "element junk 2",
        "property list ushort double a\nproperty char b",
        "element vertex 5",
        "property double z\nproperty uchar red\nproperty float x\nproperty short y",
        "element face 1",
        "property list uchar float texcoord\nproperty list int ushort vertex_index",
    ]);
    for len in [1u16, 0] {
        data.extend(len.to_be_bytes());
        (0..len).for_each(|_| data.extend(9f64.to_be_bytes()));
        data.push(1);
    }
    for _ in 0..5 {
        data.extend(0.1f64.to_be_bytes());
        data.push(255);
        data.extend(0.5f32.to_be_bytes());
        data.extend((-3i16).to_be_bytes());
    }
    data.push(2);
    data.extend([0; 8]);
    data.extend(5i32.to_be_bytes());
    (0..5u16).for_each(|v| data.extend(v.to_be_bytes()));
    let mesh = good(&data);
    assert_eq!(mesh.bits[12..], [0.5, -3., 0.1].map(f64::to_bits));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    assert_eq!(mesh.fanned, 1);
    testing::truncated(read, &data, data.len());
}

/// A binary file of 3000 triangles with a quad in between, over many refills.
#[test]
fn polygons_break_the_bulk_loop_only_where_they_are() {
    let mut data = header(&[
        "format binary_little_endian 1.0",
        "element vertex 3003",
        "property uchar x\nproperty uchar y\nproperty uchar z",
        "element face 3000",
        "property list uchar uint vertex_indices",
    ]);
    data.extend([7; 3003 * 3]);
    let mut right = Vec::new();
    for t in 0..3000u32 {
        let corners = if t % 1000 == 500 { 4 } else { 3 };
        data.push(corners as u8);
        (0..corners).for_each(|k| data.extend((t + k).to_le_bytes()));
        let t = u64::from(t);
        right.push([t, t + 1, t + 2]);
        if corners == 4 {
            right.push([t, t + 2, t + 3]);
        }
    }
    for step in [usize::MAX, 1000, 13] {
        for wide in [false, true] {
            let mesh = testing::decode_as(read, &data, step, |r| r.wide = wide).unwrap();
            assert_eq!((&mesh.triangles, mesh.fanned), (&right, 3));
        }
    }
    // An id that 4 bytes cannot name beside NONE makes all ids wide, and is an error at last.
    let end = data.len();
    data[end - 4..].fill(0xff);
    let parts = [
        "triangle 3002, corner 2",
        "3003 vertices",
        "found 4294967295",
    ];
    testing::refused(read, &data, &parts);
}

#[test]
fn strips_alternate_and_restart() {
    let right = [[0, 1, 2], [2, 1, 3], [2, 3, 3], [7, 8, 9]];
    let text = String::from_utf8(header(&[
        "format ascii 1.0",
        "element vertex 10",
        "property uchar x\nproperty uchar y\nproperty uchar z",
        "element tristrips 2",
        "property list int int vertex_indices",
    ]))
    .unwrap()
        + &"0 0 0\n".repeat(10)
        + "11 0 1 2 3 3 -1 5 6 -1 -1 4\n3 7 8 9\n";
    assert_eq!(good(text.as_bytes()).triangles, right);
    let mut data = header(&[
        "format binary_big_endian 1.0",
        "element vertex 10",
        "property uchar x\nproperty uchar y\nproperty uchar z",
        "element tristrips 2",
        "property list int int vertex_indices",
    ]);
    data.extend([0; 30]);
    for v in [11, 0, 1, 2, 3, 3, -1, 5, 6, -1, -1, 4, 3, 7, 8, 9] {
        data.extend(i32::to_be_bytes(v));
    }
    assert_eq!(good(&data).triangles, right);
    let n = data.len();
    data[n - 4..].copy_from_slice(&(-2i32).to_be_bytes());
    testing::refused(read, &data, &["tristrips 1 of 2", "found -2"]);
    let text = text.replace("-1 5", "-7 5");
    testing::refused(read, text.as_bytes(), &["line 20", "-7"]);
}

#[test]
fn declared_emptiness_is_a_mesh() {
    for format in ["ascii", "binary_little_endian"] {
        let data = header(&[
            &format!("format {format} 1.0"),
            "element vertex 0",
            XYZ,
            "element face 0",
            FACES,
        ]);
        let mesh = good(&data);
        assert!(mesh.triangles.is_empty() && mesh.bits.is_empty());
    }
}
