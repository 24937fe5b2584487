//! Checksums: the xxh3 of every 64 MiB of a file.
//!
//! Why blocks: any part can be checked alone, blocks are summed by different threads, and a
//! digest over the block sums does not depend on who summed them.
//!
//! Memory: one read buffer of [`STEP`] bytes for each thread. I/O: each file read once.

use crate::disk::{DataFile, Workspace};
use crate::error::Result;
use std::sync::Mutex;
use xxhash_rust::xxh3::{Xxh3Default, xxh3_64};

/// Bytes under one checksum.
pub const BLOCK: u64 = 64 << 20;
/// Bytes read at a time.
const STEP: usize = 256 << 10;

/// The checksum of every 64 MiB of each file, files in the given order.
///
/// # Errors
/// [`crate::Error::Budget`] for the read buffers, [`crate::Error::Io`].
pub fn block_sums(ws: &Workspace, files: &[&DataFile]) -> Result<Vec<Vec<u64>>> {
    let _lease = ws
        .budget
        .lease("checksum buffers", (ws.workers.count() * STEP) as u64)?;
    let mut units = Vec::new();
    let mut sums = Vec::new();
    for (which, file) in files.iter().enumerate() {
        let bytes = file.len()?;
        let blocks = bytes.div_ceil(BLOCK);
        sums.push(vec![0; blocks as usize]);
        units.extend((0..blocks).map(|block| (which, block, bytes)));
    }
    let sums = Mutex::new(sums);
    ws.workers.run(
        units.len() as u64,
        || Ok(vec![0u8; STEP]),
        |buf, unit| {
            let (which, block, bytes) = units[unit as usize];
            let end = bytes.min((block + 1) * BLOCK);
            let sum = sum_range(files[which], block * BLOCK, end, buf)?;
            ws.progress.advance(end - block * BLOCK);
            sums.lock().unwrap_or_else(|e| e.into_inner())[which][block as usize] = sum;
            Ok(())
        },
        |_| Ok(()),
    )?;
    Ok(sums.into_inner().unwrap_or_else(|e| e.into_inner()))
}

fn sum_range(file: &DataFile, from: u64, to: u64, buf: &mut [u8]) -> Result<u64> {
    let mut hasher = Xxh3Default::new();
    let mut at = from;
    while at < to {
        let n = buf.len().min((to - at) as usize);
        file.read_at(&mut buf[..n], at)?;
        hasher.update(&buf[..n]);
        at += n as u64;
    }
    Ok(hasher.digest())
}

/// One digest over the block sums of a file.
pub fn digest_of_blocks(sums: &[u64]) -> u64 {
    let bytes: Vec<u8> = sums.iter().flat_map(|s| s.to_le_bytes()).collect();
    xxh3_64(&bytes)
}

/// The digest of a whole file, as the manifest records it for the input.
///
/// # Errors
/// As [`block_sums`].
pub fn digest_file(ws: &Workspace, file: &DataFile) -> Result<super::InputDigest> {
    let sums = block_sums(ws, &[file])?;
    Ok(super::InputDigest {
        bytes: file.len()?,
        xxh3: format!("{:016x}", digest_of_blocks(&sums[0])),
    })
}
