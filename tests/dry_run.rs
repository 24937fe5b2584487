//! `build --dry-run`: it makes nothing, and says beforehand what a build really takes.

mod common;

use common::formats::{self, Order};
use common::mesh::Mesh;
use common::random::Random;
use common::run::{Run, cornermill};
use common::surfaces;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// 50 000 triangles: one closed component in the order of a grid, outward.
fn coherent() -> Mesh {
    surfaces::torus(125, 200).inverted()
}

/// 200 000 triangles: enough that buffers and shares of them no longer outweigh the mesh.
fn larger() -> Mesh {
    surfaces::torus(250, 400).inverted()
}

/// The same mesh at random, ids too.
fn shuffled(mesh: Mesh) -> Mesh {
    let mut mesh = mesh.renamed("shuffled");
    mesh.shuffle(&mut Random::new(7));
    mesh
}

/// Writes the mesh in a format; returns the arguments that name it.
fn written(mesh: &Mesh, format: &str, dir: &Path) -> Vec<OsString> {
    let path = dir.join(format!("mesh.{format}"));
    let bytes = match format {
        "npy" => {
            let (v, g) = formats::write_npy(mesh, dir);
            return vec![v.into(), "--positions".into(), g.into()];
        }
        "ply" => formats::ply_binary(mesh, Order::Big),
        "ascii.ply" => formats::ply_ascii(mesh),
        "stl" => formats::stl_binary(mesh, "solid or not"),
        "ascii.stl" => formats::stl_ascii(mesh, "\n", 3),
        "obj" => formats::obj(mesh),
        _ => formats::off(mesh),
    };
    std::fs::write(&path, bytes).expect("a mesh is written");
    vec![path.into()]
}

/// Every file below `dir` with its length and time.
fn listing(dir: &Path) -> BTreeMap<PathBuf, (u64, std::time::SystemTime)> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(dir).expect("a folder is read") {
        let path = entry.expect("an entry").path();
        let meta = path.symlink_metadata().expect("metadata");
        if meta.is_dir() {
            all.extend(listing(&path));
        }
        all.insert(path, (meta.len(), meta.modified().expect("a time")));
    }
    all
}

/// One mesh in one format, built into a folder of its own.
struct Case {
    dir: tempfile::TempDir,
    input: Vec<OsString>,
}

impl Case {
    fn new(mesh: &Mesh, format: &str) -> Case {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let input = written(mesh, format, dir.path());
        Case { dir, input }
    }

    fn output(&self) -> PathBuf {
        self.dir.path().join("out.ct")
    }

    fn build(&self, options: &[&str]) -> Run {
        let mut args: Vec<OsString> = vec!["build".into()];
        args.extend(self.input.iter().cloned());
        args.extend(["-o".into(), self.output().into(), "--progress=none".into()]);
        args.extend(options.iter().map(OsString::from));
        cornermill(args)
    }

    /// The prediction, after which everything must be as before.
    fn predict(&self, options: &[&str], code: i32) -> Value {
        let before = listing(self.dir.path());
        let run = self.build(&[options, &["--dry-run", "--json"]].concat());
        assert_eq!(listing(self.dir.path()), before, "{run}");
        let run = run.expect(code);
        serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}\n{run}"))
    }

    fn report(&self, options: &[&str]) -> Value {
        let run = self.build(&[options, &["--force", "--json"]].concat());
        let run = run.expect(0);
        serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}\n{run}"))
    }
}

fn number(value: &Value, path: &str) -> u64 {
    let found = value.pointer(path).and_then(Value::as_u64);
    found.unwrap_or_else(|| panic!("no number {path} in {value}"))
}

/// Panics unless `guess` is within `percent` of `truth`.
#[track_caller]
fn near(what: &str, guess: u64, truth: u64, percent: u64) {
    let off = guess.abs_diff(truth);
    assert!(
        100 * off <= percent * truth,
        "{what}: predicted {guess}, was {truth}"
    );
}

