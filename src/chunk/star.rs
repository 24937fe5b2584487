//! Vertex stars inside one chunk or cell: fans, valences, loops of the border, twin triangles.
//!
//! A *fan* is a maximal set of corners at one vertex that hang together over regular edges: a
//! path, with two ends on edges that have no opposite, or a ring.
//!
//! Why it works: a corner's triangle has two edges at the corner's vertex, so the corners of a
//! vertex are linked in paths and rings and nothing else. One walk from any corner, first over
//! one of its edges, then over the other, sees its whole fan, and when it sees as many corners as
//! the vertex has there is no other. Walks go over edges, not round oriented triangles, so they
//! work before anything is oriented, and on surfaces that cannot be.
//!
//! A vertex with *open* edges, whose corners lie elsewhere too, is not decided here: its fans
//! become [`Part`]s, to be joined with those of other chunks. All other fans are counted for good.
//!
//! *Loops*: every open fan joins the two corners without opposite at its ends, and every such
//! corner lies at the ends of two fans, so these corners form rings. They are joined into
//! *chains* here by union-find; a join inside one chain closes a loop. Where a chain leaves the
//! chunk, parts name it by its smallest corner.
//!
//! *Twins*: triangles with the same three vertices share all their edges. Opposite corners of
//! twins have the same vertex, so one regular edge tells, and a border tells that there is none;
//! triangles without either are candidates that must be compared elsewhere.
//!
//! Memory: 8 bytes for each local vertex, two for each triangle, at most 12 for each corner without
//! opposite. O(C) time.

use super::chains::Chains;
use super::pair::{BORDER, CUT, DEGENERATE, Pairs, SPECIAL};
use super::swirl::NO_COMPONENT;

/// Next corner of the same triangle.
#[inline]
const fn next(c: u32) -> u32 {
    if c % 3 == 2 { c - 2 } else { c + 1 }
}

/// Previous corner of the same triangle.
#[inline]
const fn prev(c: u32) -> u32 {
    if c.is_multiple_of(3) { c + 2 } else { c - 1 }
}

/// Stands for no corner and no vertex.
pub const NOTHING: u32 = u32::MAX;

/// What is known of one end of a [`Part`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct End {
    /// The other vertex of an edge that is not decided here, or [`NOTHING`] where the edge has no
    /// opposite for certain.
    pub to: u32,
    /// The corner that faces the edge; for an edge without opposite the corner that names its
    /// chain. [`NOTHING`] when the fan is a ring.
    pub corner: u32,
}

/// A fan, or a part of one, at a vertex that other chunks or cells may name too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The vertex, local.
    pub vertex: u32,
    /// One of its corners.
    pub corner: u32,
    /// Number of its corners.
    pub corners: u32,
    /// Its ends.
    pub ends: [End; 2],
}

/// What is added up for a local component.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StarCount {
    /// Fans that are rings.
    pub rings: u32,
    /// Loops of corners without opposite.
    pub loops: u32,
}

/// A chunk or cell as the kernels before left it.
pub struct Settled<'a> {
    /// Local vertex of each corner of a triangle; all below `span`.
    pub local: &'a [u32],
    /// Number of local vertices.
    pub span: usize,
    /// Labels of the triangles.
    pub label: &'a [u32],
    /// True for the vertices whose corners may lie elsewhere too.
    pub open: &'a [bool],
}

/// Who is told what was found. What hangs on open vertices, and what is rare, is handed out at
/// once, so that it need not be held.
pub trait Sink {
    /// What may go wrong with it.
    type Error;

    /// A vertex that is not open has so many corners.
    fn valence(&mut self, corners: u32);
    /// A corner of a fan of a vertex that has several, and is not open.
    ///
    /// # Errors
    /// The sink's own.
    fn shared(&mut self, corner: u32) -> Result<(), Self::Error>;
    /// A fan of an open vertex, or a part of one.
    ///
    /// # Errors
    /// The sink's own.
    fn part(&mut self, part: &Part) -> Result<(), Self::Error>;
    /// Two triangles that are twins, and alone with each other.
    ///
    /// # Errors
    /// The sink's own.
    fn twins(&mut self, a: u32, b: u32) -> Result<(), Self::Error>;
    /// A triangle that may have twins elsewhere, or several.
    ///
    /// # Errors
    /// The sink's own.
    fn candidate(&mut self, triangle: u32) -> Result<(), Self::Error>;
}

