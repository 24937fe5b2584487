//! What must be the same for a stopped build to be gone on with: the program, the options that its
//! state depends on, and the input.
//!
//! Why samples suffice: a file that was written to has another time of change or size. Samples find
//! what was replaced by another of the same size with its time set back, nearly always; and what
//! they miss the digest of the finished folder still tells.
//!
//! The same is asked again when the input was read, and for arrays that are used where they lie
//! before the finished folder gets its name: what was changed meanwhile would have given a folder
//! that is right for no input.
//!
//! Memory: a sample. I/O: 64 samples of 4 KiB of each file.

use super::steps::Identity;
use crate::disk::{Counters, DataFile, fs};
use crate::error::{Error, Result};
use std::os::unix::fs::MetadataExt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// Samples of a file.
const SAMPLES: u64 = 64;
/// Bytes of one.
const SAMPLE: usize = 4 << 10;

/// The files that a build reads, by what they are to it.
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    files: Vec<(&'static str, PathBuf)>,
    first: Identity,
}

impl Inputs {
    /// What the files are now.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(files: &[(&'static str, &Path)], io: &Arc<Counters>) -> Result<Inputs> {
        let files = files.iter().map(|(what, path)| (*what, path.to_path_buf()));
        let mut inputs = Inputs {
            files: files.collect(),
            first: Identity::new(),
        };
        inputs.first = inputs.now(io)?;
        Ok(inputs)
    }

    /// What they were at first.
    pub fn identity(&self) -> &Identity {
        &self.first
    }

    fn now(&self, io: &Arc<Counters>) -> Result<Identity> {
        let mut identity = Identity::new();
        for (what, path) in &self.files {
            add_file(&mut identity, what, path, io)?;
        }
        Ok(identity)
    }

    /// Runs passes that read the files where they lie. Bytes that change under a pass may lead it
    /// anywhere, so a fault of it is told as theirs when they did.
    ///
    /// # Errors
    /// Those of the passes; [`Error::Input`] as [`check`](Inputs::check).
    pub fn blamed<T>(&self, io: &Arc<Counters>, run: impl FnOnce() -> Result<T>) -> Result<T> {
        let done = catch_unwind(AssertUnwindSafe(run));
        if let Err(_) | Ok(Err(Error::Input(_) | Error::Internal(_))) = &done
            && let Err(changed @ Error::Input(_)) = self.check(io)
        {
            return Err(changed);
        }
        done.unwrap_or_else(|panic| resume_unwind(panic))
    }

    /// Refuses files that are others than at first.
    ///
    /// # Errors
    /// [`Error::Input`], naming what differs; [`Error::Io`].
    pub fn check(&self, io: &Arc<Counters>) -> Result<()> {
        let now = self.now(io)?;
        let differs = |(key, was): &(&String, &String)| now.get(*key) != Some(*was);
        let Some((key, was)) = self.first.iter().find(differs) else {
            return Ok(());
        };
        let of = |file: &&(&str, PathBuf)| key.ends_with(file.0);
        let path = self.files.iter().find(of).map(|(_, path)| &**path);
        Err(Error::input(
            path.unwrap_or(Path::new("the input")),
            "",
            format!("{key} to be {was}, as it was when the build began"),
            now.get(key).cloned().unwrap_or_default(),
            "it was changed while it was read, so no folder was made; build it again",
        ))
    }
}

/// Adds what a file is now.
///
/// # Errors
/// [`Error::Io`].
fn add_file(to: &mut Identity, what: &str, path: &Path, io: &Arc<Counters>) -> Result<()> {
    let meta = fs::metadata(path).map_err(|e| Error::io(path, "find it", e))?;
    // A pipe by its number in /dev/fd has no path that leads to it.
    let real = if meta.is_file() {
        fs::canonicalize(path).map_err(|e| Error::io(path, "find it", e))?
    } else {
        path.to_owned()
    };
    to.insert(what.to_owned(), real.display().to_string());
    to.insert(format!("the size of {what}"), meta.len().to_string());
    let time = format!("{}.{:09}", meta.mtime(), meta.mtime_nsec());
    to.insert(format!("the time of change of {what}"), time);
    // Whatever else is asked for as a mesh is refused when it is opened.
    if meta.is_file() {
        let file = DataFile::open(path, io)?;
        let (mut sum, mut sample) = (Xxh3::new(), vec![0; SAMPLE]);
        let last = meta.len().saturating_sub(SAMPLE as u64);
        for i in 0..SAMPLES {
            let at = (u128::from(last) * u128::from(i) / u128::from(SAMPLES - 1)) as u64;
            let n = file.read_some_at(&mut sample, at)?;
            sum.update(&sample[..n]);
        }
        let digest = format!("{:016x}", sum.digest());
        to.insert(format!("the content of {what}"), digest);
    }
    Ok(())
}
