//! Chunks: settles in each chunk what can be settled there, in parallel, each thread with its
//! own scratch memory.
//!
//! Why it works: see [`pair`](crate::chunk::pair) and [`swirl`](crate::chunk::swirl). O, V and
//! the local labels of a chunk are contiguous ranges, written where they belong as if each
//! local component's first triangle kept its orientation and its label; the finish pass
//! rewrites only what turns out otherwise. What hangs on edges between two seam vertices goes
//! to the seam pass with its chunk-local component and flip.
//!
//! Memory: [`Shape::chunk_bytes`](super::plan::Shape::chunk_bytes) for each triangle of a chunk
//! and thread, two writers a thread, 64 bytes a chunk. I/O: V read once, G once when coherent;
//! V, O, component written once; seam records and 24 bytes a local component to scratch.

use super::Job;
use super::arrays::{CoordReader, OutArray, TriangleReader, bad_index};
use super::chunk_rows::{Rows, pack_flips};
use super::records::{EdgeCorner, LocalCount, MeasureRecord};
use super::scan::Seams;
use super::scratch_items;
use super::stars::spill::{Block, Spilled, Spiller};
use super::whole::Whole;
use crate::chunk::grid::Grid;
use crate::chunk::ids::{LocalIds, NARROW_SPAN};
use crate::chunk::measure::{Coord, Measure, Measurer};
use crate::chunk::pair::Pairs;
use crate::chunk::star::{self, StarCount};
use crate::chunk::swirl::Swirl;
use crate::corner::{Index, next_k, prev_k};
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::Result;
use crate::shuffle::{Shuffle, Writer};
use std::ops::Range;
use std::sync::Mutex;

/// What later passes need to know of a chunk.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChunkInfo {
    /// Number of its local components.
    pub locals: u32,
    /// Its degenerate triangles.
    pub degenerate: u32,
    /// Where its [`LocalCount`]s lie in the counts file.
    pub counts_at: u64,
    /// Where its [`MeasureRecord`]s lie in the measures file; `None` when they are deferred, or
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
    /// By chunk.
    pub infos: Vec<ChunkInfo>,
    /// Number of local components in the chunks before each, and in all at the end.
    pub base: Vec<u64>,
    /// [`LocalCount`] of every local component.
    pub counts: ScratchFile,
    /// [`MeasureRecord`] of the local components of chunks that were measured.
    pub measures: ScratchFile,
    /// Packed flip bits, [`Job::flip_bytes`] for each chunk that has flips.
    pub flips: ScratchFile,
    /// Totals.
    pub settled: Settled,
    lease: Lease,
}

/// The shuffles and files that chunks write to.
pub struct Sinks<'a, W: Index> {
    /// Corners on edges between two seam vertices.
    pub edges: &'a Shuffle<EdgeCorner<W>>,
    /// Corners on settled non-manifold edges.
    pub cuts: &'a Shuffle<EdgeCorner<W>>,
    /// V of the new folder.
    pub v: &'a OutArray,
    /// O of the new folder.
    pub o: &'a OutArray,
    /// Component of the new folder; local labels until the finish pass.
    pub component: &'a OutArray,
    /// What is left of vertex stars, when they are wanted.
    pub stars: Option<&'a Spilled<W>>,
}

/// Scratch memory of one thread.
struct Thread<'a, I, W: Index, X> {
    reader: TriangleReader<'a, I>,
    coords: Option<CoordReader<'a, X>>,
    whole: Option<&'a Whole<X>>,
    positions: Vec<[X; 3]>,
    edges: Writer<'a, EdgeCorner<W>>,
    cuts: Writer<'a, EdgeCorner<W>>,
    kernels: Kernels,
    stars: Option<Spiller<'a, W>>,
    out: Vec<I>,
    counts: Vec<LocalCount>,
    measurer: Measurer,
    measures: Vec<Measure>,
    records: Vec<MeasureRecord>,
    bits: Vec<u8>,
    settled: Settled,
}

