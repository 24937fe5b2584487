//! The journal: what a process writes down of its state at a moment from which another can go on.
//!
//! ```text
//!   one line of text: who wrote it, and how far it was | values in order | sum of all before
//! ```
//!
//! Why a power cut finds it whole or not at all: it is written to another name, synced, renamed,
//! and the folder is synced; every file that it names was synced before. Why it is believed only
//! when it is true: a sum covers it, and each file that it names must be as long as it was; what
//! was appended later is cut off.
//!
//! Values have neither names nor types: who reads asks in the order of who wrote, and both are of
//! the same version, which the line says.
//!
//! Memory: two buffers of 64 KiB; what is read is leased by its owner. I/O: the state once, and the
//! waiting for the device.

use super::fs::Stream;
pub use super::keep::Keep;
use super::scratch::Named;
use super::{Budget, Counters, DataFile, Scratch, ScratchFile, fs, go_on};
use crate::error::{Error, Result};
use bytemuck::Pod;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, BufWriter, ErrorKind, Read, Write};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use xxhash_rust::xxh3::Xxh3;

/// Writes a journal.
pub struct Pen {
    out: BufWriter<Stream>,
    temp: PathBuf,
    path: PathBuf,
    sum: Xxh3,
    files: Vec<Arc<Named>>,
    scratch: Scratch,
}

impl Pen {
    /// Begins a journal that will be `path`, with its line of text.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(path: &Path, scratch: &Scratch, line: &str) -> Result<Pen> {
        let temp = path.with_extension("new");
        let out = fs::create(&temp).map_err(|e| Error::io(&temp, "create it", e))?;
        let mut pen = Pen {
            out: BufWriter::with_capacity(64 << 10, out),
            temp,
            path: path.to_owned(),
            sum: Xxh3::new(),
            files: Vec::new(),
            scratch: scratch.clone(),
        };
        pen.bytes(line.as_bytes())?;
        pen.bytes(b"\n")?;
        Ok(pen)
    }

    fn bytes(&mut self, bytes: &[u8]) -> Result<()> {
        self.sum.update(bytes);
        self.out
            .write_all(bytes)
            .map_err(|e| Error::io(&self.temp, "write to it", e))
    }

    /// A number.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn number(&mut self, number: u64) -> Result<()> {
        self.bytes(&number.to_le_bytes())
    }

    /// Plain values, with their number.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn list<T: Pod>(&mut self, items: &[T]) -> Result<()> {
        go_on()?;
        self.number(items.len() as u64)?;
        self.bytes(bytemuck::cast_slice(items))
    }

    /// Words that threads share, as a list of plain ones.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn words(&mut self, words: &[AtomicU64]) -> Result<()> {
        go_on()?;
        self.number(words.len() as u64)?;
        let mut each = words.iter().map(|word| word.load(Ordering::Relaxed));
        each.try_for_each(|word| self.number(word))
    }

    /// Text.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn text(&mut self, text: &str) -> Result<()> {
        self.list(text.as_bytes())
    }

    /// The path of a file that exists, in full.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn path(&mut self, path: &Path) -> Result<()> {
        let full = fs::canonicalize(path).map_err(|e| Error::io(path, "find it", e))?;
        self.list(full.as_os_str().as_bytes())
    }

    /// A scratch file, which is synced, and kept as it is while this journal is in force.
    ///
    /// # Errors
    /// [`Error::Internal`] for one without a name, [`Error::Io`].
    pub fn file(&mut self, file: &ScratchFile) -> Result<()> {
        let named = file.named()?;
        file.data().sync()?;
        self.path(named.path())?;
        let real = file.data().len()?;
        for number in [file.len(), file.held(), real] {
            self.number(number)?;
        }
        self.files.push(Arc::clone(named));
        Ok(())
    }

    /// Puts the journal in force: the files that it names are kept from now on, and those of the one
    /// before no longer.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<()> {
        let sum = self.sum.digest().to_le_bytes();
        let at = |e| Error::io(&self.temp, "write and sync it", e);
        self.out.write_all(&sum).map_err(at)?;
        self.out.flush().map_err(at)?;
        self.out.get_ref().sync().map_err(at)?;
        self.scratch.sync_dirs()?;
        // Before the journal names them, and not only once it is certain to be in force; those of
        // the one before stay until then.
        let before = self.scratch.pinned_now();
        let both = before.iter().chain(&self.files).map(Arc::clone).collect();
        self.scratch.pin(both);
        if let Err(e) = fs::rename(&self.temp, &self.path) {
            self.scratch.pin(before);
            return Err(Error::io(&self.path, "put the journal in its place", e));
        }
        let dir = self.path.parent().unwrap_or(Path::new("."));
        // The folder may be as new as the journal.
        let above = dir.join("..");
        for dir in [dir, &above] {
            fs::sync_dir(dir).map_err(|e| Error::io(dir, "sync the folder", e))?;
        }
        self.scratch.pin(self.files);
        Ok(())
    }
}

/// Reads a journal.
pub struct Reader {
    input: BufReader<Stream>,
    path: PathBuf,
    line: String,
    files: Vec<Arc<Named>>,
    stay: Vec<OsString>,
    /// The memory to draw from.
    pub budget: Budget,
    /// Where scratch files go.
    pub scratch: Scratch,
    /// The counters.
    pub io: Arc<Counters>,
    /// The folder of files that are no scratch.
    pub dir: PathBuf,
}

