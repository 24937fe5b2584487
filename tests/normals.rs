//! Normals against brute force in f64, on the zoo and on random meshes, both ways; and the same
//! bytes for every way, budget, number of threads, chunk size and width of ids.

mod common;
#[path = "normals/naive.rs"]
mod naive;
#[path = "normals/refusals.rs"]
mod refusals;

use common::formats::write_npy;
use common::mesh::Mesh;
use common::npy::Npy;
use common::run::cornermill;
use common::{folder, random::Random, surfaces, zoo};
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::Folder;
use cornermill::measure::normals::{NormalsCount, NormalsRequest, Way, least_memory, normals};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A built folder in a directory of its own.
struct Home {
    dir: tempfile::TempDir,
    folder: PathBuf,
}

/// How normals are computed; none of it may show.
#[derive(Clone, Copy, Debug)]
struct How {
    memory: u64,
    threads: usize,
    way: Way,
    chunk: Option<u64>,
}

const AMPLE: How = How {
    memory: 64 << 20,
    threads: 2,
    way: Way::Auto,
    chunk: None,
};

impl Home {
    fn of(mesh: &Mesh, options: &[&str]) -> Home {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("m.ct");
        let (v, g) = write_npy(mesh, dir.path());
        let mut args = vec!["build".into(), v.into_os_string(), "--positions".into()];
        args.extend([g.into_os_string(), "-o".into(), (&folder).into()]);
        args.extend(["--memory", "64MiB", "--quiet"].map(Into::into));
        args.extend(options.iter().map(Into::into));
        cornermill(args).expect(0);
        Home { dir, folder }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Normals of vertices and triangles, as bytes, what was counted, and the most scratch used.
    fn normals(&self, how: How) -> (Vec<Vec<u8>>, NormalsCount, u64) {
        let ws = workspace(self.dir.path(), how);
        let folder = Folder::open(&self.folder, &ws.io).unwrap();
        let request = NormalsRequest {
            triangles: Some(self.file("NT.npy")),
            force: true,
            way: how.way,
            chunk: how.chunk,
            ..NormalsRequest::new(self.file("N.npy"))
        };
        let count = normals(&ws, &folder, &request).unwrap_or_else(|e| panic!("{how:?}: {e}"));
        assert_eq!(ws.budget.used(), 0, "{how:?}");
        assert!(ws.budget.peak() <= how.memory, "{how:?}");
        let files = count.files.iter().map(|f| std::fs::read(f).unwrap());
        (files.collect(), count.clone(), ws.scratch.peak())
    }
}

fn workspace(dir: &Path, how: How) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(how.memory),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io).unwrap(),
        io,
        workers: Workers::new(how.threads).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

/// The rows of a file of normals.
fn rows(bytes: &[u8]) -> Vec<[f64; 3]> {
    let npy = Npy::parse(bytes).unwrap();
    assert_eq!((npy.dtype().as_str(), npy.shape[1]), ("f4", 3));
    let number = |b: &[u8]| f64::from(f32::from_le_bytes(b.try_into().unwrap()));
    let numbers: Vec<f64> = npy.data.chunks_exact(4).map(number).collect();
    numbers.chunks(3).map(|p| [p[0], p[1], p[2]]).collect()
}

fn assert_close(found: &[[f64; 3]], expected: &[[f64; 3]], what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        let apart = (0..3).map(|k| (found[k] - expected[k]).abs());
        let near = apart.fold(0.0, f64::max) <= 1e-6;
        assert!(near, "{what}: row {i} is {found:?}, expected {expected:?}");
    }
}

/// Compares both ways with brute force, and with each other byte for byte.
fn check(mesh: &Mesh, options: &[&str], random: &mut Random) {
    let home = Home::of(mesh, options);
    let expected = naive::expected(&folder::Folder::read(&home.folder));
    let (files, count, _) = home.normals(AMPLE);
    assert_close(&rows(&files[0]), &expected.vertices, &mesh.name);
    assert_close(&rows(&files[1]), &expected.triangles, &mesh.name);
    let counted = (count.vertices, count.zero, count.nonfinite_triangles);
    let vertices = expected.vertices.len() as u64;
    assert_eq!(
        counted,
        (vertices, expected.zero, expected.nonfinite),
        "{}",
        mesh.name
    );
    let how = How {
        way: Way::Chunks,
        chunk: Some(*random.pick(&[1, 2, 3, 7, 16, 64, 1000])),
        threads: *random.pick(&[1, 2, 3]),
        ..AMPLE
    };
    let (others, other, _) = home.normals(how);
    assert!(others == files, "{}: other bytes by {how:?}", mesh.name);
    assert_eq!(other, count, "{}: {how:?}", mesh.name);
}

#[test]
fn the_zoo_and_the_zoo_disturbed() {
    let mut random = Random::new(1);
    for mesh in zoo::all() {
        check(&mesh, &[], &mut random);
        let mut disturbed = mesh.clone().renamed(&format!("{}, disturbed", mesh.name));
        disturbed.flip_some(&mut random, 40);
        disturbed.rotate_corners(&mut random);
        disturbed.shuffle(&mut random);
        check(&disturbed, &["--index", "u8"], &mut random);
    }
}

