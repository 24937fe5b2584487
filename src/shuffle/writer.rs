//! The writing side: records go to a buffer per bucket, full buffers go to scratch files.
//!
//! Why writers need no lock: each has buffers of its own and fills runs of its own, and the
//! sort on the other side does not care in which order records arrived.
//!
//! Memory: a writer leases its buffers and its [`runs`](super::runs) when it is made, and gives
//! the buffers back when it is finished, but for up to 256 KiB when it keeps its records in
//! memory. Pages are touched only when a bucket gets its first record, and reused ever after.
//! I/O: one write for each full buffer.

use super::buckets::Buckets;
use super::held::{Held, Kept, Resident};
use super::keep::Parts;
use super::layout::Layout;
use super::plan::SLOT_BYTES;
use super::runs::{RUN_BYTES, Runs};
use super::{Plan, Record};
use crate::disk::journal::{Pen, Reader};
use crate::disk::{Budget, Lease, Scratch, ScratchFile, Workspace};
use crate::error::{Error, Result};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A writer that filled no buffer keeps up to this many bytes in memory.
const KEEP: u64 = 256 << 10;

/// What finished writers handed in.
struct Done<R> {
    held: Vec<Held<R>>,
    records: u64,
    spilled: u64,
}

/// A shuffle that takes records; shared by its writers, one for each thread.
///
/// ```
/// # use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
/// # use cornermill::shuffle::{Plan, Record, Shuffle};
/// # use std::sync::Arc;
/// #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
/// #[repr(transparent)]
/// struct Number(u64);
/// impl Record for Number {
///     const LEVELS: usize = 1;
///     fn key(&self, _level: usize) -> u64 {
///         self.0
///     }
/// }
///
/// # let dir = std::env::temp_dir();
/// # let io = Arc::new(Counters::default());
/// # let ws = Workspace {
/// #     budget: Budget::new(1 << 20),
/// #     scratch: Scratch::new(&[dir], u64::MAX, &io)?,
/// #     io,
/// #     workers: Workers::new(1)?,
/// #     progress: Arc::new(NoProgress),
/// # };
/// let plan = Plan::within(256 << 10, 1, size_of::<Number>(), 1000, 64 << 10);
/// let shuffle = Shuffle::new(&ws, "numbers", 0..7919, plan)?;
/// let mut writer = shuffle.writer()?;
/// for i in 0..1000 {
///     writer.push(Number(i * i % 7919))?;
/// }
/// writer.finish()?;
///
/// let buckets = shuffle.finish()?;
/// let mut sorter = buckets.sorter(64 << 10)?;
/// let mut sorted = Vec::new();
/// buckets.sorted_all(&mut sorter, &mut |numbers| {
///     sorted.extend(numbers.iter().map(|n| n.0));
///     Ok(())
/// })?;
/// assert!(sorted.len() == 1000 && sorted.is_sorted());
/// # Ok::<(), cornermill::Error>(())
/// ```
pub struct Shuffle<R> {
    what: &'static str,
    layout: Layout,
    /// Records that a buffer holds.
    per_buffer: u32,
    /// Runs that a writer expects at most.
    runs: u64,
    files: Vec<Mutex<Option<Arc<ScratchFile>>>>,
    open: AtomicU64,
    done: Mutex<Done<R>>,
    budget: Budget,
    scratch: Scratch,
}

