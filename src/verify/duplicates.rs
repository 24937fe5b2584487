//! Triangles with the same three vertices as an earlier one.
//!
//! Why edges tell them: triangles with the same vertices a < b < c all face the edge {a, b}, and
//! c is the third vertex of each, which their records carry. So two that face a regular edge
//! need only a comparison, and those that face a non-manifold edge are sorted by it and c.
//! Each triangle is looked at once, at the edge of its two smallest vertices.
//!
//! Memory: the buffers of the sorts. I/O: 24 bytes for at most a third of the corners on
//! non-manifold edges, 8 a duplicate; `duplicate.npy` once.

use super::listing::Listing;
use super::sort::{Record, Sorter};
use crate::disk::Workspace;
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// A triangle whose two smallest vertices are a non-manifold edge.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Twin {
    /// Number of the edge among the non-manifold ones.
    pub(super) edge: u64,
    /// The third vertex.
    pub(super) apex: u64,
    pub(super) triangle: u64,
}

impl Record for Twin {
    type Key = (u64, u64, u64);
    fn key(&self) -> (u64, u64, u64) {
        (self.edge, self.apex, self.triangle)
    }
}

/// A triangle that has the vertices of an earlier one.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Repeat {
    pub(super) triangle: u64,
}

impl Record for Repeat {
    type Key = u64;
    fn key(&self) -> u64 {
        self.triangle
    }
}

/// Checks the list of duplicates; returns how many there are.
pub(super) fn run(
    ws: &Workspace,
    twins: Sorter<Twin>,
    repeats: Sorter<Repeat>,
    mut listing: Listing,
    memory: u64,
) -> Result<u64> {
    let mut merge = twins.merge(ws, memory)?;
    let mut later = repeats.filler(ws)?;
    let mut before = None;
    while let Some(Twin {
        edge,
        apex,
        triangle,
    }) = merge.next()?
    {
        if before == Some((edge, apex)) {
            later.push(Repeat { triangle })?;
        }
        before = Some((edge, apex));
    }
    later.finish()?;
    drop(merge);
    let mut merge = repeats.merge(ws, memory)?;
    let mut count = 0;
    while let Some(Repeat { triangle }) = merge.next()? {
        count += 1;
        listing.expect(triangle, || "an earlier one has its vertices".into())?;
    }
    listing.finish()?;
    Ok(count)
}