#[test]
fn output_is_foretold_for_every_format() {
    for format in ["npy", "ply", "ascii.ply", "stl", "ascii.stl", "obj", "off"] {
        let case = Case::new(&coherent(), format);
        let guess = case.predict(&[], 0);
        let report = case.report(&[]);
        let files = listing(&case.output());
        let total: u64 = files.values().map(|(bytes, _)| bytes).sum();
        near(format, number(&guess, "/output/bytes"), total, 20);
        near(format, number(&guess, "/triangles"), 50_000, 5);
        near(format, number(&guess, "/vertices"), 25_000, 5);
        assert_eq!(guess["format"], report["format"]);
        if format == "npy" || format == "ply" {
            assert_eq!(guess["exact"], true);
            assert_eq!(guess["output"]["arrays"], report["arrays"], "{format}");
        }
    }
}

#[test]
fn scratch_is_bounded_whatever_the_order() {
    for (mesh, worst) in [(coherent(), false), (shuffled(coherent()), true)] {
        for format in ["npy", "ply", "stl"] {
            let case = Case::new(&mesh, format);
            for options in [
                &["--memory=1GiB", "--threads=2"][..],
                &["--memory=1GiB", "--threads=2", "--chunk-triangles=1000"],
                &["--memory=1GiB", "--threads=1", "--chunk-triangles=7000"],
                &["--memory=3MiB", "--threads=1", "--weld"],
                &["--memory=6MiB", "--threads=3", "--coords=f8", "--index=u8"],
                &["--memory=1GiB", "--threads=2", "--strategy=contract"],
            ] {
                let guess = case.predict(options, 0);
                let real = number(&case.report(options), "/build/peak_scratch");
                let all = number(&guess, "/scratch/worst_order");
                let what = format!("{} as {format}, {options:?}", mesh.name);
                assert!(real <= all, "{what}: {real} beyond {all}");
                if !worst {
                    let few = number(&guess, "/scratch/coherent");
                    assert!(real <= few, "{what}: {real} beyond {few}");
                    assert!(few <= all, "{what}");
                }
            }
        }
    }
}

#[test]
fn the_bounds_of_scratch_are_not_idle() {
    let options = ["--memory=16MiB", "--threads=2"];
    for (mesh, key) in [
        (larger(), "/scratch/coherent"),
        (shuffled(larger()), "/scratch/worst_order"),
    ] {
        let case = Case::new(&mesh, "ply");
        let guess = number(&case.predict(&options, 0), key);
        let real = number(&case.report(&options), "/build/peak_scratch");
        assert!(guess <= 2 * real, "{}: {guess} for {real}", mesh.name);
    }
}

#[test]
fn passes_are_foretold_with_what_they_move() {
    // One chunk leaves nothing to guess; what many spill is bounded from above.
    let one = ("--chunk-triangles=200000", 10);
    let many = ("--chunk-triangles=4000", 50);
    for (format, (chunk, percent)) in [("npy", one), ("ply", one), ("npy", many), ("stl", many)] {
        let case = Case::new(&larger(), format);
        let options = ["--memory=1GiB", "--threads=2", chunk];
        let (guess, report) = (case.predict(&options, 0), case.report(&options));
        let passes = |value: &Value| value.as_array().expect("passes").clone();
        let guess = passes(&guess["passes"]);
        let real = passes(&report["build"]["passes"]);
        let names = |passes: &[Value]| passes.iter().map(|p| p["name"].clone()).collect::<Vec<_>>();
        assert_eq!(names(&guess), names(&real));
        for key in ["read", "written"] {
            let sum = |passes: &[Value]| passes.iter().map(|p| number(p, &format!("/{key}"))).sum();
            let what = format!("{format}, {chunk}, {key}");
            near(&what, sum(&guess), sum(&real), percent);
        }
    }
}

