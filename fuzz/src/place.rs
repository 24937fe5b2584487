//! A folder and a workspace for one input after another, and what every error must be.

use cornermill::Error;
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tempfile::TempDir;

/// The longest message: room for a path, a place, and words; not for what a file holds.
const MESSAGE: usize = 2048;

/// A folder of its own, and a workspace in it.
pub struct Place {
    dir: TempDir,
    pub ws: Workspace,
}

impl Place {
    /// With `memory` bytes of budget.
    pub fn new(memory: u64) -> Place {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let io = Arc::new(Counters::default());
        let ws = Workspace {
            budget: Budget::new(memory),
            scratch: Scratch::new(&[dir.path().to_owned()], 1 << 30, &io).expect("scratch"),
            io,
            workers: Workers::new(1).expect("a thread"),
            progress: Arc::new(NoProgress),
        };
        Place { dir, ws }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Writes a file.
    pub fn put(&self, name: &str, data: &[u8]) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, data).expect("a file is written");
        path
    }

    /// Removes a file or a folder, if it is there.
    pub fn clear(&self, name: &str) {
        let path = self.path(name);
        if path.is_dir() {
            std::fs::remove_dir_all(path).expect("a folder goes");
        } else {
            _ = std::fs::remove_file(path);
        }
    }

    /// All memory and scratch space must have been given back.
    pub fn settled(&self) {
        assert_eq!(self.ws.budget.used(), 0, "memory is not given back");
        assert_eq!(self.ws.scratch.used(), 0, "scratch is not given back");
        assert!(self.ws.budget.peak() <= self.ws.budget.limit());
    }
}

/// Panics unless the error is one that such an input may have.
pub fn sane(error: &Error) {
    let text = error.to_string();
    match error {
        Error::Input(bad) => {
            assert!(!bad.expected.is_empty() && !bad.found.is_empty(), "{text}");
        }
        Error::Usage(_) | Error::Budget { .. } | Error::DiskLimit { .. } => {}
        Error::Io { .. } | Error::Interrupted { .. } | Error::Internal(_) => panic!("{text}"),
    }
    assert!(text.len() <= MESSAGE, "a message of {} bytes", text.len());
    assert!(!text.chars().any(char::is_control), "{text:?}");
}

/// The files of a folder by name.
pub fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let items = std::fs::read_dir(folder).expect("a folder");
    let mut files: Vec<_> = items
        .map(|item| {
            let item = item.expect("an entry");
            let name = item.file_name().to_string_lossy().into_owned();
            (name, std::fs::read(item.path()).expect("a file"))
        })
        .collect();
    files.sort();
    files
}
