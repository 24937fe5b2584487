//! Calls to the system that fail, one after the other: of a small run of every command, each call
//! in turn fails, finds the disk full, does less than it was asked, or is interrupted.
//!
//! Whatever fails, the run ends with an error that names a path and what was tried, or with the
//! very output of a run without faults; nothing half done has a final name, nothing temporary is
//! left, and no input is changed. The runs are in this process, one at a time.

#![cfg(debug_assertions)]

#[path = "../common/mod.rs"]
mod common;
mod place;
mod resumed;
mod room;
mod runs;
mod stays;

use cornermill::disk::faults::{Fault, Faults};
use cornermill::disk::fs::Call;
use cornermill::disk::interrupt;
use place::{Place, Tree};
use runs::{Case, cases, every};
use std::path::PathBuf;

const EIO: i32 = 5;
const ENOSPC: i32 = 28;
const EROFS: i32 = 30;
const EDQUOT: i32 = 122;
const SIGTERM: i32 = 15;

/// All but removals, of which `stays` tells, and what asks for memory.
const FILES: [Call; 9] = [
    Call::Open,
    Call::Create,
    Call::Ask,
    Call::SetLen,
    Call::Read,
    Call::Write,
    Call::Sync,
    Call::Map,
    Call::Rename,
];
const MAKING: [Call; 3] = [Call::Create, Call::SetLen, Call::Write];

/// What a fault must lead to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Must {
    /// Exit code 4, or the right output.
    FailOnDisk,
    /// Exit code 5, or the right output.
    LackMemory,
    /// Exit code 143, or the right output.
    Stop,
    /// The right output.
    Succeed,
}

/// Runs a case with call n in turn at fault; how many there were.
fn every_call(faults: &Faults, case: &Case, kinds: &[Call], fault: Fault, must: Must) -> u64 {
    let place = Place::new(case);
    faults.arm(0, kinds, fault);
    let (code, said) = place.run(case);
    let (calls, _) = faults.disarm();
    assert_eq!(code, 0, "{}: {said}", case.name);
    assert!(
        calls > 0 || kinds == [Call::Lease],
        "{}: no call",
        case.name
    );
    let right = place.outputs();
    place.clear();
    let before = place.tree();
    let mut n = 1;
    while n <= calls {
        faults.arm(n, kinds, fault);
        let (code, said) = place.run(case);
        let (_, struck) = faults.disarm();
        interrupt(0);
        let what = format!(
            "{}, call {n} of {calls} of {kinds:?}, {fault:?}: {code} {said}",
            case.name
        );
        let stays = judge(
            &what,
            must,
            (code, &said, struck),
            &place,
            (&before, &right),
        );
        if stays {
            place.clear_outputs();
            let (code, said) = place.run(case);
            assert_eq!(code, 0, "{what}\nthen {said}");
            assert!(
                place.tree_without_outputs() == before,
                "{what}: the next run leaves it"
            );
        }
        place.clear();
        n += if fault == Fault::Fail(EIO) {
            1
        } else {
            case.stride
        };
    }
    calls
}

/// Holds what a run left to what must be; true when something stays that could not be removed, and is
/// told.
fn judge(
    what: &str,
    must: Must,
    (code, said, struck): (u8, &str, u64),
    place: &Place,
    (before, right): (&Tree, &Tree),
) -> bool {
    let left = place.outputs();
    // What comes after a rename finds a finished output; of two files one may be there, whole.
    let whole = |(name, bytes): (&PathBuf, &Vec<u8>)| {
        name.components().count() == 2 && right.get(name) == Some(bytes)
    };
    let files = right.keys().all(|name| name.components().count() == 2);
    assert!(
        left.is_empty() || left == *right || files && left.iter().all(whole),
        "{what}\nleft {:?}",
        left.keys()
    );
    let rest = place.tree_without_outputs();
    let stays = rest != *before;
    assert!(
        !stays || said.contains("cannot remove it"),
        "{what}\nfrom {:?}\nto {:?}",
        before.keys(),
        rest.keys()
    );
    if code == 0 {
        assert!(left == *right, "{what}: other bytes");
        return stays;
    }
    assert!(struck > 0, "{what}: an error without a fault");
    let allowed = match must {
        Must::FailOnDisk => 4,
        Must::LackMemory => 5,
        Must::Stop => 143,
        Must::Succeed => 0,
    };
    assert_eq!(code, allowed, "{what}");
    if must == Must::FailOnDisk {
        assert!(
            said.contains(place.root()) && said.contains("cannot "),
            "{what}"
        );
    }
    stays
}

#[test]
fn every_call_that_fails_is_an_error_or_does_no_harm() {
    let faults = Faults::new();
    for case in cases() {
        let calls = every_call(&faults, &case, &FILES, Fault::Fail(EIO), Must::FailOnDisk);
        eprintln!("{}: {calls} calls", case.name);
    }
}

#[test]
fn a_disk_that_is_full_from_any_call_on_is_an_error() {
    let faults = Faults::new();
    for (case, number) in cases().iter().zip([ENOSPC, EDQUOT, EROFS].iter().cycle()) {
        if !case.outputs {
            continue;
        }
        every_call(
            &faults,
            case,
            &MAKING,
            Fault::FailOn(*number),
            Must::FailOnDisk,
        );
    }
}

#[test]
fn what_is_cut_short_or_interrupted_is_gone_on_with() {
    let faults = Faults::new();
    for case in cases() {
        for (kinds, fault) in [
            (&[Call::Read, Call::Write][..], Fault::Short),
            (&[Call::Read, Call::Write], Fault::Interrupt),
        ] {
            every_call(&faults, &case, kinds, fault, Must::Succeed);
        }
    }
}

#[test]
fn a_signal_at_any_call_ends_in_order() {
    let faults = Faults::new();
    for mut case in cases() {
        case.stride = every(30 * case.stride);
        every_call(&faults, &case, &FILES, Fault::Stop(SIGTERM), Must::Stop);
    }
}

#[test]
fn a_call_that_takes_long_changes_no_byte() {
    let faults = Faults::new();
    let mut all = 0;
    for case in cases() {
        let place = Place::new(&case);
        faults.arm(0, &FILES, Fault::Delay);
        let (code, said) = place.run(&case);
        let (calls, _) = faults.disarm();
        assert_eq!(code, 0, "{}: {said}", case.name);
        let right = place.outputs();
        place.clear();
        for n in (1..=calls).step_by((calls as usize / 8).max(1)) {
            faults.arm(n, &FILES, Fault::Delay);
            let (code, said) = place.run_so(&case, "--threads=2");
            all += faults.disarm().1;
            assert_eq!(code, 0, "{}, call {n}: {said}", case.name);
            assert!(
                place.outputs() == right,
                "{}, call {n}: other bytes",
                case.name
            );
            place.clear();
        }
    }
    assert!(all > 100, "{all} calls were late");
}

#[test]
fn every_lease_that_is_refused_is_an_error_or_another_way() {
    let faults = Faults::new();
    for case in cases() {
        every_call(
            &faults,
            &case,
            &[Call::Lease],
            Fault::Fail(0),
            Must::LackMemory,
        );
    }
}
