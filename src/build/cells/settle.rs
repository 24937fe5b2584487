//! Settle: each cell's edges are paired, its triangles oriented, labelled and measured, in
//! parallel over cells.
//!
//! Why it works: every edge dealt to a cell has all its corners there (see [`deal`](super::deal)),
//! so the group is seen before anything is decided. The swirl orients and labels the triangles
//! over those edges. Two triangles that meet across an edge of a cell where one of them does not
//! lie are *linked* by their numbers: a triangle that was parted names itself, and its own cell
//! links that name with the local component. What later passes add up does not depend on which
//! cell said it.
//!
//! A cell that does not fit in a thread's share of memory (a hub, an edge of a million
//! triangles) is not held: its edges go to the seam pass, which sorts them externally, and each
//! of its triangles is a local component.
//!
//! Memory: a share, four writers and seven blocks a thread; the marks of names. I/O: what was dealt
//! is read once; 5 words a triangle written, 2 for each opposite across cells and for each link;
//! 32 bytes a local component, and 112 where it was measured.

use super::super::Job;
use super::super::appender::{Appender, BLOCK};
use super::super::chunked::Settled;
use super::super::records::{EdgeCorner, Link, MeasureRecord, Patch};
use super::super::stars::spill::{Spilled, Spiller};
use super::cell::{Cell, Kept, cell_bytes, edge_corner};
use super::deal::Hands;
use super::names::Marks;
use super::places::{AtHand, Places, Positions};
use super::records::{Called, Dealt, Lone, NodeCount, NodeMeasure, Reply, Unmeasured, opposite};
use crate::chunk::grid::Grid;
use crate::chunk::measure::{Coord, Measure, Measurer};
use crate::chunk::pair::{BORDER, SPECIAL};
use crate::chunk::star::StarCount;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::{Error, Result};
use crate::shuffle::{Shuffle, Writer};
use bytemuck::Zeroable;
use std::sync::Mutex;
use std::time::Instant;

/// Where cells write to.
pub struct Sinks<'a, W: Index> {
    /// Answers to the triangles.
    pub replies: &'a Shuffle<Reply<W>>,
    /// Opposites of corners whose triangles lie in other cells.
    pub patches: &'a Shuffle<Patch<W>>,
    /// Corners on non-manifold edges.
    pub cuts: &'a Shuffle<EdgeCorner<W>>,
    /// Corners of cells that do not fit, for the seam pass.
    pub edges: &'a Shuffle<EdgeCorner<W>>,
    /// Names of local components.
    pub names: &'a Marks,
    /// Links between names.
    pub links: &'a ScratchFile,
    /// Names of triangles that face a border from another cell.
    pub borders: &'a ScratchFile,
    /// [`NodeCount`]s.
    pub counts: &'a ScratchFile,
    /// [`NodeMeasure`]s.
    pub measures: &'a ScratchFile,
    /// [`Unmeasured`] triangles.
    pub unmeasured: &'a ScratchFile,
    /// [`Unmeasured`] triangles of cells that do not fit: local components of their own.
    pub alone: &'a ScratchFile,
    /// What is left of vertex stars, when they are wanted.
    pub stars: Option<&'a Spilled<W>>,
}

/// Bytes that a thread holds for what it appends, and for a cell that passes by.
pub const APPENDED: u64 = 7 * BLOCK as u64 + PASSED;
/// Bytes of the positions that pass by.
const PASSED: u64 = Positions::<f64>::PASSING;
/// Records of a cell that does not fit, at a time.
const PASSING: usize = 2048;

impl<W: Index> Sinks<'_, W> {
    /// Bytes that a thread leases for its writers, and holds of what it appends.
    pub fn thread_bytes(&self) -> u64 {
        self.replies.writer_bytes()
            + self.patches.writer_bytes()
            + self.cuts.writer_bytes()
            + self.edges.writer_bytes()
            + APPENDED
            + self.stars.map_or(0, Spilled::thread_bytes)
    }
}

