//! The records of a contraction: two words each, ids beside a few bits. So a node must stay below
//! an eighth of what a word holds.

use super::stop::Least;
use crate::corner::Index;
use crate::shuffle::Record;
use bytemuck::{Pod, Zeroable};

/// What waits at a stop, by node: a link to a larger node (`4 * node + 2 * parity`), or the
/// smallest node of a part that was merged into this one (`8 * node + 4 * conflict + 2 * flip + 1`).
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Sent<W>([W; 2]);

impl<W: Index> Record for Sent<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// What a record says.
pub(super) enum Said {
    Link(u64, u64, bool),
    Told(u64, Least),
}

impl<W: Index> Sent<W> {
    #[inline]
    pub(super) fn link(a: u64, b: u64, parity: bool) -> Self {
        Sent([W::of(a), W::of(b << 2 | u64::from(parity) << 1)])
    }

    pub(super) fn told(to: u64, least: Least) -> Self {
        let bits = u64::from(least.conflict) << 2 | u64::from(least.flip) << 1 | 1;
        Sent([W::of(to), W::of(least.node << 3 | bits)])
    }

    #[inline]
    pub(super) fn said(&self) -> Said {
        let [at, word] = self.0.map(W::wide);
        if word & 1 == 0 {
            return Said::Link(at, word >> 2, word & 2 != 0);
        }
        let least = Least {
            node: word >> 3,
            flip: word & 2 != 0,
            conflict: word & 4 != 0,
        };
        Said::Told(at, least)
    }
}

/// A component whose links are all used up: its smallest node; `4 * root + 2 * conflict + flip`,
/// where the root is the node that knows it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Tree<W>([W; 2]);

impl<W: Index> Record for Tree<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

impl<W: Index> Tree<W> {
    pub(super) fn new(root: u64, least: Least) -> Self {
        let bits = u64::from(least.conflict) << 1 | u64::from(least.flip);
        Tree([W::of(least.node), W::of(root << 2 | bits)])
    }

    /// (root, flip, conflict).
    pub(super) fn get(&self) -> (u64, bool, bool) {
        let word = self.0[1].wide();
        (word >> 2, word & 1 == 1, word & 2 != 0)
    }
}

/// What waits to be carried back, by node counted from the last to the first: a child's
/// question to its parent (`4 * child + 2 * parity`), or a label (`2 * label + 1`).
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Back<W>([W; 2]);

impl<W: Index> Record for Back<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// What a record that is carried back says.
pub(super) enum Answer {
    /// A child asks, with the parity against its parent.
    Ask(u64, bool),
    /// The label of this node.
    Label(u64),
}

impl<W: Index> Back<W> {
    /// The node, mirrored.
    #[inline]
    pub(super) fn node(&self) -> u64 {
        self.0[0].wide()
    }

    pub(super) fn ask(mirrored: u64, child: u64, parity: bool) -> Self {
        Back([W::of(mirrored), W::of(child << 2 | u64::from(parity) << 1)])
    }

    pub(super) fn label(mirrored: u64, label: u64) -> Self {
        Back([W::of(mirrored), W::of(label << 1 | 1)])
    }

    #[inline]
    pub(super) fn says(&self) -> Answer {
        let word = self.0[1].wide();
        if word & 1 == 1 {
            Answer::Label(word >> 1)
        } else {
            Answer::Ask(word >> 2, word & 2 != 0)
        }
    }
}
