//! Every format that decodes to the same V and G gives the same arrays; STL and `--weld` give those
//! of the welded mesh.

use super::common::bench::{Bench, arrays, assert_same_files, mixture, shuffled};
use super::common::folder::{Folder, files};
use super::common::formats::{self, Order};
use super::common::mesh::Mesh;
use super::common::random::Random;
use super::common::run::{cornermill, cornermill_reading};
use super::common::{readers, surfaces};
use std::ffi::OsString;

/// Builds from a file of `bytes` and compares the arrays.
fn same_from_file(bench: &Bench, expected: &Folder, name: &str, bytes: &[u8], options: &[&str]) {
    let input = bench.path(name);
    std::fs::write(&input, bytes).expect("the input is written");
    let out = bench.path("found.ct");
    let mut args: Vec<OsString> = vec![
        "build".into(),
        input.into(),
        "-o".into(),
        out.clone().into(),
    ];
    args.extend(["--quiet", "--force"].iter().chain(options).map(Into::into));
    cornermill(args).expect(0);
    assert_same_files(
        &arrays(&out),
        &arrays(&expected.path),
        &format!("{name} {options:?}"),
    );
    assert_eq!(
        Folder::read(&out).manifest["counts"],
        expected.manifest["counts"],
        "{name}"
    );
}

#[test]
fn formats_that_decode_alike_give_equal_arrays() {
    let mesh = shuffled(&mixture(25));
    let bench = Bench::new(&mesh);
    let expected = &Folder::read(&bench.build("expected.ct", &[]));
    let same = |name: &str, bytes: Vec<u8>| same_from_file(&bench, expected, name, &bytes, &[]);
    same("ascii.ply", formats::ply_ascii(&mesh));
    same("little.ply", formats::ply_binary(&mesh, Order::Little));
    same("big.ply", formats::ply_binary(&mesh, Order::Big));
    same("mesh.obj", formats::obj(&mesh));
    same("mesh.off", formats::off(&mesh));
    let small_chunks = ["--chunk-triangles", "7", "--threads", "5"];
    let ply = formats::ply_binary(&mesh, Order::Big);
    same_from_file(&bench, expected, "chunked.ply", &ply, &small_chunks);
}

#[test]
fn npy_and_raw_arrays_of_every_type_give_equal_arrays() {
    let mesh = mixture(25);
    let bench = Bench::new(&mesh);
    let expected = &Folder::read(&bench.build("expected.ct", &[]));
    let g = bench
        .path("G.npy")
        .into_os_string()
        .into_string()
        .expect("a plain path");
    let vertices = mesh.positions.len().to_string();
    for index in ["u4", "u8", "i4", "i8"] {
        let name = format!("{index}.npy");
        formats::write_npy_v(&mesh, &bench.path(&name), index);
        let bytes = std::fs::read(bench.path(&name)).expect("the array reads back");
        same_from_file(&bench, expected, &name, &bytes, &["--positions", &g]);
        for order in [Order::Little, Order::Big] {
            let (order_name, positions) = (order.name(), bench.path("G.raw"));
            std::fs::write(&positions, formats::coordinates(&mesh, order)).expect("G.raw");
            let positions = positions.to_str().expect("a plain path");
            let raw = [
                "--raw-index",
                index,
                "--endian",
                order_name,
                "--vertices",
                &vertices,
            ];
            let options = [&raw[..], &["--positions", positions]].concat();
            let bytes = formats::indices(&mesh, index, order);
            same_from_file(
                &bench,
                expected,
                &format!("{index}-{order_name}.raw"),
                &bytes,
                &options,
            );
        }
    }
}

#[test]
fn standard_input_reads_as_the_file_does() {
    let mesh = mixture(20);
    let bench = Bench::new(&mesh);
    let expected = arrays(&bench.build("expected.ct", &[]));
    for (name, bytes) in [
        ("little.ply", formats::ply_binary(&mesh, Order::Little)),
        ("ascii.ply", formats::ply_ascii(&mesh)),
        ("mesh.off", formats::off(&mesh)),
    ] {
        let (input, out) = (bench.path(name), bench.path("piped.ct"));
        std::fs::write(&input, bytes).expect("the input is written");
        let out_name = out.as_os_str();
        let args = ["build".as_ref(), "-".as_ref(), "-o".as_ref(), out_name];
        let args = args
            .into_iter()
            .chain(["--quiet".as_ref(), "--force".as_ref()]);
        cornermill_reading(&input, args).expect(0);
        assert_same_files(
            &arrays(&out),
            &expected,
            &format!("{name} from standard input"),
        );
    }
}

