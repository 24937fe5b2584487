//! Numbers as text: the shortest digits that read back as the same value.
//!
//! Very large and very small values get an exponent, so that a line stays short. Negative zero
//! is `-0`; values that are not finite are `inf`, `-inf` and `NaN` (which NaN it was is lost).
//!
//! Memory: none. I/O: none.

use crate::table::array::Coords;
use std::fmt::{Display, LowerExp};
use std::io::Write;

/// Appends the coordinates of a row, with a space before each.
pub(super) fn put_row(buf: &mut Vec<u8>, kind: Coords, row: &[u8]) {
    for x in kind.row(row, 0) {
        match kind {
            // The f8 that holds an f4 narrows back exactly, and has its short digits as f4.
            Coords::F4 => put(buf, x as f32, x),
            Coords::F8 => put(buf, x, x),
        }
    }
}

fn put(buf: &mut Vec<u8>, x: impl Display + LowerExp, value: f64) {
    let plain = value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs());
    // Writing to a Vec cannot fail.
    let _ = if plain {
        write!(buf, " {x}")
    } else {
        write!(buf, " {x:e}")
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text_of(x: f64) -> String {
        let mut buf = Vec::new();
        let row = [x; 3].map(f64::to_le_bytes);
        put_row(&mut buf, Coords::F8, row.as_flattened());
        let text = String::from_utf8(buf).unwrap();
        text.split(' ').nth(2).unwrap().to_owned()
    }

    #[test]
    fn digits_are_short_and_read_back() {
        for (x, text) in [
            (0.1, "0.1"),
            (-0.0, "-0"),
            (3.0, "3"),
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
            (1e300, "1e300"),
            (-2.5e-7, "-2.5e-7"),
            (5e-324, "5e-324"),
            (1e-4, "0.0001"),
            (1e16, "1e16"),
            (123456789.0, "123456789"),
        ] {
            assert_eq!(text_of(x), text);
            let back: f64 = text.parse().unwrap();
            assert!(back.to_bits() == x.to_bits() || x.is_nan());
        }
        let mut buf = Vec::new();
        let row = [0.1f32, -0.0, f32::MAX].map(f32::to_le_bytes);
        put_row(&mut buf, Coords::F4, row.as_flattened());
        assert_eq!(buf, b" 0.1 -0 3.4028235e38");
    }
}
