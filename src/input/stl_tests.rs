//! STL files made by hand, each named by its hazard.

use super::*;
use crate::folder::{BLOCK, digest_of_blocks};
use crate::input::testing::{Dripping, bits, request, triangles, workspace};
use std::io::Cursor;
use std::path::Path;

/// V and the bits of G, or the message.
type Found = Result<(Vec<[u64; 3]>, Vec<u64>), String>;

/// Reads from a file (whose length is known) or a stream (whose length is not).
fn read_from(data: &[u8], known: bool, coords: Option<CoordKind>) -> Found {
    // A stream comes in pieces that no facet or word fits.
    let step = if known { usize::MAX } else { 13 };
    let source = Box::new(Dripping(Cursor::new(data.to_vec()), step));
    let length = known.then_some(data.len() as u64);
    let open = |ws: &Workspace, _: &Path| ByteReader::new(ws, source, "test.stl".into(), length);
    read_by(data, coords, 1 << 20, open)
}

/// Reads from a regular file, which all threads take.
fn read_file(data: &[u8], coords: Option<CoordKind>, memory: u64) -> Found {
    read_by(data, coords, memory, |ws, dir| {
        let path = dir.join("test.stl");
        std::fs::write(&path, data).unwrap();
        let reader = ByteReader::open(ws, &path).unwrap();
        assert!(reader.regular());
        Ok(reader)
    })
}

fn read_by(
    data: &[u8],
    coords: Option<CoordKind>,
    memory: u64,
    open: impl FnOnce(&Workspace, &Path) -> Result<ByteReader>,
) -> Found {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(dir.path(), memory);
    let mut request = request(dir.path(), dir.path());
    request.coords = coords;
    let reader = open(&ws, dir.path()).unwrap();
    request.path = reader.path().to_owned();
    let found = read(&ws, reader, &request).and_then(|reading| reading.finish(&ws, &request));
    let found = found.map_err(|e| e.to_string());
    let found = found.map(|mesh| {
        assert!(mesh.welded && mesh.entry.format == "stl");
        assert_eq!(mesh.entry.files, [digest(data)]);
        (triangles(&mesh), bits(&mesh))
    });
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    found
}

/// The digest of the input, block by block.
fn digest(data: &[u8]) -> InputDigest {
    let blocks = data.chunks(BLOCK as usize);
    let sums: Vec<u64> = blocks.map(xxhash_rust::xxh3::xxh3_64).collect();
    InputDigest {
        bytes: data.len() as u64,
        xxh3: format!("{:016x}", digest_of_blocks(&sums)),
    }
}

/// As [`read_from`], both ways, and from a file, which must agree.
fn read_both(data: &[u8]) -> Found {
    let known = read_from(data, true, None);
    let stream = read_from(data, false, None);
    assert_eq!(known.is_ok(), stream.is_ok());
    let file = read_file(data, None, 1 << 20);
    let name = |e: &String| e.rsplit_once("test.stl").map(|(_, what)| what.to_owned());
    match (&known, &file) {
        (Err(one), Err(other)) => assert_eq!(name(one), name(other)),
        _ => assert_eq!(known, file),
    }
    if known.is_ok() {
        assert_eq!(known, stream);
    }
    known
}

fn message(data: &[u8], words: &[&str]) {
    let message = read_both(data).unwrap_err();
    for word in words {
        assert!(message.contains(word), "{message} lacks {word}");
    }
}

type Corners = [[f32; 3]; 3];

const A: Corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1e-30, 3.25]];
const B: Corners = [[1.0, 0.0, 0.5], [-0.0, 0.0, -0.0], [7.0, 8.0, 9.0]];

fn binary_of(head: &[u8], facets: &[Corners]) -> Vec<u8> {
    let mut out = head.to_vec();
    out.resize(80, b' ');
    out.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        // A normal that is no number, which nobody reads.
        out.extend([0xff; 12]);
        out.extend(facet.iter().flatten().flat_map(|c| c.to_le_bytes()));
        out.extend(b"\x20\x20");
    }
    out
}

