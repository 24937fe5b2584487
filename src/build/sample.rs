//! What a mesh is like, as some stretches of its triangles tell: for predictions.
//!
//! Why a few stretches tell it: what a build spills depends on the vertices that a chunk shares
//! with others, and a mesh is mostly in one order throughout. A stretch as long as a chunk is taken
//! for one, and what the chunk pass would do with it is counted; of longer chunks it tells how
//! that grows with the length: not at all in rows of a grid, as a root in patches, in proportion
//! in no order. A vertex that a great part of the triangles name shows in every stretch.
//!
//! Memory: 150 bytes for each triangle of a stretch, which is no longer than a chunk. I/O: twice
//! 262144 triangles, or less.

use super::way::BLOCK;
use crate::chunk::ids::NARROW_SPAN;
use crate::error::Result;
use crate::input::Look;
use std::ops::AddAssign;

/// Triangles that are looked at, about.
const LOOKED: u64 = 4 * BLOCK;
/// Stretches at most.
const MOST: u64 = 64;
/// A vertex that one of so many triangles names is a hub.
const HUB: u64 = 16;

/// What a chunk leaves to others.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rim {
    /// Vertices that it shares with other chunks.
    pub vertices: f64,
    /// Corners that face an edge between two of them.
    pub corners: f64,
    /// Parts of fans at them.
    pub parts: f64,
    /// Local components.
    pub locals: f64,
    /// Triangles that may have twins elsewhere.
    pub twins: f64,
}

impl Rim {
    fn each(self, by: impl Fn(f64) -> f64) -> Rim {
        Rim {
            vertices: by(self.vertices),
            corners: by(self.corners),
            parts: by(self.parts),
            locals: by(self.locals),
            twins: by(self.twins),
        }
    }
}

impl AddAssign for Rim {
    fn add_assign(&mut self, more: Rim) {
        self.vertices += more.vertices;
        self.corners += more.corners;
        self.parts += more.parts;
        self.locals += more.locals;
        self.twins += more.twins;
    }
}

/// Shares of the triangles at hubs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hubs {
    /// Number of hubs.
    pub number: u64,
    /// Triangles with a corner at one.
    pub met: f64,
    /// Triangles with an edge between two.
    pub knotted: f64,
    /// Corners at hubs, for each triangle.
    pub corners: f64,
    /// Corners that face an edge between two, for each triangle.
    pub knots: f64,
}

impl Hubs {
    /// Share of the triangles that have three corners at hubs.
    pub fn enclosed(&self) -> f64 {
        ((self.knots - self.knotted) / 2.0).max(0.0)
    }

    fn add(&mut self, more: &Hubs, share: f64) {
        self.number = more.number;
        self.met += share * more.met;
        self.knotted += share * more.knotted;
        self.corners += share * more.corners;
        self.knots += share * more.knots;
    }
}

/// What a mesh is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nature {
    /// Triangles that were looked at; none when the nature is a guess.
    pub looked: u64,
    /// Consecutive triangles hardly share vertices.
    pub scattered: bool,
    /// Share of the stretches whose vertices lie far apart in G.
    pub far: f64,
    /// What its hubs are like.
    pub hubs: Hubs,
    /// Triangles of a stretch, and what it leaves to others.
    stretch: u64,
    rim: Rim,
    /// The power with which that grows with the stretch.
    growth: f64,
}

impl Nature {
    /// Rows of a surface of so many triangles, near in the file and in space.
    pub fn coherent(triangles: u64) -> Nature {
        // Two rows, on the side of the surface that is the longer one, twice as long as they are.
        let row = (triangles as f64).sqrt();
        Nature {
            looked: 0,
            scattered: false,
            far: 0.0,
            hubs: Hubs::default(),
            stretch: 1,
            rim: Rim {
                vertices: 2.0 * row,
                corners: 4.0 * row,
                parts: 2.0 * row,
                locals: 16.0,
                twins: 0.0,
            },
            growth: 0.0,
        }
    }

    /// No order at all.
    pub fn random() -> Nature {
        Nature {
            looked: 0,
            scattered: true,
            far: 1.0,
            hubs: Hubs::default(),
            stretch: 1,
            rim: Rim {
                vertices: 3.0,
                corners: 3.0,
                parts: 3.0,
                locals: 1.0,
                twins: 1.0,
            },
            growth: 1.0,
        }
    }

    /// No order at all around two vertices that share no edge, or, `knotted`, the same triangle again
    /// and again.
    pub fn crowd(knotted: bool) -> Nature {
        let [knots, corners] = if knotted { [3.0, 3.0] } else { [0.0, 1.0] };
        Nature {
            hubs: Hubs {
                number: 3,
                met: 1.0,
                knotted: f64::from(u8::from(knotted)),
                corners,
                knots,
            },
            ..Nature::random()
        }
    }

