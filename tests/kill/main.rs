//! A build is killed at many points of its run and gone on with: the target is never there in part,
//! and the finished folder has the bytes of one that nobody killed. `asked`: signals that ask;
//! `refused`: what is not gone on with, and what is nobody's to touch.

mod asked;
mod refused;

use clap::Parser;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_cornermill");

fn make(dir: &Path, words: &str, name: &str) {
    let out = dir.join(name);
    let words = ["data-gen"].into_iter().chain(words.split(' '));
    let words = words
        .map(Into::into)
        .chain(["-o".into(), out.into_os_string()]);
    let args = data_gen::Args::try_parse_from(words).expect("arguments");
    data_gen::args::run(&args).expect("a mesh");
}

/// A quick build that is written down a dozen times: behind passes, and within them.
fn build(dir: &Path, out: &str, args: &[&str], more: &[&str]) -> Command {
    build_kept(dir, out, "0.02", &[args, more].concat())
}

/// A build that is written down when so many seconds of work are at stake.
fn build_kept(dir: &Path, out: &str, seconds: &str, args: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command
        .current_dir(dir)
        .args([
            "build",
            "-o",
            out,
            "-q",
            "--progress",
            "none",
            "--memory",
            "24MiB",
        ])
        .args(["--threads", "2", "--checkpoint", seconds])
        .args(args)
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command
}

/// Bytes that a process has written so far.
fn written(child: &Child) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{}/io", child.id())).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("wchar: "))?;
    line.parse().ok()
}

/// Kills a process once it has written so much; true when it was still alive.
fn kill_at(mut child: Child, bytes: u64) -> bool {
    loop {
        if child.try_wait().expect("a child").is_some() {
            return false;
        }
        if written(&child).is_some_and(|now| now >= bytes) {
            child.kill().expect("a child");
            return !child.wait().expect("a child").success();
        }
        std::thread::yield_now();
    }
}

