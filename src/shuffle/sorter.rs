//! The memory in which one thread sorts buckets, and the choice of how.
//!
//! 1. Twice the bucket fits: loaded and sorted through the other half (fastest).
//! 2. The bucket fits: loaded and sorted in place.
//! 3. It does not: see [`split`](super::split).
//!
//! Memory: what was leased, divided once between records, counters and stacks; the pages of
//! the record space are touched as buckets need them, and reused.

use super::buckets::Bucket;
use super::pool::{PAGE, footer};
use super::radix::{self, Tables};
use super::split::{self, Part};
use super::{Record, compare};
use crate::disk::{Budget, Lease, Scratch};
use crate::error::{Error, Result};

/// What a small sorter needs for usual records; larger ones need more, see `least`.
const LEAST: u64 = 64 << 10;
/// Blocks of a split are this large when there is memory.
const BLOCK: u64 = 64 << 10;

/// Sorts the buckets of one thread within the memory that it leased.
pub struct Sorter<R> {
    /// Grows up to `room` records, as buckets need it.
    pub(super) space: Vec<R>,
    pub(super) room: usize,
    pub(super) tables: Tables,
    pub(super) parts: Vec<Part>,
    /// Records of a block of a split, footer included.
    pub(super) block: usize,
    pub(super) splits: u64,
    pub(super) scratch: Scratch,
    _lease: Lease,
}

impl<R: Record> Sorter<R> {
    /// The least memory in bytes that a sorter works with: 64 KiB for records of up to 256
    /// bytes and four levels.
    pub fn least() -> u64 {
        let parts = split::least_parts::<R>() * size_of::<Part>();
        LEAST.max(256 * size_of::<R>() as u64).max(4 * parts as u64)
    }

    pub(super) fn new(budget: &Budget, scratch: &Scratch, memory: u64) -> Result<Sorter<R>> {
        if memory < Self::least() {
            let short = Self::least() - memory;
            return Err(Error::Budget {
                what: "a sorter of the shuffle".into(),
                need: budget.limit().saturating_add(short),
                have: budget.limit(),
            });
        }
        let lease = budget.lease("a sorter of the shuffle", memory)?;
        let size = size_of::<R>() as u64;
        // Whole pages, where there are some, so that each can be freed.
        let bytes = (memory / 32).min(BLOCK);
        let pages = if bytes < PAGE {
            bytes
        } else {
            bytes / PAGE * PAGE
        };
        let block = pages / size;
        let block = block.max(footer::<R>() as u64 + 1);
        let parts = split::least_parts::<R>() as u64 + 4 * (memory / 2 / (block * size)).min(128);
        let fixed = parts * size_of::<Part>() as u64;
        // Tables for as many records as there would be without them: a little more than needed.
        let most = (memory / size).min(u64::from(u32::MAX));
        let room = (memory - fixed - Tables::bytes(most, memory)) / size;
        Ok(Sorter {
            space: Vec::with_capacity(room as usize),
            room: room as usize,
            tables: Tables::new(most as usize, memory),
            parts: Vec::with_capacity(parts as usize),
            block: block as usize,
            splits: 0,
            scratch: scratch.clone(),
            _lease: lease,
        })
    }

    /// How many times a bucket, or a part of one, was split on disk since it did not fit.
    pub fn splits(&self) -> u64 {
        self.splits
    }

    /// The most records that are sorted in memory at once.
    pub fn capacity(&self) -> u64 {
        (self.room - footer::<R>()) as u64
    }

    pub(super) fn sort(
        &mut self,
        bucket: &Bucket<'_, R>,
        sink: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        let records = bucket.records();
        if records > self.capacity() {
            return split::sort(self, bucket, records, sink);
        }
        if records == 0 {
            return Ok(());
        }
        let n = records as usize;
        self.grow(n);
        bucket.load(&mut self.space[..n])?;
        self.sort_loaded(n, 0, sink)
    }

    /// Sorts the first `n` records of the space by the levels from `from` on.
    pub(super) fn sort_loaded(
        &mut self,
        n: usize,
        from: usize,
        sink: &mut dyn FnMut(&[R]) -> Result<()>,
    ) -> Result<()> {
        let spare = if 2 * n <= self.room { n } else { 0 };
        self.grow(n + spare);
        let (data, rest) = self.space.split_at_mut(n);
        let sorted = radix::sort(data, &mut rest[..spare], from, &mut self.tables);
        debug_assert!(sorted.is_sorted_by(|a, b| compare(a, b, from).is_le()));
        sink(sorted)
    }

    /// Makes the first `n` records of the space usable, within its capacity.
    pub(super) fn grow(&mut self, n: usize) {
        debug_assert!(n <= self.room && self.room <= self.space.capacity());
        if self.space.len() < n {
            self.space.resize(n, R::zeroed());
        }
    }
}
