//! The grid on which volumes and areas are summed exactly.
//!
//! Why it works: coordinates are scaled by a power of two so that the bounding box of the
//! finite vertices spans at most 2^30 steps, and rounded to integers. A determinant of three
//! points of the box is an exact integer below 2^91, so i128 sums of up to 2^36 triangles are
//! exact and do not depend on the order of work. A triangle's area is computed in f64 from
//! the scaled coordinates and rounded to quarter squared steps, which again sums exactly.
//!
//! Source: signed volume as the sum of mixed products (PA x PB).PC over the triangles
//! (Rossignac); the reference point P is the corner of the box.
//!
//! Memory: none. I/O: none.

use glam::DVec3;

/// The most steps along the longest side of the box: 2^30.
const STEP_BITS: i32 = 30;
/// Adding this to a small f64 leaves its nearest integer (ties to even) in the low bits.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Bounding box of the finite vertices, and how many are not finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: [f64; 3],
    /// Largest coordinates.
    pub max: [f64; 3],
    /// Vertices with a coordinate that is not finite.
    pub nonfinite: u64,
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            nonfinite: 0,
        }
    }
}

impl Bounds {
    /// Takes in one vertex.
    #[inline]
    pub fn add(&mut self, p: [f64; 3]) {
        if p.iter().all(|x| x.is_finite()) {
            for (a, &x) in p.iter().enumerate() {
                self.min[a] = self.min[a].min(x);
                self.max[a] = self.max[a].max(x);
            }
        } else {
            self.nonfinite += 1;
        }
    }

    /// Takes in what another gathered.
    pub fn merge(&mut self, other: &Bounds) {
        for a in 0..3 {
            self.min[a] = self.min[a].min(other.min[a]);
            self.max[a] = self.max[a].max(other.max[a]);
        }
        self.nonfinite += other.nonfinite;
    }
}

/// The grid over a box.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    origin: DVec3,
    /// Steps per half unit: half, because the extent of a box of large f8 values may overflow.
    scale: f64,
    /// Binary exponent of a step, in input units.
    exponent: i32,
}

impl Grid {
    /// The grid over the box; any grid will do for a box without finite vertices.
    pub fn new(bounds: &Bounds) -> Grid {
        let half = (0..3)
            .map(|a| bounds.max[a] * 0.5 - bounds.min[a] * 0.5)
            .fold(0.0, f64::max);
        if !half.is_finite() || half <= 0.0 {
            let finite = bounds.min[0].is_finite();
            return Grid {
                origin: if finite {
                    DVec3::from(bounds.min) * 0.5
                } else {
                    DVec3::ZERO
                },
                scale: 1.0,
                exponent: 1,
            };
        }
        // The least e with half <= 2^e; below the normal range the grid is simply coarser.
        let e = exponent_above(half).max(-980);
        Grid {
            origin: DVec3::from(bounds.min) * 0.5,
            scale: exp2(STEP_BITS - e),
            exponent: e + 1 - STEP_BITS,
        }
    }

    /// A finite point in steps from the corner of the box, not rounded.
    #[inline]
    pub fn scale(&self, p: [f64; 3]) -> DVec3 {
        (DVec3::from(p) * 0.5 - self.origin) * self.scale
    }

    /// Six times a volume in input units from its sum on the grid.
    pub fn six_volume(&self, sum: i128) -> f64 {
        scale_by(sum as f64, 3 * self.exponent)
    }

    /// An area in input units from its sum on the grid.
    pub fn area(&self, sum: i128) -> f64 {
        scale_by(sum as f64, 2 * self.exponent - 2)
    }
}

/// Multiplies by 2^e in steps that do not overflow before the result does.
fn scale_by(mut x: f64, mut e: i32) -> f64 {
    while e != 0 {
        let step = e.clamp(-900, 900);
        x *= exp2(step);
        e -= step;
    }
    x
}

/// 2^e exactly, for e in the normal range.
fn exp2(e: i32) -> f64 {
    f64::from_bits(((e + 1023) as u64) << 52)
}

/// The least e with `x <= 2^e`, for a positive x; -1022 for subnormal ones.
fn exponent_above(x: f64) -> i32 {
    let bits = x.to_bits();
    let e = (bits >> 52) as i32 - 1023;
    if bits << 12 == 0 { e } else { e + 1 }
}

/// A scaled point of the box rounded to the grid: coordinates of at most 2^30.
#[inline]
pub fn rounded(p: DVec3) -> [i32; 3] {
    // The low half of the sum's bits is the nearest integer, ties to even.
    p.to_array().map(|x| (x + ROUNDER).to_bits() as i32)
}

/// The determinant of three points of the grid: (PA x PB).PC.
#[inline]
pub fn mixed_product(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> i128 {
    let [ax, ay, az] = a.map(i64::from);
    let [bx, by, bz] = b.map(i64::from);
    // Each difference of products is below 2^61.
    let x = ay * bz - az * by;
    let y = az * bx - ax * bz;
    let z = ax * by - ay * bx;
    let [x, y, z] = [x, y, z].map(i128::from);
    let [cx, cy, cz] = c.map(i128::from);
    x * cx + y * cy + z * cz
}

/// The area of the triangle of three scaled points, in quarter squared steps.
#[inline]
pub fn area(a: DVec3, b: DVec3, c: DVec3) -> i128 {
    // Half the cross product, times four; at most 2^62.
    i128::from(((b - a).cross(c - a).length() * 2.0) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(min: [f64; 3], max: [f64; 3]) -> Grid {
        let mut bounds = Bounds::default();
        bounds.add(min);
        bounds.add(max);
        Grid::new(&bounds)
    }

    /// The one convention: outward is counterclockwise seen from outside, and then the sum is
    /// six times the enclosed volume.
    #[test]
    fn unit_tetrahedron_is_outward_and_has_volume_one_sixth() {
        let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
        let outward = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let grid = grid([0.; 3], [1.; 3]);
        let p = points.map(|p| grid.scale(p));
        let sum: i128 = outward
            .iter()
            .map(|&[a, b, c]| mixed_product(rounded(p[a]), rounded(p[b]), rounded(p[c])))
            .sum();
        assert_eq!(grid.six_volume(sum), 1.0);
        let areas: i128 = outward
            .iter()
            .map(|&[a, b, c]| area(p[a], p[b], p[c]))
            .sum();
        let expected = 1.5 + 3f64.sqrt() / 2.0;
        assert!((grid.area(areas) - expected).abs() < 1e-9);
    }

    #[test]
    fn far_out_and_tiny_boxes_stay_in_range() {
        for (lo, hi) in [
            (-1.7e308, 1.7e308),
            (0.0, 5e-324),
            (1e300, 1.1e300),
            (-3.0, 5.0),
            (7.0, 7.0),
        ] {
            let grid = grid([lo; 3], [hi; 3]);
            let far = grid.scale([hi; 3]);
            assert!(far.x >= 0.0 && far.x <= exp2(30), "{lo} {hi}: {far}");
            assert_eq!(grid.scale([lo; 3]), DVec3::ZERO);
            if hi - lo > 1e-200 && hi - lo < 1e200 {
                assert!(far.x >= exp2(29), "{lo} {hi}: {far}");
            }
        }
    }

    #[test]
    fn rounds_to_nearest_even() {
        for (x, r) in [
            (0.5, 0),
            (1.5, 2),
            (-1.5, -2),
            (2.4999, 2),
            (1073741824.0, 1 << 30),
        ] {
            assert_eq!(rounded(DVec3::new(x, 0.0, -0.0)), [r, 0, 0], "{x}");
        }
    }
}
