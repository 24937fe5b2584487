//! Finish: applies labels and flips chunk by chunk, then the opposites from the seams, and
//! writes the lists of culprits.
//!
//! Why it works: the chunk pass wrote V, O and labels as if every local component kept its
//! label and its first triangle's orientation. Where that came true nothing is written again.
//! Flipping a whole local component exchanges places 1 and 2 in its rows and in references to
//! them, which all lie in the same chunk. The opposites from the seams name corners as the
//! input had them, with the parity of the edge: the flip of the triangle across is this
//! one's flip xor the parity, so it need not be looked up.
//!
//! Memory: labels and bits by component, V, O and labels of a chunk a thread; then a sorter
//! and 64 KiB a thread. I/O: chunks that change read and written once more; patches read once,
//! the parts of O that they touch read and written.

use super::Job;
use super::arrays::OutArray;
use super::chunks::Chunked;
use super::components::Chosen;
use super::deferred::ChunkLabels;
use super::graph::labels::LabelRange;
use super::records::{EdgeCorner, Patch};
use super::stars::Starred;
use super::stitch::Labels;
use crate::corner::{Index, flip, flip_k};
use crate::error::Result;
use crate::folder::{self, EDGE_DESCR, EdgeRow, Orient};
use crate::shuffle::Buckets;

/// The arrays of the folder that the pass completes.
pub struct Tables<'a> {
    /// V.
    pub v: &'a OutArray,
    /// O.
    pub o: &'a OutArray,
    /// Component.
    pub component: &'a OutArray,
    /// Flipped.
    pub flipped: &'a OutArray,
    /// Degenerate triangles.
    pub degenerate: &'a OutArray,
}

/// What was found and decided.
pub struct Found<'a, W> {
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// Orientations.
    pub chosen: &'a Chosen,
}

impl<W: Index> Found<'_, W> {
    /// Whether a local component with this label is to be flipped against its own first
    /// triangle; `None` when its triangles keep the input's orientation.
    fn turn(&self, job: &Job, (component, flip): (u64, bool)) -> Option<bool> {
        let keeps = job.orient == Orient::Keep || self.labels.nonorientable.get(component);
        (!keeps).then(|| flip ^ self.chosen.flip.get(component))
    }
}

/// Scratch memory of one thread.
struct Thread<'a, I, W> {
    labels: ChunkLabels<I>,
    range: LabelRange<'a, W>,
    rows: Vec<I>,
    /// For each triangle of the chunk: bit 0, final flip against the input; bit 1, whether its
    /// rows as written must be turned.
    turns: Vec<u8>,
    bits: Vec<u8>,
    ids: Vec<I>,
}

/// Labels that are written again together.
const PART: usize = 8 << 10;

/// Triangles of a unit of work: whole chunks, and a multiple of 8, so that no two units share
/// a byte of the flip bits.
fn chunks_per_unit(chunk: u64) -> u64 {
    let whole = (64u64 << 10).div_ceil(chunk);
    if chunk.is_multiple_of(8) {
        whole
    } else {
        whole.next_multiple_of(8)
    }
}

/// Applies labels and flips, and lists the degenerate triangles.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn apply<I: Index, W: Index>(
    job: &Job,
    chunked: &Chunked,
    found: &Found<W>,
    tables: &Tables,
) -> Result<()> {
    let ws = job.ws;
    let infos = &chunked.infos;
    let per_unit = chunks_per_unit(job.plan.chunk);
    let threads = ws.workers.count() as u64;
    let bytes = job.plan.chunk * (ChunkLabels::<I>::BYTES + 4 * I::BYTES as u64 + 1)
        + per_unit * job.plan.chunk / 8;
    let _lease = ws.budget.lease("rows to turn", threads * bytes)?;
    let degenerate_before: Vec<u64> = infos
        .iter()
        .scan(0, |sum, info| {
            let before = *sum;
            *sum += u64::from(info.degenerate);
            Some(before)
        })
        .collect();
    ws.workers.run(
        (infos.len() as u64).div_ceil(per_unit),
        || {
            Ok(Thread::<I, W> {
                labels: ChunkLabels::new(),
                range: found.labels.range(&ws.budget, job.plan.chunk)?,
                rows: Vec::new(),
                turns: Vec::new(),
                bits: Vec::new(),
                ids: Vec::new(),
            })
        },
        |thread, unit| {
            let chunks = unit * per_unit..((unit + 1) * per_unit).min(infos.len() as u64);
            let first = job.chunk_range(chunks.start).0;
            thread.bits.clear();
            for chunk in chunks {
                let before = degenerate_before[chunk as usize];
                thread.chunk(job, (chunked, found), tables, chunk, (first, before))?;
                ws.progress.advance(job.chunk_range(chunk).1);
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
            }
            if thread.bits.iter().any(|&b| b != 0) {
                tables.flipped.write(first / 8, &thread.bits)?;
            }
            Ok(())
        },
        |_| Ok(()),
    )
}

