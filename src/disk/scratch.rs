//! Scratch space: temporary files, spread over the folders that the user named, counted
//! against a limit, gone when dropped.
//!
//! The files have no name once they are open (they are unlinked at once), so a killed
//! process leaves nothing behind. Where a process keeps a [journal](super::journal) they have names,
//! and those that the journal in force names are *pinned*: neither freed nor removed before the
//! next one is in force, since a killed process is gone on with from them.
//!
//! What counts is what was written: a range that is only reserved is a hole in the file, and a
//! range that is freed becomes one again, where the file system knows holes.

use super::{Counters, DataFile, fs};
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

#[derive(Debug)]
struct Inner {
    dirs: Vec<PathBuf>,
    next: AtomicUsize,
    limit: u64,
    used: AtomicU64,
    peak: AtomicU64,
    io: Arc<Counters>,
    /// The journal, where files have names.
    journal: Option<PathBuf>,
    pinned: Mutex<Vec<Arc<Named>>>,
    /// Held by the thread that gives the journal up.
    giving_up: Mutex<()>,
    /// How often that was done.
    given_up: AtomicU64,
}

/// The name of a scratch file, and what became of it.
#[derive(Debug)]
pub(super) struct Named {
    path: PathBuf,
    fate: Mutex<Fate>,
}

#[derive(Debug, Default)]
struct Fate {
    pinned: bool,
    /// Bytes that it held when it was dropped.
    dropped: Option<u64>,
}

impl Named {
    fn new(path: &Path) -> Arc<Named> {
        Arc::new(Named {
            path: path.to_owned(),
            fate: Mutex::default(),
        })
    }

    /// Its path.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    fn fate(&self) -> MutexGuard<'_, Fate> {
        self.fate.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Where temporary files go. Clones share the limit and the counters.
#[derive(Clone, Debug)]
pub struct Scratch(Arc<Inner>);

/// A temporary file; what was written to it counts against the scratch limit until it is freed
/// again, or the file dropped.
#[derive(Debug)]
pub struct ScratchFile {
    data: DataFile,
    /// End of what was appended, written or reserved.
    len: AtomicU64,
    /// Bytes that count.
    held: AtomicU64,
    scratch: Scratch,
    named: Option<Arc<Named>>,
}

/// Reserved ranges begin and end at multiples of this: what file systems allocate and free.
const PAGE: u64 = 4 << 10;

impl Scratch {
    /// Scratch space in `dirs` (at least one), at most `limit` bytes at a time.
    ///
    /// # Errors
    /// [`Error::Usage`] when `dirs` is empty.
    pub fn new(dirs: &[PathBuf], limit: u64, io: &Arc<Counters>) -> Result<Scratch> {
        Scratch::with(dirs, limit, io, None)
    }

    /// The same with files that have names, for a process that keeps its journal at `journal`.
    ///
    /// # Errors
    /// [`Error::Usage`] when `dirs` is empty, [`Error::Io`] when one cannot be found.
    pub fn named(
        dirs: &[PathBuf],
        limit: u64,
        io: &Arc<Counters>,
        journal: &Path,
    ) -> Result<Scratch> {
        // One spelling of each name, whatever folder a later process is started in: what is kept is
        // told from what is swept by its path.
        let real = |dir: &PathBuf| fs::canonicalize(dir).map_err(|e| Error::io(dir, "find it", e));
        let dirs = dirs.iter().map(real).collect::<Result<Vec<PathBuf>>>()?;
        Scratch::with(&dirs, limit, io, Some(journal.to_owned()))
    }

