//! The rows of a settled chunk, as if each local component kept its label and the orientation of its
//! first triangle.
//!
//! Memory: a row of ids for each triangle, the caller's. I/O: V, O and labels written once.

use super::arrays::OutArray;
use crate::chunk::pair::SPECIAL;
use crate::chunk::swirl::NO_COMPONENT;
use crate::corner::{Index, flip_k};
use crate::error::Result;

/// A settled chunk, about to be written.
pub struct Rows<'a, I> {
    /// V as the input has it.
    pub v: &'a [I],
    /// Opposites.
    pub opposite: &'a [u32],
    /// Labels.
    pub label: &'a [u32],
    /// First triangle.
    pub first: u64,
    /// True when flips are applied.
    pub apply: bool,
}

impl<I: Index> Rows<'_, I> {
    /// Writes V.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write_v(&self, to: &OutArray, out: &mut Vec<I>) -> Result<()> {
        if !self.apply {
            return to.write(3 * self.first, self.v);
        }
        flip_rows(self.v, self.label, out);
        to.write(3 * self.first, out)
    }

    /// Writes O; what is not settled gets NONE for now.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write_o(&self, to: &OutArray, out: &mut Vec<I>) -> Result<()> {
        opposites(self.opposite, self.label, 3 * self.first, self.apply, out);
        to.write(3 * self.first, out)
    }

    /// Writes the local labels.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write_labels(&self, to: &OutArray, out: &mut Vec<I>) -> Result<()> {
        out.clear();
        out.extend(self.label.iter().map(|&label| match label {
            NO_COMPONENT => I::NONE,
            label => I::of(u64::from(label >> 1)),
        }));
        to.write(self.first, out)
    }
}

#[inline]
fn flipped(label: u32) -> bool {
    label != NO_COMPONENT && label & 1 == 1
}

/// V rows with the swirl's flips applied.
fn flip_rows<I: Index>(v: &[I], label: &[u32], out: &mut Vec<I>) {
    out.clear();
    for (row, &label) in v.as_chunks::<3>().0.iter().zip(label) {
        let [a, b, c] = *row;
        out.extend(if flipped(label) { [a, c, b] } else { [a, b, c] });
    }
}

/// O rows, flips applied when `apply`; corners whose opposite is not settled get NONE for now.
fn opposites<I: Index>(opposite: &[u32], label: &[u32], base: u64, apply: bool, out: &mut Vec<I>) {
    out.clear();
    if !apply {
        out.extend(opposite.iter().map(|&o| {
            if o < SPECIAL {
                I::of(base + u64::from(o >> 1))
            } else {
                I::NONE
            }
        }));
        return;
    }
    for (row, &own) in opposite.as_chunks::<3>().0.iter().zip(label) {
        let mut flat = row.map(|o| {
            if o >= SPECIAL {
                return I::NONE;
            }
            let (t, k) = ((o >> 1) / 3, (o >> 1) as usize % 3);
            let k = flip_k(k, flipped(label[t as usize]));
            I::of(base + 3 * u64::from(t) + k as u64)
        });
        if flipped(own) {
            flat.swap(1, 2);
        }
        out.extend(flat);
    }
}

/// Packs the flips, a bit a triangle.
pub fn pack_flips(label: &[u32], bits: &mut Vec<u8>) {
    bits.clear();
    bits.extend(label.chunks(8).map(|eight| {
        let bit = |(i, &label): (usize, &u32)| u8::from(flipped(label)) << i;
        eight.iter().enumerate().map(bit).fold(0, |a, b| a | b)
    }));
}
