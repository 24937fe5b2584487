//! A file read from front to back, through one leased buffer.
//!
//! Memory: the buffer. I/O: whole buffers, sequential.

use crate::disk::{Budget, DataFile, Lease};
use crate::error::Result;
use crate::input::reader::lease_buffer;

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
    fn records_are_read_and_skipped() {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), 64 << 10);
        let file = ws.scratch.file("test").unwrap();
        file.append(&[7; 24]).unwrap();
        for i in 0..5000u64 {
            file.append(&(i * i).to_le_bytes()).unwrap();
        }
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
