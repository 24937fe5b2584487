//! What the chunks leave: the table of chunks, the files of their local components, and the counts.
//!
//! Why it may be written down while the pass is under way: chunks are done in ascending order, so all
//! before one are in the table, and the files hold at least theirs; what others appended is not named
//! by the table.
//!
//! Memory: [`table_bytes`]. I/O: none but what is asked for.

use super::records::LocalCount;
use super::scratch_items;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::{Error, Result};
use std::ops::Range;

/// What later passes need to know of a chunk.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChunkInfo {
    /// Number of its local components.
    pub locals: u32,
    /// Its degenerate triangles.
    pub degenerate: u32,
    /// Where its [`LocalCount`]s lie in the counts file.
    pub counts_at: u64,
    /// Where its [`MeasureRecord`](super::records::MeasureRecord)s lie in the measures file; `None` when they are deferred, or
    /// the mesh has no coordinates.
    pub measures_at: Option<u64>,
    /// True when the swirl flipped a triangle in it.
    pub flips: bool,
    /// True when a local component in it contradicts itself.
    pub conflicts: bool,
}

/// What the chunk pass found in all chunks together.
#[derive(Clone, Copy, Debug, Default)]
pub struct Settled {
    /// Regular edges.
    pub regular: u64,
    /// Border edges.
    pub borders: u64,
    /// Non-manifold edges.
    pub nonmanifold: u64,
    /// Regular edges whose triangles disagreed.
    pub inconsistent: u64,
    /// Degenerate triangles.
    pub degenerate: u64,
    /// Corners spilled to the seam pass.
    pub spilled: u64,
}

/// What the chunk pass leaves in memory and scratch.
pub struct Chunked {
    /// Chunks that are done.
    pub done: u64,
    /// By chunk.
    pub infos: Vec<ChunkInfo>,
    /// Number of local components in the chunks before each, and in all at the end; once all
    /// chunks are done.
    pub base: Vec<u64>,
    /// Packed flip bits, [`Job::flip_bytes`](super::Job::flip_bytes) for each chunk that has flips.
    pub flips: ScratchFile,
    /// Totals.
    pub settled: Settled,
    lease: Lease,
}

/// What chunks know of their local components, until it is summed.
pub struct LocalRecords {
    /// [`LocalCount`] of every local component.
    pub counts: ScratchFile,
    /// [`MeasureRecord`](super::records::MeasureRecord) of the local components of chunks that were measured.
    pub measures: ScratchFile,
}

/// Bytes of the table of so many chunks.
pub fn table_bytes(chunks: u64) -> u64 {
    // With the lists of later passes: a word a chunk for each of three.
    chunks * (size_of::<ChunkInfo>() as u64 + 24)
}

/// The number of the first local component of each chunk, and of all together.
fn base(infos: &[ChunkInfo]) -> Vec<u64> {
    let mut base = Vec::with_capacity(infos.len() + 1);
    let mut sum = 0;
    for info in infos {
        base.push(sum);
        sum += u64::from(info.locals);
    }
    base.push(sum);
    base
}

impl Keep for Chunked {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(self.infos.len() as u64)?;
        to.number(self.done)?;
        self.infos.iter().try_for_each(|info| info.keep(to))?;
        to.file(&self.flips)?;
        self.settled.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Chunked> {
        let (chunks, done) = (from.number()?, from.number()?);
        let lease = from
            .budget
            .lease("the table of chunks", table_bytes(chunks))?;
        let infos = (0..chunks).map(|_| ChunkInfo::restore(from));
        let infos = infos.collect::<Result<Vec<_>>>()?;
        let mut chunked = Chunked {
            done,
            infos,
            base: Vec::new(),
            flips: from.file()?,
            settled: Settled::restore(from)?,
            lease,
        };
        chunked.went_to(done);
        Ok(chunked)
    }
}

impl Keep for LocalRecords {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.file(&self.counts)?;
        to.file(&self.measures)
    }

    fn restore(from: &mut Reader) -> Result<LocalRecords> {
        Ok(LocalRecords {
            counts: from.file()?,
            measures: from.file()?,
        })
    }
}

