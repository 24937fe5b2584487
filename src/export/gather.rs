//! The coordinates of the corners of a block of triangles.
//!
//! When the vertices of the block lie close together in G, as they do in a coherent mesh, all
//! that lies between them is read at once and looked up. Else the ids are sorted and G is read
//! along them, near ones together, so that within a block no part of G is read twice.
//!
//! Memory: [`BYTES_PER_TRIANGLE`] for each triangle of a block; the caller leases it. I/O: of
//! G what the block needs, and the gaps that are cheaper to read than to skip.

use crate::disk::DataFile;
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::table::array::Coords;

/// Rows of G read at once for each triangle of a block. A coherent mesh has half a vertex a
/// triangle; the rest is room for ids that lie farther apart.
const ROWS_PER_TRIANGLE: usize = 4;
/// A gap of this many bytes is read rather than skipped.
const GAP: usize = 16 << 10;

/// Sorted ids (48), coordinates (72), rows of G (96).
pub(super) const BYTES_PER_TRIANGLE: u64 = 48 + 72 + 24 * ROWS_PER_TRIANGLE as u64;
/// Most triangles in a block: the larger, the fewer times a mesh in random order reads G.
pub(super) const MAX_STEP: u64 = 1 << 20;

pub(super) struct Gather {
    kind: Coords,
    by_id: Vec<(u64, u32)>,
    spots: Vec<[f64; 3]>,
    rows: Vec<u8>,
}

impl Gather {
    /// For blocks of up to `step` triangles.
    pub(super) fn new(kind: Coords, step: u64) -> Gather {
        let step = step as usize;
        Gather {
            kind,
            by_id: Vec::with_capacity(3 * step),
            spots: Vec::with_capacity(3 * step),
            rows: vec![0; ROWS_PER_TRIANGLE * step * kind.row_bytes()],
        }
    }

    /// The coordinates of the corners of these triangles, in their order.
    pub(super) fn read(&mut self, g: &DataFile, block: &[[u64; 3]]) -> Result<&[[f64; 3]]> {
        let ids = block.as_flattened();
        self.spots.clear();
        let (Some(&lo), Some(&hi)) = (ids.iter().min(), ids.iter().max()) else {
            return Ok(&self.spots);
        };
        let room = (self.rows.len() / self.kind.row_bytes()) as u64;
        if hi - lo < room {
            self.fill(g, lo, hi)?;
            let spot = |&v: &u64| self.kind.row(&self.rows, (v - lo) as usize);
            self.spots.extend(ids.iter().map(spot));
        } else {
            self.read_sorted(g, ids, room)?;
        }
        Ok(&self.spots)
    }

    fn read_sorted(&mut self, g: &DataFile, ids: &[u64], room: u64) -> Result<()> {
        self.by_id.clear();
        let numbered = ids.iter().zip(0u32..);
        self.by_id.extend(numbered.map(|(&v, i)| (v, i)));
        self.by_id.sort_unstable();
        self.spots.resize(ids.len(), [0.0; 3]);
        let gap = (GAP / self.kind.row_bytes()) as u64;
        let mut from = 0;
        while from < self.by_id.len() {
            let lo = self.by_id[from].0;
            let mut hi = lo;
            let mut to = from;
            while let Some(&(v, _)) = self.by_id.get(to) {
                if v - hi > gap || v - lo >= room {
                    break;
                }
                hi = v;
                to += 1;
            }
            self.fill(g, lo, hi)?;
            for &(v, i) in &self.by_id[from..to] {
                self.spots[i as usize] = self.kind.row(&self.rows, (v - lo) as usize);
            }
            from = to;
        }
        Ok(())
    }

    /// Reads the rows lo..=hi of G.
    fn fill(&mut self, g: &DataFile, lo: u64, hi: u64) -> Result<()> {
        let row = self.kind.row_bytes();
        let bytes = (hi - lo + 1) as usize * row;
        g.read_at(&mut self.rows[..bytes], DATA_START + lo * row as u64)
    }
}
