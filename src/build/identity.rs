//! What must be the same for a stopped build to be gone on with: the program, the options that its
//! state depends on, and the input.
//!
//! Why samples suffice: a file that was written to has another time of change or size. Samples find
//! what was replaced by another of the same size with its time set back, nearly always; and what
//! they miss the digest of the finished folder still tells.
//!
//! Memory: a sample. I/O: 64 samples of 4 KiB of each file.

use super::steps::Identity;
use crate::disk::{Counters, DataFile, fs};
use crate::error::{Error, Result};
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::Arc;
use xxhash_rust::xxh3::Xxh3;

/// Samples of a file.
const SAMPLES: u64 = 64;
/// Bytes of one.
const SAMPLE: usize = 4 << 10;

/// Adds what a file is now.
///
/// # Errors
/// [`Error::Io`].
pub fn add_file(to: &mut Identity, what: &str, path: &Path, io: &Arc<Counters>) -> Result<()> {
    let meta =
        fs::metadata(path).map_err(|e| Error::io(path, "ask its size and time of change", e))?;
    let real = fs::canonicalize(path).map_err(|e| Error::io(path, "find it", e))?;
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