impl LocalRecords {
    /// None yet.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(ws: &Workspace) -> Result<LocalRecords> {
        Ok(LocalRecords {
            counts: ws.scratch.file("counts of local components")?,
            measures: ws.scratch.file("measures of local components")?,
        })
    }
}

impl Chunked {
    /// Of so many chunks none yet.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn new(ws: &Workspace, chunks: u64) -> Result<Chunked> {
        Ok(Chunked {
            lease: ws
                .budget
                .lease("the table of chunks", table_bytes(chunks))?,
            done: 0,
            infos: vec![ChunkInfo::default(); chunks as usize],
            base: Vec::new(),
            flips: ws.scratch.file("flips")?,
            settled: Settled::default(),
        })
    }

    /// All chunks before this one are done; true when all are.
    pub fn went_to(&mut self, done: u64) -> bool {
        self.done = done;
        let all = done == self.infos.len() as u64;
        if all {
            self.base = base(&self.infos);
        }
        all
    }

    /// Hands the numbers of local components that contradict themselves to `each`.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], and those of `each`.
    pub fn conflicts(
        &self,
        ws: &Workspace,
        records: &LocalRecords,
        each: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let chunks = self.infos.iter().zip(&self.base);
        for (info, &base) in chunks.filter(|(info, _)| info.conflicts) {
            let bytes = u64::from(info.locals) * size_of::<LocalCount>() as u64;
            let mut numbers = base..;
            scratch_items(ws, &records.counts, info.counts_at, bytes, &mut |counts| {
                for (count, number) in (counts as &[LocalCount]).iter().zip(&mut numbers) {
                    if count.borders & LocalCount::CONFLICT != 0 {
                        each(number)?;
                    }
                }
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Number of local components.
    pub fn locals(&self) -> u64 {
        *self.base.last().unwrap_or(&0)
    }

    /// The local components of a chunk, numbered through the mesh.
    pub fn locals_of(&self, chunk: u64) -> Range<u64> {
        let base = self.base[chunk as usize];
        base..base + u64::from(self.infos[chunk as usize].locals)
    }

    /// Bytes of the table of chunks.
    pub fn table_bytes(&self) -> u64 {
        self.lease.bytes()
    }
}

impl Settled {
    pub(super) fn merge(&mut self, other: &Settled) {
        self.regular += other.regular;
        self.borders += other.borders;
        self.nonmanifold += other.nonmanifold;
        self.inconsistent += other.inconsistent;
        self.degenerate += other.degenerate;
        self.spilled += other.spilled;
    }
}

impl Keep for Settled {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.list(&[
            self.regular,
            self.borders,
            self.nonmanifold,
            self.inconsistent,
            self.degenerate,
            self.spilled,
        ])
    }

    fn restore(from: &mut Reader) -> Result<Settled> {
        let numbers = from.list::<u64>()?;
        let [
            regular,
            borders,
            nonmanifold,
            inconsistent,
            degenerate,
            spilled,
        ] = numbers[..]
        else {
            return Err(Error::Internal(
                "a journal with other numbers of edges".into(),
            ));
        };
        Ok(Settled {
            regular,
            borders,
            nonmanifold,
            inconsistent,
            degenerate,
            spilled,
        })
    }
}

impl Keep for ChunkInfo {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let bits = u64::from(self.flips) | u64::from(self.conflicts) << 1;
        let measures = self.measures_at.unwrap_or(u64::MAX);
        to.number(u64::from(self.locals) | u64::from(self.degenerate) << 32)?;
        [self.counts_at, measures, bits]
            .into_iter()
            .try_for_each(|number| to.number(number))
    }

    fn restore(from: &mut Reader) -> Result<ChunkInfo> {
        let two = from.number()?;
        let [counts_at, measures, bits] = [from.number()?, from.number()?, from.number()?];
        Ok(ChunkInfo {
            locals: two as u32,
            degenerate: (two >> 32) as u32,
            counts_at,
            measures_at: (measures != u64::MAX).then_some(measures),
            flips: bits & 1 == 1,
            conflicts: bits & 2 == 2,
        })
    }
}
