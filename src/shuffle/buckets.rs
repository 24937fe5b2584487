//! The reading side: buckets in ascending order of level-0 keys, each sorted on demand.
//!
//! Reading consumes: a bucket is read once, and the scratch file that it shares with its
//! neighbours is freed when the last of them was read, or when [`Buckets`] is dropped.
//!
//! Memory: 16 bytes for each extent and one for each bucket, leased; kept records stay within
//! their writers' leases. I/O: one read for each extent.

use super::Record;
use super::layout::{EXTENT_BYTES, Extent, Extents, Layout};
use super::sorter::Sorter;
use super::writer::lock;
use crate::disk::{Budget, Lease, Scratch, ScratchFile};
use crate::error::{Error, Result};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Records that a writer kept in memory, with their extents by bucket.
pub(super) struct Resident<R> {
    records: Vec<R>,
    extents: Vec<Extent>,
    _lease: Lease,
}

impl<R> Resident<R> {
    pub(super) fn new(records: Vec<R>, extents: Vec<Extent>, lease: Lease) -> Resident<R> {
        Resident {
            records,
            extents,
            _lease: lease,
        }
    }
}

/// A file with the number of its buckets that are still to be read.
struct Shared {
    file: Option<Arc<ScratchFile>>,
    unread: u64,
}

/// The records of a finished shuffle. Threads share it, each with a [`Sorter`] of its own.
pub struct Buckets<R> {
    layout: Layout,
    files: Vec<Mutex<Shared>>,
    /// Ascending by bucket, then by place in the file.
    extents: Vec<Extent>,
    kept: Vec<Resident<R>>,
    taken: Vec<AtomicBool>,
    records: u64,
    spilled: u64,
    budget: Budget,
    scratch: Scratch,
    _lease: Lease,
}

impl<R: Record> Buckets<R> {
    pub(super) fn new(
        layout: Layout,
        files: Vec<Option<Arc<ScratchFile>>>,
        lists: Vec<Extents>,
        kept: Vec<Resident<R>>,
        (records, spilled): (u64, u64),
        (budget, scratch): (Budget, Scratch),
    ) -> Result<Buckets<R>> {
        let n: usize = lists.iter().map(Extents::len).sum();
        let lease = budget.lease(
            "the extents of a shuffle",
            n as u64 * EXTENT_BYTES + layout.buckets,
        )?;
        let mut extents = Vec::with_capacity(n);
        for (list, _lease) in lists.into_iter().flat_map(Extents::into_lists) {
            extents.extend_from_slice(&list);
        }
        extents.sort_unstable_by_key(|e| (e.bucket, e.at));
        let share = |(i, file): (usize, Option<Arc<ScratchFile>>)| {
            let first = (i as u64) << layout.file_shift;
            let unread = (layout.buckets - first).min(1 << layout.file_shift);
            Mutex::new(Shared { file, unread })
        };
        Ok(Buckets {
            files: files.into_iter().enumerate().map(share).collect(),
            taken: (0..layout.buckets)
                .map(|_| AtomicBool::new(false))
                .collect(),
            layout,
            extents,
            kept,
            records,
            spilled,
            budget,
            scratch,
            _lease: lease,
        })
    }

    /// Number of buckets.
    pub fn count(&self) -> u64 {
        self.layout.buckets
    }

    /// Number of records in all.
    pub fn records(&self) -> u64 {
        self.records
    }

    /// Bytes that the writers wrote to scratch files.
    pub fn spilled_bytes(&self) -> u64 {
        self.spilled
    }

    /// Keys of level 0 that bucket b covers.
    pub fn range(&self, b: u64) -> Range<u64> {
        let Range { start, end } = self.layout.keys;
        // In u128, since the end of the last bucket may pass the greatest u64.
        let bound = |b: u64| {
            let at = u128::from(start) + (u128::from(b) << self.layout.shift);
            at.min(u128::from(end)) as u64
        };
        bound(b)..bound(b.saturating_add(1))
    }

    /// A sorter of `memory` bytes, leased; at least [`Sorter::least`]. One for each thread.
    ///
    /// # Errors
    /// [`Error::Budget`] when `memory` is too small, or not free.
    pub fn sorter(&self, memory: u64) -> Result<Sorter<R>> {
        Sorter::new(&self.budget, &self.scratch, memory)
    }

    /// Hands the records of bucket `b` in full key order to `sink`, in slices.
    ///
    /// # Errors
    /// [`Error::Internal`] when the bucket was read before or does not exist; what `sink`
    /// returns; what reading, or splitting on disk, may say.
    pub fn sorted(
        &self,
        b: u64,
        sorter: &mut Sorter<R>,
        sink: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        self.consume(b, |bucket| sorter.sort(bucket, sink))
    }

