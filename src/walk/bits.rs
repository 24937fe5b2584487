//! A bit for each id of a kind: which were seen.
//!
//! Memory: [`Bits::bytes`], leased before it is allocated. Zeroed pages that are never touched
//! take no memory, so a short walk over a large mesh stays small. I/O: none.

use crate::disk::{Budget, Lease};
use crate::error::Result;

#[derive(Debug)]
pub(super) struct Bits {
    words: Vec<u64>,
    _lease: Lease,
}

impl Bits {
    /// Memory for ids below `count`.
    pub(super) fn bytes(count: u64) -> u64 {
        8 * count.div_ceil(64)
    }

    /// No id below `count` was seen yet.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub(super) fn new(budget: &Budget, what: &str, count: u64) -> Result<Bits> {
        let lease = budget.lease(what, Bits::bytes(count))?;
        Ok(Bits {
            words: vec![0; count.div_ceil(64) as usize],
            _lease: lease,
        })
    }

    pub(super) fn has(&self, id: u64) -> bool {
        self.words[(id / 64) as usize] >> (id % 64) & 1 == 1
    }

    /// False when it was in already.
    pub(super) fn insert(&mut self, id: u64) -> bool {
        let (word, bit) = (&mut self.words[(id / 64) as usize], 1 << (id % 64));
        let fresh = *word & bit == 0;
        *word |= bit;
        fresh
    }
}
