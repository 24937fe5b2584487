//! Locks that tell the living from the dead: whoever holds one has it until its process ends,
//! however it ends.
//!
//! Why that works: the system takes the lock of a file (`flock`) back when the last descriptor of
//! it is closed, and closes all descriptors of a process that was killed. So what can be locked
//! belongs to nobody who lives. Between making a file and locking it another process may take it
//! for dead and remove it; so whoever has locked looks whether its file still has its name, and
//! else begins again.
//!
//! Why nothing of others is taken for dead: a lock begins with a mark before anything else is in its
//! folder. A folder with something in it whose lock bears no mark is somebody's.
//!
//! Memory: a descriptor. I/O: a few bytes.

use super::fs::{self, Stream};
use super::left::gone;
use super::stop::Fleeting;
use crate::error::{Error, Result};
use rustix::fs::{FlockOperation, OFlags, flock};
use std::fs::{File, Metadata};
use std::io::{Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// The name of the lock in a folder that has one.
const NAME: &str = "lock";
/// What a lock begins with; the number of its process follows.
const MARK: &str = "cornermill ";
/// The most bytes of that line.
const MOST_LINE: u64 = 64;
/// Files and folders that live as long as a command begin with this.
pub const PREFIX: &str = ".cornermill-";
/// Files that will get another name end with this.
pub const SUFFIX: &str = ".tmp";

/// A lock that is held until it is dropped.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

/// What came of trying to take a lock.
#[derive(Debug)]
pub enum Tried {
    /// It is ours.
    Taken(Lock),
    /// It is held, by the process of this number if it said so.
    Held(Option<u32>),
}

impl Lock {
    /// Tries to take the lock of the folder `dir`, which is made when it does not exist.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn of_folder(dir: &Path) -> Result<Tried> {
        loop {
            match fs::create_dir(dir) {
                Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => {
                    return Err(Error::io(dir, "create the folder", e));
                }
                Err(_) => check_ours(dir)?,
                Ok(()) => {}
            }
            let path = dir.join(NAME);
            let mut options = File::options();
            options.read(true).write(true).create(true).truncate(false);
            let file = match open_plain(&path, &mut options) {
                Ok(file) => file,
                // Whoever took it for dead has removed the folder meanwhile.
                Err(e) if e.kind() == std::io::ErrorKind::NotFound && !dir.exists() => continue,
                Err(e) => {
                    // Only an empty folder goes.
                    remove_empty(dir);
                    return Err(Error::io(&path, "open the lock", e));
                }
            };
            if try_lock(&file, &path)? == Some(false) {
                let holder = fs::read_up_to(&path, MOST_LINE).ok();
                let number = holder.and_then(|line| {
                    let line = String::from_utf8(line).ok()?;
                    line.strip_prefix(MARK)?.trim().parse().ok()
                });
                return Ok(Tried::Held(number));
            }
            if !is_named(&file, &path) {
                continue;
            }
            if let Err(e) = sign(&file, &path) {
                // Nothing else is in a folder that was made just now.
                if !fs::read_dir(dir).is_ok_and(others) {
                    gone(&path, fs::remove_file(&path));
                    remove_empty(dir);
                }
                return Err(Error::io(&path, "write to the lock", e));
            }
            return Ok(Tried::Taken(Lock { _file: file }));
        }
    }
}

/// Writes the mark and the number of this process into its lock, over what was there: the mark of
/// a folder that is taken over must not be lost to a full disk. It is on the device before anything
/// that a power cut may leave beside it.
fn sign(file: &File, path: &Path) -> std::io::Result<()> {
    let line = format!("{MARK}{}\n", std::process::id());
    let mut stream = Stream::new(file.try_clone()?, path);
    stream.write_all(line.as_bytes())?;
    fs::set_len(file, path, line.len() as u64)?;
    stream.sync()
}

