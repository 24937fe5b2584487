//! A displaced sphere, some of whose diagonals are turned: vertices of every valence from 3 to 9.
//!
//! In a strip of the sphere (see [`sphere`](crate::sphere)) the triangles of places 2i and 2i + 1
//! form a quad. Turning its diagonal replaces the two triangles by the two others of that quad:
//!
//! ```text
//!      a-------d            a-------d
//!       \ \   1 \            \  0 / \        boundary a c b d either way;
//!        \ 0 \   \            \ /  1 \       below the equator mirrored
//!         c-------b            c-------b
//! ```
//!
//! Why the counts stay those of the sphere: quads share no triangle, so a turn changes nothing but
//! its own diagonal, and the new one joins vertices that no other edge joins. They could be joined
//! only around a vertex of valence 4, a corner of the octahedron, and no diagonal ends there; or in
//! an octahedron divided into fewer than 4, which is left as it is.
//!
//! Why neighbours need no search: of a quad's four sides, the two along the strip stay with their
//! triangle, and the two on the rings, the bases, change to the other one.
//!
//! A quad lies in one face of the octahedron and is a parallelogram there, so the surface stays
//! star-shaped, outward as it was.

use crate::Error;
use crate::hash::{mix, unit};
use crate::mesh::{Link, Mesh};
use crate::sphere::{Rings, Sphere};
use crate::truth::Truth;

/// Below this, turned diagonals could coincide.
const LEAST: u64 = 4;

/// The sphere with turned diagonals.
#[derive(Clone, Debug)]
pub struct Turned {
    base: Sphere,
    share: f64,
    seed: u64,
}

impl Turned {
    /// Turns each diagonal of a sphere of `8 n^2` triangles with the probability `share`.
    pub fn new(n: u64, share: f64, seed: u64) -> Result<Turned, Error> {
        if n < LEAST {
            return Err(Error::Usage(format!(
                "--diagonals: a sphere of --size {LEAST} or more is needed"
            )));
        }
        if !(0.0..=1.0).contains(&share) {
            let text = format!("--diagonals {share}: a probability is expected, 0 to 1");
            return Err(Error::Usage(text));
        }
        Ok(Turned {
            base: Sphere::new(n, seed),
            share,
            seed,
        })
    }

    fn rings(&self) -> Rings {
        self.base.rings()
    }

    /// The two triangles of the quad of `t`, the even place first, when its diagonal is turned.
    fn turned(&self, t: u64) -> Option<[u64; 2]> {
        let quad = self.rings().quad(t)?;
        (unit(mix(self.seed ^ 0xD1A6, quad[0])) < self.share).then_some(quad)
    }

    /// The triangle that has the base of `t` now.
    fn owner(&self, t: u64) -> u64 {
        match self.turned(t) {
            Some([even, odd]) if t == even => odd,
            Some([even, _]) => even,
            None => t,
        }
    }
}

impl Mesh for Turned {
    fn truth(&self) -> Truth {
        self.base.truth()
    }

    fn triangle(&self, t: u64) -> [u64; 3] {
        let Some([even, odd]) = self.turned(t) else {
            return self.base.triangle(t);
        };
        let (first, second) = (self.rings().triangle(even), self.rings().triangle(odd));
        if self.rings().is_upper(even) {
            let ([a, c, b], d) = (first, second[2]);
            if t == even { [a, c, d] } else { [c, b, d] }
        } else {
            let ([p, q, r], s) = (first, second[2]);
            if t == even { [p, q, s] } else { [p, s, r] }
        }
    }

    fn position(&self, v: u64) -> [f64; 3] {
        self.base.position(v)
    }

    fn neighbours(&self, t: u64) -> [Option<Link>; 3] {
        let Some([even, odd]) = self.turned(t) else {
            let base = self.rings().base(t);
            let mut links = self.rings().neighbours(t);
            links[base] = self.owner(links[base]);
            return links.map(Link::to);
        };
        let beyond = |t| self.owner(self.rings().neighbours(t)[self.rings().base(t)]);
        let (before, next) = (self.rings().before(even), self.rings().next(odd));
        let links = match (self.rings().is_upper(even), t == even) {
            (true, true) => [odd, beyond(odd), before],
            (true, false) => [next, even, beyond(even)],
            (false, true) => [beyond(odd), odd, before],
            (false, false) => [next, beyond(even), even],
        };
        links.map(Link::to)
    }

    fn across(&self, i: u64) -> u64 {
        self.base.across(i)
    }

    fn survives_welding(&self) -> bool {
        self.base.survives_welding()
    }
}
