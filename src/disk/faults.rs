//! Calls to the system that fail, do less than they were asked, or take long: for tests, and in
//! debug builds only.
//!
//! A test arms a [`Fault`] for the n-th call of a kind; the calls are counted from then on, those
//! of all threads together. Calls that clean up after an error are counted like any other.
//!
//! Memory: a few words. I/O: none.

use super::fs::Call;
use std::io;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};

/// What happens to a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It fails with this error number of the system; a lease is refused.
    Fail(i32),
    /// The same, and all that write, create or make room after it: a disk that stays full.
    FailOn(i32),
    /// It finds the file system turned read-only, and so does all that would change it later.
    ReadOnly,
    /// It is about half of what was asked, at least one byte.
    Short,
    /// It is interrupted by a signal before it did anything.
    Interrupt,
    /// It takes a millisecond longer.
    Delay,
    /// A signal asks the process to stop while it is under way.
    Stop(i32),
}

#[derive(Default)]
struct State {
    /// The number of the call, from 1, the kinds that are counted, and what happens to it.
    armed: Option<(u64, Vec<Call>, Fault)>,
    calls: u64,
    struck: u64,
}

/// Held by the test whose fault is armed: others wait.
static TURN: Mutex<()> = Mutex::new(());
static STATE: Mutex<Option<State>> = Mutex::new(None);

fn state() -> MutexGuard<'static, Option<State>> {
    STATE.lock().unwrap_or_else(|e| e.into_inner())
}

/// The right to arm faults; calls go through again when it is dropped.
#[derive(Debug)]
pub struct Faults(#[allow(dead_code)] MutexGuard<'static, ()>);

impl Faults {
    /// Waits for the turn of this test.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Faults {
        Faults(TURN.lock().unwrap_or_else(|e| e.into_inner()))
    }

    /// Lets `fault` happen to call number `n` (from 1; 0 is none) of these kinds, and counts anew.
    pub fn arm(&self, n: u64, kinds: &[Call], fault: Fault) {
        *state() = Some(State {
            armed: Some((n, kinds.to_vec(), fault)),
            ..State::default()
        });
    }

    /// Disarms; how many calls were counted, and how many of them a fault happened to.
    pub fn disarm(&self) -> (u64, u64) {
        state().take().map_or((0, 0), |s| (s.calls, s.struck))
    }
}

impl Drop for Faults {
    fn drop(&mut self) {
        *state() = None;
    }
}

/// What happens to a call of this kind now, if anything.
fn happens(call: Call) -> Option<Fault> {
    let mut state = state();
    let state = state.as_mut()?;
    let (n, kinds, fault) = state.armed.as_ref()?;
    let (n, fault) = (*n, *fault);
    if !kinds.contains(&call) {
        return None;
    }
    state.calls += 1;
    let makes = matches!(call, Call::Write | Call::Create | Call::SetLen);
    let changes = makes || matches!(call, Call::Rename | Call::Remove);
    let lasts = match fault {
        Fault::FailOn(_) => makes,
        Fault::ReadOnly => changes,
        _ => false,
    };
    let lasts = lasts && n > 0 && state.calls > n;
    if state.calls != n && !lasts {
        return None;
    }
    state.struck += 1;
    Some(fault)
}

/// Announces a call about `bytes` bytes; how many of them it may be about.
pub(super) fn pass(call: Call, _: &Path, bytes: usize) -> io::Result<usize> {
    match happens(call) {
        None => Ok(bytes),
        Some(Fault::Fail(number) | Fault::FailOn(number)) => {
            Err(io::Error::from_raw_os_error(number))
        }
        Some(Fault::ReadOnly) => Err(io::ErrorKind::ReadOnlyFilesystem.into()),
        Some(Fault::Short) => Ok(bytes.div_ceil(2)),
        Some(Fault::Interrupt) if matches!(call, Call::Read | Call::Write) => {
            Err(io::ErrorKind::Interrupted.into())
        }
        Some(Fault::Interrupt) => Ok(bytes),
        Some(Fault::Delay) => {
            std::thread::sleep(std::time::Duration::from_millis(1));
            Ok(bytes)
        }
        Some(Fault::Stop(signal)) => {
            super::interrupt(signal);
            Ok(bytes)
        }
    }
}

/// True when a lease is to be refused.
pub(super) fn refused() -> bool {
    matches!(
        happens(Call::Lease),
        Some(Fault::Fail(_) | Fault::FailOn(_))
    )
}
