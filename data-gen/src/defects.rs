//! A mesh with a known number of faults.
//!
//! `each` faults of every sort are put in, each at a *site*, a triangle of the mesh whose corners lie
//! in the midst of the surface. The stars of the corners of different sites share no vertex. So what
//! one fault does can be counted on its own, and the counts add up:
//!
//! | fault | what is done | counts |
//! |---|---|---|
//! | hole | the site is taken out | 3 edges become border, one loop. What was around it stays linked, by the ring of triangles around it |
//! | duplicate | the site a second time, in either direction | 3 edges become non-manifold; both copies are cut off: 2 components and 3 loops more |
//! | third triangle | one more on an edge of the site, with a new vertex | the edge becomes non-manifold; 2 border edges, one component, 2 loops more |
//! | degenerate | a triangle with a repeated vertex, anywhere | no edge |
//! | unreferenced | a vertex in no triangle | |
//!
//! Triangles that are put in first fill the places of those that were taken out, then follow the mesh:
//! so every triangle of the mesh keeps its number, and `neighbours` needs no renumbering.
//!
//! To ask whether a triangle is a site is one shift and one look: the triangle numbers are cut into
//! windows of a power of two, with at most one site each. Memory: about 200 bytes a fault.

use std::collections::BTreeSet;

use crate::Error;
use crate::hash::{mix, unit};
use crate::mesh::{Link, Mesh};
use crate::truth::Truth;

/// Steps of a walk around a vertex before it is taken for a hub.
const STAR: usize = 64;

/// Candidates that are tried in a window.
const TRIES: u64 = 4096;

#[derive(Clone, Copy, Debug)]
enum Fault {
    /// The triangle gives its place to this one.
    Hole([u64; 3]),
    Duplicate,
    /// A third triangle on the edge that this corner faces, whose other triangle is given.
    Third(usize, u64),
}

#[derive(Clone, Copy, Debug)]
struct Site {
    triangle: u64,
    fault: Fault,
}

/// The mesh with its faults.
pub struct Defects {
    base: Box<dyn Mesh>,
    truth: Truth,
    base_truth: Truth,
    each: u64,
    seed: u64,
    shift: u32,
    windows: Vec<Option<Site>>,
    /// What follows the mesh.
    added: Vec<[u64; 3]>,
    /// The edge of each third triangle, and the vertex against it.
    thirds: Vec<[u64; 3]>,
}

impl Defects {
    /// Puts `each` faults of every sort into `base`. A kind without a surface
    /// ([`Mesh::can_be_cut`]) gets degenerate triangles and unreferenced vertices only.
    pub fn new(base: Box<dyn Mesh>, each: u64, seed: u64) -> Result<Defects, Error> {
        let truth = base.truth();
        let mut mesh = Defects {
            base,
            truth: truth.clone(),
            base_truth: truth.clone(),
            each,
            seed: mix(seed, 0xFA17),
            shift: 63,
            windows: Vec::new(),
            added: Vec::new(),
            thirds: Vec::new(),
        };
        if each == 0 {
            return Ok(mesh);
        }
        let sites = if mesh.base.can_be_cut() {
            mesh.find_sites(3 * each)?
        } else {
            Vec::new()
        };
        mesh.place(&sites);
        mesh.truth = mesh.count(&sites);
        Ok(mesh)
    }

    /// Finds triangles whose surroundings share no vertex, one in each window from the first on.
    fn find_sites(&mut self, wanted: u64) -> Result<Vec<u64>, Error> {
        let triangles = self.base_truth.triangles;
        let too_small = || {
            Error::Usage(format!(
                "{triangles} triangles leave no room for {} faults of each sort: ask for fewer, or \
                 for a larger mesh",
                self.each
            ))
        };
        self.shift = (triangles / wanted).checked_ilog2().ok_or_else(too_small)?;
        let window = 1u64 << self.shift;
        let mut taken = BTreeSet::new();
        let mut sites = Vec::new();
        // There may be up to twice as many windows as sites: some may have no room.
        for start in (0..triangles / window).map(|w| w * window) {
            if sites.len() as u64 == wanted {
                break;
            }
            let from = mix(self.seed, start) % window;
            let candidates = (0..window.min(TRIES)).map(|i| start + (from + i) % window);
            let fits = |t: &u64| {
                let near = self.surroundings(*t)?;
                near.is_disjoint(&taken).then_some((*t, near))
            };
            if let Some((t, near)) = candidates.into_iter().find_map(|t| fits(&t)) {
                taken.extend(near);
                sites.push(t);
            }
        }
        if sites.len() as u64 == wanted {
            Ok(sites)
        } else {
            Err(too_small())
        }
    }

    /// The vertices of the stars of the corners of `t`, when each of them is whole and agrees in
    /// orientation.
    fn surroundings(&self, t: u64) -> Option<BTreeSet<u64>> {
        let mut near = BTreeSet::new();
        for v in self.base.triangle(t) {
            let mut at = t;
            let mut steps = 0;
            loop {
                let corners = self.base.triangle(at);
                near.extend(corners);
                let k = corners.iter().position(|&c| c == v)?;
                let link = self.base.neighbours(at)[(k + 1) % 3]?;
                steps += 1;
                if link.reversed || steps > STAR {
                    return None;
                }
                at = link.triangle;
                if at == t {
                    break;
                }
            }
        }
        Some(near)
    }

