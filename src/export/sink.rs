//! Where an export goes: a buffered stream, and a file that appears when it is complete.
//!
//! Memory: [`OUT_BYTES`]; the caller leases it. I/O: each byte written once.

use crate::disk::Counters;
use crate::error::{Error, Result};
use crate::folder::Folder;
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

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

/// A file under a temporary name beside its target; gone when dropped before it is kept.
pub(super) struct Target {
    temp: NamedTempFile,
    path: PathBuf,
    force: bool,
}

impl Target {
    /// A new temporary file in the folder of the target.
    ///
    /// # Errors
    /// [`Error::Usage`] when the target exists and may not be replaced, or lies in the mesh
    /// folder that is exported; [`Error::Io`].
    pub(super) fn create(folder: &Folder, path: &Path, force: bool) -> Result<Target> {
        if !force && path.symlink_metadata().is_ok() {
            return Err(exists(path));
        }
        let dir = match path.parent() {
            Some(dir) if !dir.as_os_str().is_empty() => dir,
            _ => Path::new("."),
        };
        if let (Ok(dir), Ok(mesh)) = (dir.canonicalize(), folder.path().canonicalize())
            && dir.starts_with(&mesh)
        {
            return Err(Error::Usage(format!(
                "{}: lies in the mesh folder that is exported, whose files are not to be \
                 changed; give a name outside of it",
                path.display()
            )));
        }
        // A plain new file's permissions (less the umask), not a private temporary one's.
        let temp = tempfile::Builder::new()
            .prefix(".cornermill-")
            .suffix(".tmp")
            .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666))
            .tempfile_in(dir)
            .map_err(|e| Error::io(dir, "create a file there", e))?;
        Ok(Target {
            temp,
            path: path.to_owned(),
            force,
        })
    }

    pub(super) fn file(&mut self) -> &mut std::fs::File {
        self.temp.as_file_mut()
    }

    /// Syncs the file and gives it its name.
    ///
    /// # Errors
    /// [`Error::Usage`] when a file of that name has appeared meanwhile; [`Error::Io`].
    pub(super) fn keep(self) -> Result<PathBuf> {
        let Target { temp, path, force } = self;
        temp.as_file()
            .sync_all()
            .map_err(|e| Error::io(&path, "sync it to the device", e))?;
        let kept = if force {
            temp.persist(&path)
        } else {
            temp.persist_noclobber(&path)
        };
        match kept {
            Ok(_) => Ok(path),
            Err(e) if e.error.kind() == std::io::ErrorKind::AlreadyExists => Err(exists(&path)),
            Err(e) => Err(Error::io(&path, "give the finished file its name", e.error)),
        }
    }
}

fn exists(path: &Path) -> Error {
    Error::Usage(format!(
        "{}: exists; give --force to replace it, or another name",
        path.display()
    ))
}
