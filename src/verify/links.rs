//! Connected components of a graph that need not fit in memory, and whether each has a
//! consistent orientation: a union-find with parity, range by range of the nodes.
//!
//! Why it works: nodes are cut into ranges that fit, and the ranges are settled from the
//! highest to the lowest. A link belongs to the range of its higher end. Within a range a
//! union-find joins what its inner links join. A class of the range with links to lower
//! nodes hooks to the *highest* of them, its parent, and every other lower neighbour becomes
//! a neighbour of the parent: that keeps what is connected connected, and the class needs no
//! further look. A class without lower links is a component of its own, and its least node
//! the least of the component, since hooks only go down. Parities add along a path; two
//! paths of different parity between the same nodes make the component odd (there is no
//! consistent orientation), and an odd class tells its parent by a link of parity 1 from the
//! parent to itself. When all nodes fit in one range this is a plain union-find: nothing is
//! written at all.
//!
//! Memory: 4 1/8 bytes a node of one range when there is one, else 12 1/8, plus a buffer for
//! each of the open files: a tree of ranges, [`fan`](Links) files a level, so that any number
//! of nodes goes with any memory. I/O: 16 bytes written and read for each link that leaves a
//! range, a few times for a mesh.

use super::range::{Link, NOBODY, PARITY, Range, Shape};
use super::spool::Spool;
use crate::disk::{Lease, Scratch, Workspace};
use crate::error::Result;

/// One level of the tree of ranges: `fan` files, each for `width` nodes from `start` on.
struct Level {
    start: u64,
    width: u64,
    current: u64,
    files: Vec<Option<Spool<Link>>>,
}

/// A graph that links are added to.
pub(super) struct Links {
    nodes: u64,
    shape: Shape,
    scratch: Scratch,
    levels: Vec<Level>,
    leaf: Range,
    _lease: Lease,
}

impl Links {
    /// A graph of `nodes` nodes without links, settled in `memory` bytes.
    pub(super) fn new(ws: &Workspace, nodes: u64, memory: u64) -> Result<Links> {
        let shape = Shape::of(nodes, memory);
        let lease = ws.budget.lease("connectivity", shape.bytes())?;
        let mut links = Links {
            nodes,
            shape,
            scratch: ws.scratch.clone(),
            levels: Vec::new(),
            leaf: Range {
                base: 0,
                end: 0,
                parent: Vec::with_capacity(shape.range as usize),
                odd: Vec::with_capacity((shape.range as usize).div_ceil(64)),
                best: Vec::with_capacity(if shape.levels == 0 {
                    0
                } else {
                    shape.range as usize
                }),
                leaving: Spool::new(shape.buffer),
            },
            _lease: lease,
        };
        if nodes > 0 {
            links.open(0, nodes, None)?;
        }
        Ok(links)
    }

    /// Number of ranges that the nodes are settled in.
    pub(super) fn ranges(&self) -> u64 {
        self.nodes.div_ceil(self.shape.range)
    }

    /// Nodes under one file of level `depth`.
    fn width(&self, depth: usize) -> u64 {
        let below = self.shape.levels - 1 - depth as u32;
        (0..below).fold(self.shape.range, |w, _| w.saturating_mul(self.shape.fan))
    }

    /// Opens the highest range of the nodes from `start` to `end`, whose links are in `file`,
    /// and the levels above it.
    fn open(&mut self, start: u64, end: u64, file: Option<Spool<Link>>) -> Result<()> {
        let (mut start, mut file) = (start, file);
        while self.levels.len() < self.shape.levels as usize {
            let width = self.width(self.levels.len());
            let current = (end - start - 1) / width;
            self.levels.push(Level {
                start,
                width,
                current,
                files: (0..self.shape.fan).map(|_| None).collect(),
            });
            if let Some(file) = file.take() {
                file.read(|link| self.push_link(link))?;
            }
            start += current * width;
            file = self.take_file();
        }
        self.leaf.open(start, end, start > 0);
        match file {
            Some(file) => file.read(|link| self.push_link(link)),
            None => Ok(()),
        }
    }

    /// The file of the current range of the deepest level.
    fn take_file(&mut self) -> Option<Spool<Link>> {
        let level = self.levels.last_mut()?;
        level.files[level.current as usize].take()
    }

    /// Adds a link; parity 1 says that the two are oriented against each other.
    pub(super) fn push(&mut self, a: u64, b: u64, parity: bool) -> Result<()> {
        self.push_link(Link::new(a, b, parity))
    }

    fn push_link(&mut self, link: Link) -> Result<()> {
        let (hi, lo, parity) = link.parts();
        if hi == lo && !parity {
            return Ok(());
        }
        if self.leaf.base <= hi && hi < self.leaf.end {
            if lo >= self.leaf.base {
                self.leaf.join(hi, lo, parity);
                return Ok(());
            }
            return self.leaf.leaving.push(&self.scratch, link);
        }
        for level in self.levels.iter_mut().rev() {
            if hi >= level.start {
                let which = ((hi - level.start) / level.width) as usize;
                let file = level.files[which].get_or_insert_with(|| Spool::new(self.shape.buffer));
                return file.push(&self.scratch, link);
            }
        }
        Ok(())
    }

