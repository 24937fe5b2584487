//! The integer positions of a chunk's vertices, out of G.
//!
//! Memory: [`Gather::BYTES`], and 16 bytes for each vertex of a chunk whose ids lie far apart. I/O:
//! of G what the chunk needs, and the gaps that are cheaper to read than to skip.

use super::grid::Grid;
use crate::chunk::ids::LocalIds;
use crate::disk::DataFile;
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::table::array::Coords;

/// Rows that are read at a time.
const ROWS: u64 = 1 << 14;
/// A gap of so many rows is read rather than skipped.
const GAP: u64 = 1 << 9;

/// Reads positions.
pub(super) struct Gather<'a> {
    g: Option<&'a (Coords, DataFile)>,
    grid: Grid,
    rows: Vec<u8>,
}

impl<'a> Gather<'a> {
    /// Bytes of the buffer.
    pub(super) const BYTES: u64 = 24 * ROWS;

    pub(super) fn new(g: Option<&'a (Coords, DataFile)>, grid: Grid) -> Gather<'a> {
        Gather {
            g,
            grid,
            rows: vec![0; Self::BYTES as usize],
        }
    }

    /// The positions of all local vertices, those that are not in use included.
    pub(super) fn positions(&mut self, ids: &LocalIds) -> Result<Vec<[i32; 3]>> {
        let mut positions = vec![[0; 3]; ids.span()];
        let Some((kind, file)) = self.g else {
            return Ok(positions);
        };
        if let Some(first) = ids.window() {
            let span = ids.span() as u64;
            let mut from = 0;
            while from < span {
                let n = ROWS.min(span - from);
                self.fill(*kind, file, first + from, n)?;
                for i in 0..n as usize {
                    let at = self.grid.integers(*kind, &self.rows, i);
                    positions[from as usize + i] = at;
                }
                from += n;
            }
            return Ok(positions);
        }
        let mut by_id: Vec<(u64, u32)> = ids.table().iter().copied().zip(0..).collect();
        by_id.sort_unstable();
        let mut rest = &by_id[..];
        while let Some(&(first, _)) = rest.first() {
            let mut last = first;
            let near = rest.iter().take_while(|(v, _)| {
                let near = v - last <= GAP && v - first < ROWS;
                last = if near { *v } else { last };
                near
            });
            let (run, others) = rest.split_at(near.count());
            self.fill(*kind, file, first, last - first + 1)?;
            for &(v, local) in run {
                let at = self.grid.integers(*kind, &self.rows, (v - first) as usize);
                positions[local as usize] = at;
            }
            rest = others;
        }
        Ok(positions)
    }

    fn fill(&mut self, kind: Coords, file: &DataFile, first: u64, rows: u64) -> Result<()> {
        let row = kind.row_bytes() as u64;
        let bytes = &mut self.rows[..(rows * row) as usize];
        file.read_at(bytes, DATA_START + first * row)
    }
}
