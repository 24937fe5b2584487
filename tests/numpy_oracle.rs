//! `build` on meshes of a million triangles, in budgets of a quarter of the mesh folder and less,
//! judged by NumPy and SciPy (`numpy_oracle.py`), which also map every array of the folder.
//!
//! Needs `python3` with numpy and scipy: without them the test fails, since skipping would say
//! nothing about the program.

mod common;

use common::run::{Run, run};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Enough that the folder has four times the smaller budget, and that every edge kind is there.
const TRIANGLES: &str = "1000000";
const MIB: u64 = 1 << 20;
/// What the process may hold beyond its budget.
const ALLOWANCE: u64 = 64 * MIB;

fn python<S: AsRef<OsStr>>(args: impl IntoIterator<Item = S>) -> Run {
    let mut command = Command::new("python3");
    command.args(args);
    run(command, Stdio::null())
}

fn script() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/numpy_oracle.py")
}

/// Fails with what to do about it when the judge is not there.
fn need_numpy() {
    let found = python(["-c", "import numpy, scipy.sparse.csgraph"]);
    let message = "this test needs NumPy and SciPy: python3 -m pip install numpy scipy";
    assert!(found.code == 0, "{message}\n{found}");
}

/// A generated mesh, and folders built from it.
struct Bench {
    dir: TempDir,
}

impl Bench {
    fn new(case: &str, triangles: &str) -> Bench {
        need_numpy();
        let dir = tempfile::tempdir().expect("a temporary directory");
        let args = [
            "generate".as_ref(),
            case.as_ref(),
            triangles.as_ref(),
            dir.path().as_os_str(),
        ];
        python([script().as_os_str()].into_iter().chain(args)).expect(0);
        Bench { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Builds with `options`; gives the peak resident memory in bytes.
    fn build(&self, options: &[&str]) -> u64 {
        let (v, g, out) = (self.path("V.npy"), self.path("G.npy"), self.path("OUT.ct"));
        let (script, peak) = (script(), self.path("peak"));
        let program = env!("CARGO_BIN_EXE_cornermill").as_ref();
        let measured = [
            script.as_os_str(),
            "peak".as_ref(),
            peak.as_os_str(),
            program,
        ];
        let input = [
            "build".as_ref(),
            v.as_os_str(),
            "--positions".as_ref(),
            g.as_os_str(),
        ];
        let output = [
            "-o".as_ref(),
            out.as_os_str(),
            "--quiet".as_ref(),
            "--force".as_ref(),
        ];
        let args = measured.into_iter().chain(input).chain(output);
        python(args.chain(options.iter().map(OsStr::new))).expect(0);
        let kib: u64 = fs::read_to_string(peak)
            .expect("peak")
            .parse()
            .expect("a number");
        kib * 1024
    }

    /// What the judge says of the folder.
    fn judge(&self) -> Run {
        let (v, g, out) = (self.path("V.npy"), self.path("G.npy"), self.path("OUT.ct"));
        let args = [
            script().into_os_string(),
            "check".into(),
            v.into(),
            g.into(),
            out.into(),
        ];
        python(args)
    }

    fn folder_bytes(&self) -> u64 {
        let entries = fs::read_dir(self.path("OUT.ct")).expect("the folder");
        entries
            .map(|e| e.and_then(|e| e.metadata()).expect("a file").len())
            .sum()
    }
}

/// Builds at 8 MiB, less than a quarter of the folder, on one thread and on two, then judges.
fn holds_in_small_memory(case: &str) {
    let bench = Bench::new(case, TRIANGLES);
    for options in [["--threads", "1"], ["--threads", "2"]] {
        let peak = bench.build(&[&options[..], &["--memory", "8MiB"]].concat());
        bench.judge().expect(0);
        assert!(
            bench.folder_bytes() > 4 * 8 * MIB,
            "the folder is too small for this test"
        );
        assert!(
            peak <= 8 * MIB + ALLOWANCE,
            "{case}, {options:?}: peak of {} KiB",
            peak / 1024
        );
    }
}

#[test]
fn a_million_coherent_triangles() {
    holds_in_small_memory("coherent");
}

#[test]
fn a_million_shuffled_triangles() {
    holds_in_small_memory("shuffled");
}

#[test]
fn a_million_shuffled_triangles_with_defects() {
    holds_in_small_memory("defects");
}

#[test]
fn the_wide_index_type_opens_in_numpy_too() {
    let bench = Bench::new("defects", "50000");
    bench.build(&["--index", "u8", "--chunk-triangles", "1000"]);
    bench.judge().expect(0);
}

/// Changes the bytes of one file of the folder.
fn spoil(folder: &Path, name: &str, change: impl FnOnce(&mut [u8])) {
    let path = folder.join(name);
    let mut bytes = fs::read(&path).expect("a file of the folder");
    change(&mut bytes);
    fs::write(&path, bytes).expect("the file is written back");
}

#[test]
fn the_judge_notices_what_is_wrong() {
    let bench = Bench::new("defects", "20000");
    type Spoiling = (&'static str, &'static str, fn(&mut [u8]));
    // Data starts at byte 4096; triangle 1000 is well inside.
    let spoilings: [Spoiling; 7] = [
        ("V.npy", "V:", |b| b.swap(4096 + 12_000, 4096 + 12_004)),
        ("O.npy", "O:", |b| b[4096 + 12_000] ^= 1),
        ("G.npy", "G:", |b| b[4096 + 12_000] ^= 1),
        ("component.npy", "component:", |b| b[4096 + 4000] ^= 1),
        ("flipped.npy", "V:", |b| b[4096 + 100] ^= 1),
        ("components.npy", "components.triangles:", |b| {
            b[4096 + 8] ^= 1
        }),
        ("nonmanifold_edges.npy", "lo:", |b| b[4096] ^= 1),
    ];
    for (name, complaint, change) in spoilings {
        bench.build(&[]);
        bench.judge().expect(0);
        spoil(&bench.path("OUT.ct"), name, change);
        let verdict = bench.judge().expect(1);
        let complains = verdict
            .stdout
            .lines()
            .any(|line| line.starts_with(complaint));
        assert!(complains, "{name}: no {complaint:?}\n{verdict}");
    }
}
