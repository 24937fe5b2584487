//! The records that passes hand to each other through scratch files. Widths: ids are written
//! as `W`, u32 while [`narrow`] says that every packed field fits, else u64.

use crate::chunk::measure::Measure;
use crate::corner::Index;
use crate::shuffle::Record;
use bytemuck::{Pod, Zeroable};

/// True when the packed fields of all records fit 32 bits: a triangle with three bits beside it,
/// and a vertex below NONE.
pub fn narrow(triangles: u64, vertices: u64) -> bool {
    triangles < 1 << 29 && vertices < u64::from(u32::MAX)
}

/// A corner on an edge that its chunk could not settle, or (in `cuts`) on a non-manifold edge.
///
/// Fields: smaller vertex; larger vertex; `8t + 2k + r` where k is the corner's place as the
/// input has it and r is 1 when the swirl flipped t within its chunk; `2 * component + d` where
/// the component is chunk-local and d is 1 when the edge runs from the larger vertex to the
/// smaller after that flip.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct EdgeCorner<W>([W; 4]);

impl<W: Index> EdgeCorner<W> {
    /// Packs the fields.
    #[inline]
    pub fn new(ends: (u64, u64), t: u64, k: u64, flipped: bool, local: u64, down: bool) -> Self {
        EdgeCorner([
            W::of(ends.0),
            W::of(ends.1),
            W::of(t << 3 | k << 1 | u64::from(flipped)),
            W::of(local << 1 | u64::from(down)),
        ])
    }

    /// The fields of the edge, and those of the corner.
    #[inline]
    pub fn halves(&self) -> ([W; 2], [W; 2]) {
        let [lo, hi, corner, called] = self.0;
        ([lo, hi], [corner, called])
    }

    /// The same put together again.
    #[inline]
    pub fn of_halves([lo, hi]: [W; 2], [corner, called]: [W; 2]) -> Self {
        EdgeCorner([lo, hi, corner, called])
    }

    /// The edge: (smaller, larger) vertex.
    #[inline]
    pub fn edge(&self) -> (u64, u64) {
        (self.0[0].wide(), self.0[1].wide())
    }

    /// The triangle.
    #[inline]
    pub fn triangle(&self) -> u64 {
        self.0[2].wide() >> 3
    }

    /// (triangle, place).
    #[inline]
    pub fn corner(&self) -> (u64, usize) {
        (self.triangle(), self.place() as usize)
    }

    /// The corner's place in it, as the input has it.
    #[inline]
    pub fn place(&self) -> u64 {
        self.0[2].wide() >> 1 & 3
    }

    /// True when the swirl flipped the triangle within its chunk.
    #[inline]
    pub fn flipped(&self) -> bool {
        self.0[2].wide() & 1 == 1
    }

    /// The chunk-local component.
    #[inline]
    pub fn local(&self) -> u64 {
        self.0[3].wide() >> 1
    }

    /// Direction of the edge after the chunk's flip.
    #[inline]
    pub fn down(&self) -> bool {
        self.0[3].wide() & 1 == 1
    }

    /// Direction of the edge as the input had it.
    #[inline]
    pub fn input_down(&self) -> bool {
        self.down() ^ self.flipped()
    }
}

impl<W: Index> Record for EdgeCorner<W> {
    const LEVELS: usize = 3;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// An opposite found at the seams, to be filled into O: `4t + k`, and `8t' + 2k' + p` for its
/// opposite, places as the input has them; p is 1 when the two triangles disagreed there.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Patch<W>([W; 2]);

impl<W: Index> Patch<W> {
    /// The opposite of the corner (triangle, place) `at` is `to`.
    #[inline]
    pub fn new(at: (u64, usize), to: (u64, usize), parity: bool) -> Self {
        Patch([
            W::of(at.0 << 2 | at.1 as u64),
            W::of(to.0 << 3 | (to.1 as u64) << 1 | u64::from(parity)),
        ])
    }

    /// (triangle, place) of the corner to fill in.
    #[inline]
    pub fn at(&self) -> (u64, usize) {
        let word = self.0[0].wide();
        (word >> 2, (word & 3) as usize)
    }

    /// (triangle, place) of its opposite.
    #[inline]
    pub fn to(&self) -> (u64, usize) {
        let word = self.0[1].wide();
        (word >> 3, (word >> 1 & 3) as usize)
    }

