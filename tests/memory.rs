//! Resident memory of the real program, file-backed pages included, through a whole build: below
//! the budget and 64 MiB, for meshes of at least four times the budget (twice for hubs and
//! soups). The larger budgets are rows of `benches/build`.

use clap::Parser;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

const MIB: u64 = 1 << 20;
/// What the program may take besides its budget.
const ALLOWANCE: u64 = 64 * MIB;

/// The peak that the kernel keeps of a process: resident pages, mapped files included.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// Builds, and asks for the peak until the process is gone; gives it and how often it was told.
fn build(mesh: &Path, positions: &Path, out: &Path, mib: u64) -> (u64, u64) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
    command
        .arg("build")
        .arg(mesh)
        .arg("--positions")
        .arg(positions)
        .arg("-o")
        .arg(out);
    command.args([
        "--quiet",
        "--threads",
        "2",
        "--memory",
        &format!("{mib}MiB"),
    ]);
    let mut child = command
        .stdin(Stdio::null())
        .spawn()
        .expect("the program starts");
    let (mut most, mut told) = (0, 0);
    let status = loop {
        if let Some(status) = child.try_wait().expect("waiting") {
            break status;
        }
        if let Some(peak) = peak(child.id()) {
            (most, told) = (most.max(peak), told + 1);
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(status.success(), "{command:?}: {status}");
    (most, told)
}

/// Makes a mesh as data-gen's command line does; gives its arrays.
fn generate(dir: &Path, words: &str) -> (PathBuf, PathBuf) {
    let mesh = dir.join("mesh.npy");
    let args = ["data-gen"].into_iter().chain(words.split(' '));
    let args = args.chain(["-o", mesh.to_str().expect("a plain path")]);
    data_gen::args::run(&data_gen::Args::parse_from(args)).expect("a mesh");
    (mesh, dir.join("mesh.G.npy"))
}

fn holds(words: &str, mib: u64, times: u64) {
    let dir = tempfile::Builder::new().tempdir_in(env!("CARGO_TARGET_TMPDIR"));
    let dir = dir.expect("a temporary directory");
    let (v, g) = generate(dir.path(), words);
    let bytes = |path: &Path| std::fs::metadata(path).expect("an array").len();
    assert!(
        bytes(&v) + bytes(&g) >= times * mib * MIB,
        "{words}: too small a mesh"
    );
    let (peak, told) = build(&v, &g, &dir.path().join("mesh.ct"), mib);
    println!(
        "{words}: {} KiB in {mib} MiB, told {told} times",
        peak / 1024
    );
    assert!(told > 20, "{words}: told {told} times");
    assert!(
        peak > mib * MIB / 8,
        "{words}: a peak of {} KiB is none",
        peak / 1024
    );
    assert!(
        peak <= mib * MIB + ALLOWANCE,
        "{words}: a peak of {} KiB",
        peak / 1024
    );
}

#[test]
fn a_coherent_mesh_of_four_times_the_budget_stays_within() {
    holds("sphere -t 15M --flip 0.3", 64, 4);
}

#[test]
fn a_shuffled_mesh_of_four_times_the_budget_stays_within() {
    holds("sphere -t 15M --flip 0.3 --shuffle", 64, 4);
}

#[test]
fn a_hub_of_twice_the_budget_stays_within() {
    holds("cone -t 8M --shuffle", 64, 2);
}

#[test]
fn a_soup_of_twice_the_budget_stays_within() {
    holds("soup -t 3M", 64, 2);
}
