//! Coordinates of triangles whose vertices lie far apart in G, by two sorts.
//!
//! Why it works: the corners, sorted by vertex, meet G in one sequential reading; what they
//! found there, sorted by corner, brings the three corners of each triangle together again,
//! in the order of the triangles, so that their labels are one sequential reading too.
//!
//! Memory: the buffers of the two sorts. I/O: 16 and 32 bytes a corner written and read, G and
//! the labels once.

use super::coords::{Block, Coords};
use super::open::Arrays;
use super::read::IdReader;
use super::sort::{Record, Sorter};
use super::tally::{Table, Tally};
use crate::disk::Workspace;
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// A corner that wants the coordinates of its vertex.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Wanted {
    pub(super) vertex: u64,
    pub(super) corner: u64,
}

impl Record for Wanted {
    type Key = (u64, u64);
    fn key(&self) -> (u64, u64) {
        (self.vertex, self.corner)
    }
}

/// A corner that has them.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Placed {
    corner: u64,
    point: [f64; 3],
}

impl Record for Placed {
    type Key = u64;
    fn key(&self) -> u64 {
        self.corner
    }
}

/// Measures the triangles whose corners are in `wanted`; returns how many corners there were.
pub(super) fn measure(
    ws: &Workspace,
    arrays: &Arrays,
    coords: &Coords,
    wanted: Sorter<Wanted>,
    tallies: &Sorter<Tally>,
    memory: u64,
) -> Result<u64> {
    if wanted.runs() == 0 {
        return Ok(0);
    }
    ws.progress.begin("verify: far coordinates", "corners", 0);
    let placed = Sorter::<Placed>::new(ws, "corners by triangle", memory / 3)?;
    let mut corners = 0;
    {
        let _lease = ws.budget.lease("a block of coordinates", Block::BYTES)?;
        let mut by_vertex = wanted.merge(ws, memory / 3)?;
        let mut block = Block::new();
        let mut out = placed.filler(ws)?;
        while let Some(Wanted { vertex, corner }) = by_vertex.next()? {
            let point = block.point(coords, vertex)?;
            out.push(Placed { corner, point })?;
            corners += 1;
        }
        out.finish()?;
    }
    let mut by_corner = placed.merge(ws, memory / 3)?;
    let mut table = Table::new(ws, tallies, arrays.components, memory / 4)?;
    let mut labels = IdReader::new(ws, &arrays.component, memory / 16)?;
    while let Some(first) = by_corner.next()? {
        let mut points = [first.point; 3];
        for point in &mut points[1..] {
            if let Some(next) = by_corner.next()? {
                *point = next.point;
            }
        }
        // Only triangles with a label were wanted.
        let label = labels.get(first.corner / 3)?;
        if let Some(label) = label.filter(|&l| l < arrays.components) {
            coords.frame.measure(table.of(label)?, points);
        }
        ws.progress.advance(3);
    }
    table.finish()?;
    ws.progress.end();
    Ok(corners)
}
