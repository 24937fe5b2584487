//! A mesh as it is written: in some order of triangles and vertex ids, some triangles flipped.
//!
//! All of it is decided by keyed bijections and by hashes of the *original* triangle number, so that
//! triangle `i` of the file is found without its predecessors, and a triangle is flipped or not
//! whatever the order.
//!
//! | order | triangle i of the file is, of T | hard because |
//! |---|---|---|
//! | coherent | i | |
//! | reversed | T - 1 - i | vertices are first seen from the last |
//! | shuffle-vertices | i | a triangle's vertices are anywhere, in G too |
//! | shuffle-triangles | P(i) | neighbours are anywhere in the file |
//! | shuffle | P(i) | both |
//! | interleaved | i / 2, or half + i / 2 for odd i | every chunk has two fronts |
//! | strips | a triangle of the i % 64-th of 64 strips | every chunk has 64 fronts, all across the vertices |
//! | sorted-x | across(i) | every chunk meets the whole range of vertices |
//!
//! P is a keyed bijection of 0..T, vertices go through one of 0..V where they are shuffled; see
//! [`Permutation`].

use clap::ValueEnum;

use crate::hash::{Permutation, mix, unit};
use crate::mesh::Mesh;
use crate::truth::Truth;

/// In which order the mesh is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Order {
    /// As the kind has it: neighbours on the surface are near in the file.
    #[default]
    Coherent,
    /// Triangles from the last to the first; vertices as they are.
    Reversed,
    /// Triangles in random order, vertices coherent.
    ShuffleTriangles,
    /// Vertices in random order, triangles coherent.
    ShuffleVertices,
    /// Both in random order, and the corners of each triangle turned (what --shuffle does).
    Shuffle,
    /// Two scans interleaved: the two halves of the mesh, triangle by triangle.
    Interleaved,
    /// Strips across: the order of sorted-x cut into 64 equal strips, one triangle of each by turns;
    /// the seed decides which strip has which turn.
    Strips,
    /// Triangles sorted by x: they run across the order of the vertices. Grids: column by column;
    /// blobs: within each blob; soup and fan have no other direction and stay as they are.
    SortedX,
}

/// How to show a mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// The order of triangles and vertices.
    pub order: Order,
    /// The probability that a triangle is flipped.
    pub flip: f64,
    /// Key of every random choice.
    pub seed: u64,
}

/// A triangle of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Its vertices.
    pub corners: [u64; 3],
    /// Its number in the mesh.
    pub source: u64,
    /// Whether it was flipped.
    pub flipped: bool,
}

/// A mesh in the order and orientation in which it is written.
pub struct View<'a> {
    mesh: &'a dyn Mesh,
    truth: Truth,
    options: Options,
    triangles: Option<Permutation>,
    vertices: Option<Permutation>,
    strips: Strips,
}

/// Strips of the order strips.
const STRIPS: usize = 64;

/// The numbers 0..count in 64 strips of consecutive ones, taken by turns.
///
/// Why it is a bijection: number i of the new order belongs to turn i % 64, so a turn comes up
/// `count / 64` times and once more when it is below `count % 64`. The strip of that turn is exactly
/// as long, and the strips lie one behind the other in a keyed order, so together they hold each
/// number once.
struct Strips {
    /// Where the strip of each turn begins.
    starts: [u64; STRIPS],
}

impl Strips {
    fn new(count: u64, key: u64) -> Strips {
        let (each, more) = (count / STRIPS as u64, count % STRIPS as u64);
        let order = Permutation::new(STRIPS as u64, key);
        let mut starts = [0; STRIPS];
        let mut at = 0;
        for turn in (0..STRIPS as u64).map(|place| order.apply(place)) {
            starts[turn as usize] = at;
            at += each + u64::from(turn < more);
        }
        Strips { starts }
    }

    fn apply(&self, i: u64) -> u64 {
        self.starts[(i % STRIPS as u64) as usize] + i / STRIPS as u64
    }
}

impl<'a> View<'a> {
    /// Shows `mesh` as `options` say.
    pub fn new(mesh: &'a dyn Mesh, options: Options) -> View<'a> {
        let truth = mesh.truth();
        let key = |salt| mix(options.seed, salt);
        let order = options.order;
        let triangles = matches!(order, Order::Shuffle | Order::ShuffleTriangles)
            .then(|| Permutation::new(truth.triangles, key(1)));
        let vertices = matches!(order, Order::Shuffle | Order::ShuffleVertices)
            .then(|| Permutation::new(truth.vertices, key(2)));
        View {
            mesh,
            strips: Strips::new(truth.triangles, key(5)),
            truth,
            options,
            triangles,
            vertices,
        }
    }

    /// The counts of the mesh before any flip; an order changes none of them.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// Whether any triangle may be flipped, so that two counts must be taken while writing.
    pub fn flips(&self) -> bool {
        self.options.flip > 0.0
    }

    /// Triangle `i` of the file.
    pub fn triangle(&self, i: u64) -> Shown {
        let source = self.source(i);
        let mut corners = self.mesh.triangle(source);
        let flipped = self.flipped(source);
        if flipped {
            corners.swap(1, 2);
        }
        if self.options.order == Order::Shuffle {
            corners.rotate_left((mix(self.options.seed ^ 3, source) % 3) as usize);
        }
        if let Some(p) = &self.vertices {
            corners = corners.map(|v| p.apply(v));
        }
        Shown {
            corners,
            source,
            flipped,
        }
    }

    /// Position of vertex `v` of the file.
    pub fn position(&self, v: u64) -> [f64; 3] {
        self.mesh.position(match &self.vertices {
            Some(p) => p.invert(v),
            None => v,
        })
    }

    /// How many regular edges between a triangle and one of greater number run in the same direction
    /// along both: summed over all triangles, each edge is asked once.
    pub fn inconsistent_edges(&self, shown: &Shown) -> u64 {
        let links = self.mesh.neighbours(shown.source);
        let wrong = links.iter().flatten().filter(|link| {
            let conflict = shown.flipped != self.flipped(link.triangle);
            link.triangle > shown.source && conflict != link.reversed
        });
        wrong.count() as u64
    }

    /// The mesh's number of the `i`-th triangle of the file.
    fn source(&self, i: u64) -> u64 {
        let count = self.truth.triangles;
        match self.options.order {
            Order::Coherent | Order::ShuffleVertices => i,
            Order::Reversed => count - 1 - i,
            Order::Interleaved if i.is_multiple_of(2) => i / 2,
            Order::Interleaved => count.div_ceil(2) + i / 2,
            Order::Strips => self.mesh.across(self.strips.apply(i)),
            Order::SortedX => self.mesh.across(i),
            Order::Shuffle | Order::ShuffleTriangles => match &self.triangles {
                Some(p) => p.apply(i),
                None => i,
            },
        }
    }

    fn flipped(&self, source: u64) -> bool {
        self.options.flip > 0.0 && unit(mix(self.options.seed ^ 4, source)) < self.options.flip
    }
}