/// Settles cells from the one after `done`, with `share` bytes for each thread, until all are
/// settled or `until` is past. Returns what was settled, and the cells that are.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
pub fn settle<W: Index, X: Coord>(
    job: &Job,
    (hands, places): (&Hands<W>, &Places<X>),
    grid: &Grid,
    share: u64,
    sinks: &Sinks<W>,
    (done, until): (u64, Option<Instant>),
) -> Result<(Settled, u64)> {
    let ws = job.ws;
    let threads = ws.workers.count() as u64;
    let _lease = ws.budget.lease("cells", threads * (share + APPENDED))?;
    let settled = Mutex::new(Settled::default());
    if hands.triangles.count() != hands.lone.count() {
        return Err(Error::Internal(
            "triangles and edges have other cells".into(),
        ));
    }
    let done = ws.workers.round(
        done..hands.triangles.count(),
        until,
        || Thread::<W, X>::new(sinks, places),
        |thread, cell| {
            let triangles = hands.triangles.records_of(cell);
            let lone = hands.lone.records_of(cell);
            // Kernels number corners, doubled, in 32 bits.
            let numbered = 3 * triangles + lone < u64::from(SPECIAL / 2);
            if cell_bytes::<W>(triangles, lone) <= share && numbered {
                let room = thread.make_room(triangles, lone, share);
                hands.triangles.unsorted(cell, &mut thread.cell.triangles)?;
                hands.lone.unsorted(cell, &mut thread.cell.lone)?;
                thread.cell.settle();
                thread.settled.add(&thread.cell.pairs);
                thread.measure(cell, grid, room)?;
                thread.answer(hands)?;
            } else {
                thread.pass_on(hands, cell)?;
            }
            ws.progress.advance(triangles);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |thread| {
            let part = thread.finish()?;
            settled
                .lock()
                .unwrap_or_else(|e| e.into_inner())
                .merge(&part);
            Ok(())
        },
    )?;
    let settled = settled.into_inner();
    Ok((settled.unwrap_or_else(|e| e.into_inner()), done))
}

/// Scratch memory of one thread.
struct Thread<'a, W: Index, X> {
    cell: Cell<W>,
    positions: Positions<'a, X>,
    measurer: Measurer,
    measures: Vec<Measure>,
    kept: Kept,
    places: &'a Places<X>,
    settled: Settled,
    stars: Option<Spiller<'a, W>>,
    out: Out<'a, W>,
}

/// Where one thread writes to.
struct Out<'a, W: Index> {
    names: &'a Marks,
    replies: Writer<'a, Reply<W>>,
    patches: Writer<'a, Patch<W>>,
    cuts: Writer<'a, EdgeCorner<W>>,
    edges: Writer<'a, EdgeCorner<W>>,
    links: Appender<'a, Link<W>>,
    borders: Appender<'a, W>,
    counts: Appender<'a, NodeCount>,
    measures: Appender<'a, NodeMeasure>,
    unmeasured: Appender<'a, Unmeasured<W>>,
    alone: Appender<'a, Unmeasured<W>>,
}

impl<'a, W: Index, X: Coord> Thread<'a, W, X> {
    fn new(sinks: &Sinks<'a, W>, places: &'a Places<X>) -> Result<Self> {
        Ok(Thread {
            cell: Cell::default(),
            positions: Positions::new(places),
            measurer: Measurer::default(),
            measures: Vec::new(),
            kept: Kept::default(),
            places,
            settled: Settled::default(),
            stars: sinks.stars.map(Spilled::spiller).transpose()?,
            out: Out {
                names: sinks.names,
                replies: sinks.replies.writer()?,
                patches: sinks.patches.writer()?,
                cuts: sinks.cuts.writer()?,
                edges: sinks.edges.writer()?,
                links: Appender::new(sinks.links),
                borders: Appender::new(sinks.borders),
                counts: Appender::new(sinks.counts),
                measures: Appender::new(sinks.measures),
                unmeasured: Appender::new(sinks.unmeasured),
                alone: Appender::new(sinks.alone),
            },
        })
    }

