//! A displaced sphere: the octahedron with each face divided into n^2 triangles, blown up to a ball
//! and displaced along the radius by fractal noise.
//!
//! Vertices are the integer points with |x| + |y| + |z| = n. They are numbered in rings from pole to
//! pole: ring k (0..=2n) lies at z = n - k and has four sides of s = min(k, 2n - k) vertices each (a
//! pole: one vertex). Band k lies between the rings k and k + 1; each of its four sides is a strip of
//! 2w + 1 triangles, where w is the shorter of the two sides, that begins and ends with a triangle
//! whose base is on the longer ring:
//!
//! ```text
//!    ring k      o---o---o           even places: base on the longer ring
//!               / \ / \ / \          odd places: base on the shorter ring
//!    ring k+1  o---o---o---o
//! ```
//!
//! So T = 8n^2, V = 4n^2 + 2, E = 12n^2. Along a band each triangle has the one before and the one
//! after as neighbours; only the third neighbour is in another band.
//!
//! The displacement moves a vertex along its own ray, so the surface stays star-shaped: embedded, and
//! outward wherever the octahedron was.

use crate::mesh::{Link, Mesh};
use crate::noise::Noise;
use crate::truth::Truth;

/// The combinatorics: an octahedron whose edges are divided into `n`.
#[derive(Clone, Copy, Debug)]
pub struct Rings {
    /// Segments of an octahedron edge, at least 1.
    pub n: u64,
}

/// A triangle's place: in band `band`, on side `side`, the `place`-th of the strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    band: u64,
    side: u64,
    place: u64,
}

impl Rings {
    /// Number of triangles.
    pub fn triangles(self) -> u64 {
        8 * self.n * self.n
    }

    /// Number of vertices.
    pub fn vertices(self) -> u64 {
        4 * self.n * self.n + 2
    }

    /// Vertices on one side of ring `k`.
    fn side(self, k: u64) -> u64 {
        k.min(2 * self.n - k)
    }

    /// The first vertex of ring `k`.
    fn ring_start(self, k: u64) -> u64 {
        if k == 0 {
            0
        } else if k <= self.n {
            1 + 2 * k * (k - 1)
        } else {
            let s = 2 * self.n - k;
            self.vertices() - 1 - 2 * s * (s + 1)
        }
    }

    /// Shorter side of the two rings of a band.
    fn width(self, band: u64) -> u64 {
        band.min(2 * self.n - 1 - band)
    }

    fn band_start(self, band: u64) -> u64 {
        if band <= self.n {
            4 * band * band
        } else {
            let rest = 2 * self.n - band;
            self.triangles() - 4 * rest * rest
        }
    }

    fn place(self, t: u64) -> Place {
        let half = self.triangles() / 2;
        let band = if t < half {
            root(t / 4)
        } else {
            2 * self.n - 1 - root((self.triangles() - 1 - t) / 4)
        };
        let strip = 2 * self.width(band) + 1;
        let along = t - self.band_start(band);
        let side = quarter(along, strip);
        Place {
            band,
            side,
            place: along - side * strip,
        }
    }

    fn index(self, p: Place) -> u64 {
        self.band_start(p.band) + p.side * (2 * self.width(p.band) + 1) + p.place
    }

    /// The vertex at place `along` (up to one round) of ring `k`.
    fn vertex(self, k: u64, along: u64) -> u64 {
        let round = (4 * self.side(k)).max(1);
        let along = if along >= round { along - round } else { along };
        self.ring_start(k) + along
    }

    /// The corners of triangle `t`, counterclockwise from outside.
    pub fn triangle(self, t: u64) -> [u64; 3] {
        let Place { band, side, place } = self.place(t);
        let i = place / 2;
        let upper = |j| self.vertex(band, side * self.side(band) + j);
        let lower = |j| self.vertex(band + 1, side * self.side(band + 1) + j);
        match (band < self.n, place % 2 == 0) {
            (true, true) => [upper(i), lower(i), lower(i + 1)],
            (true, false) => [upper(i), lower(i + 1), upper(i + 1)],
            (false, true) => [upper(i), lower(i), upper(i + 1)],
            (false, false) => [upper(i + 1), lower(i), lower(i + 1)],
        }
    }

