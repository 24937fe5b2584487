//! Stitch: joins local components over the links, with parity, and numbers the results.
//!
//! Why it works: a union-find whose every node knows whether it must be flipped to agree with
//! its parent. A link inside one tree that disagrees with the parities shows a component that
//! cannot be oriented. The smaller root always stays root, and local components are numbered
//! by their first triangle, so a root is the local component with the component's first
//! triangle; one ascending sweep then replaces every parent by the component's number, since a
//! parent is always smaller than its child.
//!
//! Memory: one index (4 or 8 bytes) and two bits for each local component. I/O: links read
//! once, sequentially; 16 bytes for each local component.

use super::Job;
use super::nodes::Nodes;
use super::records::Link;
use super::scratch_items;
use crate::corner::Index;
use crate::disk::{Budget, Lease, ScratchFile};
use crate::error::Result;

/// A set of bits, leased.
pub struct Bits {
    words: Vec<u64>,
    _lease: Lease,
}

impl Bits {
    /// `count` bits, all 0.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, what: &str, count: u64) -> Result<Bits> {
        let words = count.div_ceil(64);
        Ok(Bits {
            _lease: budget.lease(what, words * 8)?,
            words: vec![0; words as usize],
        })
    }

    /// Sets bit i.
    pub fn set(&mut self, i: u64) {
        self.words[(i / 64) as usize] |= 1 << (i % 64);
    }

    /// Bit i.
    #[inline]
    pub fn get(&self, i: u64) -> bool {
        self.words[(i / 64) as usize] >> (i % 64) & 1 == 1
    }

    /// True when any bit is 1.
    pub fn any(&self) -> bool {
        self.words.iter().any(|&w| w != 0)
    }
}

/// Union-find with parity: `2 * parent + flip` for each node.
struct Forest<W>(Vec<W>);

impl<W: Index> Forest<W> {
    /// The root of a node, and whether the node is flipped against it; halves the path.
    fn find(&mut self, node: u64) -> (u64, bool) {
        let (mut at, mut flip) = (node, false);
        loop {
            let word = self.0[at as usize].wide();
            let parent = word >> 1;
            if parent == at {
                return (at, flip);
            }
            let above = self.0[parent as usize].wide();
            // Skip the parent: parities add up along the path.
            let skip = above ^ (word & 1);
            self.0[at as usize] = W::of(skip);
            flip ^= skip & 1 == 1;
            at = skip >> 1;
        }
    }

    /// Joins two nodes; false when they were joined before with the other parity.
    fn join(&mut self, a: u64, b: u64, parity: bool) -> bool {
        let ((a, flip_a), (b, flip_b)) = (self.find(a), self.find(b));
        let parity = parity ^ flip_a ^ flip_b;
        if a == b {
            return !parity;
        }
        self.0[a.max(b) as usize] = W::of(a.min(b) << 1 | u64::from(parity));
        true
    }
}

/// Plain union-find, without parity: which components hang together at non-manifold edges.
pub struct Union {
    parent: Vec<u64>,
    sets: u64,
    _lease: Lease,
}

impl Union {
    /// `count` sets of one; 8 bytes each.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, count: u64) -> Result<Union> {
        let what = format!("{count} components that non-manifold edges may join");
        Ok(Union {
            _lease: budget.lease(&what, count * 8)?,
            parent: (0..count).collect(),
            sets: count,
        })
    }

    fn find(&mut self, mut at: u64) -> u64 {
        while self.parent[at as usize] != at {
            let above = self.parent[self.parent[at as usize] as usize];
            self.parent[at as usize] = above;
            at = above;
        }
        at
    }

    /// Joins the sets of a and b.
    pub fn join(&mut self, a: u64, b: u64) {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            self.parent[a.max(b) as usize] = a.min(b);
            self.sets -= 1;
        }
    }

    /// Number of sets.
    pub fn sets(&self) -> u64 {
        self.sets
    }
}

