//! The scratch space and the output that a dry run expects of a mesh are what its build takes, within
//! a fifth.

mod common;

use clap::Parser;
use common::formats;
use common::random::Random;
use common::surfaces;
use cornermill::build::Builder;
use std::fmt::Write;
use std::path::Path;

/// What is not worth foretelling: shuffles keep so much in memory, or not.
const LITTLE: u64 = 1 << 20;

/// Foretells and builds a mesh, as a command line of data-gen says it, in budgets in MiB.
fn holds(line: &str, name: &str, budgets: &[u64]) {
    let dir = tempfile::Builder::new().tempdir_in(env!("CARGO_TARGET_TMPDIR"));
    let dir = dir.expect("a temporary directory");
    let file = dir.path().join(name);
    let words = ["data-gen", "-o", file.to_str().expect("a plain path")];
    let words = words.into_iter().chain(line.split(' '));
    data_gen::args::run(&data_gen::Args::parse_from(words)).expect("a mesh");
    for &mib in budgets {
        // A state for --resume would hold more, in a build that is slow enough.
        let builder = Builder::new(&file).checkpoint(None).force(true);
        let mut builder = builder.memory(mib << 20).threads(2);
        let g = file.with_extension("G.npy");
        if g.exists() {
            builder = builder.positions(g);
        }
        let what = format!("{line} as {name} in {mib} MiB");
        near(&what, &builder, &dir.path().join("out.ct"));
    }
}

fn near(what: &str, builder: &Builder, output: &Path) {
    let told = builder.predict(output).expect("a prediction");
    let took = builder.build(output).expect("a build").peak_scratch;
    let files = std::fs::read_dir(output).expect("a folder");
    let size = |file: std::io::Result<std::fs::DirEntry>| file?.metadata();
    let made: u64 = files.map(|f| size(f).expect("a file").len()).sum();
    println!("{what}: output {} said, {made} made", told.output);
    assert!(
        5 * told.output.abs_diff(made) <= made,
        "{what}: output {} said, {made} made",
        told.output
    );
    let (said, most) = (told.expected_scratch, told.most_scratch);
    println!("{what}: {said} said, {took} taken, {most} at most");
    assert!(told.looked_at > 0, "{what}: nothing was looked at");
    assert!(took <= most, "{what}: {took} taken, {most} at most");
    let off = said.abs_diff(took);
    assert!(
        off <= (took / 5).max(LITTLE),
        "{what}: {said} said, {took} taken"
    );
}

#[test]
fn of_meshes_in_file_order() {
    holds("sphere -t 100k", "a.npy", &[4, 16]);
    holds("sphere -t 100k", "a.ply", &[4]);
    holds("sphere -t 100k --order shuffle-vertices", "a.npy", &[4]);
    holds("sphere -t 200k --order sorted-x", "a.npy", &[16]);
}

#[test]
fn of_meshes_in_no_order() {
    holds("sphere -t 100k --order shuffle", "a.npy", &[4, 16]);
    holds("sphere -t 100k --order shuffle", "a.ply", &[4]);
}

#[test]
fn of_meshes_to_be_welded() {
    holds("sphere -t 100k", "a.stl", &[16]);
    holds("sphere -t 100k --order shuffle", "a.stl", &[16]);
}

#[test]
fn of_hubs_and_crowds() {
    for line in ["cone", "fan", "book", "stack"] {
        holds(
            &format!("{line} -t 100k --order shuffle"),
            "a.npy",
            &[4, 16],
        );
    }
    holds("cone -t 200k", "a.npy", &[32]);
    holds("fan -t 100k", "a.npy", &[4]);
    holds("soup -t 100k", "a.npy", &[4]);
}

/// Foretells and builds a file of these bytes, which has so many triangles.
fn holds_of(what: &str, (name, bytes): (&str, &[u8]), triangles: u64, budgets: &[u64]) {
    let dir = tempfile::Builder::new().tempdir_in(env!("CARGO_TARGET_TMPDIR"));
    let dir = dir.expect("a temporary directory");
    let file = dir.path().join(name);
    std::fs::write(&file, bytes).expect("a mesh");
    for &mib in budgets {
        let builder = Builder::new(&file).checkpoint(None).force(true);
        let builder = builder.memory(mib << 20).threads(2);
        let what = format!("{what} as {name} in {mib} MiB");
        let output = dir.path().join("out.ct");
        let told = builder
            .predict(&output)
            .expect("a prediction")
            .survey
            .triangles;
        let off = told.abs_diff(triangles);
        assert!(
            20 * off <= triangles,
            "{what}: {told} triangles of {triangles}"
        );
        near(&what, &builder, &output);
    }
}

