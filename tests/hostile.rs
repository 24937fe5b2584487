//! Input made to hurt: files cut at every byte, with bytes changed, with claims that nothing
//! backs, with indices that name no vertex. Each ends in order: never a panic, an abort or a hang,
//! never memory by a header's word, and nothing left behind by a refusal.

mod common;

use common::formats::{self, Order};
use common::mesh::Mesh;
use common::run::{Run, cornermill_confined};
use common::{npy, surfaces};
use std::ffi::OsString;
use std::path::Path;
use tempfile::TempDir;

/// MiB of address space: room for the program's threads and a budget, not for a header's claim.
const CONFINED: u32 = 1024;

/// A directory with an input, and an empty one beside it for the output.
struct Place {
    input: TempDir,
    output: TempDir,
}

impl Place {
    fn new() -> Place {
        let dir = || tempfile::tempdir().expect("a temporary directory");
        Place {
            input: dir(),
            output: dir(),
        }
    }

    /// Writes the input, builds, and checks that the run ended in order.
    fn build(&self, name: &str, bytes: &[u8], options: &[&str]) -> Run {
        let (input, out) = (
            self.input.path().join(name),
            self.output.path().join("OUT.ct"),
        );
        std::fs::write(&input, bytes).expect("the input is written");
        if out.exists() {
            std::fs::remove_dir_all(&out).expect("the folder of an earlier build goes");
        }
        let mut args: Vec<OsString> = vec!["build".into(), input.into(), "-o".into(), out.into()];
        let usual = ["--quiet", "--force", "--memory", "64MiB", "--threads", "2"];
        args.extend(usual.iter().chain(options).map(Into::into));
        let run = cornermill_confined(CONFINED, args);
        assert!(
            matches!(run.code, 0 | 2 | 3),
            "neither done nor refused\n{run}"
        );
        assert!(!run.stderr.contains("panicked"), "a panic\n{run}");
        if run.code != 0 {
            assert!(
                !run.stderr.trim().is_empty(),
                "a refusal without a word\n{run}"
            );
            assert_empty(self.output.path());
        }
        run
    }

    /// Builds what must be refused as bad input with one of the words.
    fn refuse(&self, name: &str, bytes: &[u8], options: &[&str], words: &[&str]) {
        let run = self.build(name, bytes, options).expect(3);
        let said = run.stderr.to_lowercase();
        assert!(
            words.iter().any(|w| said.contains(w)),
            "none of {words:?} is said\n{run}"
        );
    }
}

fn assert_empty(dir: &Path) {
    let left: Vec<_> = std::fs::read_dir(dir)
        .expect("the output's directory")
        .collect();
    assert!(left.is_empty(), "left behind: {left:?}");
}

fn npy_bytes(descr: &str, rows: usize, columns: usize, data: &[u8]) -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("array.npy");
    npy::write(&path, descr, rows, columns, data);
    std::fs::read(path).expect("the array reads back")
}

/// One tetrahedron in every format, with whether its length is settled by what it says.
fn files() -> Vec<(&'static str, Vec<u8>, bool)> {
    let mesh = surfaces::tetrahedron();
    let indices = formats::indices(&mesh, "u4", Order::Little);
    vec![
        ("cut.npy", npy_bytes("<u4", 4, 3, &indices), true),
        (
            "little.ply",
            formats::ply_binary(&mesh, Order::Little),
            true,
        ),
        ("big.ply", formats::ply_binary(&mesh, Order::Big), true),
        ("binary.stl", formats::stl_binary(&mesh, "a test"), true),
        ("ascii.ply", formats::ply_ascii(&mesh), false),
        ("mesh.obj", formats::obj(&mesh), false),
        ("mesh.off", formats::off(&mesh), false),
        ("ascii.stl", formats::stl_ascii(&mesh, "\n", 1), false),
    ]
}

/// Every byte of one file of each family is tried; of its sisters, some, to save time.
fn stride(name: &str) -> usize {
    match name {
        "cut.npy" | "little.ply" | "binary.stl" | "mesh.obj" | "mesh.off" => 1,
        _ => 5,
    }
}

#[test]
fn files_cut_at_every_byte_are_refused() {
    for (name, bytes, is_binary) in files() {
        let place = Place::new();
        for length in (0..bytes.len()).step_by(stride(name)) {
            let run = place.build(name, &bytes[..length], &[]);
            // Text may well end early by one line or one digit and still be a mesh.
            assert!(
                run.code == 3 || !is_binary,
                "{name} cut to {length} bytes\n{run}"
            );
        }
        place.build(name, &bytes, &[]).expect(0);
    }
}

