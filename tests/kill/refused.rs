//! What is not gone on with: builds of other inputs or options, with damaged or foreign scratch, or of
//! a target that another process builds.

use super::{PROGRAM, build, build_kept, make, names, same, stopped, wait_for};
use std::cell::RefCell;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

/// Builds `m.ply`, and holds how that ends to a code and a part of what is said.
fn build_ends(dir: &Path, args: &[&str], code: i32, part: &str) {
    let done = build(dir, "m.ct", &["m.ply"], args).output();
    let done = done.expect("a build");
    let text = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(code), "{text}");
    assert!(text.contains(part), "{text}");
}

#[test]
fn scratch_elsewhere_is_found_again_and_nothing_of_others_is_touched() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 200k --order shuffle --flip 0.3", "m.ply");
    let done = build(dir, "whole.ct", &["m.ply"], &[])
        .output()
        .expect("a build");
    assert!(done.status.success(), "{done:?}");
    for name in ["one", "two", "precious"] {
        fs::create_dir(dir.join(name)).expect("a folder");
    }
    fs::write(dir.join("precious/data"), "mine").expect("a file");
    let state = dir.join(".m.ct.partial/state");
    let clear = || fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
    let stop = |tmp: &str| {
        let start = || {
            build(dir, "m.ct", &["m.ply"], &["--tmp", tmp, "--tmp", tmp])
                .spawn()
                .expect("a build")
        };
        stopped(start, || state.is_file(), "-KILL", clear);
        assert_eq!(names(&dir.join(tmp)).len(), 1);
    };
    let run = |args: &[&str], code, part: &str| build_ends(dir, args, code, part);
    stop("one");
    run(&["--resume", "--tmp", "two"], 2, "--tmp");
    assert!(names(&dir.join("two")).is_empty());
    // From another working folder, by other names of the same.
    let done = Command::new(PROGRAM)
        .current_dir(dir.join("precious"))
        .args([
            "build", "../m.ply", "-o", "../m.ct", "--resume", "-q", "--memory", "24MiB",
        ])
        .args([
            "--threads",
            "2",
            "--checkpoint",
            "0",
            "--tmp",
            "../one",
            "--tmp",
            "../one",
        ])
        .output()
        .expect("a build");
    assert!(done.status.success(), "{done:?}");
    same(dir, "whole.ct", "m.ct");
    assert!(names(&dir.join("one")).is_empty());
    fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
    // Begun anew without the folder: what lies in it goes.
    stop("one");
    run(&["--force"], 0, "");
    assert!(names(&dir.join("one")).is_empty());
    same(dir, "whole.ct", "m.ct");
    // Links and folders of others in the way.
    fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
    std::os::unix::fs::symlink("precious", dir.join(".m.ct.partial")).expect("a link");
    run(&[], 2, "is in the way");
    fs::remove_file(dir.join(".m.ct.partial")).expect("a link");
    fs::rename(dir.join("precious"), dir.join(".m.ct.partial")).expect("a folder");
    run(&["--force"], 2, "is in the way");
    // A lock that nobody holds, which is none of ours.
    fs::write(dir.join(".m.ct.partial/lock"), "mine").expect("a file");
    run(&["--force"], 2, "is in the way");
    let kept = fs::read_to_string(dir.join(".m.ct.partial/data"));
    assert_eq!(kept.expect("a file"), "mine");
}

#[test]
fn what_changed_is_refused_and_named() {
    // At the first state, and at the third, which is read back in the midst of the passes.
    for states in [1, 3] {
        what_changed_behind(states);
    }
}

fn what_changed_behind(states: usize) {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 200k --order shuffle", "m.ply");
    let state = dir.join(".m.ct.partial/state");
    // The beginning alone, which names the step: whole states take long to read.
    let step = || {
        let mut text = [0; 40];
        let read = fs::File::open(&state).and_then(|mut file| file.read_exact(&mut text));
        read.is_ok().then_some(text)
    };
    // Written down behind every pass, so that there are a dozen and more.
    let start = || {
        build_kept(dir, "m.ct", "0", &["m.ply"])
            .spawn()
            .expect("a build")
    };
    let seen = RefCell::new(Vec::new());
    let there = || {
        let mut seen = seen.borrow_mut();
        let new = step().filter(|text| !seen.contains(text));
        seen.extend(new);
        seen.len() == states
    };
    stopped(start, there, "-KILL", || {
        seen.borrow_mut().clear();
        fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
    });
    assert!(state.is_file());
    let refused = |args: &[&str], code, part: &str| {
        build_ends(dir, args, code, part);
        assert!(state.is_file());
    };
    refused(&[], 2, "`build --resume` goes on, --force begins anew");
    refused(
        &["--resume", "--orient", "keep"],
        2,
        "--orient was outward, and is keep",
    );
    // Scratch files that are shorter than they were.
    let scratch = fs::read_dir(dir.join(".m.ct.partial/scratch")).expect("a folder");
    let files: Vec<_> = scratch.map(|e| e.expect("an entry").path()).collect();
    let whole: Vec<_> = files.iter().map(|f| fs::read(f).expect("a file")).collect();
    for (file, bytes) in files.iter().zip(&whole) {
        fs::write(file, bytes.get(1..).unwrap_or_default()).expect("a file");
    }
    refused(&["--resume"], 3, "bytes that the journal knows");
    for (file, bytes) in files.iter().zip(&whole) {
        fs::write(file, bytes).expect("a file");
    }
    let mut mesh = fs::read(dir.join("m.ply")).expect("a mesh");
    *mesh.last_mut().expect("a byte") ^= 1;
    fs::write(dir.join("m.ply"), &mesh).expect("a mesh");
    refused(&["--resume"], 2, "the input");
}

#[test]
fn a_second_build_of_a_target_is_refused_while_the_first_lives() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 1k", "m.ply");
    // It waits for a mesh that never comes.
    let mut first = build(dir, "m.ct", &["-"], &[])
        .stdin(Stdio::piped())
        .spawn()
        .expect("a build");
    let lock = dir.join(".m.ct.partial/lock");
    let held = || fs::read_to_string(&lock).is_ok_and(|text| text.ends_with('\n'));
    assert!(wait_for(&mut first, held));
    for more in [&[][..], &["--force"], &["--resume"]] {
        let done = build(dir, "m.ct", &["m.ply"], more)
            .output()
            .expect("a build");
        let text = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{text}");
        assert!(
            text.contains(&format!("process {} is at work", first.id())),
            "{text}"
        );
    }
    first.kill().expect("a child");
    first.wait().expect("a child");
    let done = build(dir, "m.ct", &["m.ply"], &[])
        .output()
        .expect("a build");
    assert!(done.status.success(), "{done:?}");
    assert_eq!(names(dir), ["m.ct", "m.ply", "m.ply.json"]);
}
