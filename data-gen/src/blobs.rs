//! Many displaced spheres of power-law sizes, each in its own cell of a lattice, so that none touch.
//!
//! Sizes come in octaves: octave c holds 2^c spheres (the last one what is left) whose octahedron
//! edges are divided into n_1 / sqrt(2^c), at least 1. So each octave has about as many triangles as
//! the next, and the number of spheres above a size falls as its inverse. A triangle's sphere follows
//! from a search among at most 64 octaves and one division.
//!
//! All triangles are about equally large. The greatest sphere reaches 0.475 from its centre, cells are
//! 1 wide: disjoint. Which cell a sphere has is a keyed bijection, so that sizes mix in space.

use crate::Error;
use crate::hash::{Permutation, mix, unit};
use crate::mesh::{Link, Mesh};
use crate::noise::Noise;
use crate::sphere::{RELIEF, Rings, direction};
use crate::truth::Truth;

/// Spheres of one size.
#[derive(Clone, Copy, Debug)]
struct Octave {
    rings: Rings,
    count: u64,
    first_blob: u64,
    first_triangle: u64,
    first_vertex: u64,
}

/// The mesh.
#[derive(Clone, Debug)]
pub struct Blobs {
    octaves: Vec<Octave>,
    cells: Permutation,
    lattice: u64,
    largest: u64,
    noise: Noise,
    seed: u64,
}

/// The size in octave `c`, when the first has `n`.
fn size(n: u64, c: usize) -> u64 {
    ((n as f64 / (c as f64 / 2.0).exp2()).round() as u64).max(1)
}

/// How many spheres each octave has.
fn counts(blobs: u64) -> Vec<u64> {
    let mut counts = Vec::new();
    let mut left = blobs;
    while left > 0 {
        let count = left.min(1 << counts.len());
        counts.push(count);
        left -= count;
    }
    counts
}

impl Blobs {
    /// `blobs` spheres with about `triangles` triangles in all.
    pub fn new(blobs: u64, triangles: u64, seed: u64) -> Result<Blobs, Error> {
        if blobs == 0 || triangles / 8 < blobs {
            return Err(Error::Usage(format!(
                "{blobs} blobs need at least 8 triangles each, so --triangles {} or more",
                8 * blobs.max(1)
            )));
        }
        let counts = counts(blobs);
        let total = |n: u64| -> u64 {
            let each = counts.iter().enumerate();
            each.map(|(c, count)| count * 8 * size(n, c).pow(2)).sum()
        };
        // The largest n whose total is not above the request: totals grow with n.
        let (mut low, mut high) = (1, (triangles as f64 / 8.0).sqrt() as u64 + 2);
        while high - low > 1 {
            let middle = low.midpoint(high);
            if total(middle) <= triangles {
                low = middle
            } else {
                high = middle
            }
        }
        let mut sizes: Vec<u64> = (0..counts.len()).map(|c| size(low, c)).collect();
        // The first octave is one sphere: it takes what is missing.
        let others = total(low) - 8 * low * low;
        sizes[0] = (((triangles - others.min(triangles)) as f64 / 8.0)
            .sqrt()
            .round() as u64)
            .max(1);
        let mut lattice = (blobs as f64).cbrt() as u64;
        while lattice.pow(3) < blobs {
            lattice += 1;
        }
        Ok(Blobs {
            octaves: octaves(&counts, &sizes),
            cells: Permutation::new(blobs, mix(seed, 0xB10B)),
            lattice,
            largest: sizes.into_iter().max().unwrap_or(1),
            noise: Noise::new(seed),
            seed,
        })
    }

    /// The octave of triangle `t`, its blob, and the first triangle of that blob.
    fn of_triangle(&self, t: u64) -> (&Octave, u64, u64) {
        let octave = last(&self.octaves, |o| o.first_triangle <= t);
        let in_octave = (t - octave.first_triangle) / octave.rings.triangles();
        let start = octave.first_triangle + in_octave * octave.rings.triangles();
        (octave, in_octave, start)
    }
}

fn octaves(counts: &[u64], sizes: &[u64]) -> Vec<Octave> {
    let (mut blob, mut triangle, mut vertex) = (0, 0, 0);
    let each = counts.iter().zip(sizes).map(|(&count, &n)| {
        let octave = Octave {
            rings: Rings { n },
            count,
            first_blob: blob,
            first_triangle: triangle,
            first_vertex: vertex,
        };
        blob += count;
        triangle += count * octave.rings.triangles();
        vertex += count * octave.rings.vertices();
        octave
    });
    each.collect()
}

/// The last octave that begins early enough; the first one always does.
fn last(octaves: &[Octave], begins: impl Fn(&Octave) -> bool) -> &Octave {
    &octaves[octaves.partition_point(begins) - 1]
}

impl Mesh for Blobs {
    fn truth(&self) -> Truth {
        let blobs = self.octaves.iter().map(|o| o.count).sum();
        let triangles = self
            .octaves
            .iter()
            .map(|o| o.count * o.rings.triangles())
            .sum();
        Truth {
            triangles,
            vertices: self
                .octaves
                .iter()
                .map(|o| o.count * o.rings.vertices())
                .sum(),
            distinct_edges: triangles / 2 * 3,
            components: blobs,
            components_joined: blobs,
            closed_components: blobs,
            ..Truth::default()
        }
    }

    fn triangle(&self, t: u64) -> [u64; 3] {
        let (octave, in_octave, start) = self.of_triangle(t);
        let first = octave.first_vertex + in_octave * octave.rings.vertices();
        octave.rings.triangle(t - start).map(|v| first + v)
    }

    fn position(&self, v: u64) -> [f64; 3] {
        let octave = last(&self.octaves, |o| o.first_vertex <= v);
        let per = octave.rings.vertices();
        let in_octave = (v - octave.first_vertex) / per;
        let blob = octave.first_blob + in_octave;
        let d = direction(
            octave
                .rings
                .point(v - octave.first_vertex - in_octave * per),
        );
        // Each sphere looks at another part of the noise.
        let salt = |k| 64.0 * unit(mix(self.seed ^ 0xB10B, 3 * blob + k));
        let relief = self
            .noise
            .at([d[0] + salt(0), d[1] + salt(1), d[2] + salt(2)]);
        let size = octave.rings.n as f64 / self.largest as f64;
        let radius = 0.38 * size * (1.0 + RELIEF * relief);
        let cell = self.cells.apply(blob);
        let l = self.lattice;
        let corner = [cell % l, cell / l % l, cell / (l * l)];
        std::array::from_fn(|k| corner[k] as f64 + 0.5 + radius * d[k])
    }

    fn neighbours(&self, t: u64) -> [Option<Link>; 3] {
        let (octave, _, start) = self.of_triangle(t);
        octave
            .rings
            .neighbours(t - start)
            .map(|u| Link::to(start + u))
    }

    fn component(&self, t: u64) -> u64 {
        let (octave, in_octave, _) = self.of_triangle(t);
        octave.first_blob + in_octave
    }

    fn across(&self, i: u64) -> u64 {
        let (octave, _, start) = self.of_triangle(i);
        start + octave.rings.across(i - start)
    }

    /// Neighbours are at least 0.14 / n apart where n is the greatest, coordinates at most the
    /// lattice's width, of which f4 resolves 6e-8.
    fn survives_welding(&self) -> bool {
        self.largest * self.lattice < 1 << 19
    }
}