/// The stars of one chunk or cell. Reused from one to the next.
#[derive(Debug, Default)]
pub struct Stars {
    /// By local component: what is decided here.
    pub counts: Vec<StarCount>,
    /// For each vertex number of corners in the high half, one of them in the low.
    heads: Vec<u64>,
    seen: Vec<u64>,
    chains: Chains,
}

/// A fan as a walk saw it.
struct Walked {
    corners: u32,
    /// Its ends, unless it is a ring.
    ends: Option<[End; 2]>,
}

/// Where a walk came to an end: corner that faces the edge, and the side it lies on.
enum Step {
    Ring,
    End(u32, u32),
}

impl Stars {
    /// Bytes for each local vertex.
    pub const VERTEX_BYTES: u64 = 8;
    /// Bytes for each triangle, at most.
    pub const TRIANGLE_BYTES: u64 = 3 * 12 + 2;

    /// Finds the stars of a chunk or cell of `components` local components.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn settle<S: Sink>(
        &mut self,
        of: &Settled,
        pairs: &Pairs,
        components: usize,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        self.counts.clear();
        self.counts.resize(components, StarCount::default());
        let opposite = &pairs.opposite[..];
        self.list(of, opposite);
        find_twins(of.local, opposite, sink)?;
        // Chains are joined at the vertices that are not open, and then have their names.
        let several = self.settle_vertices(of, opposite, false, sink)?;
        if several {
            self.settle_several(of, opposite, false, sink)?;
        }
        if of.open.contains(&true) && self.settle_vertices(of, opposite, true, sink)? {
            self.settle_several(of, opposite, true, sink)?;
        }
        Ok(())
    }

    /// Settles the vertices that are open, or those that are not; true when some have several fans,
    /// which are left.
    fn settle_vertices<S: Sink>(
        &mut self,
        of: &Settled,
        opposite: &[u32],
        open: bool,
        sink: &mut S,
    ) -> Result<bool, S::Error> {
        let corners = of.local.len() as u32;
        let mut several = false;
        for v in 0..of.span {
            let (count, head) = ((self.heads[v] >> 32) as u32, self.heads[v] as u32);
            if count == 0 || of.open[v] != open {
                continue;
            }
            if !open {
                sink.valence(count);
            }
            let fan = walk(opposite, corners, head, &mut |_| ());
            if fan.corners == count {
                self.take(of, head, &fan, sink)?;
            } else {
                self.heads[v] |= SEVERAL;
                several = true;
            }
        }
        Ok(several)
    }

    /// Counts the corners of each vertex, and collects the corners without opposite.
    fn list(&mut self, of: &Settled, opposite: &[u32]) {
        self.heads.clear();
        self.heads.resize(of.span, 0);
        self.chains.clear(of.local.len());
        let rows = of.local.as_chunks::<3>().0.iter();
        for ((t, row), o) in (0u32..).zip(rows).zip(opposite.as_chunks::<3>().0) {
            if o[0] == DEGENERATE {
                continue;
            }
            for k in 0..3 {
                let head = &mut self.heads[row[k] as usize];
                *head = ((*head >> 32) + 1) << 32 | u64::from(3 * t + k as u32);
                if o[k] == BORDER || o[k] == CUT {
                    self.chains.add(3 * t + k as u32);
                }
            }
        }
        self.chains.number();
    }

    /// Settles the vertices with several fans, corner by corner.
    fn settle_several<S: Sink>(
        &mut self,
        of: &Settled,
        opposite: &[u32],
        open: bool,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        let corners = of.local.len() as u32;
        let mut seen = std::mem::take(&mut self.seen);
        seen.clear();
        seen.resize(of.local.len().div_ceil(64), 0);
        for c in 0..corners {
            let v = of.local[c as usize] as usize;
            if self.heads[v] & SEVERAL == 0 || of.open[v] != open {
                continue;
            }
            let again = seen[c as usize / 64] >> (c % 64) & 1 == 1;
            if again || opposite[(c - c % 3) as usize] == DEGENERATE {
                continue;
            }
            let fan = walk(opposite, corners, c, &mut |c| {
                seen[c as usize / 64] |= 1 << (c % 64)
            });
            if !open {
                sink.shared(c)?;
            }
            self.take(of, c, &fan, sink)?;
        }
        self.seen = seen;
        Ok(())
    }

    /// Takes in a whole fan, or hands out that of an open vertex.
    #[inline]
    fn take<S: Sink>(
        &mut self,
        of: &Settled,
        corner: u32,
        fan: &Walked,
        sink: &mut S,
    ) -> Result<(), S::Error> {
        let vertex = of.local[corner as usize];
        if of.open[vertex as usize] {
            let part = self.part(of, vertex, corner, fan);
            return sink.part(&part);
        }
        let label = of.label[corner as usize / 3];
        debug_assert_ne!(label, NO_COMPONENT);
        let counts = &mut self.counts[(label >> 1) as usize];
        match fan.ends {
            None => counts.rings += 1,
            Some([a, b]) => {
                debug_assert_eq!((a.to, b.to), (NOTHING, NOTHING));
                if !self.chains.join(a.corner, b.corner) {
                    counts.loops += 1;
                }
            }
        }
        Ok(())
    }

    fn part(&mut self, of: &Settled, vertex: u32, corner: u32, fan: &Walked) -> Part {
        let nowhere = End {
            to: NOTHING,
            corner: NOTHING,
        };
        let ends = fan.ends.map_or([nowhere; 2], |ends| {
            ends.map(|end| match end.to {
                NOTHING => End {
                    corner: self.chains.name(end.corner),
                    ..end
                },
                to => End {
                    to: of.local[to as usize],
                    ..end
                },
            })
        });
        Part {
            vertex,
            corner,
            corners: fan.corners,
            ends,
        }
    }
}

