//! Names of the folders that a build works in: one beside its target, and others where scratch files
//! lie elsewhere.
//!
//! Memory: a list of paths. I/O: that list.

use crate::disk::{discard_dead, fs, parent};
use crate::error::{Error, Result};
use std::ffi::{OsStr, OsString};
use std::io::ErrorKind;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::xxh3_64;

/// What a stopped build goes on from.
pub const STATE: &str = "state";
/// The folders of scratch files that lie elsewhere, each ended by a zero.
pub const ROOMS: &str = "rooms";
/// The most bytes of that list.
const MOST_ROOMS: u64 = 1 << 20;
/// The most bytes of a name on the file systems there are.
const MOST_NAME: usize = 255;

/// The file of the state that a stopped build of `target` leaves, if it leaves one.
pub fn state_of(target: &Path) -> PathBuf {
    work_of(target).join(STATE)
}

/// The working folder of a target.
pub fn work_of(target: &Path) -> PathBuf {
    parent(target).join(named_from(target, ".partial"))
}

/// The name of a folder of scratch files of the build in `work`, which is spelled in full.
pub fn room_name(target: &Path, work: &Path) -> OsString {
    let sum = xxh3_64(work.as_os_str().as_encoded_bytes());
    named_from(target, &format!(".scratch-{sum:016x}"))
}

/// A hidden name from that of the target: the sum of it where the whole would be too long.
fn named_from(target: &Path, end: &str) -> OsString {
    let own = target.file_name().unwrap_or_default();
    let mut name = OsString::from(".");
    if 1 + own.len() + end.len() <= MOST_NAME {
        name.push(own);
    } else {
        name.push(format!("{:016x}", xxh3_64(own.as_encoded_bytes())));
    }
    name.push(end);
    name
}

/// The folders of scratch files that the build of a working folder has elsewhere.
///
/// # Errors
/// [`Error::Io`].
pub fn rooms_of(work: &Path) -> Result<Vec<PathBuf>> {
    let list = work.join(ROOMS);
    let bytes = match fs::read_up_to(&list, MOST_ROOMS) {
        Err(e) if e.kind() == ErrorKind::NotFound => Vec::new(),
        read => read.map_err(|e| Error::io(&list, "read it", e))?,
    };
    let paths = bytes
        .split(|&byte| byte == 0)
        .filter(|path| !path.is_empty());
    Ok(paths
        .map(|path| PathBuf::from(OsStr::from_bytes(path)))
        .collect())
}

/// The list of them, as it is written.
pub fn joined(rooms: &[PathBuf]) -> Vec<u8> {
    let paths = rooms
        .iter()
        .flat_map(|room| [room.as_os_str().as_bytes(), b"\0"]);
    paths.collect::<Vec<_>>().concat()
}

/// Removes the folders of scratch files that a dead build had elsewhere; true when they are gone.
pub fn discard_rooms(work: &Path) -> bool {
    let ours = |room: &PathBuf| {
        let name = room.file_name().unwrap_or_default().as_bytes();
        name.starts_with(b".") && name.windows(9).any(|part| part == b".scratch-")
    };
    let Ok(rooms) = rooms_of(work) else {
        return false;
    };
    let there = rooms.iter().filter(|room| ours(room) && room.exists());
    // All of them are tried, whatever became of one.
    let stay = there.filter(|room| !discard_dead(room)).count();
    stay == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_longer_than_names_may_be() {
        let work = Path::new("/data/.mesh.ct.partial");
        assert_eq!(work_of(Path::new("/data/mesh.ct")), work);
        for length in [200, 229, 230, 246, 247, 255] {
            let target = PathBuf::from("/data").join("x".repeat(length));
            let of = [work_of(&target), PathBuf::from(room_name(&target, work))];
            for (path, short) in of.into_iter().zip([246, 229]) {
                let name = path.file_name().unwrap().as_bytes();
                assert!(name.len() <= 255);
                assert_eq!(name.len() > length, length <= short);
            }
            let other = PathBuf::from("/data").join("y".repeat(length));
            assert_ne!(work_of(&target), work_of(&other));
        }
    }
}