    /// Makes the triangles that are put in, and gives the sites their faults: of each three sites the
    /// first is a hole, the second has a duplicate, the third a third triangle on an edge.
    fn place(&mut self, sites: &[u64]) {
        let mut put_in = Vec::new();
        self.windows = vec![None; (self.base_truth.triangles >> self.shift) as usize + 1];
        let mut threes = sites.chunks_exact(3);
        for f in 0..self.each {
            let pick = mix(self.seed, 2 * f + 1);
            let [a, b, _] = self.base.triangle(pick % self.base_truth.triangles);
            put_in.push([[a, a, b], [a, b, a], [b, a, a], [a, a, a]][(f % 4) as usize]);
            if let Some(three) = threes.next() {
                put_in.push(self.duplicate(three[1], f));
                put_in.push(self.third(three[2], f));
            }
        }
        let holes = sites.len() / 3;
        self.added = put_in.split_off(holes);
        for (three, triangle) in sites.chunks_exact(3).zip(put_in) {
            self.set(three[0], Fault::Hole(triangle));
        }
    }

    fn duplicate(&mut self, site: u64, f: u64) -> [u64; 3] {
        self.set(site, Fault::Duplicate);
        let mut copy = self.base.triangle(site);
        if f % 2 == 1 {
            copy.swap(0, 1);
        }
        copy
    }

    fn third(&mut self, site: u64, f: u64) -> [u64; 3] {
        let k = (mix(self.seed, 2 * f) % 3) as usize;
        if let Some(link) = self.base.neighbours(site)[k] {
            self.set(site, Fault::Third(k, link.triangle));
        }
        let corners = self.base.triangle(site);
        let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        self.thirds.push([a, b, corners[k]]);
        [a, b, self.base_truth.vertices + f]
    }

    fn set(&mut self, triangle: u64, fault: Fault) {
        self.windows[(triangle >> self.shift) as usize] = Some(Site { triangle, fault });
    }

    fn fault(&self, t: u64) -> Option<Fault> {
        let site = self
            .windows
            .get((t >> self.shift) as usize)
            .copied()
            .flatten()?;
        (site.triangle == t).then_some(site.fault)
    }

    /// The sums of the table in the module's text.
    fn count(&self, sites: &[u64]) -> Truth {
        let base = &self.base_truth;
        let (f, cuts) = (self.each, self.thirds.len() as u64);
        let opened: BTreeSet<u64> = sites.iter().map(|&t| self.base.component(t)).collect();
        Truth {
            triangles: base.triangles + self.added.len() as u64,
            vertices: base.vertices + cuts + f,
            distinct_edges: base.distinct_edges + 2 * cuts,
            border_edges: base.border_edges + 5 * cuts,
            border_loops: base.border_loops + 6 * cuts,
            nonmanifold_edges: base.nonmanifold_edges + 4 * cuts,
            nonmanifold_vertices: base.nonmanifold_vertices + 5 * cuts,
            components: base.components + 3 * cuts,
            closed_components: base.closed_components.saturating_sub(opened.len() as u64),
            degenerate: base.degenerate + f,
            duplicate: base.duplicate + cuts,
            unreferenced: base.unreferenced + f,
            ..base.clone()
        }
    }

    /// The new vertex of a third triangle: off the middle of its edge, as far as the edge is long.
    fn third_vertex(&self, [a, b, c]: [u64; 3]) -> [f64; 3] {
        let [a, b, c] = [a, b, c].map(|v| self.base.position(v));
        let from = |p: [f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
        let (u, w) = (from(b), from(c));
        let normal = [
            u[1] * w[2] - u[2] * w[1],
            u[2] * w[0] - u[0] * w[2],
            u[0] * w[1] - u[1] * w[0],
        ];
        let length = |p: [f64; 3]| p.iter().map(|c| c * c).sum::<f64>().sqrt();
        let scale = length(u) / length(normal).max(f64::MIN_POSITIVE);
        std::array::from_fn(|k| a[k] + 0.5 * u[k] + scale * normal[k])
    }
}

impl Mesh for Defects {
    fn truth(&self) -> Truth {
        self.truth.clone()
    }

    fn triangle(&self, t: u64) -> [u64; 3] {
        match self.fault(t) {
            Some(Fault::Hole(instead)) => instead,
            _ if t >= self.base_truth.triangles => {
                self.added[(t - self.base_truth.triangles) as usize]
            }
            _ => self.base.triangle(t),
        }
    }

    fn position(&self, v: u64) -> [f64; 3] {
        let base = self.base_truth.vertices;
        if v < base {
            return self.base.position(v);
        }
        match self.thirds.get((v - base) as usize) {
            Some(&third) => self.third_vertex(third),
            None => {
                // An unreferenced vertex: somewhere inside.
                let scale = 0.5 + 0.25 * unit(mix(self.seed, !v));
                self.base
                    .position(mix(self.seed, v) % base)
                    .map(|c| scale * c)
            }
        }
    }

    fn neighbours(&self, t: u64) -> [Option<Link>; 3] {
        let fault = self.fault(t);
        if t >= self.base_truth.triangles
            || matches!(fault, Some(Fault::Hole(_) | Fault::Duplicate))
        {
            return [None; 3];
        }
        let mut links = self.base.neighbours(t);
        if let Some(Fault::Third(k, _)) = fault {
            links[k] = None;
        }
        links.map(|link| match self.fault(link?.triangle) {
            Some(Fault::Hole(_) | Fault::Duplicate) => None,
            Some(Fault::Third(_, other)) if other == t => None,
            _ => link,
        })
    }

    fn component(&self, t: u64) -> u64 {
        self.base.component(t)
    }

    fn across(&self, i: u64) -> u64 {
        if i < self.base_truth.triangles {
            self.base.across(i)
        } else {
            i
        }
    }

    fn can_be_cut(&self) -> bool {
        false
    }

    fn survives_welding(&self) -> bool {
        self.base.survives_welding()
    }
}
