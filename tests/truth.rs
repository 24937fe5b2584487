//! Real and hostile files made by others, each to its right end: the counts of `TRUTH.json`, the V and
//! G of naive readers, or a refusal that a person understands. Never a panic, and never more
//! memory than a gigabyte of address space.
//!
//! The files are in `tests/meshes`; with `CORNERMILL_MESHES` set, they are read from there, and the
//! large ones too.

mod common;
#[path = "truth/table.rs"]
mod table;

use common::folder::Folder;
use common::mesh::Mesh;
use common::naive::{self, Orient};
use common::readers;
use common::run::{Run, cornermill, cornermill_confined};
use serde_json::Value;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use table::{CORRECTED, End, LARGE, TABLE};

fn meshes() -> PathBuf {
    match std::env::var_os("CORNERMILL_MESHES") {
        Some(path) => path.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/meshes"),
    }
}

/// The path of a file; none when it is a large one that is not here.
fn find(name: &str) -> Option<PathBuf> {
    let path = meshes().join(name);
    assert!(
        path.exists() || LARGE.contains(&name),
        "{} is missing",
        path.display()
    );
    path.exists().then_some(path)
}

/// Each name in `TRUTH.json` with its counts, the few that are another mesh's corrected.
fn truth() -> Vec<(String, Value)> {
    let text = std::fs::read(meshes().join("TRUTH.json")).expect("TRUTH.json");
    let truth: Value = serde_json::from_slice(&text).expect("TRUTH.json is JSON");
    let mut files = truth.as_object().expect("an object of files").clone();
    for (name, counts) in CORRECTED {
        for (key, count) in *counts {
            let old = files[*name][*key].as_u64();
            assert!(
                old.is_some_and(|n| n != *count),
                "{name}: {key} needs no correction"
            );
            files[*name][*key] = (*count).into();
        }
    }
    files.into_iter().collect()
}

/// The counts of `TRUTH.json` under the manifest's names.
fn counts_of(truth: &Value) -> Vec<(&str, u64)> {
    let known = truth.as_object().expect("counts").iter();
    let renamed = |key| {
        if key == "unreferenced" {
            "unreferenced_vertices"
        } else {
            key
        }
    };
    known
        .map(|(key, n)| (renamed(key.as_str()), n.as_u64().expect("a count")))
        .collect()
}

/// Builds `input` into `dir` in a confined address space.
fn build(input: &Path, dir: &Path, options: &[&str]) -> (Run, PathBuf) {
    let out = dir.join("OUT.ct");
    let mut args: Vec<OsString> = vec![
        "build".into(),
        input.into(),
        "-o".into(),
        out.clone().into(),
    ];
    let usual = ["--quiet", "--force", "--memory", "64MiB", "--threads", "2"];
    args.extend(usual.iter().chain(options).map(Into::into));
    (cornermill_confined(1024, args), out)
}

/// The run must not have panicked, aborted or been killed.
fn ended_in_order(run: &Run) -> bool {
    run.code < 100 && run.code != 70 && !run.stderr.contains("panicked")
}

/// Notes every count in which a folder differs from the truth.
fn check_counts(name: &str, truth: &Value, out: &Path, wrong: &mut Vec<String>) {
    let folder = Folder::read(out);
    for (key, expected) in counts_of(truth) {
        let found = match folder.manifest["measures"].get(key) {
            Some(measure) => measure.as_u64(),
            None => folder.count(key),
        };
        if found != Some(expected) {
            wrong.push(format!("{name}: {key} is {found:?}, expected {expected}"));
        }
    }
}