impl Reader {
    /// Opens the journal at `path`.
    ///
    /// # Errors
    /// [`Error::Input`] when it is damaged, [`Error::Io`].
    pub fn open(
        path: &Path,
        (budget, scratch): (&Budget, &Scratch),
        io: &Arc<Counters>,
        dir: &Path,
    ) -> Result<Reader> {
        check_sum(path)?;
        let file = Stream::open(path).map_err(|e| Error::io(path, "open it for reading", e))?;
        let mut input = BufReader::with_capacity(64 << 10, file);
        let mut line = String::new();
        input
            .read_line(&mut line)
            .map_err(|e| Error::io(path, "read its first line", e))?;
        Ok(Reader {
            input,
            path: path.to_owned(),
            line,
            files: Vec::new(),
            stay: Vec::new(),
            budget: budget.clone(),
            scratch: scratch.clone(),
            io: Arc::clone(io),
            dir: dir.to_owned(),
        })
    }

    /// The line of text.
    pub fn line(&self) -> &str {
        self.line.trim_end()
    }

    fn fill(&mut self, into: &mut [u8]) -> Result<()> {
        self.input
            .read_exact(into)
            .map_err(|e| Error::io(&self.path, format!("read {} bytes", into.len()), e))
    }

    /// A number.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn number(&mut self) -> Result<u64> {
        let mut bytes = [0; 8];
        self.fill(&mut bytes)?;
        Ok(u64::from_le_bytes(bytes))
    }

    /// Plain values. The caller has leased, or will, what they take.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn list<T: Pod>(&mut self) -> Result<Vec<T>> {
        let count = self.number()?;
        let have = fs::metadata(&self.path)
            .map_err(|e| Error::io(&self.path, "ask its length", e))?
            .len();
        if count.saturating_mul(size_of::<T>() as u64) > have {
            return Err(Error::Internal(format!(
                "{}: a list of {count} values, longer than the journal",
                self.path.display()
            )));
        }
        let mut items = vec![T::zeroed(); count as usize];
        self.fill(bytemuck::cast_slice_mut(&mut items))?;
        Ok(items)
    }

    /// Words that threads share. The caller has leased them.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn words(&mut self) -> Result<Vec<AtomicU64>> {
        Ok(self.list()?.into_iter().map(AtomicU64::new).collect())
    }

    /// Text.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn text(&mut self) -> Result<String> {
        let bytes = self.list::<u8>()?;
        String::from_utf8(bytes).map_err(|_| Error::Internal("a journal that is no text".into()))
    }

    /// A path.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn path(&mut self) -> Result<PathBuf> {
        Ok(PathBuf::from(OsString::from_vec(self.list()?)))
    }

    /// A scratch file as it was.
    ///
    /// # Errors
    /// [`Error::Input`] when it is shorter than it was, [`Error::Io`].
    pub fn file(&mut self) -> Result<ScratchFile> {
        let path = self.path()?;
        let [len, held, real] = [self.number()?, self.number()?, self.number()?];
        let data = DataFile::open_rw(&path, &self.io)?;
        check_length(&data, real)?;
        data.set_len(real)?;
        let file = self.scratch.adopt(data, &path, len, held)?;
        self.files.push(Arc::clone(file.named()?));
        Ok(file)
    }

    /// The file of this name in the folder stays.
    pub fn stays(&mut self, name: impl Into<OsString>) {
        self.stay.push(name.into());
    }

    /// Ends the reading: the files that were read stay kept as they are, and every other file in
    /// the scratch folders and in the folder goes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(self) -> Result<()> {
        let names: Vec<&Path> = self.files.iter().map(|named| named.path()).collect();
        self.scratch.sweep(&names)?;
        for entry in fs::read_dir(&self.dir)
            .map_err(|e| Error::io(&self.dir, "list it", e))?
            .flatten()
        {
            if !self.stay.contains(&entry.file_name()) {
                let path = entry.path();
                fs::remove_file(&path).map_err(|e| Error::io(&path, "remove it", e))?;
            }
        }
        self.scratch.pin(self.files);
        Ok(())
    }
}

/// Refuses a file that is shorter than it was.
///
/// # Errors
/// [`Error::Input`], [`Error::Io`].
pub fn check_length(file: &DataFile, expected: u64) -> Result<()> {
    let have = file.len()?;
    if have < expected {
        return Err(Error::input(
            file.path(),
            "",
            format!("the {expected} bytes that the journal knows"),
            format!("{have}"),
            "what was stopped cannot be gone on with; --force begins anew",
        ));
    }
    Ok(())
}

/// Refuses a journal whose last eight bytes are not the sum of the others.
fn check_sum(path: &Path) -> Result<()> {
    let at = |e| Error::io(path, "read it", e);
    let mut file = Stream::open(path).map_err(at)?;
    let mut left = file.metadata().map_err(at)?.len().saturating_sub(8);
    let (mut sum, mut block) = (Xxh3::new(), vec![0; 64 << 10]);
    while left > 0 {
        let n = left.min(block.len() as u64) as usize;
        file.read_exact(&mut block[..n]).map_err(at)?;
        sum.update(&block[..n]);
        left -= n as u64;
    }
    let mut end = [0; 8];
    let whole = match file.read_exact(&mut end) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => false,
        done => done.map(|()| true).map_err(at)?,
    };
    if whole && u64::from_le_bytes(end) == sum.digest() {
        return Ok(());
    }
    Err(Error::input(
        path,
        "",
        "the journal of a build that was stopped",
        "a file that is damaged",
        "it cannot be gone on with; --force begins anew",
    ))
}