impl<I: Index, W: Index> Thread<'_, I, W> {
    fn chunk(
        &mut self,
        job: &Job,
        (chunked, found): (&Chunked, &Found<W>),
        tables: &Tables,
        chunk: u64,
        (unit_first, degenerate_before): (u64, u64),
    ) -> Result<()> {
        let info = &chunked.infos[chunk as usize];
        let locals = chunked.locals_of(chunk);
        let base = locals.start;
        self.range.load(locals.clone())?;
        let range = &self.range;
        let relabel = locals.clone().any(|l| range.get(l).0 != l - base);
        let turn = locals.clone().any(|l| match found.turn(job, range.get(l)) {
            Some(turn) => turn,
            None => info.flips && job.applies_flips(),
        });
        let flips = job.applies_flips() && (info.flips || turn);
        if !relabel && !flips && info.degenerate == 0 {
            return Ok(());
        }
        let (first, count) = job.chunk_range(chunk);
        self.labels.load(job, chunked, tables.component, chunk)?;
        if flips {
            self.decide(job, found, base);
            self.set_bits((first - unit_first) as usize);
        }
        if turn {
            self.turn_rows(first, count, tables)?;
        }
        if info.degenerate > 0 {
            self.ids.clear();
            let none = |i: &u64| self.labels.labels[*i as usize] == I::NONE;
            self.ids
                .extend((0..count).filter(none).map(|i| I::of(first + i)));
            tables.degenerate.write(degenerate_before, &self.ids)?;
        }
        if relabel {
            self.relabel(tables, base, first)?;
        }
        Ok(())
    }

    /// Replaces local labels by components, and writes the parts of the chunk in which any
    /// changed: mostly those at its ends.
    fn relabel(&mut self, tables: &Tables, base: u64, first: u64) -> Result<()> {
        for (part, at) in self
            .labels
            .labels
            .chunks_mut(PART)
            .zip((first..).step_by(PART))
        {
            let mut changed = false;
            for label in part.iter_mut().filter(|l| **l != I::NONE) {
                let component = I::of(self.range.get(base + label.wide()).0);
                changed |= component != *label;
                *label = component;
            }
            if changed {
                tables.component.write(at, part)?;
            }
        }
        self.labels.forget();
        Ok(())
    }

    /// Final flip and turn of each triangle of the chunk.
    fn decide(&mut self, job: &Job, found: &Found<W>, base: u64) {
        self.turns.clear();
        for i in 0..self.labels.labels.len() {
            let label = self.labels.labels[i];
            let swirled = self.labels.flipped(i);
            let (flip, turn) = if label == I::NONE {
                (false, false)
            } else {
                match found.turn(job, self.range.get(base + label.wide())) {
                    Some(turn) => (swirled ^ turn, turn),
                    None => (false, swirled),
                }
            };
            self.turns.push(u8::from(flip) | u8::from(turn) << 1);
        }
    }

    fn set_bits(&mut self, at: usize) {
        self.bits
            .resize((at + self.turns.len()).div_ceil(8).max(self.bits.len()), 0);
        for (i, turns) in self.turns.iter().enumerate() {
            self.bits[(at + i) / 8] |= (turns & 1) << ((at + i) % 8);
        }
    }

    /// Reads V and O of the chunk, turns what must be turned, writes them back.
    fn turn_rows(&mut self, first: u64, count: u64, tables: &Tables) -> Result<()> {
        self.rows.resize(3 * count as usize, I::NONE);
        for (array, refers) in [(tables.v, false), (tables.o, true)] {
            array.read(3 * first, &mut self.rows)?;
            for (row, turns) in self.rows.as_chunks_mut::<3>().0.iter_mut().zip(&self.turns) {
                if refers {
                    for o in row.iter_mut().filter(|o| **o != I::NONE) {
                        // Opposites settled in the chunk lie in the chunk.
                        let across = (o.wide() / 3 - first) as usize;
                        if self.turns[across] & 2 != 0 {
                            *o = I::of(flip(o.wide()));
                        }
                    }
                }
                if turns & 2 != 0 {
                    row.swap(1, 2);
                }
            }
            array.write(3 * first, &self.rows)?;
        }
        Ok(())
    }
}

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
    found: &Found<W>,
    patches: &Buckets<Patch<W>>,
    tables: &Tables,
    any_flip: bool,
) -> Result<()> {
    let ws = job.ws;
    let threads = ws.workers.count() as u64;
    let _lease = ws.budget.lease("spans of O", threads * (64 << 10))?;
    let memory = job.sort_memory(0);
    let nonorientable = &found.labels.nonorientable;
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

/// Rows of the lists that are held at a time.
const LISTED: usize = 1 << 10;

/// Writes the lists of culprits, by the ids of the final table.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn list<I: Index, W: Index>(
    job: &Job,
    found: &Found<W>,
    edges: u64,
    stars: Option<&Starred<W>>,
) -> Result<Vec<OutArray>> {
    let mut lists = Vec::from(list_cuts::<I, W>(job, found, edges)?);
    if let (Some(stars), Some(measured)) = (stars, &found.chosen.stars) {
        lists.push(measured.meetings.list::<I, W>(job)?);
        lists.push(stars.list_duplicates::<I>(job)?);
    }
    Ok(lists)
}

