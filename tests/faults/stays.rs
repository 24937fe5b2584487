//! Removals that fail: what stays is told, is no output, and goes with the next run.

use crate::place::Place;
use crate::runs::{Case, cases, every};
use crate::{EIO, FILES};
use cornermill::disk::faults::{Fault, Faults};
use cornermill::disk::fs::Call;

/// Runs a case with call n in turn at fault, and each time once more without; how many of the first
/// runs left something.
fn every_call(faults: &Faults, case: &Case, kinds: &[Call], fault: Fault, stride: u64) -> u64 {
    let place = Place::new(case);
    let before = place.tree();
    faults.arm(0, kinds, fault);
    let (code, said) = place.run(case);
    let (calls, _) = faults.disarm();
    assert_eq!(code, 0, "{}: {said}", case.name);
    let right = place.outputs();
    place.clear();
    let mut stayed = 0;
    for n in (1..=calls).step_by(stride as usize) {
        faults.arm(n, kinds, fault);
        let (code, said) = place.run(case);
        faults.disarm();
        let what = format!(
            "{}, call {n} of {calls}, {fault:?}: {code} {said}",
            case.name
        );
        let left = place.outputs();
        match code {
            0 => assert!(left == right, "{what}: other bytes"),
            4 => assert!(
                said.contains("cannot ") && said.contains(place.root()),
                "{what}"
            ),
            _ => panic!("{what}"),
        }
        assert!(
            left.iter()
                .all(|(name, bytes)| right.get(name) == Some(bytes)),
            "{what}: a part of an output"
        );
        if place.tree_without_outputs() != before {
            assert!(
                said.contains("cannot remove it"),
                "{what}: what stays is not told"
            );
            stayed += 1;
        }
        place.clear_outputs();
        let (code, said) = place.run(case);
        assert_eq!(code, 0, "{what}\nthen {said}");
        assert!(
            place.outputs() == right,
            "{what}: other bytes in the next run"
        );
        assert!(
            place.tree_without_outputs() == before,
            "{what}: the next run leaves it"
        );
        place.clear();
    }
    stayed
}

#[test]
fn what_cannot_be_removed_is_told_and_goes_with_the_next_run() {
    let faults = Faults::new();
    let mut stayed = 0;
    for case in cases() {
        stayed += every_call(&faults, &case, &[Call::Remove], Fault::Fail(EIO), 1);
    }
    assert!(stayed > 10, "{stayed}");
}

#[test]
fn a_disk_that_turns_read_only_is_an_error_and_the_next_run_takes_what_stays() {
    let faults = Faults::new();
    let kinds: Vec<Call> = FILES.into_iter().chain([Call::Remove]).collect();
    let mut stayed = 0;
    for case in cases().iter().filter(|case| case.outputs) {
        stayed += every_call(
            &faults,
            case,
            &kinds,
            Fault::ReadOnly,
            every(35 * case.stride),
        );
    }
    assert!(stayed > 40, "{stayed}");
}
