//! The reading side: buckets in ascending order of level-0 keys, each sorted on demand.
//!
//! Reading consumes: a bucket is read once, and each of its runs is freed on disk as soon as it
//! was read. Where the file system does not free parts of files, the scratch file that a bucket
//! shares with its neighbours is dropped when the last of them was read.
//!
//! Memory: a byte for each bucket, leased; runs and kept records stay within their writers'
//! leases. I/O: one read for each run, once more for a bucket that must be split.

use super::Record;
use super::held::Held;
use super::keep::Parts;
use super::layout::Layout;
use super::runs::Run;
use super::sorter::Sorter;
use super::writer::lock;
use crate::disk::journal::{Pen, Reader};
use crate::disk::{Budget, Lease, Scratch, ScratchFile};
use crate::error::{Error, Result};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// A shuffle of so many bytes may have left the page cache when it is read.
const FAR: u64 = 1 << 30;

/// A file with the number of its buckets that are still to be read.
struct Shared {
    file: Option<Arc<ScratchFile>>,
    unread: u64,
}

/// The records of a finished shuffle. Threads share it, each with a [`Sorter`] of its own.
pub struct Buckets<R> {
    layout: Layout,
    files: Vec<Mutex<Shared>>,
    held: Vec<Held<R>>,
    taken: Vec<AtomicBool>,
    /// Sorters that were made: so many buckets are read at a time.
    sorters: AtomicU64,
    /// Buckets before this one were announced.
    announced: AtomicU64,
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
        held: Vec<Held<R>>,
        (records, spilled): (u64, u64),
        (budget, scratch): (Budget, Scratch),
    ) -> Result<Buckets<R>> {
        let lease = budget.lease("the buckets of a shuffle", layout.buckets)?;
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
            sorters: AtomicU64::new(0),
            announced: AtomicU64::new(0),
            layout,
            held,
            records,
            spilled,
            budget,
            scratch,
            _lease: lease,
        })
    }

    /// Writes them down, and which were read, as long as none is being read.
    pub(super) fn write_down(&self, to: &mut Pen) -> Result<()> {
        let taken = self
            .taken
            .iter()
            .map(|t| u8::from(t.load(Ordering::Relaxed)));
        to.list(&taken.collect::<Vec<u8>>())?;
        let files: Vec<_> = self.files.iter().map(|f| lock(f).file.clone()).collect();
        let counts = (self.records, self.spilled);
        super::keep::keep(to, &self.layout, &files, &self.held, counts)
    }

    /// The same, of which some were read before, as [`write_down`](Buckets::write_down) says.
    pub(super) fn of(parts: Parts<R>, taken: &[u8], from: &Reader) -> Result<Buckets<R>> {
        let Parts {
            layout,
            files,
            held,
            counts,
        } = parts;
        let room = (from.budget.clone(), from.scratch.clone());
        let file_shift = layout.file_shift;
        let buckets = Buckets::new(layout, files, held, counts, room)?;
        for (b, flag) in buckets.taken.iter().enumerate() {
            if taken.get(b) == Some(&1) {
                flag.store(true, Ordering::Relaxed);
                lock(&buckets.files[b >> file_shift]).unread -= 1;
            }
        }
        Ok(buckets)
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
        self.sorters.fetch_add(1, Ordering::Relaxed);
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
        self.consume(b, |bucket| bucket.stream(true, block, each))
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
        self.announce(b);
        let done = read(&self.bucket(b));
        let mut shared = lock(&self.files[(b >> self.layout.file_shift) as usize]);
        shared.unread -= 1;
        if shared.unread == 0 {
            shared.file = None;
        }
        done
    }

    fn bucket(&self, b: u64) -> Bucket<'_, R> {
        let shared = &self.files[(b >> self.layout.file_shift) as usize];
        Bucket {
            file: lock(shared).file.clone(),
            held: &self.held,
            b,
        }
    }

    /// Bucket `b` is about to be read: begins to read those that come next, one for each sorter
    /// (two where buckets are taken unsorted), when there are so many bytes that they are not in memory anyway.
    fn announce(&self, b: u64) {
        if self.spilled < FAR {
            return;
        }
        let end = (b + 1 + self.sorters.load(Ordering::Relaxed).max(2)).min(self.count());
        let from = self.announced.fetch_max(end, Ordering::Relaxed);
        (from.max(b + 1)..end).for_each(|next| self.bucket(next).announce());
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

/// One bucket, unsorted.
pub(super) struct Bucket<'a, R> {
    file: Option<Arc<ScratchFile>>,
    held: &'a [Held<R>],
    b: u64,
}

impl<R: Record> Bucket<'_, R> {
    /// Number of records.
    pub(super) fn records(&self) -> u64 {
        let spilled: u64 = self.runs().map(|run| u64::from(run.records)).sum();
        let kept: u64 = self.kept().map(|part| part.len() as u64).sum();
        spilled + kept
    }

    /// Hands all records to `each` in pieces of at most `buffer.len()`; `consume` frees them on
    /// disk.
    pub(super) fn stream(
        &self,
        consume: bool,
        buffer: &mut [R],
        each: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        for run in self.runs() {
            let mut at = run.at;
            let mut left = run.records as usize;
            // A run may be half of the bucket, so it is freed piece by piece.
            let mut freed = run.at;
            while left > 0 {
                let n = left.min(buffer.len());
                self.read(&mut buffer[..n], at)?;
                at += (n * size_of::<R>()) as u64;
                left -= n;
                if let (true, Some(file)) = (consume, &self.file) {
                    freed += file.free_before(freed, at);
                }
                each(&buffer[..n])?;
            }
            if let (true, Some(file)) = (consume && freed < at, &self.file) {
                file.free(freed, at - freed);
            }
        }
        self.kept().try_for_each(each)
    }

    /// Fills `into`, which is as long as the bucket, and frees the bucket on disk.
    pub(super) fn load(&self, into: &mut [R]) -> Result<()> {
        let mut done = 0;
        for run in self.runs() {
            let n = run.records as usize;
            self.read(&mut into[done..done + n], run.at)?;
            self.free(&run);
            done += n;
        }
        for slice in self.kept() {
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

    /// Tells the system that the bucket will be read soon.
    fn announce(&self) {
        if let Some(file) = &self.file {
            let bytes = |run: &Run| u64::from(run.records) * size_of::<R>() as u64;
            self.runs().for_each(|run| file.expect(run.at, bytes(&run)));
        }
    }

    /// Frees a run that was read. Where that is not possible the whole file goes later.
    fn free(&self, run: &Run) {
        if let Some(file) = &self.file {
            file.free(run.at, u64::from(run.records) * size_of::<R>() as u64);
        }
    }

    fn runs(&self) -> impl Iterator<Item = Run> {
        let spilled = self.held.iter().filter_map(|held| match held {
            Held::Spilled { runs, .. } => Some(runs),
            Held::Kept { .. } => None,
        });
        spilled.flat_map(|runs| runs.of(self.b))
    }

    fn kept(&self) -> impl Iterator<Item = &[R]> {
        self.held.iter().filter_map(|held| match held {
            Held::Kept { records, .. } => Some(records.of(self.b)).filter(|part| !part.is_empty()),
            Held::Spilled { .. } => None,
        })
    }
}
