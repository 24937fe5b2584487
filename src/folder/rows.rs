//! `components.npy`: a row for each component, with its measures or without.
//!
//! Why a row has two parts: what a component is and how it is oriented is in every folder; what
//! its vertices tell is left out by `--no-measures`, and then the columns are not there at all,
//! so that nobody takes a blank for a number. The first part has the same columns in both.
//!
//! Memory: 64 KiB while rows are read. I/O: the rows that are asked for.

use super::npy::DATA_START;
use super::{COMPONENTS, Folder};
use crate::disk::DataFile;
use crate::error::{Error, Result};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// A row of `components.npy`: packed, little-endian, no padding.
#[repr(C, packed)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ComponentRow {
    /// Its first triangle.
    pub first_triangle: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// Triangles whose orientation differs from the input.
    pub flipped: u64,
    /// Edges of the surface as O has it: regular + border + cut.
    pub edges: u64,
    /// Edges with one incident corner in the whole mesh.
    pub border_edges: u64,
    /// Its corners on non-manifold edges.
    pub cut_edges: u64,
    /// 1 when its triangles can be oriented consistently.
    pub orientable: u8,
    /// 1 when every corner has an opposite.
    pub closed: u8,
    /// 1 when closed, or without border and with cut edges whose corners cancel.
    pub watertight: u8,
    /// 1 when it was oriented by the sign of its volume (under `--orient outward`).
    pub outward: u8,
    /// Six times the signed volume in the final orientation, in cubed input units, on the
    /// volume grid; NaN without coordinates or with a non-finite vertex.
    pub six_volume: f64,
    /// Area in squared input units; NaN as above.
    pub area: f64,
    /// Smallest coordinates (x, y, z) of its finite vertices; NaN when there are none.
    pub bbox_min: [f64; 3],
    /// Largest coordinates (x, y, z) of its finite vertices; NaN when there are none.
    pub bbox_max: [f64; 3],
}

/// What the vertices of a component tell, behind its [`ComponentRow`]; packed like it.
#[repr(C, packed)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct ComponentMeasures {
    /// Distinct vertices.
    pub vertices: u64,
    /// Fans: maximal sets of corners at one vertex that hang together over regular edges.
    pub fans: u64,
    /// Loops of the corners that have no opposite.
    pub border_loops: u64,
    /// Euler characteristic of the surface as O has it: fans - edges + triangles.
    pub euler: i64,
    /// (2 - border_loops - euler) / 2 when orientable, else 2 - border_loops - euler.
    pub genus: u64,
    /// 1 when it is a simple mesh: closed, orientable, manifold, of 2 * vertices - 4 triangles.
    pub is_smesh: u8,
}

/// NumPy's description of [`ComponentRow`].
pub const COMPONENT_DESCR: &str = "[('first_triangle', '<u8'), ('triangles', '<u8'), \
('flipped', '<u8'), ('edges', '<u8'), ('border_edges', '<u8'), ('cut_edges', '<u8'), \
('orientable', '|u1'), ('closed', '|u1'), ('watertight', '|u1'), ('outward', '|u1'), \
('six_volume', '<f8'), ('area', '<f8'), ('bbox_min', '<f8', (3,)), ('bbox_max', '<f8', (3,))]";

/// NumPy's description of a [`ComponentRow`] with its [`ComponentMeasures`].
pub const MEASURED_DESCR: &str = "[('first_triangle', '<u8'), ('triangles', '<u8'), \
('flipped', '<u8'), ('edges', '<u8'), ('border_edges', '<u8'), ('cut_edges', '<u8'), \
('orientable', '|u1'), ('closed', '|u1'), ('watertight', '|u1'), ('outward', '|u1'), \
('six_volume', '<f8'), ('area', '<f8'), ('bbox_min', '<f8', (3,)), ('bbox_max', '<f8', (3,)), \
('vertices', '<u8'), ('fans', '<u8'), ('border_loops', '<u8'), ('euler', '<i8'), \
('genus', '<u8'), ('is_smesh', '|u1')]";

/// The type and the bytes of a row.
pub fn row_type(measured: bool) -> (&'static str, u64) {
    let plain = size_of::<ComponentRow>() as u64;
    if measured {
        (
            MEASURED_DESCR,
            plain + size_of::<ComponentMeasures>() as u64,
        )
    } else {
        (COMPONENT_DESCR, plain)
    }
}

/// A row as it was read.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// What every folder has.
    pub base: ComponentRow,
    /// What a measured folder has.
    pub measures: Option<ComponentMeasures>,
}

/// The rows of a folder's `components.npy`, read in order or at random.
#[derive(Debug)]
pub struct Rows {
    file: DataFile,
    len: u64,
    measured: bool,
    bytes: Vec<u8>,
}

impl Rows {
    /// Rows that are read at a time: a buffer of less than 64 KiB.
    pub const STEP: u64 = 384;

    /// Opens the table.
    ///
    /// # Errors
    /// [`Error::Input`] when the folder has none of a known type, [`Error::Io`].
    pub fn open(folder: &Folder) -> Result<Rows> {
        let file = folder.file(COMPONENTS)?;
        let files = &folder.manifest().files;
        let entry = files.iter().find(|f| f.name == COMPONENTS);
        let (dtype, len) = entry.map_or(("", 0), |f| {
            (f.dtype.as_str(), f.shape.first().copied().unwrap_or(0))
        });
        let measured = dtype == MEASURED_DESCR;
        if !measured && dtype != COMPONENT_DESCR {
            return Err(Error::input(
                file.path(),
                "byte 0",
                "the columns of a table of components",
                dtype,
                "the folder was changed; build it again",
            ));
        }
        Ok(Rows {
            file,
            len,
            measured,
            bytes: Vec::new(),
        })
    }

    /// Number of components.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// True when there is no component.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// True when rows have [`ComponentMeasures`].
    pub fn measured(&self) -> bool {
        self.measured
    }

    /// Reads the rows of some components into `to`, which is cleared; at most [`Rows::STEP`] of
    /// them, from the first on.
    ///
    /// # Errors
    /// [`Error::Io`], also when there are no such rows.
    pub fn read(&mut self, range: Range<u64>, to: &mut Vec<Row>) -> Result<()> {
        to.clear();
        let count = (range.end.saturating_sub(range.start)).min(Self::STEP);
        let row = row_type(self.measured).1 as usize;
        self.bytes.resize(count as usize * row, 0);
        let at = DATA_START + range.start * row as u64;
        self.file.read_at(&mut self.bytes, at)?;
        to.extend(self.bytes.chunks_exact(row).map(|bytes| {
            let (base, rest) = bytes.split_at(size_of::<ComponentRow>());
            Row {
                base: bytemuck::pod_read_unaligned(base),
                measures: self.measured.then(|| bytemuck::pod_read_unaligned(rest)),
            }
        }));
        Ok(())
    }

    /// Reads all rows once, in order.
    ///
    /// # Errors
    /// [`Error::Io`], and those of `each`.
    pub fn each(&mut self, mut each: impl FnMut(u64, &Row) -> Result<()>) -> Result<()> {
        let mut rows = Vec::new();
        for first in (0..self.len).step_by(Self::STEP as usize) {
            self.read(first..self.len, &mut rows)?;
            for (number, row) in (first..).zip(&rows) {
                each(number, row)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_measured_row_is_the_plain_one_and_more() {
        let (plain, bytes) = row_type(false);
        let (measured, more) = row_type(true);
        assert_eq!((bytes, more), (116, 157));
        assert!(measured.starts_with(plain.trim_end_matches(']')));
    }
}
