//! Files read by a second decoder: `decoder/`, in plain Python, written from `docs/format.md` alone.
//! What it makes of a file must be, byte for byte, what the program makes of it.
//!
//! Needs `python3`, without any package.

use super::common::formats::write_npy_v;
use super::common::mesh::Mesh;
use super::common::npy;
use super::common::run::run;
use super::common::{bench, surfaces, zoo};
use super::{told_apart, workspace};
use cornermill::build::Builder;
use cornermill::codec::Level;
use cornermill::codec::decode::decode;
use cornermill::codec::encode::{EncodeRequest, encode};
use cornermill::codec::grid::Precision;
use cornermill::codec::packed::Packed;
use cornermill::folder::Folder;
use std::fs::read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

const WHOLE: u64 = 1 << 20;
/// An eleven-bit grid.
const GRID: Precision = Precision::Bits(11);

/// Files to compare, in a directory of their own: what each is, and where.
struct Files {
    dir: TempDir,
    all: Vec<(String, PathBuf)>,
}

/// Coordinates of the folder to be encoded.
#[derive(Clone, Copy)]
enum Places {
    None,
    F4,
    F8,
}

impl Files {
    fn new() -> Files {
        let dir = tempfile::tempdir().unwrap();
        Files { dir, all: vec![] }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Builds the mesh and encodes it in each of these ways: precision, level, triangles of a chunk.
    fn encode(&mut self, mesh: &Mesh, places: Places, ways: &[(Precision, Level, u64)]) {
        let (v, g) = (self.path("V.npy"), self.path("G.npy"));
        write_npy_v(mesh, &v, "u4");
        let numbers = mesh.positions.as_flattened().iter();
        let (kind, bytes): (&str, Vec<u8>) = match places {
            Places::F8 => (
                "<f8",
                // Not numbers of f4.
                numbers
                    .flat_map(|&x| (f64::from(x) / 3.0).to_le_bytes())
                    .collect(),
            ),
            _ => ("<f4", numbers.flat_map(|x| x.to_le_bytes()).collect()),
        };
        npy::write(&g, kind, mesh.positions.len(), 3, &bytes);
        let mut builder = Builder::new(v).memory(64 << 20).threads(2);
        if !matches!(places, Places::None) {
            builder = builder.positions(g);
        }
        let folder = self.path(&format!("{}.ct", self.all.len()));
        builder.build(&folder).unwrap();
        let ws = workspace(self.dir.path(), 64 << 20, 2);
        let folder = Folder::open(&folder, &ws.io).unwrap();
        for &(precision, level, most) in ways {
            // The order of one chunk is coded as that of many is.
            for keep_order in [false, true]
                .into_iter()
                .take(1 + usize::from(most < WHOLE))
            {
                let path = self.path(&format!("{}.cmz", self.all.len()));
                let mut request = EncodeRequest::new(&path, precision);
                (request.level, request.most, request.keep_order) = (level, most, keep_order);
                encode(&ws, &folder, &request).unwrap();
                let what = format!("{}: {precision:?} {level:?}, {most} a chunk", mesh.name);
                self.all
                    .push((format!("{what}, ordered {keep_order}"), path));
            }
        }
    }

    /// Decodes all files both ways.
    fn compare(&self) {
        let found = |i: usize, name: &str| self.path(&format!("{i}.found.{name}.npy"));
        let mut python = Command::new("python3");
        let script = "tests/codec/decoder/decoder.py";
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(script);
        // -B: leave no compiled files in the repository.
        python.arg("-B").arg(script);
        for (i, (_, path)) in self.all.iter().enumerate() {
            python.arg(path).arg(self.path(&format!("{i}.found.")));
        }
        run(python, Stdio::null()).expect(0);
        let ws = workspace(self.dir.path(), 64 << 20, 2);
        for (i, (what, path)) in self.all.iter().enumerate() {
            let [v, g] = ["V", "G"].map(|name| self.path(&format!("{i}.{name}.npy")));
            let packed = Packed::open(&ws.budget, &ws.io, path).unwrap();
            decode(&ws, &packed, &v, &g).unwrap();
            assert!(
                read(found(i, "V")).unwrap() == read(v).unwrap(),
                "V of {what}"
            );
            assert_eq!(found(i, "G").exists(), g.exists(), "G of {what}");
            if g.exists() {
                assert!(
                    read(found(i, "G")).unwrap() == read(g).unwrap(),
                    "G of {what}"
                );
            }
        }
    }
}

#[test]
fn stored_files_read_alike() {
    let mut files = Files::new();
    for place in ["codec/golden", "fixtures/v1"] {
        let place = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests")
            .join(place);
        for file in std::fs::read_dir(place).unwrap() {
            let path = file.unwrap().path();
            if path.extension().is_some_and(|e| e == "cmz") {
                files.all.push((path.display().to_string(), path));
            }
        }
    }
    assert!(files.all.len() >= 6, "{:?}", files.all);
    files.compare();
}

#[test]
fn the_zoo_reads_alike() {
    let mut files = Files::new();
    for mesh in zoo::all() {
        let mesh = told_apart(mesh);
        let finite = mesh.positions.as_flattened().iter().all(|x| x.is_finite());
        let ways = [
            (Precision::Exact, Level::Fast, 3),
            (Precision::Exact, Level::Strong, WHOLE),
            (GRID, Level::Fast, WHOLE),
        ];
        files.encode(&mesh, Places::F4, &ways[..if finite { 3 } else { 2 }]);
    }
    files.compare();
}

#[test]
fn meshes_of_all_kinds_read_alike() {
    let mut files = Files::new();
    let torus = surfaces::torus(14, 18);
    let ways = [
        (GRID, Level::Fast, WHOLE),
        (GRID, Level::Strong, WHOLE),
        (Precision::Exact, Level::Fast, 100),
        (Precision::Exact, Level::Strong, WHOLE),
    ];
    files.encode(&torus, Places::F4, &ways);
    files.encode(&torus, Places::F8, &ways[..2]);
    files.encode(&torus, Places::None, &ways[..2]);
    // Coordinates that repeat, as those of an isosurface.
    let mut lattice = torus.renamed("a lattice");
    for x in lattice.positions.as_flattened_mut() {
        *x = (*x * 4.0).round();
    }
    files.encode(&lattice, Places::F4, &ways);
    let mixture = bench::shuffled(&bench::mixture(8));
    let many = [(GRID, Level::Fast, 50), (GRID, Level::Strong, 200)];
    files.encode(&mixture, Places::F4, &many);
    for seed in 0..6 {
        let mesh = told_apart(zoo::random(seed));
        files.encode(&mesh, Places::F4, &[(Precision::Exact, Level::Fast, WHOLE)]);
    }
    let empty = Mesh::new("nothing", vec![], vec![]);
    files.encode(&empty, Places::F4, &ways[..1]);
    files.compare();
}
