//! Scratch space: temporary files, spread over the folders that the user named, counted
//! against a limit, gone when dropped.
//!
//! The files have no name once they are open (they are unlinked at once), so a killed
//! process leaves nothing behind.

use super::{Counters, DataFile};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

#[derive(Debug)]
struct Inner {
    dirs: Vec<PathBuf>,
    next: AtomicUsize,
    limit: u64,
    used: AtomicU64,
    peak: AtomicU64,
    io: Arc<Counters>,
}

/// Where temporary files go. Clones share the limit and the counters.
#[derive(Clone, Debug)]
pub struct Scratch(Arc<Inner>);

/// A temporary file that only grows; its bytes count against the scratch limit until drop.
#[derive(Debug)]
pub struct ScratchFile {
    data: DataFile,
    len: AtomicU64,
    scratch: Scratch,
}

impl Scratch {
    /// Scratch space in `dirs` (at least one), at most `limit` bytes at a time.
    ///
    /// # Errors
    /// [`Error::Usage`] when `dirs` is empty.
    pub fn new(dirs: &[PathBuf], limit: u64, io: &Arc<Counters>) -> Result<Scratch> {
        if dirs.is_empty() {
            return Err(Error::Usage(
                "scratch space needs at least one folder".into(),
            ));
        }
        Ok(Scratch(Arc::new(Inner {
            dirs: dirs.to_vec(),
            next: AtomicUsize::new(0),
            limit,
            used: AtomicU64::new(0),
            peak: AtomicU64::new(0),
            io: Arc::clone(io),
        })))
    }

    /// A new empty temporary file, in the next folder by turns.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder.
    pub fn file(&self, what: &str) -> Result<ScratchFile> {
        let turn = self.0.next.fetch_add(1, Ordering::Relaxed);
        let dir = &self.0.dirs[turn % self.0.dirs.len()];
        let file = tempfile::tempfile_in(dir)
            .map_err(|e| Error::io(dir, format!("create a temporary file for {what} there"), e))?;
        Ok(ScratchFile {
            data: DataFile::from_file(file, &dir.join(format!("(temporary: {what})")), &self.0.io),
            len: AtomicU64::new(0),
            scratch: self.clone(),
        })
    }

    /// Bytes in use now.
    pub fn used(&self) -> u64 {
        self.0.used.load(Ordering::Relaxed)
    }

    /// The most bytes that were in use at once.
    pub fn peak(&self) -> u64 {
        self.0.peak.load(Ordering::Relaxed)
    }

    /// The first folder, for messages and free-space questions.
    pub fn first_dir(&self) -> &Path {
        &self.0.dirs[0]
    }

    fn grow(&self, bytes: u64) -> Result<()> {
        let used = self.0.used.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if used > self.0.limit {
            self.0.used.fetch_sub(bytes, Ordering::Relaxed);
            return Err(Error::DiskLimit {
                need: used,
                limit: self.0.limit,
            });
        }
        self.0.peak.fetch_max(used, Ordering::Relaxed);
        Ok(())
    }
}

impl ScratchFile {
    /// Appends `buf` and returns the offset where it begins; safe from any thread.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn append(&self, buf: &[u8]) -> Result<u64> {
        self.scratch.grow(buf.len() as u64)?;
        let at = self.len.fetch_add(buf.len() as u64, Ordering::Relaxed);
        self.data.write_at(buf, at)?;
        Ok(at)
    }

    /// Writes `buf` at byte `at`, growing the file when it lies beyond the end.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn write_at(&self, buf: &[u8], at: u64) -> Result<()> {
        let end = at + buf.len() as u64;
        let before = self.len.fetch_max(end, Ordering::Relaxed);
        if end > before
            && let Err(e) = self.scratch.grow(end - before)
        {
            // What was refused must not be given back on drop. (A build stops here, so no
            // other writer's growth is lost that still matters.)
            self.len.fetch_min(before, Ordering::Relaxed);
            return Err(e);
        }
        self.data.write_at(buf, at)
    }

    /// Fills `buf` from byte `at`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read_at(&self, buf: &mut [u8], at: u64) -> Result<()> {
        self.data.read_at(buf, at)
    }

    /// Bytes appended so far.
    pub fn len(&self) -> u64 {
        self.len.load(Ordering::Relaxed)
    }

    /// True when nothing was appended.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The file itself, for windows and shared readers.
    pub fn data(&self) -> &DataFile {
        &self.data
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        self.scratch
            .0
            .used
            .fetch_sub(self.len.load(Ordering::Relaxed), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_limit_and_gives_back() {
        let dir = tempfile::tempdir().unwrap();
        let io = Arc::new(Counters::default());
        let scratch = Scratch::new(&[dir.path().to_owned()], 10, &io).unwrap();
        let file = scratch.file("test").unwrap();
        assert_eq!(file.append(b"abcdef").unwrap(), 0);
        assert!(matches!(
            file.append(b"ghijkl"),
            Err(Error::DiskLimit {
                need: 12,
                limit: 10
            })
        ));
        assert_eq!(file.append(b"gh").unwrap(), 6);
        let mut back = [0; 8];
        file.read_at(&mut back, 0).unwrap();
        assert_eq!(&back, b"abcdefgh");
        assert!(file.write_at(b"xyz", 8).is_err());
        drop(file);
        assert_eq!((scratch.used(), scratch.peak()), (0, 8));
        assert_eq!(io.now().written, 8);
    }
}