#[test]
fn every_file_of_the_truth_has_its_counts() {
    let mut wrong = vec![];
    for (name, counts) in truth() {
        let Some(path) = find(&name) else { continue };
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (run, out) = build(&path, dir.path(), &[]);
        if run.code != 0 {
            wrong.push(format!("{name}: {run}"));
            continue;
        }
        check_counts(&name, &counts, &out, &mut wrong);
        let verified = cornermill(["verify".as_ref(), out.as_os_str()]);
        if verified.code != 0 {
            wrong.push(format!("{name}: {verified}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Builds without turning any triangle over, and compares V and G with a naive reader's.
fn check_reading(name: &str, path: &Path, wrong: &mut Vec<String>) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let (run, out) = build(path, dir.path(), &["--orient", "keep", "--coords", "f4"]);
    if run.code != 0 {
        wrong.push(format!("{name}: {run}"));
        return;
    }
    let (folder, expected) = (Folder::read(&out), readers::read(path));
    let v: Vec<u64> = expected
        .triangles
        .concat()
        .into_iter()
        .map(u64::from)
        .collect();
    let g = folder.g.as_ref().map(|g| g.data.chunks_exact(4));
    let g = g.map(|g| {
        g.map(|b| f32::from_le_bytes(b.try_into().expect("4 bytes")))
            .collect()
    });
    if folder.v.ids() != v {
        wrong.push(format!(
            "{name}: V differs, {:?} triangles of {}",
            folder.v.shape,
            v.len() / 3
        ));
    }
    // Text does not say which NaN.
    let bits = |x: &f32| {
        if x.is_nan() {
            f32::NAN.to_bits()
        } else {
            x.to_bits()
        }
    };
    let positions = expected.positions.concat();
    let same = |found: Vec<f32>| found.iter().map(bits).eq(positions.iter().map(bits));
    if !g.is_some_and(same) {
        wrong.push(format!("{name}: G differs"));
    }
}

#[test]
fn every_readable_file_has_the_v_and_g_of_a_naive_reader() {
    let readable = TABLE.iter().filter(|row| matches!(row.1, End::Reads));
    let readable = readable.map(|row| row.0.to_string());
    let mut wrong = vec![];
    for name in readable.chain(truth().into_iter().map(|(name, _)| name)) {
        if let Some(path) = find(&name) {
            check_reading(&name, &path, &mut wrong);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Notes what is wrong with a refusal: code, words, or something left behind.
fn check_refusal(name: &str, run: &Run, words: &[&str], dir: &Path, wrong: &mut Vec<String>) {
    let said = run.stderr.to_lowercase();
    if run.code != 3 || !ended_in_order(run) {
        wrong.push(format!(
            "{name}: expected a refusal with exit code 3\n{run}"
        ));
    } else if !words.iter().any(|w| said.contains(&w.to_lowercase())) {
        wrong.push(format!("{name}: none of {words:?} is said\n{run}"));
    }
    let last = Path::new(name)
        .file_name()
        .and_then(|n| n.to_str())
        .expect("a plain name");
    if !run.stderr.contains(last) {
        wrong.push(format!("{name}: the message does not name the file\n{run}"));
    }
    if std::fs::read_dir(dir)
        .expect("the output's directory")
        .count()
        > 0
    {
        wrong.push(format!("{name}: a refusal leaves files behind"));
    }
}

#[test]
fn every_other_file_comes_to_its_right_end() {
    let mut wrong = vec![];
    for (name, end) in TABLE {
        let Some(path) = find(name) else { continue };
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (run, out) = build(&path, dir.path(), &[]);
        match end {
            End::Refused(words) => check_refusal(name, &run, words, dir.path(), &mut wrong),
            _ if run.code != 0 => wrong.push(format!("{name}: {run}")),
            _ => {
                let verified = cornermill(["verify".as_ref(), out.as_os_str()]);
                if verified.code != 0 {
                    wrong.push(format!("{name}: {verified}"));
                }
                let triangles = Folder::read(&out).count("triangles");
                if matches!(end, End::Empty) != (triangles == Some(0)) {
                    wrong.push(format!("{name}: {triangles:?} triangles"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn what_the_same_mesh_says_in_three_files_is_the_same() {
    let counts = truth()
        .into_iter()
        .find(|(name, _)| name.ends_with("platonic_shelf_ascii.ply"));
    let counts = counts.expect("the ascii file is in TRUTH.json").1;
    let mut wrong = vec![];
    for name in ["platonic_shelf.ply", "platonic_shelf_big_endian.ply"] {
        let path = find(&format!("hostile_happly_MIT/{name}")).expect("a small file");
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (run, out) = build(&path, dir.path(), &[]);
        run.expect(0);
        check_counts(name, &counts, &out, &mut wrong);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every file of the folder, by name relative to it.
fn names_below(dir: &Path, prefix: &str, names: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(dir).expect("a directory of meshes") {
        let entry = entry.expect("a directory entry");
        let name = format!(
            "{prefix}{}",
            entry.file_name().into_string().expect("a plain name")
        );
        match entry.path().is_dir() {
            true => names_below(&entry.path(), &format!("{name}/"), names),
            false => _ = names.insert(name),
        }
    }
}

#[test]
fn every_file_is_in_the_truth_or_in_the_table() {
    let mut names = BTreeSet::new();
    names_below(&meshes(), "", &mut names);
    let known = truth().into_iter().map(|(name, _)| name);
    let known = known.chain(TABLE.iter().map(|row| row.0.to_string()));
    known.for_each(|name| _ = names.remove(&name));
    let expected = ["README.md", "TRUTH.json"].map(String::from);
    names.remove(".gitattributes");
    assert_eq!(names, BTreeSet::from(expected));
}

/// The counts of TRUTH.json that the oracle finds by itself in what the naive readers read: the
/// judges judged, without the program.
#[test]
fn the_oracle_and_the_naive_readers_agree_with_the_truth() {
    let (mut judged, mut wrong) = (0, vec![]);
    for (name, counts) in truth() {
        let Some(path) = find(&name) else { continue };
        let mesh: Mesh = readers::read(&path);
        // The oracle is quadratic.
        if mesh.triangles.len() > 3800 {
            continue;
        }
        let answer = naive::solve(&mesh, true, Orient::Keep, &|_| panic!("not asked"));
        for (key, expected) in counts_of(&counts) {
            let found = match answer.stars.measures.get(key) {
                Some(&measure) => measure as u64,
                None => answer.counts[key],
            };
            if found != expected {
                wrong.push(format!("{name}: {key} is {found}, expected {expected}"));
            }
        }
        judged += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(judged > 30, "only {judged} files judged");
}
