//! The threads of a build, each with scratch memory of its own.
//!
//! Why errors do not depend on timing: units are handed out in ascending order, so when one
//! fails all smaller ones were handed out before it and run to their end; the error of the
//! smallest failing unit is the one returned. For the same reason a round that stops has done all
//! units before the first that it has not.

use super::go_on;
use crate::error::{Error, Result};
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// A pool of threads.
#[derive(Debug)]
pub struct Workers {
    pool: rayon::ThreadPool,
}

impl Workers {
    /// A pool of `threads` threads (at least one).
    ///
    /// # Errors
    /// [`Error::Usage`] when the system does not give that many.
    pub fn new(threads: usize) -> Result<Workers> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.max(1))
            .build()
            .map_err(|e| Error::Usage(format!("cannot start {threads} threads: {e}")))?;
        Ok(Workers { pool })
    }

    /// Number of threads.
    pub fn count(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `work(state, unit)` for every unit in `0..units`, each thread with a state of its
    /// own from `start`, and closes each state with `close`.
    ///
    /// # Errors
    /// The error of the smallest unit that failed; else the first of `start` or `close`.
    pub fn run<S>(
        &self,
        units: u64,
        start: impl Fn() -> Result<S> + Sync,
        work: impl Fn(&mut S, u64) -> Result<()> + Sync,
        close: impl Fn(S) -> Result<()> + Sync,
    ) -> Result<()> {
        self.round(0..units, None, start, work, close).map(|_| ())
    }

    /// The same for `units`, until all are done or `until` is past, but one for each thread at
    /// least. Returns the first that was not done: all before it are, and none behind it.
    ///
    /// # Errors
    /// As [`run`](Workers::run).
    pub fn round<S>(
        &self,
        units: Range<u64>,
        until: Option<Instant>,
        start: impl Fn() -> Result<S> + Sync,
        work: impl Fn(&mut S, u64) -> Result<()> + Sync,
        close: impl Fn(S) -> Result<()> + Sync,
    ) -> Result<u64> {
        let next = AtomicU64::new(units.start);
        let stop = AtomicBool::new(false);
        let failed: Mutex<Option<(u64, Error)>> = Mutex::new(None);
        let fail = |unit: u64, error: Error| {
            stop.store(true, Ordering::Relaxed);
            let mut slot = failed.lock().unwrap_or_else(|e| e.into_inner());
            if slot.as_ref().is_none_or(|(first, _)| unit < *first) {
                *slot = Some((unit, error));
            }
        };
        let body = || {
            let mut state = match start() {
                Ok(state) => state,
                Err(e) => return fail(u64::MAX, e),
            };
            loop {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let unit = next.fetch_add(1, Ordering::Relaxed);
                if unit >= units.end {
                    break;
                }
                if let Err(e) = go_on().and_then(|()| work(&mut state, unit)) {
                    return fail(unit, e);
                }
                if until.is_some_and(|until| Instant::now() >= until) {
                    break;
                }
            }
            if let Err(e) = close(state) {
                fail(u64::MAX, e);
            }
        };
        // One broadcast even for one unit: states are started on the thread that uses them.
        self.pool.broadcast(|_| body());
        match failed.into_inner().unwrap_or_else(|e| e.into_inner()) {
            Some((_, error)) => Err(error),
            None => Ok(next.into_inner().min(units.end)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_once_and_the_smallest_error() {
        let workers = Workers::new(3).unwrap();
        let sum = AtomicU64::new(0);
        let run = |bad: u64| {
            workers.run(
                1000,
                || Ok(0u64),
                |state, unit| {
                    if unit % bad == bad - 1 {
                        return Err(Error::Usage(unit.to_string()));
                    }
                    *state += unit;
                    Ok(())
                },
                |state| {
                    sum.fetch_add(state, Ordering::Relaxed);
                    Ok(())
                },
            )
        };
        run(1001).unwrap();
        assert_eq!(sum.load(Ordering::Relaxed), 999 * 1000 / 2);
        for _ in 0..20 {
            assert_eq!(run(50).unwrap_err().to_string(), "49");
        }
    }

    #[test]
    fn rounds_do_what_lies_before_their_end() {
        let workers = Workers::new(3).unwrap();
        let done = Mutex::new(Vec::new());
        let (mut next, mut rounds) = (5, 0);
        while next < 105 {
            let now = Some(Instant::now());
            let work = |_: &mut (), unit| {
                done.lock().unwrap().push(unit);
                Ok(())
            };
            let before = next;
            next = workers
                .round(before..105, now, || Ok(()), work, |()| Ok(()))
                .unwrap();
            assert!(next > before && next <= before + 3);
            let mut all = done.lock().unwrap().clone();
            all.sort_unstable();
            assert!(all.into_iter().eq(5..next));
            rounds += 1;
        }
        assert!((34..=100).contains(&rounds), "{rounds}");
    }
}
