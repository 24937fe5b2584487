//! Hubs: joins the parts of vertices that have more of them than memory holds.
//!
//! Why it works: as in a [`group`](super::group), but every part is a node of a graph. Sorted by
//! (vertex, other vertex), the ends on one edge come together: two link their parts, one or more
//! than two are *tips* of fans. The sets of the graph are the fans; each has two tips, or none when
//! it is a ring. A part with both is a fan by itself, and needs no more than that; the others are
//! brought together by fan. All fans of a hub are handed on as sharing it; whether there are several
//! is found when they are brought together.
//!
//! Memory: writers, a sorter, blocks; a label for each part, or a contraction. I/O: 8 words a part
//! read once, and freed; 4 written and read; 3 words an end on an undecided edge written and read
//! by edge; 2 words a link; 1 word a tip; 4 words for each ring, and for each tip of a fan of
//! several parts.

use super::super::appender::{Appender, BLOCK, Records};
use super::super::nodes::Nodes;
use super::super::{Job, consumed_items};
use super::gather::{Gathered, Out};
use super::paths::{Firsts, Links, sets};
use super::records::Part;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Record, Shuffle, Writer};
use bytemuck::{Pod, Zeroable};

/// What is kept of a part: vertex, local component, the corners at its ends (NONE for a ring).
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Head<W>([W; 4]);

/// An end of a part on an undecided edge: vertex, other vertex, and `2 * part + side`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Edge<W>([W; 3]);

impl<W: Index> Record for Edge<W> {
    const LEVELS: usize = 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// An end of a part where its fan ends: `2 * part + side`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Tip<W>([W; 1]);

impl<W: Index> Record for Tip<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// A part of a fan of several: the fan, vertex, local component; the corner at its tip, or NONE
/// when it is the first part.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Piece<W>([W; 4]);

impl<W: Index> Record for Piece<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// Joins the parts of all hubs.
///
/// # Errors
/// [`Error::Internal`] for a fan with one end or more than two; [`Error::Budget`], [`Error::Io`],
/// [`Error::DiskLimit`].
pub fn hubs<W: Index>(job: &Job, nodes: &Nodes, gathered: &Gathered) -> Result<()> {
    let (ws, hubs) = (job.ws, &gathered.hubs);
    let parts = hubs.len() / size_of::<Part<W>>() as u64;
    if parts == 0 {
        return Ok(());
    }
    let heads = ws.scratch.file("heads of parts of hubs")?;
    let links = ws.scratch.file("links of parts of hubs")?;
    let plan = job.single_plan(size_of::<Tip<W>>(), 2 * parts);
    let tips = Shuffle::<Tip<W>>::new(ws, "tips of fans of hubs", 0..2 * parts, plan)?;
    {
        let mut tips = tips.writer()?;
        let edges = by_edge(job, nodes, hubs, &heads, &mut tips)?;
        match_ends(job, &edges, &mut Links::new(job, &links)?, &mut tips)?;
        tips.finish()?;
    }
    let tips = tips.finish()?;
    let labels = sets::<W>(job, parts, &links)?;
    drop(links);
    let _lease = ws.budget.lease("fans of hubs", Out::<W>::BYTES)?;
    let mut out = Out::new(gathered);
    let fans = 0..labels.components.max(1);
    // A ring at least, or a path with two ends; few where parts are many.
    let plan = job.single_plan(size_of::<Piece<W>>(), parts / 16);
    let pieces = Shuffle::<Piece<W>>::new(ws, "fans of hubs", fans, plan)?;
    {
        let mut walk = Walk {
            heads: (&heads, Records::new(&ws.budget)?),
            firsts: Firsts::new(job, &labels, parts)?,
            part: 0,
            tips: [false; 2],
            out: &mut out,
            pieces: pieces.writer()?,
        };
        let mut sorter = tips.sorter(job.sort_memory(0))?;
        tips.sorted_all(&mut sorter, &mut |batch| {
            batch.iter().try_for_each(|tip| walk.tip(tip.0[0].wide()))
        })?;
        walk.go_to(parts)?;
        walk.pieces.finish()?;
    }
    drop((tips, heads, labels));
    let pieces = pieces.finish()?;
    let mut sorter = pieces.sorter(job.sort_memory(0))?;
    let mut fan = Fan::default();
    pieces.sorted_all(&mut sorter, &mut |batch| {
        batch.iter().try_for_each(|piece| fan.take(piece, &mut out))
    })?;
    fan.close(&mut out)?;
    out.flush()
}

/// The ends on undecided edges by edge; the others are tips.
fn by_edge<W: Index>(
    job: &Job,
    nodes: &Nodes,
    hubs: &ScratchFile,
    heads: &ScratchFile,
    tips: &mut Writer<Tip<W>>,
) -> Result<Buckets<Edge<W>>> {
    let (ws, n) = (job.ws, job.shape.vertices.max(1));
    let parts = hubs.len() / size_of::<Part<W>>() as u64;
    let plan = job.single_plan(size_of::<Edge<W>>(), 2 * parts);
    let edges = Shuffle::<Edge<W>>::new(ws, "ends at hubs", 0..n, plan)?;
    let mut writer = edges.writer()?;
    let _lease = ws.budget.lease("heads of parts", BLOCK as u64)?;
    let mut heads = Appender::<Head<W>>::new(heads);
    let mut end = 0;
    consumed_items(ws, hubs, &mut |parts: &[Part<W>]| {
        for part in parts {
            let mut corners = [W::NONE; 2];
            let ends = part.ends().into_iter().flatten();
            for (side, (to, corner)) in ends.enumerate() {
                corners[side] = corner;
                let own = W::of(end + side as u64);
                match to {
                    Some(to) => writer.push(Edge([W::of(part.vertex()), to, own]))?,
                    None => tips.push(Tip([own]))?,
                }
            }
            end += 2;
            let (t, called) = part.at();
            let number = W::of(nodes.of_triangle(t, called));
            let [a, b] = corners;
            heads.push(Head([W::of(part.vertex()), number, a, b]))?;
        }
        Ok(())
    })?;
    heads.flush()?;
    writer.finish()?;
    edges.finish()
}

/// Links the two parts on an edge; one, and more than two, end there.
fn match_ends<W: Index>(
    job: &Job,
    edges: &Buckets<Edge<W>>,
    links: &mut Links<W>,
    tips: &mut Writer<Tip<W>>,
) -> Result<()> {
    let mut sorter = edges.sorter(job.sort_memory(0))?;
    let part = |Edge([.., end]): Edge<W>| W::of(end.wide() >> 1);
    let tip = |Edge([.., end]): Edge<W>| Tip([end]);
    // The first two on the edge, until there is a third.
    let mut held: Vec<Edge<W>> = Vec::with_capacity(2);
    let mut many: Option<[W; 2]> = None;
    let mut close = |held: &mut Vec<Edge<W>>, tips: &mut Writer<Tip<W>>| match held[..] {
        [a, b] => links.join(part(a), part(b)),
        _ => held.iter().try_for_each(|&edge| tips.push(tip(edge))),
    };
    edges.sorted_all(&mut sorter, &mut |batch| {
        for &edge in batch {
            let [v, to, _] = edge.0;
            if many == Some([v, to]) {
                tips.push(tip(edge))?;
                continue;
            }
            if held.first().is_some_and(|first| first.0[..2] != [v, to]) {
                close(&mut held, tips)?;
                held.clear();
            }
            held.push(edge);
            if held.len() == 3 {
                many = Some([v, to]);
                close(&mut held, tips)?;
                held.clear();
            }
        }
        Ok(())
    })?;
    close(&mut held, tips)?;
    links.finish()
}

/// The parts in their order, each with its tips.
struct Walk<'a, 'o, 'g, W: Index> {
    heads: (&'a ScratchFile, Records<Head<W>>),
    firsts: Firsts<'a, W>,
    /// The part whose tips are arriving.
    part: u64,
    tips: [bool; 2],
    out: &'o mut Out<'g, W>,
    pieces: Writer<'a, Piece<W>>,
}

impl<W: Index> Walk<'_, '_, '_, W> {
    /// The next tip.
    fn tip(&mut self, end: u64) -> Result<()> {
        self.go_to(end >> 1)?;
        self.tips[(end & 1) as usize] = true;
        Ok(())
    }

