//! Hubs: joins the parts of vertices that have more of them than memory holds.
//!
//! Why it works: as in a [`group`](super::group), but every part is a node of a graph. Sorted by
//! (vertex, other vertex), the ends on one edge come together: two link their parts, one or more
//! than two are ends of fans. The sets of the graph are the fans; each has two ends, or none when
//! it is a ring. All fans of a hub are handed on as sharing it; whether there are several is
//! found when they are brought together.
//!
//! Memory: writers, a sorter, blocks; a label for each part, or a contraction. I/O: 32 bytes a part
//! read twice; 4 words an end on an undecided edge written and read by edge; 2 words a link; 4
//! words for each fan and each of its ends.

use super::super::appender::{Appender, BLOCK};
use super::super::graph::labels::{Labels, split};
use super::super::nodes::Nodes;
use super::super::{Job, scratch_items};
use super::gather::{Gathered, Out};
use super::paths::{Firsts, Links, sets};
use super::records::Part;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Record, Shuffle};
use bytemuck::{Pod, Zeroable};

/// An end of a part on an undecided edge: vertex, other vertex, part, corner.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Edge<W>([W; 4]);

impl<W: Index> Record for Edge<W> {
    const LEVELS: usize = 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// An end of a fan: part, corner.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Tip<W>([W; 2]);

/// What belongs to a fan: the fan; of its first part the vertex and local component, and NONE; of
/// an end NONE twice, and the corner.
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
    let links = ws.scratch.file("links of parts of hubs")?;
    let tips = ws.scratch.file("ends of fans of hubs")?;
    {
        let _lease = ws.budget.lease("ends of fans", BLOCK as u64)?;
        let mut tips = Appender::<Tip<W>>::new(&tips);
        let edges = by_edge(job, hubs, parts, &mut tips)?;
        match_ends(job, &edges, &mut Links::new(job, &links)?, &mut tips)?;
        tips.flush()?;
    }
    let labels = sets::<W>(job, parts, &links)?;
    let pieces = by_fan(job, nodes, hubs, &tips, &labels)?;
    let _lease = ws.budget.lease("fans of hubs", Out::<W>::BYTES)?;
    let mut out = Out::new(gathered);
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
    hubs: &ScratchFile,
    parts: u64,
    tips: &mut Appender<Tip<W>>,
) -> Result<Buckets<Edge<W>>> {
    let (ws, n) = (job.ws, job.shape.vertices.max(1));
    let plan = job.single_plan(size_of::<Edge<W>>(), 2 * parts);
    let edges = Shuffle::<Edge<W>>::new(ws, "ends at hubs", 0..n, plan)?;
    let mut writer = edges.writer()?;
    let mut number = 0;
    scratch_items(ws, hubs, 0, hubs.len(), &mut |parts: &[Part<W>]| {
        for part in parts {
            let own = W::of(number);
            for (to, corner) in part.ends().into_iter().flatten() {
                match to {
                    Some(to) => writer.push(Edge([W::of(part.vertex()), to, own, corner]))?,
                    None => tips.push(Tip([own, corner]))?,
                }
            }
            number += 1;
        }
        Ok(())
    })?;
    writer.finish()?;
    edges.finish()
}

