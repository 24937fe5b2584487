//! The arithmetic: cross products, and sums made unit vectors.
//!
//! Why no coordinate is too large or too small: f4 coordinates, widened, leave f64 neither way in
//! a product of two. Those of 8 bytes are first multiplied with a power of two that brings the
//! largest of the mesh to about 2^480. Products then stay below 2^965 and sums of 2^36 of them finite,
//! and what loses bits to the smallest numbers is smaller than 2^-990 of the largest coordinate.
//!
//! Memory: none. I/O: the table of components once, for coordinates of 8 bytes.

use crate::chunk::measure::Coord;
use crate::error::Result;
use crate::folder::{Folder, Rows};

/// Takes cross products of the triangles of one mesh.
pub(super) struct Cross {
    /// A power of two.
    scale: f64,
}

impl Cross {
    /// For the mesh of this folder; `double` when its coordinates have 8 bytes.
    pub(super) fn new(folder: &Folder, double: bool) -> Result<Cross> {
        let mut largest = 0f64;
        if double {
            Rows::open(folder)?.each(|_, row| {
                let (min, max) = (row.base.bbox_min, row.base.bbox_max);
                for x in min.into_iter().chain(max).filter(|x| x.is_finite()) {
                    largest = largest.max(x.abs());
                }
                Ok(())
            })?;
        }
        Ok(Cross {
            scale: scale_of(largest),
        })
    }

    /// The cross product of a triangle's sides, seen from its first corner; `None` when a
    /// coordinate is not finite.
    #[inline]
    pub(super) fn of<X: Coord>(&self, corners: [[X; 3]; 3]) -> Option<[f64; 3]> {
        let [a, b, c] = corners.map(|p| p.map(|x| x.wide() * self.scale));
        let (u, v) = (minus(b, a), minus(c, a));
        let cross = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        // Finite corners have a finite product; others are looked at closely.
        if cross.iter().all(|x| x.is_finite()) && [a, b, c].as_flattened().iter().all(finite) {
            Some(cross)
        } else {
            None
        }
    }
}

#[inline]
fn finite(x: &f64) -> bool {
    x.is_finite()
}

#[inline]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Where the largest coordinate is brought to, as a power of two.
const LARGEST: i64 = 480;

/// A power of two that brings x to about 2^[`LARGEST`]; 1 for zero.
fn scale_of(x: f64) -> f64 {
    if x == 0.0 {
        return 1.0;
    }
    // The exponent, of subnormal numbers too low by what the clamp allows for.
    let exponent = (x.to_bits() >> 52) as i64 - 1023;
    2f64.powi((LARGEST - exponent).clamp(-1022, 1022) as i32)
}

/// Adds a cross product to a sum.
#[inline]
pub(super) fn add(sum: &mut [f64; 3], cross: [f64; 3]) {
    for (s, x) in sum.iter_mut().zip(cross) {
        *s += x;
    }
}

/// The sum's direction, or zero.
#[inline]
pub(super) fn unit(sum: [f64; 3]) -> [f32; 3] {
    let most = sum.iter().fold(0f64, |most, x| most.max(x.abs()));
    if most == 0.0 {
        return [0.0; 3];
    }
    // Divided by its largest, a sum of any size can be squared.
    let [x, y, z] = sum.map(|x| x / most);
    let length = (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|x| (x / length) as f32)
}

/// True when two corners have the same vertex.
#[inline]
pub(super) fn degenerate<V: PartialEq>([a, b, c]: &[V; 3]) -> bool {
    a == b || b == c || c == a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_any_kind_keep_their_direction() {
        for size in [5e-324, 1e-310, 1e-160, 1.0, 3.0, 1e160, 1e308] {
            let cross = Cross {
                scale: scale_of(size),
            };
            let p = |x: f64, y: f64| [x * size, y * size, 0.0];
            let of = cross.of([p(-1.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)]).unwrap();
            assert_eq!(unit(of), [0.0, 0.0, 1.0], "{size:e}: {of:?}");
            assert!(
                of.iter().all(|x| x.abs() < 2f64.powi(966)),
                "{size:e}: {of:?}"
            );
        }
        // A part of ordinary size beside coordinates near the end of the numbers.
        let cross = Cross {
            scale: scale_of(1e200),
        };
        let of = cross
            .of([[0.0; 3], [1.0, 0.0, 0.5], [0.25, 1.0, 0.0]])
            .unwrap();
        let plain = Cross { scale: 1.0 }.of([[0.0; 3], [1.0, 0.0, 0.5], [0.25, 1.0, 0.0]]);
        assert_eq!(unit(of), unit(plain.unwrap()));
        assert_eq!(unit([0.0, -0.0, 0.0]), [0.0; 3]);
        assert_eq!(unit([0.0, -5e-324, 0.0]), [0.0, -1.0, 0.0]);
        let times = 2f64.powi(480);
        assert_eq!(
            (scale_of(8.0), scale_of(0.25), scale_of(0.0)),
            (0.125 * times, 4.0 * times, 1.0)
        );
    }

    #[test]
    fn what_is_not_finite_has_no_product() {
        let cross = Cross { scale: 1.0 };
        let good = [[0f32; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(cross.of(good), Some([0.0, 0.0, 1.0]));
        for i in 0..9 {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut corners = good;
                corners[i / 3][i % 3] = bad;
                assert_eq!(cross.of(corners), None);
            }
        }
    }
}