impl<R: Record> Shuffle<R> {
    /// A shuffle named `what` for records whose level-0 keys lie in `keys`.
    ///
    /// # Errors
    /// [`Error::Internal`] when one writer's buffers would hold 2^32 records or more.
    pub fn new(
        ws: &Workspace,
        what: &'static str,
        keys: Range<u64>,
        plan: Plan,
    ) -> Result<Shuffle<R>> {
        const { assert!(R::LEVELS > 0 && size_of::<R>() > 0) };
        let layout = Layout::new(keys, plan.buckets.clamp(1, 1 << 30) as u64);
        let per_buffer = (plan.buffer_bytes / size_of::<R>()).max(1) as u64;
        if layout.buckets.saturating_mul(per_buffer) > u64::from(u32::MAX) {
            return Err(Error::Internal(format!(
                "{what}: a plan of {} buckets with {per_buffer} records each is beyond 2^32",
                layout.buckets
            )));
        }
        Ok(Shuffle {
            what,
            per_buffer: per_buffer as u32,
            files: (0..layout.files()).map(|_| Mutex::default()).collect(),
            runs: plan.runs(layout.buckets),
            layout,
            open: AtomicU64::new(0),
            done: Mutex::new(Done {
                held: Vec::new(),
                records: 0,
                spilled: 0,
            }),
            budget: ws.budget.clone(),
            scratch: ws.scratch.clone(),
        })
    }

    /// A writer with buffers of its own, leased from the budget. It goes on with what one that was
    /// finished handed in, if any: however often a pass stops, it holds no more than its writers.
    ///
    /// # Errors
    /// [`Error::Budget`]; what a write of a full buffer may say.
    pub fn writer(&self) -> Result<Writer<'_, R>> {
        let buckets = self.layout.buckets;
        let room = buckets * u64::from(self.per_buffer);
        // What was leased for it goes back before as much and more is leased again.
        let (runs, kept) = match lock(&self.done).held.pop() {
            Some(Held::Spilled { mut runs, .. }) => {
                runs.reopen(self.runs as usize);
                (runs, None)
            }
            Some(Held::Kept { records, .. }) => (self.no_runs(), Some(records)),
            None => (self.no_runs(), None),
        };
        let notes = buckets * SLOT_BYTES + runs.expected() * RUN_BYTES;
        let bytes = room * size_of::<R>() as u64 + notes;
        let lease = self.budget.lease(self.what, bytes)?;
        self.open.fetch_add(1, Ordering::Relaxed);
        let mut writer = Writer {
            arena: Vec::with_capacity(room as usize),
            slots: vec![Slot { next: 0, end: 0 }; buckets as usize],
            start: self.layout.keys.start,
            width: self.layout.keys.end.saturating_sub(self.layout.keys.start),
            shift: self.layout.shift,
            runs,
            records: 0,
            spilled: 0,
            shuffle: self,
            lease,
        };
        if let Some(kept) = kept {
            lock(&self.done).records -= kept.count();
            for (bucket, records) in kept.all() {
                let mut records = records.iter();
                records.try_for_each(|record| writer.put(bucket, *record))?;
            }
        }
        Ok(writer)
    }

    /// Bytes that a writer leases when it is made, as [`Plan::writer_bytes`] says.
    pub fn writer_bytes(&self) -> u64 {
        let buffer = u64::from(self.per_buffer) * size_of::<R>() as u64;
        self.layout.buckets * (buffer + SLOT_BYTES) + self.runs * RUN_BYTES
    }

    fn no_runs(&self) -> Runs {
        Runs::new(self.layout.buckets as usize, self.runs as usize)
    }

    /// Records of the writers that have finished.
    pub fn records(&self) -> u64 {
        lock(&self.done).records
    }

    /// Ends the writing.
    ///
    /// # Errors
    /// [`Error::Internal`] when a writer was dropped unfinished, [`Error::Budget`] when a byte
    /// for each bucket does not fit.
    pub fn finish(self) -> Result<Buckets<R>> {
        let open = self.open.into_inner();
        if open > 0 {
            return Err(Error::Internal(format!(
                "{}: {open} writer(s) of the shuffle were dropped unfinished",
                self.what
            )));
        }
        let done = self
            .done
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        let files = self.files.into_iter();
        Buckets::new(
            self.layout,
            files
                .map(|f| f.into_inner().unwrap_or_else(PoisonError::into_inner))
                .collect(),
            done.held,
            (done.records, done.spilled),
            (self.budget, self.scratch),
        )
    }

    /// Writes it down, as long as no writer is at work.
    pub(super) fn write_down(&self, to: &mut Pen) -> Result<()> {
        let open = self.open.load(Ordering::Relaxed);
        if open > 0 {
            let what = format!("{}: kept while {open} writer(s) are at work", self.what);
            return Err(Error::Internal(what));
        }
        to.number(u64::from(self.per_buffer))?;
        to.number(self.runs)?;
        let files: Vec<_> = self.files.iter().map(|file| lock(file).clone()).collect();
        let done = lock(&self.done);
        let counts = (done.records, done.spilled);
        super::keep::keep(to, &self.layout, &files, &done.held, counts)
    }

    /// What was written down.
    pub(super) fn of(parts: Parts<R>, per_buffer: u32, runs: u64, from: &Reader) -> Shuffle<R> {
        Shuffle {
            what: "a shuffle that is gone on with",
            layout: parts.layout,
            per_buffer,
            runs,
            files: parts.files.into_iter().map(Mutex::new).collect(),
            open: AtomicU64::new(0),
            done: Mutex::new(Done {
                held: parts.held,
                records: parts.counts.0,
                spilled: parts.counts.1,
            }),
            budget: from.budget.clone(),
            scratch: from.scratch.clone(),
        }
    }

    fn file_of(&self, bucket: usize) -> Result<Arc<ScratchFile>> {
        let mut slot = lock(&self.files[bucket >> self.layout.file_shift]);
        if let Some(file) = &*slot {
            return Ok(Arc::clone(file));
        }
        let file = Arc::new(self.scratch.file(self.what)?);
        *slot = Some(Arc::clone(&file));
        Ok(file)
    }
}