/// Links the two parts on an edge; one, and more than two, end there.
fn match_ends<W: Index>(
    job: &Job,
    edges: &Buckets<Edge<W>>,
    links: &mut Links<W>,
    tips: &mut Appender<Tip<W>>,
) -> Result<()> {
    let mut sorter = edges.sorter(job.sort_memory(0))?;
    let tip = |Edge([_, _, part, corner]): Edge<W>| Tip([part, corner]);
    // The first two on the edge, until there is a third.
    let mut held: Vec<Edge<W>> = Vec::with_capacity(2);
    let mut many: Option<[W; 2]> = None;
    let mut close = |held: &mut Vec<Edge<W>>, tips: &mut Appender<Tip<W>>| match held[..] {
        [a, b] => links.join(a.0[2], b.0[2]),
        _ => held.iter().try_for_each(|&edge| tips.push(tip(edge))),
    };
    edges.sorted_all(&mut sorter, &mut |batch| {
        for &edge in batch {
            let [v, to, ..] = edge.0;
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

/// What belongs to each fan.
fn by_fan<W: Index>(
    job: &Job,
    nodes: &Nodes,
    hubs: &ScratchFile,
    tips: &ScratchFile,
    labels: &Labels<W>,
) -> Result<Buckets<Piece<W>>> {
    let ws = job.ws;
    let parts = hubs.len() / size_of::<Part<W>>() as u64;
    let corners = of_tips(job, parts, tips, labels)?;
    let ends = tips.len() / size_of::<Tip<W>>() as u64;
    let plan = job.single_plan(size_of::<Piece<W>>(), labels.components + ends);
    let fans = 0..labels.components.max(1);
    let pieces = Shuffle::<Piece<W>>::new(ws, "fans of hubs", fans, plan)?;
    let mut writer = pieces.writer()?;
    let mut firsts = Firsts::new(job, labels, parts)?;
    scratch_items(ws, hubs, 0, hubs.len(), &mut |parts: &[Part<W>]| {
        for part in parts {
            if let Some(fan) = firsts.advance()? {
                let (t, called) = part.at();
                let number = nodes.of_triangle(t, called);
                let head = [fan, part.vertex(), number].map(W::of);
                writer.push(Piece([head[0], head[1], head[2], W::NONE]))?;
            }
        }
        Ok(())
    })?;
    let mut at = 0;
    let _lease = ws.budget.lease("ends of fans", BLOCK as u64)?;
    let mut block: Vec<W> = Vec::new();
    scratch_items(ws, tips, 0, tips.len(), &mut |tips: &[Tip<W>]| {
        block.resize(tips.len(), W::NONE);
        corners.read_at(bytemuck::cast_slice_mut(&mut block), at)?;
        at += size_of_val(&block[..]) as u64;
        for (Tip([_, corner]), &label) in tips.iter().zip(&block) {
            let fan = W::of(split(label).0);
            writer.push(Piece([fan, W::NONE, W::NONE, *corner]))?;
        }
        Ok(())
    })?;
    writer.finish()?;
    pieces.finish()
}

/// The labels of the parts of all tips, in their order.
fn of_tips<W: Index>(
    job: &Job,
    parts: u64,
    tips: &ScratchFile,
    labels: &Labels<W>,
) -> Result<ScratchFile> {
    let asked = job.ws.scratch.file("parts with ends")?;
    let _lease = job.ws.budget.lease("parts with ends", BLOCK as u64)?;
    let mut list = Appender::<W>::new(&asked);
    scratch_items(job.ws, tips, 0, tips.len(), &mut |tips: &[Tip<W>]| {
        tips.iter().try_for_each(|Tip([part, _])| list.push(*part))
    })?;
    list.flush()?;
    job.labels_of_list(labels, parts, &asked)
}

/// The fan whose pieces are arriving.
#[derive(Default)]
struct Fan {
    fan: Option<u64>,
    /// Vertex and local component.
    at: Option<(u64, u64)>,
    ends: [u64; 2],
    count: usize,
}

impl Fan {
    fn take<W: Index>(&mut self, piece: &Piece<W>, out: &mut Out<W>) -> Result<()> {
        let [fan, vertex, number, corner] = piece.0.map(W::wide);
        if self.fan.is_some_and(|own| own != fan) {
            self.close(out)?;
        }
        self.fan = Some(fan);
        if piece.0[1] == W::NONE {
            if let Some(end) = self.ends.get_mut(self.count) {
                *end = corner;
            }
            self.count += 1;
        } else {
            self.at = Some((vertex, number));
        }
        Ok(())
    }

    fn close<W: Index>(&mut self, out: &mut Out<W>) -> Result<()> {
        let Fan {
            fan,
            at,
            ends,
            count,
        } = std::mem::take(self);
        match (fan, at, count) {
            (None, ..) => Ok(()),
            (_, Some((vertex, number)), 0 | 2) => {
                out.take((count == 2).then_some(ends), number)?;
                out.share(vertex, number)
            }
            _ => Err(Error::Internal(format!(
                "the pass over stars found a fan with {count} ends at a hub"
            ))),
        }
    }
}
