//! One range of the nodes of a graph: how large it may be, and its union-find with parity.
//!
//! Why the least node is the root: it names the class, and a class must be told apart from
//! its lower neighbours. Paths are halved on the way up, so a search stays short.
//!
//! Memory: see [`Shape::bytes`]. I/O: none but the links that leave the range.

use super::spool::Spool;
use bytemuck::{Pod, Zeroable};

/// The most nodes of a range: parents are 31 bits beside the parity.
const MOST_NODES: u64 = (1 << 31) - 1;
/// No lower neighbour.
pub(super) const NOBODY: u64 = u64::MAX;

/// A link from `hi` to `lo <= hi`, with the parity in the top bit of `lo`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Link {
    pub(super) hi: u64,
    pub(super) lo: u64,
}

pub(super) const PARITY: u64 = 1 << 63;

impl Link {
    pub(super) fn new(a: u64, b: u64, parity: bool) -> Link {
        Link {
            hi: a.max(b),
            lo: a.min(b) | if parity { PARITY } else { 0 },
        }
    }

    pub(super) fn parts(self) -> (u64, u64, bool) {
        (self.hi, self.lo & !PARITY, self.lo & PARITY != 0)
    }
}

/// How a graph is cut, from the memory that it may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// Nodes of a range.
    pub(super) range: u64,
    /// Ranges that a level of the tree is cut into.
    pub(super) fan: u64,
    /// Levels of the tree.
    pub(super) levels: u32,
    /// Bytes of a file's buffer.
    pub(super) buffer: u64,
}

impl Shape {
    pub(super) fn of(nodes: u64, memory: u64) -> Shape {
        let single = memory.saturating_sub(64) * 8 / 33;
        if nodes <= single.min(MOST_NODES) {
            return Shape {
                range: nodes.max(1),
                fan: 1,
                levels: 0,
                buffer: 0,
            };
        }
        let buffer = (memory / 256).clamp(256, 64 << 10);
        let fan = (memory / 8 / buffer).clamp(8, 128);
        // Levels take memory from the range, and a smaller range may need more levels.
        let mut levels = 1;
        loop {
            // Two buffers more for the links that leave the range, and reading.
            let files = (u64::from(levels) * fan + 3) * buffer;
            let range = (memory.saturating_sub(files) * 8 / 97).clamp(64, MOST_NODES);
            let covered = (range as u128) * (fan as u128).pow(levels);
            if covered >= u128::from(nodes) || levels == 20 {
                return Shape {
                    range,
                    fan,
                    levels,
                    buffer,
                };
            }
            levels += 1;
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        if self.levels == 0 {
            return self.range * 4 + self.range / 8 + 64;
        }
        self.range * 12
            + self.range / 8
            + 64
            + (u64::from(self.levels) * self.fan + 3) * self.buffer
    }
}

/// The union-find of the range that is open now.
pub(super) struct Range {
    pub(super) base: u64,
    pub(super) end: u64,
    pub(super) parent: Vec<u32>,
    pub(super) odd: Vec<u64>,
    /// Highest lower neighbour of each class, parity in the top bit.
    pub(super) best: Vec<u64>,
    /// Links that leave the range.
    pub(super) leaving: Spool<Link>,
}

/// Top bit of a parent: the node's parity differs from its parent's.
const FLIP: u32 = 1 << 31;

impl Range {
    pub(super) fn open(&mut self, base: u64, end: u64, leaves: bool) {
        let n = (end - base) as usize;
        self.base = base;
        self.end = end;
        self.parent.clear();
        self.parent.extend(0..n as u32);
        self.odd.clear();
        self.odd.resize(n.div_ceil(64), 0);
        self.best.clear();
        if leaves {
            self.best.resize(n, NOBODY);
        }
    }

    /// Root of a node's class and the node's parity to it.
    pub(super) fn find(&mut self, node: u64) -> (u32, bool) {
        let mut at = (node - self.base) as u32;
        let mut parity = 0;
        loop {
            let up = self.parent[at as usize];
            let (above, flip) = (up & !FLIP, up & FLIP);
            if above == at {
                return (at, parity != 0);
            }
            // Halve the path: hang the node on its grandparent.
            let top = self.parent[above as usize];
            self.parent[at as usize] = top ^ flip;
            parity ^= self.parent[at as usize] & FLIP;
            at = top & !FLIP;
        }
    }

    pub(super) fn mark_odd(&mut self, root: u32) {
        self.odd[root as usize / 64] |= 1 << (root % 64);
    }

    pub(super) fn is_odd(&self, root: u32) -> bool {
        self.odd[root as usize / 64] >> (root % 64) & 1 != 0
    }

    pub(super) fn join(&mut self, a: u64, b: u64, parity: bool) {
        let ((ra, pa), (rb, pb)) = (self.find(a), self.find(b));
        let parity = parity ^ pa ^ pb;
        if ra == rb {
            if parity {
                self.mark_odd(ra);
            }
            return;
        }
        // The least node is the root: it names the component.
        let (low, high) = (ra.min(rb), ra.max(rb));
        self.parent[high as usize] = low | if parity { FLIP } else { 0 };
        if self.is_odd(high) {
            self.mark_odd(low);
        }
    }
}
