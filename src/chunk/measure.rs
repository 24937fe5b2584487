//! Volume, area and bounding box of the local components of one chunk.
//!
//! Why it works: every sum is an integer (see [`grid`](super::grid)) or a minimum or maximum, so
//! any grouping of the triangles gives the same result.
//!
//! Memory: [`Measure`] for each local component, and the [`Measurer`]'s. O(C) time.

use super::grid::{Grid, area, mixed_product, rounded};
use super::swirl::NO_COMPONENT;
use glam::DVec3;

/// Sums over some triangles of one component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Sum of mixed products with every triangle oriented like its local component's first.
    pub six_oriented: i128,
    /// Sum of mixed products as the input had the triangles.
    pub six_input: i128,
    /// Sum of areas, in quarter squared steps.
    pub area: i128,
    /// Smallest finite coordinates.
    pub min: [f64; 3],
    /// Largest finite coordinates.
    pub max: [f64; 3],
    /// True when a vertex is not finite.
    pub nonfinite: bool,
}

impl Default for Measure {
    fn default() -> Self {
        Measure {
            six_oriented: 0,
            six_input: 0,
            area: 0,
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            nonfinite: false,
        }
    }
}

impl Measure {
    /// Takes in one triangle: its corners' positions as the input had them, and whether it is
    /// flipped against its local component's first triangle.
    #[inline]
    pub fn add(&mut self, grid: &Grid, corners: [[f64; 3]; 3], flipped: bool) {
        let finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
        if corners.iter().all(finite) {
            let [a, b, c] = corners.map(|p| grid.scale(p));
            let six = mixed_product(rounded(a), rounded(b), rounded(c));
            self.six_input += six;
            self.six_oriented += if flipped { -six } else { six };
            self.area += area(a, b, c);
            for p in &corners {
                self.stretch(p);
            }
        } else {
            self.nonfinite = true;
            for p in corners.iter().filter(|p| finite(p)) {
                self.stretch(p);
            }
        }
    }

    /// Takes in what another gathered; `flipped` when it was oriented the other way.
    pub fn merge(&mut self, other: &Measure, flipped: bool) {
        self.six_input += other.six_input;
        self.six_oriented += if flipped {
            -other.six_oriented
        } else {
            other.six_oriented
        };
        self.area += other.area;
        for a in 0..3 {
            self.min[a] = self.min[a].min(other.min[a]);
            self.max[a] = self.max[a].max(other.max[a]);
        }
        self.nonfinite |= other.nonfinite;
    }

    #[inline]
    fn stretch(&mut self, p: &[f64; 3]) {
        for (a, &x) in p.iter().enumerate() {
            // Adding +0 turns -0 into +0, so that neither wins by the order of work.
            let x = x + 0.0;
            if x < self.min[a] {
                self.min[a] = x;
            }
            if x > self.max[a] {
                self.max[a] = x;
            }
        }
    }
}

/// Coordinates of both widths.
pub trait Coord: bytemuck::Pod + Send + Sync {
    /// Bytes on disk.
    const BYTES: usize;
    /// NumPy's name of the type.
    const DESCR: &'static str;
    /// Widens exactly.
    fn wide(self) -> f64;
    /// Narrows by rounding.
    fn of(x: f64) -> Self;
}

impl Coord for f32 {
    const BYTES: usize = 4;
    const DESCR: &'static str = "<f4";
    #[inline]
    fn wide(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn of(x: f64) -> f32 {
        x as f32
    }
}

impl Coord for f64 {
    const BYTES: usize = 8;
    const DESCR: &'static str = "<f8";
    #[inline]
    fn wide(self) -> f64 {
        self
    }
    #[inline]
    fn of(x: f64) -> f64 {
        x
    }
}

/// A local vertex made ready: each is named by about six triangles.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    /// In steps from the corner of the box.
    scaled: DVec3,
    /// The same rounded to the grid.
    rounded: [i32; 3],
    /// The component whose box was stretched over it last, or [`NONFINITE`], or [`ABSENT`].
    seen: u32,
}

const UNSEEN: u32 = u32::MAX - 2;
const NONFINITE: u32 = u32::MAX - 1;
const ABSENT: u32 = u32::MAX;

