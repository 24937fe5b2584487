//! Bits by number, in memory, leased.

use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Lease};
use crate::error::Result;

/// A set of bits, leased.
pub struct Bits {
    words: Vec<u64>,
    _lease: Lease,
}

impl Bits {
    /// `count` bits, all 0.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, what: &str, count: u64) -> Result<Bits> {
        let words = count.div_ceil(64);
        Ok(Bits {
            _lease: budget.lease(what, words * 8)?,
            words: vec![0; words as usize],
        })
    }

    /// Sets bit i.
    pub fn set(&mut self, i: u64) {
        self.words[(i / 64) as usize] |= 1 << (i % 64);
    }

    /// Bit i.
    #[inline]
    pub fn get(&self, i: u64) -> bool {
        self.words[(i / 64) as usize] >> (i % 64) & 1 == 1
    }

    /// True when any bit is 1.
    pub fn any(&self) -> bool {
        self.words.iter().any(|&w| w != 0)
    }
}

impl Keep for Bits {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(self._lease.bytes())?;
        to.list(&self.words)
    }

    fn restore(from: &mut Reader) -> Result<Bits> {
        let bytes = from.number()?;
        Ok(Bits {
            _lease: from.budget.lease("bits", bytes)?,
            words: from.list()?,
        })
    }
}
