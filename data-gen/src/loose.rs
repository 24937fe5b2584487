//! Meshes without a surface to speak of: what is hard is their skew, not their shape.
//!
//! | kind | T triangles are | T, V, distinct edges |
//! |---|---|---|
//! | soup | apart: none touch | T, 3T, 3T |
//! | fan | around one hub, an open cone | T, T + 1, 2T |
//! | cone | the same with a base: around two hubs, closed | 2m, m + 2, 3m |
//! | book | on one edge | T, T + 2, 2T + 1 |
//! | stack | all the same triangle | T, 3, 3 |

use std::f64::consts::TAU;

use crate::hash::{mix, unit};
use crate::mesh::{Link, Mesh};
use crate::truth::Truth;

/// Which of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Triangles in the cells of a lattice.
    Soup,
    /// Hub 0, and a closed rim.
    Fan,
    /// Hub 0 above, hub 1 below, and a closed rim.
    Cone,
    /// Spine 0 - 1, and a vertex of its own for each triangle.
    Book,
    /// Triangle 0 1 2 again and again.
    Stack,
}

/// One of the forms, of some number of triangles.
#[derive(Clone, Copy, Debug)]
pub struct Loose {
    form: Form,
    triangles: u64,
    lattice: u64,
    seed: u64,
}

impl Loose {
    /// A mesh of that many triangles: rounded up to 3 where there is a rim or a non-manifold edge, a
    /// cone to an even number from 6.
    pub fn new(form: Form, triangles: u64, seed: u64) -> Loose {
        let triangles = match form {
            Form::Soup => triangles.max(1),
            Form::Cone => triangles.div_ceil(2).max(3) * 2,
            _ => triangles.max(3),
        };
        let mut lattice = (triangles as f64).cbrt() as u64;
        while lattice.pow(3) < triangles {
            lattice += 1;
        }
        Loose {
            form,
            triangles,
            lattice,
            seed,
        }
    }

    /// Vertices of the rim.
    fn rim(&self) -> u64 {
        if self.form == Form::Cone {
            self.triangles / 2
        } else {
            self.triangles
        }
    }

    /// Corner k keeps 0.4 more of coordinate k than the others can reach, and all keep away from the
    /// walls of the cell, so that no two vertices coincide.
    fn in_cell(&self, t: u64, k: usize) -> [f64; 3] {
        let l = self.lattice;
        let cell = [t % l, t / l % l, t / (l * l)];
        std::array::from_fn(|axis| {
            let jitter = unit(mix(self.seed, 9 * t + 3 * k as u64 + axis as u64));
            let own = if axis == k { 0.4 } else { 0.0 };
            cell[axis] as f64 + 0.2 + own + 0.25 * jitter
        })
    }

    /// A crown: heights rise like a saw over 4096 vertices, so that neighbours differ in height where
    /// f4 can no longer tell their angles apart.
    fn on_rim(&self, j: u64) -> [f64; 3] {
        let around = TAU * j as f64 / self.rim() as f64;
        [around.cos(), around.sin(), (j % 4096) as f64 / 8192.0]
    }
}

impl Mesh for Loose {
    fn truth(&self) -> Truth {
        let t = self.triangles;
        let none = Truth {
            triangles: t,
            components: 1,
            components_joined: 1,
            ..Truth::default()
        };
        let apart = Truth {
            components: t,
            border_loops: t,
            ..none.clone()
        };
        match self.form {
            Form::Soup => Truth {
                vertices: 3 * t,
                distinct_edges: 3 * t,
                border_edges: 3 * t,
                components_joined: t,
                ..apart
            },
            Form::Fan => Truth {
                vertices: t + 1,
                distinct_edges: 2 * t,
                border_edges: t,
                border_loops: 1,
                ..none
            },
            Form::Cone => Truth {
                vertices: t / 2 + 2,
                distinct_edges: t / 2 * 3,
                closed_components: 1,
                ..none
            },
            Form::Book => Truth {
                vertices: t + 2,
                distinct_edges: 2 * t + 1,
                border_edges: 2 * t,
                nonmanifold_edges: 1,
                nonmanifold_vertices: 2,
                ..apart
            },
            Form::Stack => Truth {
                vertices: 3,
                distinct_edges: 3,
                nonmanifold_edges: 3,
                nonmanifold_vertices: 3,
                duplicate: t - 1,
                ..apart
            },
        }
    }

    fn triangle(&self, t: u64) -> [u64; 3] {
        let rim = self.rim();
        let after = |j: u64| if j + 1 == rim { 0 } else { j + 1 };
        match self.form {
            Form::Soup => [3 * t, 3 * t + 1, 3 * t + 2],
            Form::Fan => [0, 1 + t, 1 + after(t)],
            Form::Cone if t < rim => [0, 2 + t, 2 + after(t)],
            Form::Cone => [1, 2 + after(t - rim), 2 + t - rim],
            Form::Book => [0, 1, 2 + t],
            Form::Stack => [0, 1, 2],
        }
    }

    fn position(&self, v: u64) -> [f64; 3] {
        match (self.form, v) {
            (Form::Soup, _) => self.in_cell(v / 3, (v % 3) as usize),
            (Form::Fan | Form::Cone | Form::Book, 0) => [0.0, 0.0, 1.0],
            (Form::Cone | Form::Book, 1) => [0.0, 0.0, -1.0],
            (Form::Fan, _) => self.on_rim(v - 1),
            (Form::Cone | Form::Book, _) => self.on_rim(v - 2),
            (Form::Stack, _) => [f64::from(v == 0), f64::from(v == 1), f64::from(v == 2)],
        }
    }

    fn neighbours(&self, t: u64) -> [Option<Link>; 3] {
        let rim = self.rim();
        let lower = t >= rim;
        let (base, j) = if lower { (rim, t - rim) } else { (0, t) };
        let next = Link::to(base + if j + 1 == rim { 0 } else { j + 1 });
        let before = Link::to(base + if j == 0 { rim - 1 } else { j - 1 });
        match self.form {
            Form::Fan => [None, next, before],
            // Seen from below the rim runs backward.
            Form::Cone if lower => [Link::to(j), before, next],
            Form::Cone => [Link::to(rim + j), next, before],
            Form::Soup | Form::Book | Form::Stack => [None; 3],
        }
    }

    fn component(&self, t: u64) -> u64 {
        if matches!(self.form, Form::Fan | Form::Cone) {
            0
        } else {
            t
        }
    }

    fn can_be_cut(&self) -> bool {
        false
    }

    /// The soup's lattice has cells of 1; vertices of the rim at the same height are 4096 apart.
    fn survives_welding(&self) -> bool {
        match self.form {
            Form::Soup => self.lattice < 1 << 20,
            _ => self.triangles < 1 << 33,
        }
    }
}
