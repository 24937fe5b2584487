//! The path through cells, for meshes whose triangles lie in no order that helps.
//!
//! In file order a chunk of such a mesh is no patch of surface: nearly every edge is a seam and
//! nearly every triangle a piece of its own. So the triangles are dealt to *cells* of vertices
//! first, and a cell is settled like a chunk:
//!
//! ```text
//!   G or ids ──> map: the cell of each vertex
//!   V ──deal──> triangles by cell, and edges that go alone
//!            ──settle──> replies by triangle, patches by triangle, links, sums
//!            ──> seams (cells that do not fit), stitch, components ──assemble──> V O component
//! ```
//!
//! 1. [`map`]: cells are patches of surface when G tells where vertices are, else ranges of ids.
//! 2. [`deal`]: each edge gets one cell, in which all its corners meet.
//! 3. [`settle`]: pairs, orients, labels and measures cell by cell.
//! 4. [`sums`]: adds up by component, once components are known.
//! 5. [`assemble`]: brings the replies back to the triangles and writes the arrays, once.
//!
//! Why the result is that of file order: edges are decided from all their corners, local
//! components are numbered by their first triangles ([`names`]) and everything that is summed is
//! exact. Only time depends on the map.
//!
//! Memory: see [`CellPlan`]. I/O, in words of 4 bytes (8 for wide ids) a triangle: V read twice, 4
//! dealt and 5 replied (written and read once), the arrays written once.

pub mod assemble;
pub mod cell;
pub mod deal;
pub mod map;
pub mod names;
pub mod places;
pub mod records;
pub mod settle;
pub mod sums;

use self::map::MOST_CELLS;
use self::names::Marks;
use self::records::{Dealt, Lone, Reply};
use super::plan::Shape;
use crate::corner::Index;
use crate::shuffle;

/// Triangles of a cell that suit a core's second-level cache.
const GOOD_CELL: u64 = 16 << 10;
/// More cells at once cost more in address translation than they save.
const MOST_AT_ONCE: u64 = 2048;
/// Bytes of one cell's buffer for triangles: best, and least.
const BUFFER: (u64, u64) = (16 << 10, 2 << 10);
/// Triangles of a window that suit the cache.
const GOOD_WINDOW: u64 = 16 << 10;
/// Triangles that are dealt at a time.
const STEP: u64 = 16 << 10;

/// Consecutive triangles that are assembled together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Triangles of a window, as a power of two: at least 8, since 8 share a byte of flip bits.
    pub shift: u32,
    /// Number of windows.
    pub count: u64,
}

impl Window {
    fn new(triangles: u64, most: u64) -> Window {
        let mut shift = 3;
        while triangles.div_ceil(1 << shift) > most.max(1)
            || (1 << shift) < GOOD_WINDOW && 1 << shift < triangles
        {
            shift += 1;
        }
        Window {
            shift,
            count: triangles.div_ceil(1 << shift).max(1),
        }
    }

    /// The window of triangle t.
    #[inline]
    pub fn of(&self, t: u64) -> usize {
        (t >> self.shift) as usize
    }

    /// Bytes that a thread holds to assemble one.
    pub fn bytes<I: Index, W: Index>(&self) -> u64 {
        (assemble::WORDS * W::BYTES.max(I::BYTES) as u64 + 24) << self.shift
    }

    /// A shuffle to windows whose writers buffer `bytes` for each.
    pub fn plan(&self, bytes: u64) -> shuffle::Plan {
        shuffle::Plan {
            buckets: self.count as usize,
            buffer_bytes: bytes as usize,
        }
    }
}

/// How the budget is cut up on the path through cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellPlan {
    /// Cells that are wanted; a map may have fewer.
    pub cells: u64,
    /// Triangles that are dealt at a time.
    pub step: u64,
    /// The shuffle of triangles to cells.
    pub dealt: shuffle::Plan,
    /// The shuffle of edges to cells.
    pub lone: shuffle::Plan,
    /// Windows of triangles.
    pub windows: Window,
    /// Bytes of a window's buffer in a writer of replies.
    pub reply_buffer: u64,
    /// Bytes of a window's buffer in a writer of patches.
    pub patch_buffer: u64,
}

impl CellPlan {
    /// Cuts up `memory` bytes. `by_place` when G says which vertices are near: few edges go alone
    /// then.
    pub fn new(shape: &Shape, memory: u64, by_place: bool, cells: Option<usize>) -> CellPlan {
        let wide = shape.index / 4;
        let (triangles, threads) = (shape.triangles, shape.threads);
        // Writers of the deal get a quarter of the memory.
        let share = memory / 4 / threads;
        let afford = share / (wide * (BUFFER.1 + BUFFER.1 / 2) + 64);
        let wanted = triangles.div_ceil(GOOD_CELL).min(MOST_AT_ONCE);
        let cells = cells
            .map_or(wanted.min(afford).max(1), |cells| cells as u64)
            .clamp(1, MOST_CELLS.min(afford.max(1)));
        let buffer = (share / cells).min(2 * BUFFER.0 * wide);
        let (dealt, lone) = if by_place {
            (buffer * 7 / 8, buffer / 8)
        } else {
            (buffer * 4 / 7, buffer * 3 / 7)
        };
        let plan = |bytes: u64, record: usize| shuffle::Plan {
            buckets: cells as usize,
            buffer_bytes: (bytes.saturating_sub(24) as usize).max(record),
        };
        let most = (share / (wide * 2 * BUFFER.1)).clamp(1, MOST_AT_ONCE);
        let windows = Window::new(triangles, most);
        let buffer = (share / windows.count).min(2 * BUFFER.0 * wide);
        CellPlan {
            cells,
            step: STEP.min((share / 64).max(64)),
            dealt: plan(dealt, size_of::<Dealt<u64>>()),
            lone: plan(lone, size_of::<Lone<u64>>()),
            windows,
            reply_buffer: (buffer * 3 / 4).max(size_of::<Reply<u64>>() as u64),
            patch_buffer: (buffer / 4).max(16),
        }
    }

    /// Bytes held through all passes: the marks of names.
    pub fn held(shape: &Shape) -> u64 {
        Marks::bytes(shape.triangles)
    }
}
