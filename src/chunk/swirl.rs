//! The swirl: walks triangle to triangle across settled edges with an explicit stack, labels
//! the local components and orients each like its first triangle.
//!
//! Why it works: every settled regular edge is looked at from both sides, so a triangle that
//! is reached twice with different flips is found whatever the order of the walk, and the
//! component is then known not to be orientable. Seeds are taken in ascending order, so local
//! components are numbered by their first triangle.
//!
//! Memory: 4 bytes a triangle for the result, at most 4 for the stack, [`Local`] for each local
//! component. O(C) time, no recursion.

use super::pair::{BORDER, DEGENERATE};

/// Of a degenerate triangle: in no component.
pub const NO_COMPONENT: u32 = u32::MAX;
const UNSEEN: u32 = u32::MAX - 1;

/// A local component: triangles of one chunk joined across settled edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Local {
    /// Its first triangle, local.
    pub first: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Triangles whose orientation differs from the first one's.
    pub flipped: u32,
    /// Its settled border edges.
    pub borders: u32,
    /// True when a settled edge contradicts another.
    pub conflict: bool,
}

/// The result of the swirl on one chunk. Reused from chunk to chunk.
#[derive(Debug, Default)]
pub struct Swirl {
    /// For each triangle `2 * local component + flip`, or [`NO_COMPONENT`]. Flip is 1 when the
    /// triangle must be flipped to agree with the component's first triangle.
    pub label: Vec<u32>,
    /// The local components, by first triangle.
    pub components: Vec<Local>,
    stack: Vec<u32>,
}

impl Swirl {
    /// Walks a chunk whose corners were paired into `opposite`; opposites beyond its end (lone
    /// edges of a cell) are not walked to.
    pub fn walk(&mut self, opposite: &[u32]) {
        let triangles = opposite.len() / 3;
        self.components.clear();
        self.label.clear();
        self.label.resize(triangles, UNSEEN);
        for seed in 0..triangles {
            if self.label[seed] != UNSEEN {
                continue;
            }
            if opposite[3 * seed] == DEGENERATE {
                self.label[seed] = NO_COMPONENT;
                continue;
            }
            let conflict = self.walk_from(seed as u32, opposite);
            self.components.push(Local {
                first: seed as u32,
                triangles: 0,
                flipped: 0,
                borders: 0,
                conflict,
            });
        }
        self.tally(opposite);
    }

    /// Labels everything that `seed` reaches; true when flips contradict each other.
    fn walk_from(&mut self, seed: u32, opposite: &[u32]) -> bool {
        let name = (self.components.len() as u32) << 1;
        let mut conflict = false;
        let end = 2 * opposite.len() as u32;
        self.label[seed as usize] = name;
        self.stack.push(seed);
        while let Some(t) = self.stack.pop() {
            let own = self.label[t as usize];
            for &o in &opposite[3 * t as usize..3 * t as usize + 3] {
                if o >= end {
                    continue;
                }
                let across = o / 6;
                let wanted = own ^ (o & 1);
                let label = &mut self.label[across as usize];
                if *label == UNSEEN {
                    *label = wanted;
                    self.stack.push(across);
                } else {
                    conflict |= *label != wanted;
                }
            }
        }
        conflict
    }

    fn tally(&mut self, opposite: &[u32]) {
        for (label, o) in self.label.iter().zip(opposite.as_chunks::<3>().0) {
            if *label == NO_COMPONENT {
                continue;
            }
            let local = &mut self.components[(label >> 1) as usize];
            local.triangles += 1;
            local.flipped += label & 1;
            local.borders += o.iter().map(|&o| u32::from(o == BORDER)).sum::<u32>();
        }
    }

    /// True when some triangle is flipped.
    pub fn any_flip(&self) -> bool {
        self.components.iter().any(|c| c.flipped > 0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::pair::Pairs;
    use super::*;

    fn walk(local: &[u32], span: usize) -> Swirl {
        let mut pairs = Pairs::default();
        pairs.pair(local, &vec![false; span]);
        let mut swirl = Swirl::default();
        swirl.walk(&pairs.opposite);
        swirl
    }

    #[test]
    fn tetrahedron_with_one_triangle_flipped() {
        let swirl = walk(&[0, 1, 2, 0, 1, 3, 1, 3, 2, 2, 3, 0], 4);
        assert_eq!(swirl.components.len(), 1);
        let c = swirl.components[0];
        assert_eq!(
            (c.triangles, c.flipped, c.borders, c.conflict),
            (4, 1, 0, false)
        );
    }

    #[test]
    fn moebius_strip_conflicts() {
        let strip: Vec<u32> = (0..5).flat_map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        let swirl = walk(&strip, 5);
        assert_eq!(swirl.components.len(), 1);
        assert!(swirl.components[0].conflict);
        assert_eq!(swirl.components[0].borders, 5);
    }

    #[test]
    fn components_are_numbered_by_first_triangle_and_skip_degenerate_ones() {
        let swirl = walk(&[9, 9, 1, 0, 1, 2, 3, 4, 5, 2, 1, 6], 10);
        assert_eq!(swirl.label, [NO_COMPONENT, 0, 2, 0]);
        assert_eq!(swirl.components[1].first, 2);
    }
}
