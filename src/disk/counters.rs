//! Bytes read and written, for the report; and what was lost of a mapped file on the way.

use crate::error::{Error, Result};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that went through [`DataFile`](super::DataFile), scratch files and windows.
#[derive(Debug, Default)]
pub struct Counters {
    read: AtomicU64,
    written: AtomicU64,
    /// The first part of a mapped file that was lost.
    lost: Mutex<Option<Error>>,
}

/// A reading of [`Counters`]: bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IoCount {
    /// Bytes read.
    pub read: u64,
    /// Bytes written.
    pub written: u64,
}

impl Counters {
    /// Adds bytes read.
    pub fn add_read(&self, bytes: u64) {
        self.read.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds bytes written.
    pub fn add_written(&self, bytes: u64) {
        self.written.fetch_add(bytes, Ordering::Relaxed);
    }

    /// A part of a mapped file was lost: the outcome of what read it is worth nothing.
    pub(super) fn lose(&self, error: Error) {
        let mut lost = self.lost.lock().unwrap_or_else(|e| e.into_inner());
        lost.get_or_insert(error);
    }

    /// What came of reading files, unless a part of one was lost while it was mapped: then that,
    /// whatever came of it.
    ///
    /// # Errors
    /// Those of `done`; [`Error::Input`] for a file that was cut short while it was mapped,
    /// [`Error::Io`] for one that could not be read.
    pub fn intact<T>(&self, done: Result<T>) -> Result<T> {
        let mut lost = self.lost.lock().unwrap_or_else(|e| e.into_inner());
        match lost.take() {
            Some(error) => Err(error),
            None => done,
        }
    }

    /// What was counted so far.
    pub fn now(&self) -> IoCount {
        IoCount {
            read: self.read.load(Ordering::Relaxed),
            written: self.written.load(Ordering::Relaxed),
        }
    }
}