fn text_of(name: &str, facets: &[Corners], eol: &str) -> String {
    let mut out = format!("solid {name}{eol}");
    for facet in facets {
        out += &format!("  facet normal 0 0 1{eol}    outer loop{eol}");
        for [x, y, z] in facet {
            out += &format!("      vertex {x:e} {y} {z}{eol}");
        }
        out += &format!("    endloop{eol}  endfacet{eol}");
    }
    out + &format!("endsolid {name}{eol}")
}

/// What A and B give.
fn expected() -> (Vec<[u64; 3]>, Vec<u64>) {
    let points = [A[0], A[1], A[2], B[2]];
    let bits = points.iter().flatten().map(|c| u64::from(c.to_bits()));
    (vec![[0, 1, 2], [1, 0, 3]], bits.collect())
}

#[test]
fn binary_whatever_it_begins_with() {
    for head in [
        &b"made by hand"[..],
        b"",
        b"solid",
        b"solid part",
        b"  SOLID",
        b"solidworks",
        &[0; 80],
        b"COLOR=\x01\x02\x03\xff",
    ] {
        let data = binary_of(head, &[A, B]);
        assert_eq!(read_both(&data), Ok(expected()), "{head:?}");
        assert_eq!(read_both(&binary_of(head, &[])), Ok((vec![], vec![])));
    }
    // A header that looks like text to the end: only a known length tells it.
    let data = binary_of(b"solid x\nfacet normal 0 0 1", &[A, B]);
    assert_eq!(read_from(&data, true, None), Ok(expected()));
    assert!(
        read_from(&data, false, None)
            .unwrap_err()
            .contains("line 2")
    );
}

#[test]
fn text_whatever_its_lines_end_with() {
    for eol in ["\n", "\r\n", "\r"] {
        let text = text_of("a part", &[A, B], eol);
        assert_eq!(read_both(text.as_bytes()), Ok(expected()));
        let upper = text.to_uppercase();
        assert_eq!(read_both(upper.as_bytes()), Ok(expected()));
        let marked = format!("\u{feff} {eol}{text}");
        assert_eq!(read_both(marked.as_bytes()), Ok(expected()));
        let two =
            text_of("facet", &[A], eol) + &text_of("", &[], eol) + eol + &text_of("c", &[B], eol);
        assert_eq!(read_both(two.as_bytes()), Ok(expected()));
    }
}

#[test]
fn text_with_odd_layouts() {
    let text = text_of("s", &[A, B], "\n");
    let (first, rest) = text.split_once('\n').unwrap();
    let flat = format!("{first}\n{}", rest.replace('\n', " \t "));
    assert_eq!(read_both(flat.as_bytes()), Ok(expected()));
    let tall = text_of("", &[A, B], "\n").replace(' ', "\n");
    assert_eq!(read_both(tall.as_bytes()), Ok(expected()));
    let bare = text.replace("normal 0 0 1", "");
    assert_eq!(read_both(bare.as_bytes()), Ok(expected()));
    let nan = text.replace("normal 0 0 1", "normal -nan(ind) 1.#QNAN x");
    assert_eq!(read_both(nan.as_bytes()), Ok(expected()));
    let unended = text.trim_end().strip_suffix(" s").unwrap();
    assert_eq!(read_both(unended.as_bytes()), Ok(expected()));
    // A name beyond any buffer, with bytes that are no UTF-8.
    let mut long = b"solid ".to_vec();
    long.resize(3 << 20, 0xe9);
    long.extend(&text.as_bytes()[first.len()..]);
    assert_eq!(read_both(&long), Ok(expected()));
    // A name padded with zeros, as some old programs do.
    let padded = text.replacen("solid s", "solid s\0\0\0\0", 1);
    assert_eq!(read_both(padded.as_bytes()), Ok(expected()));
}

