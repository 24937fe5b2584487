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
use super::appender::{Appender, BLOCK};
use super::chunked::Settled;
use super::cuts::Sorted;
use super::records::{EdgeCorner, Link, Patch};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Shuffle, Writer};
use std::sync::Mutex;
use std::time::Instant;

/// What the seam pass reads and where it writes, and how far it is.
pub struct Seaming<W: Index> {
    /// The corners to settle.
    pub edges: Buckets<EdgeCorner<W>>,
    /// Corners on non-manifold edges.
    pub cuts: Shuffle<EdgeCorner<W>>,
    /// Opposites to fill into O, by triangle.
    pub patches: Shuffle<Patch<W>>,
    /// [`Link`]s between local components.
    pub links: ScratchFile,
    /// For each border edge, its local component.
    pub borders: ScratchFile,
    /// Totals of what was settled so far; `spilled` are the corners that came.
    pub settled: Settled,
    /// Buckets of corners that were settled.
    pub done: u64,
}

impl<W: Index> Keep for Seaming<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.edges.keep(to)?;
        self.cuts.keep(to)?;
        self.patches.keep(to)?;
        to.file(&self.links)?;
        to.file(&self.borders)?;
        self.settled.keep(to)?;
        to.number(self.done)
    }

    fn restore(from: &mut Reader) -> Result<Seaming<W>> {
        Ok(Seaming {
            edges: Buckets::restore(from)?,
            cuts: Shuffle::restore(from)?,
            patches: Shuffle::restore(from)?,
            links: from.file()?,
            borders: from.file()?,
            settled: Settled::restore(from)?,
            done: from.number()?,
        })
    }
}

/// What the seam pass leaves.
pub struct Seamed<W: Index> {
    /// Corners on non-manifold edges.
    pub cuts: Sorted,
    /// How many those are.
    pub cut_corners: u64,
    /// Opposites to fill into O, by triangle.
    pub patches: Buckets<Patch<W>>,
    /// [`Link`]s between local components.
    pub links: ScratchFile,
    /// For each border edge, its local component.
    pub borders: ScratchFile,
    /// Totals of what was settled.
    pub settled: Settled,
}

impl<W: Index> Seaming<W> {
    /// All is settled: sorts the corners on non-manifold edges.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn finish(self, job: &Job) -> Result<Seamed<W>> {
        drop(self.edges);
        let cuts = self.cuts.finish()?;
        Ok(Seamed {
            cut_corners: cuts.records(),
            cuts: Sorted::new(job, &cuts)?,
            patches: self.patches.finish()?,
            links: self.links,
            borders: self.borders,
            settled: self.settled,
        })
    }
}

/// One thread's outputs, and the edge whose corners are arriving.
struct Thread<'a, W: Index, C> {
    patches: Writer<'a, Patch<W>>,
    cuts: Writer<'a, EdgeCorner<W>>,
    links: Appender<'a, Link<W>>,
    borders: Appender<'a, W>,
    /// The first two corners of the edge, and how many there were.
    group: [EdgeCorner<W>; 2],
    seen: u64,
    settled: Settled,
    /// Corners on non-manifold edges.
    cut: u64,
    call: &'a C,
}

/// Runs the seam pass from where it stopped, until all is settled or `until` is past; true when all
/// is. `call` says how links and borders call a corner's local component.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn seams<W: Index, C: Fn(&EdgeCorner<W>) -> u64 + Sync>(
    job: &Job,
    seaming: &mut Seaming<W>,
    until: Option<Instant>,
    call: C,
) -> Result<bool> {
    let ws = job.ws;
    let threads = ws.workers.count() as u64;
    let Seaming {
        edges,
        cuts,
        patches,
        links,
        borders,
        settled,
        done,
    } = seaming;
    let (edges, cuts, patches) = (&*edges, &*cuts, &*patches);
    let total = Mutex::new(settled);
    let _blocks = ws
        .budget
        .lease("seam buffers", threads * 2 * BLOCK as u64)?;
    // The writers lease theirs as they start; what is left is for sorting.
    let writers = threads * (job.plan.writer + patches.writer_bytes());
    let memory = job.sort_memory(writers);
    *done = ws.workers.round(
        *done..edges.count(),
        until,
        || {
            let thread = Thread {
                patches: patches.writer()?,
                cuts: cuts.writer()?,
                links: Appender::new(links),
                borders: Appender::new(borders),
                group: [EdgeCorner::new((0, 0), 0, 0, false, 0, false); 2],
                seen: 0,
                settled: Settled::default(),
                cut: 0,
                call: &call,
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
            let own = &thread.settled;
            let found = own.borders + 2 * own.regular + thread.cut;
            conserve("seams", "corners of a thread", own.spilled, found)?;
            total.lock().unwrap_or_else(|e| e.into_inner()).merge(own);
            thread.patches.finish()?;
            thread.cuts.finish()
        },
    )?;
    let all = *done == edges.count();
    if all {
        let came = total
            .into_inner()
            .unwrap_or_else(|e| e.into_inner())
            .spilled;
        conserve("seams", "corners", edges.records(), came)?;
    }
    Ok(all)
}

impl<W: Index, C: Fn(&EdgeCorner<W>) -> u64> Thread<'_, W, C> {
    fn take(&mut self, corner: &EdgeCorner<W>) -> Result<()> {
        if self.seen > 0 && self.group[0].edge() != corner.edge() {
            self.close()?;
        }
        match self.seen {
            0 | 1 => self.group[self.seen as usize] = *corner,
            2 => {
                self.cut += 3;
                self.cuts.push(self.group[0])?;
                self.cuts.push(self.group[1])?;
                self.cuts.push(*corner)?;
            }
            _ => {
                self.cut += 1;
                self.cuts.push(*corner)?;
            }
        }
        self.settled.spilled += 1;
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
                self.borders.push(W::of((self.call)(&a)))?;
            }
            2 => {
                let parity = a.input_down() == b.input_down();
                self.settled.regular += 1;
                self.settled.inconsistent += u64::from(parity);
                self.patches
                    .push(Patch::new(a.corner(), b.corner(), parity))?;
                self.patches
                    .push(Patch::new(b.corner(), a.corner(), parity))?;
                let (from, to) = ((self.call)(&a), (self.call)(&b));
                let against = a.down() == b.down();
                if from != to || against {
                    self.links.push(Link::new(from, to, against))?;
                }
            }
            _ => self.settled.nonmanifold += 1,
        }
        Ok(())
    }
}
