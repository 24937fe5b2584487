//! Components that edges join anew, with parity.
//!
//! Why numbers keep their order: components ascend with their first triangles, the smallest
//! member of a set is its root, so sets ascend with theirs.
//!
//! Memory: 9 bytes a component. I/O: none.

use crate::build::graph::forest::{Forest, Joined};

/// Union-find with parity; after [`seal`](Sets::seal), sets by number.
pub(super) struct Sets {
    forest: Forest<u64>,
    /// By root, sealed by set: it contradicts itself.
    conflicts: Vec<bool>,
    count: u64,
}

impl Sets {
    /// Bytes for each component.
    pub(super) const BYTES: u64 = 9;

    pub(super) fn new(components: u64) -> Sets {
        Sets {
            forest: Forest::new(components),
            conflicts: vec![false; components as usize],
            count: components,
        }
    }

    /// Joins two components; with parity when one must turn to agree with the other.
    pub(super) fn join(&mut self, a: u64, b: u64, parity: bool) {
        match self.forest.join(a, b, parity) {
            Joined::Before => {}
            Joined::Conflict(root) => self.conflicts[root as usize] = true,
            Joined::Now { root, under, .. } => {
                self.conflicts[root as usize] |= self.conflicts[under as usize];
                self.count -= 1;
            }
        }
    }

    /// Marks a component as one that contradicts itself.
    pub(super) fn contradict(&mut self, component: u64) {
        let root = self.forest.find(component).0;
        self.conflicts[root as usize] = true;
    }

    /// Numbers the sets.
    pub(super) fn seal(&mut self) {
        let mut set = 0;
        for (c, word) in self.forest.words().iter().enumerate() {
            if (word >> 1) as usize == c {
                self.conflicts[set] = self.conflicts[c];
                set += 1;
            }
        }
        self.forest.number();
    }

    /// Set of a component, sealed, and its parity to the set's first.
    #[inline]
    pub(super) fn of(&self, component: u64) -> (u64, bool) {
        let word = self.forest.words()[component as usize];
        (word >> 1, word & 1 == 1)
    }

    /// True when a set, sealed, can be oriented.
    pub(super) fn orientable(&self, set: u64) -> bool {
        !self.conflicts[set as usize]
    }

    /// Number of sets.
    pub(super) fn count(&self) -> u64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_and_parities_agree_with_spreading() {
        let mut seed = 1u64;
        let mut random = |end: u64| {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 33) % end
        };
        for links in [0, 5, 20, 40] {
            let n = 30;
            let links: Vec<_> = (0..links)
                .map(|_| (random(n), random(n), random(8) == 0))
                .collect();
            let mut sets = Sets::new(n);
            links
                .iter()
                .for_each(|&(a, b, parity)| sets.join(a, b, parity));
            sets.seal();
            // The least component that is reached, and how.
            let mut least: Vec<(u64, bool)> = (0..n).map(|c| (c, false)).collect();
            for _ in 0..n {
                for &(a, b, parity) in links.iter().chain(&links) {
                    for (a, b) in [(a, b), (b, a)] {
                        let (root, p) = least[b as usize];
                        if root < least[a as usize].0 {
                            least[a as usize] = (root, p ^ parity);
                        }
                    }
                }
            }
            let roots: Vec<u64> = (0..n).filter(|&c| least[c as usize].0 == c).collect();
            assert_eq!(sets.count(), roots.len() as u64);
            for c in 0..n {
                let (root, parity) = least[c as usize];
                let (set, found) = sets.of(c);
                assert_eq!(roots[set as usize], root);
                let sound = links
                    .iter()
                    .filter(|(a, _, _)| least[*a as usize].0 == root)
                    .all(|&(a, b, p)| least[a as usize].1 ^ least[b as usize].1 == p);
                assert_eq!(sets.orientable(set), sound);
                assert!(found == parity || !sound);
            }
        }
    }
}