#[test]
fn raw_arrays_cut_within_a_triangle_are_refused() {
    let mesh = surfaces::tetrahedron();
    let bytes = formats::indices(&mesh, "u4", Order::Little);
    let place = Place::new();
    let options = ["--raw-index", "u4", "--endian", "little", "--vertices", "4"];
    for length in 0..bytes.len() {
        let run = place.build("cut.raw", &bytes[..length], &options);
        let whole = length % 12 == 0;
        assert!(whole || run.code == 3, "cut to {length} bytes\n{run}");
    }
}

#[test]
fn changed_bytes_do_no_harm() {
    for (name, bytes, _) in files() {
        let place = Place::new();
        for at in (0..bytes.len()).step_by(3 * stride(name)) {
            let mut changed = bytes.clone();
            // Another bit each time; the high ones make counts and indices huge.
            changed[at] ^= 0x80 >> (at % 8);
            place.build(name, &changed, &[]);
        }
    }
}

fn ply(format: &str, elements: &str, body: &[u8]) -> Vec<u8> {
    let header = format!("ply\nformat {format} 1.0\n{elements}end_header\n");
    [header.as_bytes(), body].concat()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const LIST: &str = "property list uchar int vertex_indices\n";

#[test]
fn claims_that_nothing_backs_are_refused() {
    let place = Place::new();
    for count in [
        "4000000000",
        "1000000000000000",
        "18446744073709551615",
        "99999999999999999999999",
    ] {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let vertices = format!("element vertex {count}\n{XYZ}element face 1\n{LIST}");
            place
                .build("vertices.ply", &ply(format, &vertices, b"0 0 0\n"), &[])
                .expect(3);
            let faces = format!("element vertex 0\n{XYZ}element face {count}\n{LIST}");
            place
                .build("faces.ply", &ply(format, &faces, b"\x03"), &[])
                .expect(3);
        }
        let off = format!("OFF\n3 {count} 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
        place.build("faces.off", off.as_bytes(), &[]).expect(3);
        let dict = "{'descr': '<u4', 'fortran_order': False, 'shape': ";
        let header = format!("{dict}({count}, 3), }}");
        let header = format!("{header:<117}\n");
        let npy = [b"\x93NUMPY\x01\x00\x76\x00", header.as_bytes(), &[0; 48]].concat();
        place.build("rows.npy", &npy, &[]).expect(3);
    }
    let mut stl = formats::stl_binary(&surfaces::tetrahedron(), "a test");
    stl[80..84].fill(0xff);
    place.build("claims.stl", &stl, &[]).expect(3);
    let list = "property list uint int vertex_indices\n";
    let face = format!("element vertex 3\n{XYZ}element face 1\n{list}");
    let body = [&[0; 36][..], &[0xff; 4], &[0; 12]].concat();
    place
        .build("list.ply", &ply("binary_little_endian", &face, &body), &[])
        .expect(3);
}

#[test]
fn an_index_beyond_the_vertices_is_named() {
    let place = Place::new();
    let mut mesh = surfaces::octahedron();
    mesh.triangles[5][1] = 777;
    let (little, big) = (Order::Little, Order::Big);
    place.refuse("mesh.ply", &formats::ply_ascii(&mesh), &[], &["777"]);
    place.refuse(
        "mesh.ply",
        &formats::ply_binary(&mesh, little),
        &[],
        &["777"],
    );
    place.refuse("mesh.ply", &formats::ply_binary(&mesh, big), &[], &["777"]);
    place.refuse("mesh.off", &formats::off(&mesh), &[], &["777"]);
    place.refuse("mesh.obj", &formats::obj(&mesh), &[], &["777", "778"]);
    let raw = ["--raw-index", "u4", "--endian", "big", "--vertices", "6"];
    place.refuse(
        "mesh.raw",
        &formats::indices(&mesh, "u4", big),
        &raw,
        &["777"],
    );
    let g = place.input.path().join("G.npy");
    npy::write(&g, "<f4", 6, 3, &formats::coordinates(&mesh, little));
    let v = npy_bytes("<u8", 8, 3, &formats::indices(&mesh, "u8", little));
    place.refuse(
        "V.npy",
        &v,
        &["--positions", g.to_str().expect("a plain path")],
        &["777"],
    );
    let negative = npy_bytes("<i4", 1, 3, &[0, 0, 0, 0, 255, 255, 255, 255, 1, 0, 0, 0]);
    place.refuse("negative.npy", &negative, &[], &["-1", "negative"]);
}

#[test]
fn arrays_of_another_shape_or_type_are_refused() {
    let place = Place::new();
    place.refuse(
        "floats.npy",
        &npy_bytes("<f4", 4, 3, &[0; 48]),
        &[],
        &["f4", "float", "type"],
    );
    place.refuse(
        "quads.npy",
        &npy_bytes("<u4", 3, 4, &[0; 48]),
        &[],
        &["shape", "(3, 4)"],
    );
    let fortran = npy_bytes("<u4", 4, 3, &[0; 48]);
    let at = fortran
        .windows(5)
        .position(|w| w == b"False")
        .expect("False");
    let fortran = [&fortran[..at], b"True ", &fortran[at + 5..]].concat();
    place.refuse("fortran.npy", &fortran, &[], &["fortran", "order"]);
    let v = npy_bytes("<u4", 1, 3, &[0; 12]);
    let flat = place.input.path().join("flat.npy");
    npy::write(&flat, "<f4", 3, 2, &[0; 24]);
    let flat = flat.to_str().expect("a plain path");
    place.refuse("V.npy", &v, &["--positions", flat], &["shape", "(3, 2)"]);
    place.refuse(
        "V.npy",
        &v[..v.len() - 1],
        &[],
        &["truncated", "short", "bytes", "ends"],
    );
}

/// Many writers of scans declare faces and have none.
#[test]
fn vertices_with_an_empty_face_element_are_a_point_cloud() {
    let cloud = format!("element vertex 2\n{XYZ}element face 0\n{LIST}");
    let cloud = ply("ascii", &cloud, b"0 0 0\n1 1 1\n");
    Place::new().refuse("cloud.ply", &cloud, &[], &["point cloud"]);
}

#[test]
fn what_is_no_mesh_is_called_by_its_name() {
    let place = Place::new();
    let grid = "element range_grid 2\nproperty list uchar int vertex_indices\n";
    let grid = format!("obj_info num_cols 2\nobj_info num_rows 1\nelement vertex 2\n{XYZ}{grid}");
    let body = b"0 0 0\n1 1 1\n1 0\n1 1\n";
    place.refuse(
        "grid.ply",
        &ply("ascii", &grid, body),
        &[],
        &["range_grid", "range grid"],
    );
    place.refuse("scene.glb", b"glTF\x02\0\0\0\x40\0\0\0", &[], &["format"]);
    place.refuse(
        "hills.dem",
        b"MOUNT ST. HELENS, WASH. (POST-ERUPTION)",
        &[],
        &["format"],
    );
    place.refuse("no_extension", b"\x7fELF\x02\x01\x01", &[], &["format"]);
    place.refuse("text.ply", b"this is no PLY at all\n", &[], &["ply"]);
    place.refuse("text.off", b"this is no OFF at all\n", &[], &["off"]);
    place.refuse("text.stl", b"this is no STL at all\n", &[], &["stl"]);
}

#[test]
fn coordinates_of_f8_are_kept_and_their_extremes_survived() {
    let place = Place::new();
    let mesh: Mesh = surfaces::octahedron().inverted();
    let v = npy_bytes("<u4", 8, 3, &formats::indices(&mesh, "u4", Order::Little));
    for scale in [1.0, 1e-320, 1e300, f64::MAX, f64::INFINITY, f64::NAN] {
        let coordinates = mesh.positions.as_flattened().iter();
        let bytes: Vec<u8> = coordinates
            .flat_map(|&x| (f64::from(x) * scale).to_le_bytes())
            .collect();
        let g = place.input.path().join("G.npy");
        npy::write(&g, "<f8", 6, 3, &bytes);
        place
            .build(
                "V.npy",
                &v,
                &["--positions", g.to_str().expect("a plain path")],
            )
            .expect(0);
        let kept = npy::Npy::read(&place.output.path().join("OUT.ct/G.npy"));
        assert_eq!(
            (kept.dtype().as_str(), kept.data),
            ("f8", bytes),
            "scaled by {scale}"
        );
    }
}

#[test]
fn a_finite_coordinate_never_becomes_infinite() {
    let place = Place::new();
    let v = npy_bytes("<u4", 1, 3, &[0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    let g = place.input.path().join("G.npy");
    let write = |last: f64| {
        let flat = [0.0, 1.0, f64::NAN, f64::INFINITY, 0.5, 0.0, 0.0, 2.0, last];
        npy::write(&g, "<f8", 3, 3, &flat.map(f64::to_le_bytes).concat());
    };
    let path = g.to_str().expect("a plain path");
    let narrow = ["--positions", path, "--coords", "f4"];
    write(1e300);
    place.refuse("V.npy", &v, &narrow, &["vertex 2"]);
    place.build("V.npy", &v, &narrow[..2]).expect(0);
    write(1e30);
    place.build("V.npy", &v, &narrow).expect(0);
}
