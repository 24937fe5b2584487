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
//! and thread, two writers a thread; the table of chunks is [`Chunked`]'s. I/O: V read once, G once when coherent;
//! V, O, component written once; seam records and 24 bytes a local component to scratch.

use super::Job;
use super::arrays::{CoordReader, OutArray, TriangleReader};
use super::chunk_rows::{Rows, pack_flips};
use super::chunked::{ChunkInfo, Chunked, LocalRecords, Settled};
use super::first_read::read_again;
use super::records::{EdgeCorner, LocalCount, MeasureRecord};
use super::scan::Seams;
use super::stars::spill::{Block, Spilled, Spiller};
use super::whole::Whole;
use crate::chunk::grid::Grid;
use crate::chunk::ids::{LocalIds, NARROW_SPAN};
use crate::chunk::measure::{Coord, Measure, Measurer};
use crate::chunk::pair::Pairs;
use crate::chunk::star::{self, StarCount};
use crate::chunk::swirl::Swirl;
use crate::corner::{Index, next_k, prev_k};
use crate::disk::ScratchFile;
use crate::error::Result;
use crate::shuffle::{Shuffle, Writer};
use std::sync::Mutex;
use std::time::Instant;

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

/// Runs the chunk pass from where `chunked` says that it stopped, until all chunks are done or
/// `until` is past; true when all are.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`];
/// [`crate::Error::Input`] when the input changed since the scan.
pub fn chunks<I: Index, W: Index, X: Coord>(
    job: &Job,
    seams: &Seams,
    grid: &Grid,
    sinks: &Sinks<W>,
    (chunked, records, until): (&mut Chunked, &LocalRecords, Option<Instant>),
) -> Result<bool> {
    let ws = job.ws;
    let _scratch = job.chunk_lease("chunks")?;
    let whole = Whole::<X>::within(job, 3 * ws.workers.count() as u64 * job.plan.writer)?;
    let out = Outputs {
        counts: &records.counts,
        measures: &records.measures,
        flips: &chunked.flips,
    };
    let units = chunked.done..chunked.infos.len() as u64;
    let infos = Mutex::new(&mut chunked.infos);
    let settled = Mutex::new(&mut chunked.settled);
    let done = ws.workers.round(
        units,
        until,
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
    Ok(chunked.went_to(done))
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
        read_again(job, first, &self.ids)?;
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