/// Finds twins, and what may have some.
fn find_twins<S: Sink>(local: &[u32], opposite: &[u32], sink: &mut S) -> Result<(), S::Error> {
    let end = 2 * local.len() as u32;
    let rows = opposite[..local.len()].as_chunks::<3>().0;
    for (t, row) in (0u32..).zip(rows) {
        // A border, or a regular edge whose other triangle lies elsewhere, has no twin behind.
        let Some(k) = row.iter().position(|&o| o < SPECIAL || o == BORDER) else {
            if row[0] != DEGENERATE {
                sink.candidate(t)?;
            }
            continue;
        };
        let o = row[k];
        if o < end && local[(o >> 1) as usize] == local[3 * t as usize + k] && o / 6 > t {
            sink.twins(t, o / 6)?;
        }
    }
    Ok(())
}

/// Marks a vertex with several fans in its head: a corner stays below it.
const SEVERAL: u64 = 1 << 31;

/// Walks the fan of corner `c`; an end's `to` is, for now, the corner at the edge's other vertex.
#[inline]
fn walk(opposite: &[u32], corners: u32, c: u32, each: &mut impl FnMut(u32)) -> Walked {
    let mut count = 1;
    each(c);
    let ring = |corners| Walked {
        corners,
        ends: None,
    };
    let Step::End(first, side) = go(opposite, corners, (next(c), 0), &mut count, each) else {
        return ring(count);
    };
    let one = end(opposite, first, side);
    let Step::End(second, side) = go(opposite, corners, (prev(c), 1), &mut count, each) else {
        return ring(count);
    };
    let two = end(opposite, second, side);
    Walked {
        corners: count,
        ends: Some([one, two]),
    }
}

/// Goes on over the edge that corner `from` faces. Side 0: the vertex is at the corner before it
/// in the triangle; side 1: at the one behind it.
#[inline]
fn go(
    opposite: &[u32],
    corners: u32,
    (from, side): (u32, u32),
    count: &mut u32,
    each: &mut impl FnMut(u32),
) -> Step {
    let (mut face, mut side) = (from, side);
    loop {
        let o = opposite[face as usize];
        if o >= 2 * corners {
            return Step::End(face, side);
        }
        // Where the two triangles agree the fan goes on the same way round, else the other way.
        side ^= o & 1;
        let across = o >> 1;
        face = if side == 0 {
            prev(across)
        } else {
            next(across)
        };
        if face == from {
            return Step::Ring;
        }
        each(if side == 0 { prev(face) } else { next(face) });
        *count += 1;
    }
}

fn end(opposite: &[u32], face: u32, side: u32) -> End {
    let o = opposite[face as usize];
    let decided = o == BORDER || o == CUT;
    End {
        to: match (decided, side) {
            (true, _) => NOTHING,
            (false, 0) => next(face),
            (false, _) => prev(face),
        },
        corner: face,
    }
}