#[derive(Default)]
struct Kernels {
    ids: LocalIds,
    seam: Vec<bool>,
    pairs: Pairs,
    swirl: Swirl,
}

/// Runs the chunk pass.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`];
/// [`crate::Error::Input`] when the input changed since the scan.
pub fn chunks<I: Index, W: Index, X: Coord>(
    job: &Job,
    seams: &Seams,
    grid: &Grid,
    sinks: &Sinks<W>,
) -> Result<Chunked> {
    let ws = job.ws;
    let chunks = job.plan.chunks(job.shape.triangles);
    let lease = ws
        .budget
        .lease("the table of chunks", table_bytes(chunks))?;
    let _scratch = job.chunk_lease("chunks")?;
    let whole = Whole::<X>::within(job, 3 * ws.workers.count() as u64 * job.plan.writer)?;
    let infos = Mutex::new(vec![ChunkInfo::default(); chunks as usize]);
    let counts = ws.scratch.file("counts of local components")?;
    let measures = ws.scratch.file("measures of local components")?;
    let flips = ws.scratch.file("flips")?;
    let settled = Mutex::new(Settled::default());
    let out = Outputs {
        counts: &counts,
        measures: &measures,
        flips: &flips,
    };
    ws.workers.run(
        chunks,
        || Thread::<I, W, X>::new(job, sinks, whole.as_ref()),
        |thread, chunk| {
            let info = thread.chunk(job, seams, grid, sinks, &out, chunk)?;
            infos.lock().unwrap_or_else(|e| e.into_inner())[chunk as usize] = info;
            ws.progress.advance(job.chunk_range(chunk).1);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |thread| {
            settled
                .lock()
                .unwrap_or_else(|e| e.into_inner())
                .merge(&thread.settled);
            thread.edges.finish()?;
            thread.cuts.finish()?;
            thread.stars.map_or(Ok(()), Spiller::finish)
        },
    )?;
    let infos = infos.into_inner().unwrap_or_else(|e| e.into_inner());
    Ok(Chunked {
        base: base(&infos),
        infos,
        counts,
        measures,
        flips,
        settled: settled.into_inner().unwrap_or_else(|e| e.into_inner()),
        lease,
    })
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
        self.infos.iter().try_for_each(|info| info.keep(to))?;
        for file in [&self.counts, &self.measures, &self.flips] {
            to.file(file)?;
        }
        self.settled.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Chunked> {
        let chunks = from.number()?;
        let lease = from
            .budget
            .lease("the table of chunks", table_bytes(chunks))?;
        let infos = (0..chunks).map(|_| ChunkInfo::restore(from));
        let infos = infos.collect::<Result<Vec<_>>>()?;
        Ok(Chunked {
            base: base(&infos),
            infos,
            counts: from.file()?,
            measures: from.file()?,
            flips: from.file()?,
            settled: Settled::restore(from)?,
            lease,
        })
    }
}

impl Chunked {
    /// Hands the numbers of local components that contradict themselves to `each`.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], and those of `each`.
    pub fn conflicts(&self, ws: &Workspace, each: &mut dyn FnMut(u64) -> Result<()>) -> Result<()> {
        let chunks = self.infos.iter().zip(&self.base);
        for (info, &base) in chunks.filter(|(info, _)| info.conflicts) {
            let bytes = u64::from(info.locals) * size_of::<LocalCount>() as u64;
            let mut numbers = base..;
            scratch_items(ws, &self.counts, info.counts_at, bytes, &mut |counts| {
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

/// The scratch files that chunks append to.
struct Outputs<'a> {
    counts: &'a ScratchFile,
    measures: &'a ScratchFile,
    flips: &'a ScratchFile,
}

impl<'a, I: Index, W: Index, X: Coord> Thread<'a, I, W, X> {
    fn new(job: &'a Job, sinks: &Sinks<'a, W>, whole: Option<&'a Whole<X>>) -> Result<Self> {
        Ok(Thread {
            reader: TriangleReader::last(&job.mesh.v),
            coords: job.g.as_ref().map(CoordReader::new),
            whole,
            positions: Vec::new(),
            edges: sinks.edges.writer()?,
            cuts: sinks.cuts.writer()?,
            kernels: Kernels::default(),
            stars: sinks.stars.map(Spilled::spiller).transpose()?,
            out: Vec::new(),
            counts: Vec::new(),
            measurer: Measurer::default(),
            measures: Vec::new(),
            records: Vec::new(),
            bits: Vec::new(),
            settled: Settled::default(),
        })
    }

    fn chunk(
        &mut self,
        job: &Job,
        seams: &Seams,
        grid: &Grid,
        sinks: &Sinks<W>,
        out: &Outputs,
        chunk: u64,
    ) -> Result<ChunkInfo> {
        let (first, count) = job.chunk_range(chunk);
        let v = self.reader.read(first, count)?;
        self.kernels.run(v, seams, job, first)?;
        let rows = Rows {
            v,
            opposite: &self.kernels.pairs.opposite,
            label: &self.kernels.swirl.label,
            first,
            apply: job.applies_flips() && self.kernels.swirl.any_flip(),
        };
        // Neighbours are at work at the same time: they write to different files first, since a
        // file takes one writer at a time.
        if chunk.is_multiple_of(2) {
            rows.write_v(sinks.v, &mut self.out)?;
            rows.write_o(sinks.o, &mut self.out)?;
        } else {
            rows.write_o(sinks.o, &mut self.out)?;
            rows.write_v(sinks.v, &mut self.out)?;
        }
        rows.write_labels(sinks.component, &mut self.out)?;
        self.spill(first)?;
        self.settled.add(&self.kernels.pairs);
        let info = self.summarise(job, grid, out, chunk)?;
        Ok(info)
    }

    /// Hands out the corners that others must settle, and the non-manifold ones.
    fn spill(&mut self, first: u64) -> Result<()> {
        let Kernels {
            ids, pairs, swirl, ..
        } = &self.kernels;
        for (list, writer) in [
            (&pairs.seams, &mut self.edges),
            (&pairs.cuts, &mut self.cuts),
        ] {
            for directed in list {
                let (t, k) = ((directed >> 1) / 3, (directed >> 1) as usize % 3);
                let label = swirl.label[t as usize];
                let place = |k: usize| ids.global(ids.local()[3 * t as usize + k]);
                let (from, to) = (place(next_k(k)), place(prev_k(k)));
                let flipped = label & 1 == 1;
                writer.push(EdgeCorner::new(
                    (from.min(to), from.max(to)),
                    first + u64::from(t),
                    k as u64,
                    flipped,
                    u64::from(label >> 1),
                    (from > to) ^ flipped,
                ))?;
            }
        }
        Ok(())
    }

    /// Writes what the chunk knows of its local components.
    fn summarise(
        &mut self,
        job: &Job,
        grid: &Grid,
        out: &Outputs,
        chunk: u64,
    ) -> Result<ChunkInfo> {
        let swirl = &self.kernels.swirl;
        self.counts.clear();
        self.counts
            .extend(swirl.components.iter().map(|c| LocalCount {
                first: c.first,
                triangles: c.triangles,
                flipped: c.flipped,
                borders: c.borders | if c.conflict { LocalCount::CONFLICT } else { 0 },
                rings: 0,
                loops: 0,
            }));
        if let Some(stars) = &mut self.stars {
            let first = job.chunk_range(chunk).0;
            let found = self.kernels.stars(stars, first)?;
            for (count, star) in self.counts.iter_mut().zip(found) {
                (count.rings, count.loops) = (star.rings, star.loops);
            }
        }
        let swirl = &self.kernels.swirl;
        let conflicts = swirl.components.iter().any(|c| c.conflict);
        let flips = swirl.any_flip();
        if flips {
            pack_flips(&swirl.label, &mut self.bits);
            out.flips.write_at(&self.bits, chunk * job.flip_bytes())?;
        }
        Ok(ChunkInfo {
            locals: self.counts.len() as u32,
            degenerate: self.kernels.pairs.degenerate as u32,
            counts_at: out.counts.append(bytemuck::cast_slice(&self.counts))?,
            measures_at: self.measure(job, grid, out)?,
            flips,
            conflicts,
        })
    }

    /// Measures the local components now, when they are few and their coordinates at hand.
    fn measure(&mut self, job: &Job, grid: &Grid, out: &Outputs) -> Result<Option<u64>> {
        let Kernels { ids, swirl, .. } = &self.kernels;
        let few = swirl.components.len() as u64 <= job.plan.chunk / 16 + 8;
        let (Some(coords), true) = (&mut self.coords, few) else {
            return Ok(None);
        };
        // As many as the memory of a narrow chunk holds.
        let span = ids.span() as u64;
        let fits = span <= NARROW_SPAN * swirl.label.len() as u64;
        let positions = match (ids.window(), self.whole) {
            (Some(first), _) => coords.read(first, span)?,
            (None, Some(whole)) if fits => {
                let g = whole.rows()?;
                self.positions.clear();
                let rows = ids.table().iter().map(|&v| g[v as usize]);
                self.positions.extend(rows);
                whole.took(self.positions.len());
                &self.positions
            }
            _ => return Ok(None),
        };
        self.measures.clear();
        self.measures
            .resize(swirl.components.len(), Measure::default());
        self.measurer.measure(
            grid,
            ids.local(),
            &swirl.label,
            positions,
            &[],
            &mut self.measures,
        );
        self.records.clear();
        self.records
            .extend(self.measures.iter().map(MeasureRecord::new));
        Ok(Some(
            out.measures.append(bytemuck::cast_slice(&self.records))?,
        ))
    }
}

impl Settled {
    /// Counts what was paired.
    pub(super) fn add(&mut self, pairs: &Pairs) {
        self.regular += pairs.regular;
        self.borders += pairs.borders;
        self.nonmanifold += pairs.nonmanifold;
        self.inconsistent += pairs.inconsistent;
        self.degenerate += pairs.degenerate;
        self.spilled += pairs.seams.len() as u64;
    }
}

impl Kernels {
    fn run<I: Index>(&mut self, v: &[I], seams: &Seams, job: &Job, first: u64) -> Result<()> {
        self.ids.assign(v);
        let n = job.shape.vertices;
        let last = match self.ids.window() {
            Some(first) => first + self.ids.span() as u64,
            None => self.ids.table().iter().max().map_or(0, |&top| top + 1),
        };
        if last > n {
            let found = format!("{} (the file changed during the build)", last - 1);
            return Err(bad_index(&job.mesh.v, 3 * first, found));
        }
        seams.flags(&self.ids, &mut self.seam);
        self.pairs.pair(self.ids.local(), &self.seam);
        self.swirl.walk(&self.pairs.opposite);
        Ok(())
    }

    /// Finds the stars of the chunk, which begins with triangle `first`; gives what its local
    /// components count.
    fn stars<'s, W: Index>(
        &self,
        stars: &'s mut Spiller<'_, W>,
        first: u64,
    ) -> Result<&'s [StarCount]> {
        let settled = star::Settled {
            local: self.ids.local(),
            span: self.ids.span(),
            label: &self.swirl.label,
            open: &self.seam,
        };
        let block = Settling {
            kernels: self,
            first,
        };
        let components = self.swirl.components.len();
        stars.settle(&settled, &self.pairs, components, &block)
    }
}

/// A chunk that begins with triangle `first`, and what it calls things.
struct Settling<'a> {
    kernels: &'a Kernels,
    first: u64,
}

impl Block for Settling<'_> {
    #[inline]
    fn corner(&self, corner: u32) -> (u64, usize) {
        (self.first + u64::from(corner / 3), corner as usize % 3)
    }

    #[inline]
    fn vertex(&self, local: u32) -> u64 {
        self.kernels.ids.global(local)
    }

    #[inline]
    fn called(&self, triangle: u32) -> u64 {
        u64::from(self.kernels.swirl.label[triangle as usize] >> 1)
    }
}