#[test]
fn random_meshes() {
    let mut random = Random::new(2);
    for seed in 0..120 {
        let options: &[&str] = match seed % 3 {
            0 => &["--orient", "keep"],
            1 => &["--index", "u8"],
            _ => &[],
        };
        check(&zoo::random(seed), options, &mut random);
    }
}

/// Budgets from the least accepted up, threads, chunks, both ways.
fn variations() -> Vec<How> {
    let mut all = Vec::new();
    for threads in [1, 2, 5] {
        let least = least_memory(threads);
        for (memory, way, chunk) in [
            (least, Way::Auto, None),
            (least, Way::Chunks, None),
            (least, Way::Chunks, Some(100)),
            (2 * least, Way::Chunks, None),
            (64 << 20, Way::Auto, None),
            (64 << 20, Way::Chunks, Some(64)),
            (64 << 20, Way::Chunks, None),
        ] {
            all.push(How {
                memory,
                threads,
                way,
                chunk,
            });
        }
    }
    all
}

/// Orders in which a chunk finds its positions in one place, in a few, or by asking; vertices that
/// no other chunk names but that lie scattered; and a hub that all triangles share.
fn orders() -> Vec<Mesh> {
    let coherent = surfaces::torus(120, 90);
    let mut shuffled = coherent.clone().renamed("shuffled torus");
    shuffled.shuffle(&mut Random::new(3));
    let both = coherent.clone().plus(&coherent.clone().moved([9.0; 3]));
    let (one, other) = both.triangles.split_at(coherent.triangles.len());
    let woven = one.iter().zip(other).flat_map(|(a, b)| [*a, *b]).collect();
    let woven = Mesh::new("two tori, woven", woven, both.positions);
    let mut soup = surfaces::soup(8000).renamed("shuffled soup");
    soup.shuffle(&mut Random::new(4));
    let hub = surfaces::disk(30_000).renamed("a hub");
    vec![coherent, shuffled, woven, soup, hub, uneven_hub()]
}

/// Triangles of very different sizes around one vertex: what their sum is depends on its order.
fn uneven_hub() -> Mesh {
    let mut random = Random::new(6);
    let mut positions = vec![[0f32; 3]];
    for _ in 0..12_000 {
        let size = 2f32.powi(random.below(60) as i32 - 30);
        positions.extend([0; 2].map(|_| [0; 3].map(|_| size * random.coordinate())));
    }
    // Each from both sides: what is left at the hub is nothing but what was rounded off.
    let sides = |t: u32| [[0, 2 * t + 1, 2 * t + 2], [0, 2 * t + 2, 2 * t + 1]];
    let mut triangles: Vec<[u32; 3]> = (0..12_000).flat_map(sides).collect();
    random.shuffle(&mut triangles);
    Mesh::new("a hub of uneven triangles", triangles, positions)
}

#[test]
fn the_uneven_hub_tells_orders_apart() {
    let home = Home::of(&uneven_hub(), &[]);
    let folder = folder::Folder::read(&home.folder);
    let other = naive::Expected::backward(&folder);
    let apart = |a: [f64; 3], b: [f64; 3]| a.map(|x| x as f32) != b.map(|x| x as f32);
    assert!(apart(
        naive::expected(&folder).vertices[0],
        other.vertices[0]
    ));
}

#[test]
fn nothing_but_the_mesh_shows() {
    for mesh in orders() {
        let home = Home::of(&mesh, &[]);
        let (expected, count, scratch) = home.normals(AMPLE);
        assert_eq!(scratch, 0, "all fits in memory");
        let naive = naive::expected(&folder::Folder::read(&home.folder));
        assert_close(&rows(&expected[0]), &naive.vertices, &mesh.name);
        for how in variations() {
            let (found, other, _) = home.normals(how);
            assert!(found == expected, "{}: other bytes by {how:?}", mesh.name);
            assert_eq!(other, count, "{}: {how:?}", mesh.name);
        }
        let wide = Home::of(&mesh, &["--index", "u8"]);
        for how in [AMPLE, variations()[1]] {
            let found = wide.normals(how).0;
            assert!(
                found == expected,
                "{}: other bytes by u8, {how:?}",
                mesh.name
            );
        }
    }
}

/// G is four times the budget and more, and V in random order: everything goes through scratch.
#[test]
fn coordinates_far_larger_than_the_budget() {
    let mut mesh = surfaces::torus(840, 840);
    mesh.shuffle(&mut Random::new(5));
    let home = Home::of(&mesh, &[]);
    let how = How {
        memory: least_memory(1),
        threads: 1,
        ..AMPLE
    };
    let g = 12 * mesh.positions.len() as u64;
    assert!(g >= 4 * how.memory, "G has {g} bytes");
    let (found, _, scratch) = home.normals(how);
    // A position for each corner, and a cross product.
    assert!(scratch >= 4 * g, "{scratch} bytes of scratch");
    assert!(home.normals(AMPLE).0 == found);
}