/// The component of each local component.
pub struct Labels<W> {
    /// `2 * component + flip` for each local component: flip is 1 when it must be flipped to
    /// agree with the component's first triangle.
    map: Vec<W>,
    /// Number of components.
    pub components: u64,
    /// The components that cannot be oriented.
    pub nonorientable: Bits,
    _lease: Lease,
}

impl<W: Index> Labels<W> {
    /// (component, flip) of a local component.
    #[inline]
    pub fn get(&self, local: u64) -> (u64, bool) {
        let word = self.map[local as usize].wide();
        (word >> 1, word & 1 == 1)
    }
}

/// Joins the local components over the links; `conflicts` hands the numbers of those that
/// contradict themselves to its argument.
///
/// # Errors
/// [`crate::Error::Budget`] when the nodes do not fit, [`crate::Error::Io`].
pub fn stitch<W: Index>(
    job: &Job,
    nodes: &Nodes,
    links: &ScratchFile,
    conflicts: impl FnOnce(&mut dyn FnMut(u64)) -> Result<()>,
) -> Result<Labels<W>> {
    let (ws, count) = (job.ws, nodes.count());
    let what = format!("{count} local components in the union-find");
    let lease = ws.budget.lease(&what, count * W::BYTES as u64)?;
    let mut forest = Forest((0..count).map(|i| W::of(i << 1)).collect::<Vec<W>>());
    let mut marked = Bits::new(&ws.budget, "parity conflicts", count)?;
    scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
        for link in links {
            let (a, b, parity) = link.get();
            let (a, b) = (nodes.number(a), nodes.number(b));
            if !forest.join(a, b, parity) {
                marked.set(a);
            }
        }
        ws.progress.advance(links.len() as u64);
        Ok(())
    })?;
    conflicts(&mut |node| marked.set(node))?;
    let components = number(&mut forest.0);
    let mut nonorientable = Bits::new(&ws.budget, "non-orientable components", components)?;
    for (i, word) in forest.0.iter().enumerate() {
        if marked.get(i as u64) {
            nonorientable.set(word.wide() >> 1);
        }
    }
    Ok(Labels {
        map: forest.0,
        components,
        nonorientable,
        _lease: lease,
    })
}

/// Replaces parents by component numbers, in ascending order of roots; returns their number.
fn number<W: Index>(forest: &mut [W]) -> u64 {
    let mut components = 0;
    for i in 0..forest.len() {
        let word = forest[i].wide();
        let parent = (word >> 1) as usize;
        forest[i] = if parent == i {
            components += 1;
            W::of((components - 1) << 1)
        } else {
            // Already numbered: parents are smaller than children.
            W::of(forest[parent].wide() ^ (word & 1))
        };
    }
    components
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joins_numbers_and_finds_conflicts() {
        let mut forest = Forest((0..7u32).map(|i| i << 1).collect());
        assert!(forest.join(5, 3, true));
        assert!(forest.join(3, 6, true));
        assert!(forest.join(6, 5, false));
        assert!(!forest.join(6, 3, false));
        assert!(forest.join(1, 4, false));
        assert_eq!(number(&mut forest.0), 4);
        assert_eq!(forest.0, [0, 2, 4, 6, 2, 7, 7]);
    }

    #[test]
    fn long_chains_agree_with_a_walk() {
        // Each node is linked to the one before with a known parity; order is scrambled.
        let n = 1000u64;
        let flip = |i: u64| (i * 7919 % 13) % 2 == 1;
        let mut forest = Forest((0..n as u32).map(|i| i << 1).collect());
        for i in 0..n - 1 {
            let i = i * 617 % (n - 1);
            assert!(forest.join(i, i + 1, flip(i) ^ flip(i + 1)));
        }
        assert_eq!(number(&mut forest.0), 1);
        for i in 0..n {
            assert_eq!(forest.0[i as usize] & 1 == 1, flip(i) ^ flip(0));
        }
    }
}
