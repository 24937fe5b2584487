//! Union-find with parity: sets of nodes, each node knowing whether it must be flipped to agree
//! with the root of its set.
//!
//! Why it works: a word of a node names an ancestor and the flip against it; flips add up
//! along a path. The smaller root always stays root, so a root is the smallest node of its set,
//! and parents are smaller than children: one ascending sweep reaches every root.
//!
//! Memory: a word a node. I/O: none.

use crate::corner::Index;

/// What joining two nodes came to.
pub enum Joined {
    /// Two sets became one: `under` has the root `root` now, and is flipped against it or not.
    Now {
        /// The root of both.
        root: u64,
        /// What was a root before.
        under: u64,
        /// Whether `under` must be flipped to agree with `root`.
        flip: bool,
    },
    /// They were joined before, with this parity.
    Before,
    /// They were joined before with the other parity, in the set of this root.
    Conflict(u64),
}

/// Links that are looked up together: their words are on the way at the same time.
const BATCH: usize = 128;

/// Sets of nodes: `2 * ancestor + flip` for each node.
pub struct Forest<W>(Vec<W>);

impl<W: Index> Forest<W> {
    /// `count` sets of one. The caller has the memory: one `W` each.
    pub fn new(count: u64) -> Forest<W> {
        let mut forest = Forest(Vec::new());
        forest.reset(count);
        forest
    }

    /// `count` sets of one again.
    pub fn reset(&mut self, count: u64) {
        self.0.clear();
        self.0.extend((0..count).map(|i| W::of(i << 1)));
    }

    /// The words.
    pub fn words(&self) -> &[W] {
        &self.0
    }

    /// The words, for who needs no more sets.
    pub fn into_words(self) -> Vec<W> {
        self.0
    }

    /// The root of a node, and whether the node is flipped against it; halves the path.
    #[inline]
    pub fn find(&mut self, node: u64) -> (u64, bool) {
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

    /// Joins two nodes: parity is true when one must be flipped to agree with the other.
    #[inline]
    pub fn join(&mut self, a: u64, b: u64, parity: bool) -> Joined {
        let (a, b) = (self.find(a), self.find(b));
        self.join_roots(a, b, parity)
    }

    #[inline]
    fn join_roots(
        &mut self,
        (a, flip_a): (u64, bool),
        (b, flip_b): (u64, bool),
        parity: bool,
    ) -> Joined {
        let flip = parity ^ flip_a ^ flip_b;
        if a == b {
            return if flip {
                Joined::Conflict(a)
            } else {
                Joined::Before
            };
        }
        let (root, under) = (a.min(b), a.max(b));
        self.0[under as usize] = W::of(root << 1 | u64::from(flip));
        Joined::Now { root, under, flip }
    }

    /// Joins many pairs; `conflict` is told the root at each that disagrees.
    ///
    /// Words of distant nodes come from memory, not from the cache. So for a batch of links all
    /// words are loaded before one is needed, then those of all their ancestors: the loads do not
    /// wait for each other. What a join changes meanwhile does no harm, since an ancestor stays
    /// one, with the same parity.
    pub fn join_all<L>(
        &mut self,
        links: &[L],
        get: impl Fn(&L) -> (u64, u64, bool),
        mut conflict: impl FnMut(u64),
    ) {
        let mut ends = [[0u64; 2]; BATCH];
        for batch in links.chunks(BATCH) {
            let ends = &mut ends[..batch.len()];
            for (words, link) in ends.iter_mut().zip(batch) {
                let (a, b, _) = get(link);
                *words = [a, b].map(|node| self.0[node as usize].wide());
            }
            for words in ends.iter_mut() {
                *words = words.map(|word| self.0[(word >> 1) as usize].wide() ^ (word & 1));
            }
            for (words, link) in ends.iter().zip(batch) {
                let (a, b, parity) = get(link);
                let [a, b] = [(a, words[0]), (b, words[1])].map(|(node, word)| {
                    let (root, flip) = self.find(word >> 1);
                    let flip = flip ^ (word & 1 == 1);
                    self.0[node as usize] = W::of(root << 1 | u64::from(flip));
                    (root, flip)
                });
                if let Joined::Conflict(root) = self.join_roots(a, b, parity) {
                    conflict(root);
                }
            }
        }
    }

    /// Makes every word name the root itself.
    pub fn flatten(&mut self) {
        for i in 0..self.0.len() {
            let word = self.0[i].wide();
            // Flat already, since ancestors are smaller; a root stays what it is.
            self.0[i] = W::of(self.0[(word >> 1) as usize].wide() ^ (word & 1));
        }
    }

    /// Replaces the words by `2 * number + flip`, sets numbered in ascending order of roots;
    /// returns how many there are.
    pub fn number(&mut self) -> u64 {
        let mut sets = 0;
        for i in 0..self.0.len() {
            let word = self.0[i].wide();
            let above = (word >> 1) as usize;
            self.0[i] = if above == i {
                sets += 1;
                W::of((sets - 1) << 1)
            } else {
                // Already numbered: ancestors are smaller.
                W::of(self.0[above].wide() ^ (word & 1))
            };
        }
        sets
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn agree(joined: Joined) -> bool {
        !matches!(joined, Joined::Conflict(_))
    }

    #[test]
    fn joins_numbers_and_finds_conflicts() {
        let mut forest = Forest::<u32>::new(7);
        assert!(agree(forest.join(5, 3, true)));
        assert!(agree(forest.join(3, 6, true)));
        assert!(agree(forest.join(6, 5, false)));
        assert!(matches!(forest.join(6, 3, false), Joined::Conflict(3)));
        assert!(agree(forest.join(1, 4, false)));
        assert_eq!(forest.number(), 4);
        assert_eq!(forest.words(), [0, 2, 4, 6, 2, 7, 7]);
    }

    #[test]
    fn long_chains_agree_with_a_walk() {
        // Each node is linked to the one before with a known parity; order is scrambled.
        let n = 1000u64;
        let flip = |i: u64| (i * 7919 % 13) % 2 == 1;
        let links: Vec<(u64, u64, bool)> = (0..n - 1)
            .map(|i| i * 617 % (n - 1))
            .map(|i| (i, i + 1, flip(i) ^ flip(i + 1)))
            .collect();
        let mut one = Forest::<u32>::new(n);
        assert!(links.iter().all(|&(a, b, p)| agree(one.join(a, b, p))));
        let mut all = Forest::<u64>::new(n);
        all.join_all(&links, |l| *l, |_| panic!("no conflict is there"));
        let mut conflicts = Vec::new();
        all.join_all(
            &[(9, 8, !flip(9) ^ flip(8))],
            |l| *l,
            |root| conflicts.push(root),
        );
        assert_eq!(conflicts, [0]);
        one.flatten();
        assert!(one.words().iter().all(|w| w >> 1 == 0));
        assert_eq!((one.number(), all.number()), (1, 1));
        for i in 0..n as usize {
            assert_eq!(one.words()[i] & 1 == 1, flip(i as u64) ^ flip(0));
            assert_eq!(u64::from(one.words()[i]), all.words()[i]);
        }
    }
}
