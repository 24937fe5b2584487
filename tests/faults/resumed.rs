//! Builds that write down every step: whatever call fails, what is left can be gone on with, to the
//! bytes of a build that nothing happened to; and so can a build that goes on when calls fail.

use crate::place::Place;
use crate::runs::{Case, every, stepwise};
use crate::{EIO, ENOSPC, FILES, SIGTERM};
use cornermill::disk::faults::{Fault, Faults};
use cornermill::disk::fs::Call;
use cornermill::disk::interrupt;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const RESUME: &str = "--threads=1 --resume";

fn kinds() -> Vec<Call> {
    FILES.into_iter().chain([Call::Remove]).collect()
}

/// The step that a stopped build goes on behind.
fn step(place: &Place) -> Option<String> {
    let state = Path::new(place.root()).join("out/.m.ct.partial/state");
    let bytes = std::fs::read(state).ok()?;
    let line = bytes.split(|&byte| byte == b'\n').next()?;
    let line: serde_json::Value = serde_json::from_slice(line).ok()?;
    Some(line["step"].as_str()?.to_owned())
}

/// A place of a case, the calls of its run, and what it makes.
struct Trial<'a> {
    faults: &'a Faults,
    case: &'a Case,
    place: Place,
    /// The folder with copies of what stopped builds left, by step.
    saved: tempfile::TempDir,
    steps: BTreeSet<String>,
}

impl Trial<'_> {
    fn copy_of(&self, step: &str) -> PathBuf {
        self.saved.path().join(step)
    }

    /// Runs with call n in turn at fault from what `begin` prepares, and goes on each time.
    fn every(&mut self, more: &str, fault: Fault, stride: u64, begin: &dyn Fn(&Place)) {
        let kinds = kinds();
        begin(&self.place);
        self.faults.arm(0, &kinds, fault);
        let (code, said) = self.place.run_so(self.case, more);
        let (calls, _) = self.faults.disarm();
        assert_eq!(code, 0, "{}: {said}", self.case.name);
        let (right, rest) = (self.place.outputs(), self.place.tree_without_outputs());
        for n in (1..=calls).step_by(every(stride) as usize) {
            begin(&self.place);
            self.faults.arm(n, &kinds, fault);
            let (code, said) = self.place.run_so(self.case, more);
            self.faults.disarm();
            interrupt(0);
            let what = format!(
                "{}{more}, call {n} of {calls}, {fault:?}: {code} {said}",
                self.case.name
            );
            let stopped = matches!(fault, Fault::Stop(_));
            let allowed = if stopped { 143 } else { 4 };
            assert!(code == 0 || code == allowed, "{what}");
            let left = self.place.outputs();
            assert!(left == right || code != 0 && left.is_empty(), "{what}");
            if let Some(step) = step(&self.place)
                && !self.steps.contains(&step)
            {
                self.place.copy_to(&self.copy_of(&step));
                self.steps.insert(step);
            }
            if left.is_empty() {
                let (code, said) = self.place.run_so(self.case, RESUME);
                assert_eq!(code, 0, "{what}\nthen {said}");
                assert!(
                    self.place.outputs() == right,
                    "{what}: gone on with, other bytes"
                );
                assert!(
                    self.place.tree_without_outputs() == rest,
                    "{what}: something stays"
                );
            }
        }
    }
}

fn trial<'a>(faults: &'a Faults, case: &'a Case) -> Trial<'a> {
    Trial {
        faults,
        case,
        place: Place::new(case),
        saved: tempfile::tempdir().expect("a temporary folder"),
        steps: BTreeSet::new(),
    }
}

#[test]
fn whatever_call_fails_between_steps_a_build_is_gone_on_with() {
    let faults = Faults::new();
    for (case, steps) in &stepwise() {
        let mut trial = trial(&faults, case);
        trial.every("--threads=1", Fault::Fail(EIO), case.stride, &Place::clear);
        for step in steps {
            assert!(
                trial.steps.contains(*step),
                "{}: {:?}",
                case.name,
                trial.steps
            );
            let copy = trial.copy_of(step);
            let begin = |place: &Place| place.restore_from(&copy);
            trial.every(RESUME, Fault::Fail(EIO), 3 * case.stride, &begin);
        }
    }
}

#[test]
fn a_full_disk_or_a_signal_between_steps_is_gone_on_from() {
    let faults = Faults::new();
    for (case, _) in &stepwise() {
        let full = [Fault::FailOn(ENOSPC), Fault::Fail(ENOSPC)];
        for fault in full.into_iter().chain([Fault::Stop(SIGTERM)]) {
            let mut trial = trial(&faults, case);
            trial.every("--threads=1", fault, 7 * case.stride, &Place::clear);
        }
    }
}
