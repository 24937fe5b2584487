//! Commands that are asked to stop, and what the dead leave for the next run.

use super::{PROGRAM, build, make, names, same, stopped};
use std::fs;
use std::process::{Command, Stdio};

#[test]
fn builds_stop_when_asked_and_say_how_to_go_on() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 500k --order shuffle --flip 0.3", "m.ply");
    let whole = build(dir, "whole.ct", &["m.ply"], &[])
        .output()
        .expect("a build");
    assert!(whole.status.success());
    let state = dir.join(".m.ct.partial/state");
    for (name, code) in [("-INT", 130), ("-TERM", 143)] {
        let start = || {
            build(dir, "m.ct", &["m.ply"], &[])
                .spawn()
                .expect("a build")
        };
        let clear = || fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
        let done = stopped(start, || state.is_file(), name, clear);
        let text = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(code), "{text}");
        assert!(
            text.contains("is kept; to go on: ") && text.contains("--resume"),
            "{text}"
        );
        assert!(!dir.join("m.ct").exists() && state.is_file());
        let done = build(dir, "m.ct", &["m.ply"], &["--resume"])
            .output()
            .expect("a build");
        assert!(done.status.success(), "{done:?}");
        same(dir, "whole.ct", "m.ct");
        fs::remove_dir_all(dir.join("m.ct")).expect("a folder");
        assert_eq!(names(dir), ["m.ply", "m.ply.json", "whole.ct"]);
    }
}

#[test]
fn other_commands_leave_nothing_and_the_next_takes_what_the_dead_left() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    make(dir, "sphere -t 500k", "m.npy");
    let args = ["m.npy", "--positions", "m.G.npy"];
    let done = build(dir, "m.ct", &args, &[]).output().expect("a build");
    assert!(done.status.success(), "{done:?}");
    let before = names(dir);
    let encode = || {
        let mut command = Command::new(PROGRAM);
        command.current_dir(dir).args([
            "encode", "m.ct", "-o", "m.cmz", "--level", "strong", "--bits", "14", "-q",
        ]);
        command.stderr(Stdio::piped());
        command
    };
    let at_work = || {
        names(dir)
            .iter()
            .any(|name| name.starts_with(".cornermill-"))
    };
    let start = || encode().spawn().expect("encode runs");
    let clear = || fs::remove_file(dir.join("m.cmz")).expect("a file");
    for (name, code) in [("-INT", 130), ("-TERM", 143)] {
        let done = stopped(start, at_work, name, clear);
        assert_eq!(done.status.code(), Some(code), "{done:?}");
        assert_eq!(names(dir), before);
    }
    stopped(start, at_work, "-KILL", clear);
    assert!(at_work(), "nothing is left to find");
    assert!(encode().output().expect("encode runs").status.success());
    assert!(!at_work(), "{:?}", names(dir));
}
