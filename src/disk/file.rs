//! A file read and written at offsets, whose errors name path, offset and length.
//!
//! Reads and writes go to the caller's buffer, so memory is the caller's; every byte is
//! counted. Offsets make the calls independent of each other: threads share one file.

use super::{Counters, fs, go_on};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// An open file with its path and the counters that its traffic is added to.
#[derive(Debug)]
pub struct DataFile {
    file: Arc<File>,
    path: PathBuf,
    io: Arc<Counters>,
}

impl DataFile {
    /// Opens an existing file for reading.
    ///
    /// # Errors
    /// [`Error::Io`] with the path.
    pub fn open(path: &Path, io: &Arc<Counters>) -> Result<DataFile> {
        let file = fs::open(path, File::options().read(true))
            .map_err(|e| Error::io(path, "open it for reading", e))?;
        Ok(DataFile::from_file(file, path, io))
    }

    /// Creates a file that must not exist yet, for reading and writing.
    ///
    /// # Errors
    /// [`Error::Io`] with the path.
    pub fn create_new(path: &Path, io: &Arc<Counters>) -> Result<DataFile> {
        let file = fs::create_new(path).map_err(|e| Error::io(path, "create it", e))?;
        Ok(DataFile::from_file(file, path, io))
    }

    /// Opens an existing file for reading and writing.
    ///
    /// # Errors
    /// [`Error::Io`] with the path.
    pub fn open_rw(path: &Path, io: &Arc<Counters>) -> Result<DataFile> {
        let file = fs::open(path, File::options().read(true).write(true))
            .map_err(|e| Error::io(path, "open it for writing", e))?;
        Ok(DataFile::from_file(file, path, io))
    }

    pub(super) fn from_file(file: File, path: &Path, io: &Arc<Counters>) -> DataFile {
        DataFile {
            file: Arc::new(file),
            path: path.to_owned(),
            io: Arc::clone(io),
        }
    }

    /// The path, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn raw(&self) -> &Arc<File> {
        &self.file
    }

    pub(super) fn counters(&self) -> &Arc<Counters> {
        &self.io
    }

    /// Length in bytes, asked anew.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn len(&self) -> Result<u64> {
        fs::length(&self.file, &self.path).map_err(|e| Error::io(&self.path, "ask its length", e))
    }

    /// True when the file has no byte.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn is_empty(&self) -> Result<bool> {
        Ok(self.len()? == 0)
    }

    /// Sets the length; a part that was never written reads as zeros.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn set_len(&self, bytes: u64) -> Result<()> {
        fs::set_len(&self.file, &self.path, bytes)
            .map_err(|e| Error::io(&self.path, format!("set its length to {bytes} bytes"), e))
    }

    /// Fills `buf` from byte `at`.
    ///
    /// # Errors
    /// [`Error::Io`], also when the file ends before `buf` is full.
    pub fn read_at(&self, buf: &mut [u8], at: u64) -> Result<()> {
        go_on()?;
        let failed =
            |bytes, e| Error::io(&self.path, format!("read {bytes} bytes at byte {at}"), e);
        let mut done = 0;
        while done < buf.len() {
            match fs::read_at(&self.file, &self.path, &mut buf[done..], at + done as u64) {
                Ok(0) => return Err(failed(buf.len(), ErrorKind::UnexpectedEof.into())),
                Ok(n) => done += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(failed(buf.len(), e)),
            }
        }
        self.io.add_read(done as u64);
        Ok(())
    }

    /// Reads up to `buf.len()` bytes from byte `at`; fewer only at the end of the file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read_some_at(&self, buf: &mut [u8], at: u64) -> Result<usize> {
        go_on()?;
        let mut done = 0;
        while done < buf.len() {
            match fs::read_at(&self.file, &self.path, &mut buf[done..], at + done as u64) {
                Ok(0) => break,
                Ok(n) => done += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => {
                    return Err(Error::io(&self.path, format!("read at byte {at}"), e));
                }
            }
        }
        self.io.add_read(done as u64);
        Ok(done)
    }

    /// Writes all of `buf` at byte `at`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_at(&self, buf: &[u8], at: u64) -> Result<()> {
        go_on()?;
        let failed = |e| {
            let action = format!("write {} bytes at byte {at}", buf.len());
            Error::io(&self.path, action, e)
        };
        let mut done = 0;
        while done < buf.len() {
            match fs::write_at(&self.file, &self.path, &buf[done..], at + done as u64) {
                Ok(0) => return Err(failed(ErrorKind::WriteZero.into())),
                Ok(n) => done += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(failed(e)),
            }
        }
        self.io.add_written(done as u64);
        Ok(())
    }

    /// Waits until the data is on the device.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn sync(&self) -> Result<()> {
        fs::sync(&self.file, &self.path)
            .map_err(|e| Error::io(&self.path, "sync it to the device", e))
    }
}
