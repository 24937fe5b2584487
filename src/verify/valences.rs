//! How many triangles the vertices have: the histogram of the manifest.
//!
//! Why sums are enough: each chunk of triangles counts, for each vertex that it names, its
//! triangles that are not degenerate there; these have three different vertices, so corners
//! at a vertex are triangles at it. Sorted by vertex, the counts of all chunks add up to the
//! valence. Vertices that no count names have valence 0.
//!
//! Memory: the buffers of the merge, 1 KiB for the classes. I/O: 16 bytes for each vertex of
//! each chunk.

use super::sort::{Record, Sorter};
use crate::disk::Workspace;
use crate::error::Result;
use crate::folder::ValenceClass;
use bytemuck::{Pod, Zeroable};

/// A vertex, and how many triangles of a chunk have it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Seen {
    pub(super) vertex: u64,
    pub(super) times: u64,
}

impl Record for Seen {
    type Key = u64;
    #[inline]
    fn key(&self) -> u64 {
        self.vertex
    }
}

/// The histogram, recounted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Valences {
    pub(super) largest: u64,
    pub(super) classes: Vec<ValenceClass>,
}

/// Valences below this have a class each.
const EXACT: u64 = 64;
/// Classes of one valence, and one for each power of two from 2^6 to 2^63.
const CLASSES: usize = EXACT as usize + 58;

/// Number of the class of a valence.
fn class(valence: u64) -> usize {
    if valence < EXACT {
        valence as usize
    } else {
        EXACT as usize + (valence.ilog2() - EXACT.ilog2()) as usize
    }
}

/// Least and greatest valence of a class.
fn bounds(class: usize) -> (u64, u64) {
    match (class as u64).checked_sub(EXACT) {
        None => (class as u64, class as u64),
        Some(power) => {
            let from = EXACT << power;
            (from, from - 1 + from)
        }
    }
}

/// Counts the `vertices` vertices of the mesh by valence.
pub(super) fn run(
    ws: &Workspace,
    seen: Sorter<Seen>,
    vertices: u64,
    memory: u64,
) -> Result<Valences> {
    let mut merge = seen.merge(ws, memory)?;
    let mut classes = [0u64; CLASSES];
    let (mut named, mut largest) = (0, 0);
    let mut next = merge.next()?;
    while let Some(mut sum) = next {
        loop {
            next = merge.next()?;
            match next.filter(|more| more.vertex == sum.vertex) {
                Some(more) => sum.times += more.times,
                None => break,
            }
        }
        classes[class(sum.times)] += 1;
        largest = largest.max(sum.times);
        named += 1;
    }
    classes[0] += vertices.saturating_sub(named);
    let counted = classes.iter().enumerate().filter(|(_, n)| **n > 0);
    Ok(Valences {
        largest,
        classes: counted
            .map(|(i, &vertices)| {
                let (from, to) = bounds(i);
                ValenceClass { from, to, vertices }
            })
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_follow_each_other() {
        let mut after = 0;
        for number in 0..CLASSES {
            let (from, to) = bounds(number);
            assert_eq!((from, class(from), class(to)), (after, number, number));
            after = to.wrapping_add(1);
        }
        assert_eq!(after, 0);
        assert_eq!(bounds(64), (64, 127));
    }
}
