//! How records call local components, and their numbers.
//!
//! Why there are two ways: in file order a chunk numbers its local components by first triangles,
//! and the chunks before it are counted; on the path through cells they are called by their first
//! triangles and numbered when all are known. Numbers ascend with first triangles either way.
//!
//! Memory: none of its own. I/O: none.

use super::cells::names::Names;
use super::chunked::Chunked;
use super::records::EdgeCorner;
use crate::corner::Index;

/// The local components of a build.
#[derive(Clone, Copy)]
pub enum Nodes<'a> {
    /// Those of chunks of so many triangles.
    InOrder(&'a Chunked, u64),
    /// Those of cells.
    ByName(&'a Names),
}

impl Nodes<'_> {
    /// How many there are.
    pub fn count(&self) -> u64 {
        match self {
            Nodes::InOrder(chunked, _) => chunked.locals(),
            Nodes::ByName(names) => names.count(),
        }
    }

    /// The number of what a link or a border calls so.
    #[inline]
    pub fn number(&self, called: u64) -> u64 {
        match self {
            Nodes::InOrder(..) => called,
            Nodes::ByName(names) => names.number(called),
        }
    }

    /// The number of a corner's local component.
    #[inline]
    pub fn of_corner<W: Index>(&self, corner: &EdgeCorner<W>) -> u64 {
        self.of_triangle(corner.triangle(), corner.local())
    }

    /// The number of the local component of a triangle, which the triangle's chunk or cell calls
    /// so.
    #[inline]
    pub fn of_triangle(&self, t: u64, called: u64) -> u64 {
        match self {
            Nodes::InOrder(chunked, chunk) => chunked.base[(t / chunk) as usize] + called,
            Nodes::ByName(names) => names.number(called),
        }
    }
}