/// Data behind a lock is whole between calls, so a panic elsewhere does not spoil it.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where the next record of a bucket goes in the arena; `next == end` says no room.
#[derive(Clone, Copy)]
struct Slot {
    next: u32,
    end: u32,
}

/// Takes the records of one thread; [`finish`](Writer::finish) hands them in.
pub struct Writer<'a, R> {
    /// The buffers, one after another in order of first use.
    arena: Vec<R>,
    slots: Vec<Slot>,
    start: u64,
    width: u64,
    shift: u32,
    runs: Runs,
    records: u64,
    spilled: u64,
    shuffle: &'a Shuffle<R>,
    lease: Lease,
}

impl<R: Record> Writer<'_, R> {
    /// Takes a record.
    ///
    /// # Errors
    /// [`Error::Internal`] when its key of level 0 is out of range; what a write of a full
    /// buffer may say.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<()> {
        self.push_at(record.key(0), record)
    }

    /// Takes a record as if its key of level 0 were `key`, for readers that take whole buckets:
    /// [`Buckets::unsorted`] and [`Buckets::streamed`].
    ///
    /// # Errors
    /// As [`push`](Writer::push).
    #[inline]
    pub fn push_at(&mut self, key: u64, record: R) -> Result<()> {
        let offset = key.wrapping_sub(self.start);
        if offset >= self.width {
            return Err(self.out_of_range(key));
        }
        self.put((offset >> self.shift) as usize, record)
    }

    #[inline]
    fn put(&mut self, bucket: usize, record: R) -> Result<()> {
        if self.slots[bucket].next == self.slots[bucket].end {
            self.make_room(bucket)?;
        }
        let slot = &mut self.slots[bucket];
        self.arena[slot.next as usize] = record;
        slot.next += 1;
        Ok(())
    }

    #[cold]
    fn out_of_range(&self, key: u64) -> Error {
        let keys = &self.shuffle.layout.keys;
        Error::Internal(format!(
            "{}: key {key} is outside of {}..{}",
            self.shuffle.what, keys.start, keys.end
        ))
    }

    /// Gives a bucket its buffer, or empties the full one.
    #[cold]
    fn make_room(&mut self, bucket: usize) -> Result<()> {
        let per = self.shuffle.per_buffer;
        if self.slots[bucket].end > 0 {
            return self.flush(bucket);
        }
        let next = self.arena.len() as u32;
        // The arena's capacity holds a buffer for each bucket, so this never moves it.
        self.arena
            .resize(self.arena.len() + per as usize, R::zeroed());
        self.slots[bucket] = Slot {
            next,
            end: next + per,
        };
        Ok(())
    }

    /// Writes what the bucket's buffer holds to the bucket's run.
    fn flush(&mut self, bucket: usize) -> Result<()> {
        let (start, len) = self.held(bucket);
        if len == 0 {
            return Ok(());
        }
        let (size, per) = (size_of::<R>(), self.shuffle.per_buffer);
        let file = self.shuffle.file_of(bucket)?;
        if let Some(room) = self.runs.wants(bucket, len, per, size) {
            let at = file.reserve(u64::from(room) * size as u64);
            self.runs.begin(bucket, (at, room), &self.shuffle.budget)?;
        }
        let (at, before) = self.runs.add(bucket, len);
        let bytes: &[u8] = bytemuck::cast_slice(&self.arena[start..start + len as usize]);
        file.fill(bytes, at + u64::from(before) * size as u64)?;
        self.spilled += bytes.len() as u64;
        self.records += u64::from(len);
        self.slots[bucket].next = start as u32;
        Ok(())
    }

    /// Index and number of the records in the bucket's buffer.
    fn held(&self, bucket: usize) -> (usize, u32) {
        let Slot { next, end } = self.slots[bucket];
        let start = end.saturating_sub(self.shuffle.per_buffer);
        (start as usize, next - start)
    }

    /// Hands in what is left; the writer's buffers go back to the budget.
    ///
    /// # Errors
    /// As [`push`](Writer::push).
    pub fn finish(mut self) -> Result<()> {
        let buckets = 0..self.slots.len();
        let (count, left) = buckets
            .clone()
            .map(|b| self.held(b).1)
            .fold((0, 0), |(count, sum), len| {
                (count + u64::from(len > 0), sum + u64::from(len))
            });
        let weight = left * size_of::<R>() as u64 + count * size_of::<Kept>() as u64;
        let wrote = !self.runs.is_empty();
        let held = if wrote || weight > self.lease.bytes().min(KEEP) {
            buckets.clone().try_for_each(|bucket| self.flush(bucket))?;
            drop((
                std::mem::take(&mut self.arena),
                std::mem::take(&mut self.slots),
            ));
            self.lease.shrink(self.runs.seal());
            Some(Held::Spilled {
                runs: self.runs,
                _lease: self.lease,
            })
        } else if left > 0 {
            self.records = left;
            let (records, kept) = self.compact(count as usize);
            drop((std::mem::take(&mut self.slots), self.runs));
            self.lease.shrink(weight);
            Some(Held::Kept {
                records: Resident::new(records, kept),
                _lease: self.lease,
            })
        } else {
            None
        };
        let mut done = lock(&self.shuffle.done);
        done.records += self.records;
        done.spilled += self.spilled;
        done.held.extend(held);
        drop(done);
        self.shuffle.open.fetch_sub(1, Ordering::Relaxed);
        Ok(())
    }

    /// Moves the held records to the front of the arena and gives the rest of it back.
    fn compact(&mut self, count: usize) -> (Vec<R>, Vec<Kept>) {
        let mut kept = Vec::with_capacity(count);
        for bucket in 0..self.slots.len() {
            let (start, records) = self.held(bucket);
            if records > 0 {
                kept.push(Kept {
                    bucket: bucket as u32,
                    records,
                    at: start,
                });
            }
        }
        kept.sort_unstable_by_key(|k| k.at);
        let mut records = std::mem::take(&mut self.arena);
        let mut len = 0;
        for part in &mut kept {
            let from = part.at;
            records.copy_within(from..from + part.records as usize, len);
            part.at = len;
            len += part.records as usize;
        }
        records.truncate(len);
        records.shrink_to_fit();
        kept.sort_unstable_by_key(|k| k.bucket);
        (records, kept)
    }
}
