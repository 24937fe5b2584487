//! Positions as bits, when two are equal, and the records that the shuffles sort.
//!
//! Two positions are equal when their coordinates are, bit for bit, where -0 counts as +0. So
//! a NaN equals the NaN with the same bits and no other: equality is an equivalence, whatever
//! the input holds, and needs no arithmetic.
//!
//! Memory: none. I/O: none.

use crate::corner::Index;
use crate::input::{CoordKind, Endian};
use crate::shuffle::Record;
use bytemuck::{Pod, Zeroable};

/// Bits of a coordinate: `u32` of an f4, `u64` of an f8.
pub trait Bits: Pod + Copy + Eq + Send + Sync + std::fmt::Debug + 'static {
    /// The type of coordinate.
    const KIND: CoordKind;
    /// Words that hold a position.
    const WORDS: usize;
    /// From an f4; widening is exact.
    fn from_f4(bits: u32) -> Self;
    /// From an f8, to the nearest value; `None` when it is finite and that value is not.
    fn from_f8(bits: u64) -> Option<Self>;
    /// The bits that stand for the value: those of +0 for both zeros.
    fn value(self) -> Self;
    /// True when two coordinates are equal, the zeros too.
    fn equals(self, other: Self) -> bool;
    /// Word `i` of a position, for sorting; equal for equal positions only, taken together.
    fn word(at: [Self; 3], i: usize) -> u64;
}

impl Bits for u32 {
    const KIND: CoordKind = CoordKind::F4;
    const WORDS: usize = 2;
    #[inline]
    fn from_f4(bits: u32) -> u32 {
        bits
    }
    #[inline]
    fn from_f8(bits: u64) -> Option<u32> {
        let wide = f64::from_bits(bits);
        let near = wide as f32;
        (near.is_finite() || !wide.is_finite()).then(|| near.to_bits())
    }
    #[inline]
    fn value(self) -> u32 {
        if self << 1 == 0 { 0 } else { self }
    }
    #[inline]
    fn equals(self, other: u32) -> bool {
        (self == other) | ((self | other) << 1 == 0)
    }
    #[inline]
    fn word(at: [u32; 3], i: usize) -> u64 {
        let [x, y, z] = at.map(|c| u64::from(c.value()));
        if i == 0 { x << 32 | y } else { z }
    }
}

impl Bits for u64 {
    const KIND: CoordKind = CoordKind::F8;
    const WORDS: usize = 3;
    #[inline]
    fn from_f4(bits: u32) -> u64 {
        f64::from(f32::from_bits(bits)).to_bits()
    }
    #[inline]
    fn from_f8(bits: u64) -> Option<u64> {
        Some(bits)
    }
    #[inline]
    fn value(self) -> u64 {
        if self << 1 == 0 { 0 } else { self }
    }
    #[inline]
    fn equals(self, other: u64) -> bool {
        (self == other) | ((self | other) << 1 == 0)
    }
    #[inline]
    fn word(at: [u64; 3], i: usize) -> u64 {
        at[i].value()
    }
}

/// True when two positions are equal.
#[inline]
pub fn same<B: Bits>(a: [B; 3], b: [B; 3]) -> bool {
    a[0].equals(b[0]) & a[1].equals(b[1]) & a[2].equals(b[2])
}

/// Mixes two words; every bit of both reaches every bit of the result.
#[inline]
fn mix(a: u64, b: u64) -> u64 {
    let product = u128::from(a ^ 0x9e37_79b9_7f4a_7c15)
        * u128::from(b.rotate_left(32) ^ 0xd1b5_4a32_d192_ed03);
    (product >> 64) as u64 ^ product as u64
}

/// What the hash table of a block holds. Hashes shape no result, only the time it takes.
pub trait Key: Copy {
    /// Equal for equal keys.
    fn hash(self) -> u64;
    /// True when two keys are equal.
    fn same(self, other: Self) -> bool;
}

impl<B: Bits> Key for [B; 3] {
    #[inline]
    fn hash(self) -> u64 {
        let mut sum = mix(B::word(self, 0), B::word(self, 1));
        if B::WORDS > 2 {
            sum = mix(sum, B::word(self, 2));
        }
        mix(sum, sum)
    }
    #[inline]
    fn same(self, other: Self) -> bool {
        same(self, other)
    }
}

impl Key for u64 {
    #[inline]
    fn hash(self) -> u64 {
        mix(self, 0)
    }
    #[inline]
    fn same(self, other: u64) -> bool {
        self == other
    }
}

