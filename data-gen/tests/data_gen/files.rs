//! The files: every format decodes to the same mesh, and the counts beside it hold for what is read
//! back from disk.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::naive;
use clap::Parser;
use data_gen::{Args, Truth};
use serde_json::Value;

/// Runs the program's own entry point; returns the file and its counts.
fn make(folder: &Path, name: &str, line: &str) -> (PathBuf, Value) {
    let path = folder.join(name);
    let output = path.to_str().unwrap();
    let words = ["data-gen"]
        .into_iter()
        .chain(line.split_whitespace())
        .chain(["-o", output]);
    data_gen::args::run(&Args::try_parse_from(words).unwrap()).unwrap();
    let json = std::fs::read(folder.join(format!("{name}.json"))).unwrap();
    (path, serde_json::from_slice(&json).unwrap())
}

fn u32s(bytes: &[u8]) -> Vec<u32> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|b| u32::from_le_bytes(*b))
        .collect()
}

fn triples(numbers: &[u32]) -> Vec<[u64; 3]> {
    numbers
        .as_chunks()
        .0
        .iter()
        .map(|t: &[u32; 3]| t.map(u64::from))
        .collect()
}

/// Header and data of a .npy file.
fn npy(path: &Path) -> (String, Vec<u8>) {
    let bytes = std::fs::read(path).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    assert_eq!((10 + length) % 64, 0);
    let header = String::from_utf8(bytes[10..10 + length].to_vec()).unwrap();
    assert!(header.ends_with('\n'));
    (header, bytes[10 + length..].to_vec())
}

/// V and the bits of G of a binary PLY as this program writes it.
fn ply(path: &Path) -> (Vec<[u64; 3]>, Vec<u32>) {
    let bytes = std::fs::read(path).unwrap();
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..start]).unwrap();
    let count = |what: &str| -> usize {
        let line = header.lines().find_map(|l| l.strip_prefix(what)).unwrap();
        line.trim().parse().unwrap()
    };
    let (vertices, faces) = (count("element vertex"), count("element face"));
    let (points, rest) = bytes[start..].split_at(12 * vertices);
    assert_eq!(rest.len(), 13 * faces);
    let mut corners = Vec::new();
    for face in rest.chunks_exact(13) {
        assert_eq!(face[0], 3);
        corners.extend(u32s(&face[1..]));
    }
    (triples(&corners), u32s(points))
}

/// V of an STL, welded by position in order of first use.
fn stl(path: &Path) -> (Vec<[u64; 3]>, u64) {
    let bytes = std::fs::read(path).unwrap();
    assert!(!bytes.starts_with(b"solid"));
    let count = u32s(&bytes[80..84])[0] as usize;
    assert_eq!(bytes.len(), 84 + 50 * count);
    let mut ids: BTreeMap<[u32; 3], u64> = BTreeMap::new();
    let mut corners = Vec::new();
    for record in bytes[84..].chunks_exact(50) {
        let mut triangle = [0; 3];
        for (k, corner) in triangle.iter_mut().enumerate() {
            let bits = u32s(&record[12 + 12 * k..24 + 12 * k]);
            // -0 equals 0.
            let place = [bits[0], bits[1], bits[2]].map(|b| (f32::from_bits(b) + 0.0).to_bits());
            let next = ids.len() as u64;
            *corner = *ids.entry(place).or_insert(next);
        }
        corners.push(triangle);
    }
    (corners, ids.len() as u64)
}

/// The counts beside a file against naive counts of what is in it.
fn assert_holds(what: &str, facts: &Value, triangles: &[[u64; 3]], vertices: u64) {
    let found = naive::count(triangles, vertices);
    let found = Truth {
        flipped: facts["flipped"].as_u64().unwrap(),
        ..found
    };
    for (key, value) in found.to_json().as_object().unwrap() {
        assert_eq!(&facts[key], value, "{what}: {key}");
    }
}

const LINES: [&str; 11] = [
    "sphere --size 12 --seed 3 --defects=2",
    "sphere --triangles 2k --shuffle --flip 0.3",
    "torus --size 16x30 --shuffle --flip 0.3 --defects=2",
    "terrain --triangles 1k --order sorted-x",
    "moebius --size 3x50 --flip 0.3",
    "blobs --triangles 3k --blobs 12 --shuffle --defects=1 --flip 0.5",
    "soup --triangles 150 --shuffle --flip 0.3",
    "soup --triangles 150 --order strips",
    "torus --size 16x30 --order strips --flip 0.3 --defects=2",
    "fan --size 90 --order reversed --defects=3",
    "cone --size 90 --order interleaved --flip 0.2",
];

