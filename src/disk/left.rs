//! What could not be removed, so that whoever runs a command can say it.
//!
//! Why a list for the whole process: what cleans up are destructors and ends of commands that have
//! their outcome already, which a folder that stays behind does not change. It is in nobody's way:
//! the next run there removes it.
//!
//! Memory: so many paths as are kept. I/O: none.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The most that are kept; more say nothing new.
const MOST: usize = 8;

static LEFT: Mutex<Vec<(PathBuf, io::Error)>> = Mutex::new(Vec::new());

/// Keeps what came of removing a file or folder; true when it is gone, whoever did it.
pub(super) fn gone(path: &Path, done: io::Result<()>) -> bool {
    match done {
        Ok(()) => true,
        Err(e) if e.kind() == ErrorKind::NotFound => true,
        Err(e) => {
            let mut left = LEFT.lock().unwrap_or_else(|e| e.into_inner());
            if left.len() < MOST && left.iter().all(|(other, _)| other != path) {
                left.push((path.to_owned(), e));
            }
            false
        }
    }
}

/// What could not be removed since this was asked last, each in a line.
pub fn left_behind() -> Vec<String> {
    let left = std::mem::take(&mut *LEFT.lock().unwrap_or_else(|e| e.into_inner()));
    left.iter()
        .map(|(path, e)| {
            format!(
                "{}: cannot remove it: {e}; the next run there removes it",
                path.display()
            )
        })
        .collect()
}
