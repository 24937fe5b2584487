//! One stop of the contraction: a run of nodes that are eliminated together, in memory.
//!
//! Why a union-find in the run: links inside it are joined at once, so what leaves the run are
//! links of its *groups*, and a link waits at one stop, not at one node. Of the nodes behind
//! the run that a group is linked to, the *largest* becomes its parent: it takes over the
//! group's other links, and hubs near the end of all nodes gather what small ones would relay from
//! stop to stop.
//!
//! Memory: [`Stop::node_bytes`] for each node of the run. I/O: none.

use super::forest::{Forest, Joined};
use crate::corner::Index;

/// A run of nodes, with what is known of their groups.
pub struct Stop<W> {
    start: u64,
    forest: Forest<u32>,
    /// For a root: `2 * node + flip` of the largest node behind the run that its group is
    /// linked to; 0 is none. Once the run is flat, the same for every node.
    best: Vec<W>,
    /// For a root: `4 * node + 2 * conflict + flip` of the smallest node that was merged into its
    /// group here or before.
    least: Vec<W>,
}

/// The smallest node of a part of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Least {
    /// The node.
    pub node: u64,
    /// Whether it must be flipped to agree with the node that it is told to.
    pub flip: bool,
    /// True when the part cannot be oriented.
    pub conflict: bool,
}

/// A group as it leaves the run.
pub struct Group {
    /// The smallest node of the run in it.
    pub root: u64,
    /// Its parent behind the run, and the flip against it; none left means that the component is
    /// complete.
    pub parent: Option<(u64, bool)>,
    /// The smallest node of the group and of what was merged into it, against the root.
    pub least: Least,
}

impl<W: Index> Stop<W> {
    /// A stop without nodes.
    pub fn new() -> Stop<W> {
        Stop {
            start: 0,
            forest: Forest::new(0),
            best: Vec::new(),
            least: Vec::new(),
        }
    }

    /// Bytes held for each node.
    pub fn node_bytes() -> u64 {
        4 + 2 * W::BYTES as u64
    }

    /// Turns to the nodes from `start`, each alone.
    pub fn reset(&mut self, start: u64, count: u64) {
        self.start = start;
        self.forest.reset(count);
        self.best.clear();
        self.best.resize(count as usize, W::of(0));
        self.least.clear();
        self.least
            .extend((start..start + count).map(|i| W::of(i << 2)));
    }

    fn end(&self) -> u64 {
        self.start + self.best.len() as u64
    }

    /// Takes a link from a node of the run to one that is not smaller.
    #[inline]
    pub fn link(&mut self, a: u64, b: u64, parity: bool) {
        if b >= self.end() {
            let (root, flip) = self.forest.find(a - self.start);
            self.offer(root, b << 1 | u64::from(parity ^ flip));
            return;
        }
        match self.forest.join(a - self.start, b - self.start, parity) {
            Joined::Now { root, under, flip } => {
                let flip = u64::from(flip);
                let (best, least) = (self.best[under as usize], self.least[under as usize]);
                if best.wide() != 0 {
                    self.offer(root, best.wide() ^ flip);
                }
                self.merge(root, least.wide() ^ flip);
            }
            Joined::Before => {}
            Joined::Conflict(root) => self.conflict(root),
        }
    }

    /// Takes the smallest node of a part that was merged into a node of the run before.
    pub fn told(&mut self, at: u64, least: Least) {
        let (root, flip) = self.forest.find(at - self.start);
        let bits = u64::from(least.conflict) << 1 | u64::from(least.flip ^ flip);
        self.merge(root, least.node << 2 | bits);
    }

    #[inline]
    fn offer(&mut self, root: u64, word: u64) {
        // Links to the same node that disagree are found when they are re-keyed.
        let best = &mut self.best[root as usize];
        if word >> 1 > best.wide() >> 1 {
            *best = W::of(word);
        }
    }

    #[inline]
    fn merge(&mut self, root: u64, word: u64) {
        let least = &mut self.least[root as usize];
        let have = least.wide();
        let conflict = (have | word) & 2;
        *least = W::of(if word >> 2 < have >> 2 { word } else { have } | conflict);
    }

    fn conflict(&mut self, root: u64) {
        let least = &mut self.least[root as usize];
        *least = W::of(least.wide() | 2);
    }

    /// Ends the joining inside the run; call it before what follows.
    pub fn flatten(&mut self) {
        self.forest.flatten();
        for (i, word) in self.forest.words().iter().enumerate() {
            let best = self.best[*word as usize >> 1].wide();
            if best != 0 {
                self.best[i] = W::of(best ^ u64::from(word & 1));
            }
        }
    }

    /// The word of each node: `2 * root + flip`, counted from the first node of the run.
    pub fn words(&self) -> &[u32] {
        self.forest.words()
    }

    /// What becomes of a link when the group of `a` is merged into its parent: a link from `b` to
    /// the parent with a parity, both behind the run; none when nothing is left of it.
    #[inline]
    pub fn rekeyed(&mut self, a: u64, b: u64, parity: bool) -> Option<(u64, u64, bool)> {
        if b < self.end() {
            return None;
        }
        let best = self.best[(a - self.start) as usize].wide();
        let parity = parity ^ (best & 1 == 1);
        if b == best >> 1 {
            if parity {
                self.contradict(a);
            }
            return None;
        }
        Some((b, best >> 1, parity))
    }

    /// Notes that the component of a node of the run cannot be oriented.
    pub fn contradict(&mut self, a: u64) {
        let word = u64::from(self.forest.words()[(a - self.start) as usize]);
        self.conflict(word >> 1);
    }

    /// The groups, in ascending order of roots.
    pub fn groups(&self) -> impl Iterator<Item = Group> {
        let roots = self.forest.words().iter().enumerate();
        roots
            .filter(|(i, word)| **word as usize >> 1 == *i)
            .map(|(i, _)| {
                let (best, least) = (self.best[i].wide(), self.least[i].wide());
                Group {
                    root: self.start + i as u64,
                    parent: (best != 0).then_some((best >> 1, best & 1 == 1)),
                    least: Least {
                        node: least >> 2,
                        flip: least & 1 == 1,
                        conflict: least & 2 != 0,
                    },
                }
            })
    }
}
