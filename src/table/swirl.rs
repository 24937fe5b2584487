//! The triangles of a component, in swirl order.
//!
//! The recursive swirl marks a triangle, then swirls into its right and its left neighbour.
//! With the left neighbours on a stack of our own the order is the same, and the depth of a
//! component (it can be all of it) costs 8 bytes a level on the heap instead of a frame.
//!
//! Why it visits each triangle once: a triangle is marked when it is given out, and one that
//! is marked is passed over. It visits all: whatever lies across an edge of a marked triangle
//! was on the stack once.
//!
//! Memory: [`Swirl`] says. I/O: the pages of O of the component.

use super::CornerTable;
use crate::corner::{Corner, Triangle};
use std::collections::HashMap;

/// Iterator over the triangles that opposites join to a corner's triangle: its component.
///
/// From [`CornerTable::swirl`]. First the triangle of the corner c; then, always before all
/// that waits, what lies to the right (`c.r`) and after that what lies to the left (`c.l`),
/// each entered through the corner that faces the edge crossed; last what lies across `c.o`.
/// It is the order of the recursive procedure *swirl*. In a triangle that disagrees in
/// orientation with the one before, right and left are its own.
///
/// Memory, for a component of t triangles whose ids are close: about t/7 bytes of visited
/// bits (allocated in pieces of 512 bytes for 4096 triangle ids, so up to 550 bytes a triangle
/// when the ids lie far apart, and never more than T/7 bytes in all), and the stack: 8 bytes a
/// level, at most 8 (t + 2). Nothing of the size of the mesh is touched, so that swirling over
/// each of many small components is linear in all. It draws on no budget.
///
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # by_hand::tetrahedron().write(&folder);
/// let table = cornermill::CornerTable::open(&folder)?; // a tetrahedron
/// let c = table.corner(0).expect("the table has a corner");
/// let order: Vec<_> = table.swirl(c).collect();
/// assert_eq!(order[0], table.t(c));
/// assert_eq!(order[1], table.t(table.r(c).unwrap()));
/// assert_eq!(order.len(), 4);
/// # Ok::<(), cornermill::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Swirl<'a> {
    table: &'a CornerTable,
    stack: Vec<Corner>,
    visited: Visited,
}

impl<'a> Swirl<'a> {
    pub(super) fn new(table: &'a CornerTable, c: Corner) -> Swirl<'a> {
        // What lies across c.o waits until all else is done.
        let mut stack: Vec<Corner> = table.o(c).into_iter().collect();
        stack.push(c);
        Swirl {
            table,
            stack,
            visited: Visited::default(),
        }
    }
}

impl Iterator for Swirl<'_> {
    type Item = Triangle;

    fn next(&mut self) -> Option<Triangle> {
        while let Some(c) = self.stack.pop() {
            let t = c.t();
            if !self.visited.insert(t) {
                continue;
            }
            // Left first: what is pushed last is visited first.
            for side in [self.table.l(c), self.table.r(c)].into_iter().flatten() {
                if !self.visited.has(side.t()) {
                    self.stack.push(side);
                }
            }
            return Some(t);
        }
        None
    }
}

impl std::iter::FusedIterator for Swirl<'_> {}

/// Triangles under one piece of the visited bits.
const PIECE: u64 = 4096;

/// A set of triangles: pieces of a bit array, made when first touched. The map is only ever
/// asked, never walked, so its order shows nowhere.
#[derive(Clone, Debug, Default)]
struct Visited(HashMap<u64, Box<[u64; PIECE as usize / 64]>>);

impl Visited {
    fn place(t: Triangle) -> (u64, usize, u64) {
        let t = t.id();
        (t / PIECE, (t % PIECE / 64) as usize, 1 << (t % 64))
    }

    fn has(&self, t: Triangle) -> bool {
        let (piece, word, bit) = Visited::place(t);
        self.0.get(&piece).is_some_and(|bits| bits[word] & bit != 0)
    }

    /// False when it was in already.
    fn insert(&mut self, t: Triangle) -> bool {
        let (piece, word, bit) = Visited::place(t);
        let bits = self
            .0
            .entry(piece)
            .or_insert_with(|| Box::new([0; PIECE as usize / 64]));
        let fresh = bits[word] & bit == 0;
        bits[word] |= bit;
        fresh
    }
}
