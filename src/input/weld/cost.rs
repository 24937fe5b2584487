//! What a weld will take, from its sizes alone: the files that [`super`] names, one by one.
//!
//! Why two answers: only keys that are distinct in their block go through the sorts. In a
//! coherent mesh they are the vertices and, at every border of a block, a strip of them again;
//! in the worst order no block ever sees a vertex twice.
//!
//! Memory: none. I/O: none.

use super::bits::{Pair, Place};
use super::front::MOST_KEYS;
use crate::input::CoordKind;
use crate::shuffle::tail;

/// The sizes of a weld.
#[derive(Clone, Copy, Debug)]
pub struct WeldSize {
    /// T.
    pub triangles: u64,
    /// Vertices that will be left.
    pub vertices: u64,
    /// Type of their coordinates.
    pub coords: CoordKind,
    /// The memory budget in bytes.
    pub memory: u64,
    /// True when indices are 8 bytes.
    pub wide: bool,
    /// Bytes of V and of G that the weld reads back, for an indexed mesh.
    pub indexed: Option<[u64; 2]>,
    /// True when these two lie in scratch files.
    pub decoded: bool,
    /// True for the worst order, false for a coherent mesh.
    pub worst: bool,
}

/// What a weld takes, in bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct WeldCost {
    /// The most scratch space at once, V as it leaves the weld with it.
    pub scratch: u64,
    /// Bytes read.
    pub read: u64,
    /// Bytes written, the new V and G with them.
    pub written: u64,
}

impl WeldSize {
    /// Predicts the cost.
    pub fn cost(&self) -> WeldCost {
        let corners = self.triangles.saturating_mul(3);
        let place = match self.coords {
            CoordKind::F4 => size_of::<Place<u32>>(),
            CoordKind::F8 => size_of::<Place<u64>>(),
        } as u64;
        let vertices = self.vertices.min(corners);
        let blocks = vertices.div_ceil(self.keys()).max(1);
        let strip = 2 * vertices.isqrt();
        let distinct = if self.worst {
            corners
        } else {
            (vertices + blocks * strip).min(corners)
        };
        let locals = 4 * corners + 16 * blocks.max(distinct / self.keys());
        let places = distinct * place;
        let firsts = vertices * place;
        let others = (distinct - vertices) * size_of::<Pair>() as u64;
        let ranks = if others > 0 { 8 * vertices } else { 0 };
        let rest = |bytes| tail(bytes, 1, self.memory / 8);
        let group = locals + places.max(firsts + others) + rest(places);
        let resolve = locals + ranks + others + rest(others);
        let wide = if self.wide { 8 * corners } else { 0 };
        let numbers = locals + others + wide;
        let [v, g] = self.indexed.unwrap_or_default();
        let apart = match self.indexed {
            Some(_) if self.worst => distinct * size_of::<Pair>() as u64,
            _ => 0,
        };
        let [old_v, old_g] = if self.decoded { [v, g] } else { [0, 0] };
        let front = old_v + old_g + locals + apart.max(places);
        let fetch = old_g + locals + apart.max(places) + rest(apart);
        WeldCost {
            scratch: [front, fetch, group, resolve, numbers]
                .into_iter()
                .fold(0, u64::max),
            read: v + g + 2 * apart + places + firsts + 2 * others + ranks + 4 * corners,
            written: locals
                + apart
                + places
                + firsts
                + 2 * others
                + ranks
                + wide.max(4 * corners)
                + vertices * 3 * self.coords.bytes(),
        }
    }

    /// Distinct keys of a block.
    fn keys(&self) -> u64 {
        let each = 3 * self.coords.bytes() + 8;
        1 << (self.memory / 8 / each).clamp(16, MOST_KEYS).ilog2()
    }
}