#[test]
fn empty_solids_are_meshes() {
    for text in [
        "solid\nendsolid",
        "SOLID x\r\nendsolid x\r\n",
        "solid\n\nendsolid\n\nsolid a\nendsolid",
    ] {
        assert_eq!(read_both(text.as_bytes()), Ok((vec![], vec![])));
    }
}

#[test]
fn wrong_counts_name_both() {
    let data = binary_of(b"", &[A, B]);
    for known in [true, false] {
        let short = read_from(&data[..170], known, None).unwrap_err();
        assert!(
            short.contains("2 facets") && short.contains("170"),
            "{short}"
        );
        let mut long = data.clone();
        long.extend([0; 7]);
        let long = read_from(&long, known, None).unwrap_err();
        assert!(long.contains("2 facets"), "{long}");
        assert!(
            long.contains(if known {
                "191 bytes: 7 too many"
            } else {
                "byte 184"
            }),
            "{long}"
        );
    }
    let mut claims = binary_of(b"solid", &[A]);
    claims[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    message(&claims, &["4294967295 facets"]);
}

#[test]
fn garbage_is_refused_by_name() {
    let good = text_of("s", &[A], "\n");
    let with = |from: &str, to: &str| good.replacen(from, to, 1);
    message(
        b"hello world, this is no mesh",
        &["begins with `hello`", "--format"],
    );
    message(b"", &["84 bytes"]);
    message(b"\0\0\0", &["84 bytes", "byte 3"]);
    message(b"solid", &["`facet` or `endsolid`", "the end of the input"]);
    message(b"solid s\nhello\n", &["line 2", "`hello`"]);
    message(
        with("endloop", "vertex 1 2 3").as_bytes(),
        &["line 7", "triangles"],
    );
    message(
        with("vertex", "vortex").as_bytes(),
        &["line 4", "`vertex`", "`vortex`"],
    );
    message(with("3.25", "3,25").as_bytes(), &["line 6", "`3,25`"]);
    message(
        with("3.25", "1e39").as_bytes(),
        &["line 6", "4 bytes", "`1e39`"],
    );
    message(
        with("3.25", "").as_bytes(),
        &["line 7", "coordinate", "`endloop`"],
    );
    message(
        with("0 0 1", "0 0 1 2").as_bytes(),
        &["line 2", "`outer loop`"],
    );
    message(
        with("endfacet", "").as_bytes(),
        &["`endfacet`", "`endsolid`"],
    );
    message(
        (good.clone() + "trailing").as_bytes(),
        &["line 10", "`solid`", "`trailing`"],
    );
    let endless = with("3.25", &"1".repeat(5000));
    message(endless.as_bytes(), &["line 6"]);
}

#[test]
fn nonfinite_coordinates_keep_their_bits() {
    let odd = [
        f32::from_bits(0x7fa0_0001),
        f32::NEG_INFINITY,
        f32::from_bits(0xffff_ffff),
    ];
    let data = binary_of(b"", &[[odd, odd, [0.0; 3]]]);
    let (v, g) = read_both(&data).unwrap();
    assert_eq!(v, [[0, 0, 1]]);
    assert_eq!(g[..3], [0x7fa0_0001, 0xff80_0000, 0xffff_ffff]);
    let text = text_of("n", &[A], "\n").replace("3.25", "-inf");
    assert_eq!(read_both(text.as_bytes()).unwrap().1[8], 0xff80_0000);
}

#[test]
fn wide_coordinates_are_exact() {
    for data in [
        binary_of(b"", &[A, B]),
        text_of("s", &[A, B], "\n").into_bytes(),
    ] {
        let (v, g) = read_from(&data, true, Some(CoordKind::F8)).unwrap();
        let (v4, g4) = expected();
        assert_eq!(v, v4);
        let wide = g4
            .iter()
            .map(|&c| f64::from(f32::from_bits(c as u32)).to_bits());
        assert_eq!(g, wide.collect::<Vec<_>>());
    }
}

#[test]
fn cut_at_every_byte_is_an_error_or_a_whole_text() {
    for data in [binary_of(b"", &[A, B]), binary_of(b"solid", &[A, B])] {
        for len in 0..data.len() {
            read_both(&data[..len]).unwrap_err();
        }
    }
    let text = text_of("two", &[A], "\r\n") + &text_of("more", &[B], "\n");
    let ends: Vec<usize> = text
        .match_indices("endsolid")
        .map(|(at, _)| at + 8)
        .collect();
    for len in 0..text.len() {
        let found = read_both(&text.as_bytes()[..len]);
        // Whole as far as it goes: behind an `endsolid`, up to the next `solid`.
        let next = text
            .match_indices("\nsolid")
            .map(|(at, _)| at + 1)
            .next()
            .unwrap();
        let whole = len >= ends[1] || (ends[0]..=next).contains(&len);
        assert_eq!(found.is_ok(), whole, "{len}");
    }
}

#[test]
fn flipped_bytes_never_panic() {
    let files = [
        binary_of(b"solid", &[A]),
        text_of("s", &[A], "\n").into_bytes(),
    ];
    for data in files {
        for at in 0..data.len() {
            for byte in [0, b'\n', data[at] ^ 0x20] {
                let mut data = data.clone();
                data[at] = byte;
                let _ = (read_from(&data, true, None), read_from(&data, false, None));
            }
        }
    }
}

/// A strip: facet t has the points t, t + 1 and t + 2.
fn strip(facets: u64) -> Vec<u8> {
    let point = |i: u64| [i as f32, (i % 2) as f32, 0.0];
    let facet = |t: u64| [point(t), point(t + 1), point(t + 2)];
    binary_of(b"strip", &(0..facets).map(facet).collect::<Vec<_>>())
}

fn strip_read(facets: u64) -> (Vec<[u64; 3]>, Vec<u64>) {
    let point = |i: u64| [i as f32, (i % 2) as f32, 0.0].map(|c| u64::from(c.to_bits()));
    let triangles = (0..facets).map(|t| [t, t + 1, t + 2]).collect();
    (triangles, (0..facets + 2).flat_map(point).collect())
}

#[test]
fn facets_across_pieces_of_a_file() {
    // Buffers of 4 KiB and more, whose ends fall on every byte of a facet.
    for (facets, memory) in [(81, 600 << 10), (5000, 600 << 10), (20_000, 64 << 20)] {
        let data = strip(facets);
        let found = read_file(&data, None, memory).unwrap();
        assert!(found == strip_read(facets), "{facets}");
        assert!(read_from(&data, false, None).unwrap() == found);
    }
}

#[test]
fn facets_across_blocks_of_a_file() {
    // A little more than two blocks of the digest, each read by a thread.
    let facets = 2 * BLOCK / FACET as u64 + 3;
    let found = read_file(&strip(facets), None, 64 << 20).unwrap();
    assert!(found == strip_read(facets));
}

#[test]
fn a_file_that_shrinks_is_an_error() {
    let data = strip(40);
    let found = read_by(&data, None, 1 << 20, |ws, dir| {
        let path = dir.join("test.stl");
        std::fs::write(&path, &data).unwrap();
        let reader = ByteReader::open(ws, &path)?;
        std::fs::write(&path, &data[..1900]).unwrap();
        Ok(reader)
    });
    let message = found.unwrap_err();
    assert!(message.contains("test.stl"), "{message}");
}

#[test]
fn no_weld_is_refused_with_the_reason() {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(dir.path(), 1 << 20);
    let mut request = request(dir.path(), dir.path());
    request.weld = Some(false);
    let source = Box::new(Cursor::new(binary_of(b"", &[A])));
    let reader = ByteReader::new(&ws, source, "test.stl".into(), None).unwrap();
    match read(&ws, reader, &request) {
        Err(Error::Usage(text)) => assert!(text.contains("share an edge"), "{text}"),
        other => panic!("{other:?}"),
    }
}

#[path = "stl_tests_long.rs"]
mod long;
