//! The compressed file: what is encoded comes back, the bytes are always the same, and what is no
//! such file is refused.

#[path = "../common/mod.rs"]
mod common;
mod decoder;
mod golden;
mod order;
mod part;
mod refusals;

use common::formats::write_npy;
use common::mesh::Mesh;
use common::npy::Npy;
use common::readers;
use common::run::cornermill;
use common::{bench, surfaces, zoo};
use cornermill::build::{Builder, IndexChoice};
use cornermill::codec::Level;
use cornermill::codec::decode::decode;
use cornermill::codec::encode::{EncodeCount, EncodeRequest, encode};
use cornermill::codec::grid::Precision;
use cornermill::codec::packed::Packed;
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::Folder;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// What a run may use.
fn workspace(dir: &Path, memory: u64, threads: usize) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io).unwrap(),
        io,
        workers: Workers::new(threads).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

/// A folder of its own for a mesh, built.
struct Case {
    dir: TempDir,
    folder: PathBuf,
}

impl Case {
    fn new(mesh: &Mesh, index: IndexChoice) -> Case {
        let dir = tempfile::tempdir().unwrap();
        let (v, g) = write_npy(mesh, dir.path());
        let folder = dir.path().join("mesh.ct");
        let builder = Builder::new(v).positions(g).memory(64 << 20).threads(2);
        builder.index(index).build(&folder).unwrap();
        Case { dir, folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Encodes into `name`, with chunks of `most` triangles.
    fn encode(
        &self,
        name: &str,
        (precision, level, most): (Precision, Level, u64),
        (memory, threads): (u64, usize),
    ) -> EncodeCount {
        let ws = workspace(self.dir.path(), memory, threads);
        let mut request = EncodeRequest::new(self.path(name), precision);
        (request.level, request.most, request.force) = (level, most, true);
        let folder = Folder::open(&self.folder, &ws.io).unwrap();
        let count = encode(&ws, &folder, &request).unwrap();
        assert_eq!(ws.budget.used(), 0, "the budget is not given back");
        count
    }

    /// Decodes `name`: V, and the rows of G as bytes.
    fn decode(&self, name: &str, threads: usize) -> (Vec<[u64; 3]>, Vec<Vec<u8>>) {
        let ws = workspace(self.dir.path(), 64 << 20, threads);
        let (v, g) = (self.path("back.V.npy"), self.path("back.G.npy"));
        [&v, &g].iter().for_each(|f| _ = std::fs::remove_file(f));
        let packed = Packed::open(&ws.budget, &ws.io, &self.path(name)).unwrap();
        decode(&ws, &packed, &v, &g).unwrap();
        drop(packed);
        assert_eq!(ws.budget.used(), 0, "the budget is not given back");
        (triangles(&v), rows(&g))
    }
}

fn triangles(path: &Path) -> Vec<[u64; 3]> {
    Npy::read(path).ids().as_chunks::<3>().0.to_vec()
}

fn rows(path: &Path) -> Vec<Vec<u8>> {
    let bytes = std::fs::read(path).unwrap();
    bytes[4096..].chunks_exact(12).map(<[u8]>::to_vec).collect()
}

/// Triangles turned so that the least vertex comes first, sorted.
fn canonical(mut triangles: Vec<[u64; 3]>) -> Vec<[u64; 3]> {
    for t in &mut triangles {
        let turns = [*t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
        *t = turns.into_iter().min().unwrap();
    }
    triangles.sort_unstable();
    triangles
}

/// The mesh with a first coordinate that tells its vertices apart.
fn told_apart(mut mesh: Mesh) -> Mesh {
    for (v, p) in mesh.positions.iter_mut().enumerate() {
        p[0] = (v * 7919 % 1024 + v / 1024 * 1024) as f32 - 37.0;
    }
    mesh
}

/// Everything of the folder must come back: the same vertices, and the same triangles over them.
fn comes_back(mesh: &Mesh, most: u64, level: Level) -> EncodeCount {
    let case = Case::new(mesh, IndexChoice::Auto);
    let count = case.encode("m.cmz", (Precision::Exact, level, most), (64 << 20, 2));
    let (found, points) = case.decode("m.cmz", 2);
    let expected_points = rows(&case.folder.join("G.npy"));
    let ids: BTreeMap<&[u8], u64> = expected_points.iter().map(|p| &p[..]).zip(0..).collect();
    assert_eq!(ids.len(), expected_points.len(), "{}", mesh.name);
    let back: Vec<u64> = points.iter().map(|p| ids[&p[..]]).collect();
    let mut all = back.clone();
    all.sort_unstable();
    assert!(all.into_iter().eq(0..ids.len() as u64), "{}", mesh.name);
    let found = found.into_iter().map(|t| t.map(|v| back[v as usize]));
    let expected = triangles(&case.folder.join("V.npy"));
    assert_eq!(
        canonical(found.collect()),
        canonical(expected),
        "{}",
        mesh.name
    );
    count
}

#[test]
fn the_zoo_comes_back_in_one_chunk_and_in_many() {
    for mesh in zoo::all() {
        let mesh = told_apart(mesh);
        for (most, level) in [
            (1 << 20, Level::Fast),
            (1 << 20, Level::Strong),
            (3, Level::Fast),
        ] {
            comes_back(&mesh, most, level);
        }
    }
}

#[test]
fn seams_are_shared_whatever_the_order() {
    let mesh = told_apart(bench::mixture(12));
    for (mesh, most) in [(bench::shuffled(&mesh), 50), (mesh, 200)] {
        for level in [Level::Fast, Level::Strong] {
            let count = comes_back(&mesh, most, level);
            let least = mesh.triangles.len() as u64 / most;
            assert!(
                count.chunks > least && count.references > count.chunks,
                "{count:?}"
            );
        }
    }
}

#[test]
fn a_grid_rounds_to_its_nodes() {
    let mesh = told_apart(surfaces::torus(20, 30).plus(&surfaces::moebius(9)));
    let case = Case::new(&mesh, IndexChoice::Auto);
    let corners = |v: &[[u64; 3]], g: &[Vec<u8>], scale: &dyn Fn(f64, usize) -> i64| {
        let at = |v: u64| {
            let row = g[v as usize].as_chunks::<4>().0;
            [0, 1, 2].map(|k| scale(f64::from(f32::from_le_bytes(row[k])), k) as u64)
        };
        let mut all: Vec<[[u64; 3]; 3]> = v.iter().map(|t| t.map(at)).collect();
        for t in &mut all {
            let turns = [*t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]];
            *t = turns.into_iter().min().unwrap();
        }
        all.sort_unstable();
        all
    };
    let (v, g) = (
        triangles(&case.folder.join("V.npy")),
        rows(&case.folder.join("G.npy")),
    );
    let axis = |k: usize| mesh.positions.iter().map(move |p| f64::from(p[k]));
    let low = [0, 1, 2].map(|k| axis(k).fold(f64::INFINITY, f64::min));
    let high = [0, 1, 2].map(|k| axis(k).fold(f64::NEG_INFINITY, f64::max));
    let extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    for (precision, step) in [
        (Precision::Bits(11), extent / 2047.0),
        (Precision::Bits(16), extent / 65535.0),
        (Precision::Step(0.125), 0.125),
    ] {
        case.encode("m.cmz", (precision, Level::Fast, 100), (64 << 20, 2));
        let (back, points) = case.decode("m.cmz", 1);
        let node = |x: f64, k: usize| ((x - low[k]) / step).round() as i64;
        let exact = |x: f64, k: usize| ((x - low[k]) / step + 0.5).floor() as i64;
        assert_eq!(
            corners(&back, &points, &node),
            corners(&v, &g, &exact),
            "{precision:?}"
        );
    }
}

#[test]
fn threads_memory_and_index_width_do_not_show() {
    let mesh = bench::shuffled(&told_apart(bench::mixture(16)));
    for level in [Level::Fast, Level::Strong] {
        let wish = (Precision::Bits(12), level, 150);
        let narrow = Case::new(&mesh, IndexChoice::Auto);
        narrow.encode("expected.cmz", wish, (256 << 20, 1));
        let expected = std::fs::read(narrow.path("expected.cmz")).unwrap();
        let wide = Case::new(&mesh, IndexChoice::U8);
        for case in [&narrow, &wide] {
            for room in [(64 << 20, 2), (256 << 20, 5), (40 << 20, 3)] {
                case.encode("found.cmz", wish, room);
                let found = std::fs::read(case.path("found.cmz")).unwrap();
                assert!(found == expected, "{level:?} with {room:?}");
            }
        }
        let one = narrow.decode("expected.cmz", 1);
        assert!(one == narrow.decode("expected.cmz", 5));
    }
}

#[test]
fn the_commands_go_there_and_back() {
    let mesh = told_apart(surfaces::torus(8, 12).plus(&surfaces::moebius(9)));
    let case = Case::new(&mesh, IndexChoice::Auto);
    let path = |name: &str| case.path(name).display().to_string();
    let (folder, file) = (path("mesh.ct"), path("m.cmz"));
    let refused = cornermill(["encode", &folder, "-o", &file]).expect(2);
    assert!(refused.stderr.contains("--exact"), "{}", refused.stderr);
    cornermill(["encode", &folder, "-o", &file, "--exact", "-q"]).expect(0);
    cornermill(["encode", &folder, "-o", &file, "--bits", "12"]).expect(2);
    let said = cornermill(["info", &file]).expect(0).stdout;
    assert!(
        said.contains("connectivity") && said.contains("positions"),
        "{said}"
    );
    cornermill(["decode", &file, "-o", &path("back.ct"), "-q"]).expect(0);
    cornermill(["verify", &path("back.ct")]).expect(0);
    cornermill(["decode", &file, "-o", &path("back.ct")]).expect(2);
    for name in ["back.ply", "back.npy", "back.obj"] {
        cornermill(["decode", &file, "-o", &path(name), "-q"]).expect(0);
        cornermill([
            "build",
            &path(name),
            "-o",
            &path("again.ct"),
            "-q",
            "--force",
        ])
        .expect(0);
    }
    // Beside NAME.npy its coordinates are written, which must be neither there nor the input.
    std::fs::copy(&file, case.path("own.G.npy")).unwrap();
    let own = [&path("own.G.npy"), "-o", &path("own.npy"), "-q"];
    for force in [&[][..], &["--force"]] {
        let words = ["decode"].iter().chain(force);
        let words = words.map(|w| (*w).to_owned()).chain(own.map(Into::into));
        let refused = cornermill(words).expect(2);
        let why = "is the input";
        assert!(refused.stderr.contains(why), "{}", refused.stderr);
    }
    let leftovers = std::fs::read_dir(case.dir.path()).unwrap();
    let hidden = |f: &std::fs::DirEntry| f.file_name().to_string_lossy().starts_with('.');
    assert_eq!(leftovers.filter(|f| hidden(f.as_ref().unwrap())).count(), 0);
}

/// Bits of coordinates jump where these change sign; no prediction may leave what a number holds.
#[test]
fn exact_coordinates_around_the_origin_come_back() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut mesh = readers::read(&path.join("tests/meshes/vtkdata_Apache2/turbineblade.ply"));
    let count = mesh.positions.len() as f64;
    for k in 0..3 {
        let mean = mesh.positions.iter().map(|p| f64::from(p[k])).sum::<f64>() / count;
        let centred = |p: &mut [f32; 3]| p[k] = (f64::from(p[k]) - mean) as f32;
        mesh.positions.iter_mut().for_each(centred);
    }
    let case = Case::new(&mesh, IndexChoice::Auto);
    let corners = |v: Vec<[u64; 3]>, g: &[Vec<u8>]| {
        let mut all: Vec<Vec<u8>> = v
            .as_flattened()
            .iter()
            .map(|&v| g[v as usize].clone())
            .collect();
        all.sort_unstable();
        all
    };
    let g = rows(&case.folder.join("G.npy"));
    let expected = corners(triangles(&case.folder.join("V.npy")), &g);
    for level in [Level::Fast, Level::Strong] {
        case.encode("m.cmz", (Precision::Exact, level, 1 << 20), (256 << 20, 2));
        let (v, g) = case.decode("m.cmz", 2);
        assert!(corners(v, &g) == expected, "{level:?}");
    }
}

#[test]
fn a_folder_is_not_written_into() {
    let case = Case::new(&told_apart(surfaces::cube()), IndexChoice::Auto);
    let path = |name: &str| case.path(name).display().to_string();
    let (folder, inside) = (path("mesh.ct"), path("mesh.ct/m.cmz"));
    for (target, why) in [(&inside, "mesh folder"), (&folder, "is the input")] {
        let args = ["encode", &folder, "-o", target, "--bits", "12", "--force"];
        let refused = cornermill(args).expect(2);
        assert!(refused.stderr.contains(why), "{}", refused.stderr);
    }
    cornermill(["verify", &folder]).expect(0);
}