    /// Makes the buffers ready for a cell that fits in `share` bytes, and gives the bytes that are
    /// left for measuring.
    fn make_room(&mut self, triangles: u64, lone: u64, share: u64) -> u64 {
        let (room, fits) = self.kept.grow::<W>(triangles, lone, share);
        if !fits {
            self.cell = Cell::default();
            self.positions = Positions::new(self.places);
            self.measurer = Measurer::default();
            self.measures = Vec::new();
            if let Some(stars) = &mut self.stars {
                stars.shrink();
            }
        }
        room
    }

    /// Measures the local components by the positions at hand, in `memory` bytes, and notes the
    /// triangles that want others.
    fn measure(&mut self, cell: u64, grid: &Grid, memory: u64) -> Result<()> {
        let Thread { cell: own, out, .. } = self;
        let locals = own.swirl.components.len();
        let need = own.ids.span() as u64 * (Measurer::BYTES + Positions::<X>::BYTES)
            + locals as u64 * MEASURE_BYTES;
        let fits = need <= memory;
        if fits {
            self.kept.measured = self.kept.measured.max(need);
        }
        let hand = self.positions.load(cell, &own.ids, fits)?;
        let (positions, absent) = match hand {
            AtHand::None => return Ok(()),
            AtHand::Later => return out.all_unmeasured(own),
            AtHand::Here { positions, absent } => (positions, absent),
        };
        if !absent.is_empty() {
            for (i, row) in own.corners().as_chunks::<3>().0.iter().enumerate() {
                if row.iter().any(|&v| absent[v as usize]) {
                    let triangle = Unmeasured::new(&own.triangles[i], own.called(i));
                    out.unmeasured.push(triangle)?;
                }
            }
        }
        self.measures.clear();
        self.measures.resize(locals, Measure::default());
        let (corners, label) = (own.corners(), &own.swirl.label);
        self.measurer
            .measure(grid, corners, label, positions, absent, &mut self.measures);
        for (measure, (_, name, flip)) in self.measures.iter_mut().zip(own.named()) {
            if flip {
                measure.six_oriented = -measure.six_oriented;
            }
            let measure = MeasureRecord::new(measure);
            out.measures.push(NodeMeasure { name, measure })?;
        }
        Ok(())
    }

    /// Finds the stars of the settled cell, and answers its triangles and lone edges.
    fn answer(&mut self, hands: &Hands<W>) -> Result<()> {
        let counts = match (&mut self.stars, &hands.open) {
            (Some(stars), Some(open)) => self.cell.stars(stars, open)?,
            _ => &[],
        };
        self.out.answer(&self.cell, counts)
    }

    /// Hands the edges of a cell that does not fit to the seam pass.
    fn pass_on(&mut self, hands: &Hands<W>, cell: u64) -> Result<()> {
        let Thread { out, settled, .. } = self;
        let mut block = vec![Dealt::<W>::zeroed(); PASSING];
        hands
            .triangles
            .streamed(cell, &mut block, &mut |triangles| {
                for triangle in triangles {
                    settled.spilled += 3 - u64::from(triangle.aside() != 0);
                    out.pass_on(triangle)?;
                }
                Ok(())
            })?;
        let mut block = vec![Lone::<W>::zeroed(); PASSING];
        hands.lone.streamed(cell, &mut block, &mut |edges| {
            settled.spilled += edges.len() as u64;
            edges.iter().try_for_each(|lone| {
                let at = lone.corner();
                let corner = edge_corner(lone.edge(), at, Called::itself(at.0));
                out.edges.push(corner)
            })
        })
    }

    fn finish(self) -> Result<Settled> {
        self.out.finish()?;
        self.stars.map_or(Ok(()), Spiller::finish)?;
        Ok(self.settled)
    }
}

/// Bytes of a local component's measure while it is summed.
const MEASURE_BYTES: u64 = (size_of::<Measure>() + size_of::<i128>()) as u64;

