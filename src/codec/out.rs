//! The file that is written, summed and counted as it grows.
//!
//! Memory: a block of 1 MiB while bytes are copied, leased. I/O: each byte written once.

use crate::disk::{ScratchFile, Target, Workspace};
use crate::error::{Error, Result};
use std::io::Write;
use xxhash_rust::xxh3::Xxh3;

/// Bytes that are copied at a time.
const BLOCK: u64 = 1 << 20;

/// A file that gets its name when it is complete.
pub(super) struct Out<'a> {
    target: Target,
    pub(super) written: u64,
    pub(super) summed: Xxh3,
    ws: &'a Workspace,
}

impl<'a> Out<'a> {
    pub(super) fn new(ws: &'a Workspace, target: Target) -> Out<'a> {
        Out {
            target,
            written: 0,
            summed: Xxh3::new(),
            ws,
        }
    }

    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.target.file().write_all(bytes);
        written.map_err(|e| Error::io(self.target.path(), "write to it", e))?;
        self.summed.update(bytes);
        self.written += bytes.len() as u64;
        self.ws.io.add_written(bytes.len() as u64);
        Ok(())
    }

    /// Copies bytes of a scratch file.
    pub(super) fn copy(&mut self, from: &ScratchFile, at: u64, bytes: u64) -> Result<()> {
        let _lease = self.ws.budget.lease("a block of coded bytes", BLOCK)?;
        let mut buf = vec![0; BLOCK.min(bytes) as usize];
        let mut done = 0;
        while done < bytes {
            let n = (bytes - done).min(buf.len() as u64) as usize;
            from.read_at(&mut buf[..n], at + done)?;
            self.put(&buf[..n])?;
            done += n as u64;
        }
        Ok(())
    }

    /// Syncs the file and gives it its name; its length.
    pub(super) fn finish(self) -> Result<u64> {
        self.target.keep()?;
        Ok(self.written)
    }
}
