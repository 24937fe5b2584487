//! Files written and read from front to back, through one leased buffer each.
//!
//! Memory: the buffers. I/O: whole buffers, sequential.

use crate::disk::{Budget, DataFile, Lease, ScratchFile};
use crate::error::Result;
use crate::input::reader::lease_buffer;

/// A file that takes bytes at an offset.
pub trait WriteAt {
    /// Writes all of `buf` at byte `at`.
    ///
    /// # Errors
    /// As the file's own.
    fn write_at(&self, buf: &[u8], at: u64) -> Result<()>;
}

impl WriteAt for ScratchFile {
    fn write_at(&self, buf: &[u8], at: u64) -> Result<()> {
        ScratchFile::write_at(self, buf, at)
    }
}

impl WriteAt for DataFile {
    fn write_at(&self, buf: &[u8], at: u64) -> Result<()> {
        DataFile::write_at(self, buf, at)
    }
}

/// Writes a file from byte `at` on.
pub struct SeqWriter<F> {
    file: F,
    at: u64,
    buf: Vec<u8>,
    room: usize,
    _lease: Lease,
}

impl<F: WriteAt> SeqWriter<F> {
    /// Takes a buffer from the budget.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, file: F, at: u64) -> Result<SeqWriter<F>> {
        let (room, lease) = lease_buffer(budget, "the buffer for welded output", 4096)?;
        Ok(SeqWriter {
            file,
            at,
            buf: Vec::with_capacity(room),
            room,
            _lease: lease,
        })
    }

    /// Appends a few bytes.
    ///
    /// # Errors
    /// As the file's.
    #[inline]
    pub fn push(&mut self, bytes: &[u8]) -> Result<()> {
        if self.room - self.buf.len() < bytes.len() {
            self.flush()?;
        }
        self.buf.extend_from_slice(bytes);
        Ok(())
    }

    #[cold]
    fn flush(&mut self) -> Result<()> {
        self.file.write_at(&self.buf, self.at)?;
        self.at += self.buf.len() as u64;
        self.buf.clear();
        Ok(())
    }

    /// Writes what is left, and gives the file back with the byte behind its last.
    ///
    /// # Errors
    /// As the file's.
    pub fn finish(mut self) -> Result<(F, u64)> {
        self.flush()?;
        Ok((self.file, self.at))
    }
}

/// Reads records of equal size from bytes `at..end` of a file.
pub struct SeqReader<'a> {
    file: &'a DataFile,
    /// Byte of the file behind the buffer.
    at: u64,
    end: u64,
    record: usize,
    buf: Vec<u8>,
    pos: usize,
    len: usize,
    _lease: Lease,
}

impl<'a> SeqReader<'a> {
    /// Takes a buffer from the budget; `records` of `record` bytes each lie from byte `at` on.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(
        budget: &Budget,
        file: &'a DataFile,
        at: u64,
        record: usize,
        records: u64,
    ) -> Result<SeqReader<'a>> {
        let (room, lease) = lease_buffer(budget, "a buffer for reading back", 4096)?;
        Ok(SeqReader {
            file,
            at,
            end: at + records * record as u64,
            record,
            buf: vec![0; room / record * record],
            pos: 0,
            len: 0,
            _lease: lease,
        })
    }

    /// The next record; `None` behind the last.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    #[inline]
    pub fn next(&mut self) -> Result<Option<&[u8]>> {
        if self.pos == self.len && !self.fill()? {
            return Ok(None);
        }
        let from = self.pos;
        self.pos += self.record;
        Ok(Some(&self.buf[from..self.pos]))
    }

    #[cold]
    fn fill(&mut self) -> Result<bool> {
        let left = self.end - self.at;
        let n = left.min(self.buf.len() as u64) as usize;
        self.file.read_at(&mut self.buf[..n], self.at)?;
        self.at += n as u64;
        (self.pos, self.len) = (0, n);
        Ok(n > 0)
    }

    /// Goes past `records` records without reading those that are not in the buffer.
    #[inline]
    pub fn skip(&mut self, records: u64) {
        let bytes = records * self.record as u64;
        let held = (self.len - self.pos) as u64;
        if bytes <= held {
            self.pos += bytes as usize;
        } else {
            self.at = (self.at + (bytes - held)).min(self.end);
            (self.pos, self.len) = (0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::workspace;

    #[test]
    fn what_is_written_is_read_and_skipped() {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), 64 << 10);
        let file = ws.scratch.file("test").unwrap();
        let mut out = SeqWriter::new(&ws.budget, file, 24).unwrap();
        for i in 0..5000u64 {
            out.push(&(i * i).to_le_bytes()).unwrap();
        }
        let (file, end) = out.finish().unwrap();
        assert_eq!(end, 24 + 40_000);
        let mut back = SeqReader::new(&ws.budget, file.data(), 24, 8, 5000).unwrap();
        let mut i = 0u64;
        for step in (0..100).chain([600, 2000, 3]) {
            back.skip(step);
            i += step;
            if i < 5000 {
                assert_eq!(back.next().unwrap().unwrap(), (i * i).to_le_bytes(), "{i}");
                i += 1;
            }
        }
        assert!(i > 5000);
        assert!(back.next().unwrap().is_none());
        drop(back);
        drop(file);
        assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    }
}
