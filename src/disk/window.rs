//! A part of a file mapped read-only: the one place of the crate with unsafe code and mmap.
//!
//! A window covers what a pass looks at now and is dropped before the next, so resident
//! memory is the window's length, which its owner leases from the budget.

#![allow(unsafe_code)]

use super::{DataFile, go_on};
use crate::error::{Error, Result};
use bytemuck::Pod;
use memmap2::{Mmap, MmapOptions};

/// `len` bytes of a file from byte `at`, mapped read-only.
#[derive(Debug)]
pub struct Window {
    map: Option<Mmap>,
    lead: usize,
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
            return Ok(Window { map: None, lead: 0 });
        }
        let start = at / PAGE * PAGE;
        let lead = (at - start) as usize;
        let mut options = MmapOptions::new();
        options.offset(start).len(lead + len);
        if populate {
            options.populate();
        }
        // SAFETY: the mapping is read-only and lives as long as this window. Its length was
        // checked against the file just now. What can still go wrong: another process that
        // shortens the file while the window lives makes a read of the lost pages raise
        // SIGBUS, and one that writes to it changes the bytes under us. Both are the user
        // changing an input during a build; every value read here is checked after it is
        // copied out, so changed bytes cannot break memory safety of what follows.
        let map = unsafe { options.map(file.raw()) }
            .map_err(|e| Error::io(file.path(), format!("map {len} bytes at byte {at}"), e))?;
        Ok(Window {
            map: Some(map),
            lead,
        })
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        self.map.as_ref().map_or(&[], |map| &map[self.lead..])
    }

    /// The bytes as an array of plain values in the machine's byte order.
    ///
    /// `None` when the window's start is not aligned to T, or its length is no multiple of T.
    pub fn slice<T: Pod>(&self) -> Option<&[T]> {
        if self.map.is_none() {
            // Nothing is mapped, so there is nothing to be aligned.
            return Some(&[]);
        }
        bytemuck::try_cast_slice(self.bytes()).ok()
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
}
