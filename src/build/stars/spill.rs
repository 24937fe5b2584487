//! What chunks and cells hand out of their stars.
//!
//! Why it works: see [`star`]. A chunk's vertices are open when they are seam
//! vertices, a cell's when a triangle at them lies in a smaller cell; either way all corners of
//! a vertex that is open anywhere are handed out by everyone who has some.
//!
//! Memory: three writers and a block a thread, and the kernel's. I/O: 32 bytes for each part of a
//! fan, 16 for each triangle that may have twins, 12 for each fan of a vertex with several, 4 for
//! each triangle with a twin (twice that for wide ids).

use super::super::Job;
use super::super::appender::{Appender, BLOCK};
use super::Valences;
use super::records::{Candidate, Fan, Part, Twin, pack};
use crate::chunk::pair::Pairs;
use crate::chunk::star::{self, NOTHING, Settled, Sink, StarCount, Stars};
use crate::corner::{Index, next_k, prev_k};
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Plan, Shuffle, Writer};
use std::sync::Mutex;

/// Writers of shuffles that a thread has for its stars.
pub const WRITERS: u64 = 3;
/// Bytes that a thread holds for what it appends.
pub const APPENDED: u64 = BLOCK as u64;

/// Where threads write to.
pub struct Spilled<W: Index> {
    /// Parts of fans, by vertex.
    parts: Shuffle<Part<W>>,
    /// Triangles that may have twins, by vertices.
    candidates: Shuffle<Candidate<W>>,
    /// Triangles with the same vertices as an earlier one.
    twins: Shuffle<Twin<W>>,
    /// [`Fan`]s of vertices with several.
    shared: ScratchFile,
    /// Vertices that were decided at once, by valence.
    valences: Mutex<Valences>,
    thread_bytes: u64,
}

impl<W: Index> Spilled<W> {
    /// Nothing yet, or `None` when stars are not wanted; about so many parts are expected.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn wanted(job: &Job, parts: u64) -> Result<Option<Spilled<W>>> {
        if !job.shape.measures {
            return Ok(None);
        }
        let (ws, t) = (job.ws, job.shape.triangles);
        let n = job.shape.vertices.max(1);
        let plans = Self::plans(job, parts);
        Ok(Some(Spilled {
            parts: Shuffle::new(ws, "parts of fans", 0..n, plans[0])?,
            candidates: Shuffle::new(ws, "triangles with twins, perhaps", 0..n, plans[1])?,
            twins: Shuffle::new(ws, "duplicate triangles", 0..t.max(1), plans[2])?,
            shared: ws.scratch.file("fans of vertices with several")?,
            valences: Mutex::default(),
            thread_bytes: plans.iter().map(Plan::writer_bytes).sum::<u64>() + APPENDED,
        }))
    }

    fn plans(job: &Job, parts: u64) -> [Plan; WRITERS as usize] {
        // Twins are few, but for stacks of triangles.
        let rare = job.shape.triangles / 64;
        [
            job.shuffle_plan(size_of::<Part<W>>(), parts),
            job.shuffle_plan(size_of::<Candidate<W>>(), rare),
            job.shuffle_plan(size_of::<Twin<W>>(), rare),
        ]
    }

    /// Bytes that a thread's writers and block take.
    pub fn thread_bytes(&self) -> u64 {
        self.thread_bytes
    }

    /// Parts that threads have handed in.
    pub fn parts(&self) -> u64 {
        self.parts.records()
    }

    /// All threads have finished.
    ///
    /// # Errors
    /// [`Error::Internal`] when one has not.
    pub fn finish(self) -> Result<Left<W>> {
        Ok(Left {
            parts: self.parts.finish()?,
            candidates: self.candidates.finish()?,
            twins: self.twins,
            shared: self.shared,
            valences: self
                .valences
                .into_inner()
                .unwrap_or_else(|e| e.into_inner()),
        })
    }

    /// One thread's way to it, with the kernel.
    ///
    /// # Errors
    /// [`Error::Budget`].
    pub fn spiller(&self) -> Result<Spiller<'_, W>> {
        Ok(Spiller {
            stars: Stars::default(),
            out: Out {
                parts: self.parts.writer()?,
                candidates: self.candidates.writer()?,
                twins: self.twins.writer()?,
                shared: Appender::new(&self.shared),
                valences: Valences::default(),
            },
            total: &self.valences,
        })
    }
}

impl<W: Index> Keep for Spilled<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.parts.keep(to)?;
        self.candidates.keep(to)?;
        self.twins.keep(to)?;
        to.file(&self.shared)?;
        self.valences
            .lock()
            .unwrap_or_else(|e| e.into_inner())
            .keep(to)?;
        to.number(self.thread_bytes)
    }

    fn restore(from: &mut Reader) -> Result<Spilled<W>> {
        Ok(Spilled {
            parts: Shuffle::restore(from)?,
            candidates: Shuffle::restore(from)?,
            twins: Shuffle::restore(from)?,
            shared: from.file()?,
            valences: Mutex::new(Valences::restore(from)?),
            thread_bytes: from.number()?,
        })
    }
}

