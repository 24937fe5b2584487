//! Reads what was sent to corners, window by window.
//!
//! Why no sort: a bucket that is one window is streamed in any order, since what takes it
//! holds an array of the window. A bucket of several windows, which there are only when memory
//! has no buffers for more buckets, is sorted, so that its windows come one after another.
//!
//! Memory: a block of at most 64 KiB, or a sorter. I/O: each record read once, once more for
//! each split of a sorter.

use super::cut::Cut;
use crate::disk::{Lease, Workspace};
use crate::error::Result;
use crate::shuffle::{Buckets, Record, Sorter};

/// Takes the records of windows in ascending order.
pub trait Visit<R> {
    /// Takes some records whose keys lie in a window.
    ///
    /// # Errors
    /// What the visitor's files and memory may say.
    fn take(&mut self, window: u64, records: &[R]) -> Result<()>;

    /// A window has had all its records; comes once for each, also for one without any.
    ///
    /// # Errors
    /// As [`take`](Visit::take).
    fn close(&mut self, window: u64) -> Result<()>;
}

/// Reads the windows of buckets on one thread.
pub struct Windows<R> {
    window: u64,
    block: Vec<R>,
    sorter: Option<Sorter<R>>,
    _lease: Lease,
}

impl<R: Record> Windows<R> {
    /// Takes an eighth of a thread's share of the memory, or the least that will do.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(ws: &Workspace, cut: &Cut, of: &Buckets<R>) -> Result<Windows<R>> {
        let several = (0..of.count()).any(|b| {
            let range = of.range(b);
            range.end - range.start > cut.window
        });
        let sorter = several
            .then(|| of.sorter(cut.each(8).max(Sorter::<R>::least())))
            .transpose()?;
        let block = match sorter {
            Some(_) => 0,
            None => (cut.each(32) as usize).min(64 << 10) / size_of::<R>() + 1,
        };
        let bytes = (block * size_of::<R>()) as u64;
        let lease = ws.budget.lease("a block of a weld", bytes)?;
        Ok(Windows {
            window: cut.window,
            block: vec![R::zeroed(); block],
            sorter,
            _lease: lease,
        })
    }

    /// Hands bucket `b` to `visit`.
    ///
    /// # Errors
    /// Those of `visit`, and of the shuffle.
    pub fn read(&mut self, of: &Buckets<R>, b: u64, visit: &mut impl Visit<R>) -> Result<()> {
        let range = of.range(b);
        let mut at = range.start / self.window;
        match &mut self.sorter {
            None => of.streamed(b, &mut self.block, &mut |records| visit.take(at, records))?,
            Some(sorter) => of.sorted(b, sorter, &mut |mut records| {
                while let Some(next) = records.first() {
                    let of_next = next.key(0) / self.window;
                    while at < of_next {
                        visit.close(at)?;
                        at += 1;
                    }
                    let end = (at + 1) * self.window;
                    let (here, rest) =
                        records.split_at(records.partition_point(|r| r.key(0) < end));
                    visit.take(at, here)?;
                    records = rest;
                }
                Ok(())
            })?,
        }
        while at * self.window < range.end {
            visit.close(at)?;
            at += 1;
        }
        Ok(())
    }
}
