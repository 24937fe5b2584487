//! Names of local components, and their numbers.
//!
//! Why it works: a local component is named by its first triangle, whichever cell it lies in. One
//! bit a triangle marks the names; a name's number is the count of marks before it. So numbers
//! ascend with first triangles, as those of local components in file order do, and whoever joins
//! them need not know where they came from.
//!
//! Memory: 3T/16 bytes. I/O: none.

use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Lease};
use crate::error::Result;
use std::sync::atomic::{AtomicU64, Ordering};

/// Words whose counts share one base, so that a count within fits 32 bits.
const WORDS: usize = 1 << 24;

/// Marks that are still being made, by any thread.
pub struct Marks {
    words: Vec<AtomicU64>,
    lease: Lease,
}

/// The names of a mesh's local components.
pub struct Names {
    words: Vec<u64>,
    /// Marks before each word, from the base of its [`WORDS`].
    before: Vec<u32>,
    base: Vec<u64>,
    count: u64,
    _lease: Lease,
}

impl Marks {
    /// Bytes for so many triangles.
    pub fn bytes(triangles: u64) -> u64 {
        triangles.div_ceil(64) * 12 + 64
    }

    /// No marks yet on `triangles` triangles.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, triangles: u64) -> Result<Marks> {
        Ok(Marks {
            lease: budget.lease("names of local components", Marks::bytes(triangles))?,
            words: (0..triangles.div_ceil(64))
                .map(|_| AtomicU64::new(0))
                .collect(),
        })
    }

    /// Makes triangle t a name.
    #[inline]
    pub fn mark(&self, t: u64) {
        self.words[(t / 64) as usize].fetch_or(1 << (t % 64), Ordering::Relaxed);
    }

    /// Counts the marks.
    pub fn seal(self) -> Names {
        let words = self.words.into_iter().map(AtomicU64::into_inner).collect();
        Names::of(words, self.lease)
    }
}

impl Names {
    /// Counts the marks.
    fn of(words: Vec<u64>, lease: Lease) -> Names {
        let mut before = Vec::with_capacity(words.len());
        let mut base = Vec::new();
        let mut count = 0;
        for block in words.chunks(WORDS) {
            base.push(count);
            let mut within = 0;
            for word in block {
                before.push(within);
                within += word.count_ones();
            }
            count += u64::from(within);
        }
        Names {
            words,
            before,
            base,
            count,
            _lease: lease,
        }
    }
}

impl Names {
    /// The number of the local component with this name.
    #[inline]
    pub fn number(&self, name: u64) -> u64 {
        let at = (name / 64) as usize;
        let below = self.words[at] & ((1 << (name % 64)) - 1);
        self.base[at / WORDS] + u64::from(self.before[at]) + u64::from(below.count_ones())
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.count
    }
}

impl Keep for Marks {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(self.lease.bytes())?;
        to.words(&self.words)
    }

    fn restore(from: &mut Reader) -> Result<Marks> {
        let bytes = from.number()?;
        Ok(Marks {
            lease: from.budget.lease("names of local components", bytes)?,
            words: from.words()?,
        })
    }
}

impl Keep for Names {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(self._lease.bytes())?;
        to.list(&self.words)
    }

    fn restore(from: &mut Reader) -> Result<Names> {
        let bytes = from.number()?;
        let lease = from.budget.lease("names of local components", bytes)?;
        Ok(Names::of(from.list()?, lease))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_ascend_with_names() {
        let budget = Budget::new(1 << 20);
        let marks = Marks::new(&budget, 1000).unwrap();
        let marked: Vec<u64> = (0..1000).filter(|t| t % 7 == 3 || *t == 999).collect();
        marked.iter().for_each(|&t| marks.mark(t));
        marks.mark(3);
        let names = marks.seal();
        assert_eq!(names.count(), marked.len() as u64);
        let numbers: Vec<u64> = marked.iter().map(|&t| names.number(t)).collect();
        assert!(numbers.iter().copied().eq(0..names.count()));
        drop(names);
        assert_eq!(budget.used(), 0);
    }
}
