//! Seams: settles the edges between seam vertices, from the corners that the chunks spilled.
//!
//! Why it works: all corners on such an edge were spilled, by whichever chunk, and the shuffle
//! brings records of equal (lo, hi) together, corners ascending. A group is decided only when
//! its last corner was seen: one is a border, two are opposite, three or more are non-manifold,
//! and a group of any length passes through in constant memory.
//!
//! Memory: a sorter and two writers a thread. I/O: spilled corners read once; two patches and
//! a link for each regular edge written to scratch, a word for each border.

use super::Job;
use super::chunks::{Chunked, Settled};
use super::records::{EdgeCorner, Link, Patch};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::Result;
use crate::shuffle::{Buckets, Shuffle, Writer};
use bytemuck::Pod;
use std::sync::Mutex;

/// What the seam pass leaves in scratch.
pub struct Seamed<W: Index> {
    /// Opposites to fill into O, by corner.
    pub patches: Buckets<Patch<W>>,
    /// [`Link`]s between local components.
    pub links: ScratchFile,
    /// For each border edge found here, its local component (numbered through the mesh).
    pub borders: ScratchFile,
    /// Totals of the edges settled here.
    pub settled: Settled,
}

/// Collects records and appends them to a scratch file, a block at a time.
struct Appender<'a, T> {
    file: &'a ScratchFile,
    block: Vec<T>,
}

/// Bytes of an appender's block.
const BLOCK: usize = 64 << 10;

impl<'a, T: Pod> Appender<'a, T> {
    fn new(file: &'a ScratchFile) -> Self {
        let block = Vec::with_capacity(BLOCK / size_of::<T>());
        Appender { file, block }
    }

    fn push(&mut self, item: T) -> Result<()> {
        self.block.push(item);
        if self.block.len() == self.block.capacity() {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        self.file.append(bytemuck::cast_slice(&self.block))?;
        self.block.clear();
        Ok(())
    }
}

/// One thread's outputs, and the edge whose corners are arriving.
struct Thread<'a, W: Index> {
    patches: Writer<'a, Patch<W>>,
    cuts: Writer<'a, EdgeCorner<W>>,
    links: Appender<'a, Link<W>>,
    borders: Appender<'a, W>,
    /// The first two corners of the edge, and how many there were.
    group: [EdgeCorner<W>; 2],
    seen: u64,
    settled: Settled,
    chunk: u64,
    base: &'a [u64],
}

/// Runs the seam pass over the spilled corners; non-manifold ones go on to `cuts`.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn seams<W: Index>(
    job: &Job,
    chunked: &Chunked,
    edges: &Buckets<EdgeCorner<W>>,
    cuts: &Shuffle<EdgeCorner<W>>,
) -> Result<Seamed<W>> {
    let ws = job.ws;
    let threads = ws.workers.count() as u64;
    let plan = job.shuffle_plan(size_of::<Patch<W>>(), edges.records());
    let patches = Shuffle::<Patch<W>>::new(ws, "opposites", 0..job.shape.triangles.max(1), plan)?;
    let links = ws.scratch.file("links")?;
    let borders = ws.scratch.file("borders at seams")?;
    let settled = Mutex::new(Settled::default());
    let _blocks = ws
        .budget
        .lease("seam buffers", threads * 2 * BLOCK as u64)?;
    // The writers lease theirs as they start; what is left is for sorting.
    let writers = threads * (job.plan.writer + plan.writer_bytes());
    let memory = job.sort_memory(writers);
    ws.workers.run(
        edges.count(),
        || {
            let thread = Thread {
                patches: patches.writer()?,
                cuts: cuts.writer()?,
                links: Appender::new(&links),
                borders: Appender::new(&borders),
                group: [EdgeCorner::new((0, 0), 0, 0, false, 0, false); 2],
                seen: 0,
                settled: Settled::default(),
                chunk: job.plan.chunk,
                base: &chunked.base,
            };
            Ok((edges.sorter(memory)?, thread))
        },
        |(sorter, thread), bucket| {
            edges.sorted(bucket, sorter, &mut |batch| {
                ws.progress.advance(batch.len() as u64);
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
                batch.iter().try_for_each(|corner| thread.take(corner))
            })?;
            // An edge never goes on in the next bucket: buckets part by lo.
            thread.close()
        },
        |(_, mut thread)| {
            thread.links.flush()?;
            thread.borders.flush()?;
            settled
                .lock()
                .unwrap_or_else(|e| e.into_inner())
                .merge(&thread.settled);
            thread.patches.finish()?;
            thread.cuts.finish()
        },
    )?;
    Ok(Seamed {
        patches: patches.finish()?,
        links,
        borders,
        settled: settled.into_inner().unwrap_or_else(|e| e.into_inner()),
    })
}

impl<W: Index> Thread<'_, W> {
    fn take(&mut self, corner: &EdgeCorner<W>) -> Result<()> {
        if self.seen > 0 && self.group[0].edge() != corner.edge() {
            self.close()?;
        }
        match self.seen {
            0 | 1 => self.group[self.seen as usize] = *corner,
            2 => {
                self.cuts.push(self.group[0])?;
                self.cuts.push(self.group[1])?;
                self.cuts.push(*corner)?;
            }
            _ => self.cuts.push(*corner)?,
        }
        self.seen += 1;
        Ok(())
    }

    /// The edge is complete: settles it.
    fn close(&mut self) -> Result<()> {
        let [a, b] = self.group;
        match std::mem::take(&mut self.seen) {
            0 => {}
            1 => {
                self.settled.borders += 1;
                self.borders.push(W::of(self.component(&a)))?;
            }
            2 => {
                let parity = a.input_down() == b.input_down();
                self.settled.regular += 1;
                self.settled.inconsistent += u64::from(parity);
                self.patches.push(Patch::new(&a, &b, parity))?;
                self.patches.push(Patch::new(&b, &a, parity))?;
                let (from, to) = (self.component(&a), self.component(&b));
                let against = a.down() == b.down();
                if from != to || against {
                    self.links.push(Link::new(from, to, against))?;
                }
            }
            _ => self.settled.nonmanifold += 1,
        }
        Ok(())
    }

    fn component(&self, corner: &EdgeCorner<W>) -> u64 {
        self.base[(corner.triangle() / self.chunk) as usize] + corner.local()
    }
}
