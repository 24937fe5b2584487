//! Finish: applies labels and flips chunk by chunk.
//!
//! Why it works: the chunk pass wrote V, O and labels as if every local component kept its
//! label and its first triangle's orientation. Where that came true nothing is written again.
//! Flipping a whole local component exchanges places 1 and 2 in its rows and in references to
//! them, which all lie in the same chunk. What is not settled there is [filled](super::fill) in
//! later.
//!
//! Doing it twice would do harm: what a chunk must become is read from what it is. So where a
//! build is to be gone on with, changed rows are put [aside](super::changes) and no array is
//! touched before all are known.
//!
//! Memory: labels and bits by component, V, O and labels of a chunk a thread. I/O: chunks that
//! change read and written once more; twice when they are put aside, and read from there.

use super::Job;
use super::arrays::OutArray;
use super::changes::{Array, Changes};
use super::chunked::Chunked;
use super::components::Chosen;
use super::deferred::ChunkLabels;
use super::graph::labels::LabelRange;
use super::stitch::Labels;
use crate::corner::{Index, flip};
use crate::error::Result;
use crate::folder::Orient;

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
    pub fn turn(&self, job: &Job, (component, flip): (u64, bool)) -> Option<bool> {
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
    aside: Option<&'a Changes>,
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

/// Applies labels and flips, in place or `aside`, and lists the degenerate triangles.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn apply<I: Index, W: Index>(
    job: &Job,
    chunked: &Chunked,
    found: &Found<W>,
    tables: &Tables,
    aside: Option<&Changes>,
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
                aside,
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

/// Writes items of an array from item `first`, in place or aside.
fn change<I: Index>(
    (tables, aside): (&Tables, Option<&Changes>),
    array: Array,
    first: u64,
    items: &[I],
) -> Result<()> {
    match aside {
        Some(changes) => changes.put(array, first, items),
        None => array.of(tables).write(first, items),
    }
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
                change((tables, self.aside), Array::Component, at, part)?;
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
        for (array, refers) in [(Array::V, false), (Array::O, true)] {
            array.of(tables).read(3 * first, &mut self.rows)?;
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
            change((tables, self.aside), array, 3 * first, &self.rows)?;
        }
        Ok(())
    }
}