#[test]
fn of_texts() {
    let mut mesh = surfaces::torus(250, 320);
    for what in ["coherent", "shuffled"] {
        let files = [
            ("a.ply", formats::ply_ascii(&mesh)),
            ("a.obj", formats::obj(&mesh)),
            ("a.off", formats::off(&mesh)),
            ("a.stl", formats::stl_ascii(&mesh, "\r\n", 1)),
        ];
        for (name, bytes) in files {
            let least = if name == "a.stl" { 16 } else { 4 };
            holds_of(what, (name, &bytes), 160_000, &[least]);
        }
        mesh.shuffle(&mut Random::new(5));
    }
}

/// A torus whose faces are squares first, and squares cut in two then: corners, and bytes of a row of
/// a binary file, tell little of triangles.
#[test]
fn of_polygons() {
    let mesh = surfaces::torus(250, 320);
    let pairs = mesh.triangles.as_chunks::<2>().0;
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for (i, [one, other]) in pairs.iter().enumerate() {
        // The corner of the other triangle that is none of this one.
        let across = other.iter().find(|v| !one.contains(v)).expect("a square");
        let k = (0..3)
            .find(|&k| !other.contains(&one[k]))
            .expect("a square");
        let [a, b, c] = [0, 1, 2].map(|j| one[(k + j) % 3]);
        if i < pairs.len() / 2 {
            faces.push(vec![a, b, *across, c]);
        } else {
            faces.extend([one.to_vec(), other.to_vec()]);
        }
    }
    for what in ["coherent polygons", "shuffled polygons"] {
        let (n, f) = (mesh.positions.len(), faces.len());
        let header = |format: &str, more: &str| {
            format!(
                "ply\nformat {format} 1.0\nelement vertex {n}\nproperty float x\nproperty float y\n\
                 property float z\nelement face {f}\nproperty list uchar int vertex_indices\n{more}\
                 end_header\n"
            )
        };
        let mut rows = String::new();
        let mut statements = String::new();
        let mut binary = header("binary_big_endian", "").into_bytes();
        // A second list leaves the number of triangles open.
        let list = "property list uchar float texcoord\n";
        let mut listed = header("binary_little_endian", list).into_bytes();
        for p in &mesh.positions {
            let [x, y, z] = p;
            let _ = writeln!(rows, "{x} {y} {z}");
            let _ = writeln!(statements, "v {x} {y} {z}\nvt {x} {y}");
            binary.extend(p.iter().flat_map(|x| x.to_be_bytes()));
            listed.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        }
        for face in &faces {
            let _ = write!(rows, "{}", face.len());
            statements.push('f');
            binary.push(face.len() as u8);
            listed.push(face.len() as u8);
            for &v in face {
                let _ = write!(rows, " {v}");
                let _ = write!(statements, " {0}/{0}", v as i64 - n as i64);
                binary.extend(v.to_be_bytes());
                listed.extend(v.to_le_bytes());
            }
            listed.push(2 * face.len() as u8);
            let places = face.iter().map(|&v| mesh.positions[v as usize]);
            listed.extend(
                places
                    .flat_map(|[x, y, _]| [x, y])
                    .flat_map(f32::to_le_bytes),
            );
            rows.push('\n');
            statements.push('\n');
        }
        let off = format!("OFF\n{n} {f} 0\n{rows}");
        let ply = header("ascii", "") + &rows;
        let files = [
            ("p.off", off.as_bytes()),
            ("text.ply", ply.as_bytes()),
            ("p.obj", statements.as_bytes()),
            ("p.ply", &binary),
            ("listed.ply", &listed),
        ];
        for file in files {
            holds_of(what, file, 160_000, &[4]);
        }
        Random::new(6).shuffle(&mut faces);
    }
}

/// An element of a PLY file: its name and properties, and its rows.
type Element = (String, Vec<Vec<Value>>);

#[derive(Clone, Copy)]
enum Value {
    Byte(u8),
    Int(i32),
    Float(f32),
}

