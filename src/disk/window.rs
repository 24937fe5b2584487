//! A part of a file mapped read-only. This and [`lost`](super::lost), which handles what the
//! system does when a mapped file shrinks, are the only places with unsafe code.
//!
//! A window covers what a pass looks at now and is dropped before the next, so resident
//! memory is the window's length, which its owner leases from the budget.
//!
//! A file that another process cuts short reads as zeros behind its new end; so whoever read from
//! a window must ask before the outcome is believed. Windows tell the counters of their file when
//! they are dropped, and those are asked at the end of each pass ([`Counters::intact`]); what is
//! mapped for longer is asked itself ([`Window::check`]).

#![allow(unsafe_code)]

use super::lost::Watch;
use super::{Counters, DataFile, fs, go_on};
use crate::error::{Error, Result};
use bytemuck::Pod;
use memmap2::{Mmap, MmapOptions};
use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;

/// `len` bytes of a file from byte `at`, mapped read-only.
#[derive(Debug)]
pub struct Window {
    mapped: Option<Mapped>,
    lead: usize,
}

/// Fields are dropped in this order: the watch before what it watches.
#[derive(Debug)]
struct Mapped {
    watch: Watch,
    map: Mmap,
    file: Arc<File>,
    path: PathBuf,
    /// End of the window in the file.
    end: u64,
    io: Arc<Counters>,
}

/// Mapping offsets are multiples of this: the largest page size in common use is 64 KiB.
const PAGE: u64 = 64 << 10;

impl Window {
    /// Maps `len` bytes from byte `at`; the file must be that long.
    ///
    /// # Errors
    /// [`Error::Input`] when the file is shorter, [`Error::Io`] when the system refuses.
    pub fn new(file: &DataFile, at: u64, len: usize) -> Result<Window> {
        let window = Window::map(file, at, len, false)?;
        file.counters().add_read(len as u64);
        Ok(window)
    }

    /// As [`new`](Window::new), and brings all its pages in at once: for windows read whole.
    ///
    /// # Errors
    /// As [`new`](Window::new).
    pub fn populated(file: &DataFile, at: u64, len: usize) -> Result<Window> {
        let window = Window::map(file, at, len, true)?;
        file.counters().add_read(len as u64);
        Ok(window)
    }

    /// As [`new`](Window::new), for windows of which little may be touched: nothing is counted as
    /// read, so that the caller counts what it takes.
    ///
    /// # Errors
    /// As [`new`](Window::new).
    pub fn uncounted(file: &DataFile, at: u64, len: usize) -> Result<Window> {
        Window::map(file, at, len, false)
    }

    fn map(file: &DataFile, at: u64, len: usize, populate: bool) -> Result<Window> {
        go_on()?;
        let have = file.len()?;
        if at.checked_add(len as u64).is_none_or(|end| end > have) {
            return Err(Error::input(
                file.path(),
                format!("byte {at}"),
                format!("{len} bytes more"),
                format!("the end of the file at byte {have}"),
                "the file is cut short, or changed while it was read",
            ));
        }
        if len == 0 {
            return Ok(Window {
                mapped: None,
                lead: 0,
            });
        }
        let start = at / PAGE * PAGE;
        let lead = (at - start) as usize;
        let mut options = MmapOptions::new();
        options.offset(start).len(lead + len);
        if populate {
            options.populate();
        }
        let failed = |e| Error::io(file.path(), format!("map {len} bytes at byte {at}"), e);
        fs::pass(fs::Call::Map, file.path(), 0).map_err(failed)?;
        // SAFETY: the mapping is read-only and lives as long as this window. Its length was
        // checked against the file just now. What can still go wrong: another process that
        // shortens the file while the window lives, which the watch turns into zeros and an
        // error, and one that writes to it, which changes the bytes under us. Every value read
        // here is checked after it is copied out, so neither can break memory safety of what
        // follows.
        let map = unsafe { options.map(file.raw()) }.map_err(failed)?;
        Ok(Window {
            mapped: Some(Mapped {
                watch: Watch::over(&map),
                map,
                file: Arc::clone(file.raw()),
                path: file.path().to_owned(),
                end: at + len as u64,
                io: Arc::clone(file.counters()),
            }),
            lead,
        })
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        let all = self.mapped.as_ref().map(|mapped| &mapped.map[..]);
        all.map_or(&[], |all| &all[self.lead..])
    }

    /// Whether all bytes that were read so far were those of the file.
    ///
    /// # Errors
    /// [`Error::Input`] when the file was cut short since it was mapped, [`Error::Io`] when the
    /// device could not deliver a part of it.
    pub fn check(&self) -> Result<()> {
        self.mapped.as_ref().map_or(Ok(()), Mapped::check)
    }