#[test]
fn the_plan_is_what_the_build_does_and_fits_the_budget() {
    for (mesh, through_cells) in [(larger(), false), (shuffled(larger()), true)] {
        let case = Case::new(&mesh, "npy");
        for memory in [16u64 << 20, 64 << 20] {
            let memory_option = format!("--memory={memory}B");
            let options = [&memory_option[..], "--threads=2", "--chunk-triangles=4000"];
            let (guess, report) = (case.predict(&options, 0), case.report(&options));
            let plan = guess["plan"].as_array().expect("a plan").clone();
            let name = |step: &Value| step["name"].as_str().expect("a name").to_owned();
            let steps: Vec<String> = plan.iter().map(name).collect();
            let all = ["scan", "chunks", "cells", "deal", "settle", "assemble"];
            assert_eq!(steps, all, "{memory}");
            for step in &plan {
                let bytes = number(step, "/bytes");
                assert!(number(step, "/parts") > 0 && bytes > 0, "{step}");
                assert!(bytes <= memory, "{step} in {memory}");
            }
            let chunks = number(&guess, "/triangles").div_ceil(4000);
            assert_eq!(number(&plan[0], "/parts"), chunks);
            let passes = report["build"]["passes"]
                .as_array()
                .expect("passes")
                .clone();
            let names: Vec<String> = passes.iter().map(name).collect();
            let (did, did_not) = if through_cells {
                (&all[2..], &all[..2])
            } else {
                (&all[..2], &all[2..])
            };
            assert!(
                did.iter().all(|n| names.iter().any(|m| m == n)),
                "{names:?}"
            );
            assert!(
                !did_not.iter().any(|n| names.iter().any(|m| m == n)),
                "{names:?}"
            );
            assert!(number(&report["build"], "/peak_budget") <= memory);
        }
    }
}

#[test]
fn a_budget_below_the_least_is_told_and_ends_with_5() {
    let case = Case::new(&coherent(), "ply");
    let guess = case.predict(&["--memory=300KiB"], 5);
    assert_eq!(guess["memory"]["accepted"], false);
    let least = number(&guess, "/memory/least");
    let text = case.build(&["--memory=300KiB", "--dry-run"]).expect(5);
    assert!(text.stdout.contains("would be refused"), "{text}");
    case.build(&["--memory=300KiB"]).expect(5);
    let said = format!("--memory {}KiB", least.div_ceil(1024));
    assert!(text.stderr.contains(&said), "{text}");
    case.build(&[&format!("--memory={least}B")]).expect(0);
}

#[test]
fn the_least_budget_does_for_any_order() {
    let case = Case::new(&shuffled(larger()), "ply");
    let guess = case.predict(&["--memory=300KiB"], 5);
    let least = number(&guess, "/memory/least");
    let labels = number(&guess, "/memory/labels");
    assert!(least < labels);
    // Labels go to a file, which shows in what the pass writes, or stay in memory.
    for (memory, in_file) in [(least, true), (labels, false)] {
        let report = case.report(&[&format!("--memory={memory}B")]);
        assert_eq!(report["counts"]["components"], 1);
        let passes = report["build"]["passes"].as_array().expect("passes");
        let stitch = passes.iter().find(|p| p["name"] == "stitch");
        let written = number(stitch.expect("the pass"), "/written");
        assert_eq!(written > 0, in_file, "{memory}: {written}");
    }
}

#[test]
fn an_output_that_exists_is_said_and_left_alone() {
    let case = Case::new(&surfaces::tetrahedron(), "ply");
    assert_eq!(case.predict(&[], 0)["output"]["exists"], false);
    case.build(&[]).expect(0);
    assert_eq!(case.predict(&[], 0)["output"]["exists"], true);
    let before = listing(case.dir.path());
    let text = case.build(&["--dry-run"]).expect(0);
    assert!(text.stdout.contains("the name is taken"), "{text}");
    assert!(text.stdout.contains("\n  triangles "), "{text}");
    let quiet = case.build(&["--dry-run", "--quiet"]).expect(0);
    assert_eq!((quiet.stdout, quiet.stderr), (String::new(), String::new()));
    assert_eq!(listing(case.dir.path()), before);
}

#[test]
fn what_a_build_refuses_at_first_sight_is_refused() {
    let stdin = cornermill(["build", "-", "-o", "x.ct", "--dry-run"]).expect(2);
    assert!(stdin.stderr.contains("standard input"), "{stdin}");
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("a.off");
    std::fs::write(&path, "OFF\n353535235358 6 0\n0 0 0\n").expect("a file");
    let path = path.to_str().expect("a path");
    let lies = cornermill(["build", path, "--dry-run"]).expect(3);
    assert!(lies.stderr.contains("counts are wrong"), "{lies}");
    let many = ["--raw-index=u4", "--vertices=18446744073709551615"];
    std::fs::write(path, [0; 12]).expect("a file");
    let args = [&["build", path, "--dry-run"][..], &many].concat();
    assert!(
        cornermill(args)
            .expect(2)
            .stderr
            .contains("beyond any mesh")
    );
    assert_eq!(listing(dir.path()).len(), 1);
}
