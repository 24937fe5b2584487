//! Every call of the crate to the system about files: the one place where they can be made to
//! fail, to do less than they were asked, or to take long.
//!
//! Why one place: what holds when any of these calls fails can then be tried call by call (see
//! `faults`, which is part of debug builds only). Each function is the one of `std::fs` of that
//! name, in front of which the call is announced.
//!
//! Memory: none but what a file read whole takes. I/O: what the call does.

#[cfg(debug_assertions)]
pub(super) use super::faults::pass;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{FileExt, PermissionsExt};
use std::path::{Path, PathBuf};
use tempfile::{NamedTempFile, TempDir, TempPath};

/// What is asked of the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Call {
    /// Opening a file that exists.
    Open,
    /// Making a file or a folder.
    Create,
    /// Asking for the length or the kind of a file, or what a folder holds.
    Ask,
    /// Setting a length.
    SetLen,
    /// Reading.
    Read,
    /// Writing.
    Write,
    /// Waiting until data is on the device.
    Sync,
    /// Mapping.
    Map,
    /// Giving a file or folder another name.
    Rename,
    /// Removing a file or folder.
    Remove,
    /// Drawing memory from the budget.
    Lease,
}

/// Announces a call about `bytes` bytes; how many of them it may be about.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub(super) fn pass(_: Call, _: &Path, bytes: usize) -> io::Result<usize> {
    Ok(bytes)
}

/// Opens an existing file.
pub(crate) fn open(path: &Path, options: &OpenOptions) -> io::Result<File> {
    pass(Call::Open, path, 0)?;
    options.open(path)
}

/// Makes a file that must not exist, for reading and writing.
pub(crate) fn create_new(path: &Path) -> io::Result<File> {
    pass(Call::Create, path, 0)?;
    let mut options = File::options();
    options.read(true).write(true).create_new(true).open(path)
}

/// Makes a file, or empties the one that has its name, for writing in order.
pub(crate) fn create(path: &Path) -> io::Result<Stream> {
    pass(Call::Create, path, 0)?;
    Ok(Stream::new(File::create(path)?, path))
}

/// Makes a file in a folder, under a name that is free and begins so; it stays.
pub(crate) fn create_named(dir: &Path, prefix: &str) -> io::Result<(File, PathBuf)> {
    pass(Call::Create, dir, 0)?;
    let file = tempfile::Builder::new().prefix(prefix).tempfile_in(dir)?;
    file.keep().map_err(|e| e.error)
}

/// Makes a file without a name in a folder.
pub(crate) fn create_nameless(dir: &Path) -> io::Result<File> {
    pass(Call::Create, dir, 0)?;
    tempfile::tempfile_in(dir)
}

/// Makes a file under a name that is free, which is gone when dropped. It has a plain new file's
/// permissions (less the umask), not a private temporary one's.
pub(crate) fn create_temporary(dir: &Path) -> io::Result<NamedTempFile> {
    pass(Call::Create, dir, 0)?;
    tempfile::Builder::new()
        .prefix(super::lock::PREFIX)
        .suffix(super::lock::SUFFIX)
        .permissions(PermissionsExt::from_mode(0o666))
        .tempfile_in(dir)
}

/// Makes a folder under a name that is free, which is gone when dropped.
pub(crate) fn create_temporary_dir(dir: &Path, prefix: &str) -> io::Result<TempDir> {
    pass(Call::Create, dir, 0)?;
    tempfile::Builder::new().prefix(prefix).tempdir_in(dir)
}

/// Gives a temporary file its name; when that fails, it is handed back.
pub(crate) fn persist(
    temp: TempPath,
    path: &Path,
    replace: bool,
) -> Result<(), (io::Error, TempPath)> {
    if let Err(e) = pass(Call::Rename, path, 0) {
        return Err((e, temp));
    }
    let kept = if replace {
        temp.persist(path)
    } else {
        temp.persist_noclobber(path)
    };
    kept.map_err(|e| (e.error, e.path))
}

/// Makes a folder.
pub(crate) fn create_dir(path: impl AsRef<Path>) -> io::Result<()> {
    pass(Call::Create, path.as_ref(), 0)?;
    fs::create_dir(path)
}

/// Gives a file or folder another name.
pub(crate) fn rename(from: impl AsRef<Path>, to: impl AsRef<Path>) -> io::Result<()> {
    pass(Call::Rename, to.as_ref(), 0)?;
    fs::rename(from, to)
}

