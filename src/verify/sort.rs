//! An external sort of plain records: sorted runs in scratch space, then a k-way merge.
//!
//! Why that is bounded: a thread fills a buffer of fixed size, sorts it and writes it as a run;
//! a merge holds a read buffer for each of its runs, and when the runs are more than the
//! memory has buffers for, groups of them are merged into longer runs first. Runs lie at
//! multiples of one stride, so their places need no list. No distribution of keys matters:
//! a key that occurs in every record sorts as well as any other.
//!
//! Memory: the buffers, leased: what each thread was given to fill, then what the merge was
//! given. I/O: each record is written and read once, and once more for each level of merging
//! (log of runs to the base memory / 16 KiB, less one).

use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::Result;
use bytemuck::Pod;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The least read buffer of a run in a merge, in bytes.
const LEAST_BUFFER: u64 = 16 << 10;
/// The largest: more does not make reading faster.
const MOST_BUFFER: u64 = 1 << 20;

/// The least memory of a merge, in bytes: two runs in, one out.
pub(super) const LEAST_MERGE: u64 = 3 * LEAST_BUFFER;

/// A record that can be sorted.
pub(super) trait Record: Pod + Send + Sync {
    /// What it is sorted by.
    type Key: Ord + Copy;
    /// Its key.
    fn key(&self) -> Self::Key;
}

/// Records to be sorted, in runs of at most `cap`.
pub(super) struct Sorter<R> {
    what: &'static str,
    cap: usize,
    runs: Runs,
    kind: std::marker::PhantomData<fn() -> R>,
}

/// Runs in one file: run i begins at record i * stride and is stride long, unless `short`.
struct Runs {
    file: ScratchFile,
    stride: u64,
    count: AtomicU64,
    short: Mutex<Vec<(u64, u64)>>,
}

impl Runs {
    fn new(ws: &Workspace, what: &str, stride: u64) -> Result<Runs> {
        Ok(Runs {
            file: ws.scratch.file(what)?,
            stride,
            count: AtomicU64::new(0),
            short: Mutex::new(Vec::new()),
        })
    }

    fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    /// First record and number of records of run `i`.
    fn place(&self, i: u64) -> (u64, u64) {
        let short = self.short.lock().unwrap_or_else(|e| e.into_inner());
        let len = short.iter().find(|(run, _)| *run == i);
        (i * self.stride, len.map_or(self.stride, |(_, len)| *len))
    }

    fn shorten(&self, run: u64, len: u64) {
        if len < self.stride {
            let mut short = self.short.lock().unwrap_or_else(|e| e.into_inner());
            short.push((run, len));
        }
    }
}

impl<R: Record> Sorter<R> {
    /// A sorter whose threads each fill a buffer of `bytes`.
    pub(super) fn new(ws: &Workspace, what: &'static str, bytes: u64) -> Result<Sorter<R>> {
        let cap = (bytes as usize / size_of::<R>()).max(16);
        Ok(Sorter {
            what,
            cap,
            runs: Runs::new(ws, what, cap as u64)?,
            kind: std::marker::PhantomData,
        })
    }

    /// A buffer for one thread.
    pub(super) fn filler(&self, ws: &Workspace) -> Result<Filler<'_, R>> {
        let bytes = (self.cap * size_of::<R>()) as u64;
        let lease = ws.budget.lease(self.what, bytes)?;
        Ok(Filler {
            sorter: self,
            buf: Vec::with_capacity(self.cap),
            _lease: lease,
        })
    }

    /// Number of runs written so far.
    pub(super) fn runs(&self) -> u64 {
        self.runs.count()
    }

    fn write_run(&self, records: &mut Vec<R>) -> Result<()> {
        if records.is_empty() {
            return Ok(());
        }
        records.sort_unstable_by_key(R::key);
        let run = self.runs.count.fetch_add(1, Ordering::Relaxed);
        let at = run * self.runs.stride * size_of::<R>() as u64;
        self.runs.file.write_at(bytemuck::cast_slice(records), at)?;
        self.runs.shorten(run, records.len() as u64);
        records.clear();
        Ok(())
    }

    /// All records in the order of their keys, read with `bytes` of memory.
    pub(super) fn merge(self, ws: &Workspace, bytes: u64) -> Result<Merge<R>> {
        let bytes = bytes.max(LEAST_MERGE);
        let fan = (bytes / LEAST_BUFFER - 1).max(2);
        let mut runs = self.runs;
        while runs.count() > fan {
            let lease = ws.budget.lease(self.what, bytes)?;
            runs = merge_groups::<R>(ws, self.what, runs, fan, bytes)?;
            drop(lease);
        }
        let count = runs.count();
        let buffer = (bytes / count.max(1)).min(MOST_BUFFER);
        let lease = ws.budget.lease(self.what, count * buffer)?;
        Merge::new(runs, 0, count, buffer, Some(lease))
    }
}

/// Merges every `fan` runs into one.
fn merge_groups<R: Record>(
    ws: &Workspace,
    what: &str,
    from: Runs,
    fan: u64,
    bytes: u64,
) -> Result<Runs> {
    let to = Runs::new(ws, what, from.stride * fan)?;
    let groups = from.count().div_ceil(fan);
    let buffer = bytes / (fan + 1);
    let mut out: Vec<R> = Vec::with_capacity(buffer as usize / size_of::<R>());
    let mut from = from;
    for group in 0..groups {
        let (first, end) = (group * fan, from.count().min((group + 1) * fan));
        let mut merge = Merge::<R>::new(from, first, end, buffer, None)?;
        let start = group * to.stride;
        let mut len = 0u64;
        loop {
            let record = merge.next()?;
            out.extend(record);
            if out.len() == out.capacity() || record.is_none() {
                let at = (start + len) * size_of::<R>() as u64;
                to.file.write_at(bytemuck::cast_slice(&out), at)?;
                len += out.len() as u64;
                out.clear();
            }
            if record.is_none() {
                break;
            }
        }
        to.count.fetch_add(1, Ordering::Relaxed);
        to.shorten(group, len);
        from = merge.runs;
    }
    Ok(to)
}

