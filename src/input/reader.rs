//! Bytes of the mesh file (or of standard input), once, in order, with their digest.
//!
//! Why the digest costs no second read: the manifest's digest is over the xxh3 of each 64 MiB
//! block, and a stream passes the block borders in order, so every byte is hashed when it
//! enters the buffer. [`ByteReader::finish`] reads what the decoder left, and so the digest is
//! always that of the whole input.
//!
//! Memory: one buffer (1 MiB, less when the budget is tight) and 8 bytes for every 64 MiB
//! read. I/O: the input once.

use crate::disk::fs::Stream;
use crate::disk::{Budget, Counters, Lease, Progress, Workspace};
use crate::error::{Error, Result};
use crate::folder::{BLOCK, InputDigest, digest_of_blocks};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3Default;

/// Bytes that [`ByteReader::peek`] always grants, whatever the budget.
pub const PEEK: usize = 4096;
/// Bytes of a buffer when the budget is ample.
const BUFFER: u64 = 1 << 20;

/// Draws a buffer of 1 MiB from the budget, less (but `least`) when the budget is tight.
pub(crate) fn lease_buffer(budget: &Budget, what: &str, least: usize) -> Result<(usize, Lease)> {
    let bytes = (budget.free() / 16 / 4096 * 4096).clamp(least as u64, BUFFER);
    Ok((bytes as usize, budget.lease(what, bytes)?))
}

/// A buffered stream of bytes that knows where it is and sums what it reads.
pub struct ByteReader {
    source: Box<dyn Read>,
    path: PathBuf,
    length: Option<u64>,
    regular: bool,
    buf: Vec<u8>,
    start: usize,
    end: usize,
    /// Byte of the input that `buf[start]` is.
    offset: u64,
    ended: bool,
    digest: Digest,
    io: Arc<Counters>,
    progress: Arc<dyn Progress>,
    _lease: Lease,
}

