//! The records that stars are made of. Widths as in [`records`](crate::build::records). Corners are
//! packed `4t + k`.

use crate::corner::Index;
use crate::shuffle::Record;
use bytemuck::{Pod, Zeroable};

/// A corner as records have it.
#[inline]
pub fn pack((t, k): (u64, usize)) -> u64 {
    t << 2 | k as u64
}

/// One end of a [`Part`]: the other vertex of an edge that is not decided, or `None`, and the
/// corner that faces it, or that names the chain of an edge without opposite.
pub type End<W> = (Option<W>, W);

/// A fan, or a part of one: vertex; of each end the other vertex or NONE, and the corner (NONE for
/// both of a ring); what its local component is called where it was found, with a triangle of
/// it; number of corners.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Part<W>([W; 8]);

impl<W: Index> Part<W> {
    /// Packs the fields. `ends` is `None` for a ring; `at` is (a triangle of it, what its local
    /// component is called there).
    pub fn new(vertex: u64, corners: u32, at: (u64, u64), ends: Option<[(u64, u64); 2]>) -> Self {
        // NONE is all ones at both widths.
        let [(a, c), (b, d)] = ends.unwrap_or([(u64::MAX, u64::MAX); 2]);
        let (t, called) = at;
        Part([vertex, a, c, b, d, t, called, u64::from(corners)].map(W::of))
    }

    /// The vertex.
    #[inline]
    pub fn vertex(&self) -> u64 {
        self.0[0].wide()
    }

    /// Its ends, unless it is a ring.
    #[inline]
    pub fn ends(&self) -> Option<[End<W>; 2]> {
        let [_, a, c, b, d, ..] = self.0;
        let to = |x: W| (x != W::NONE).then_some(x);
        (c != W::NONE).then(|| [(to(a), c), (to(b), d)])
    }

    /// (a triangle of it, what its local component is called there).
    #[inline]
    pub fn at(&self) -> (u64, u64) {
        (self.0[5].wide(), self.0[6].wide())
    }

    /// Number of corners.
    #[inline]
    pub fn corners(&self) -> u64 {
        self.0[7].wide()
    }
}

impl<W: Index> Record for Part<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.vertex()
    }
}

/// A fan of a vertex that has several: vertex, a triangle, what its local component is called
/// there.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Fan<W>(pub [W; 3]);

/// (vertex, local component) of a fan of a vertex that has several, or may have.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Shared<W>(pub [W; 2]);

/// An open fan: the corners that name the chains at its ends, and its local component.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Open<W>(pub [W; 3]);

/// A number that is sorted by, and one that goes along.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Keyed<W>(pub [W; 2]);

impl<W: Index> Record for Keyed<W> {
    const LEVELS: usize = 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// A triangle that may have twins: its vertices, ascending, and the triangle.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Candidate<W>([W; 4]);

impl<W: Index> Candidate<W> {
    /// Packs the fields; vertices in any order.
    pub fn new(mut v: [u64; 3], t: u64) -> Self {
        v.sort_unstable();
        Candidate([W::of(v[0]), W::of(v[1]), W::of(v[2]), W::of(t)])
    }

    /// Its vertices, ascending.
    #[inline]
    pub fn vertices(&self) -> [W; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// The triangle.
    #[inline]
    pub fn triangle(&self) -> W {
        self.0[3]
    }
}

impl<W: Index> Record for Candidate<W> {
    const LEVELS: usize = 4;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// A triangle with the same vertices as an earlier one.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Twin<W>(pub [W; 1]);

impl<W: Index> Record for Twin<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_back_at_both_widths() {
        fn check<W: Index>(t: u64) {
            let corner = pack((t, 2));
            let ends = [(W::NONE.wide(), corner), (7, corner - 1)];
            let part = Part::<W>::new(9, 5, (t, t), Some(ends));
            assert_eq!((part.vertex(), part.corners(), part.at()), (9, 5, (t, t)));
            let found = part.ends().expect("ends");
            assert_eq!(found[0], (None, W::of(corner)));
            assert_eq!(found[1], (Some(W::of(7)), W::of(corner - 1)));
            assert!(Part::<W>::new(9, 5, (t, t), None).ends().is_none());
            let candidate = Candidate::<W>::new([5, 9, 2], t);
            assert_eq!(candidate.vertices().map(W::wide), [2, 5, 9]);
        }
        check::<u32>((1 << 29) - 1);
        check::<u64>(1 << 40);
    }
}
