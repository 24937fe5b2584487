//! Measures of the chunks that could not measure themselves: those whose vertices lie far
//! apart in G, or that have nearly as many local components as triangles.
//!
//! Why it works: by now the component of each triangle is known, so that a triangle adds to it at
//! once, and crowds of local components go in one piece each. Vertices that lie far apart are
//! looked up when all of G fits, and else [asked for](super::asked). Sums do not depend on the
//! order.
//!
//! Memory: G or a window of it, a tally, labels and a piece of V a thread. I/O: V of such chunks
//! once more, G once, and what asking takes.

use super::Job;
use super::arrays::{CoordReader, OutArray, TriangleReader};
use super::asked::{Adds, Ask, measure_asked, questions};
use super::chunked::{Chunked, LocalRecords};
use super::first_read::read_again;
use super::graph::labels::LabelRange;
use super::records::LocalCount;
use super::stitch::Labels;
use super::tally::{Pieces, Tally};
use super::whole::Whole;
use crate::chunk::ids::LocalIds;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::{Error, Result};
use crate::input::CoordArray;
use crate::shuffle::{Shuffle, Writer};

/// What the pass works with.
pub struct Deferred<'a, W> {
    /// The job.
    pub job: &'a Job<'a>,
    /// Chunks.
    pub chunked: &'a Chunked,
    /// What they know of their local components.
    pub records: &'a LocalRecords,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// Local labels of the triangles.
    pub component: &'a OutArray,
    /// Where sums go.
    pub pieces: &'a Pieces<'a>,
}

/// Local labels and flips of one chunk, read back.
#[derive(Default)]
pub struct ChunkLabels<I> {
    /// Local component of each triangle, or NONE.
    pub labels: Vec<I>,
    bits: Vec<u8>,
    chunk: Option<u64>,
}

impl<I: Index> ChunkLabels<I> {
    /// Bytes held for each triangle of a chunk.
    pub const BYTES: u64 = I::BYTES as u64 + 1;

    /// None yet.
    pub fn new() -> Self {
        ChunkLabels {
            labels: Vec::new(),
            bits: Vec::new(),
            chunk: None,
        }
    }

    /// The labels were changed: they are no longer what the file's chunk pass wrote.
    pub fn forget(&mut self) {
        self.chunk = None;
    }

    /// Reads those of a chunk, unless they are there.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn load(
        &mut self,
        job: &Job,
        chunked: &Chunked,
        component: &OutArray,
        chunk: u64,
    ) -> Result<()> {
        if self.chunk == Some(chunk) {
            return Ok(());
        }
        let (first, count) = job.chunk_range(chunk);
        self.labels.resize(count as usize, I::NONE);
        component.read(first, &mut self.labels)?;
        self.bits.clear();
        if chunked.infos[chunk as usize].flips {
            self.bits.resize(count.div_ceil(8) as usize, 0);
            chunked
                .flips
                .read_at(&mut self.bits, chunk * job.flip_bytes())?;
        }
        self.chunk = Some(chunk);
        Ok(())
    }

    /// True when the swirl flipped triangle i of the chunk.
    #[inline]
    pub fn flipped(&self, i: usize) -> bool {
        self.bits
            .get(i / 8)
            .is_some_and(|byte| byte >> (i % 8) & 1 == 1)
    }
}

/// Counts and measures the chunks that the chunk pass did not measure.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn measure_deferred<I: Index, W: Index, X: Coord>(
    d: &Deferred<W>,
    g: &CoordArray,
) -> Result<()> {
    let chunks: Vec<u64> = (0..d.chunked.infos.len() as u64)
        .filter(|&c| d.chunked.infos[c as usize].measures_at.is_none())
        .collect();
    if chunks.is_empty() {
        return Ok(());
    }
    let ws = d.job.ws;
    // Half of what is free is for tallies and writers.
    let whole = Whole::<X>::within(d.job, ws.budget.free() / 2)?;
    let corners = if whole.is_some() {
        0
    } else {
        chunks.len() as u64 * 3 * d.job.plan.chunk
    };
    let asks = questions::<W>(d.job, corners)?;
    {
        let (plan, shape) = (&d.job.plan, &d.job.shape);
        let labels = plan.chunk.min(shape.triangles) * ChunkLabels::<I>::BYTES;
        let again = (plan.again.min(plan.chunk) + 64) * shape.again_bytes();
        let bytes = ws.workers.count() as u64 * (labels + again);
        let _lease = ws.budget.lease("chunks measured again", bytes)?;
        ws.workers.run(
            chunks.len() as u64,
            || Near::<I, W, X>::new(d, g, (whole.as_ref(), &asks)),
            |near, unit| near.chunk(d, chunks[unit as usize]),
            |near| {
                near.asks.finish()?;
                near.tally.finish()
            },
        )?;
    }
    drop(whole);
    measure_asked::<W, X>(d.job, g, asks.finish()?, d.pieces)
}

