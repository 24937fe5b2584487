//! Chains of blocks in one temporary file, for records that wait until memory has room.
//!
//! Each block ends with a footer that names the block before it in its chain, so a chain of any
//! length is known by one number. A block that was given back is a hole in the file again; where
//! blocks are no whole pages, or the file system knows no holes, it is written again. Either way
//! the file takes as much space as the most that waits at once.
//!
//! Memory: a few words. I/O: a block at a time, and eight bytes for a block that is to be written
//! again.

use super::Record;
use crate::disk::{Scratch, ScratchFile};
use crate::error::{Error, Result};

/// No block: the end of a chain.
pub(super) const NONE: u64 = u64::MAX;
/// Free blocks remembered in memory; the others are chained on disk.
const FREE: usize = 64;
/// What file systems allocate and free.
pub(super) const PAGE: u64 = 4 << 10;

/// Records that hold the footer of a block.
pub(super) const fn footer<R: Record>() -> usize {
    8usize.div_ceil(size_of::<R>())
}

/// A temporary file of equal blocks, each linked to another by a footer. A block is known by its
/// first byte.
pub(super) struct Pool {
    scratch: Scratch,
    what: &'static str,
    file: Option<ScratchFile>,
    block_bytes: u64,
    /// True when blocks are nearly whole pages, so that each can be a hole.
    holes: bool,
    /// End of the last block, where they are no holes.
    end: u64,
    free: Vec<u64>,
    /// Free blocks beyond those in `free`, linked by their first bytes.
    chain: u64,
}

impl Pool {
    /// A pool without blocks; its file is made with the first.
    pub(super) fn new(scratch: &Scratch, what: &'static str, block_bytes: u64) -> Pool {
        let lost = block_bytes.next_multiple_of(PAGE) - block_bytes;
        Pool {
            scratch: scratch.clone(),
            what,
            file: None,
            block_bytes,
            holes: 16 * lost <= block_bytes,
            end: 0,
            free: Vec::with_capacity(FREE),
            chain: NONE,
        }
    }

    fn file(&self) -> Result<&ScratchFile> {
        let gone = || Error::Internal(format!("{} has no file yet", self.what));
        self.file.as_ref().ok_or_else(gone)
    }

    /// Writes records and their footer, which is overwritten with `link`; returns the block.
    pub(super) fn write<R: Record>(&mut self, block: &mut [R], link: u64) -> Result<u64> {
        if self.file.is_none() {
            self.file = Some(self.scratch.file(self.what)?);
        }
        let foot = block.len() - footer::<R>();
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut block[foot..]);
        bytes[..8].copy_from_slice(&link.to_le_bytes());
        let bytes: &[u8] = bytemuck::cast_slice(block);
        let at = match self.again()? {
            Some(at) => at,
            None if self.holes => {
                let file = self.file()?;
                let at = file.reserve(self.block_bytes);
                file.fill(bytes, at)?;
                return Ok(at);
            }
            None => {
                self.end += self.block_bytes;
                self.end - self.block_bytes
            }
        };
        self.file()?.write_at(bytes, at)?;
        Ok(at)
    }

    /// Reads records and their footer; returns the link in it.
    pub(super) fn read<R: Record>(&self, block: &mut [R], at: u64) -> Result<u64> {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(block);
        self.file()?.read_at(bytes, at)?;
        let foot = bytes.len() - footer::<R>() * size_of::<R>();
        let mut link = [0; 8];
        link.copy_from_slice(&bytes[foot..foot + 8]);
        Ok(u64::from_le_bytes(link))
    }

    /// A block that is to be written again, if there is one.
    fn again(&mut self) -> Result<Option<u64>> {
        if let Some(at) = self.free.pop() {
            return Ok(Some(at));
        }
        if self.chain == NONE {
            return Ok(None);
        }
        let at = self.chain;
        let mut link = [0; 8];
        self.file()?.read_at(&mut link, at)?;
        self.chain = u64::from_le_bytes(link);
        Ok(Some(at))
    }

    /// Frees a block that was written with so many records, footer included.
    pub(super) fn give<R: Record>(&mut self, at: u64, records: usize) -> Result<()> {
        let bytes = (records * size_of::<R>()) as u64;
        if self.holes && self.file()?.free(at, bytes) {
            return Ok(());
        }
        if self.free.len() < FREE {
            self.free.push(at);
            return Ok(());
        }
        let link = self.chain.to_le_bytes();
        self.file()?.write_at(&link, at)?;
        self.chain = at;
        Ok(())
    }
}