    /// All tips of the parts before `part` have come.
    fn go_to(&mut self, part: u64) -> Result<()> {
        while self.part < part {
            self.close()?;
        }
        Ok(())
    }

    fn close(&mut self) -> Result<()> {
        let (file, heads) = &mut self.heads;
        let Some(Head([vertex, number, a, b])) = heads.peek(file)? else {
            let what = format!("part {} of hubs has no head", self.part);
            return Err(Error::Internal(what));
        };
        heads.take();
        let (fan, first) = self.firsts.advance()?;
        let mut piece = |corner| {
            self.pieces
                .push(Piece([W::of(fan), vertex, number, corner]))
        };
        match std::mem::take(&mut self.tips) {
            [true, true] => {
                let (number, ends) = (number.wide(), [a.wide(), b.wide()]);
                self.out.take(Some(ends), number)?;
                self.out.share(vertex.wide(), number)?;
            }
            [true, false] => piece(a)?,
            [false, true] => piece(b)?,
            [false, false] if first => piece(W::NONE)?,
            [false, false] => {}
        }
        self.part += 1;
        Ok(())
    }
}

/// The fan whose pieces are arriving.
#[derive(Default)]
struct Fan {
    fan: Option<u64>,
    /// Vertex and local component.
    at: (u64, u64),
    ends: [u64; 2],
    count: usize,
}

impl Fan {
    fn take<W: Index>(&mut self, piece: &Piece<W>, out: &mut Out<W>) -> Result<()> {
        let [fan, vertex, number, corner] = piece.0.map(W::wide);
        if self.fan.is_some_and(|own| own != fan) {
            self.close(out)?;
        }
        (self.fan, self.at) = (Some(fan), (vertex, number));
        if piece.0[3] != W::NONE {
            if let Some(end) = self.ends.get_mut(self.count) {
                *end = corner;
            }
            self.count += 1;
        }
        Ok(())
    }

    fn close<W: Index>(&mut self, out: &mut Out<W>) -> Result<()> {
        let Fan {
            fan,
            at: (vertex, number),
            ends,
            count,
        } = std::mem::take(self);
        match (fan, count) {
            (None, _) => Ok(()),
            (_, 0 | 2) => {
                out.take((count == 2).then_some(ends), number)?;
                out.share(vertex, number)
            }
            _ => Err(Error::Internal(format!(
                "the pass over stars found a fan with {count} ends at a hub"
            ))),
        }
    }
}
