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
use super::plan::{Plan, Shape};
use crate::corner::Index;
use crate::shuffle;

/// Triangles of a cell that suit a core's second-level cache.
const GOOD_CELL: u64 = 16 << 10;
/// More cells at once cost more in address translation than they save.
const MOST_AT_ONCE: u64 = 2048;
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
    /// Windows of `good` triangles, or more where they would be more than `most`.
    fn new(triangles: u64, most: u64, good: u64) -> Window {
        let mut shift = 3;
        while triangles.div_ceil(1 << shift) > most.max(1)
            || (2 << shift) <= good && 1 << shift < triangles
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
        window_bytes(W::BYTES.max(I::BYTES) as u64) << self.shift
    }
}

/// Bytes for each triangle of a window, with words of so many bytes.
fn window_bytes(word: u64) -> u64 {
    assemble::WORDS * word + 24
}

/// How the budget is cut up on the path through cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellPlan {
    /// Cells that are wanted; a map may have fewer.
    pub cells: u64,
    /// Triangles of which an edge goes alone, about.
    pub alone: u64,
    /// Triangles that are dealt at a time.
    pub step: u64,
    /// The shuffle of triangles to cells.
    pub dealt: shuffle::Plan,
    /// The shuffle of edges to cells.
    pub lone: shuffle::Plan,
    /// The shuffle of positions to cells, where G does not fit.
    pub spots: shuffle::Plan,
    /// Windows of triangles.
    pub windows: Window,
    /// The shuffle of replies to windows.
    pub replies: shuffle::Plan,
    /// The shuffle of patches to windows.
    pub patches: shuffle::Plan,
}

impl CellPlan {
    /// Cuts up `memory` bytes. `by_place` when G says which vertices are near: few edges go alone
    /// then. `cells` is for tests.
    pub fn new(shape: &Shape, memory: u64, by_place: bool, cells: Option<usize>) -> CellPlan {
        let width = shape.record() as usize;
        let (triangles, threads) = (shape.triangles, shape.threads);
        // The writers of one pass get a quarter of the memory.
        let share = memory / 4 / threads;
        let (windows, replies, patches) = window_plans(shape, share, by_place);
        let alone = if by_place { triangles / 16 } else { triangles };
        let wanted = triangles.div_ceil(GOOD_CELL).clamp(1, MOST_AT_ONCE);
        // In little memory cells are as many as to leave them room.
        let room = share / 4 / (cell::TRIANGLE_BYTES + cell::LONE_BYTES) * 4 / shape.record();
        let wanted = wanted.max(triangles.div_ceil(room.max(64)).min(MOST_AT_ONCE));
        let wanted = cells.map_or(wanted, |cells| cells as u64).min(MOST_CELLS) as usize;
        let (most, some) = parts(share, by_place);
        let plans = |buckets: usize| {
            (
                shuffle::Plan::of(buckets, most, 4 * width, triangles),
                shuffle::Plan::of(buckets, some, 3 * width, alone),
                shuffle::Plan::of(buckets, most, 4 * width.max(8), shape.vertices),
            )
        };
        // All shuffles to cells have the same buckets.
        let (a, b, c) = plans(wanted);
        let mut cells = a.buckets.min(b.buckets);
        if by_place && shape.coord > 0 {
            cells = cells.min(c.buckets);
        }
        let (dealt, lone, spots) = plans(cells);
        let same = |plan: shuffle::Plan| shuffle::Plan {
            buckets: cells,
            ..plan
        };
        CellPlan {
            cells: cells as u64,
            alone,
            step: STEP.min((share / 64).max(64)),
            dealt: same(dealt),
            lone: same(lone),
            spots: same(spots),
            windows,
            replies,
            patches,
        }
    }

    /// True when G would be mapped whole in so much memory.
    pub fn maps_all(shape: &Shape, memory: u64) -> bool {
        let held = CellPlan::held(shape);
        shape.coord > 0 && 3 * shape.coord * shape.vertices + held <= memory / 2
    }

