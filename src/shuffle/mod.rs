//! External radix partition and sort of fixed-width records. Knows no mesh word.
//!
//! ```text
//!   push ──> [buffer per bucket] ──full──> scratch file, a run of one bucket
//!   bucket fits the sorter      ──> loaded, sorted in memory ──> sink
//!   bucket does not fit         ──> split by more bits, or by the next level, parts in turn
//!   all keys of a part equal    ──> streamed as it is
//! ```
//!
//! Why the order is right: bucket b holds the keys of level 0 in one interval, and the
//! intervals ascend with b; a split cuts a part's interval into ascending intervals again, and
//! goes to the next level only when all records of the part agree in this one. So the parts
//! come out in key order, and within a part the sort does. Nothing else (plan, memory, number
//! of writers, order of arrival) can change the sequence of keys, and records with equal keys
//! are interchangeable.
//!
//! Memory: a writer leases [`Plan::writer_bytes`]; what it notes of what it wrote is part of that
//! as long as no more comes than was expected. A sorter leases what it was given and holds never
//! more. I/O: each record is written once and read once, a record of an oversized bucket once
//! more for each split; written by whole buffers, read by whole runs of them, and its space on
//! disk is free again as soon as it was read. A writer that filled no buffer and holds little
//! keeps its records in memory and writes nothing.

mod buckets;
mod held;
mod keep;
mod layout;
mod plan;
mod pool;
mod radix;
mod relay;
mod runs;
mod sorter;
mod split;
#[cfg(test)]
mod tests;
mod writer;

pub use buckets::Buckets;
pub use plan::{Plan, tail};
pub use relay::Relay;
pub use sorter::Sorter;
pub use writer::{Shuffle, Writer};

use std::cmp::Ordering;

/// A fixed-width record ordered by its keys, level 0 first.
///
/// Records that are equal in all levels are interchangeable: which comes first is not defined.
///
/// ```
/// use cornermill::shuffle::Record;
/// #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
/// #[repr(C)]
/// struct Use { vertex: u32, corner: u32 }
/// impl Record for Use {
///     const LEVELS: usize = 2;
///     fn key(&self, level: usize) -> u64 {
///         u64::from(if level == 0 { self.vertex } else { self.corner })
///     }
/// }
/// ```
pub trait Record: bytemuck::Pod + Send + Sync {
    /// Number of keys, at least one.
    const LEVELS: usize;

    /// The key of `level`, which is below [`LEVELS`](Record::LEVELS).
    fn key(&self, level: usize) -> u64;
}

/// Compares by the keys from level `from` on.
#[inline]
fn compare<R: Record>(a: &R, b: &R, from: usize) -> Ordering {
    for level in from..R::LEVELS {
        match a.key(level).cmp(&b.key(level)) {
            Ordering::Equal => {}
            other => return other,
        }
    }
    Ordering::Equal
}

/// The first level in which some records differ, and the least and greatest key there.
///
/// Fed record by record. A record that differs at a lower level than any before restarts the
/// bounds: all records before it have the first record's key there.
struct Spread<R> {
    first: Option<R>,
    from: usize,
    level: usize,
    min: u64,
    max: u64,
}

impl<R: Record> Spread<R> {
    /// Looks at the keys from level `from` on.
    fn new(from: usize) -> Spread<R> {
        Spread {
            first: None,
            from,
            level: R::LEVELS,
            min: u64::MAX,
            max: 0,
        }
    }

    fn feed(&mut self, records: &[R]) {
        let Some(first) = self.first.or(records.first().copied()) else {
            return;
        };
        self.first = Some(first);
        for r in records {
            for level in self.from..self.level {
                let key = first.key(level);
                if r.key(level) != key {
                    (self.level, self.min, self.max) = (level, key, key);
                    break;
                }
            }
            if self.level < R::LEVELS {
                let key = r.key(self.level);
                self.min = self.min.min(key);
                self.max = self.max.max(key);
            }
        }
    }
}
