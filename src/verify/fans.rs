//! Fans and border loops, by counting: what the corners of a mesh hang together in.
//!
//! The corners of all triangles are nodes. At each of its two ends a regular edge links the
//! corners of its two triangles, so what hangs together over these links is a *fan*: a chain of
//! corners at one vertex, each with two edges there. A chain that returns to itself is a
//! closed fan; an open one has two ends. A corner without an opposite faces a border or a
//! non-manifold edge, and each end of this edge is an end of the fan of its triangle there: so
//! the ends of open fans and the ends of such edges are the same things, two for each.
//!
//! Why one graph tells both: let each corner without an opposite also link the corners at the
//! two ends of the edge that it faces, and mark them. Closed fans have no ends and stay what
//! they were. Open fans are joined, end to end, along the border: what carries a mark is a
//! border loop, and what carries none is a closed fan. How many open fans a vertex has needs
//! no search: half the ends there. So each closed fan leaves a [`Share`] of two halves with its
//! vertex, each end leaves one half, and [`stars`](super::stars) adds them up.
//!
//! Memory: that of [`links`](super::links) for 3T nodes, and buffers. I/O: 16 bytes for each
//! closed fan, 32 for each corner without an opposite, and what the links take when the nodes
//! do not fit; V and the labels once.

use super::duplicates::{Repeat, Twin};
use super::edge_record::Facing;
use super::links::Links;
use super::open::Arrays;
use super::read::IdReader;
use super::sort::{Filler, Record};
use super::tally::Table;
use crate::disk::Workspace;
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// One end of an open fan, or both halves of a closed one, at its vertex.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Share {
    pub(super) vertex: u64,
    /// Label of the component, shifted left by one, and whether the fan is closed.
    owner: u64,
}

/// The label field of a [`Share`] when there is no label.
const NO_LABEL: u64 = u64::MAX >> 1;

impl Share {
    fn new(vertex: u64, label: u64, closed: bool) -> Share {
        Share {
            vertex,
            owner: label << 1 | u64::from(closed),
        }
    }

    /// Label of the component; all ones for none.
    pub(super) fn label(&self) -> u64 {
        let label = self.owner >> 1;
        if label == NO_LABEL { u64::MAX } else { label }
    }

    /// What it is of a fan, in halves.
    pub(super) fn halves(&self) -> u64 {
        1 + (self.owner & 1)
    }
}

impl Record for Share {
    type Key = (u64, u64);
    #[inline]
    fn key(&self) -> (u64, u64) {
        (self.vertex, self.owner)
    }
}

/// Where the pass over the edges sends what stars and duplicates are told from.
pub(super) struct Feed<'a> {
    /// The graph of all corners.
    pub(super) corners: &'a mut Links,
    pub(super) shares: Filler<'a, Share>,
    pub(super) twins: Filler<'a, Twin>,
    pub(super) repeats: Filler<'a, Repeat>,
}

impl Feed<'_> {
    /// Two corners that face an edge alone.
    pub(super) fn regular(&mut self, a: &Facing, b: &Facing) -> Result<()> {
        let ((a_lo, a_hi), (b_lo, b_hi)) = (a.ends(), b.ends());
        self.corners.push(a_lo, b_lo, false)?;
        self.corners.push(a_hi, b_hi, false)?;
        if a.apex == b.apex && a.apex != u64::MAX {
            let triangle = a.corner.max(b.corner) / 3;
            self.repeats.push(Repeat { triangle })?;
        }
        Ok(())
    }

    /// A corner that faces an edge with no other.
    pub(super) fn border(&mut self, facing: &Facing) -> Result<()> {
        let (lo, hi) = facing.ends();
        self.corners.push(lo, hi, false)?;
        // The mark: a corner that is turned against itself.
        self.corners.push(lo, lo, true)?;
        for vertex in [facing.lo, facing.hi] {
            self.shares.push(Share::new(vertex, facing.label, false))?;
        }
        Ok(())
    }

    /// A corner that faces a non-manifold edge, which has this number among such edges.
    pub(super) fn cut(&mut self, facing: &Facing, edge: u64) -> Result<()> {
        if facing.apex != u64::MAX {
            self.twins.push(Twin {
                edge,
                apex: facing.apex,
                triangle: facing.corner / 3,
            })?;
        }
        self.border(facing)
    }

    /// Hands over all that was sent.
    pub(super) fn finish(self) -> Result<()> {
        self.shares.finish()?;
        self.twins.finish()?;
        self.repeats.finish()
    }
}

/// Settles the graph of corners: gives each component its loops, and each closed fan's share to
/// its vertex. Returns the number of loops in all.
pub(super) fn settle(
    ws: &Workspace,
    arrays: &Arrays,
    corners: Links,
    mut table: Table,
    mut shares: Filler<Share>,
) -> Result<u64> {
    ws.progress
        .begin("verify: fans", "corners", arrays.triangles * 3);
    let mut v = IdReader::new(ws, &arrays.v, 64 << 10)?;
    let mut labels = IdReader::new(ws, &arrays.component, 64 << 10)?;
    let mut loops = 0;
    corners.finish(|corner, marked| {
        let triangle = corner / 3;
        let label = labels.get(triangle)?.filter(|&l| l < arrays.components);
        if marked {
            loops += 1;
            if let Some(label) = label {
                table.of(label)?.loops += 1;
            }
            return Ok(());
        }
        let mut at = |k: u64| v.get(3 * triangle + k).map(Option::unwrap_or_default);
        let three = [at(0)?, at(1)?, at(2)?];
        let [a, b, c] = three;
        // Corners of a degenerate triangle are in no fan.
        if a != b && b != c && c != a {
            let vertex = three[(corner % 3) as usize];
            let label = label.unwrap_or(u64::MAX);
            shares.push(Share::new(vertex, label, true))?;
        }
        Ok(())
    })?;
    ws.progress.end();
    table.finish()?;
    shares.finish()?;
    Ok(loops)
}
