//! Collects records and appends them to a scratch file, a block at a time. The order in the file
//! is that of arrival, so what is read from it must not depend on order.
//!
//! Memory: [`BLOCK`] bytes, which the caller leases. I/O: one write for each block.

use crate::disk::{Budget, Lease, ScratchFile};
use crate::error::Result;
use bytemuck::Pod;

/// Bytes of an appender's block.
pub const BLOCK: usize = 64 << 10;

/// One thread's way to a scratch file.
pub struct Appender<'a, T> {
    file: &'a ScratchFile,
    block: Vec<T>,
}

impl<'a, T: Pod> Appender<'a, T> {
    /// An empty block before `file`.
    pub fn new(file: &'a ScratchFile) -> Self {
        let block = Vec::with_capacity(BLOCK / size_of::<T>());
        Appender { file, block }
    }

    /// Takes a record.
    ///
    /// # Errors
    /// Those of the file, when the block is full.
    #[inline]
    pub fn push(&mut self, item: T) -> Result<()> {
        self.block.push(item);
        if self.block.len() == self.block.capacity() {
            self.flush()?;
        }
        Ok(())
    }

    /// Appends what is left.
    ///
    /// # Errors
    /// Those of the file.
    pub fn flush(&mut self) -> Result<()> {
        self.file.append(bytemuck::cast_slice(&self.block))?;
        self.block.clear();
        Ok(())
    }
}

/// Takes the records of a file up one after another.
pub struct Records<T> {
    block: Vec<T>,
    next: usize,
    at: u64,
    _lease: Lease,
}

impl<T: Pod> Records<T> {
    /// Before the first record; leases a block.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget) -> Result<Records<T>> {
        Ok(Records {
            block: Vec::new(),
            next: 0,
            at: 0,
            _lease: budget.lease("a block of records", BLOCK as u64)?,
        })
    }

    /// The next record of `file`, which stays the next until it is [taken](Records::take).
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    #[inline]
    pub fn peek(&mut self, file: &ScratchFile) -> Result<Option<T>> {
        if self.next == self.block.len() {
            let item = size_of::<T>() as u64;
            let some = (file.len() - self.at).min(BLOCK as u64) / item;
            self.block.resize(some as usize, T::zeroed());
            file.read_at(bytemuck::cast_slice_mut(&mut self.block), self.at)?;
            self.at += some * item;
            self.next = 0;
        }
        Ok(self.block.get(self.next).copied())
    }

    /// Goes on to the record behind.
    #[inline]
    pub fn take(&mut self) {
        self.next += 1;
    }
}
