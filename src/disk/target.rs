//! A file that appears under its name when it is complete.
//!
//! Why nothing half-written is left under the name: all is written to a temporary file beside
//! it, which is synced and renamed at the end, and gone when dropped before. It is locked while
//! its process lives, so what a killed one left is removed by the next that writes there.
//!
//! Memory: none that grows. I/O: what its owner writes.

use super::fs::{self, Stream};
use super::left::gone;
use super::lock::{claim, sweep};
use super::stop::Fleeting;
use super::{Counters, DataFile};
use crate::error::{Error, Result};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempPath;

/// A file under a temporary name beside its target; gone when dropped before it is kept.
#[derive(Debug)]
pub struct Target {
    temp: Temporary,
    stream: Stream,
    path: PathBuf,
    force: bool,
    _fleeting: Fleeting,
}

impl Target {
    /// A new temporary file in the folder of the target, which replaces a file of that name only
    /// with `force`. What else it must not be, `folder::Outputs` says, which calls this.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn create(path: &Path, force: bool) -> Result<Target> {
        let dir = parent(path);
        sweep(dir);
        let failed = |e| Error::io(dir, "create a file there", e);
        let mut temp = Temporary::new(dir).map_err(failed)?;
        while !claim(&temp.file, &temp.path)? {
            temp = Temporary::new(dir).map_err(failed)?;
        }
        let stream = Stream::new(temp.file.try_clone().map_err(failed)?, path);
        Ok(Target {
            _fleeting: Fleeting::new(&temp.path),
            temp,
            stream,
            path: path.to_owned(),
            force,
        })
    }

    /// What is said of a file that exists and may not be replaced.
    pub fn exists(path: &Path) -> Error {
        Error::Usage(format!(
            "{}: exists; give --force to replace it, or another name",
            path.display()
        ))
    }

    /// Where the file will be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file, to be written at offsets by many.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn data(&self, io: &Arc<Counters>) -> Result<DataFile> {
        DataFile::open_rw(&self.temp.path, io)
    }

    /// The file, to write to.
    pub fn file(&mut self) -> &mut Stream {
        &mut self.stream
    }

    /// Bytes of the file so far.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn bytes(&self) -> Result<u64> {
        let length = fs::length(&self.temp.file, &self.path);
        length.map_err(|e| Error::io(&self.path, "ask its length", e))
    }

    /// Syncs the file and gives it its name.
    ///
    /// # Errors
    /// [`Error::Usage`] when a file of that name has appeared meanwhile; [`Error::Io`].
    pub fn keep(self) -> Result<PathBuf> {
        let Target {
            mut temp,
            path,
            force,
            ..
        } = self;
        fs::sync(&temp.file, &path).map_err(|e| Error::io(&path, "sync it to the device", e))?;
        match temp.persist(&path, force) {
            Ok(()) => Ok(path),
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => Err(Target::exists(&path)),
            Err(e) => Err(Error::io(&path, "give the finished file its name", e)),
        }
    }
}

/// The folder that a path lies in.
pub fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A file under a name that nobody has, gone when dropped before it is given another.
#[derive(Debug)]
struct Temporary {
    file: File,
    path: PathBuf,
    /// None once it has its name.
    name: Option<TempPath>,
}

impl Temporary {
    fn new(dir: &Path) -> std::io::Result<Temporary> {
        let (file, name) = fs::create_temporary(dir)?.into_parts();
        Ok(Temporary {
            file,
            path: name.to_path_buf(),
            name: Some(name),
        })
    }

    fn persist(&mut self, path: &Path, replace: bool) -> std::io::Result<()> {
        let Some(name) = self.name.take() else {
            return Ok(());
        };
        fs::persist(name, path, replace).map_err(|(e, name)| {
            self.name = Some(name);
            e
        })
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(mut name) = self.name.take() {
            name.disable_cleanup(true);
            gone(&self.path, fs::remove_file(&self.path));
        }
    }
}