/// Measures the local components of chunks. Reused from chunk to chunk.
///
/// Memory: 40 bytes a local vertex.
#[derive(Debug, Default)]
pub struct Measurer {
    points: Vec<Point>,
    /// Sum of mixed products of the flipped triangles, by component.
    flipped: Vec<i128>,
}

impl Measurer {
    /// Bytes held for each local vertex.
    pub const BYTES: u64 = size_of::<Point>() as u64;

    /// Sums each local component of a chunk into `out` (one entry a component, from zero).
    ///
    /// `local` is the local vertex of each corner, `label` the swirl's result for each
    /// triangle, `positions` the coordinates by local vertex. Triangles with a vertex that is
    /// marked in `absent` (as long as `positions`, or empty) are passed over.
    pub fn measure<X: Coord>(
        &mut self,
        grid: &Grid,
        local: &[u32],
        label: &[u32],
        positions: &[[X; 3]],
        absent: &[bool],
        out: &mut [Measure],
    ) {
        self.points.clear();
        self.points
            .extend(positions.iter().map(|p| point(grid, p.map(Coord::wide))));
        for (p, _) in self.points.iter_mut().zip(absent).filter(|(_, a)| **a) {
            p.seen = ABSENT;
        }
        self.flipped.clear();
        self.flipped.resize(out.len(), 0);
        for (v, &label) in local.as_chunks::<3>().0.iter().zip(label) {
            if label == NO_COMPONENT {
                continue;
            }
            let component = (label >> 1) as usize;
            let [a, b, c] = v.map(|v| self.points[v as usize]);
            let m = &mut out[component];
            if a.seen > UNSEEN || b.seen > UNSEEN || c.seen > UNSEEN {
                if [a, b, c].iter().any(|p| p.seen == ABSENT) {
                    continue;
                }
                m.add(
                    grid,
                    v.map(|v| positions[v as usize].map(Coord::wide)),
                    label & 1 == 1,
                );
                continue;
            }
            let six = mixed_product(a.rounded, b.rounded, c.rounded);
            m.six_input += six;
            if label & 1 == 1 {
                self.flipped[component] += six;
            }
            m.area += area(a.scaled, b.scaled, c.scaled);
            for (p, v) in [a, b, c].iter().zip(v) {
                if p.seen != label >> 1 {
                    self.points[*v as usize].seen = label >> 1;
                    m.stretch(&positions[*v as usize].map(Coord::wide));
                }
            }
        }
        for (m, flipped) in out.iter_mut().zip(&self.flipped) {
            // What non-finite triangles would have added is nothing in both sums.
            m.six_oriented = m.six_input - 2 * flipped;
        }
    }
}

#[inline]
fn point(grid: &Grid, p: [f64; 3]) -> Point {
    if p.iter().all(|x| x.is_finite()) {
        let scaled = grid.scale(p);
        Point {
            scaled,
            rounded: rounded(scaled),
            seen: UNSEEN,
        }
    } else {
        Point {
            seen: NONFINITE,
            ..Point::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::Bounds;
    use super::*;

    #[test]
    fn flips_and_non_finite_vertices() {
        let positions = [
            [0f32, 0., 0.],
            [1., 0., 0.],
            [0., 1., 0.],
            [0., 0., 1.],
            [f32::NAN, 9., 9.],
        ];
        let mut bounds = Bounds::default();
        positions.iter().for_each(|p| bounds.add(p.map(f64::from)));
        assert_eq!(bounds.nonfinite, 1);
        let grid = Grid::new(&bounds);
        // The only face away from the origin, given inward and so flipped.
        let local = [1, 3, 2, 0, 1, 4, 2, 2, 1];
        let label = [1, 2, NO_COMPONENT];
        let mut out = [Measure::default(); 2];
        Measurer::default().measure(&grid, &local, &label, &positions, &[], &mut out);
        assert_eq!(grid.six_volume(out[0].six_oriented), 1.0);
        assert_eq!(grid.six_volume(out[0].six_input), -1.0);
        assert_eq!(
            (out[0].min, out[0].max, out[0].nonfinite),
            ([0.; 3], [1.; 3], false)
        );
        assert_eq!(
            (out[1].area, out[1].max, out[1].nonfinite),
            (0, [1., 0., 0.], true)
        );
    }
}