    /// The triangle after `t` along its band.
    pub(crate) fn next(self, t: u64) -> u64 {
        self.beside(t, self.place(t).band)[1]
    }

    /// The triangle before `t` along its band.
    pub(crate) fn before(self, t: u64) -> u64 {
        self.beside(t, self.place(t).band)[0]
    }

    fn beside(self, t: u64, band: u64) -> [u64; 2] {
        let (start, end) = (self.band_start(band), self.band_start(band + 1));
        let next = if t + 1 == end { start } else { t + 1 };
        let before = if t == start { end - 1 } else { t - 1 };
        [before, next]
    }

    /// Whether `t` lies above the equator.
    pub(crate) fn is_upper(self, t: u64) -> bool {
        t < self.triangles() / 2
    }

    /// The corner of `t` that faces the edge on a ring.
    pub(crate) fn base(self, t: u64) -> usize {
        let even = self.place(t).place.is_multiple_of(2);
        usize::from(self.is_upper(t) != even)
    }

    /// The triangles of places 2i and 2i + 1 of a strip, of which `t` is one; the last of a strip
    /// is in no quad.
    pub(crate) fn quad(self, t: u64) -> Option<[u64; 2]> {
        let Place { band, place, .. } = self.place(t);
        match place % 2 {
            1 => Some([t - 1, t]),
            _ if place == 2 * self.width(band) => None,
            _ => Some([t, t + 1]),
        }
    }

    /// The neighbours across the edges that face the three corners of `t`.
    pub fn neighbours(self, t: u64) -> [u64; 3] {
        let p = self.place(t);
        let [before, next] = self.beside(t, p.band);
        // The base on the longer ring is shared with the band beyond that ring: there it is the base
        // of an odd place, or across the equator of an even one. And the other way round.
        let even = p.place.is_multiple_of(2);
        let down = (p.band < self.n) == even;
        let band = if down { p.band + 1 } else { p.band - 1 };
        let equator = (band < self.n) != (p.band < self.n);
        let place = match (even, equator) {
            (_, true) => p.place,
            (true, false) => p.place + 1,
            (false, false) => p.place - 1,
        };
        let beyond = self.index(Place { band, place, ..p });
        match (p.band < self.n, even) {
            (true, true) | (false, false) => [beyond, next, before],
            _ => [next, beyond, before],
        }
    }

    /// The integer point of vertex `v`.
    pub fn point(self, v: u64) -> [i64; 3] {
        let last = self.vertices() - 1;
        let k = if v < self.ring_start(self.n + 1) {
            ring_of(v)
        } else {
            2 * self.n - ring_of(last - v)
        };
        let s = self.side(k);
        let along = v - self.ring_start(k);
        let side = quarter(along, s);
        let i = (along - side * s) as i64;
        let (a, b) = (s as i64 - i, i);
        let (x, y) = match side {
            0 => (a, b),
            1 => (-b, a),
            2 => (-a, -b),
            _ => (b, -a),
        };
        [x, y, self.n as i64 - k as i64]
    }

    /// The vertex at an integer point.
    fn vertex_at(self, [x, y, z]: [i64; 3]) -> u64 {
        let k = (self.n as i64 - z) as u64;
        self.ring_start(k) + self.along(k, x, y)
    }

    /// Place along ring `k` of the point (x, y).
    fn along(self, k: u64, x: i64, y: i64) -> u64 {
        let s = self.side(k);
        match (x, y) {
            (0, 0) => 0,
            (1.., 0..) => y as u64,
            (..=0, 1..) => s + (-x) as u64,
            (..=-1, ..=0) => 2 * s + (-y) as u64,
            _ => 3 * s + x as u64,
        }
    }