/// A row of G as bits, from a file in any type and order. `None`: beyond the type asked for.
#[inline]
pub fn position<B: Bits>(row: &[u8], kind: CoordKind, endian: Endian) -> Option<[B; 3]> {
    let mut at = [B::from_f4(0); 3];
    let width = kind.bytes() as usize;
    for (out, bytes) in at.iter_mut().zip(row.chunks_exact(width)) {
        *out = match kind {
            CoordKind::F4 => B::from_f4(unsigned(bytes, endian) as u32),
            CoordKind::F8 => B::from_f8(unsigned(bytes, endian))?,
        };
    }
    Some(at)
}

/// An unsigned integer of 4 or 8 bytes.
#[inline]
pub fn unsigned(bytes: &[u8], endian: Endian) -> u64 {
    let mut out = [0; 8];
    out[..bytes.len()].copy_from_slice(bytes);
    let value = u64::from_le_bytes(out);
    match endian {
        Endian::Little => value,
        Endian::Big => value.swap_bytes() >> (64 - 8 * bytes.len()),
    }
}

/// A position with the corner that uses it, its rank. In buckets by hash; sorted by hash, then
/// position, then rank.
#[repr(C, packed)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct Place<B, R> {
    /// The position as it was first used in its block.
    pub at: [B; 3],
    /// The corner of that use.
    pub rank: R,
}

/// One past the greatest key of level 0 of a [`Place`].
pub const HASHES: u64 = 1 << 63;

impl<B: Bits, R: Index> Record for Place<B, R> {
    const LEVELS: usize = B::WORDS + 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        let at = self.at;
        if level == 0 {
            Key::hash(at) >> 1
        } else if level <= B::WORDS {
            B::word(at, level - 1)
        } else {
            { self.rank }.wide()
        }
    }
}

/// A position with the corner of its first use, by which it is sorted.
#[repr(C, packed)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct First<B, R> {
    /// The position.
    pub at: [B; 3],
    /// The corner, which no other has.
    pub rank: R,
}

impl<B: Bits, R: Index> Record for First<B, R> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        { self.rank }.wide()
    }
}

/// A value sent to where its key is, by which alone it is sorted.
#[repr(C, packed)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct Pair<R> {
    /// Where to.
    pub key: R,
    /// What.
    pub value: R,
}

impl<R: Index> Record for Pair<R> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        { self.key }.wide()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_one_and_nans_many() {
        let at = |x: f32| [x.to_bits(), 1, 2];
        assert!(same(at(0.0), at(-0.0)));
        assert_eq!(at(0.0).hash(), at(-0.0).hash());
        let (quiet, other) = (f32::from_bits(0x7fc0_0000), f32::from_bits(0xffc0_0001));
        assert!(same(at(quiet), at(quiet)) && !same(at(quiet), at(other)));
        let wide = |x: f64| [1, 2, x.to_bits()];
        assert!(same(wide(0.0), wide(-0.0)) && !same(wide(1.0), wide(-1.0)));
        assert_eq!(wide(0.0).hash(), wide(-0.0).hash());
        assert_ne!(wide(1.0).hash(), wide(-1.0).hash());
    }

    #[test]
    fn rows_in_every_type_and_order() {
        let f8 = [1.5f64, -0.0, 1e300];
        let (mut little, mut big) = (Vec::new(), Vec::new());
        for c in f8 {
            little.extend(c.to_le_bytes());
            big.extend(c.to_be_bytes());
        }
        let bits = f8.map(f64::to_bits);
        assert_eq!(position(&little, CoordKind::F8, Endian::Little), Some(bits));
        assert_eq!(position(&big, CoordKind::F8, Endian::Big), Some(bits));
        assert_eq!(position::<u32>(&big, CoordKind::F8, Endian::Big), None);
        let row: Vec<u8> = [1.5f32, f32::INFINITY, 3.0]
            .into_iter()
            .flat_map(f32::to_be_bytes)
            .collect();
        let wide = [1.5, f64::INFINITY, 3.0].map(f64::to_bits);
        assert_eq!(position(&row, CoordKind::F4, Endian::Big), Some(wide));
        assert_eq!(u32::from_f8(f64::NEG_INFINITY.to_bits()), Some(0xff80_0000));
        assert_eq!(u32::from_f8(0.1f64.to_bits()), Some(0.1f32.to_bits()));
    }
}