/// One thread that measures chunks whose vertices are near, and asks for the others.
struct Near<'a, I, W: Index, X> {
    reader: TriangleReader<'a, I>,
    coords: CoordReader<'a, X>,
    ids: LocalIds,
    labels: ChunkLabels<I>,
    range: LabelRange<'a, W>,
    tally: Tally<'a>,
    counts: Vec<LocalCount>,
    whole: Option<&'a Whole<X>>,
    asks: Writer<'a, Ask<W>>,
}

impl<'a, I: Index, W: Index, X: Coord> Near<'a, I, W, X> {
    fn new(
        d: &Deferred<'a, W>,
        g: &'a CoordArray,
        (whole, asks): (Option<&'a Whole<X>>, &'a Shuffle<Ask<W>>),
    ) -> Result<Self> {
        let budget = &d.job.ws.budget;
        Ok(Near {
            reader: TriangleReader::new(&d.job.mesh.v),
            coords: CoordReader::new(g),
            ids: LocalIds::default(),
            labels: ChunkLabels::new(),
            range: d.labels.range(budget, d.job.plan.chunk)?,
            tally: d.pieces.tally()?,
            counts: Vec::new(),
            whole,
            asks: asks.writer()?,
        })
    }

    fn chunk(&mut self, d: &Deferred<W>, chunk: u64) -> Result<()> {
        let (start, count) = d.job.chunk_range(chunk);
        self.labels.load(d.job, d.chunked, d.component, chunk)?;
        let locals = d.chunked.locals_of(chunk);
        let mut counts = Counts {
            file: &d.records.counts,
            at: d.chunked.infos[chunk as usize].counts_at,
            left: locals.end - locals.start,
            next: locals.start,
        };
        self.range.load(locals.clone())?;
        let step = d.job.plan.again;
        (0..count).step_by(step as usize).try_for_each(|from| {
            let part = (start, from, step.min(count - from));
            self.part(d.job, locals.start, part, &mut counts)
        })
    }

    /// Counts and measures `count` triangles of a chunk that begins with triangle `start`, from
    /// its triangle `from`. Local components are numbered by their first triangles, so a number
    /// that was not met before is the next: its count goes where its first triangle does.
    fn part(
        &mut self,
        job: &Job,
        base: u64,
        (start, from, count): (u64, u64, u64),
        counts: &mut Counts,
    ) -> Result<()> {
        let v = self.reader.read(start + from, count)?;
        self.ids.assign(v);
        read_again(job, start + from, &self.ids)?;
        let near = match self.ids.window() {
            Some(start) => Some(self.coords.read(start, self.ids.span() as u64)?),
            None => None,
        };
        let all = self.whole.map(Whole::rows).transpose()?;
        if let (None, Some(whole)) = (near, self.whole) {
            whole.took(v.len());
        }
        let rows = v
            .as_chunks::<3>()
            .0
            .iter()
            .zip(self.ids.local().as_chunks::<3>().0);
        for (i, (row, local)) in (from as usize..).zip(rows) {
            let label = self.labels.labels[i];
            if label == I::NONE {
                continue;
            }
            let node = base + label.wide();
            let (component, flip) = self.range.get(node);
            let mut adds = Adds {
                component,
                flip: flip ^ self.labels.flipped(i),
                counted: false,
            };
            if node == counts.next {
                let count = counts.take(&mut self.counts)?;
                adds.counted = count.is_bare();
                if !adds.counted {
                    self.tally.at(component)?.count(&count, start, flip);
                }
            }
            let corners = match (near, all) {
                (Some(near), _) => local.map(|v| near[v as usize].map(Coord::wide)),
                (_, Some(all)) => row.map(|v| all[v.wide() as usize].map(Coord::wide)),
                _ => {
                    let triangle = start + i as u64;
                    for (k, v) in row.iter().enumerate() {
                        let ask = Ask::new(v.wide(), (triangle, k), adds);
                        self.asks.push(ask)?;
                    }
                    continue;
                }
            };
            adds.add(&mut self.tally, start + i as u64, Some(corners))?;
        }
        Ok(())
    }
}

/// The counts of a chunk's local components, one after another.
struct Counts<'a> {
    file: &'a ScratchFile,
    at: u64,
    left: u64,
    /// The local component whose count is the next.
    next: u64,
}

impl Counts<'_> {
    /// Counts read at a time.
    const READ: u64 = 1 << 10;

    /// The next count; `block` holds some of them.
    fn take(&mut self, block: &mut Vec<LocalCount>) -> Result<LocalCount> {
        if block.is_empty() {
            block.resize(Self::READ.min(self.left) as usize, LocalCount::default());
            self.file
                .read_at(bytemuck::cast_slice_mut(&mut block[..]), self.at)?;
            self.at += size_of_val(&block[..]) as u64;
            self.left -= block.len() as u64;
            block.reverse();
        }
        self.next += 1;
        let count = block.pop();
        count.ok_or_else(|| Error::Internal("more local components than were counted".into()))
    }
}