/// Refuses to take a folder that is not one of these: a link, a file, or a folder of somebody's.
fn check_ours(dir: &Path) -> Result<()> {
    let folder = dir.symlink_metadata().map_or(true, |meta| meta.is_dir());
    // Whoever had it may be removing it: the second look finds nothing.
    if folder && (is_ours(dir) || is_ours(dir)) {
        return Ok(());
    }
    let what = "is in the way of a working folder of that name: it has no lock that says that it is \
                one; rename or remove it";
    Err(Error::Usage(format!("{} {what}", dir.display())))
}

/// Whether there is something in a folder besides a lock.
fn others(list: std::fs::ReadDir) -> bool {
    list.flatten().any(|entry| entry.file_name() != NAME)
}

/// Whether a folder is empty, but for a lock perhaps, or has a lock that bears the mark.
fn is_ours(dir: &Path) -> bool {
    // The list first: a process that makes the folder just now marks the lock before all else.
    let empty = !fs::read_dir(dir).is_ok_and(others);
    let mark = || {
        let mut mark = [0; MARK.len()];
        let file = open_plain(&dir.join(NAME), File::options().read(true));
        file.is_ok_and(|mut file| file.read_exact(&mut mark).is_ok()) && mark == MARK.as_bytes()
    };
    empty || mark()
}

/// Opens a regular file: a link is not followed, and a pipe not waited for.
fn open_plain(path: &Path, options: &mut std::fs::OpenOptions) -> std::io::Result<File> {
    let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK;
    let file = fs::open(path, options.custom_flags(flags.bits() as i32))?;
    match file.metadata()?.is_file() {
        true => Ok(file),
        false => Err(std::io::Error::other("no regular file")),
    }
}

/// Locks a file: true when it is ours, false when another process has it; `None` where the file
/// system has no locks.
fn try_lock(file: &File, path: &Path) -> Result<Option<bool>> {
    use rustix::io::Errno;
    match flock(file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(Some(true)),
        Err(Errno::WOULDBLOCK) => Ok(Some(false)),
        Err(Errno::NOSYS | Errno::OPNOTSUPP | Errno::NOLCK) => Ok(None),
        Err(e) => Err(Error::io(path, "lock it", e.into())),
    }
}

/// Removes a folder whose lock is held by this process; true when it is gone. The lock goes last,
/// so that nobody takes the folder while it is emptied, and only when all else is gone: what stays
/// is recognised by the next run there, and [told](super::left_behind).
pub fn discard(dir: &Path) -> bool {
    let entries = match fs::read_dir(dir) {
        Ok(entries) => entries,
        Err(e) => return gone(dir, Err(e)),
    };
    let mut emptied = true;
    for entry in entries.flatten().filter(|entry| entry.file_name() != NAME) {
        let path = entry.path();
        let done = match entry.file_type() {
            Ok(kind) if kind.is_dir() => fs::remove_dir_all(&path),
            _ => fs::remove_file(&path),
        };
        emptied &= gone(&path, done);
    }
    let lock = dir.join(NAME);
    emptied && gone(&lock, fs::remove_file(&lock)) && remove_empty(dir)
}

/// Removes a folder that is empty, if it still is; true when it is gone.
fn remove_empty(dir: &Path) -> bool {
    match fs::remove_dir(dir) {
        // Another process has taken it meanwhile.
        Err(e) if e.kind() == std::io::ErrorKind::DirectoryNotEmpty => false,
        done => gone(dir, done),
    }
}

/// Removes a folder of a dead process; true when it is gone.
pub fn discard_dead(dir: &Path) -> bool {
    sweep_folder(dir)
}

/// True when `path` still names this file.
fn is_named(file: &File, path: &Path) -> bool {
    let of = |meta: Metadata| (meta.dev(), meta.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(own), Ok(named)) => of(own) == of(named),
        _ => false,
    }
}

/// Locks a temporary file that was just made; false when it was taken for dead meanwhile.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn claim(file: &File, path: &Path) -> Result<bool> {
    Ok(try_lock(file, path)? != Some(false) && is_named(file, path))
}

/// A folder that lives as long as a command; removed on drop.
#[derive(Debug)]
pub struct TempFolder {
    path: PathBuf,
    _lock: Lock,
    _fleeting: Fleeting,
}