    /// Settles all ranges. For each range, from the highest to the lowest, `roots` is given
    /// its component roots in ascending order: the least node of each component, and whether
    /// the component is odd.
    pub(super) fn finish(mut self, mut roots: impl FnMut(u64, bool) -> Result<()>) -> Result<()> {
        if self.nodes == 0 {
            return Ok(());
        }
        loop {
            self.hook()?;
            let leaf = &self.leaf;
            for (i, &up) in leaf.parent.iter().enumerate() {
                if up == i as u32 && leaf.best.get(i).is_none_or(|&b| b == NOBODY) {
                    roots(leaf.base + i as u64, leaf.is_odd(up))?;
                }
            }
            let base = leaf.base;
            if base == 0 {
                return Ok(());
            }
            // Close the levels whose lowest range this was, then open the next range.
            while self.levels.last().is_some_and(|level| level.start == base) {
                self.levels.pop();
            }
            // Until the next range is open, nothing may be joined to this one.
            self.leaf.end = self.leaf.base;
            let Some(level) = self.levels.last_mut() else {
                return Ok(());
            };
            level.current -= 1;
            let start = level.start + level.current * level.width;
            let file = self.take_file();
            self.open(start, base, file)?;
        }
    }

    /// Hooks every class with lower neighbours to the highest of them.
    fn hook(&mut self) -> Result<()> {
        let leaving = std::mem::replace(&mut self.leaf.leaving, Spool::new(self.shape.buffer));
        if leaving.len() == 0 {
            return Ok(());
        }
        let leaf = &mut self.leaf;
        leaving.read(|link| {
            let (hi, lo, parity) = link.parts();
            let (root, own) = leaf.find(hi);
            let best = &mut leaf.best[root as usize];
            if *best == NOBODY || (*best & !PARITY) < lo {
                *best = lo | if parity ^ own { PARITY } else { 0 };
            }
            Ok(())
        })?;
        leaving.read(|link| {
            let (hi, lo, parity) = link.parts();
            let (root, own) = self.leaf.find(hi);
            let best = self.leaf.best[root as usize];
            let (parent, up) = (best & !PARITY, best & PARITY != 0);
            // From lo to the class, and on to its parent. For the parent itself this is a
            // link to itself, which says something only when the parities differ.
            self.push(parent, lo, parity ^ own ^ up)
        })?;
        for root in 0..self.leaf.parent.len() as u32 {
            if self.leaf.parent[root as usize] == root && self.leaf.is_odd(root) {
                let best = self.leaf.best[root as usize];
                if best != NOBODY {
                    self.push(best & !PARITY, best & !PARITY, true)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::testing::workspace;

    /// Roots and oddness by labels spread until nothing changes: too simple to be wrong.
    fn naive(nodes: u64, links: &[(u64, u64, bool)]) -> Vec<(u64, bool)> {
        // Node 2i is node i as it is, 2i + 1 reversed: odd when both meet.
        let mut label: Vec<u64> = (0..2 * nodes).collect();
        let mut changed = true;
        while changed {
            changed = false;
            for &(a, b, parity) in links {
                for side in 0..2 {
                    let (x, y) = (2 * a + side, 2 * b + (side ^ u64::from(parity)));
                    let least = label[x as usize].min(label[y as usize]);
                    changed |= label[x as usize] != least || label[y as usize] != least;
                    label[x as usize] = least;
                    label[y as usize] = least;
                }
            }
        }
        let root = |i: u64| label[2 * i as usize].min(label[2 * i as usize + 1]) / 2;
        (0..nodes)
            .filter(|&i| root(i) == i)
            .map(|i| (i, label[2 * i as usize] == label[2 * i as usize + 1]))
            .collect()
    }

    fn settle(nodes: u64, links: &[(u64, u64, bool)], memory: u64) -> (u64, Vec<(u64, bool)>) {
        let (ws, _dir) = workspace(4 << 20, 1);
        let mut graph = Links::new(&ws, nodes, memory).unwrap();
        let ranges = graph.ranges();
        for &(a, b, parity) in links {
            graph.push(a, b, parity).unwrap();
        }
        let mut roots = Vec::new();
        graph
            .finish(|node, odd| {
                roots.push((node, odd));
                Ok(())
            })
            .unwrap();
        assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
        roots.sort();
        (ranges, roots)
    }

    #[test]
    fn settles_any_graph_in_any_memory() {
        let mut seed = 1u64;
        let mut random = move |n: u64| {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        let mut most = 0;
        for round in 0..60 {
            let nodes = [1, 2, 500, 3_000, 8_000, 20_000][round % 6];
            let span = [nodes, 7.min(nodes), 300.min(nodes)][round % 3];
            let links: Vec<_> = (0..nodes * (round as u64 % 4) / 2)
                .map(|_| {
                    let a = random(nodes);
                    let b = (a + random(span)) % nodes;
                    // Sides that agree with a colouring but for a few.
                    (a, b, ((a ^ b) & 1 != 0) ^ (random(5_000) == 0))
                })
                .collect();
            let expected = naive(nodes, &links);
            for memory in [6 << 10, 12 << 10, 100 << 10, 1 << 20] {
                let (ranges, roots) = settle(nodes, &links, memory);
                assert_eq!(roots, expected, "{nodes} nodes in {memory} bytes");
                most = most.max(ranges);
            }
        }
        assert!(most > 100, "{most} ranges at most");
    }

    #[test]
    fn no_node_and_no_link() {
        assert_eq!(settle(0, &[], 1 << 20).1, []);
        assert_eq!(settle(2, &[], 1 << 20).1, [(0, false), (1, false)]);
        assert_eq!(settle(1, &[(0, 0, true)], 1 << 20).1, [(0, true)]);
    }
}
