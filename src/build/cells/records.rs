//! The records of the path through cells. Widths as in [`records`](crate::build::records): `W` is
//! u32 while [`narrow`](crate::build::records::narrow) says that every packed field fits.

use super::super::records::MeasureRecord;
use crate::corner::{Index, next_k, prev_k};
use crate::shuffle::Record;
use bytemuck::{Pod, Zeroable};

/// A triangle dealt to a cell: its vertices as the input has them, and `4t + a`. When a is 0 the
/// edges at all its corners are settled in the cell; else the edge that corner a - 1 faces is
/// settled in another.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Dealt<W>([W; 4]);

impl<W: Index> Dealt<W> {
    /// Packs the fields; `aside` is 0, or 1 + the corner whose edge is settled elsewhere.
    #[inline]
    pub fn new(v: [W; 3], t: u64, aside: u8) -> Self {
        Dealt([v[0], v[1], v[2], W::of(t << 2 | u64::from(aside))])
    }

    /// Its vertices.
    #[inline]
    pub fn v(&self) -> [W; 3] {
        [self.0[0], self.0[1], self.0[2]]
    }

    /// The triangle.
    #[inline]
    pub fn t(&self) -> u64 {
        self.0[3].wide() >> 2
    }

    /// 0, or 1 + the corner whose edge is settled elsewhere.
    #[inline]
    pub fn aside(&self) -> u8 {
        self.0[3].wide() as u8 & 3
    }

    /// The edge that corner k faces: (from, to).
    #[inline]
    pub fn edge(&self, k: usize) -> (u64, u64) {
        (self.0[next_k(k)].wide(), self.0[prev_k(k)].wide())
    }
}

impl<W: Index> Record for Dealt<W> {
    const LEVELS: usize = 1;
    /// Cells are taken whole, so the order within one does not matter.
    fn key(&self, _: usize) -> u64 {
        self.t()
    }
}

/// An edge dealt to a cell without its triangle, which lies in another: from, to, `4t + k` of the
/// corner that faces it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Lone<W>([W; 3]);

impl<W: Index> Lone<W> {
    /// The edge that corner k of triangle t faces.
    #[inline]
    pub fn new((from, to): (u64, u64), t: u64, k: usize) -> Self {
        Lone([W::of(from), W::of(to), W::of(t << 2 | k as u64)])
    }

    /// (from, to), as the triangle runs it in the input.
    #[inline]
    pub fn edge(&self) -> (u64, u64) {
        (self.0[0].wide(), self.0[1].wide())
    }

    /// The same as stored.
    #[inline]
    pub fn ends(&self) -> [W; 2] {
        [self.0[0], self.0[1]]
    }

    /// (triangle, place) of the corner that faces it.
    #[inline]
    pub fn corner(&self) -> (u64, usize) {
        let word = self.0[2].wide();
        (word >> 2, (word & 3) as usize)
    }
}

impl<W: Index> Record for Lone<W> {
    const LEVELS: usize = 1;
    /// Cells are taken whole, so the order within one does not matter.
    fn key(&self, _: usize) -> u64 {
        self.corner().0
    }
}

/// A triangle and what it is called by: its local component is named by a triangle, and it is
/// flipped, or not, against that one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Called {
    /// The triangle that names the local component: its first.
    pub name: u64,
    /// True when the two disagree in orientation.
    pub flip: bool,
}

impl Called {
    /// A triangle that is called by itself.
    #[inline]
    pub fn itself(t: u64) -> Called {
        Called {
            name: t,
            flip: false,
        }
    }

    #[inline]
    fn word<W: Index>(self) -> W {
        W::of(self.name << 1 | u64::from(self.flip))
    }

    #[inline]
    fn from<W: Index>(word: W) -> Called {
        let word = word.wide();
        Called {
            name: word >> 1,
            flip: word & 1 == 1,
        }
    }
}

/// The answer of a cell to a triangle: t, what its three corners have for opposites
/// (`8t' + 2k' + p` with the places as the input has them and p the edge's parity; or NONE), and
/// what it is called by.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Reply<W>([W; 5]);

