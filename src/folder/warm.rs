//! Checksums of blocks taken while their bytes are warm, so that a file larger than the page
//! cache is not read from the disk once more for them.
//!
//! Why a sum taken early is right: every block counts its writes, each *after* it was made. A
//! sum is kept with the count from before its block was read, and holds as long as the count is
//! the same. So a write that came later, or went on while the block was read, makes the sum
//! void, and the block is read again in the end; when a sum is taken decides the time, never
//! the result.
//!
//! Memory: 48 bytes for each 64 MiB; one read buffer while a sum is taken, when the budget has
//! room for it, else the block waits for the end. I/O: each block once, most likely from memory;
//! blocks that were written again once more.

use super::seal::{BLOCK, STEP, sum_range};
use crate::disk::{Budget, DataFile, Lease};
use crate::error::Result;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// A sum is taken early only when so many bytes of the budget are free: those who need memory
/// come first.
const ROOM: u64 = 16 * STEP as u64;

/// One block of a file.
#[derive(Debug, Default)]
struct Block {
    /// Bytes that were read or written; the block is whole when they are as many as it has.
    passed: AtomicU64,
    writes: AtomicU64,
    /// The sum, and the number of writes before it was taken.
    sum: Mutex<Option<(u64, u64)>>,
}

/// The sums of one file's blocks, taken as its bytes pass.
#[derive(Debug)]
pub struct WarmSums {
    blocks: Vec<Block>,
    bytes: u64,
    early: bool,
    budget: Budget,
    _lease: Lease,
}

/// Memory for the sums of so many files of so many bytes together, at most.
pub fn sum_bytes(bytes: u64, files: u64) -> u64 {
    (bytes.div_ceil(BLOCK) + files) * size_of::<Block>() as u64
}