/// What all threads handed out: see [`Spilled`].
pub struct Left<W: Index> {
    /// Parts of fans, by vertex.
    pub parts: Buckets<Part<W>>,
    /// Triangles that may have twins, by vertices.
    pub candidates: Buckets<Candidate<W>>,
    /// Triangles with the same vertices as an earlier one, so far.
    pub twins: Shuffle<Twin<W>>,
    /// [`Fan`]s of vertices with several.
    pub shared: ScratchFile,
    /// Vertices that were decided, by valence.
    pub valences: Valences,
}

/// What a chunk or a cell calls its corners and vertices.
pub trait Block {
    /// (triangle, place) of a local corner.
    fn corner(&self, corner: u32) -> (u64, usize);
    /// The vertex of a local one.
    fn vertex(&self, local: u32) -> u64;
    /// What the local component of a local triangle is called.
    fn called(&self, triangle: u32) -> u64;
}

/// One thread's stars.
pub struct Spiller<'a, W: Index> {
    stars: Stars,
    out: Out<'a, W>,
    total: &'a Mutex<Valences>,
}

impl<W: Index> Spiller<'_, W> {
    /// Finds the stars of a settled chunk or cell; gives what its local components count.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn settle<B: Block>(
        &mut self,
        of: &Settled,
        pairs: &Pairs,
        components: usize,
        block: &B,
    ) -> Result<&[StarCount]> {
        let out = &mut self.out;
        self.stars
            .settle(of, pairs, components, &mut Named { out, of, block })?;
        Ok(&self.stars.counts)
    }

    /// Gives back the kernel's memory.
    pub fn shrink(&mut self) {
        self.stars = Stars::default();
    }

    /// Hands out all of a triangle whose edges are not decided here; its local component is called
    /// by itself.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn alone(&mut self, t: u64, v: [u64; 3]) -> Result<()> {
        for k in 0..3 {
            let (n, p) = (next_k(k), prev_k(k));
            // The corner before k faces the edge to the corner behind it, and the other way round.
            let ends = [(v[p], pack((t, n))), (v[n], pack((t, p)))];
            self.out
                .parts
                .push(Part::new(v[k], 1, (t, t), Some(ends)))?;
        }
        self.out.candidates.push(Candidate::new(v, t))
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// [`Error::DiskLimit`], [`Error::Io`].
    pub fn finish(self) -> Result<()> {
        let Out {
            parts,
            candidates,
            twins,
            mut shared,
            valences,
        } = self.out;
        let mut total = self.total.lock().unwrap_or_else(|e| e.into_inner());
        total.merge(&valences);
        drop(total);
        shared.flush()?;
        parts.finish()?;
        candidates.finish()?;
        twins.finish()
    }
}

struct Out<'a, W: Index> {
    parts: Writer<'a, Part<W>>,
    candidates: Writer<'a, Candidate<W>>,
    twins: Writer<'a, Twin<W>>,
    shared: Appender<'a, Fan<W>>,
    valences: Valences,
}

/// Turns local ids into those of the mesh on their way out.
struct Named<'o, 'w, 's, W: Index, B> {
    out: &'o mut Out<'w, W>,
    of: &'s Settled<'s>,
    block: &'s B,
}

impl<W: Index, B: Block> Named<'_, '_, '_, W, B> {
    /// (triangle, what its local component is called) of a local corner.
    fn at(&self, corner: u32) -> (u64, u64) {
        let t = self.block.corner(corner).0;
        (t, self.block.called(corner / 3))
    }
}

impl<W: Index, B: Block> Sink for Named<'_, '_, '_, W, B> {
    type Error = Error;

    #[inline]
    fn valence(&mut self, corners: u32) {
        self.out.valences.add(u64::from(corners));
    }

    fn shared(&mut self, corner: u32) -> Result<()> {
        let v = self.block.vertex(self.of.local[corner as usize]);
        let (t, called) = self.at(corner);
        self.out.shared.push(Fan([v, t, called].map(W::of)))
    }

    fn part(&mut self, part: &star::Part) -> Result<()> {
        let (block, v) = (self.block, self.block.vertex(part.vertex));
        let ends = (part.ends[0].corner != NOTHING).then(|| {
            part.ends.map(|end| {
                let to = match end.to {
                    NOTHING => u64::MAX,
                    to => block.vertex(to),
                };
                (to, pack(block.corner(end.corner)))
            })
        });
        let at = self.at(part.corner);
        self.out.parts.push(Part::new(v, part.corners, at, ends))
    }

    fn twins(&mut self, a: u32, b: u32) -> Result<()> {
        let t = |triangle: u32| self.block.corner(3 * triangle).0;
        self.out.twins.push(Twin([W::of(t(a).max(t(b)))]))
    }

    fn candidate(&mut self, triangle: u32) -> Result<()> {
        let at = 3 * triangle as usize;
        let v = [0, 1, 2].map(|k| self.block.vertex(self.of.local[at + k]));
        let t = self.block.corner(3 * triangle).0;
        self.out.candidates.push(Candidate::new(v, t))
    }
}
