//! The cut border: the loops of edges between the triangles that are coded and those to come.
//!
//! ```text
//!          b ──────> c        an edge runs from its origin to the origin of the next;
//!        ^   \  n  /          the coded triangle lies at its apex,
//!     e /     \   /           what is to come on its other side
//!      /  apex \ /
//!     a ─ ─ ─ ─ o      prev: z -> a      e: a -> b      next: b -> c
//! ```
//!
//! Why a list is enough: a new triangle touches the loop at its gate and its two neighbours, or
//! at one more place when its tip is linked to; the same exchange of pointers then splits a loop
//! in two, or joins two loops into one (a handle).
//!
//! Memory: 32 bytes for each edge of the border at its longest.

use super::NONE;

/// An edge of the border.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Vertex where it starts, by its number in coded order.
    pub org: u32,
    /// The edge that starts where this one ends.
    pub next: u32,
    /// The edge that ends where this one starts.
    pub prev: u32,
    /// The third vertex of the coded triangle at this edge.
    pub apex: u32,
    /// The vertex behind that triangle: the apex that the gate had through which it was reached.
    pub far: u32,
    /// The corner of the coded triangle that faces this edge; the encoder's.
    pub corner: u32,
    /// Changes whenever the edge or its successor does; 0 when the edge is gone.
    pub stamp: u32,
    /// How far the border bends in at its end, as of when it was listed last; the walk's.
    pub gap: u8,
    /// False when nothing lies across: a border of the mesh, or of the chunk.
    pub open: bool,
    /// True when it is known that the triangle across is not the one across the next edge.
    pub not_right: bool,
    /// True when it is known that the triangle across is not the one across the edge before.
    pub not_left: bool,
}

/// All loops.
#[derive(Debug, Default)]
pub struct Border {
    edges: Vec<Edge>,
    free: Vec<u32>,
    stamps: u32,
}

impl std::ops::Index<u32> for Border {
    type Output = Edge;
    #[inline]
    fn index(&self, e: u32) -> &Edge {
        &self.edges[e as usize]
    }
}

impl std::ops::IndexMut<u32> for Border {
    #[inline]
    fn index_mut(&mut self, e: u32) -> &mut Edge {
        &mut self.edges[e as usize]
    }
}

impl Border {
    /// Forgets all edges.
    pub fn clear(&mut self) {
        self.edges.clear();
        self.free.clear();
        self.stamps = 0;
    }

    /// A new edge, outside of all loops.
    pub fn add(&mut self, org: u32, apex: u32, corner: u32) -> u32 {
        let edge = Edge {
            org,
            next: NONE,
            prev: NONE,
            apex,
            far: apex,
            corner,
            stamp: self.stamp(),
            gap: 0,
            open: true,
            not_right: false,
            not_left: false,
        };
        if let Some(e) = self.free.pop() {
            self[e] = edge;
            return e;
        }
        self.edges.push(edge);
        self.edges.len() as u32 - 1
    }

    /// Takes an edge out of use; its neighbours are the caller's to join.
    pub fn remove(&mut self, e: u32) {
        self[e].stamp = 0;
        self[e].open = false;
        self.free.push(e);
    }

    /// A stamp that no edge has had.
    pub fn stamp(&mut self) -> u32 {
        self.stamps += 1;
        self.stamps
    }

    /// Lets `second` follow `first`.
    #[inline]
    pub fn join(&mut self, first: u32, second: u32) {
        self[first].next = second;
        self[second].prev = first;
    }

    /// The vertex where an edge ends.
    #[inline]
    pub fn dest(&self, e: u32) -> u32 {
        self[self[e].next].org
    }

    /// Slots in use or free: the numbers of all edges lie below.
    pub fn slots(&self) -> u32 {
        self.edges.len() as u32
    }

    /// True when the edge with this number is in a loop.
    pub fn alive(&self, e: u32) -> bool {
        self.edges
            .get(e as usize)
            .is_some_and(|edge| edge.stamp != 0)
    }
}
