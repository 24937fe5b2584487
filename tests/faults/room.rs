//! What only a journal keeps is no reason for a disk to be full.

use crate::{EIO, ENOSPC};
use cornermill::disk::faults::{Fault, Faults};
use cornermill::disk::fs::Call;
use cornermill::disk::journal::Pen;
use cornermill::disk::{Counters, Scratch};
use std::path::Path;
use std::sync::Arc;

fn scratch(dir: &Path) -> Scratch {
    let io = Arc::new(Counters::default());
    Scratch::named(&[dir.to_owned()], u64::MAX, &io, &dir.join("state")).expect("scratch")
}

/// A file of so many bytes that the journal in force names, and that its owner dropped.
fn kept(dir: &Path, scratch: &Scratch, bytes: usize) {
    let file = scratch.file("kept").expect("a file");
    file.append(&vec![1; bytes]).expect("appended");
    let mut pen = Pen::new(&dir.join("state"), scratch, "{}").expect("a journal");
    pen.file(&file).expect("noted");
    pen.finish().expect("in force");
}

#[test]
fn a_full_disk_takes_back_what_only_a_journal_keeps() {
    let faults = Faults::new();
    let dir = tempfile::tempdir().expect("a folder");
    let scratch = scratch(dir.path());
    kept(dir.path(), &scratch, 5000);
    assert_eq!(scratch.used(), 5000);
    let file = scratch.file("more").expect("a file");
    faults.arm(1, &[Call::Write], Fault::Fail(ENOSPC));
    file.append(b"abc").expect("there is room now");
    assert_eq!(faults.disarm().1, 1);
    assert_eq!(scratch.used(), 3);
    assert!(!dir.path().join("state").exists());
    // There is nothing more to give up.
    faults.arm(1, &[Call::Write], Fault::FailOn(ENOSPC));
    assert!(file.append(b"abc").expect_err("full").is_no_space());
}

#[test]
fn a_journal_that_comes_to_nothing_keeps_nothing() {
    let faults = Faults::new();
    let dir = tempfile::tempdir().expect("a folder");
    let scratch = scratch(dir.path());
    kept(dir.path(), &scratch, 100);
    let file = scratch.file("next").expect("a file");
    file.append(b"abc").expect("appended");
    let mut pen = Pen::new(&dir.path().join("state"), &scratch, "{}").expect("a journal");
    pen.file(&file).expect("noted");
    faults.arm(1, &[Call::Rename], Fault::Fail(EIO));
    pen.finish().expect_err("no other name");
    faults.disarm();
    assert_eq!(scratch.used(), 103);
    drop(file);
    // That of the journal before is in force still.
    assert_eq!(scratch.used(), 100);
    assert!(dir.path().join("state").exists());
}