/// Writes the non-manifold edges and their corners, by the ids of the final table.
///
/// # Errors
/// [`crate::Error::Io`].
fn list_cuts<I: Index, W: Index>(job: &Job, found: &Found<W>, edges: u64) -> Result<[OutArray; 2]> {
    let corners = found.chosen.cuts.count::<W>();
    let create = |name, descr: &str, rows, bytes| {
        OutArray::create(job.dir, name, descr, &[rows], bytes, job.ws)
    };
    let edge_file = create(
        folder::NONMANIFOLD_EDGES,
        EDGE_DESCR,
        edges,
        size_of::<EdgeRow>() as u64,
    )?;
    let corner_file = create(
        folder::NONMANIFOLD_CORNERS,
        I::DESCR,
        corners,
        I::BYTES as u64,
    )?;
    let mut rows: Vec<EdgeRow> = Vec::with_capacity(LISTED);
    let mut ids: Vec<I> = Vec::with_capacity(LISTED);
    let (mut rows_done, mut ids_done) = (0, 0);
    found
        .chosen
        .cuts
        .each(job, &mut |corner: &EdgeCorner<W>, label| {
            if ids.len() == LISTED {
                corner_file.write(ids_done, &ids)?;
                ids_done += ids.len() as u64;
                ids.clear();
            }
            let turn = found.turn(job, label);
            let flipped = turn.is_some_and(|turn| turn ^ corner.flipped());
            let place = flip_k(corner.place() as usize, flipped) as u64;
            let id = 3 * corner.triangle() + place;
            ids.push(I::of(id));
            let (lo, hi) = corner.edge();
            match rows.last_mut() {
                Some(row) if (row.lo, row.hi) == (lo, hi) => {
                    row.corners += 1;
                    return Ok(());
                }
                _ => {}
            }
            if rows.len() == LISTED {
                edge_file.write(rows_done, &rows)?;
                rows_done += rows.len() as u64;
                rows.clear();
            }
            rows.push(EdgeRow {
                lo,
                hi,
                corners: 1,
                first_corner: id,
            });
            Ok(())
        })?;
    corner_file.write(ids_done, &ids)?;
    edge_file.write(rows_done, &rows)?;
    if rows_done + rows.len() as u64 != edges {
        let what = format!(
            "{} non-manifold edges listed, {edges} counted",
            rows_done + rows.len() as u64
        );
        return Err(crate::Error::Internal(what));
    }
    Ok([edge_file, corner_file])
}
