//! What a triangle or a line covers: pure arithmetic on integers.
//!
//! ```text
//!      a ●────────● b      a sample at p lies within when the three products
//!         \  ·p  /         (b-a)×(p-a), (c-b)×(p-b), (a-c)×(p-c)
//!          \    /          have the sign of the area; on an edge, when the edge
//!           \  /           points down, or to the left
//!            ● c
//! ```
//!
//! Why no crack shows between triangles: a product is exact (coordinates stay within 2^28, so
//! products within 2^59), so of two triangles that run along an edge in opposite directions one
//! has the sample and the other has not; a sample *on* the edge belongs to the one for which
//! the edge points down or left, and to that alone. So every sample inside a surface is
//! covered, however small its triangles, and the many that cover none may be dropped at once.
//!
//! Memory: none. I/O: none.

use super::view::{FRACTION, Spot};
use std::ops::Range;

const UNIT: i32 = 1 << FRACTION;
const HALF: i32 = UNIT / 2;
/// Bits of depth below a unit: 32 in all.
const DEPTH_SHARE: f64 = 8.0;

/// A rectangle of samples.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Area {
    pub(super) x: Range<i32>,
    pub(super) y: Range<i32>,
}

impl Area {
    /// The part within another.
    pub(super) fn within(&self, other: &Area) -> Area {
        let both = |a: &Range<i32>, b: &Range<i32>| a.start.max(b.start)..a.end.min(b.end);
        Area {
            x: both(&self.x, &other.x),
            y: both(&self.y, &other.y),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.x.is_empty() || self.y.is_empty()
    }
}

/// Samples whose middle lies from `least` to `most`, of `0..count`.
#[inline]
fn middles(least: i32, most: i32, count: i32) -> Range<i32> {
    let from = (least - HALF + UNIT - 1) >> FRACTION;
    let to = ((most - HALF) >> FRACTION) + 1;
    from.max(0)..to.min(count)
}

/// Depth as it is kept, 32 bits, smaller nearer.
#[inline]
fn kept(depth: f64) -> u32 {
    (depth * DEPTH_SHARE) as u32
}

/// `(b - a) × (p - a)`, positive when p lies clockwise as the image is seen.
#[inline]
fn product(a: Spot, b: Spot, p: [i32; 2]) -> i64 {
    let wide = |x: i32, y: i32| i64::from(x) - i64::from(y);
    wide(b[0], a[0]) * wide(p[1], a[1]) - wide(b[1], a[1]) * wide(p[0], a[0])
}

/// A triangle in the image that may cover samples.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Its corners, so turned that the area is positive.
    spots: [Spot; 3],
    area: i64,
    /// True when its front faces the viewer.
    pub(super) front: bool,
    /// The samples that it may cover.
    pub(super) bounds: Area,
}

impl Facet {
    /// `None` when it covers no sample: no middle of one lies within its bounds, or it is seen
    /// edge-on.
    #[inline]
    pub(super) fn new(spots: [Spot; 3], width: i32, height: i32) -> Option<Facet> {
        let [a, b, c] = spots;
        let range =
            |k: usize, count| middles(a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]), count);
        let bounds = Area {
            x: range(0, width),
            y: range(1, height),
        };
        if bounds.is_empty() {
            return None;
        }
        let area = product(a, b, [c[0], c[1]]);
        let (spots, front) = if area > 0 {
            (spots, false)
        } else {
            ([a, c, b], true)
        };
        (area != 0).then_some(Facet {
            spots,
            area: area.abs(),
            front,
            bounds,
        })
    }

    /// The cosine of the angle between its normal and the viewer, in 0..=255.
    pub(super) fn shade(&self, depth_unit: f64) -> u32 {
        let [a, b, c] = self.spots;
        let side = |p: Spot, k: usize| f64::from(p[k]) - f64::from(a[k]);
        let [u, v] = [b, c].map(|p| [side(p, 0), side(p, 1), side(p, 2) * depth_unit]);
        let (x, y) = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2]);
        let z = self.area as f64;
        (255.0 * z / (x * x + y * y + z * z).sqrt() + 0.5) as u32
    }

    /// Calls `f` with each sample that it covers within an area, and the depth there.
    #[inline]
    pub(super) fn cover(&self, area: &Area, mut f: impl FnMut(i32, i32, u32)) {
        let Area {
            x: columns,
            y: rows,
        } = self.bounds.within(area);
        let [a, b, c] = self.spots;
        let first = [columns.start, rows.start].map(|i| (i << FRACTION) + HALF);
        // At the first sample; an edge that does not own what lies on it loses what is 0 there.
        let edges = [(a, b), (b, c), (c, a)];
        let owns = |(p, q): (Spot, Spot)| q[1] > p[1] || (q[1] == p[1] && q[0] < p[0]);
        let less = edges.map(|edge| i64::from(!owns(edge)));
        let mut row = [0, 1, 2].map(|k| product(edges[k].0, edges[k].1, first) - less[k]);
        let step = |d: i32| i64::from(d) << FRACTION;
        let right = edges.map(|(p, q)| -step(q[1] - p[1]));
        let down = edges.map(|(p, q)| step(q[0] - p[0]));
        let (share, depth) = (1.0 / self.area as f64, f64::from(a[2]));
        let (to_b, to_c) = (f64::from(b[2]) - depth, f64::from(c[2]) - depth);
        for y in rows {
            let mut at = row;
            for x in columns.clone() {
                if at[0] | at[1] | at[2] >= 0 {
                    // The product along ca weighs b, the one along ab weighs c.
                    let weigh = |k: usize| (at[k] + less[k]) as f64 * share;
                    f(x, y, kept(depth + weigh(2) * to_b + weigh(0) * to_c));
                }
                at = [0, 1, 2].map(|k| at[k] + right[k]);
            }
            row = [0, 1, 2].map(|k| row[k] + down[k]);
        }
    }
}