    /// Number of records in bucket `b`.
    pub fn records_of(&self, b: u64) -> u64 {
        self.bucket(b).records()
    }

    /// Fills `into` with the records of bucket `b` in no order. The caller has leased memory for
    /// [`records_of`](Buckets::records_of) it.
    ///
    /// # Errors
    /// [`Error::Internal`] when the bucket was read before or does not exist; [`Error::Io`].
    pub fn unsorted(&self, b: u64, into: &mut Vec<R>) -> Result<()> {
        self.consume(b, |bucket| {
            into.resize(bucket.records() as usize, R::zeroed());
            bucket.load(into)
        })
    }

    /// Hands the records of bucket `b` in no order to `each`, in slices of at most `block`.
    ///
    /// # Errors
    /// As [`unsorted`](Buckets::unsorted), and those of `each`.
    pub fn streamed(
        &self,
        b: u64,
        block: &mut [R],
        each: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        self.consume(b, |bucket| bucket.stream(block, each))
    }

    /// Hands out bucket `b`, once, and frees its file when it was the last one in it.
    fn consume<T>(&self, b: u64, read: impl FnOnce(&Bucket<R>) -> Result<T>) -> Result<T> {
        let taken = self.taken.get(b as usize);
        if taken.is_none_or(|t| t.swap(true, Ordering::Relaxed)) {
            return Err(Error::Internal(format!(
                "bucket {b} of {} was read before, or does not exist",
                self.count()
            )));
        }
        let done = read(&self.bucket(b));
        let mut shared = lock(&self.files[(b >> self.layout.file_shift) as usize]);
        shared.unread -= 1;
        if shared.unread == 0 {
            shared.file = None;
        }
        done
    }

    fn bucket(&self, b: u64) -> Bucket<'_, R> {
        Bucket {
            file: lock(&self.files[(b >> self.layout.file_shift) as usize])
                .file
                .clone(),
            extents: part_of(&self.extents, b),
            kept: &self.kept,
            b,
        }
    }

    /// As [`sorted`](Buckets::sorted), for all buckets in order.
    ///
    /// # Errors
    /// As [`sorted`](Buckets::sorted).
    pub fn sorted_all(
        &self,
        sorter: &mut Sorter<R>,
        sink: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        (0..self.count()).try_for_each(|b| self.sorted(b, sorter, sink))
    }
}

/// The extents of bucket `b` in a list that ascends by bucket.
fn part_of(extents: &[Extent], b: u64) -> &[Extent] {
    let from = extents.partition_point(|e| u64::from(e.bucket) < b);
    let len = extents[from..].partition_point(|e| u64::from(e.bucket) == b);
    &extents[from..from + len]
}

/// One bucket, unsorted.
pub(super) struct Bucket<'a, R> {
    file: Option<Arc<ScratchFile>>,
    extents: &'a [Extent],
    kept: &'a [Resident<R>],
    b: u64,
}

impl<R: Record> Bucket<'_, R> {
    /// Number of records.
    pub(super) fn records(&self) -> u64 {
        let kept = self.kept.iter().flat_map(|k| part_of(&k.extents, self.b));
        let all = self.extents.iter().chain(kept);
        all.map(|e| u64::from(e.records)).sum()
    }

    /// Hands all records to `each` in pieces of at most `buffer.len()`.
    pub(super) fn stream(
        &self,
        buffer: &mut [R],
        each: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        for extent in self.extents {
            let mut at = extent.at;
            let mut left = extent.records as usize;
            while left > 0 {
                let n = left.min(buffer.len());
                self.read(&mut buffer[..n], at)?;
                each(&buffer[..n])?;
                at += (n * size_of::<R>()) as u64;
                left -= n;
            }
        }
        for slice in self.kept_slices() {
            each(slice)?;
        }
        Ok(())
    }

    /// Fills `into`, which is as long as the bucket.
    pub(super) fn load(&self, into: &mut [R]) -> Result<()> {
        let mut done = 0;
        for extent in self.extents {
            let n = extent.records as usize;
            self.read(&mut into[done..done + n], extent.at)?;
            done += n;
        }
        for slice in self.kept_slices() {
            into[done..done + slice.len()].copy_from_slice(slice);
            done += slice.len();
        }
        Ok(())
    }

    fn read(&self, into: &mut [R], at: u64) -> Result<()> {
        let Some(file) = &self.file else {
            return Err(Error::Internal(format!(
                "the scratch file of bucket {} is gone",
                self.b
            )));
        };
        file.read_at(bytemuck::cast_slice_mut(into), at)
    }

    fn kept_slices(&self) -> impl Iterator<Item = &[R]> {
        self.kept.iter().flat_map(|k| {
            let slice = |e: &Extent| &k.records[e.at as usize..][..e.records as usize];
            part_of(&k.extents, self.b).iter().map(slice)
        })
    }
}
