//! Where records lie: which bucket a key belongs to, which file a bucket, which extents hold
//! its records.
//!
//! Memory: 16 bytes for each extent, leased in steps before a list grows. I/O: none.

use crate::disk::{Budget, Lease};
use crate::error::Result;
use std::ops::Range;

/// Buckets share this many scratch files at most; a file is freed when its buckets were read.
pub(super) const FILES: u64 = 16;
/// Extents of the first and of the largest step of a list.
const STEPS: (usize, usize) = (64, 4096);
/// Memory of an extent.
pub(super) const EXTENT_BYTES: u64 = size_of::<Extent>() as u64;

/// Consecutive records of one bucket, in its scratch file or in kept memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Extent {
    pub bucket: u32,
    pub records: u32,
    /// Byte in the file, or index in kept records.
    pub at: u64,
}

/// A list of extents that leases memory in steps before it grows.
#[derive(Default)]
pub(super) struct Extents {
    steps: Vec<(Vec<Extent>, Lease)>,
}

impl Extents {
    pub(super) fn push(&mut self, extent: Extent, budget: &Budget) -> Result<()> {
        if let Some((list, _)) = self.steps.last_mut()
            && list.len() < list.capacity()
        {
            list.push(extent);
            return Ok(());
        }
        let n = (STEPS.0 << self.steps.len().min(16)).min(STEPS.1);
        let lease = budget.lease("the extents of a shuffle", n as u64 * EXTENT_BYTES)?;
        let mut list = Vec::with_capacity(n);
        list.push(extent);
        self.steps.push((list, lease));
        Ok(())
    }

    pub(super) fn len(&self) -> usize {
        self.steps.iter().map(|(list, _)| list.len()).sum()
    }

    pub(super) fn into_lists(self) -> impl Iterator<Item = (Vec<Extent>, Lease)> {
        self.steps.into_iter()
    }
}

/// How level-0 keys map to buckets: `(key - start) >> shift`.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub keys: Range<u64>,
    pub shift: u32,
    pub buckets: u64,
    /// Bucket b lies in file `b >> file_shift`.
    pub file_shift: u32,
}

impl Layout {
    pub(super) fn new(keys: Range<u64>, most: u64) -> Layout {
        let last = keys.end.saturating_sub(keys.start).checked_sub(1);
        let mut shift = 0;
        while shift < 63 && last.is_some_and(|last| last >> shift >= most) {
            shift += 1;
        }
        let buckets = last.map_or(0, |last| (last >> shift) + 1);
        let mut file_shift = 0;
        while buckets >> file_shift > FILES {
            file_shift += 1;
        }
        Layout {
            keys,
            shift,
            buckets,
            file_shift,
        }
    }

    pub(super) fn files(&self) -> u64 {
        self.buckets.div_ceil(1 << self.file_shift)
    }
}
