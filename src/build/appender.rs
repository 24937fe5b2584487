//! Collects records and appends them to a scratch file, a block at a time. The order in the file
//! is that of arrival, so what is read from it must not depend on order.
//!
//! Memory: [`BLOCK`] bytes, which the caller leases. I/O: one write for each block.

use crate::disk::ScratchFile;
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
