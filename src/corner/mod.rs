//! Ids and operators of the corner table (Rossignac's corner table): pure arithmetic.
//!
//! ```text
//!            c.v                      corner c = 3t + k is corner k of triangle t
//!            /\                       c.t = c / 3
//!           /c \                      c.n = next, c.p = previous corner of the triangle
//!          /    \                     c faces the edge {c.n.v, c.p.v}
//!         / t    \                    c.o = the corner that faces the same edge
//!   c.n  /________\  c.p                    from the other side
//!        \        /
//!         \      /
//!          \ c.o/
//!           \  /
//! ```
//!
//! Memory: none. I/O: none.

mod ids;
mod index;

pub use ids::{Corner, Triangle, Vertex};
pub use index::Index;

/// Next corner of the same triangle: `3t + (c + 1) % 3`.
///
/// ```
/// assert_eq!([3, 4, 5].map(cornermill::corner::next), [4, 5, 3]);
/// ```
#[inline]
pub const fn next(c: u64) -> u64 {
    if c % 3 == 2 { c - 2 } else { c + 1 }
}

/// Previous corner of the same triangle: `3t + (c + 2) % 3`.
///
/// ```
/// assert_eq!([3, 4, 5].map(cornermill::corner::prev), [5, 3, 4]);
/// ```
#[inline]
pub const fn prev(c: u64) -> u64 {
    if c.is_multiple_of(3) { c + 2 } else { c - 1 }
}

/// Next place in a triangle, for k in 0..3.
#[inline]
pub const fn next_k(k: usize) -> usize {
    // 0 -> 1 -> 2 -> 0 without a division.
    (1 << k) & 3
}

/// Previous place in a triangle, for k in 0..3.
#[inline]
pub const fn prev_k(k: usize) -> usize {
    // 0 -> 2, 1 -> 0, 2 -> 1.
    (0b01_00_10 >> (2 * k)) & 3
}

/// Where corner c goes when its triangle is flipped: corners 3t + 1 and 3t + 2 change places.
///
/// ```
/// assert_eq!([3, 4, 5].map(cornermill::corner::flip), [3, 5, 4]);
/// ```
#[inline]
pub const fn flip(c: u64) -> u64 {
    match c % 3 {
        0 => c,
        1 => c + 1,
        _ => c - 1,
    }
}

/// Flips the place k in a triangle when `on`: 1 and 2 change places.
#[inline]
pub const fn flip_k(k: usize, on: bool) -> usize {
    if on && k != 0 { 3 - k } else { k }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_agree_with_corners() {
        for k in 0..3usize {
            assert_eq!(next(30 + k as u64), 30 + next_k(k) as u64);
            assert_eq!(prev(30 + k as u64), 30 + prev_k(k) as u64);
            assert_eq!(flip(30 + k as u64), 30 + flip_k(k, true) as u64);
            assert_eq!(flip_k(k, false), k);
            assert_eq!(prev_k(next_k(k)), k);
        }
    }
}