fn same(dir: &Path, a: &str, b: &str) {
    let list = |name: &str| {
        let entries = fs::read_dir(dir.join(name)).expect("a folder");
        let mut names: Vec<_> = entries.map(|e| e.expect("an entry").file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(list(a), list(b));
    for name in list(a) {
        let read = |folder: &str| fs::read(dir.join(folder).join(&name)).expect("a file");
        assert!(read(a) == read(b), "{name:?} differs");
    }
}

/// The step behind which the build in a working folder goes on, if its state says one.
fn step_of(work: &Path) -> Option<String> {
    let state = fs::read(work.join("state")).ok()?;
    let line = state.split(|&byte| byte == b'\n').next()?;
    let line: serde_json::Value = serde_json::from_slice(line).ok()?;
    Some(line["step"].as_str()?.to_owned())
}

/// Kills builds at so many points, each gone on with; returns how many were resumed, and behind
/// which steps.
fn kills(dir: &Path, args: &[&str], points: u64) -> (u64, BTreeSet<String>) {
    let whole = build(dir, "whole.ct", args, &["--force"])
        .spawn()
        .expect("a build");
    let mut child = whole;
    let mut total = 0;
    while child.try_wait().expect("a child").is_none() {
        total = written(&child).unwrap_or(0).max(total);
    }
    assert!(child.wait().expect("a child").success());
    let (mut resumed, mut steps) = (0, BTreeSet::new());
    for point in 0..points {
        let out = "killed.ct";
        // More of them late, where little is written from one step to the next.
        let (left, all) = (points - point, points + 1);
        let bytes = total - total * left * left / (all * all);
        let alive = kill_at(build(dir, out, args, &[]).spawn().expect("a build"), bytes);
        let work = dir.join(".killed.ct.partial");
        if dir.join(out).exists() {
            same(dir, "whole.ct", out);
        } else {
            if let (true, Some(step)) = (alive, step_of(&work)) {
                resumed += 1;
                steps.insert(step);
            }
            if point % 3 == 0 {
                // Killed again while it goes on.
                let again = build(dir, out, args, &["--resume"])
                    .spawn()
                    .expect("a build");
                kill_at(again, total / 5);
            }
            if !dir.join(out).exists() {
                let done = build(dir, out, args, &["--resume"])
                    .output()
                    .expect("a build");
                assert!(done.status.success(), "point {point}: {done:?}");
            }
            same(dir, "whole.ct", out);
        }
        fs::remove_dir_all(dir.join(out)).expect("a folder");
        // Killed between the name and the end, the working folder may stay for the next.
        let _ = fs::remove_dir_all(work);
    }
    (resumed, steps)
}

#[test]
fn killed_anywhere_and_resumed_it_is_the_same() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 200k --flip 0.3", "coherent.npy");
    for name in ["shuffled.npy", "shuffled.ply", "shuffled.stl"] {
        make(dir, "sphere -t 200k --order shuffle --flip 0.3", name);
    }
    let cases: [&[&str]; 5] = [
        &["coherent.npy", "--positions", "coherent.G.npy"],
        &[
            "shuffled.npy",
            "--positions",
            "shuffled.G.npy",
            "--strategy",
            "by-place",
        ],
        &[
            "shuffled.npy",
            "--positions",
            "shuffled.G.npy",
            "--strategy",
            "contract",
        ],
        &["shuffled.ply", "--strategy", "by-id"],
        &["shuffled.stl", "--strategy", "memory"],
    ];
    let resumed: Vec<_> = cases.iter().map(|args| kills(dir, args, 20)).collect();
    let all: u64 = resumed.iter().map(|(count, _)| count).sum();
    // How many there are depends on the machine, since steps are written down by time.
    assert!(all >= 30, "resumed of 20 each: {resumed:?}");
    let steps: BTreeSet<_> = resumed.iter().flat_map(|(_, steps)| steps).collect();
    assert!(steps.len() >= 4, "behind few steps: {resumed:?}");
}

/// Before there is a mesh to speak of: each step of reading and welding is gone on with.
#[test]
fn killed_while_it_reads_and_welds_it_is_the_same() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    for name in ["m.stl", "m.ply"] {
        make(dir, "sphere -t 100k --order shuffle --flip 0.3", name);
    }
    let mut export = Command::new(PROGRAM);
    export.current_dir(dir);
    export.args(["export", "o.ct", "-o", "m.obj", "--quiet"]);
    for mut command in [build(dir, "o.ct", &["m.ply"], &[]), export] {
        assert!(command.status().expect("a mesh").success());
    }
    let weld = ["weld: read", "weld: group", "weld: place", "weld"];
    let decoded = ["read", "weld: read", "weld: group", "weld: place", "weld"];
    let cases: [(&[&str], &[&str]); 5] = [
        (&["m.stl"], &weld),
        (&["m.stl", "--coords", "f8"], &weld[..1]),
        (&["m.obj"], &["read"]),
        (&["m.ply"], &["read"]),
        (&["m.ply", "--weld", "--index", "u8"], &decoded),
    ];
    let mut met = 0;
    for (args, steps) in cases {
        let done = build(dir, "whole.ct", args, &["--force"]).output();
        assert!(done.expect("a build").status.success());
        for step in steps {
            let work = dir.join(".m.ct.partial");
            let mut child = build_kept(dir, "m.ct", "0", args).spawn().expect("a build");
            let there = || step_of(&work).is_some_and(|now| now == *step);
            // On a busy machine it may go on, or end, before it is seen there.
            wait_for(&mut child, there);
            child.kill().expect("a child");
            child.wait().expect("a child");
            met += u64::from(there());
            if !dir.join("m.ct").exists() {
                let done = build(dir, "m.ct", args, &["--resume"]).output();
                let done = done.expect("a build");
                assert!(done.status.success(), "{args:?}, {step}: {done:?}");
            }
            same(dir, "whole.ct", "m.ct");
            fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
            let _ = fs::remove_dir_all(work);
        }
    }
    assert!(
        met >= 3,
        "{met} were killed behind the step that was waited for"
    );
}

/// Where hardly a cell or a chunk settles its triangles, so that files of their own hold them.
#[test]
fn hubs_killed_anywhere_and_resumed_are_the_same() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    for kind in ["cone", "stack"] {
        let words = format!("{kind} -t 100k --order shuffle --flip 0.3");
        make(dir, &words, &format!("{kind}.npy"));
    }
    let cases: [&[&str]; 3] = [
        &[
            "cone.npy",
            "--positions",
            "cone.G.npy",
            "--strategy",
            "by-place",
        ],
        &["cone.npy", "--strategy", "memory"],
        &[
            "stack.npy",
            "--positions",
            "stack.G.npy",
            "--strategy",
            "by-place",
        ],
    ];
    let resumed: Vec<_> = cases.iter().map(|args| kills(dir, args, 8)).collect();
    let all: u64 = resumed.iter().map(|(count, _)| count).sum();
    assert!(all >= 6, "resumed of 8 each: {resumed:?}");
}

