//! Grids of quads, each cut into two triangles, with their sides glued or not: terrain, torus,
//! Moebius strip and Klein bottle.
//!
//! ```text
//!     (i,j+1) o-----o (i+1,j+1)      quad (i,j) has the triangles 2q and 2q + 1, q = j * columns + i
//!             |2q+1/|
//!             |  /  |                2q:     (i,j)  (i+1,j)    (i+1,j+1)
//!             |/ 2q |                2q + 1: (i,j)  (i+1,j+1)  (i,j+1)
//!       (i,j) o-----o (i+1,j)
//! ```
//!
//! An even triangle owns the lower and the right side of its quad, an odd one the upper and the left
//! side, so across every side of a quad lies a triangle of the other parity. That holds for glued
//! sides too, since the top is always glued to the bottom and the right side to the left one. Where the
//! glue mirrors the rows, both triangles run the same way along the seam: one reversed link a column.

use std::f64::consts::TAU;

use crate::mesh::{Link, Mesh};
use crate::noise::Noise;
use crate::truth::Truth;

/// How the sides of the grid are glued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Nothing glued: a sheet with one border, heights by noise.
    Terrain,
    /// Left to right and top to bottom; rows run around the tube.
    Torus,
    /// Top to bottom, mirrored; rows run across the strip.
    Moebius,
    /// Left to right, and top to bottom mirrored: closed, not orientable.
    Klein,
}

/// A grid of `columns` x `rows` quads.
#[derive(Clone, Debug)]
pub struct Grid {
    shape: Shape,
    columns: u64,
    rows: u64,
    noise: Noise,
}

impl Grid {
    /// A grid of that many quads; see [`Grid::least`].
    pub fn new(shape: Shape, columns: u64, rows: u64, seed: u64) -> Grid {
        Grid {
            shape,
            columns,
            rows,
            noise: Noise::new(seed),
        }
    }

    /// The fewest columns and rows with which no edge meets itself.
    pub fn least(shape: Shape) -> (u64, u64) {
        match shape {
            Shape::Terrain => (1, 1),
            Shape::Torus => (3, 3),
            Shape::Moebius => (1, 3),
            Shape::Klein => (3, 4),
        }
    }

    /// Columns and rows for about that many triangles.
    pub fn fit(shape: Shape, triangles: u64) -> (u64, u64) {
        let rows_per_column = match shape {
            Shape::Terrain => 1.0,
            Shape::Torus | Shape::Klein => 2.0,
            Shape::Moebius => 8.0,
        };
        let least = Grid::least(shape);
        let columns = (triangles as f64 / 2.0 / rows_per_column).sqrt().round() as u64;
        let columns = columns.max(least.0);
        let rows = (triangles as f64 / 2.0 / columns as f64).round() as u64;
        (columns, rows.max(least.1))
    }

    fn glued_sideways(&self) -> bool {
        matches!(self.shape, Shape::Torus | Shape::Klein)
    }

    fn mirrored(&self) -> bool {
        matches!(self.shape, Shape::Moebius | Shape::Klein)
    }

    fn vertices_in_row(&self) -> u64 {
        self.columns + u64::from(!self.glued_sideways())
    }

    fn rows_of_vertices(&self) -> u64 {
        self.rows + u64::from(self.shape == Shape::Terrain)
    }

    /// The vertex at grid point (i, j), i <= columns, j <= rows.
    fn vertex(&self, i: u64, j: u64) -> u64 {
        let (mut i, mut j) = (i, j);
        if j == self.rows && self.shape != Shape::Terrain {
            j = 0;
            if self.mirrored() {
                i = self.columns - i;
            }
        }
        if i == self.columns && self.glued_sideways() {
            i = 0;
        }
        j * self.vertices_in_row() + i
    }

    fn link(&self, i: u64, j: u64, odd: u64, reversed: bool) -> Option<Link> {
        let triangle = 2 * (j * self.columns + i) + odd;
        Some(Link { triangle, reversed })
    }

    /// The odd triangle below quad (i, j).
    fn below(&self, i: u64, j: u64) -> Option<Link> {
        match (j, self.shape) {
            (1.., _) => self.link(i, j - 1, 1, false),
            (_, Shape::Terrain) => None,
            (_, Shape::Torus) => self.link(i, self.rows - 1, 1, false),
            _ => self.link(self.columns - 1 - i, self.rows - 1, 1, true),
        }
    }

    /// The even triangle above quad (i, j).
    fn above(&self, i: u64, j: u64) -> Option<Link> {
        match self.shape {
            _ if j + 1 < self.rows => self.link(i, j + 1, 0, false),
            Shape::Terrain => None,
            Shape::Torus => self.link(i, 0, 0, false),
            _ => self.link(self.columns - 1 - i, 0, 0, true),
        }
    }

    /// The odd triangle to the right of quad (i, j).
    fn right(&self, i: u64, j: u64) -> Option<Link> {
        if i + 1 < self.columns {
            self.link(i + 1, j, 1, false)
        } else if self.glued_sideways() {
            self.link(0, j, 1, false)
        } else {
            None
        }
    }