/// The triangles of `mesh` with vertices of their own each.
fn as_soup(mesh: &Mesh) -> Mesh {
    let corners = mesh.triangles.as_flattened().iter();
    let positions = corners.map(|&v| mesh.positions[v as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Mesh::new("soup of a mesh", triangles.collect(), positions)
}

/// Three tetrahedra and an octahedron that meet only by position, some of it written with -0.
fn soup_to_weld() -> Mesh {
    let tetrahedron = surfaces::tetrahedron();
    let mesh = tetrahedron
        .clone()
        .plus(&tetrahedron.scaled(-1.0))
        .plus(&surfaces::octahedron());
    let mesh = mesh
        .plus(&surfaces::torus(20, 20))
        .plus(&surfaces::soup(50));
    let mut soup = as_soup(&shuffled(&mesh));
    let mut random = Random::new(3);
    for x in soup.positions.as_flattened_mut() {
        if *x == 0.0 {
            *x = *random.pick(&[0.0, -0.0]);
        }
    }
    soup
}

#[test]
fn stl_and_weld_give_the_arrays_of_the_welded_mesh() {
    let soup = soup_to_weld();
    let welded = readers::weld(&soup.positions);
    assert!(
        welded.positions.len() < soup.positions.len() / 2,
        "nothing to weld"
    );
    let bench = Bench::new(&welded);
    let expected = &Folder::read(&bench.build("expected.ct", &[]));
    let same = |name: &str, bytes: Vec<u8>, options: &[&str]| {
        same_from_file(&bench, expected, name, &bytes, options);
    };
    same("binary.stl", formats::stl_binary(&soup, "a test"), &[]);
    same(
        "solid.stl",
        formats::stl_binary(&soup, "solid but binary"),
        &[],
    );
    same("lf.stl", formats::stl_ascii(&soup, "\n", 1), &[]);
    same("crlf.stl", formats::stl_ascii(&soup, "\r\n", 3), &[]);
    same("cr.stl", formats::stl_ascii(&soup, "\r", 2), &[]);
    same(
        "welded.stl",
        formats::stl_binary(&soup, "a test"),
        &["--weld"],
    );
    same(
        "soup.ply",
        formats::ply_binary(&soup, Order::Little),
        &["--weld"],
    );
    same("soup.obj", formats::obj(&soup), &["--weld"]);
    same("soup.off", formats::off(&soup), &["--weld"]);
}

#[test]
fn nan_welds_by_its_bits() {
    let mut soup = as_soup(&surfaces::octahedron());
    let (one, other) = (f32::from_bits(0x7fc0_0000), f32::from_bits(0xffc0_0001));
    for p in &mut soup.positions {
        match *p {
            [1.0, _, _] => *p = [one, 0.0, 0.0],
            [-1.0, _, _] => *p = [other, 0.0, 0.0],
            _ => {}
        }
    }
    let welded = readers::weld(&soup.positions);
    assert_eq!(welded.positions.len(), 6);
    let bench = Bench::new(&welded);
    let expected = &Folder::read(&bench.build("expected.ct", &[]));
    let stl = formats::stl_binary(&soup, "a test");
    same_from_file(&bench, expected, "nan.stl", &stl, &[]);
    let ply = formats::ply_binary(&soup, Order::Big);
    same_from_file(&bench, expected, "nan.ply", &ply, &["--weld"]);
}

#[test]
fn a_welded_mesh_is_the_same_for_every_budget() {
    let soup = as_soup(&shuffled(&surfaces::torus(150, 150)));
    let bench = Bench::new(&soup);
    let expected = files(&bench.build("expected.ct", &["--weld"]));
    for threads in ["1", "5"] {
        let least = bench.small_budget(&["--weld", "--threads", threads]);
        let options = ["--weld", "--threads", threads, "--memory", &least];
        let found = files(&bench.build("found.ct", &options));
        assert_same_files(&found, &expected, &format!("{options:?}"));
    }
    let options = ["--weld", "--chunk-triangles", "64", "--buckets", "3"];
    assert_same_files(
        &files(&bench.build("found.ct", &options)),
        &expected,
        "small chunks",
    );
}
