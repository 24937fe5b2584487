//! What the system is told of parts of a file: that they are done with, or soon wanted.
//!
//! Why nothing here can fail: each call only spares the system space or time. Where it is not
//! known (another system, a file system without holes), the file stays as it is, and whoever
//! asked is told so.
//!
//! Memory: none. I/O: none that is waited for.

use super::DataFile;

#[cfg(target_os = "linux")]
impl DataFile {
    /// Frees the blocks of `bytes` from byte `at`; they read as zeros from now on. False when
    /// nothing was freed.
    pub(super) fn punch(&self, at: u64, bytes: u64) -> bool {
        use rustix::fs::{FallocateFlags, fallocate};
        let hole = FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE;
        fallocate(self.raw(), hole, at, bytes).is_ok()
    }
}

#[cfg(not(target_os = "linux"))]
impl DataFile {
    /// Nothing is freed here.
    pub(super) fn punch(&self, _: u64, _: u64) -> bool {
        false
    }
}