/// A line of constant width in the image, with round ends, drawn a little nearer than it lies.
#[derive(Clone, Debug)]
pub(super) struct Line {
    ends: [[f64; 3]; 2],
    /// Half its width, in units.
    radius: f64,
    /// How much nearer, in units of depth.
    nearer: f64,
    /// The samples that it may cover.
    pub(super) bounds: Area,
}

impl Line {
    /// `radius` in samples, `nearer` in units of depth; `None` when it covers no sample.
    pub(super) fn new(
        ends: [Spot; 2],
        (radius, nearer): (f64, f64),
        width: i32,
        height: i32,
    ) -> Option<Line> {
        let radius = radius * f64::from(UNIT);
        let [a, b] = ends;
        let range = |k: usize, count| {
            let wide = radius as i32 + 1;
            middles(a[k].min(b[k]) - wide, a[k].max(b[k]) + wide, count)
        };
        let bounds = Area {
            x: range(0, width),
            y: range(1, height),
        };
        (!bounds.is_empty()).then_some(Line {
            ends: ends.map(|end| end.map(f64::from)),
            radius,
            nearer,
            bounds,
        })
    }

    /// Calls `f` with each sample that it covers within an area, and the depth there.
    pub(super) fn cover(&self, area: &Area, mut f: impl FnMut(i32, i32, u32)) {
        let Area {
            x: columns,
            y: rows,
        } = self.bounds.within(area);
        let [a, b] = self.ends;
        let along = [0, 1, 2].map(|k| b[k] - a[k]);
        let length = along[0] * along[0] + along[1] * along[1];
        let middle = |i: i32| f64::from(i) * f64::from(UNIT) + f64::from(HALF);
        for y in rows {
            let dy = middle(y) - a[1];
            for x in self.columns(columns.clone(), middle(y)) {
                let dx = middle(x) - a[0];
                // The nearest place on the line, from 0 at one end to 1 at the other.
                let place = if length > 0.0 {
                    ((dx * along[0] + dy * along[1]) / length).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let off = [dx - place * along[0], dy - place * along[1]];
                if off[0] * off[0] + off[1] * off[1] <= self.radius * self.radius {
                    f(x, y, kept(a[2] + place * along[2] - self.nearer));
                }
            }
        }
    }

    /// Of the columns those that a row may touch: a long slanted line need not look at all of
    /// its rectangle.
    fn columns(&self, columns: Range<i32>, y: f64) -> Range<i32> {
        let [a, b] = self.ends;
        let rise = b[1] - a[1];
        if rise.abs() < 4.0 * self.radius {
            return columns;
        }
        // Where the line passes the row, and where it does two radii above and below.
        let at = |y: f64| a[0] + ((y - a[1]) / rise).clamp(0.0, 1.0) * (b[0] - a[0]);
        let (p, q) = (at(y - 2.0 * self.radius), at(y + 2.0 * self.radius));
        let wide = self.radius + f64::from(UNIT);
        let index = |x: f64| (x / f64::from(UNIT)).floor() as i32;
        let touched = index(p.min(q) - wide)..index(p.max(q) + wide) + 1;
        columns.start.max(touched.start)..columns.end.min(touched.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIDE: i32 = 24;

    fn all() -> Area {
        Area {
            x: 0..SIDE,
            y: 0..SIDE,
        }
    }

    fn count(spots: [Spot; 3], hits: &mut [u32]) {
        if let Some(facet) = Facet::new(spots, SIDE, SIDE) {
            facet.cover(&all(), |x, y, _| hits[(y * SIDE + x) as usize] += 1);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// A fan around any spot, over a square's border: each sample exactly once. Halves of
        /// samples are taken often, so that middles lie on edges and on vertices.
        #[test]
        fn a_fan_covers_each_sample_once(
            x in 0..2 * SIDE, y in 0..2 * SIDE, fine in any::<bool>(),
            shift in 0..UNIT, turned in any::<u16>(),
        ) {
            let middle = if fine { [x * HALF + shift, y * HALF - shift, 5] } else { [x * HALF, y * HALF, 5] };
            let middle = middle.map(|x| x.clamp(0, SIDE * UNIT));
            let side = SIDE * UNIT;
            let mut rim = Vec::new();
            for i in 0..4 {
                rim.push([i * side / 4, 0, 0]);
            }
            for i in 0..4 {
                rim.push([side, i * side / 4, 0]);
            }
            for i in 0..4 {
                rim.push([side - i * side / 4, side, 0]);
            }
            for i in 0..4 {
                rim.push([0, side - i * side / 4, 0]);
            }
            let mut hits = vec![0; (SIDE * SIDE) as usize];
            for i in 0..16 {
                let mut spots = [rim[i], rim[(i + 1) % 16], middle];
                // The winding must not matter.
                if turned >> i & 1 == 1 {
                    spots.swap(0, 1);
                }
                count(spots, &mut hits);
            }
            prop_assert!(hits.iter().all(|&n| n == 1), "{hits:?}");
        }

        /// A line covers what lies within its radius, by the distance worked out plainly.
        #[test]
        fn lines_cover_their_width(
            ends in any::<[[u16; 2]; 2]>(), radius in 1u32..40,
        ) {
            let radius = f64::from(radius) / 10.0;
            let end = |e: [u16; 2]| [i32::from(e[0]) * 6, i32::from(e[1]) * 6, 1000];
            let (a, b) = (end(ends[0]), end(ends[1]));
            let mut seen = vec![false; (SIDE * SIDE) as usize];
            if let Some(line) = Line::new([a, b], (radius, 0.0), SIDE, SIDE) {
                line.cover(&all(), |x, y, _| seen[(y * SIDE + x) as usize] = true);
            }
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let unit = f64::from(UNIT);
                    let p = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                    let mut least = f64::MAX;
                    for i in 0..=4000 {
                        let at = f64::from(i) / 4000.0;
                        let q = [0, 1].map(|k| (f64::from(a[k]) * (1.0 - at) + f64::from(b[k]) * at) / unit);
                        least = least.min((p[0] - q[0]).hypot(p[1] - q[1]));
                    }
                    let sure = (least - radius).abs() > 0.02;
                    prop_assert!(!sure || seen[(y * SIDE + x) as usize] == (least < radius), "{x} {y}");
                }
            }
        }
    }

    #[test]
    fn depth_runs_straight_and_facing_is_told() {
        // Counterclockwise as one sees it: down is positive, so b lies below.
        let at = |x: i32, y: i32, z: i32| [x * UNIT, y * UNIT, z * UNIT];
        let facet = Facet::new([at(0, 0, 10), at(0, 20, 10), at(20, 0, 30)], SIDE, SIDE).unwrap();
        assert!(facet.front);
        facet.cover(&all(), |x, _, depth| {
            let expected = (10.5 + f64::from(x)) * f64::from(UNIT) * DEPTH_SHARE;
            assert!((f64::from(depth) - expected).abs() <= 1.0);
        });
        // The slope is one: the normal stands at 45 degrees.
        assert_eq!(facet.shade(1.0), 180);
        let back = Facet::new([at(0, 0, 9), at(20, 0, 9), at(0, 20, 9)], SIDE, SIDE).unwrap();
        assert!(!back.front);
        assert_eq!(back.shade(1.0), 255);
        assert!(Facet::new([at(0, 0, 0), at(4, 4, 0), at(8, 8, 9)], SIDE, SIDE).is_none());
        let small = [
            [HALF + 1, HALF + 1, 0],
            [UNIT, HALF + 1, 0],
            [UNIT, UNIT, 0],
        ];
        assert!(Facet::new(small, SIDE, SIDE).is_none());
    }
}