    /// The bytes as an array of plain values in the machine's byte order.
    ///
    /// `None` when the window's start is not aligned to T, or its length is no multiple of T.
    pub fn slice<T: Pod>(&self) -> Option<&[T]> {
        if self.mapped.is_none() {
            // Nothing is mapped, so there is nothing to be aligned.
            return Some(&[]);
        }
        bytemuck::try_cast_slice(self.bytes()).ok()
    }
}

impl Mapped {
    fn check(&self) -> Result<()> {
        let length = self.file.metadata();
        let length = length
            .map_err(|e| Error::io(&self.path, "ask its length", e))?
            .len();
        if length < self.end {
            return Err(Error::input(
                &self.path,
                format!("byte {length}"),
                format!("a file of at least {} bytes, as it was before", self.end),
                "its end",
                "it was cut short while it was read; do not change it meanwhile",
            ));
        }
        if self.watch.lost() {
            let source = std::io::Error::other("a mapped part of it could not be read");
            let action = format!("read it up to byte {}", self.end);
            return Err(Error::io(&self.path, action, source));
        }
        Ok(())
    }
}

impl Drop for Mapped {
    fn drop(&mut self) {
        if let Err(e) = self.check() {
            self.io.lose(e);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::Counters;
    use std::sync::Arc;

    #[test]
    fn maps_any_offset_and_refuses_beyond_the_end() {
        let dir = tempfile::tempdir().unwrap();
        let io = Arc::new(Counters::default());
        let file = DataFile::create_new(&dir.path().join("f"), &io).unwrap();
        let data: Vec<u8> = (0..200_000u32).map(|i| i as u8).collect();
        file.write_at(&data, 0).unwrap();
        for (at, len) in [
            (0, 200_000),
            (4096, 12),
            (65_537, 70_001),
            (199_999, 1),
            (5, 0),
        ] {
            let window = Window::new(&file, at as u64, len).unwrap();
            assert_eq!(window.bytes(), &data[at..at + len]);
        }
        assert!(Window::new(&file, 199_999, 2).is_err());
        assert!(Window::new(&file, u64::MAX, 2).is_err());
        let window = Window::populated(&file, 4096, 8).unwrap();
        assert_eq!(window.slice::<u32>().unwrap().len(), 2);
        assert!(window.slice::<[u8; 3]>().is_none());
        let empty = Window::new(&file, 5, 0).unwrap();
        assert!(empty.slice::<u64>().is_some_and(<[u64]>::is_empty));
    }

    #[test]
    fn a_file_that_shrinks_reads_as_zeros_and_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let io = Arc::new(Counters::default());
        let file = DataFile::create_new(&dir.path().join("f"), &io).unwrap();
        // To nothing, to a page in the middle, within the last page: the last raises no signal.
        for left in [0, 200_000, 299_990] {
            file.set_len(0).unwrap();
            file.write_at(&[7; 300_000], 0).unwrap();
            let window = Window::new(&file, 4096, 300_000 - 4096).unwrap();
            assert_eq!(window.bytes()[250_000], 7);
            window.check().unwrap();
            file.set_len(left).unwrap();
            let sum: u64 = window.bytes().iter().map(|&b| u64::from(b)).sum();
            assert_eq!(sum, 7 * left.saturating_sub(4096));
            let error = window.check().unwrap_err();
            assert!(matches!(error, Error::Input(_)), "{error}");
            assert!(error.to_string().contains("cut short"), "{error}");
            io.intact(Ok(())).unwrap();
            drop(window);
            io.intact(Ok(())).unwrap_err();
            io.intact(Ok(())).unwrap();
        }
    }

    #[test]
    fn many_threads_lose_many_windows() {
        let dir = tempfile::tempdir().unwrap();
        let io = Arc::new(Counters::default());
        std::thread::scope(|scope| {
            for t in 0..4 {
                let file = DataFile::create_new(&dir.path().join(t.to_string()), &io).unwrap();
                scope.spawn(move || {
                    for round in 0..50u64 {
                        file.write_at(&[1; 100_000], 0).unwrap();
                        let windows: Vec<Window> = (0..5)
                            .map(|_| Window::new(&file, 0, 100_000).unwrap())
                            .collect();
                        file.set_len(round * 1000).unwrap();
                        for window in &windows {
                            let sum: u64 = window.bytes().iter().map(|&b| u64::from(b)).sum();
                            assert_eq!(sum, round * 1000);
                            assert!(window.check().is_err());
                        }
                    }
                });
            }
        });
    }
}