impl TempFolder {
    /// Makes one in `dir`, and removes what dead processes left of theirs there.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(dir: &Path, what: &str) -> Result<TempFolder> {
        sweep(dir);
        let prefix = format!("{PREFIX}{what}-");
        loop {
            let path = fs::create_temporary_dir(dir, &prefix)
                .map_err(|e| Error::io(dir, "make a folder there", e))?
                .keep();
            let fleeting = Fleeting::new(&path);
            match Lock::of_folder(&path) {
                Ok(Tried::Taken(lock)) => {
                    return Ok(TempFolder {
                        path,
                        _lock: lock,
                        _fleeting: fleeting,
                    });
                }
                Ok(Tried::Held(_)) => {}
                Err(e) => {
                    gone(&path, fs::remove_dir_all(&path));
                    return Err(e);
                }
            }
        }
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for TempFolder {
    fn drop(&mut self) {
        discard(&self.path);
    }
}

/// Removes temporary files and folders of dead processes from `dir`. What cannot be looked at or
/// removed stays: it is in nobody's way.
pub fn sweep(dir: &Path) {
    let Ok(entries) = fs::read_dir(dir) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        if !name.to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        // The type of the entry itself: a link is never followed.
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => {
                sweep_folder(&entry.path());
            }
            Ok(kind) if kind.is_file() && name.to_string_lossy().ends_with(SUFFIX) => {
                sweep_file(&entry.path());
            }
            _ => {}
        }
    }
}

fn sweep_file(path: &Path) {
    let Ok(file) = open_plain(path, File::options().read(true)) else {
        return;
    };
    if matches!(try_lock(&file, path), Ok(Some(true))) && is_named(&file, path) {
        gone(path, fs::remove_file(path));
    }
}

fn sweep_folder(dir: &Path) -> bool {
    let path = dir.join(NAME);
    if !is_ours(dir) {
        return false;
    }
    let Ok(file) = open_plain(&path, File::options().read(true)) else {
        // Just made, or nearly removed: only an empty folder goes.
        return remove_empty(dir);
    };
    matches!(try_lock(&file, &path), Ok(Some(true))) && is_named(&file, &path) && discard(dir)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_living_keep_what_is_theirs() {
        let dir = tempfile::tempdir().unwrap();
        let alive = TempFolder::new(dir.path(), "test").unwrap();
        let dead = dir.path().join(".cornermill-test-dead");
        fs::create_dir(&dead).unwrap();
        let foreign = dir.path().join(".cornermill-test-foreign");
        fs::create_dir(&foreign).unwrap();
        for (folder, lock) in [(&dead, "cornermill 1\n"), (&foreign, "1\n")] {
            fs::write(folder.join("lock"), lock).unwrap();
            fs::write(folder.join("data"), "1\n").unwrap();
        }
        let empty = dir.path().join(".cornermill-empty");
        fs::create_dir(&empty).unwrap();
        // Neither names nor kinds that are not ours.
        let others = [".cornermill-notes", "a.tmp", ".cornermill"].map(|n| dir.path().join(n));
        others.iter().for_each(|path| fs::write(path, "").unwrap());
        let file = dir.path().join(".cornermill-x.tmp");
        fs::write(&file, "").unwrap();
        let held = File::open(&file).unwrap();
        assert!(claim(&held, &file).unwrap());
        sweep(dir.path());
        assert!(alive.path().join("lock").is_file());
        assert!(!dead.exists() && !empty.exists() && file.exists());
        // A lock that somebody else has made, in a folder of such a name.
        assert!(foreign.join("data").is_file());
        assert!(Lock::of_folder(&foreign).is_err());
        assert!(others.iter().all(|path| path.exists()));
        drop(held);
        sweep(dir.path());
        assert!(!file.exists());
        let path = alive.path().to_owned();
        let own = std::process::id();
        assert!(matches!(Lock::of_folder(&path).unwrap(), Tried::Held(Some(pid)) if pid == own));
        drop(alive);
        assert!(!path.exists());
    }
}