impl ByteReader {
    /// Opens a file, or anything that can be read in order (a named pipe).
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Budget`] for the buffer.
    pub fn open(ws: &Workspace, path: &Path) -> Result<ByteReader> {
        let file = Stream::open(path).map_err(|e| Error::io(path, "open it for reading", e))?;
        let meta = file
            .metadata()
            .map_err(|e| Error::io(path, "ask its length", e))?;
        let length = meta.is_file().then_some(meta.len());
        let mut reader = ByteReader::new(ws, Box::new(file), path.to_owned(), length)?;
        reader.regular = length.is_some();
        Ok(reader)
    }

    /// Reads standard input.
    ///
    /// # Errors
    /// [`Error::Budget`] for the buffer.
    pub fn from_stdin(ws: &Workspace) -> Result<ByteReader> {
        let stdin = Box::new(std::io::stdin());
        ByteReader::new(ws, stdin, PathBuf::from("(standard input)"), None)
    }

    /// Reads any stream; `path` names it in messages.
    ///
    /// # Errors
    /// [`Error::Budget`] for the buffer.
    pub fn new(
        ws: &Workspace,
        source: Box<dyn Read>,
        path: PathBuf,
        length: Option<u64>,
    ) -> Result<ByteReader> {
        let (bytes, lease) = lease_buffer(&ws.budget, "the buffer for reading the mesh", PEEK)?;
        Ok(ByteReader {
            source,
            path,
            length,
            regular: false,
            buf: vec![0; bytes],
            start: 0,
            end: 0,
            offset: 0,
            ended: false,
            digest: Digest::default(),
            io: Arc::clone(&ws.io),
            progress: Arc::clone(&ws.progress),
            _lease: lease,
        })
    }

    /// What the input is called in messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Length of the input in bytes when it is known beforehand.
    pub fn length(&self) -> Option<u64> {
        self.length
    }

    /// True for a file that can be opened again by its name, and read from any byte.
    pub fn regular(&self) -> bool {
        self.regular
    }

    /// Bytes that were read from the input, consumed or not.
    pub fn read_so_far(&self) -> u64 {
        self.offset + (self.end - self.start) as u64
    }

    /// Byte of the input that comes next.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// The next `n` bytes ([`PEEK`] at most), fewer only at the end of the input; at least
    /// these are then in [`buffered`](ByteReader::buffered).
    ///
    /// # Errors
    /// [`Error::Io`].
    #[inline]
    pub fn peek(&mut self, n: usize) -> Result<&[u8]> {
        debug_assert!(n <= PEEK);
        while self.end - self.start < n && self.more()? {}
        let n = n.min(self.end - self.start);
        Ok(&self.buf[self.start..self.start + n])
    }

    /// What is buffered, refilled when that is nothing; empty only at the end of the input.
    ///
    /// # Errors
    /// [`Error::Io`].
    #[inline]
    pub fn buffer(&mut self) -> Result<&[u8]> {
        if self.start == self.end {
            self.more()?;
        }
        Ok(self.buffered())
    }

    /// What is buffered, without reading.
    #[inline]
    pub fn buffered(&self) -> &[u8] {
        &self.buf[self.start..self.end]
    }

    /// Reads some more behind what is buffered; false at the end of the input, or when the
    /// buffer is full.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn more(&mut self) -> Result<bool> {
        if self.ended {
            return Ok(false);
        }
        if self.start > 0 {
            self.buf.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if self.end == self.buf.len() {
            return Ok(false);
        }
        let got = loop {
            match self.source.read(&mut self.buf[self.end..]) {
                Ok(n) => break n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => {
                    let at = self.offset + self.end as u64;
                    return Err(Error::io(&self.path, format!("read at byte {at}"), e));
                }
            }
        };
        self.ended = got == 0;
        self.digest.update(&self.buf[self.end..self.end + got]);
        self.end += got;
        self.io.add_read(got as u64);
        self.progress.advance(got as u64);
        Ok(got > 0)
    }

    /// Goes past `n` bytes of what is buffered (all of it when that is less).
    #[inline]
    pub fn consume(&mut self, n: usize) {
        let n = n.min(self.end - self.start);
        self.start += n;
        self.offset += n as u64;
    }

    /// The last `n` bytes consumed; valid until the next call that may read.
    #[inline]
    pub(crate) fn consumed(&self, n: usize) -> &[u8] {
        &self.buf[self.start - n..self.start]
    }

    /// Fills `out`.
    ///
    /// # Errors
    /// [`Error::Input`] when the input ends before, [`Error::Io`].
    pub fn read_exact(&mut self, out: &mut [u8]) -> Result<()> {
        let mut done = 0;
        while done < out.len() {
            let have = self.buffer()?;
            if have.is_empty() {
                return Err(self.cut_short(format!("{} bytes more", out.len() - done)));
            }
            let n = have.len().min(out.len() - done);
            out[done..done + n].copy_from_slice(&have[..n]);
            done += n;
            self.consume(n);
        }
        Ok(())
    }

    /// Goes past `n` bytes, however many.
    ///
    /// # Errors
    /// [`Error::Input`] when the input ends before, [`Error::Io`].
    pub fn skip(&mut self, mut n: u64) -> Result<()> {
        while n > 0 {
            let have = self.buffer()?.len();
            if have == 0 {
                return Err(self.cut_short(format!("{n} bytes more")));
            }
            let step = n.min(have as u64);
            self.consume(step as usize);
            n -= step;
        }
        Ok(())
    }

    /// The error of an input that ends where it must not.
    pub fn cut_short(&self, expected: impl Into<String>) -> Error {
        let at = self.read_so_far();
        Error::input(
            &self.path,
            format!("byte {at}"),
            expected,
            "the end of the input",
            "the file is cut short; write or copy it again",
        )
    }

    /// Reads the rest, and gives the digest of the whole input.
    ///
    /// # Errors
    /// [`Error::Input`] when a file ends before it did when it was opened; [`Error::Io`].
    pub fn finish(mut self) -> Result<InputDigest> {
        loop {
            self.consume(usize::MAX);
            if !self.more()? {
                break;
            }
        }
        match self.length.filter(|_| self.regular) {
            // A text that was cut between two lines would pass for a smaller mesh.
            Some(length) if self.offset < length => {
                Err(self.cut_short(format!("{length} bytes, as it was when it was opened")))
            }
            _ => Ok(self.digest.finish()),
        }
    }
}

impl std::fmt::Debug for ByteReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ByteReader")
            .field("path", &self.path)
            .field("offset", &self.offset)
            .finish_non_exhaustive()
    }
}

/// The digest of [`crate::folder::digest_file`], over a stream.
#[derive(Default)]
struct Digest {
    hasher: Xxh3Default,
    bytes: u64,
    sums: Vec<u64>,
}

impl Digest {
    fn update(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let room = BLOCK - self.bytes % BLOCK;
            let n = room.min(bytes.len() as u64) as usize;
            self.hasher.update(&bytes[..n]);
            self.bytes += n as u64;
            bytes = &bytes[n..];
            if self.bytes.is_multiple_of(BLOCK) {
                self.sums.push(self.hasher.digest());
                self.hasher.reset();
            }
        }
    }

    fn finish(mut self) -> InputDigest {
        if !self.bytes.is_multiple_of(BLOCK) {
            self.sums.push(self.hasher.digest());
        }
        InputDigest {
            bytes: self.bytes,
            xxh3: format!("{:016x}", digest_of_blocks(&self.sums)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::DataFile;
    use crate::folder::digest_file;
    use crate::input::testing::{Dripping, workspace};

    fn dripping(ws: &Workspace, data: &[u8]) -> ByteReader {
        let source = Dripping(std::io::Cursor::new(data.to_vec()), 7);
        ByteReader::new(ws, Box::new(source), "drip".into(), None).unwrap()
    }

    #[test]
    fn digest_equals_that_of_the_file_whatever_was_consumed() {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), 64 << 20);
        for len in [0, 1, 5000, BLOCK as usize, BLOCK as usize + 12_345] {
            let data: Vec<u8> = (0..len).map(|i| (i / 3) as u8).collect();
            let path = dir.path().join("data");
            std::fs::write(&path, &data).unwrap();
            let whole = digest_file(&ws, &DataFile::open(&path, &ws.io).unwrap()).unwrap();
            let mut reader = ByteReader::open(&ws, &path).unwrap();
            assert_eq!(reader.peek(10).unwrap(), &data[..len.min(10)]);
            reader.skip((len / 2) as u64).unwrap();
            assert_eq!(reader.finish().unwrap(), whole);
        }
        assert_eq!(ws.budget.used(), 0);
    }

    #[test]
    fn peeks_over_refills_and_names_the_end() {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), 1 << 20);
        let data: Vec<u8> = (0..100_000u32).map(|i| (i % 251) as u8).collect();
        let mut reader = dripping(&ws, &data);
        let mut at = 0;
        for n in [1, 100, 4096, 3000, 4096, 17] {
            assert_eq!(reader.peek(n).unwrap(), &data[at..at + n]);
            reader.consume(n);
            assert_eq!(reader.consumed(n.min(5)), &data[at + n - n.min(5)..at + n]);
            at += n;
            assert_eq!(reader.offset(), at as u64);
        }
        let mut out = vec![0; data.len() - at - 3];
        reader.read_exact(&mut out).unwrap();
        assert_eq!(out, data[at..data.len() - 3]);
        assert_eq!(reader.peek(10).unwrap().len(), 3);
        let error = reader.read_exact(&mut [0; 4]).unwrap_err().to_string();
        assert!(
            error.contains("byte 100000: expected 1 bytes more"),
            "{error}"
        );
    }
}
