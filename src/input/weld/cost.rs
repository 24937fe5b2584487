//! What a weld will take, from its sizes alone: the files that [`super`] names, one by one.
//!
//! Why two answers: only keys that are distinct in their block go through the sorts. In a
//! coherent mesh they are the vertices and, at every border of a block, a strip of them again;
//! in the worst order no block ever sees a vertex twice.
//!
//! Memory: none. I/O: none.

use super::bits::{Pair, Place};
use super::cut::Cut;
use super::firsts::Held;
use super::{Tuning, narrow};
use crate::input::CoordKind;
use crate::shuffle::tail;

/// Threads that empty a shuffle at once, for what it still holds then.
const READERS: u64 = 2;
/// One of so many bytes that a shuffle held is not free again as soon as it was read: it lies on
/// a page that two buckets share.
const SHARED: u64 = 16;

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
        let [place, pair] = self.records();
        let vertices = self.vertices.min(corners);
        let distinct = self.distinct(corners, vertices);
        let backs = if self.worst { 0 } else { 4 * corners };
        // A block in which little repeats leaves none; but a few that try it may see repeats.
        let most_backs = 4 * corners;
        let places = distinct * place;
        let firsts = vertices * place;
        let others = (distinct - vertices) * pair;
        let rest = |bytes| tail(bytes, READERS, self.memory / 8) + bytes / SHARED;
        let counts = Held::bytes(corners);
        // Ids are sent once more, and bits and counts filed, when these do not fit.
        let [filed, resolved] = if counts <= self.memory / 4 {
            [0, 0]
        } else {
            [counts, others]
        };
        let ids = if self.wide { 8 * corners } else { 4 * corners };
        let [v, g] = self.indexed.unwrap_or_default();
        let apart = match self.indexed {
            Some(_) if self.worst => distinct * size_of::<Pair<u64>>() as u64,
            _ => 0,
        };
        let [old_v, old_g] = if self.decoded { [v, g] } else { [0, 0] };
        let front = old_v + old_g + most_backs + apart.max(places);
        let fetch = old_g + most_backs + apart.max(places) + rest(apart);
        let group = most_backs + places.max(firsts + others) + rest(places);
        let first = most_backs + filed + firsts + others;
        let resolve = most_backs + filed + resolved + rest(resolved);
        // Narrow ids take the place of the ways back.
        let held = if self.wide { most_backs } else { 0 };
        let last = filed + held + ids.max(most_backs + others) + rest(others);
        WeldCost {
            scratch: [front, fetch, group, first, resolve, last]
                .into_iter()
                .fold(0, u64::max),
            read: v + g + 2 * apart + places + firsts + others + resolved + backs + 2 * filed,
            written: backs
                + apart
                + places
                + firsts
                + others
                + resolved
                + filed
                + ids
                + vertices * 3 * self.coords.bytes(),
        }
    }

    /// Bytes of a position with its rank, and of a pair of ranks.
    fn records(&self) -> [u64; 2] {
        let sizes = match (self.coords, narrow(Some(self.triangles), Tuning::default())) {
            (CoordKind::F4, true) => [size_of::<Place<u32, u32>>(), size_of::<Pair<u32>>()],
            (CoordKind::F4, false) => [size_of::<Place<u32, u64>>(), size_of::<Pair<u64>>()],
            (CoordKind::F8, true) => [size_of::<Place<u64, u32>>(), size_of::<Pair<u32>>()],
            (CoordKind::F8, false) => [size_of::<Place<u64, u64>>(), size_of::<Pair<u64>>()],
        };
        sizes.map(|bytes| bytes as u64)
    }

    /// Keys that are distinct in their blocks.
    fn distinct(&self, corners: u64, vertices: u64) -> u64 {
        if self.worst {
            return corners;
        }
        let cut = Cut::new(self.memory, 1, corners, Tuning::default());
        let blocks = cut.windows(corners).max(1);
        // The border of a block has two sides, each about as long as a row of the surface.
        let strip = 2 * vertices.isqrt();
        (vertices + blocks * strip).min(corners)
    }
}
