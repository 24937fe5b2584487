//! The record that every corner of a triangle leaves with the edge that it faces.
//!
//! Sorted by (lo, hi, corner), the records of an edge lie together, smallest corner first, and
//! hold all that the checks of the edge need: no check looks anything up.
//!
//! The triangle's third vertex comes along when it is the largest: so the two smallest vertices
//! and the third name a triangle's set of vertices once among its three records.
//!
//! Memory: 24 bytes with ids of 4 bytes and fewer than 2^30 vertices, else 48. I/O: none.

use super::sort::Record;
use bytemuck::{Pod, Zeroable};

/// A corner and the edge that it faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Facing {
    pub(super) lo: u64,
    pub(super) hi: u64,
    pub(super) corner: u64,
    /// O of the corner; all ones for NONE.
    pub(super) opposite: u64,
    /// Label of its triangle; all ones when that is NONE or out of range.
    pub(super) label: u64,
    /// V of the corner when that is above hi (and a vertex); else all ones.
    pub(super) apex: u64,
    /// True when V[n(corner)] is lo.
    pub(super) upward: bool,
    /// True when the triangle is flipped.
    pub(super) flipped: bool,
}

impl Facing {
    /// The triangle's corners at lo and at hi.
    #[inline]
    pub(super) fn ends(&self) -> (u64, u64) {
        let (first, k) = (self.corner / 3 * 3, self.corner % 3);
        let (next, prev) = (first + (k + 1) % 3, first + (k + 2) % 3);
        if self.upward {
            (next, prev)
        } else {
            (prev, next)
        }
    }
}

/// A [`Facing`] as it is sorted.
pub(super) trait EdgeRecord: Record {
    /// Packs.
    fn pack(facing: &Facing) -> Self;
    /// Unpacks.
    fn unpack(&self) -> Facing;
}

/// With ids of 4 bytes, of fewer than [`Narrow::VERTICES`] vertices.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Narrow {
    lo: u32,
    hi: u32,
    corner: u32,
    opposite: u32,
    label: u32,
    /// The apex, shifted left by two, and the two bits.
    apex: u32,
}

/// The apex field of [`Narrow`] when there is none.
const NO_APEX: u32 = u32::MAX >> 2;

impl Narrow {
    /// The most vertices: one fewer than there are values of the apex field.
    pub(super) const VERTICES: u64 = NO_APEX as u64;
}

/// With ids of 8 bytes.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Wide {
    lo: u64,
    hi: u64,
    corner: u64,
    opposite: u64,
    /// Label, shifted left by two, and the two bits.
    label: u64,
    apex: u64,
}

fn bits(facing: &Facing) -> u32 {
    u32::from(facing.upward) | u32::from(facing.flipped) << 1
}

/// All ones stay all ones, whatever the width.
fn widen(id: u32) -> u64 {
    if id == u32::MAX {
        u64::MAX
    } else {
        u64::from(id)
    }
}

impl Record for Narrow {
    type Key = (u64, u32);
    #[inline]
    fn key(&self) -> (u64, u32) {
        (u64::from(self.lo) << 32 | u64::from(self.hi), self.corner)
    }
}

impl EdgeRecord for Narrow {
    fn pack(facing: &Facing) -> Narrow {
        // Every id came from 4 bytes, so cutting to 4 bytes loses nothing, NONE included.
        Narrow {
            lo: facing.lo as u32,
            hi: facing.hi as u32,
            corner: facing.corner as u32,
            opposite: facing.opposite as u32,
            label: facing.label as u32,
            apex: (facing.apex as u32) << 2 | bits(facing),
        }
    }

    fn unpack(&self) -> Facing {
        let apex = self.apex >> 2;
        Facing {
            lo: widen(self.lo),
            hi: widen(self.hi),
            corner: u64::from(self.corner),
            opposite: widen(self.opposite),
            label: widen(self.label),
            apex: if apex == NO_APEX {
                u64::MAX
            } else {
                u64::from(apex)
            },
            upward: self.apex & 1 != 0,
            flipped: self.apex & 2 != 0,
        }
    }
}

impl Record for Wide {
    type Key = (u64, u64, u64);
    #[inline]
    fn key(&self) -> (u64, u64, u64) {
        (self.lo, self.hi, self.corner)
    }
}

/// The label field of [`Wide`] when there is no label.
const NO_LABEL: u64 = u64::MAX >> 2;

impl EdgeRecord for Wide {
    fn pack(facing: &Facing) -> Wide {
        Wide {
            lo: facing.lo,
            hi: facing.hi,
            corner: facing.corner,
            opposite: facing.opposite,
            label: facing.label << 2 | u64::from(bits(facing)),
            apex: facing.apex,
        }
    }

    fn unpack(&self) -> Facing {
        let label = self.label >> 2;
        Facing {
            lo: self.lo,
            hi: self.hi,
            corner: self.corner,
            opposite: self.opposite,
            label: if label == NO_LABEL { u64::MAX } else { label },
            apex: self.apex,
            upward: self.label & 1 != 0,
            flipped: self.label & 2 != 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_back() {
        let none = u64::MAX;
        let most = Narrow::VERTICES - 1;
        for (lo, hi, opposite, label, apex) in [
            (1, 7, 12, 3, 9),
            (0, none, none, none, none),
            (0, 1, 4, 2, most),
        ] {
            for side in 0..4 {
                let facing = Facing {
                    lo,
                    hi,
                    corner: 41,
                    opposite,
                    label,
                    apex,
                    upward: side & 1 != 0,
                    flipped: side & 2 != 0,
                };
                assert_eq!(Narrow::pack(&facing).unpack(), facing);
                assert_eq!(Wide::pack(&facing).unpack(), facing);
            }
        }
    }
}
