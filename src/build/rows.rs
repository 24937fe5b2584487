//! The table of components, row by row, and what the vertices of a component tell.
//!
//! Why no surface is looked at again: a component's open fans are as many as its corners without
//! opposite, so rings and loops, counted before, give its fans, its Euler characteristic and its
//! genus. Its distinct vertices are its fans without those that meet another one of its own.
//!
//! Memory: 64 KiB. I/O: the rows written once.

use super::Job;
use super::arrays::OutArray;
use super::marks::{Kind, Marked};
use super::tally::Sums;
use crate::error::{Error, Result};
use crate::folder::{self, ComponentMeasures, ComponentRow, Measures};

/// The table of components on its way to the folder.
pub struct Table {
    array: OutArray,
    bytes: Vec<u8>,
    written: u64,
    rows: u64,
}

impl Table {
    /// Bytes that are written at a time.
    const BLOCK: usize = 64 << 10;

    /// No row yet, of so many.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn new(job: &Job, rows: u64, measured: bool) -> Result<Table> {
        let (descr, bytes) = folder::row_type(measured);
        let name = folder::COMPONENTS;
        Ok(Table {
            array: OutArray::create(job.dir, name, descr, &[rows], bytes, job.ws)?,
            bytes: Vec::with_capacity(Self::BLOCK),
            written: 0,
            rows: 0,
        })
    }

    /// Rows that were taken.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn push(&mut self, row: &ComponentRow, measures: Option<&ComponentMeasures>) -> Result<()> {
        self.bytes.extend_from_slice(bytemuck::bytes_of(row));
        if let Some(measures) = measures {
            self.bytes.extend_from_slice(bytemuck::bytes_of(measures));
        }
        self.rows += 1;
        if self.bytes.len() + folder::row_type(true).1 as usize > Self::BLOCK {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<()> {
        self.array.write(self.written, &self.bytes)?;
        self.written += self.bytes.len() as u64;
        self.bytes.clear();
        Ok(())
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<OutArray> {
        self.flush()?;
        Ok(self.array)
    }
}

/// What the vertices of a component tell; adds it to the numbers of the whole mesh.
///
/// # Errors
/// [`Error::Internal`] when no surface has such numbers.
pub fn measured(
    row: &ComponentRow,
    (s, marked): (&Sums, &Marked),
    all: &mut Measures,
) -> Result<ComponentMeasures> {
    let again = marked.of(Kind::Again);
    // Each corner without opposite lies at the ends of two open fans, which have two ends each.
    let fans = s.rings + row.border_edges + row.cut_edges;
    let euler = fans as i64 - row.edges as i64 + row.triangles as i64;
    // Twice the genus of an orientable surface, the genus of another.
    let handles = 2 - s.loops as i64 - euler;
    let orientable = row.orientable == 1;
    if fans < again || handles < 0 || orientable && handles % 2 != 0 {
        let first = row.first_triangle;
        return Err(Error::Internal(format!(
            "the pass over components found {fans} fans ({} again), {} loops and the Euler \
             characteristic {euler} for the component of triangle {first}, which no surface has",
            again, s.loops
        )));
    }
    let vertices = fans - again;
    let smesh = row.closed == 1
        && orientable
        && vertices == fans
        && row.triangles as i64 == 2 * vertices as i64 - 4;
    all.fans += fans;
    all.border_loops += s.loops;
    all.euler += euler;
    all.smesh_components += u64::from(smesh);
    Ok(ComponentMeasures {
        vertices,
        fans,
        border_loops: s.loops,
        euler,
        genus: handles as u64 / if orientable { 2 } else { 1 },
        is_smesh: u8::from(smesh),
    })
}
