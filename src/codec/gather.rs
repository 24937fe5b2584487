//! The integer positions of a chunk's vertices, out of G, and the components of its triangles.
//!
//! Memory: [`Gather::BYTES`], and 16 bytes for each vertex of a chunk whose ids lie far apart. I/O:
//! of G what the chunk needs, and the gaps that are cheaper to read than to skip.

use super::grid::Grid;
use crate::chunk::ids::LocalIds;
use crate::disk::DataFile;
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::table::array::{Coords, Width};

/// Rows that are read at a time.
const ROWS: u64 = 1 << 14;
/// A gap of so many rows is read rather than skipped.
const GAP: u64 = 1 << 9;

/// Reads positions and components.
pub(super) struct Gather<'a> {
    g: Option<&'a (Coords, DataFile)>,
    grid: Grid,
    labels: Option<&'a (Width, DataFile)>,
    rows: Vec<u8>,
}

/// How many of these ascending numbers, from the first on, are read at once.
fn run(mut numbers: impl Iterator<Item = u64>) -> (usize, u64) {
    let Some(first) = numbers.next() else {
        return (0, 0);
    };
    let (mut count, mut last) = (1, first);
    for number in numbers {
        if number - last > GAP || number - first >= ROWS {
            break;
        }
        (count, last) = (count + 1, number);
    }
    (count, last + 1 - first)
}

impl<'a> Gather<'a> {
    /// Bytes of the buffer.
    pub(super) const BYTES: u64 = 24 * ROWS;

    pub(super) fn new(
        g: Option<&'a (Coords, DataFile)>,
        grid: Grid,
        labels: Option<&'a (Width, DataFile)>,
    ) -> Gather<'a> {
        Gather {
            g,
            grid,
            labels,
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
                self.fill(file, kind.row_bytes(), first + from, n)?;
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
            let (count, span) = run(rest.iter().map(|r| r.0));
            let (near, others) = rest.split_at(count);
            self.fill(file, kind.row_bytes(), first, span)?;
            for &(v, local) in near {
                let at = self.grid.integers(*kind, &self.rows, (v - first) as usize);
                positions[local as usize] = at;
            }
            rest = others;
        }
        Ok(positions)
    }

    /// The components of these triangles, which ascend; none when all triangles of the mesh are of
    /// one.
    pub(super) fn labels(&mut self, triangles: &[u64]) -> Result<Vec<u64>> {
        let Some((width, file)) = self.labels else {
            return Ok(Vec::new());
        };
        let mut labels = Vec::with_capacity(triangles.len());
        let mut rest = triangles;
        while let Some(&first) = rest.first() {
            let (count, span) = run(rest.iter().copied());
            let (near, others) = rest.split_at(count);
            self.fill(file, width.bytes(), first, span)?;
            let label = |t: &u64| width.get(&self.rows, (t - first) as usize);
            labels.extend(near.iter().map(label));
            rest = others;
        }
        Ok(labels)
    }

    fn fill(&mut self, file: &DataFile, row: usize, first: u64, rows: u64) -> Result<()> {
        let row = row as u64;
        let bytes = &mut self.rows[..(rows * row) as usize];
        file.read_at(bytes, DATA_START + first * row)
    }
}
