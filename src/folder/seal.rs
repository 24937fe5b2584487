//! Checksums: the xxh3 of every 64 MiB of a file.
//!
//! Why blocks: any part can be checked alone, blocks are summed by different threads, and a
//! digest over the block sums does not depend on who summed them.
//!
//! Memory: one read buffer of [`STEP`] bytes for each thread. I/O: each file read once, but for
//! blocks whose sums were taken before ([`WarmSums`]).

use super::WarmSums;
use crate::disk::{DataFile, Workspace};
use crate::error::Result;
use std::ops::Range;
use std::sync::Mutex;
use xxhash_rust::xxh3::{Xxh3Default, xxh3_64};

/// Bytes under one checksum.
pub const BLOCK: u64 = 64 << 20;
/// Bytes read at a time.
pub(super) const STEP: usize = 256 << 10;

/// Bytes that sums take while they are taken.
pub fn checksum_bytes(ws: &Workspace) -> u64 {
    (ws.workers.count() * STEP) as u64
}

/// The checksum of every 64 MiB of each file, files in the given order.
///
/// # Errors
/// [`crate::Error::Budget`] for the read buffers, [`crate::Error::Io`].
pub fn block_sums(ws: &Workspace, files: &[&DataFile]) -> Result<Vec<Vec<u64>>> {
    let cold = |file: &&DataFile| WarmSums::new(&ws.budget, file.len()?, false);
    let sums = files.iter().map(cold).collect::<Result<Vec<_>>>()?;
    let pairs: Vec<_> = files.iter().copied().zip(&sums).collect();
    warm_sums(ws, &pairs)
}

/// As [`block_sums`], reading only blocks whose sums were not taken yet, or no longer hold.
///
/// # Errors
/// As [`block_sums`].
pub fn warm_sums(ws: &Workspace, files: &[(&DataFile, &WarmSums)]) -> Result<Vec<Vec<u64>>> {
    let _lease = ws.budget.lease("checksum buffers", checksum_bytes(ws))?;
    let mut units = Vec::new();
    let mut sums = Vec::new();
    for (which, (_, warm)) in files.iter().enumerate() {
        let blocks = 0..warm.bytes().div_ceil(BLOCK);
        let known: Vec<Option<u64>> = blocks.map(|b| warm.get(b)).collect();
        let left = (0u64..).zip(&known).filter(|(_, sum)| sum.is_none());
        units.extend(left.map(|(b, _)| (which, b, warm.range(b))));
        sums.push(known.into_iter().map(Option::unwrap_or_default).collect());
    }
    let sums: Mutex<Vec<Vec<u64>>> = Mutex::new(sums);
    ws.workers.run(
        units.len() as u64,
        || Ok(vec![0u8; STEP]),
        |buf, unit| {
            let (which, b, range) = &units[unit as usize];
            let sum = sum_range(files[*which].0, range.clone(), buf)?;
            ws.progress.advance(range.end - range.start);
            sums.lock().unwrap_or_else(|e| e.into_inner())[*which][*b as usize] = sum;
            Ok(())
        },
        |_| Ok(()),
    )?;
    Ok(sums.into_inner().unwrap_or_else(|e| e.into_inner()))
}

pub(super) fn sum_range(file: &DataFile, range: Range<u64>, buf: &mut [u8]) -> Result<u64> {
    let mut hasher = Xxh3Default::new();
    let mut at = range.start;
    while at < range.end {
        let n = buf.len().min((range.end - at) as usize);
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
    digest_warm(ws, file, &WarmSums::new(&ws.budget, file.len()?, false)?)
}

/// As [`digest_file`], reading only what was not summed yet.
///
/// # Errors
/// As [`block_sums`].
pub fn digest_warm(ws: &Workspace, file: &DataFile, warm: &WarmSums) -> Result<super::InputDigest> {
    let sums = warm_sums(ws, &[(file, warm)])?;
    Ok(super::InputDigest {
        bytes: warm.bytes(),
        xxh3: format!("{:016x}", digest_of_blocks(&sums[0])),
    })
}
