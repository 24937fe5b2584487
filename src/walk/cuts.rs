//! Why a corner has no opposite: a border, a cut at a non-manifold edge, or a degenerate triangle.
//!
//! The non-manifold edges are listed in order of their vertices, so whether an edge is among them
//! takes a search by halves.
//!
//! Memory: none. I/O: up to log2 of the edges reads of a row of 32 bytes, for each corner asked.

use super::{Side, Surface};
use crate::corner::Corner;
use crate::disk::DataFile;
use crate::error::Result;
use crate::folder::{self, EdgeRow, npy::DATA_START};
use crate::table::array;

/// The list of non-manifold edges of a folder.
pub(super) struct Cuts {
    file: Option<DataFile>,
    rows: u64,
}

impl Cuts {
    pub(super) fn open(surface: &Surface<'_>) -> Result<Cuts> {
        let rows = surface.folder.manifest().counts.nonmanifold_edges;
        let open = || {
            array::open(
                surface.folder,
                folder::NONMANIFOLD_EDGES,
                folder::EDGE_DESCR,
                &[rows],
            )
        };
        Ok(Cuts {
            file: (rows > 0).then(open).transpose()?,
            rows,
        })
    }

    /// What a corner without opposite faces.
    pub(super) fn why(&self, surface: &Surface<'_>, c: Corner) -> Result<Side> {
        if surface.table.component(c.t()).is_none() {
            return Ok(Side::Degenerate);
        }
        let ends = [c.n(), c.p()].map(|c| surface.table.v(c).id());
        let edge = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        Ok(if self.has(edge)? {
            Side::Cut
        } else {
            Side::Border
        })
    }

    fn has(&self, edge: (u64, u64)) -> Result<bool> {
        const ROW: usize = size_of::<EdgeRow>();
        let Some(file) = &self.file else {
            return Ok(false);
        };
        let (mut from, mut to) = (0, self.rows);
        let mut row = [0; ROW];
        while from < to {
            let middle = from + (to - from) / 2;
            file.read_at(&mut row, DATA_START + middle * ROW as u64)?;
            let found: EdgeRow = bytemuck::pod_read_unaligned(&row);
            match (u64::from_le(found.lo), u64::from_le(found.hi)).cmp(&edge) {
                std::cmp::Ordering::Equal => return Ok(true),
                std::cmp::Ordering::Less => from = middle + 1,
                std::cmp::Ordering::Greater => to = middle,
            }
        }
        Ok(false)
    }
}