/// Where arrays are changed in place: what was changed before is changed again.
#[test]
fn killed_while_rows_are_changed_it_is_the_same() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 300k --flip 0.3", "m.npy");
    let args = ["m.npy", "--positions", "m.G.npy", "--strategy", "memory"];
    let start = |out: &str, more: &[&str]| build(dir, out, &args, more).spawn().expect("a build");
    let clear = |out: &str| fs::remove_dir_all(dir.join(out)).expect("a folder");
    let decided = |out: &str| {
        step_of(&dir.join(format!(".{out}.partial"))).is_some_and(|step| step == "decisions")
    };
    // How much is written from there to the end.
    let begin = |out: &str| caught(|| start(out, &[]), || decided(out), || clear(out));
    let mut child = begin("whole.ct");
    let from = written(&child).unwrap_or(0);
    let mut end = from;
    while child.try_wait().expect("a child").is_none() {
        end = written(&child).unwrap_or(0).max(end);
    }
    let mut resumed = 0;
    for point in 0..8 {
        let child = begin("m.ct");
        let now = written(&child).unwrap_or(0);
        kill_at(child, now + (end - from) * point / 8);
        if !dir.join("m.ct").exists() {
            resumed += u64::from(decided("m.ct"));
            if point % 2 == 1 {
                kill_at(start("m.ct", &["--resume"]), (end - from) * point / 16);
            }
        }
        if !dir.join("m.ct").exists() {
            let done = build(dir, "m.ct", &args, &["--resume"])
                .output()
                .expect("a build");
            assert!(done.status.success(), "point {point}: {done:?}");
        }
        same(dir, "whole.ct", "m.ct");
        clear("m.ct");
        let _ = fs::remove_dir_all(dir.join(".m.ct.partial"));
    }
    assert!(resumed >= 3, "{resumed} of 8 behind the decisions");
}

#[test]
fn a_folder_that_is_replaced_is_the_old_one_or_the_new() {
    use std::os::unix::fs::MetadataExt;
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 50k --order shuffle --flip 0.3", "m.ply");
    let done = |out: &str, more: &[&str]| {
        let done = build(dir, out, &["m.ply"], more).output().expect("a build");
        assert!(done.status.success(), "{done:?}");
    };
    done("old.ct", &["--orient", "keep"]);
    done("whole.ct", &[]);
    let inode = || fs::metadata(dir.join("m.ct")).map_or(0, |meta| meta.ino());
    let (mut before, mut behind) = (0, 0);
    for point in 0..30 {
        done("m.ct", &["--orient", "keep", "--force"]);
        let old = inode();
        let mut child = build(dir, "m.ct", &["m.ply"], &["--force"])
            .spawn()
            .expect("a build");
        // At moments spread over the run, and as soon as the name is another folder's.
        if point % 2 == 0 {
            before += u64::from(kill_at(child, point * 200_000));
        } else {
            behind += u64::from(wait_for(&mut child, || inode() != old));
            child.kill().expect("a child");
            child.wait().expect("a child");
        }
        let now = if inode() == old { "old.ct" } else { "whole.ct" };
        same(dir, now, "m.ct");
        done("m.ct", &["--force", "--resume"]);
        same(dir, "whole.ct", "m.ct");
        assert_eq!(
            names(dir),
            ["m.ct", "m.ply", "m.ply.json", "old.ct", "whole.ct"]
        );
    }
    assert!(before > 4 && behind > 4, "{before} before, {behind} behind");
}

/// Waits until something of the process is there; false when it ended before.
fn wait_for(child: &mut Child, mut there: impl FnMut() -> bool) -> bool {
    while child.try_wait().expect("a child").is_none() {
        if there() {
            return true;
        }
        std::thread::yield_now();
    }
    false
}

/// A process of which something is seen. One that ends before, as happens on a busy machine, is
/// cleared away and begun anew.
fn caught(start: impl Fn() -> Child, mut there: impl FnMut() -> bool, clear: impl Fn()) -> Child {
    for _ in 0..50 {
        let mut child = start();
        if wait_for(&mut child, &mut there) {
            return child;
        }
        assert!(child.wait().expect("a child").success());
        clear();
    }
    panic!("ended before it was seen, fifty times");
}

/// Sends a signal to a process of which something is seen, and returns how it ended of that.
fn stopped(
    start: impl Fn() -> Child,
    mut there: impl FnMut() -> bool,
    name: &str,
    clear: impl Fn(),
) -> Output {
    for _ in 0..50 {
        let mut child = caught(&start, &mut there, &clear);
        if name == "-KILL" {
            child.kill().expect("a child");
        } else {
            signal(&child, name);
        }
        let done = child.wait_with_output().expect("a child");
        if !done.status.success() {
            return done;
        }
        clear();
    }
    panic!("ended before it was stopped, fifty times");
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .arg(name)
        .arg(child.id().to_string())
        .status();
    assert!(sent.expect("kill runs").success());
}

fn names(dir: &Path) -> Vec<String> {
    let entries = fs::read_dir(dir).expect("a folder").flatten();
    let mut names: Vec<String> = entries
        .map(|e| e.file_name().to_string_lossy().into())
        .collect();
    names.sort();
    names
}
