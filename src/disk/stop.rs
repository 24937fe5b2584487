//! The wish to stop, and what must not be left behind when a process ends without unwinding.
//!
//! Why a flag for the whole process: a signal is sent to the process, and every read, write and
//! window of every workspace looks at the flag, so each pass ends with
//! [`Error::Interrupted`](crate::Error::Interrupted) within the time of a block, on every thread.
//!
//! Why a list: whoever cannot wait for the passes ends the process at once, and then no
//! destructor runs. What only a destructor would remove is named here while it exists.
//!
//! Memory: a path for each temporary file or folder that exists. I/O: none.

use super::fs;
use super::lock::discard;
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Mutex, MutexGuard};

/// The signal that asked to stop; 0 while none has.
static SIGNAL: AtomicI32 = AtomicI32::new(0);
/// Temporary files and folders of this process, each with the file beside which it is kept.
static FLEETING: Mutex<Vec<(PathBuf, PathBuf)>> = Mutex::new(Vec::new());

/// Makes every read, write and window from now on fail with [`Error::Interrupted`].
pub fn interrupt(signal: i32) {
    SIGNAL.store(signal, Ordering::Relaxed);
}

/// Whether to go on.
///
/// # Errors
/// [`Error::Interrupted`] once [`interrupt`] was called.
#[inline]
pub fn go_on() -> Result<()> {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => Ok(()),
        signal => Err(Error::Interrupted { signal }),
    }
}

fn list() -> MutexGuard<'static, Vec<(PathBuf, PathBuf)>> {
    FLEETING.lock().unwrap_or_else(|e| e.into_inner())
}

/// Names a file or folder of the process on the list for as long as this lives.
#[derive(Debug)]
pub struct Fleeting(PathBuf);

impl Fleeting {
    /// Names `path`.
    pub fn new(path: &Path) -> Fleeting {
        Fleeting::unless(path, Path::new(""))
    }

    /// Names `path`, which stays if there is a file `kept`.
    pub fn unless(path: &Path, kept: &Path) -> Fleeting {
        list().push((path.to_owned(), kept.to_owned()));
        Fleeting(path.to_owned())
    }
}

impl Drop for Fleeting {
    fn drop(&mut self) {
        let mut list = list();
        if let Some(at) = list.iter().position(|(path, _)| *path == self.0) {
            list.swap_remove(at);
        }
    }
}

/// Removes what is on the list, for a process that ends at once.
pub fn remove_fleeting() {
    for (path, kept) in list().drain(..) {
        if kept.is_file() {
            continue;
        }
        // Best effort: what stays is recognised by the next run there.
        if fs::remove_file(&path).is_err() {
            discard(&path);
        }
    }
}