impl<W: Index> Out<'_, W> {
    /// Answers all triangles and lone edges of a settled cell, of whose local components `stars`
    /// are the counts, if any.
    fn answer(&mut self, cell: &Cell<W>, stars: &[StarCount]) -> Result<()> {
        for (i, (local, name, flip)) in cell.named().enumerate() {
            let star = stars.get(i).copied().unwrap_or_default();
            self.names.mark(name);
            self.counts.push(NodeCount {
                name,
                triangles: local.triangles,
                flipped: if flip {
                    local.triangles - local.flipped
                } else {
                    local.flipped
                },
                borders: local.borders,
                conflict: u32::from(local.conflict),
                rings: star.rings,
                loops: star.loops,
            })?;
        }
        (0..cell.triangles.len()).try_for_each(|i| self.answer_triangle(cell, i))?;
        (0..cell.lone.len()).try_for_each(|j| self.answer_lone(cell, j))?;
        let cuts = cell.pairs.cuts.iter();
        cuts.map(|directed| cell.edge_corner(directed >> 1))
            .try_for_each(|corner| self.cuts.push(corner))
    }

    fn answer_triangle(&mut self, cell: &Cell<W>, i: usize) -> Result<()> {
        let (triangle, called) = (cell.triangles[i], cell.called(i));
        let mut opposites = [W::NONE; 3];
        for (k, word) in opposites.iter_mut().enumerate() {
            let o = cell.pairs.opposite[3 * i + k];
            if o >= SPECIAL {
                continue;
            }
            let (across, here) = cell.corner(o >> 1);
            *word = opposite(across, o & 1 == 1);
            if !here {
                self.link(called, across.0, o & 1 == 1)?;
            }
        }
        if triangle.aside() != 0 {
            // Other cells call it by itself.
            self.names.mark(triangle.t());
            self.link(called, triangle.t(), false)?;
        }
        self.replies
            .push(Reply::new(triangle.t(), opposites, called))
    }

    fn answer_lone(&mut self, cell: &Cell<W>, j: usize) -> Result<()> {
        let at = 3 * cell.triangles.len() + j;
        let ((t, k), o) = (cell.lone[j].corner(), cell.pairs.opposite[at]);
        if o == BORDER {
            return self.borders.push(W::of(t));
        }
        if o >= SPECIAL {
            return Ok(());
        }
        let (parity, (across, here)) = (o & 1 == 1, cell.corner(o >> 1));
        self.patches.push(Patch::new((t, k), across, parity))?;
        if !here && (o >> 1) as usize > at {
            self.link(Called::itself(t), across.0, parity)?;
        }
        Ok(())
    }

    /// Links the local component of a triangle that is called so with triangle `to`, which
    /// disagrees with it in the input when `parity`.
    #[inline]
    fn link(&mut self, called: Called, to: u64, parity: bool) -> Result<()> {
        let against = called.flip ^ parity;
        if called.name == to && !against {
            return Ok(());
        }
        self.links.push(Link::new(called.name, to, against))
    }

    fn all_unmeasured(&mut self, cell: &Cell<W>) -> Result<()> {
        let each = cell.triangles.iter().enumerate();
        each.map(|(i, triangle)| Unmeasured::new(triangle, cell.called(i)))
            .try_for_each(|triangle| self.unmeasured.push(triangle))
    }

    /// Makes a triangle a local component of its own, with its edges for the seam pass.
    fn pass_on(&mut self, triangle: &Dealt<W>) -> Result<()> {
        let called = Called::itself(triangle.t());
        for k in (0..3).filter(|k| triangle.aside() as usize != k + 1) {
            let at = (triangle.t(), k);
            self.edges.push(edge_corner(triangle.edge(k), at, called))?;
        }
        self.names.mark(triangle.t());
        self.alone.push(Unmeasured::new(triangle, called))?;
        let none = [W::NONE; 3];
        self.replies.push(Reply::new(triangle.t(), none, called))
    }

    fn finish(mut self) -> Result<()> {
        self.links.flush()?;
        self.borders.flush()?;
        self.counts.flush()?;
        self.measures.flush()?;
        self.unmeasured.flush()?;
        self.alone.flush()?;
        self.replies.finish()?;
        self.patches.finish()?;
        self.cuts.finish()?;
        self.edges.finish()
    }
}