/// The buffer that one thread fills.
pub(super) struct Filler<'a, R: Record> {
    sorter: &'a Sorter<R>,
    buf: Vec<R>,
    _lease: Lease,
}

impl<R: Record> Filler<'_, R> {
    /// Adds a record.
    #[inline]
    pub(super) fn push(&mut self, record: R) -> Result<()> {
        if self.buf.len() == self.sorter.cap {
            self.sorter.write_run(&mut self.buf)?;
        }
        self.buf.push(record);
        Ok(())
    }

    /// Writes what is left.
    pub(super) fn finish(mut self) -> Result<()> {
        self.sorter.write_run(&mut self.buf)
    }
}

/// The records of a sorter, in order.
pub(super) struct Merge<R: Record> {
    runs: Runs,
    cursors: Vec<Cursor<R>>,
    /// Heads of all cursors but the current one.
    heap: BinaryHeap<Reverse<(R::Key, usize)>>,
    current: Option<usize>,
    _lease: Option<Lease>,
}

struct Cursor<R> {
    next: u64,
    end: u64,
    buf: Vec<R>,
    at: usize,
}

impl<R: Record> Cursor<R> {
    /// Head of the run, after reading more when the buffer is used up.
    fn head(&mut self, file: &ScratchFile, cap: usize) -> Result<Option<&R>> {
        if self.at == self.buf.len() && self.next < self.end {
            let n = ((self.end - self.next) as usize).min(cap);
            self.buf.resize(n, R::zeroed());
            file.read_at(
                bytemuck::cast_slice_mut(&mut self.buf),
                self.next * size_of::<R>() as u64,
            )?;
            self.next += n as u64;
            self.at = 0;
        }
        Ok(self.buf.get(self.at))
    }
}

impl<R: Record> Merge<R> {
    fn new(
        runs: Runs,
        first: u64,
        end: u64,
        buffer: u64,
        lease: Option<Lease>,
    ) -> Result<Merge<R>> {
        let cap = (buffer as usize / size_of::<R>()).max(1);
        let mut cursors = Vec::new();
        let mut heap = BinaryHeap::new();
        for run in first..end {
            let (next, len) = runs.place(run);
            let mut cursor: Cursor<R> = Cursor {
                next,
                end: next + len,
                buf: Vec::with_capacity(cap.min(len as usize)),
                at: 0,
            };
            if let Some(head) = cursor.head(&runs.file, cap)? {
                heap.push(Reverse((head.key(), cursors.len())));
                cursors.push(cursor);
            }
        }
        let current = heap.pop().map(|Reverse((_, which))| which);
        Ok(Merge {
            runs,
            cursors,
            heap,
            current,
            _lease: lease,
        })
    }

    /// The next record, or none at the end. Equal keys come in the order of their runs.
    pub(super) fn next(&mut self) -> Result<Option<R>> {
        let Some(which) = self.current else {
            return Ok(None);
        };
        let cursor = &mut self.cursors[which];
        let record = cursor.buf[cursor.at];
        cursor.at += 1;
        let cap = cursor.buf.capacity();
        match cursor.head(&self.runs.file, cap)?.map(R::key) {
            None => self.current = self.heap.pop().map(|Reverse((_, which))| which),
            Some(key) => {
                // Stay with this run while it has the least key: runs of a coherent mesh
                // hardly overlap, so the heap is seldom touched.
                if self.heap.peek().is_some_and(|top| top.0 < (key, which)) {
                    self.heap.push(Reverse((key, which)));
                    self.current = self.heap.pop().map(|Reverse((_, which))| which);
                }
            }
        }
        Ok(Some(record))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::testing::workspace;
    use bytemuck::Zeroable;

    /// A single id, sorted by itself.
    #[repr(transparent)]
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
    struct Id(u64);

    impl Record for Id {
        type Key = u64;
        fn key(&self) -> u64 {
            self.0
        }
    }

    #[test]
    fn sorts_through_many_runs_and_levels() {
        for (count, run_bytes, merge_bytes) in [
            (0u64, 1024, 0),
            (1, 1024, 0),
            (5_000, 1 << 20, 1 << 20),
            (100_000, 1024, LEAST_MERGE),
            (100_000, 4096, 1 << 20),
        ] {
            let (ws, _dir) = workspace(8 << 20, 3);
            let sorter = Sorter::<Id>::new(&ws, "test", run_bytes).unwrap();
            ws.workers
                .run(
                    10,
                    || sorter.filler(&ws),
                    |filler, unit| {
                        for i in (unit..count).step_by(10) {
                            filler.push(Id(i.wrapping_mul(0x9e37_79b9_7f4a_7c15) % 1000))?;
                        }
                        Ok(())
                    },
                    Filler::finish,
                )
                .unwrap();
            assert_eq!(sorter.runs() > 1, count * 8 > run_bytes);
            let mut expected: Vec<u64> = (0..count)
                .map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) % 1000)
                .collect();
            expected.sort();
            let mut merge = sorter.merge(&ws, merge_bytes).unwrap();
            let mut found = Vec::new();
            while let Some(Id(id)) = merge.next().unwrap() {
                found.push(id);
            }
            assert_eq!(found, expected);
            drop(merge);
            assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
        }
    }
}