/// An opposite as records have it: `8t + 2k + p`.
#[inline]
pub fn opposite<W: Index>((t, k): (u64, usize), parity: bool) -> W {
    W::of(t << 3 | (k as u64) << 1 | u64::from(parity))
}

impl<W: Index> Reply<W> {
    /// Packs the fields.
    #[inline]
    pub fn new(t: u64, opposites: [W; 3], called: Called) -> Self {
        let [a, b, c] = opposites;
        Reply([W::of(t), a, b, c, called.word()])
    }

    /// The triangle.
    #[inline]
    pub fn t(&self) -> u64 {
        self.0[0].wide()
    }

    /// Opposites by corner, as [`opposite`] packs them.
    #[inline]
    pub fn opposites(&self) -> [W; 3] {
        [self.0[1], self.0[2], self.0[3]]
    }

    /// What it is called by.
    #[inline]
    pub fn called(&self) -> Called {
        Called::from(self.0[4])
    }
}

impl<W: Index> Record for Reply<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.t()
    }
}

/// A triangle that its cell could not measure: vertices, t, and what it is called by.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Unmeasured<W>([W; 5]);

impl<W: Index> Unmeasured<W> {
    /// Packs the fields.
    #[inline]
    pub fn new(triangle: &Dealt<W>, called: Called) -> Self {
        let [a, b, c] = triangle.v();
        Unmeasured([a, b, c, W::of(triangle.t()), called.word()])
    }

    /// Its vertices.
    #[inline]
    pub fn v(&self) -> [u64; 3] {
        [self.0[0].wide(), self.0[1].wide(), self.0[2].wide()]
    }

    /// The triangle.
    #[inline]
    pub fn t(&self) -> u64 {
        self.0[3].wide()
    }

    /// What it is called by.
    #[inline]
    pub fn called(&self) -> Called {
        Called::from(self.0[4])
    }
}

/// What a cell counted of one of its local components.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct NodeCount {
    /// The first triangle, which names it.
    pub name: u64,
    /// Triangles.
    pub triangles: u32,
    /// Triangles that differ in orientation from the first.
    pub flipped: u32,
    /// Border edges.
    pub borders: u32,
    /// 1 when its edges contradict each other in parity.
    pub conflict: u32,
    /// Fans that are rings.
    pub rings: u32,
    /// Loops of corners without opposite.
    pub loops: u32,
}

/// What a cell measured of one of its local components, oriented like its first triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct NodeMeasure {
    /// The first triangle, which names it.
    pub name: u64,
    /// The measure.
    pub measure: MeasureRecord,
}

/// A vertex's position on its way to its cell: v, and the bits of x, y, z.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Spot<S>(pub [S; 4]);

impl<S: Index> Record for Spot<S> {
    const LEVELS: usize = 1;
    /// Cells are taken whole, so the order within one does not matter.
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
            let dealt = Dealt::<W>::new([7, 8, 9].map(W::of), t, 3);
            assert_eq!((dealt.t(), dealt.aside()), (t, 3));
            assert_eq!([0, 1, 2].map(|k| dealt.edge(k)), [(8, 9), (9, 7), (7, 8)]);
            let lone = Lone::<W>::new((9, 3), t, 2);
            assert_eq!((lone.edge(), lone.corner()), ((9, 3), (t, 2)));
            let called = Called {
                name: t,
                flip: true,
            };
            let none = W::NONE;
            let reply = Reply::<W>::new(t, [opposite((t, 2), true), none, none], called);
            assert_eq!((reply.t(), reply.called()), (t, called));
            assert_eq!(reply.opposites()[0].wide(), t << 3 | 5);
            assert_eq!(reply.opposites()[1], none);
            let unmeasured = Unmeasured::new(&dealt, called);
            assert_eq!((unmeasured.v(), unmeasured.t()), ([7, 8, 9], t));
            assert_eq!(unmeasured.called(), called);
        }
        check::<u32>((1 << 29) - 1);
        check::<u64>(1 << 40);
    }
}
