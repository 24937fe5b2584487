//! The parts of fans at one vertex, joined.
//!
//! Why it works: every triangle on an undecided edge of the vertex has one corner there, whose part
//! ends at that edge. So the ends that name the same other vertex are all the triangles on the
//! edge: two are opposite, and the parts go on into each other; one is a border, and three or
//! more are non-manifold, where fans end. Joined so, parts form paths and rings.
//!
//! Memory: [`Group::BYTES`] for each part that there is room for, with the parts. I/O: none.

use super::records::Part;
use crate::corner::Index;

/// A whole fan: the corners that name the chains at its ends, unless it is a ring, and one of its
/// parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Whole {
    /// The corners, packed.
    pub ends: Option<[u64; 2]>,
    /// The part.
    pub part: usize,
}

/// Joins the parts of one vertex after another. Buffers are reused.
#[derive(Debug, Default)]
pub struct Group {
    /// (other vertex, end), ends numbered two a part.
    ends: Vec<(u64, u32)>,
    /// The end that each goes on in, or [`END`].
    mates: Vec<u32>,
    seen: Vec<bool>,
    /// The fans.
    pub fans: Vec<Whole>,
}

const END: u32 = u32::MAX;

impl Group {
    /// Bytes for each part, with the part.
    pub const BYTES: u64 = 64 + 2 * 16 + 2 * 4 + 1 + 32;

    /// A group with room for so many parts.
    pub fn new(most: usize) -> Group {
        Group {
            ends: Vec::with_capacity(2 * most),
            mates: Vec::with_capacity(2 * most),
            seen: Vec::with_capacity(most),
            fans: Vec::with_capacity(most),
        }
    }

    /// Joins all parts of a vertex into [`fans`](Group::fans).
    pub fn join<W: Index>(&mut self, parts: &[Part<W>]) {
        self.fans.clear();
        self.match_ends(parts);
        self.seen.clear();
        self.seen.resize(parts.len(), false);
        for part in 0..parts.len() {
            if self.seen[part] {
                continue;
            }
            self.seen[part] = true;
            let Some(_) = parts[part].ends() else {
                self.fans.push(Whole { ends: None, part });
                continue;
            };
            let first = self.follow(2 * part as u32);
            let ends = first.map(|one| {
                // A path: its other end lies the other way.
                let two = self.follow(2 * part as u32 + 1).unwrap_or(one);
                [one, two].map(|end| corner(parts, end))
            });
            self.fans.push(Whole { ends, part });
        }
    }

    fn match_ends<W: Index>(&mut self, parts: &[Part<W>]) {
        self.ends.clear();
        self.mates.clear();
        self.mates.resize(2 * parts.len(), END);
        for (i, part) in parts.iter().enumerate() {
            for (side, (to, _)) in part.ends().into_iter().flatten().enumerate() {
                if let Some(to) = to {
                    self.ends.push((to.wide(), (2 * i + side) as u32));
                }
            }
        }
        self.ends.sort_unstable();
        for edge in self.ends.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, a), (_, b)] = *edge {
                self.mates[a as usize] = b;
                self.mates[b as usize] = a;
            }
        }
    }

    /// Goes out from an end of a part as far as it goes; `None` when it comes back.
    fn follow(&mut self, from: u32) -> Option<u32> {
        let mut end = from;
        loop {
            let mate = self.mates[end as usize];
            if mate == END {
                return Some(end);
            }
            end = mate ^ 1;
            if end == from {
                return None;
            }
            self.seen[end as usize / 2] = true;
        }
    }
}

/// The corner at an end.
fn corner<W: Index>(parts: &[Part<W>], end: u32) -> u64 {
    let ends = parts[end as usize / 2].ends();
    // An end that was followed is one of a part that has some.
    ends.map_or(u64::MAX, |ends| ends[end as usize % 2].1.wide())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: u64 = u64::MAX;

    fn fans(parts: &[Option<[(u64, u64); 2]>]) -> Vec<Option<[u64; 2]>> {
        let part = |&ends: &_| Part::<u32>::new(9, 1, (0, 0), ends);
        let parts: Vec<_> = parts.iter().map(part).collect();
        let mut group = Group::default();
        group.join(&parts);
        group.fans.iter().map(|fan| fan.ends).collect()
    }

    #[test]
    fn parts_are_joined_into_paths_and_rings() {
        assert_eq!(fans(&[None, None]), [None, None]);
        // Edges to 1, 2, 3 all the way round, in any order.
        let ring = [
            Some([(1, 10), (2, 11)]),
            Some([(1, 12), (3, 13)]),
            Some([(3, 14), (2, 15)]),
        ];
        assert_eq!(fans(&ring), [None]);
        // The edge to 3 has one triangle, and the last part ends at a decided border.
        let path = [
            Some([(1, 10), (2, 11)]),
            Some([(1, 12), (3, 13)]),
            Some([(NONE, 14), (2, 15)]),
        ];
        assert_eq!(fans(&path), [Some([13, 14])]);
        // One part that closes with itself.
        assert_eq!(fans(&[Some([(5, 1), (5, 2)])]), [None]);
    }

    #[test]
    fn three_ends_on_an_edge_are_the_ends_of_three_fans() {
        let book = [
            Some([(1, 10), (NONE, 11)]),
            Some([(NONE, 12), (1, 13)]),
            Some([(1, 14), (1, 15)]),
        ];
        let expected = [Some([10, 11]), Some([12, 13]), Some([14, 15])];
        assert_eq!(fans(&book), expected);
        assert_eq!(fans(&[Some([(1, 10), (2, 11)])]), [Some([10, 11])]);
    }
}
