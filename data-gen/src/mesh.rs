//! What a kind of mesh must be able to say.

use crate::truth::Truth;

/// The triangle on the other side of a regular edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// The neighbour.
    pub triangle: u64,
    /// The two run along the edge in the same direction, so their orientations disagree.
    pub reversed: bool,
}

impl Link {
    /// A neighbour that agrees in orientation.
    pub fn to(triangle: u64) -> Option<Link> {
        Some(Link {
            triangle,
            reversed: false,
        })
    }
}

/// A mesh given by closed forms. Every method may be called in any order, from any thread, and costs
/// O(1): none allocates or looks at another triangle.
pub trait Mesh: Send + Sync {
    /// The exact counts, before any flip.
    fn truth(&self) -> Truth;

    /// The vertices of triangle `t < truth().triangles`; closed kinds: counterclockwise from outside.
    fn triangle(&self, t: u64) -> [u64; 3];

    /// Where vertex `v < truth().vertices` lies.
    fn position(&self, v: u64) -> [f64; 3];

    /// For each corner of `t` the triangle across the edge that the corner faces; `None` where that
    /// edge is not regular.
    fn neighbours(&self, t: u64) -> [Option<Link>; 3];

    /// The component of `t`, numbered in any fixed way.
    fn component(&self, _t: u64) -> u64 {
        0
    }

    /// The `i`-th triangle in an order that runs across the usual one (a bijection).
    fn across(&self, i: u64) -> u64 {
        i
    }

    /// Whether the mesh has triangles in the midst of a surface, where [`Defects`](crate::defects::Defects) can cut.
    fn can_be_cut(&self) -> bool {
        true
    }

    /// Whether all positions stay distinct when rounded to f4, so that welding restores the mesh.
    fn survives_welding(&self) -> bool;
}