    /// The even triangle to the left of quad (i, j).
    fn left(&self, i: u64, j: u64) -> Option<Link> {
        if i > 0 {
            self.link(i - 1, j, 0, false)
        } else if self.glued_sideways() {
            self.link(self.columns - 1, j, 0, false)
        } else {
            None
        }
    }

    fn terrain(&self, i: f64, j: f64) -> [f64; 3] {
        let extent = self.columns.max(self.rows) as f64;
        let place = [4.0 * i / extent, 4.0 * j / extent, 0.0];
        [i, j, 0.15 * extent * self.noise.at(place)]
    }

    /// The tube turns clockwise, so that the triangles face outward.
    fn torus(&self, i: f64, j: f64) -> [f64; 3] {
        let (around, tube) = (TAU * j / self.rows as f64, TAU * i / self.columns as f64);
        let at = |radius: f64| {
            let out = 1.0 + radius * tube.cos();
            [out * around.cos(), out * around.sin(), -radius * tube.sin()]
        };
        at(0.4 * (1.0 + 0.25 * self.noise.at(at(0.4))))
    }

    fn moebius(&self, i: f64, j: f64) -> [f64; 3] {
        let around = TAU * j / self.rows as f64;
        let across = 0.8 * (i / self.columns as f64 - 0.5);
        let out = 1.0 + across * (around / 2.0).cos();
        let place = [
            out * around.cos(),
            out * around.sin(),
            across * (around / 2.0).sin(),
        ];
        let scale = 1.0 + 0.1 * self.noise.at(place);
        place.map(|c| c * scale)
    }

    /// The immersion whose cross-section is an eight. It meets itself.
    fn klein(&self, i: f64, j: f64) -> [f64; 3] {
        let (around, eight) = (TAU * j / self.rows as f64, TAU * i / self.columns as f64);
        let (x, y) = (0.6 * eight.sin(), 0.6 * (2.0 * eight).sin());
        let (sin, cos) = (around / 2.0).sin_cos();
        let out = 2.0 + cos * x - sin * y;
        [out * around.cos(), out * around.sin(), sin * x + cos * y]
    }
}

impl Mesh for Grid {
    fn truth(&self) -> Truth {
        let (a, b) = (self.columns, self.rows);
        let border_edges = match self.shape {
            Shape::Terrain => 2 * (a + b),
            Shape::Moebius => 2 * b,
            Shape::Torus | Shape::Klein => 0,
        };
        let closed = border_edges == 0;
        Truth {
            triangles: 2 * a * b,
            vertices: self.vertices_in_row() * self.rows_of_vertices(),
            // Each triangle has three sides; sides on the border have no partner.
            distinct_edges: 3 * a * b + border_edges / 2,
            border_edges,
            border_loops: u64::from(!closed),
            components: 1,
            components_joined: 1,
            closed_components: u64::from(closed),
            nonorientable_components: u64::from(self.mirrored()),
            inconsistent_edges: if self.mirrored() { a } else { 0 },
            ..Truth::default()
        }
    }

    fn triangle(&self, t: u64) -> [u64; 3] {
        let q = t / 2;
        let (i, j) = (q % self.columns, q / self.columns);
        let (from, to) = (self.vertex(i, j), self.vertex(i + 1, j + 1));
        if t.is_multiple_of(2) {
            [from, self.vertex(i + 1, j), to]
        } else {
            [from, to, self.vertex(i, j + 1)]
        }
    }

    fn position(&self, v: u64) -> [f64; 3] {
        let row = self.vertices_in_row();
        let (i, j) = ((v % row) as f64, (v / row) as f64);
        match self.shape {
            Shape::Terrain => self.terrain(i, j),
            Shape::Torus => self.torus(i, j),
            Shape::Moebius => self.moebius(i, j),
            Shape::Klein => self.klein(i, j),
        }
    }

    fn neighbours(&self, t: u64) -> [Option<Link>; 3] {
        let q = t / 2;
        let (i, j) = (q % self.columns, q / self.columns);
        let twin = Link::to(t ^ 1);
        if t.is_multiple_of(2) {
            [self.right(i, j), twin, self.below(i, j)]
        } else {
            [self.above(i, j), self.left(i, j), twin]
        }
    }

    fn across(&self, i: u64) -> u64 {
        let q = i / 2;
        2 * (q % self.rows * self.columns + q / self.rows) + i % 2
    }

    /// Terrain has whole numbers for x and y, exact below 2^24. The others are of size 1: steps of
    /// TAU / 2^20 are many times what f4 resolves. The Klein bottle meets itself.
    fn survives_welding(&self) -> bool {
        let long = self.columns.max(self.rows);
        match self.shape {
            Shape::Terrain => long < 1 << 24,
            Shape::Torus | Shape::Moebius => long < 1 << 20,
            Shape::Klein => false,
        }
    }
}
