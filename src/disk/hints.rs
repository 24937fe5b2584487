//! What the system is told of parts of a file: that they are done with, or soon wanted.
//!
//! Why nothing here can fail: each call only spares the system space or time. Where it is not
//! known (another system, a file system without holes), the file stays as it is, and whoever
//! asked is told so.
//!
//! Memory: none. I/O: none that is waited for.

use super::DataFile;
use std::ops::Range;

/// Files of at least this many bytes are not kept in the page cache on purpose: what is done
/// with makes room at once, before the system must look for room itself.
const LONG: u64 = 2 << 30;

impl DataFile {
    /// These bytes of a file of `length` were written, and will hardly be changed again soon: if
    /// it is long, they should go to the device from now on, before so many wait for it that
    /// writers are made to wait too.
    pub fn settle(&self, range: Range<u64>, length: u64) {
        if length >= LONG {
            self.forget(range);
        }
    }

    /// These bytes of a file of `length` are done with: if it is long, they leave the page cache,
    /// unless they still wait to be written.
    pub fn release(&self, range: Range<u64>, length: u64) {
        if length >= LONG {
            self.forget(range);
        }
    }
}

#[cfg(target_os = "linux")]
impl DataFile {
    /// Frees the blocks of `bytes` from byte `at`; they read as zeros from now on. False when
    /// nothing was freed.
    pub(super) fn punch(&self, at: u64, bytes: u64) -> bool {
        use rustix::fs::{FallocateFlags, fallocate};
        let hole = FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE;
        fallocate(self.raw(), hole, at, bytes).is_ok()
    }

    /// These bytes will be read soon: the system may begin to read them now.
    pub(super) fn expect(&self, range: Range<u64>) {
        use rustix::fs::{Advice, fadvise};
        let bytes = std::num::NonZeroU64::new(range.end - range.start);
        if bytes.is_some() {
            let _ = fadvise(self.raw(), range.start, bytes, Advice::WillNeed);
        }
    }

    /// On Linux this advice starts to write what is dirty, and drops the pages that are clean.
    fn forget(&self, range: Range<u64>) {
        use rustix::fs::{Advice, fadvise};
        let bytes = std::num::NonZeroU64::new(range.end - range.start);
        if bytes.is_some() {
            // Advice that is not taken costs nothing but time.
            let _ = fadvise(self.raw(), range.start, bytes, Advice::DontNeed);
        }
    }
}

#[cfg(not(target_os = "linux"))]
impl DataFile {
    /// Nothing is freed here.
    pub(super) fn punch(&self, _: u64, _: u64) -> bool {
        false
    }

    /// Nothing is advised here.
    pub(super) fn expect(&self, _: Range<u64>) {}

    /// Nothing is advised here.
    fn forget(&self, _: Range<u64>) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::Counters;
    use std::sync::Arc;

    #[test]
    fn advice_changes_no_byte_and_counts_none() {
        let dir = tempfile::tempdir().unwrap();
        let io = Arc::new(Counters::default());
        let file = DataFile::create_new(&dir.path().join("f"), &io).unwrap();
        let data: Vec<u8> = (0..100_000u32).map(|i| (i / 7) as u8).collect();
        file.write_at(&data, 0).unwrap();
        let before = io.now();
        // Within the file, across its end, of nothing, of a file that is said to be long.
        for range in [0..100_000, 5000..5001, 90_000..1 << 40, 7..7] {
            file.settle(range.clone(), LONG);
            file.release(range.clone(), LONG);
            file.release(range.clone(), LONG - 1);
            file.expect(range);
        }
        assert_eq!(io.now(), before);
        let mut back = vec![0; data.len()];
        file.read_at(&mut back, 0).unwrap();
        assert_eq!(back, data);
    }
}
