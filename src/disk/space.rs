//! How much room there is in a folder, as far as the system tells.
//!
//! Why the answer may be none: where files are compressed or shared, or the system does not tell,
//! what is free says nothing of what fits, and nobody is to be refused what would fit.
//!
//! Memory: none. I/O: none.

use std::path::Path;

/// Room in a file system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// Which file system: equal for folders that share their room.
    pub device: u64,
    /// Bytes that are free, reserves for the system's own use included.
    pub free: u64,
}

/// File systems that may store less than was written: btrfs, ZFS, bcachefs.
#[cfg(target_os = "linux")]
const SHRINKING: [u64; 3] = [0x9123_683E, 0x2FC1_2FC1, 0xCA45_1A4E];

/// The room in a folder that exists, where it can be told.
#[cfg(target_os = "linux")]
pub fn room(dir: &Path) -> Option<Room> {
    use std::os::unix::fs::MetadataExt;
    let told = rustix::fs::statfs(dir).ok()?;
    if SHRINKING.contains(&(told.f_type as u64 & 0xFFFF_FFFF)) || told.f_blocks == 0 {
        return None;
    }
    Some(Room {
        device: dir.metadata().ok()?.dev(),
        free: told.f_bfree.saturating_mul(told.f_bsize as u64),
    })
}

/// Nothing is told here.
#[cfg(not(target_os = "linux"))]
pub fn room(_: &Path) -> Option<Room> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_one_file_system_share_their_room() {
        let dir = tempfile::tempdir().unwrap();
        let below = dir.path().join("below");
        std::fs::create_dir(&below).unwrap();
        assert_eq!(
            room(dir.path()).map(|r| r.device),
            room(&below).map(|r| r.device)
        );
        assert_eq!(room(&dir.path().join("none")), None);
    }
}
