//! Vectors of integers, and logarithms and lengths without floating point.

/// A vector.
pub type Vec3 = [i64; 3];

/// a - b.
#[inline]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + b.
#[inline]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a . b.
#[inline]
pub fn dot(a: Vec3, b: Vec3) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a x b.
#[inline]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The largest magnitude of a coordinate.
#[inline]
pub fn reach(a: Vec3) -> u64 {
    a[0].unsigned_abs() | a[1].unsigned_abs() | a[2].unsigned_abs()
}

/// How far to shift down so that at most `bits` bits are left.
#[inline]
pub fn excess(reach: u64, bits: u32) -> u32 {
    (64 - reach.leading_zeros()).saturating_sub(bits)
}

/// Each coordinate shifted down.
#[inline]
pub fn shift(a: Vec3, by: u32) -> Vec3 {
    [a[0] >> by, a[1] >> by, a[2] >> by]
}

/// Four times the binary logarithm, by the leading one and the two bits behind it; 0 for 0.
#[inline]
pub fn log4(x: u64) -> i32 {
    if x == 0 {
        return 0;
    }
    let top = 63 - x.leading_zeros();
    let two = if top >= 2 {
        x >> (top - 2)
    } else {
        x << (2 - top)
    };
    (4 * top + (two as u32 & 3)) as i32
}

/// [`log4`] of the square of a vector's length.
#[inline]
pub fn log_square(a: Vec3) -> i32 {
    let down = excess(reach(a), 29);
    let a = shift(a, down);
    log4(dot(a, a) as u64) + 8 * down as i32
}

/// The integer square root: the largest whose square is no more.
///
/// The processor's root is within one of it, whatever it rounds to, and is set right.
#[inline]
fn root(x: u64) -> u64 {
    let mut r = ((x as f64).sqrt() as u64).min(u64::from(u32::MAX));
    while r * r > x {
        r -= 1;
    }
    while r < u64::from(u32::MAX) && (r + 1) * (r + 1) <= x {
        r += 1;
    }
    r
}

/// Bits of a fraction of a [`unit()`] vector.
pub const UNIT: u32 = 20;

/// The vector of length 2^20 in this direction; 0 for 0.
#[inline]
pub fn unit(a: Vec3) -> Vec3 {
    let a = shift(a, excess(reach(a), 30));
    let length = root(dot(a, a) as u64) as i64;
    if length == 0 {
        return [0; 3];
    }
    a.map(|x| (x << UNIT) / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_those_of_integers() {
        let squares = (0..32).flat_map(|bits| [1u64 << bits, (1 << bits) + 1, (3 << bits) / 2]);
        let ends = [u64::from(u32::MAX), 94_906_265, 94_906_266, 94_906_267];
        for r in squares.chain(ends) {
            let r = r.min(u64::from(u32::MAX));
            for x in [r * r - 1, r * r, r * r + 1, r * r + 2 * r] {
                assert_eq!(root(x), x.isqrt(), "{x}");
            }
        }
        assert_eq!((root(0), root(u64::MAX)), (0, u64::from(u32::MAX)));
    }
}
