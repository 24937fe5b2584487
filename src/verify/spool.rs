//! A queue of plain records in scratch space: written through a buffer, then read in order.
//!
//! Memory: one buffer while writing and one while reading, whose bytes the owner leases; a
//! queue that nothing was written to has none, and no file. I/O: each record once each way.

use crate::disk::{Scratch, ScratchFile};
use crate::error::Result;
use bytemuck::Pod;

/// Records written in order, to be read in the same order.
pub(super) struct Spool<R> {
    file: Option<ScratchFile>,
    buf: Vec<R>,
    cap: usize,
    written: u64,
}

impl<R: Pod> Spool<R> {
    /// An empty queue with a buffer of `bytes`.
    pub(super) fn new(bytes: u64) -> Spool<R> {
        Spool {
            file: None,
            buf: Vec::new(),
            cap: (bytes as usize / size_of::<R>()).max(1),
            written: 0,
        }
    }

    /// Adds a record.
    pub(super) fn push(&mut self, scratch: &Scratch, record: R) -> Result<()> {
        if self.buf.capacity() == 0 {
            self.buf.reserve_exact(self.cap);
        }
        if self.buf.len() == self.cap {
            self.flush(scratch)?;
        }
        self.buf.push(record);
        Ok(())
    }

    fn flush(&mut self, scratch: &Scratch) -> Result<()> {
        if self.file.is_none() {
            self.file = Some(scratch.file("links between triangles")?);
        }
        if let Some(file) = &self.file {
            file.append(bytemuck::cast_slice(&self.buf))?;
        }
        self.written += self.buf.len() as u64;
        self.buf.clear();
        Ok(())
    }

    /// Number of records in the queue.
    pub(super) fn len(&self) -> u64 {
        self.written + self.buf.len() as u64
    }

    /// Calls `each` for every record, in order. What never left the buffer is not read back.
    pub(super) fn read(&self, mut each: impl FnMut(R) -> Result<()>) -> Result<()> {
        if let Some(file) = &self.file {
            let mut buf = vec![R::zeroed(); self.cap.min(self.written as usize)];
            let mut at = 0;
            while at < self.written {
                let n = buf.len().min((self.written - at) as usize);
                file.read_at(
                    bytemuck::cast_slice_mut(&mut buf[..n]),
                    at * size_of::<R>() as u64,
                )?;
                at += n as u64;
                buf[..n].iter().try_for_each(|&record| each(record))?;
            }
        }
        self.buf.iter().try_for_each(|&record| each(record))
    }
}
