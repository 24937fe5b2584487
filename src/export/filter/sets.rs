//! Components that edges join anew, with parity.
//!
//! Why numbers keep their order: components ascend with their first triangles, the smallest
//! member of a set is its root, so sets ascend with theirs.
//!
//! Memory: 9 bytes a component. I/O: none.

/// Union-find with parity; after [`seal`](Sets::seal), sets by number.
pub(super) struct Sets {
    /// `2 * parent + parity` to it; sealed: `2 * set + parity` to the set's smallest member.
    words: Vec<u64>,
    /// By root, sealed by set: it contradicts itself.
    conflicts: Vec<bool>,
    count: u64,
}

impl Sets {
    /// Bytes for each component.
    pub(super) const BYTES: u64 = 9;

    pub(super) fn new(components: u64) -> Sets {
        Sets {
            words: (0..components).map(|c| c << 1).collect(),
            conflicts: vec![false; components as usize],
            count: components,
        }
    }

    /// Root of a component, and the parity to it.
    fn find(&mut self, mut at: u64) -> (u64, bool) {
        let mut parity = 0;
        loop {
            let word = self.words[at as usize];
            let above = self.words[(word >> 1) as usize];
            if word >> 1 == above >> 1 {
                return (word >> 1, (parity ^ word) & 1 == 1);
            }
            // Halved: the parent's parent is next.
            self.words[at as usize] = above ^ (word & 1);
            parity ^= (above ^ word) & 1;
            at = above >> 1;
        }
    }

    /// Joins two components; with parity when one must turn to agree with the other. True when
    /// they were not joined before.
    pub(super) fn join(&mut self, a: u64, b: u64, parity: bool) -> bool {
        let ((a, p), (b, q)) = (self.find(a), self.find(b));
        let parity = p ^ q ^ parity;
        if a == b {
            self.conflicts[a as usize] |= parity;
            return false;
        }
        let (root, other) = (a.min(b), a.max(b));
        self.words[other as usize] = root << 1 | u64::from(parity);
        self.conflicts[root as usize] |= self.conflicts[other as usize];
        self.count -= 1;
        true
    }

    /// Marks a component as one that contradicts itself.
    pub(super) fn contradict(&mut self, component: u64) {
        let root = self.find(component).0;
        self.conflicts[root as usize] = true;
    }

    /// Numbers the sets.
    pub(super) fn seal(&mut self) {
        for c in 0..self.words.len() as u64 {
            let (root, parity) = self.find(c);
            self.words[c as usize] = root << 1 | u64::from(parity);
        }
        let mut number = 0;
        for c in 0..self.words.len() {
            let (root, parity) = ((self.words[c] >> 1) as usize, self.words[c] & 1);
            let mut set = self.words[root] >> 1;
            if root == c {
                set = number;
                number += 1;
                self.conflicts[set as usize] = self.conflicts[root];
            }
            self.words[c] = set << 1 | parity;
        }
    }

    /// Set of a component, sealed, and its parity to the set's first.
    #[inline]
    pub(super) fn of(&self, component: u64) -> (u64, bool) {
        let word = self.words[component as usize];
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
                .for_each(|&(a, b, parity)| _ = sets.join(a, b, parity));
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