fn ply(format: &str, elements: &[&Element]) -> Vec<u8> {
    let mut file = format!("ply\nformat {format} 1.0\n");
    for (header, rows) in elements {
        let (name, properties) = header.split_once(':').expect("a name");
        let _ = write!(file, "element {name} {}\n{properties}\n", rows.len());
    }
    let mut file = (file + "end_header\n").into_bytes();
    for row in elements.iter().flat_map(|(_, rows)| rows) {
        for value in row {
            match (format, *value) {
                ("ascii", Value::Byte(n)) => file.extend(format!("{n} ").bytes()),
                ("ascii", Value::Int(n)) => file.extend(format!("{n} ").bytes()),
                ("ascii", Value::Float(x)) => file.extend(format!("{x} ").bytes()),
                (_, Value::Byte(n)) => file.push(n),
                (_, Value::Int(n)) => file.extend(n.to_be_bytes()),
                (_, Value::Float(x)) => file.extend(x.to_be_bytes()),
            }
        }
        if format == "ascii" {
            file.push(b'\n');
        }
    }
    file
}

fn list(length: Value, items: &[u32]) -> Vec<Value> {
    let items = items.iter().map(|&v| Value::Int(v as i32));
    [length].into_iter().chain(items).collect()
}

/// Strips, short and long, and faces that are not the last rows or lie behind lists.
#[test]
fn of_strips_and_faces_among_other_rows() {
    const FACES: &str = "face:property list uchar int vertex_indices";
    const STRIPS: &str = "tristrips:property list int int vertex_indices";
    let (m, n) = (250, 320);
    let mesh = surfaces::torus(m, n);
    let point = |p: &[f32; 3]| p.map(Value::Float).to_vec();
    let vertices: Element = (
        "vertex:property float x\nproperty float y\nproperty float z".into(),
        mesh.positions.iter().map(point).collect(),
    );
    let polygon = |corners: &[u32]| list(Value::Byte(corners.len() as u8), corners);
    let triangles = mesh.triangles.iter().map(|t| polygon(t));
    let triangles: Element = (FACES.into(), triangles.collect());
    let quads = mesh.triangles.as_chunks::<2>().0;
    // Squares in the second half alone.
    let cut = |(i, [one, other]): (usize, &[[u32; 3]; 2])| match i < quads.len() / 2 {
        true => vec![polygon(one), polygon(other)],
        false => vec![polygon(&[one[0], one[1], one[2], other[2]])],
    };
    let polygons: Element = (
        FACES.into(),
        quads.iter().enumerate().flat_map(cut).collect(),
    );
    let strip = |corners: &[u32]| list(Value::Int(corners.len() as i32), corners);
    let rings: Vec<Vec<u32>> = (0..n)
        .map(|j| {
            let pair = |i| [i % m + m * ((j + 1) % n), i % m + m * j];
            (0..=m).flat_map(pair).collect()
        })
        .collect();
    let all = rings.join(&u32::MAX);
    let one: Element = (STRIPS.into(), vec![strip(&all)]);
    let many: Element = (
        STRIPS.into(),
        rings.iter().map(|ring| strip(ring)).collect(),
    );
    let mut short: Vec<_> = quads
        .iter()
        .map(|[one, other]| polygon(&[one[1], one[2], one[0], other[2]]))
        .collect();
    Random::new(7).shuffle(&mut short);
    let short: Element = (
        "tristrips:property list uchar int vertex_indices".into(),
        short,
    );
    let note = |i: u32| list(Value::Byte((i % 5) as u8), &vec![1 << 20; (i % 5) as usize]);
    let words = "property list uchar int words";
    let [notes, more]: [Element; 2] = ["note:", "more:"].map(|name| {
        (
            name.to_owned() + words,
            (0..20_000).map(note).collect::<Vec<_>>(),
        )
    });
    for (what, elements) in [
        ("triangles first", &[&triangles, &vertices][..]),
        ("polygons first", &[&polygons, &vertices]),
        ("polygons, then lists", &[&vertices, &polygons, &notes]),
        (
            "polygons among lists",
            &[&notes, &polygons, &vertices, &more],
        ),
        ("one strip", &[&vertices, &one]),
        ("one strip first", &[&one, &vertices]),
        ("strips", &[&vertices, &many]),
        ("strips among lists", &[&notes, &many, &more, &vertices]),
        ("short strips at random", &[&vertices, &short]),
    ] {
        for format in ["ascii", "binary_big_endian"] {
            let what = format!("{what}, {format},");
            holds_of(&what, ("a.ply", &ply(format, elements)), 160_000, &[4]);
        }
    }
}
