//! Every order in which data-gen writes a mesh, and every kind of mesh in hard orders: the folder
//! must be what the naive oracle says, and byte for byte the same for every way to build it.
//!
//! [`VARIANTS`] lists those ways in one place. Meshes of some thousand triangles are held to the
//! oracle, with chunks and buckets so small that all of it hangs on seams; larger ones are built in
//! the least memory that is accepted, where shuffles go to disk, and compared with a build in
//! ample memory, whose code the small ones have proved.

mod common;

use clap::Parser;
use common::bench::assert_same_files;
use common::compare;
use common::folder::{Folder, files};
use common::mesh::Mesh;
use common::naive::Orient;
use common::npy::Npy;
use common::readers;
use cornermill::Error;
use cornermill::build::{BuildReport, Builder, IndexChoice, Strategy};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A way to build: what it is called, and what it asks of the builder.
type Variant = (&'static str, fn(Builder) -> Builder);

/// The strategies between which a build chooses. One that can be asked for joins here, and every
/// test of this file, in ample memory and in little, runs each.
const STRATEGIES: [Variant; 5] = [
    ("the way that it chooses", |b| b),
    ("by place", |b| b.strategy(Strategy::ByPlace)),
    ("by id", |b| b.strategy(Strategy::ById)),
    ("in memory", |b| b.strategy(Strategy::Memory)),
    ("by contraction", |b| b.strategy(Strategy::Contract)),
];

/// What must not show in the folder besides. A new knob of the builder joins here.
const VARIANTS: [Variant; 7] = [
    ("one thread", |b| b.threads(1)),
    ("chunks of 1", |b| b.threads(2).chunk_triangles(1)),
    ("chunks of 7, 3 buckets", |b| {
        b.threads(1).chunk_triangles(7).buckets(3)
    }),
    ("chunks of 64, 1 bucket", |b| {
        b.threads(3).chunk_triangles(64).buckets(1)
    }),
    ("chunks of 500, many buckets", |b| {
        b.threads(2).chunk_triangles(500).buckets(1000)
    }),
    ("2 MiB", |b| b.threads(1).memory(2 << 20)),
    ("5 MiB, chunks of 64", |b| {
        b.threads(3).memory(5 << 20).chunk_triangles(64)
    }),
];

/// Both widths of ids, and their names.
const WIDTHS: [(&str, IndexChoice); 2] = [("u4", IndexChoice::Auto), ("u8", IndexChoice::U8)];

/// Every order of data-gen.
const ORDERS: [&str; 8] = [
    "coherent",
    "reversed",
    "shuffle-triangles",
    "shuffle-vertices",
    "shuffle",
    "interleaved",
    "strips",
    "sorted-x",
];

/// A mesh that data-gen wrote, in a directory of its own.
struct Input {
    line: String,
    dir: TempDir,
    /// V, or the whole mesh.
    file: PathBuf,
    /// G, where it is a file of its own.
    g: Option<PathBuf>,
}

impl Input {
    /// Makes what a command line of data-gen says, V and G as `.npy`.
    fn new(line: &str) -> Input {
        Input::named("V.npy", line)
    }

    /// Makes it as STL, whose vertices the build must weld.
    fn stl(line: &str) -> Input {
        Input::named("mesh.stl", line)
    }

    fn named(name: &str, line: &str) -> Input {
        let dir = fast_dir();
        let file = dir.path().join(name);
        let words = ["data-gen", "-o", file.to_str().expect("a plain path")];
        let words = words.into_iter().chain(line.split_whitespace());
        let args = data_gen::Args::try_parse_from(words).unwrap_or_else(|e| panic!("{line}: {e}"));
        data_gen::args::run(&args).unwrap_or_else(|e| panic!("{line}: {e}"));
        Input {
            line: format!("{line} as {name}"),
            g: Some(dir.path().join("V.G.npy")).filter(|g| g.exists()),
            file,
            dir,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// A builder with two threads and 64 MiB; variants change that.
    fn builder(&self) -> Builder {
        let builder = Builder::new(&self.file).threads(2).memory(64 << 20);
        let builder = builder.force(true);
        match &self.g {
            Some(g) => builder.positions(g),
            None => builder,
        }
    }

    fn has_positions(&self) -> bool {
        self.g.is_some() || self.file.extension().is_some_and(|e| e == "stl")
    }

    /// The mesh as the oracle takes it.
    fn mesh(&self) -> Mesh {
        if self.file.extension().is_some_and(|e| e == "stl") {
            return readers::read(&self.file).renamed(&self.line);
        }
        let v = Npy::read(&self.file).ids();
        let triangles = v.as_chunks().0.iter();
        let triangles: Vec<[u32; 3]> = triangles.map(|t: &[u64; 3]| t.map(|v| v as u32)).collect();
        let positions = if let Some(g) = &self.g {
            let words = Npy::read(g).data;
            let numbers = words.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
            let numbers: Vec<f32> = numbers.collect();
            numbers.as_chunks().0.to_vec()
        } else {
            let count = triangles.as_flattened().iter().max().map_or(0, |v| v + 1);
            vec![[0.0; 3]; count as usize]
        };
        Mesh::new(&self.line, triangles, positions)
    }

    /// The oracle's answer at both widths, and the same bytes from every variant.
    fn check(&self) {
        let mesh = self.mesh();
        let has_positions = self.has_positions();
        let positions = has_positions.then_some(&mesh.positions[..]);
        let mut answer = None;
        for (index, width) in WIDTHS {
            let out = self.path("expected.ct");
            let builder = self.builder().index(width);
            build(&builder, &out, &self.line);
            let folder = Folder::read(&out);
            let answer = answer.get_or_insert_with(|| {
                compare::answer(&folder, &mesh, has_positions, Orient::Outward)
            });
            let wrong = compare::differences(&folder, answer, positions, index);
            assert!(
                wrong.is_empty(),
                "{}, {index}:\n{}",
                self.line,
                wrong.join("\n")
            );
            let expected = files(&out);
            for (name, strategy) in STRATEGIES {
                for (more, variant) in VARIANTS {
                    let how = format!("{}, {index}, {name}, {more}", self.line);
                    let out = self.path("found.ct");
                    build(&variant(strategy(builder.clone())), &out, &how);
                    assert_same_files(&files(&out), &expected, &how);
                }
            }
        }
    }

    /// The same bytes in ample memory and in at most a quarter of the mesh's bytes, or else in
    /// the least that is accepted, on so many threads. Gives the least scratch that one of the
    /// small builds took.
    fn check_in_little(&self, threads: usize) -> u64 {
        let input = [Some(&self.file), self.g.as_ref()].into_iter().flatten();
        let bytes: u64 = input.map(|f| f.metadata().map_or(0, |m| m.len())).sum();
        let quarter = bytes / 4;
        let mut scratch = u64::MAX;
        for (index, width) in WIDTHS {
            let out = self.path("expected.ct");
            let builder = self.builder().index(width);
            build(&builder.clone().memory(512 << 20), &out, &self.line);
            let expected = files(&out);
            let builder = builder.threads(threads);
            for (name, strategy) in STRATEGIES {
                let how = format!("{}, {index}, {name}, {threads} threads", self.line);
                let out = self.path("found.ct");
                let cost = build_in_least(&strategy(builder.clone()), quarter, &out, &how);
                assert_same_files(&files(&out), &expected, &how);
                scratch = scratch.min(cost.peak_scratch);
            }
        }
        scratch
    }
}

/// A directory in memory where the system has one: every build syncs its files, and on a disk the
/// thousand builds of this file would spend their time waiting for that.
fn fast_dir() -> TempDir {
    tempfile::tempdir_in("/dev/shm")
        .or_else(|_| tempfile::tempdir())
        .expect("a temporary directory")
}

fn build(builder: &Builder, out: &Path, how: &str) -> BuildReport {
    builder.build(out).unwrap_or_else(|e| panic!("{how}: {e}"))
}

/// Builds in `memory` bytes, or else in what the refusal names, or a tenth more as long as that is
/// refused too.
fn build_in_least(builder: &Builder, mut memory: u64, out: &Path, how: &str) -> BuildReport {
    for _ in 0..100 {
        match builder.clone().memory(memory).build(out) {
            Ok(report) => return report,
            Err(Error::Budget { need, .. }) => memory = need.max(memory / 10 * 11),
            Err(e) => panic!("{how} in {memory} bytes: {e}"),
        }
    }
    panic!("{how}: no budget is accepted, not even {memory} bytes");
}

#[test]
fn every_order_of_a_closed_surface_with_flips() {
    for (seed, order) in ORDERS.iter().enumerate() {
        let options = format!("--order {order} --flip 0.3 --seed {seed}");
        Input::new(&format!("sphere --triangles 2k {options}")).check();
    }
}

#[test]
fn every_order_of_a_surface_with_faults() {
    for (seed, order) in ORDERS.iter().enumerate() {
        let options = format!("--order {order} --flip 0.4 --seed {seed}");
        Input::new(&format!("torus --size 23x41 --defects=3 {options}")).check();
    }
}

#[test]
fn every_order_without_coordinates() {
    for (seed, order) in ORDERS.iter().enumerate() {
        let options = format!("--order {order} --flip 0.3 --seed {seed}");
        Input::new(&format!("blobs -t 1k --blobs 9 --no-positions {options}")).check();
    }
}

#[test]
fn borders_and_what_cannot_be_oriented_in_hard_orders() {
    for kind in ["terrain", "moebius", "klein"] {
        for order in ["shuffle", "strips", "shuffle-vertices", "interleaved"] {
            for faults in [0, 2] {
                let options = format!("--order {order} --flip 0.3 --defects={faults}");
                Input::new(&format!("{kind} --triangles 1k {options}")).check();
            }
        }
    }
}

#[test]
fn many_components_in_hard_orders() {
    for line in [
        "blobs -t 1k --blobs 30",
        "blobs -t 1k --blobs 7 --defects=3",
        "soup -t 300",
        "soup -t 200 --defects=5",
    ] {
        for order in ["coherent", "shuffle", "strips", "reversed"] {
            Input::new(&format!("{line} --order {order} --flip 0.3")).check();
        }
    }
}

#[test]
fn hubs_in_hard_orders() {
    for line in ["fan -t 400", "cone -t 400", "book -t 250", "stack -t 200"] {
        for order in ["coherent", "shuffle", "strips"] {
            for faults in [0, 4] {
                let options = format!("--order {order} --flip 0.3 --defects={faults}");
                Input::new(&format!("{line} {options}")).check();
            }
        }
    }
}

#[test]
fn welded_surfaces_and_soups_in_hard_orders() {
    for line in ["sphere -t 1k --defects=2", "terrain -t 1k", "soup -t 200"] {
        for order in ["coherent", "shuffle", "strips", "reversed"] {
            Input::stl(&format!("{line} --order {order} --flip 0.3")).check();
        }
    }
}

#[test]
fn welding_in_little_memory() {
    for line in ["sphere -t 60k", "soup -t 30k"] {
        let input = Input::stl(&format!("{line} --order shuffle --flip 0.3"));
        let scratch = input.check_in_little(2);
        assert!(scratch > 1 << 18, "{line}: nothing spilled");
    }
}

#[test]
fn every_order_in_little_memory() {
    for order in ORDERS {
        let flips = if order == "coherent" { 0.0 } else { 0.3 };
        let input = Input::new(&format!("sphere -t 60k --order {order} --flip {flips}"));
        let scratch = input.check_in_little(1);
        if ["shuffle", "shuffle-triangles"].contains(&order) {
            assert!(scratch > 1 << 18, "{order}: nothing spilled");
        }
    }
}

#[test]
fn hubs_and_crowds_in_little_memory() {
    for line in [
        "fan -t 40k",
        "cone -t 40k",
        "book -t 40k",
        "stack -t 40k",
        "soup -t 40k",
        "blobs -t 50k --defects=50",
        "klein -t 50k --defects=50",
    ] {
        let input = Input::new(&format!("{line} --order shuffle --flip 0.3"));
        let scratch = input.check_in_little(2);
        assert!(scratch > 1 << 18, "{line}: nothing spilled");
    }
}

/// Cells by id refuse what does not fit them, and name what suffices: the next build, in that, is one.
#[test]
fn the_least_budget_that_cells_by_id_name_suffices() {
    let mut refused = 0;
    for line in ["sphere -t 60k", "soup -t 40k"] {
        let input = Input::new(&format!("{line} --order shuffle"));
        for (how, given) in [("with", &input.g), ("without", &None)] {
            for threads in [1, 2] {
                let mut builder = Builder::new(&input.file).strategy(Strategy::ById);
                builder = builder.threads(threads).checkpoint(None).force(true);
                builder = match given {
                    Some(g) => builder.positions(g),
                    None => builder,
                };
                let how = format!("{line} {how} coordinates on {threads} threads");
                let out = input.path("out.ct");
                // The least for any mesh, which goes in file order when cells do not fit.
                let least = match builder.clone().memory(1 << 20).build(&out) {
                    Err(Error::Budget { need, .. }) => need,
                    other => panic!("{how}: {other:?}"),
                };
                let mut memory = least;
                while let Err(refusal) = builder.clone().memory(memory).build(&out) {
                    let Error::Budget { need, .. } = refusal else {
                        panic!("{how} in {memory} bytes: {refusal}");
                    };
                    let built = builder.clone().memory(need).build(&out);
                    let report = built.unwrap_or_else(|e| {
                        panic!("{how}: named in {memory} bytes, and then refused: {e}")
                    });
                    assert!(report.peak_budget <= need, "{how}");
                    refused += 1;
                    memory += memory / 16;
                }
            }
        }
    }
    assert!(refused > 3, "{refused} refusals");
}
