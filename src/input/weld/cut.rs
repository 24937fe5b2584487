//! How a weld cuts its memory up, and the corners into windows.
//!
//! Why windows: numbers of corners are even, so a pass that goes by corner needs no hash, no
//! sort and no care for skew: what is sent to a window's corners fits an array of the window's
//! length. Nothing here shapes the result.
//!
//! Memory: each figure below is a share of what is free. I/O: none.

use super::Tuning;
use crate::disk::Workspace;
use crate::error::Result;
use crate::shuffle::Plan;
use std::ops::Range;
use std::time::Instant;

/// The most corners of a window while windows are few: its arrays stay in a core's cache.
const WINDOW: u64 = 1 << 18;
/// More windows than this want larger ones, as far as memory goes.
const FEW: u64 = 1 << 10;
/// Bytes for each corner of a window that any pass holds at most: a position of f8.
const WINDOW_BYTES: u64 = 32;
/// Threads that would have less than this each are one.
const THREAD: u64 = 4 << 20;
/// The least for each bucket of a shuffle, in bytes: fewer make too many small writes.
const BUFFER: u64 = 5 << 10;

/// The shares of a weld's memory, in bytes, and its windows.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Threads that each pass runs on: all, or one.
    pub threads: u64,
    /// Corners of a window, a power of two.
    pub window: u64,
    /// What is cut.
    pub memory: u64,
}

impl Cut {
    /// A cut of `memory` for about `corners`.
    pub(super) fn new(memory: u64, threads: u64, corners: u64, tuning: Tuning) -> Cut {
        let few = memory / threads.max(1) < THREAD;
        let threads = if few { 1 } else { threads.max(1) };
        let threads = tuning.threads.unwrap_or(threads);
        let fits = memory / 8 / threads / WINDOW_BYTES;
        let wanted = WINDOW.max(corners / FEW);
        let window = 1 << fits.min(wanted).clamp(64, 1 << 30).ilog2();
        Cut {
            threads,
            window: tuning.window.unwrap_or(window),
            memory,
        }
    }

    /// A share of the memory for each thread.
    pub fn each(&self, parts: u64) -> u64 {
        self.memory / parts / self.threads
    }

    /// Windows of so many corners.
    pub fn windows(&self, corners: u64) -> u64 {
        corners.div_ceil(self.window)
    }

    /// A plan for records sent to corners, whose buckets are whole windows: one each when
    /// `memory` has buffers for them.
    pub fn by_window(&self, corners: u64, record: usize, memory: u64) -> Plan {
        let share = memory / self.threads;
        let afford = (share / BUFFER).max(1);
        let buckets = self.windows(corners).clamp(1, afford);
        Plan::of(buckets as usize, share, record, corners)
    }

    /// Runs `work(state, unit)` for each unit, as [`Workers::run`](crate::disk::Workers::run)
    /// does: on all threads, or on the calling one.
    ///
    /// # Errors
    /// The error of the smallest unit that failed; else the first of `start` or `close`.
    pub fn run<S>(
        &self,
        ws: &Workspace,
        units: u64,
        start: impl Fn() -> Result<S> + Sync,
        work: impl Fn(&mut S, u64) -> Result<()> + Sync,
        close: impl Fn(S) -> Result<()> + Sync,
    ) -> Result<()> {
        let all = (0..units, None);
        self.round(ws, all, start, work, close).map(drop)
    }

    /// The same for `units`, until all are done or `until` is past, as
    /// [`Workers::round`](crate::disk::Workers::round) does; gives the first that is not done.
    ///
    /// # Errors
    /// As [`run`](Cut::run).
    pub fn round<S>(
        &self,
        ws: &Workspace,
        (mut units, until): (Range<u64>, Option<Instant>),
        start: impl Fn() -> Result<S> + Sync,
        work: impl Fn(&mut S, u64) -> Result<()> + Sync,
        close: impl Fn(S) -> Result<()> + Sync,
    ) -> Result<u64> {
        if self.threads > 1 {
            return ws.workers.round(units, until, start, work, close);
        }
        let mut state = start()?;
        while !units.is_empty() {
            work(&mut state, units.start)?;
            units.start += 1;
            if until.is_some_and(|until| Instant::now() >= until) {
                break;
            }
        }
        close(state)?;
        Ok(units.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_are_whole_windows() {
        let cut = |memory| Cut::new(memory, 2, 1 << 27, Tuning::default());
        assert_eq!((cut(256 << 10).threads, cut(64 << 20).threads), (1, 2));
        assert_eq!(cut(1 << 30).window, WINDOW);
        for memory in [256 << 10, 5 << 20, 1 << 30] {
            let cut = cut(memory);
            assert!(cut.window.is_power_of_two());
            assert!(cut.threads * cut.window * WINDOW_BYTES <= memory / 8);
            for corners in [0, 1, cut.window, cut.window + 1, 1 << 27] {
                let plan = cut.by_window(corners, 8, memory / 8);
                assert!(plan.buckets as u64 <= cut.windows(corners).max(1));
                let held = cut.threads * plan.writer_bytes();
                assert!(held <= memory / 8, "{plan:?}");
            }
        }
    }
}
