//! Fill: brings the opposites from the seams into O.
//!
//! Why it works: the opposites name corners as the input had them, with the parity of the edge: the
//! flip of the triangle across is this one's flip xor the parity, so it need not be looked up. What
//! is filled in depends on nothing that is filled in, so doing it twice is harmless.
//!
//! Memory: a sorter and 64 KiB a thread. I/O: patches read once, the parts of O that they touch read
//! and written.

use super::Job;
use super::arrays::OutArray;
use super::finish::Tables;
use super::graph::bits::Bits;
use super::records::Patch;
use crate::corner::{Index, flip_k};
use crate::error::Result;
use crate::folder::Orient;
use crate::shuffle::Buckets;

/// Corners of O that are held at a time while opposites are filled in.
pub const SPAN: u64 = 4 << 10;

/// A span of O that opposites are filled into, within one bucket's range of corners.
struct Span<I> {
    first: u64,
    rows: Vec<I>,
}

impl<I: Index> Span<I> {
    fn put(&mut self, o: &OutArray, corner: u64, value: u64, end: u64) -> Result<()> {
        if corner < self.first || corner - self.first >= self.rows.len() as u64 {
            self.flush(o)?;
            // Whole triangles, since a flip moves a corner down as well as up.
            self.first = corner / 3 * 3;
            self.rows
                .resize(SPAN.min(end - self.first) as usize, I::NONE);
            o.read(self.first, &mut self.rows)?;
        }
        self.rows[(corner - self.first) as usize] = I::of(value);
        Ok(())
    }

    fn flush(&mut self, o: &OutArray) -> Result<()> {
        if !self.rows.is_empty() {
            o.write(self.first, &self.rows)?;
            self.rows.clear();
        }
        Ok(())
    }
}

/// Final flip of triangles and whether they keep the input's orientation, read in blocks.
struct Flips<'a, I> {
    tables: &'a Tables<'a>,
    any_flip: bool,
    any_nonorientable: bool,
    first: u64,
    bits: Vec<u8>,
    labels: Vec<I>,
}

impl<I: Index> Flips<'_, I> {
    /// Triangles of a block: a multiple of 8.
    const BLOCK: u64 = 2048;

    fn load(&mut self, t: u64, triangles: u64) -> Result<()> {
        if t >= self.first && t - self.first < self.labels.len() as u64 {
            return Ok(());
        }
        self.first = t / Self::BLOCK * Self::BLOCK;
        let count = Self::BLOCK.min(triangles - self.first);
        self.labels.resize(count as usize, I::NONE);
        self.bits.resize(count.div_ceil(8) as usize, 0);
        if self.any_flip {
            self.tables.flipped.read(self.first / 8, &mut self.bits)?;
        }
        if self.any_nonorientable {
            self.tables.component.read(self.first, &mut self.labels)?;
        }
        Ok(())
    }

    fn flipped(&self, t: u64) -> bool {
        let i = (t - self.first) as usize;
        self.bits[i / 8] >> (i % 8) & 1 == 1
    }
}

/// Fills the opposites from the seams into O.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn fill<I: Index, W: Index>(
    job: &Job,
    nonorientable: &Bits,
    patches: &Buckets<Patch<W>>,
    tables: &Tables,
    any_flip: bool,
) -> Result<()> {
    let ws = job.ws;
    let threads = ws.workers.count() as u64;
    let _lease = ws.budget.lease("spans of O", threads * (64 << 10))?;
    let memory = job.sort_memory(0);
    let any_nonorientable = nonorientable.any();
    ws.workers.run(
        patches.count(),
        || {
            let span = Span::<I> {
                first: 0,
                rows: Vec::new(),
            };
            let flips = Flips::<I> {
                tables,
                any_flip,
                any_nonorientable,
                first: 0,
                bits: Vec::new(),
                labels: Vec::new(),
            };
            Ok((patches.sorter(memory)?, span, flips))
        },
        |(sorter, span, flips), bucket| {
            // A bucket is a range of triangles, so no two threads touch the same part of O.
            let end = 3 * patches.range(bucket).end.min(job.shape.triangles);
            patches.sorted(bucket, sorter, &mut |batch| {
                ws.progress.advance(batch.len() as u64);
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
                for patch in batch {
                    let ((t, k), (across, l)) = (patch.at(), patch.to());
                    flips.load(t, job.shape.triangles)?;
                    let own = flips.flipped(t);
                    let keeps = job.orient == Orient::Keep
                        || any_nonorientable
                            && nonorientable.get(flips.labels[(t - flips.first) as usize].wide());
                    let other = !keeps && own ^ patch.parity();
                    let corner = 3 * t + flip_k(k, own) as u64;
                    let value = 3 * across + flip_k(l, other) as u64;
                    span.put(tables.o, corner, value, end)?;
                }
                Ok(())
            })?;
            span.flush(tables.o)
        },
        |_| Ok(()),
    )
}
