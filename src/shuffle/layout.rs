//! Where keys belong: which bucket a key lies in, and which file a bucket.
//!
//! Memory: a few words. I/O: none.

use crate::disk::journal::{Pen, Reader};
use crate::error::{Error, Result};
use std::ops::Range;

/// Buckets share this many scratch files at most, so that writers seldom meet in one.
const FILES: u64 = 16;

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

    /// Writes it down.
    pub(super) fn keep(&self, to: &mut Pen) -> Result<()> {
        let shifts = [u64::from(self.shift), u64::from(self.file_shift)];
        to.list(&[
            self.keys.start,
            self.keys.end,
            self.buckets,
            shifts[0],
            shifts[1],
        ])
    }

    /// Reads it back.
    pub(super) fn restore(from: &mut Reader) -> Result<Layout> {
        let numbers = from.list::<u64>()?;
        let [start, end, buckets, shift, file_shift] = numbers[..] else {
            return Err(Error::Internal("a layout of other numbers".into()));
        };
        Ok(Layout {
            keys: start..end,
            buckets,
            shift: shift as u32,
            file_shift: file_shift as u32,
        })
    }
}