#[test]
fn formats_agree_and_the_counts_beside_them_hold() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for line in LINES {
        let (path, facts) = make(folder, "m.npy", line);
        let (header, v) = npy(&path);
        let (n, t) = (
            facts["vertices"].as_u64().unwrap(),
            facts["triangles"].as_u64().unwrap(),
        );
        let shape = |kind, rows| {
            format!("{{'descr': '<{kind}', 'fortran_order': False, 'shape': ({rows}, 3), }}")
        };
        assert!(header.starts_with(&shape("u4", t)), "{header}");
        let triangles = triples(&u32s(&v));
        assert_holds(line, &facts, &triangles, n);
        let (header, g) = npy(&folder.join("m.G.npy"));
        assert!(header.starts_with(&shape("f4", n)), "{header}");
        assert_eq!(g.len() as u64, 12 * n);

        let (path, _) = make(folder, "m.ply", line);
        assert!(
            ply(&path) == (triangles.clone(), u32s(&g)),
            "{line}: PLY differs"
        );

        let (path, _) = make(folder, "m.raw", line);
        assert!(std::fs::read(&path).unwrap() == v, "{line}: raw V differs");
        assert!(
            std::fs::read(folder.join("m.raw.G")).unwrap() == g,
            "{line}: raw G differs"
        );

        let (path, facts) = make(folder, "m.stl", line);
        let (triangles, vertices) = stl(&path);
        assert_holds(&format!("{line} as STL"), &facts, &triangles, vertices);
    }
}

#[test]
fn wide_types_hold_the_same_values() {
    let folder = tempfile::tempdir().unwrap();
    let line = "torus --size 9x11 --shuffle";
    let (path, _) = make(folder.path(), "a.npy", line);
    let (_, narrow) = npy(&path);
    let (_, f4) = npy(&folder.path().join("a.G.npy"));
    let (path, _) = make(
        folder.path(),
        "b.npy",
        &format!("{line} --index u8 --coords f8"),
    );
    let (header, wide) = npy(&path);
    assert!(header.contains("'<u8'"), "{header}");
    let (header, f8) = npy(&folder.path().join("b.G.npy"));
    assert!(header.contains("'<f8'"), "{header}");
    let wide: Vec<u64> = wide
        .as_chunks()
        .0
        .iter()
        .map(|b| u64::from_le_bytes(*b))
        .collect();
    assert!(u32s(&narrow).into_iter().map(u64::from).eq(wide));
    let rounded: Vec<u32> = (f8.as_chunks().0.iter())
        .map(|b| (f64::from_le_bytes(*b) as f32).to_bits())
        .collect();
    assert!(u32s(&f4) == rounded);
}

#[test]
fn threads_and_blocks_do_not_change_a_byte() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, threads: u32| {
        // More than two blocks of V, and not a whole number of them.
        let line = format!("sphere --triangles 900k --shuffle --flip 0.3 --threads {threads}");
        let (path, facts) = make(folder.path(), name, &line);
        let g = std::fs::read(folder.path().join(name.replace(".npy", ".G.npy"))).unwrap();
        (std::fs::read(path).unwrap(), g, facts)
    };
    assert!(read("a.npy", 1) == read("b.npy", 5));
}

#[test]
fn what_cannot_be_made_is_refused_with_advice() {
    let folder = tempfile::tempdir().unwrap();
    let run = |line: &str| {
        let output = folder.path().join(line.split_whitespace().last().unwrap());
        let words = line.split_whitespace().collect::<Vec<_>>();
        let words = [
            &["data-gen"],
            &words[..words.len() - 1],
            &["-o", output.to_str().unwrap()],
        ];
        let args = Args::try_parse_from(words.concat()).map_err(|e| e.to_string())?;
        data_gen::args::run(&args).map_err(|e| e.to_string())
    };
    let refused = [
        ("sphere a.xyz", "what format"),
        ("klein a.stl", "coincide"),
        ("soup --triangles 5G a.stl", "4 bytes"),
        ("soup --triangles 2G a.ply", "use npy"),
        ("soup --triangles 2G --index u4 a.npy", "--index u8"),
        ("torus --size 2x9 a.npy", "at least 3x3"),
        ("torus --size 9 a.npy", "AxB"),
        ("sphere --size 9x9 a.npy", "one number"),
        ("sphere --blobs 3 a.npy", "--blobs"),
        ("torus --diagonals 0.5 a.npy", "--diagonals"),
        ("sphere --diagonals 1.5 a.npy", "probability"),
        ("sphere --size 3 --diagonals 0.5 a.npy", "--size 4"),
        ("blobs --blobs 300 --triangles 2k a.npy", "2400"),
        ("sphere --size 3 --defects a.npy", "larger mesh"),
        ("sphere --triangles 3q a.npy", "expected a number"),
        ("sphere --triangles 0 a.npy", "expected 1"),
        ("sphere --flip 1.5 a.npy", "probability"),
        ("sphere no/such/folder/a.ply", "a.ply: "),
    ];
    for (line, expected) in refused {
        let error = run(line).expect_err(line);
        assert!(error.contains(expected), "{line}: {error}");
        let name = line.split_whitespace().last().unwrap();
        assert!(!folder.path().join(name).exists(), "{line} left a file");
    }
}
