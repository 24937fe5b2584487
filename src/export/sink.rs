//! Where an export goes: a buffered stream.
//!
//! Memory: [`OUT_BYTES`]; the caller leases it. I/O: each byte written once.

use crate::disk::Counters;
use crate::error::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Bytes that are gathered before they are written.
const FULL: usize = 256 << 10;
/// Memory of a [`Sink`]: no record is longer than the slack.
pub(super) const OUT_BYTES: u64 = FULL as u64 + (8 << 10);

/// A stream that counts its bytes and names its target in errors.
pub(super) struct Sink<'a> {
    out: &'a mut dyn Write,
    path: PathBuf,
    io: &'a Counters,
    buf: Vec<u8>,
    written: u64,
}

impl<'a> Sink<'a> {
    pub(super) fn new(out: &'a mut dyn Write, path: PathBuf, io: &'a Counters) -> Sink<'a> {
        Sink {
            out,
            path,
            io,
            buf: Vec::with_capacity(OUT_BYTES as usize),
            written: 0,
        }
    }

    /// The target, for messages.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes one record: `fill` appends it (at most 8 KiB) to the buffer.
    pub(super) fn put(&mut self, fill: impl FnOnce(&mut Vec<u8>)) -> Result<()> {
        fill(&mut self.buf);
        if self.buf.len() >= FULL {
            self.spill()?;
        }
        Ok(())
    }

    fn spill(&mut self) -> Result<()> {
        self.out
            .write_all(&self.buf)
            .map_err(|e| self.failed("write to it", e))?;
        self.io.add_written(self.buf.len() as u64);
        self.written += self.buf.len() as u64;
        self.buf.clear();
        Ok(())
    }

    fn failed(&self, action: &str, source: std::io::Error) -> Error {
        Error::io(&self.path, action, source)
    }

    /// Writes what is left, and returns the bytes written in all.
    pub(super) fn finish(mut self) -> Result<u64> {
        self.spill()?;
        self.out
            .flush()
            .map_err(|e| self.failed("write to it", e))?;
        Ok(self.written)
    }
}