    /// What some stretches of the triangles tell, of a mesh of so many vertices that is cut into
    /// chunks of so many triangles.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn of(look: &mut Look, vertices: u64, chunk: u64) -> Result<Nature> {
        let t = look.triangles();
        let count = BLOCK.min(chunk).min(t);
        let mut stretch = Stretch {
            uses: 3.0 * t as f64 / vertices.max(1) as f64,
            ..Stretch::default()
        };
        let stretches = (LOOKED / count.max(1)).clamp(4, MOST);
        let begins = (0..stretches).map(|i| (t - count) * i / (stretches - 1));
        let mut rows = Vec::new();
        let (mut looked, mut distinct, mut far, mut frequent) = (0, 0, 0, Vec::new());
        for first in begins.clone() {
            look.read(first, count, &mut rows)?;
            stretch.take(&rows);
            looked += rows.len() as u64;
            distinct += stretch.distinct();
            let apart = stretch.span() >= NARROW_SPAN * count + 64;
            far += u64::from(apart && !look.by_position());
            frequent.extend(stretch.frequent(count.div_ceil(HUB).max(8)));
        }
        frequent.sort_unstable();
        let hubs = frequent.chunk_by(|a, b| a.0 == b.0).filter_map(|same| {
            let uses: u64 = same.iter().map(|(_, uses)| uses).sum();
            (HUB * uses >= looked).then_some(same[0].0)
        });
        stretch.hubs = hubs.collect();
        let (mut rim, mut half, mut hubs) = (Rim::default(), Rim::default(), Hubs::default());
        for first in begins {
            look.read(first, count, &mut rows)?;
            half += stretch.rim(&rows[..rows.len() / 2]);
            rim += stretch.rim(&rows);
            hubs.add(&stretch.at_hubs(&rows), 1.0 / stretches as f64);
        }
        let growth = match half.corners > 0.0 {
            true => (rim.corners / half.corners).log2().clamp(0.0, 1.0),
            false => 0.0,
        };
        Ok(Nature {
            looked,
            scattered: 10 * distinct > 6 * 3 * looked,
            far: far as f64 / stretches as f64,
            hubs,
            // About as many, where about as many lie.
            stretch: (looked / stretches).max(1),
            rim: rim.each(|x| x / stretches as f64),
            growth,
        })
    }

    /// What a chunk of so many triangles leaves to others.
    pub fn rim(&self, chunk: u64) -> Rim {
        let by = (chunk as f64 / self.stretch as f64).powf(self.growth);
        self.rim.each(|x| (x * by).min(3.0 * chunk as f64))
    }
}

/// An edge: its smaller and its larger vertex.
type Edge = [u64; 2];

fn edges([a, b, c]: [u64; 3]) -> [Edge; 3] {
    [(a, b), (b, c), (c, a)].map(|(x, y)| [x.min(y), x.max(y)])
}

/// One stretch; buffers are reused.
#[derive(Default)]
struct Stretch {
    /// Triangles of a vertex in the whole mesh, on average.
    uses: f64,
    /// Hubs, ascending.
    hubs: Vec<u64>,
    ids: Vec<u64>,
    edges: Vec<Edge>,
    /// Vertices that are shared with others, ascending.
    rim: Vec<u64>,
    /// Edges between two triangles that the stretch settles, ascending.
    settled: Vec<Edge>,
}

impl Stretch {
    fn take(&mut self, rows: &[[u64; 3]]) {
        self.ids.clear();
        self.ids.extend(rows.as_flattened());
        self.ids.sort_unstable();
    }

    /// What these triangles leave to others.
    fn rim(&mut self, rows: &[[u64; 3]]) -> Rim {
        self.take(rows);
        self.edges.clear();
        self.edges.extend(rows.iter().flat_map(|&row| edges(row)));
        self.edges.sort_unstable();
        self.find_rim();
        let on = |v: &u64| self.rim.binary_search(v).is_ok();
        let mut found = Rim {
            vertices: self.rim.len() as f64,
            parts: self.ids.iter().filter(|v| on(v)).count() as f64,
            ..Rim::default()
        };
        self.settled.clear();
        for same in self.edges.chunk_by(|a, b| a == b) {
            match same[0].iter().filter(|v| on(v)).count() {
                2 => found.corners += same.len() as f64,
                some if same.len() == 2 => {
                    // The two triangles hang together at the vertex of the rim.
                    found.parts -= some as f64;
                    self.settled.push(same[0]);
                }
                _ => {}
            }
        }
        let settled = |edge: &Edge| self.settled.binary_search(edge).is_ok();
        for &row in rows {
            found.locals += f64::from(u8::from(!edges(row).iter().any(settled)));
            found.twins += f64::from(u8::from(row.iter().all(on)));
        }
        found.locals += 1.0;
        found
    }

    /// The hubs, and the vertices on edges with one triangle here: unless hardly a use of them is
    /// missing, so that those are borders of the mesh.
    fn find_rim(&mut self) {
        self.rim.clone_from(&self.hubs);
        let single = self.edges.chunk_by(|a, b| a == b);
        let single = single.filter(|same| same.len() == 1).map(|same| same[0]);
        self.rim.extend(single.flatten());
        let many = (self.rim.len() - self.hubs.len()) as f64 / 2.0;
        let missing = self.distinct() as f64 * self.uses - self.ids.len() as f64;
        if 2.0 * missing < many {
            self.rim.truncate(self.hubs.len());
        }
        self.rim.sort_unstable();
        self.rim.dedup();
    }

    fn distinct(&self) -> u64 {
        self.ids.chunk_by(|a, b| a == b).count() as u64
    }

    fn span(&self) -> u64 {
        match (self.ids.first(), self.ids.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0,
        }
    }

    /// Vertices with so many corners here or more, and how many those are.
    fn frequent(&self, least: u64) -> Vec<(u64, u64)> {
        let same = self.ids.chunk_by(|a, b| a == b);
        let counted = same.map(|same| (same[0], same.len() as u64));
        counted.filter(|(_, uses)| *uses >= least).collect()
    }

    fn at_hubs(&self, rows: &[[u64; 3]]) -> Hubs {
        let hub = |v: &&u64| self.hubs.binary_search(v).is_ok();
        let mut with = [0u64; 4];
        for row in rows {
            with[row.iter().filter(hub).count()] += 1;
        }
        let [_, one, two, three] = with.map(|n| n as f64 / rows.len().max(1) as f64);
        Hubs {
            number: self.hubs.len() as u64,
            met: one + two + three,
            knotted: two + three,
            corners: one + 2.0 * two + 3.0 * three,
            knots: two + 3.0 * three,
        }
    }
}