    /// The `i`-th triangle when the rings are laid around the x axis instead, by descending x: turning
    /// the octahedron so that z becomes x maps its triangles onto themselves.
    pub fn across(self, i: u64) -> u64 {
        let corners = self.triangle(i).map(|v| {
            let [x, y, z] = self.point(v);
            self.vertex_at([z, x, y])
        });
        let ring = corners.map(|v| (self.n as i64 - self.point(v)[2]) as u64);
        let band = ring[0].min(ring[1]).min(ring[2]);
        // Two corners share a ring: their edge is the base, and the earlier of them tells the place.
        let k = (0..3)
            .find(|&k| ring[(k + 1) % 3] == ring[(k + 2) % 3])
            .unwrap_or(0);
        let (base, a, b) = (
            ring[(k + 1) % 3],
            corners[(k + 1) % 3],
            corners[(k + 2) % 3],
        );
        let (low, high) = (a.min(b), a.max(b));
        let from = if high - low == 1 { low } else { high };
        let s = self.side(base);
        let along = from - self.ring_start(base);
        let side = quarter(along, s);
        let odd = u64::from(s == self.width(band));
        self.index(Place {
            band,
            side,
            place: 2 * (along - side * s) + odd,
        })
    }

    /// Counts of this surface.
    pub fn truth(self) -> Truth {
        Truth {
            triangles: self.triangles(),
            vertices: self.vertices(),
            distinct_edges: self.triangles() / 2 * 3,
            components: 1,
            components_joined: 1,
            closed_components: 1,
            ..Truth::default()
        }
    }
}

/// Which of four equal parts of length `part` a place is in.
fn quarter(along: u64, part: u64) -> u64 {
    if part == 0 {
        return 0;
    }
    u64::from(along >= part) + u64::from(along >= 2 * part) + u64::from(along >= 3 * part)
}

/// The integer square root; the float root is off by one at most for x below 2^63.
fn root(x: u64) -> u64 {
    // Signed casts: one instruction each, where unsigned ones branch.
    let r = (x as i64 as f64).sqrt() as i64 as u64;
    if r * r > x {
        r - 1
    } else if (r + 1) * (r + 1) <= x {
        r + 1
    } else {
        r
    }
}

/// The ring k of vertex `v` of the upper half: the last k with 1 + 2k(k - 1) <= v.
fn ring_of(v: u64) -> u64 {
    if v == 0 {
        0
    } else {
        root(2 * v - 1).div_ceil(2)
    }
}

/// The displaced sphere, of radius about 1.
#[derive(Clone, Debug)]
pub struct Sphere {
    rings: Rings,
    noise: Noise,
}

/// The greatest displacement, as a part of the radius.
pub const RELIEF: f64 = 0.25;

impl Sphere {
    /// A sphere of `8 n^2` triangles.
    pub fn new(n: u64, seed: u64) -> Sphere {
        Sphere {
            rings: Rings { n },
            noise: Noise::new(seed),
        }
    }

    /// Its combinatorics.
    pub(crate) fn rings(&self) -> Rings {
        self.rings
    }
}

/// The direction of an integer point, as a unit vector.
pub fn direction(point: [i64; 3]) -> [f64; 3] {
    let [x, y, z] = point.map(|c| c as f64);
    let scale = 1.0 / (x * x + y * y + z * z).sqrt();
    [x * scale, y * scale, z * scale]
}

impl Mesh for Sphere {
    fn truth(&self) -> Truth {
        self.rings.truth()
    }

    fn triangle(&self, t: u64) -> [u64; 3] {
        self.rings.triangle(t)
    }

    fn position(&self, v: u64) -> [f64; 3] {
        let d = direction(self.rings.point(v));
        let radius = 1.0 + RELIEF * self.noise.at(d);
        d.map(|c| c * radius)
    }

    fn neighbours(&self, t: u64) -> [Option<Link>; 3] {
        self.rings.neighbours(t).map(Link::to)
    }

    fn across(&self, i: u64) -> u64 {
        self.rings.across(i)
    }

    /// Rays of neighbours are at least 0.5 / n apart, and f4 resolves 1e-7 of the radius.
    fn survives_welding(&self) -> bool {
        self.rings.n < 1 << 20
    }
}