    /// The opposite as it is packed: `8t' + 2k' + p`.
    #[inline]
    pub fn opposite(&self) -> W {
        self.0[1]
    }

    /// True when the two triangles disagreed in the input.
    #[inline]
    pub fn parity(&self) -> bool {
        self.0[1].wide() & 1 == 1
    }
}

impl<W: Index> Record for Patch<W> {
    /// The triangle, so that a triangle's patches share a bucket; then the corner's place.
    const LEVELS: usize = 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        let (triangle, place) = self.at();
        if level == 0 { triangle } else { place as u64 }
    }
}

/// Two local components (numbered through the whole mesh) joined by a regular edge; parity is
/// true when one must be flipped to agree with the other.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Link<W>([W; 2]);

impl<W: Index> Link<W> {
    /// Packs the fields.
    #[inline]
    pub fn new(a: u64, b: u64, parity: bool) -> Self {
        Link([W::of(a << 1 | u64::from(parity)), W::of(b)])
    }

    /// (a, b, parity).
    #[inline]
    pub fn get(&self) -> (u64, u64, bool) {
        let word = self.0[0].wide();
        (word >> 1, self.0[1].wide(), word & 1 == 1)
    }
}

/// What a chunk knows of one of its local components, in the order of their first triangles.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct LocalCount {
    /// First triangle, local to the chunk.
    pub first: u32,
    /// Triangles.
    pub triangles: u32,
    /// Triangles that differ in orientation from the first.
    pub flipped: u32,
    /// Settled border edges, and in the top bit a parity conflict.
    pub borders: u32,
    /// Fans that are rings.
    pub rings: u32,
    /// Loops of corners without opposite.
    pub loops: u32,
}

impl LocalCount {
    /// The bit of `borders` that tells a conflict.
    pub const CONFLICT: u32 = 1 << 31;

    /// True when it tells no more than that there is a triangle.
    pub fn is_bare(&self) -> bool {
        let LocalCount {
            triangles,
            borders,
            rings,
            loops,
            ..
        } = self;
        (*triangles, borders & !Self::CONFLICT, rings + loops) == (1, 0, 0)
    }
}

/// A [`Measure`] as plain words.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct MeasureRecord([u64; 13]);

impl MeasureRecord {
    /// Packs a measure.
    pub fn new(m: &Measure) -> Self {
        let ([a, b], [c, d], [e, f]) = (split(m.six_oriented), split(m.six_input), split(m.area));
        let [x, y, z] = m.min.map(f64::to_bits);
        let [u, v, w] = m.max.map(f64::to_bits);
        MeasureRecord([a, b, c, d, e, f, x, y, z, u, v, w, u64::from(m.nonfinite)])
    }

    /// The measure back.
    pub fn get(&self) -> Measure {
        let w = &self.0;
        Measure {
            six_oriented: join([w[0], w[1]]),
            six_input: join([w[2], w[3]]),
            area: join([w[4], w[5]]),
            min: [w[6], w[7], w[8]].map(f64::from_bits),
            max: [w[9], w[10], w[11]].map(f64::from_bits),
            nonfinite: w[12] != 0,
        }
    }
}

/// A wide sum as two words: i128 would bring padding and an alignment of 16.
fn split(x: i128) -> [u64; 2] {
    [x as u64, (x >> 64) as u64]
}

fn join(w: [u64; 2]) -> i128 {
    i128::from(w[0]) | (w[1] as i128) << 64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_back_at_both_widths() {
        fn check<W: Index>(t: u64) {
            let a = EdgeCorner::<W>::new((3, 9), t, 2, true, t, true);
            assert_eq!(a.edge(), (3, 9));
            assert_eq!((a.triangle(), a.place(), a.local()), (t, 2, t));
            assert_eq!((a.flipped(), a.down(), a.input_down()), (true, true, false));
            let b = EdgeCorner::<W>::new((3, 9), 1, 0, false, 0, false);
            let patch = Patch::<W>::new(b.corner(), a.corner(), true);
            assert_eq!(
                (patch.at(), patch.to(), patch.parity()),
                ((1, 0), (t, 2), true)
            );
            assert_eq!(Link::<W>::new(t, 7, true).get(), (t, 7, true));
        }
        check::<u32>((1 << 29) - 1);
        check::<u64>(1 << 40);
        for x in [0, -1, 1 << 90, -(1 << 100)] {
            assert_eq!(join(split(x)), x);
        }
    }
}