/// Removes a folder with all that it holds.
pub(crate) fn remove_dir_all(path: impl AsRef<Path>) -> io::Result<()> {
    pass(Call::Remove, path.as_ref(), 0)?;
    fs::remove_dir_all(path)
}

/// Removes an empty folder.
pub(crate) fn remove_dir(path: impl AsRef<Path>) -> io::Result<()> {
    pass(Call::Remove, path.as_ref(), 0)?;
    fs::remove_dir(path)
}

/// Removes a file.
pub(crate) fn remove_file(path: impl AsRef<Path>) -> io::Result<()> {
    pass(Call::Remove, path.as_ref(), 0)?;
    fs::remove_file(path)
}

/// The real name of a file or folder.
pub(crate) fn canonicalize(path: impl AsRef<Path>) -> io::Result<PathBuf> {
    pass(Call::Ask, path.as_ref(), 0)?;
    fs::canonicalize(path)
}

/// What is known of a path.
pub(crate) fn metadata(path: impl AsRef<Path>) -> io::Result<Metadata> {
    pass(Call::Ask, path.as_ref(), 0)?;
    fs::metadata(path)
}

/// Length of an open file.
pub(crate) fn length(file: &File, path: &Path) -> io::Result<u64> {
    pass(Call::Ask, path, 0)?;
    Ok(file.metadata()?.len())
}

/// The names in a folder.
pub(crate) fn read_dir(path: impl AsRef<Path>) -> io::Result<fs::ReadDir> {
    pass(Call::Ask, path.as_ref(), 0)?;
    fs::read_dir(path)
}

/// At most `most` bytes of a file.
pub(crate) fn read_up_to(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let stream = Stream::open(path)?;
    stream.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Writes a whole file, anew.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    create(path)?.write_all(bytes)
}

/// Sets the length of a file.
pub(crate) fn set_len(file: &File, path: &Path, bytes: u64) -> io::Result<()> {
    pass(Call::SetLen, path, 0)?;
    file.set_len(bytes)
}

/// Reads some of `buf` from byte `at`.
pub(crate) fn read_at(file: &File, path: &Path, buf: &mut [u8], at: u64) -> io::Result<usize> {
    let may = pass(Call::Read, path, buf.len())?;
    file.read_at(&mut buf[..may], at)
}

/// Writes some of `buf` at byte `at`.
pub(crate) fn write_at(file: &File, path: &Path, buf: &[u8], at: u64) -> io::Result<usize> {
    let may = pass(Call::Write, path, buf.len())?;
    file.write_at(&buf[..may], at)
}

/// Waits until what a file holds is on the device.
pub(crate) fn sync(file: &File, path: &Path) -> io::Result<()> {
    pass(Call::Sync, path, 0)?;
    file.sync_all()
}

/// Waits until the names in a folder are on the device.
pub(crate) fn sync_dir(path: &Path) -> io::Result<()> {
    pass(Call::Sync, path, 0)?;
    File::open(path)?.sync_all()
}

/// A file read or written in order.
#[derive(Debug)]
pub struct Stream {
    file: File,
    path: PathBuf,
}

impl Stream {
    /// A stream over an open file.
    pub(crate) fn new(file: File, path: &Path) -> Stream {
        Stream {
            file,
            path: path.to_owned(),
        }
    }

    /// Opens a file for reading.
    pub(crate) fn open(path: &Path) -> io::Result<Stream> {
        let file = open(path, File::options().read(true))?;
        Ok(Stream::new(file, path))
    }

    /// Waits until what the file holds is on the device.
    pub(crate) fn sync(&self) -> io::Result<()> {
        sync(&self.file, &self.path)
    }

    /// What is known of the file.
    pub(crate) fn metadata(&self) -> io::Result<Metadata> {
        pass(Call::Ask, &self.path, 0)?;
        self.file.metadata()
    }
}

impl Read for Stream {
    fn read(&mut self, buf: &mut [u8]) -> io::Result<usize> {
        let may = pass(Call::Read, &self.path, buf.len())?;
        self.file.read(&mut buf[..may])
    }
}

impl Write for Stream {
    fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
        let may = pass(Call::Write, &self.path, buf.len())?;
        self.file.write(&buf[..may])
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
