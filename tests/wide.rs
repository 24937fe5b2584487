//! Ids, rows and bytes around 2^31, 2^32 and 2^33 corners: where a count that was kept in 32 bits,
//! or an offset that was multiplied before it was widened, goes wrong.
//!
//! Files are sparse: `set_len` gives them their length, and only the rows that a test writes take
//! disk. What reads whole arrays is tested from the other end: small meshes whose vertex ids lie
//! that far out go through the whole build.

#[path = "wide/arrays.rs"]
mod arrays;
#[path = "wide/build.rs"]
mod build;
#[allow(dead_code)]
mod by_hand;
mod common;
#[path = "wide/ids.rs"]
mod ids;
#[path = "wide/table.rs"]
mod table;

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Numbers of corners at whose neighbours every test looks.
pub const CORNERS: [u64; 3] = [1 << 31, 1 << 32, 1 << 33];

/// Makes a file of `bytes` bytes that takes no disk, but for what is written.
pub fn sparse(path: &Path, bytes: u64, written: &[(u64, Vec<u8>)]) {
    let file = File::create_new(path).expect("a new file");
    file.set_len(bytes).expect("a length");
    for (at, data) in written {
        file.write_all_at(data, *at).expect("written bytes");
    }
}

/// Bytes of a file, past all code of the crate.
pub fn bytes_at(path: &Path, at: u64, len: usize) -> Vec<u8> {
    let mut bytes = vec![0; len];
    let file = File::open(path).expect("a file");
    file.read_exact_at(&mut bytes, at).expect("bytes");
    bytes
}

/// Where item `i` lies in data that begins at `start`: in 128 bits, so that nothing can wrap.
pub fn place(start: u64, i: u64, item: u64) -> u64 {
    let at = u128::from(start) + u128::from(i) * u128::from(item);
    u64::try_from(at).expect("a byte that a file has")
}
