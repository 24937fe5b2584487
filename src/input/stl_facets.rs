//! The facets of a binary STL file, by all threads.
//!
//! Why any thread can begin anywhere: all facets take 50 bytes, so the one that begins at or
//! behind a byte is known without reading what lies before; and a weld takes corners by number.
//! A unit is a block of the input's digest: the thread that decodes it sums its bytes, too, as
//! they pass, so the file is read once (but for the facets that lie across the pieces in which
//! it is read). A facet belongs to the unit in which it begins.
//!
//! Memory: a buffer a thread. I/O: the input once.

use super::{FACET, HEAD, corners};
use crate::disk::{DataFile, Workspace};
use crate::error::Result;
use crate::folder::{BLOCK, InputDigest, digest_of_blocks};
use crate::input::reader::ByteReader;
use crate::input::weld::{Bits, Soup, Welding, soup_of_units};
use std::sync::{Mutex, PoisonError};
use xxhash_rust::xxh3::Xxh3Default;

/// Bytes of a thread's buffer when the budget is ample: they stay in its cache.
const BUFFER: u64 = 256 << 10;
/// Facets whose corners are handed on at a time.
const BATCH: usize = 64;

/// Begins to weld the facets of a regular file whose length agrees with their number.
pub(super) fn read<B: Bits>(
    ws: &Workspace,
    reader: ByteReader,
    facets: u64,
) -> Result<(InputDigest, Welding)> {
    let seen = reader.read_so_far();
    let file = DataFile::open(reader.path(), &ws.io)?;
    drop(reader);
    let bytes = HEAD + facets * FACET as u64;
    let units = bytes.div_ceil(BLOCK);
    let sums = Mutex::new(vec![0; units as usize]);
    let weld = soup_of_units::<B, _>(
        ws,
        (facets, units),
        || {
            let share = ws.budget.limit() / 32 / ws.workers.count() as u64;
            let room = share.clamp(4096, BUFFER);
            let lease = ws.budget.lease("the buffer for reading the mesh", room)?;
            Ok((vec![0; room as usize], lease))
        },
        |(buf, _), soup, unit| {
            let (from, to) = (unit * BLOCK, bytes.min((unit + 1) * BLOCK));
            let mut part = Part {
                file: &file,
                bytes,
                facets,
                hasher: Xxh3Default::new(),
            };
            soup.begin(part.facet_at(from));
            part.read(from, to, buf, soup)?;
            ws.progress
                .advance((to - from).saturating_sub(seen.saturating_sub(from)));
            sums.lock().unwrap_or_else(PoisonError::into_inner)[unit as usize] =
                part.hasher.digest();
            Ok(())
        },
    )?;
    let sums = sums.into_inner().unwrap_or_else(PoisonError::into_inner);
    let digest = InputDigest {
        bytes,
        xxh3: format!("{:016x}", digest_of_blocks(&sums)),
    };
    Ok((digest, weld))
}

/// A part of the file on its way.
struct Part<'a> {
    file: &'a DataFile,
    bytes: u64,
    facets: u64,
    hasher: Xxh3Default,
}

impl Part<'_> {
    /// The first facet that begins at byte `at` or behind it.
    fn facet_at(&self, at: u64) -> u64 {
        at.saturating_sub(HEAD)
            .div_ceil(FACET as u64)
            .min(self.facets)
    }

    /// Sums bytes `from..to`, and hands on the facets that begin there.
    fn read<B: Bits>(
        &mut self,
        from: u64,
        to: u64,
        buf: &mut [u8],
        soup: &mut dyn Soup<B>,
    ) -> Result<()> {
        let step = (buf.len() - FACET) as u64;
        let mut at = from;
        while at < to {
            let end = to.min(at + step);
            // The last facet may reach beyond.
            let held = &mut buf[..(self.bytes.min(end + FACET as u64) - at) as usize];
            self.file.read_at(held, at)?;
            self.hasher.update(&held[..(end - at) as usize]);
            let [first, last] = [self.facet_at(at), self.facet_at(end)];
            if first < last {
                let start = (HEAD + first * FACET as u64 - at) as usize;
                let whole = &held[start..start + (last - first) as usize * FACET];
                hand_on(whole, soup)?;
            }
            at = end;
        }
        Ok(())
    }
}

fn hand_on<B: Bits>(facets: &[u8], soup: &mut dyn Soup<B>) -> Result<()> {
    let mut at = [[[B::from_f4(0); 3]; 3]; BATCH];
    for batch in facets.chunks(BATCH * FACET) {
        let mut taken = 0;
        for (to, facet) in at.iter_mut().zip(batch.chunks_exact(FACET)) {
            *to = corners(facet);
            taken += 1;
        }
        soup.corners(at[..taken].as_flattened())?;
    }
    Ok(())
}