    /// True when a cell twice as large as most would fit in a thread's share of so much memory.
    pub fn suits(&self, shape: &Shape, plan: &Plan, memory: u64, by_place: bool) -> bool {
        let whole = if Self::maps_all(shape, memory) {
            3 * shape.coord * shape.vertices
        } else {
            0
        };
        // Of what is left of stars only parts of fans are many.
        let others = if shape.measures { 3 } else { 2 } * plan.writer;
        let writers = self.replies.writer_bytes() + self.patches.writer_bytes() + others;
        let free = memory.saturating_sub(Self::held(shape) + whole) / 8 * 7;
        let share = (free / shape.threads).saturating_sub(writers + settle::APPENDED);
        let cell = shape.triangles / self.cells + 1;
        // Of random ids nearly every triangle has an edge that goes alone.
        let alone = if by_place { 4 } else { 1 };
        let bytes = cell::TRIANGLE_BYTES + cell::LONE_BYTES / alone;
        let window = self.window_bytes(shape);
        2 * cell * bytes * shape.record() / 4 <= share && window <= memory / 4 / shape.threads
    }

    /// Parts of fans that are expected of so many triangles: about two at each vertex of those that
    /// are parted.
    pub fn parts(&self, triangles: u64) -> u64 {
        (4 * self.alone).min(3 * triangles)
    }

    /// Bytes that a thread holds to assemble a window.
    pub fn window_bytes(&self, shape: &Shape) -> u64 {
        window_bytes(shape.record()) << self.windows.shift
    }

    /// Bytes held through all passes: the marks of names.
    pub fn held(shape: &Shape) -> u64 {
        Marks::bytes(shape.triangles)
    }
}

/// Memory for what goes for each triangle, and for what crosses from cell to cell.
fn parts(share: u64, by_place: bool) -> (u64, u64) {
    if by_place {
        (share / 8 * 7, share / 8)
    } else {
        (share / 8 * 5, share / 8 * 3)
    }
}

/// Windows, as many as their shuffles can buffer for, and those shuffles.
fn window_plans(
    shape: &Shape,
    share: u64,
    by_place: bool,
) -> (Window, shuffle::Plan, shuffle::Plan) {
    let (triangles, width) = (shape.triangles, shape.record() as usize);
    let across = if by_place { triangles / 16 } else { triangles };
    let (most, some) = parts(share, by_place);
    let good = (share / window_bytes(2 * shape.record())).min(GOOD_WINDOW);
    let mut at_most = MOST_AT_ONCE;
    loop {
        let windows = Window::new(triangles, at_most, good);
        let buckets = windows.count as usize;
        let replies = shuffle::Plan::of(buckets, most, 5 * width, triangles);
        let patches = shuffle::Plan::of(buckets, some, 2 * width, across);
        if replies.buckets.min(patches.buckets) == buckets {
            return (windows, replies, patches);
        }
        at_most = (replies.buckets.min(patches.buckets) as u64).max(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plans_know_how_wide_records_are() {
        for (triangles, bytes) in [(1 << 28, 4), (600_000_000, 8)] {
            let shape = Shape {
                triangles,
                vertices: triangles / 2,
                index: 4,
                coord: 4,
                threads: 2,
                measures: true,
            };
            assert_eq!(shape.record(), bytes);
            let plan = CellPlan::new(&shape, 2 << 30, true, None);
            let held = if bytes == 4 {
                plan.windows.bytes::<u32, u32>()
            } else {
                plan.windows.bytes::<u32, u64>()
            };
            assert_eq!(plan.window_bytes(&shape), held);
            assert_eq!(plan.dealt.volume, 4 * bytes * triangles);
            assert_eq!(plan.replies.volume, 5 * bytes * triangles);
            assert_eq!(plan.replies.buckets as u64, plan.windows.count);
        }
    }
}