impl WarmSums {
    /// For a file of `bytes`, whose length stays. `early` is false for a file that is known to
    /// be written again after it was written whole.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, bytes: u64, early: bool) -> Result<WarmSums> {
        let blocks = bytes.div_ceil(BLOCK);
        let lease = budget.lease("block sums", sum_bytes(bytes, 0))?;
        Ok(WarmSums {
            blocks: (0..blocks).map(|_| Block::default()).collect(),
            bytes,
            early,
            budget: budget.clone(),
            _lease: lease,
        })
    }

    /// Length of the file.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes of the file that lie in its block `b`.
    pub(super) fn range(&self, b: u64) -> Range<u64> {
        b * BLOCK..self.bytes.min((b + 1) * BLOCK)
    }

    /// So many bytes from byte `at` were read just now, for the first time.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn seen(&self, file: &DataFile, at: u64, bytes: u64) -> Result<()> {
        self.pass(file, at..at + bytes, false)
    }

    /// So many bytes from byte `at` were written just now.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn wrote(&self, file: &DataFile, at: u64, bytes: u64) -> Result<()> {
        self.pass(file, at..at + bytes, true)
    }

    fn pass(&self, file: &DataFile, range: Range<u64>, write: bool) -> Result<()> {
        if range.is_empty() {
            return Ok(());
        }
        let last = range.end.min(self.bytes).div_ceil(BLOCK);
        for b in range.start / BLOCK..last {
            let (block, whole) = (&self.blocks[b as usize], self.range(b));
            if write {
                block.writes.fetch_add(1, Ordering::AcqRel);
            }
            let n = range.end.min(whole.end) - range.start.max(whole.start);
            let size = whole.end - whole.start;
            let before = block.passed.fetch_add(n, Ordering::AcqRel);
            if before < size && before + n >= size {
                if self.early {
                    self.take(file, b)?;
                }
                if write {
                    self.settle(file, b);
                }
            }
        }
        Ok(())
    }

    /// Block `b` was just completed: starts its way to the device. That of the block before is
    /// mostly done, so it may leave memory, unless the file is to be read again.
    fn settle(&self, file: &DataFile, b: u64) {
        file.settle(self.range(b), self.bytes);
        if let (true, Some(before)) = (self.early, b.checked_sub(2)) {
            file.release(self.range(before), self.bytes);
        }
    }

    /// Takes the sum of a block, if there is memory for it.
    fn take(&self, file: &DataFile, b: u64) -> Result<()> {
        if self.budget.free() < ROOM {
            return Ok(());
        }
        let Ok(_lease) = self.budget.lease("a checksum buffer", STEP as u64) else {
            return Ok(());
        };
        let block = &self.blocks[b as usize];
        let writes = block.writes.load(Ordering::Acquire);
        let sum = sum_range(file, self.range(b), &mut vec![0; STEP])?;
        *block.sum.lock().unwrap_or_else(|e| e.into_inner()) = Some((writes, sum));
        Ok(())
    }

    /// The sum of block `b`, unless it was not taken or no longer holds. Nobody writes any more.
    pub(super) fn get(&self, b: u64) -> Option<u64> {
        let block = &self.blocks[b as usize];
        let taken = *block.sum.lock().unwrap_or_else(|e| e.into_inner());
        let (writes, sum) = taken?;
        (writes == block.writes.load(Ordering::Acquire)).then_some(sum)
    }

    /// Bytes whose blocks are still to be summed.
    pub fn left(&self) -> u64 {
        let blocks = 0..self.blocks.len() as u64;
        let left = blocks.filter(|&b| self.get(b).is_none());
        left.map(|b| self.range(b)).map(|r| r.end - r.start).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{block_sums, warm_sums};
    use super::*;
    use crate::disk::{Counters, NoProgress, Scratch, Workers, Workspace};
    use std::sync::Arc;

    fn workspace(dir: &std::path::Path, memory: u64) -> Workspace {
        let io = Arc::new(Counters::default());
        Workspace {
            budget: Budget::new(memory),
            scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io).unwrap(),
            io,
            workers: Workers::new(2).unwrap(),
            progress: Arc::new(NoProgress),
        }
    }

    /// Sums of a file equal those of reading it in the end, whatever was written when.
    fn check(memory: u64, early: bool, rewrites: &[(u64, u64)], left: u64) {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), memory);
        let file = DataFile::create_new(&dir.path().join("f"), &ws.io).unwrap();
        let bytes = 2 * BLOCK + 12_345;
        file.set_len(bytes).unwrap();
        let sums = WarmSums::new(&ws.budget, bytes, early).unwrap();
        let write = |at: u64, len: u64, byte: u8| {
            file.write_at(&vec![byte; len as usize], at).unwrap();
            sums.wrote(&file, at, len).unwrap();
        };
        // Pieces that straddle blocks, in two interleaved orders, as two threads write them.
        let step = 10_000_001;
        let pieces = (0..bytes).step_by(step as usize);
        for at in pieces.clone().step_by(2).chain(pieces.skip(1).step_by(2)) {
            write(at, step.min(bytes - at), (at % 251) as u8);
        }
        for &(at, len) in rewrites {
            write(at, len, 7);
        }
        assert_eq!(sums.left(), left);
        let before = ws.io.now().read;
        let warm = warm_sums(&ws, &[(&file, &sums)]).unwrap();
        assert_eq!(ws.io.now().read - before, left);
        assert_eq!(warm, block_sums(&ws, &[&file]).unwrap());
        drop(sums);
        assert_eq!(ws.budget.used(), 0);
    }

    #[test]
    fn blocks_are_summed_as_they_become_whole() {
        check(64 << 20, true, &[], 0);
        // Written again: the first block alone, then a range across two, then nothing at all.
        check(64 << 20, true, &[(5, 3)], BLOCK);
        check(64 << 20, true, &[(2 * BLOCK - 1, 2)], BLOCK + 12_345);
        check(64 << 20, true, &[(9, 0)], 0);
        // Without memory to spare, or the wish, all of them wait.
        check(1 << 20, true, &[(5, 3)], 2 * BLOCK + 12_345);
        check(64 << 20, false, &[], 2 * BLOCK + 12_345);
    }

    #[test]
    fn a_write_while_a_sum_is_taken_makes_it_void() {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), 64 << 20);
        let file = DataFile::create_new(&dir.path().join("f"), &ws.io).unwrap();
        file.write_at(&[1; 100], 0).unwrap();
        let sums = WarmSums::new(&ws.budget, 100, true).unwrap();
        // Counted writes and the sum's own count part here as they would then.
        sums.wrote(&file, 0, 100).unwrap();
        assert!(sums.get(0).is_some());
        sums.blocks[0].writes.fetch_add(1, Ordering::AcqRel);
        assert!(sums.get(0).is_none());
    }
}