    fn with(
        dirs: &[PathBuf],
        limit: u64,
        io: &Arc<Counters>,
        journal: Option<PathBuf>,
    ) -> Result<Scratch> {
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
            journal,
            pinned: Mutex::default(),
            giving_up: Mutex::default(),
            given_up: AtomicU64::new(0),
        })))
    }

    /// A new empty temporary file, in the next folder by turns.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder.
    pub fn file(&self, what: &str) -> Result<ScratchFile> {
        let turn = self.0.next.fetch_add(1, Ordering::Relaxed);
        let dir = &self.0.dirs[turn % self.0.dirs.len()];
        let failed = |e| Error::io(dir, format!("create a temporary file for {what} there"), e);
        if self.0.journal.is_none() {
            let file = fs::create_nameless(dir).map_err(failed)?;
            let name = dir.join(format!("(temporary: {what})"));
            return Ok(self.around(DataFile::from_file(file, &name, &self.0.io), None));
        }
        let readable = what.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
        let prefix = format!("{turn:06}-{readable}-");
        let (file, path) = fs::create_named(dir, &prefix).map_err(failed)?;
        let data = DataFile::from_file(file, &path, &self.0.io);
        Ok(self.around(data, Some(Named::new(&path))))
    }

    fn around(&self, data: DataFile, named: Option<Arc<Named>>) -> ScratchFile {
        ScratchFile {
            data,
            len: AtomicU64::new(0),
            held: AtomicU64::new(0),
            scratch: self.clone(),
            named,
        }
    }

    /// Takes over a file that another process left.
    pub(super) fn adopt(
        &self,
        data: DataFile,
        path: &Path,
        len: u64,
        held: u64,
    ) -> Result<ScratchFile> {
        let file = self.around(data, Some(Named::new(path)));
        *file.named()?.fate() = Fate {
            pinned: true,
            dropped: None,
        };
        file.len.store(len, Ordering::Relaxed);
        file.grow(held)?;
        Ok(file)
    }

    /// Pins these files, and no others.
    pub(super) fn pin(&self, files: Vec<Arc<Named>>) {
        files.iter().for_each(|named| named.fate().pinned = true);
        let before = std::mem::replace(&mut *self.pinned(), files);
        let now = self.pinned();
        let still = |named: &Arc<Named>| now.iter().any(|other| Arc::ptr_eq(named, other));
        for named in before.iter().filter(|named| !still(named)) {
            let mut fate = named.fate();
            fate.pinned = false;
            // Taken: a file that is pinned twice is given back once.
            if let Some(held) = fate.dropped.take() {
                // Best effort: what stays is removed with its folder.
                let _ = fs::remove_file(&named.path);
                self.0.used.fetch_sub(held, Ordering::Relaxed);
            }
        }
    }

    fn pinned(&self) -> MutexGuard<'_, Vec<Arc<Named>>> {
        self.0.pinned.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The files that are pinned now.
    pub(super) fn pinned_now(&self) -> Vec<Arc<Named>> {
        self.pinned().clone()
    }

    /// Gives up going on from the journal in force: it is removed, and its files are pinned no
    /// longer.
    ///
    /// # Errors
    /// [`Error::Io`]; the files stay pinned.
    pub(crate) fn forget(&self) -> Result<()> {
        if let Some(journal) = &self.0.journal {
            // The journal first: it must not outlive what it names.
            match fs::remove_file(journal) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::io(journal, "remove it", e));
                }
                _ => {}
            }
            let dir = journal.parent().unwrap_or(Path::new("."));
            fs::sync_dir(dir).map_err(|e| Error::io(dir, "sync the folder", e))?;
            self.pin(Vec::new());
        }
        Ok(())
    }

    /// Gives up going on from the journal, for the space that it takes. False when none does.
    pub(crate) fn give_up(&self) -> bool {
        let before = self.0.given_up.load(Ordering::Relaxed);
        let _one = self
            .0
            .giving_up
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if self.0.given_up.load(Ordering::Relaxed) != before {
            // Another thread has, while this one waited.
            return true;
        }
        let waits = |named: &Arc<Named>| named.fate().dropped.is_some();
        let any = self.pinned().iter().any(waits);
        let gave_up = any && self.forget().is_ok();
        if gave_up {
            self.0.given_up.fetch_add(1, Ordering::Relaxed);
        }
        gave_up
    }

    /// Makes the names of the files durable.
    pub(super) fn sync_dirs(&self) -> Result<()> {
        self.0
            .dirs
            .iter()
            .try_for_each(|dir| fs::sync_dir(dir).map_err(|e| Error::io(dir, "sync the folder", e)))
    }

    /// Removes all files of the folders but these. Only for folders that are the process's own.
    pub(super) fn sweep(&self, stay: &[&Path]) -> Result<()> {
        for dir in &self.0.dirs {
            let list = fs::read_dir(dir).map_err(|e| Error::io(dir, "list it", e))?;
            for path in list.flatten().map(|entry| entry.path()) {
                if path.is_file()
                    && path.file_name() != Some("lock".as_ref())
                    && !stay.contains(&&*path)
                {
                    fs::remove_file(&path).map_err(|e| Error::io(&path, "remove it", e))?;
                }
            }
        }
        Ok(())
    }

    /// Bytes in use now.
    pub fn used(&self) -> u64 {
        self.0.used.load(Ordering::Relaxed)
    }

    /// The most bytes that were in use at once.
    pub fn peak(&self) -> u64 {
        self.0.peak.load(Ordering::Relaxed)
    }

    /// The most bytes that may be in use at once.
    pub fn limit(&self) -> u64 {
        self.0.limit
    }

    /// The folders.
    pub fn dirs(&self) -> &[PathBuf] {
        &self.0.dirs
    }

    /// The first folder, for messages and free-space questions.
    pub fn first_dir(&self) -> &Path {
        &self.0.dirs[0]
    }

    fn grow(&self, bytes: u64) -> Result<()> {
        let used = self.0.used.fetch_add(bytes, Ordering::Relaxed) + bytes;
        if used > self.0.limit {
            self.0.used.fetch_sub(bytes, Ordering::Relaxed);
            if self.give_up() {
                return self.grow(bytes);
            }
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
        self.grow(buf.len() as u64)?;
        let at = self.len.fetch_add(buf.len() as u64, Ordering::Relaxed);
        self.put(buf, at)?;
        Ok(at)
    }

    /// Writes `buf` at byte `at`, growing the file when it lies beyond the end.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn write_at(&self, buf: &[u8], at: u64) -> Result<()> {
        let end = at + buf.len() as u64;
        let before = self.len.fetch_max(end, Ordering::Relaxed);
        self.grow(end.saturating_sub(before))?;
        self.put(buf, at)
    }

    /// Sets `bytes` aside behind all else and returns the offset where they begin. They take no
    /// space, and count nothing, before [`fill`](ScratchFile::fill) writes them.
    pub fn reserve(&self, bytes: u64) -> u64 {
        let bytes = bytes.next_multiple_of(PAGE);
        self.len.fetch_add(bytes, Ordering::Relaxed)
    }

    /// Writes `buf` at byte `at` of a reserved range, for the first time.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn fill(&self, buf: &[u8], at: u64) -> Result<()> {
        self.grow(buf.len() as u64)?;
        self.put(buf, at)
    }

    /// Writes; on a full disk what only a journal keeps is given up for it.
    fn put(&self, buf: &[u8], at: u64) -> Result<()> {
        loop {
            match self.data.write_at(buf, at) {
                Err(e) if e.is_no_space() && self.scratch.give_up() => {}
                done => return done,
            }
        }
    }

    /// Frees the whole pages of an appended file from byte `from`, which begins one, up to byte `to`;
    /// gives how many bytes those are, as long as they can be freed: see [`free`](ScratchFile::free).
    pub fn free_before(&self, from: u64, to: u64) -> u64 {
        let bytes = (to - from) / PAGE * PAGE;
        if bytes > 0 && self.free(from, bytes) {
            bytes
        } else {
            0
        }
    }

    /// Frees the first `bytes` of the reserved range at byte `at`, which were filled. False when
    /// the file system does not free parts of files, or this one is pinned: they count until the
    /// file is dropped.
    pub fn free(&self, at: u64, bytes: u64) -> bool {
        if self.is_kept() {
            return false;
        }
        let freed = self.data.punch(at, bytes.next_multiple_of(PAGE));
        if freed {
            self.held.fetch_sub(bytes, Ordering::Relaxed);
            self.scratch.0.used.fetch_sub(bytes, Ordering::Relaxed);
        }
        freed
    }

    /// True when the journal in force keeps it as it is: what is in it must not be changed.
    pub fn is_kept(&self) -> bool {
        let pinned = |named: &Arc<Named>| named.fate().pinned;
        self.named.as_ref().is_some_and(pinned)
    }

    fn grow(&self, bytes: u64) -> Result<()> {
        self.scratch.grow(bytes)?;
        self.held.fetch_add(bytes, Ordering::Relaxed);
        Ok(())
    }

    /// Fills `buf` from byte `at`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read_at(&self, buf: &mut [u8], at: u64) -> Result<()> {
        self.data.read_at(buf, at)
    }

    /// So many bytes from byte `at` will be read soon.
    pub fn expect(&self, at: u64, bytes: u64) {
        self.data.expect(at..at + bytes);
    }

    /// End of what was appended, written or reserved so far.
    pub fn len(&self) -> u64 {
        self.len.load(Ordering::Relaxed)
    }

    pub(super) fn held(&self) -> u64 {
        self.held.load(Ordering::Relaxed)
    }

    pub(super) fn named(&self) -> Result<&Arc<Named>> {
        let none = || Error::Internal("a scratch file without a name is to be kept".into());
        self.named.as_ref().ok_or_else(none)
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
        let held = *self.held.get_mut();
        if let Some(named) = &self.named {
            let mut fate = named.fate();
            if fate.pinned {
                fate.dropped = Some(held);
                return;
            }
            // Best effort: what stays is removed with its folder.
            let _ = fs::remove_file(&named.path);
        }
        self.scratch.0.used.fetch_sub(held, Ordering::Relaxed);
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

    #[test]
    fn frees_ranges_and_their_blocks() {
        use std::os::unix::fs::MetadataExt;
        let dir = tempfile::tempdir().unwrap();
        let io = Arc::new(Counters::default());
        let scratch = Scratch::new(&[dir.path().to_owned()], 1 << 20, &io).unwrap();
        let file = scratch.file("test").unwrap();
        let blocks = || file.data().raw().metadata().unwrap().blocks();
        // A range that is reserved and not filled costs nothing.
        let runs = [100_000, 5000, 1 << 30].map(|bytes| file.reserve(bytes));
        assert_eq!((runs, scratch.used()), ([0, 102_400, 110_592], 0));
        file.fill(&[1; 100_000], runs[0]).unwrap();
        file.fill(&[2; 4000], runs[1]).unwrap();
        file.fill(&[3; 10], runs[2]).unwrap();
        assert!(file.fill(&[0; 1 << 20], runs[2] + 10).is_err());
        assert_eq!(scratch.used(), 104_010);
        let before = blocks();
        if file.free(runs[0], 100_000) {
            assert_eq!(scratch.used(), 4010);
            assert!(blocks() + 100_000 / 512 <= before);
        }
        let mut back = [0; 4000];
        file.read_at(&mut back, runs[1]).unwrap();
        assert_eq!(back, [2; 4000]);
        drop(file);
        assert_eq!((scratch.used(), scratch.peak()), (0, 104_010));
    }
}
