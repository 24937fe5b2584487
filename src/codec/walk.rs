//! The walk over a surface: triangle to triangle across the gates of the cut border, coding at
//! each what lies behind it. One code for both sides.
//!
//! ```text
//!   at the gate a -> b           right     left      border    new        link
//!                                    c    z                     v          v (on the border)
//!   z ─ ─ a ═══ b ─ ─ c           a═b      a═b       a═b       a═b        a═b
//! ```
//!
//! Why it is exact: each step names the tip of one triangle, as the next vertex of the border, the
//! one before, one elsewhere on it, one met before, or a new one; so the triangles come out as
//! they went in whatever the surface is like. Only how *few* bits that takes rests on the surface
//! being one. What the border's loops would have to be for that is never relied on.
//!
//! Why it is short: the gate is taken where the border bends in most, so that a neighbour is the
//! tip where the bend is sharp, and a new vertex has coded triangles on two sides where it is not:
//! the fan is followed to the right and left before the new vertex's position is coded.
//!
//! Memory: 21 bytes a vertex, 12 a triangle for the result, 32 and at most 24 more for each edge
//! of the border and each change of it that is still listed. O(1) time a triangle, but for links.

use super::around::onward;
use super::border::Border;
use super::model::{self, Contexts, Model};
use super::place::Places;
use super::range::Coder;
use super::truth::{Truth, next, prev};
use super::vec::{Vec3, add, dot, excess, log4, reach, shift, sub};
use super::{Damaged, NONE};

/// Classes of how far the border bends in.
const GAPS: i32 = 24;
/// The class of a gap that nobody asked for.
pub(super) const UNASKED: u32 = GAPS as u32 - 1;
/// Gates wait in so many stacks, the sharpest bends first.
const STACKS: usize = 8;

/// The state of a walk, of which the mesh coded so far is a part.
pub struct Walk<M> {
    pub(super) border: Border,
    stacks: [Vec<(u32, u32)>; STACKS],
    /// Positions, and how they were coded.
    pub places: Places,
    pub(super) valence: Vec<u8>,
    /// The vertex behind each along the rim, the gates that were closed; NONE of those that are not
    /// on it.
    pub rim: Vec<u32>,
    /// The triangles, by numbers of vertices.
    pub triangles: Vec<[u32; 3]>,
    pub(super) model: M,
    /// True when triangles may be turned against their neighbours.
    turns: bool,
}

/// What the walk has to code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Triangles, without those that name a vertex twice.
    pub triangles: usize,
    /// Triangles that name a vertex twice.
    pub degenerate: usize,
    /// Vertices, with the loose ones.
    pub vertices: usize,
    /// Vertices that no triangle names.
    pub loose: usize,
    /// True when triangles may be turned against their neighbours.
    pub turns: bool,
}

impl<M: Model> Default for Walk<M> {
    fn default() -> Walk<M> {
        Walk {
            border: Border::default(),
            stacks: Default::default(),
            places: Places::default(),
            valence: Vec::new(),
            rim: Vec::new(),
            triangles: Vec::new(),
            model: M::new(),
            turns: false,
        }
    }
}

impl<M: Model> Walk<M> {
    /// Makes room for what is known to come.
    pub fn reserve(&mut self, extent: Extent) {
        self.triangles
            .reserve_exact(extent.triangles + extent.degenerate);
        self.valence.reserve_exact(extent.vertices);
        self.rim.reserve_exact(extent.vertices);
        self.places.make_room(extent.vertices);
    }

    /// Codes all triangles.
    ///
    /// # Errors
    /// [`Damaged`] when the decoder is told what no encoder says.
    pub fn run(
        &mut self,
        extent: Extent,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        self.part(extent, extent.triangles, truth, coder)?;
        for _ in 0..extent.degenerate {
            let x = truth.degenerate();
            let tri = self.corners([x, next(x), prev(x)], truth, coder)?;
            self.triangles.push(tri);
            if self.places.len() > extent.vertices {
                return Err(Damaged("more vertices than stated"));
            }
        }
        for i in 0..extent.loose {
            let fresh = self.places.len() as u32;
            let truth = truth.loose(fresh);
            self.places.lone(&mut self.model, coder, i > 0, truth)?;
        }
        if self.places.len() != extent.vertices {
            return Err(Damaged("another number of vertices than stated"));
        }
        Ok(())
    }

    /// Codes triangles that name three vertices: all, or no more than some over `most`.
    ///
    /// # Errors
    /// [`Damaged`], as above.
    pub fn part(
        &mut self,
        extent: Extent,
        most: usize,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        self.turns = extent.turns;
        self.places
            .lattice
            .code(&mut self.model, coder, extent.vertices)?;
        while self.triangles.len() < extent.triangles {
            self.seed(truth, coder)?;
            while let Some(e) = self.gate() {
                if most < extent.triangles && self.triangles.len() >= most {
                    return Ok(());
                }
                self.step(e, truth, coder)?;
                if self.triangles.len() > extent.triangles {
                    return Err(Damaged("more triangles than stated"));
                }
                if self.places.len() > extent.vertices {
                    return Err(Damaged("more vertices than stated"));
                }
            }
        }
        Ok(())
    }

    /// The first triangle of a part that hangs together.
    fn seed(&mut self, truth: &mut impl Truth, coder: &mut impl Coder) -> Result<(), Damaged> {
        let x = truth.seed();
        let corners = [x, next(x), prev(x)];
        let tri = self.corners(corners, truth, coder)?;
        self.emit(tri, x, truth, coder)?;
        self.border.clear();
        let edges: [u32; 3] = std::array::from_fn(|k| {
            let (from, apex) = (tri[(k + 1) % 3], tri[k]);
            let e = self.border.add(from, apex, corners[k]);
            truth.faces(corners[k], e);
            e
        });
        for k in 0..3 {
            self.border.join(edges[k], edges[(k + 1) % 3]);
        }
        edges.iter().for_each(|&e| self.touch(e));
        Ok(())
    }

    /// The vertices of three corners, each met before or alone.
    fn corners(
        &mut self,
        corners: [u32; 3],
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<[u32; 3], Damaged> {
        let mut tri = [0; 3];
        for (k, &corner) in corners.iter().enumerate() {
            tri[k] = match self.met(corner, 0, truth, coder)? {
                Some(number) => number,
                None => {
                    let fresh = self.places.len() as u32;
                    truth.meet(corner, fresh);
                    let truth = truth.position(corner);
                    self.places.lone(&mut self.model, coder, k > 0, truth)?;
                    self.valence.push(0);
                    self.rim.push(NONE);
                    fresh
                }
            };
        }
        Ok(tri)
    }

    /// Codes whether a corner's vertex was met before, and if so which it is.
    pub(super) fn met(
        &mut self,
        x: u32,
        place: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<Option<u32>, Damaged> {
        let count = self.places.len() as u32;
        let number = truth.number(x);
        let seen = (count > 0)
            && self
                .model
                .bit(coder, model::SEEN, &Contexts::of(place), number != NONE);
        if !seen {
            return Ok(None);
        }
        let back = u64::from((count - 1).wrapping_sub(number));
        let back = self
            .model
            .size(coder, model::BACK, &Contexts::of(place.min(1)), 8, back);
        if back >= u64::from(count) {
            return Err(Damaged("a vertex before the first"));
        }
        Ok(Some(count - 1 - back as u32))
    }

    /// Hands out a triangle: its tip, and the ends of its gate from the back.
    pub(super) fn emit(
        &mut self,
        tri: [u32; 3],
        x: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let [a, b, c] = tri;
        if a == b || b == c || c == a {
            return Err(Damaged("a triangle that names a vertex twice"));
        }
        for v in tri {
            let valence = &mut self.valence[v as usize];
            *valence = valence.saturating_add(1);
        }
        let turned = self.turns && {
            let bit = truth.reversed(x);
            let contexts = Contexts::of(0);
            self.model.bit(coder, model::REVERSED, &contexts, bit)
        };
        truth.visit(x);
        self.triangles.push(if turned { [a, c, b] } else { tri });
        Ok(())
    }

    /// The gate to go through next: where the border bends in most; of several the latest.
    fn gate(&mut self) -> Option<u32> {
        for stack in &mut self.stacks {
            while let Some((e, stamp)) = stack.pop() {
                if self.border[e].stamp == stamp && self.border[e].open {
                    return Some(e);
                }
            }
        }
        None
    }

    /// Lists an edge anew, after it or its successor changed.
    pub(super) fn touch(&mut self, e: u32) {
        let stamp = self.border.stamp();
        self.border[e].stamp = stamp;
        if !self.border[e].open {
            return;
        }
        let open = self.border[self.border[e].next].open;
        let stack = if open {
            let gap = self.gap_right(e);
            self.border[e].gap = gap as u8;
            ((gap as i32 - 8) / 2).clamp(0, STACKS as i32 - 2) as usize
        } else {
            STACKS - 1
        };
        self.stacks[stack].push((e, stamp));
    }

    fn at(&self, v: u32) -> Vec3 {
        self.places.at(v)
    }

    /// How far the tip of a parallelogram at the gate lies from the next vertex of the border.
    pub(super) fn gap_right(&self, e: u32) -> u32 {
        let n = self.border[e].next;
        self.gap(e, self.border.dest(n), false)
    }

    /// The same for the vertex before.
    pub(super) fn gap_left(&self, e: u32) -> u32 {
        self.gap(e, self.border[self.border[e].prev].org, true)
    }

    fn gap(&self, e: u32, to: u32, left: bool) -> u32 {
        let edge = &self.border[e];
        let (a, b, to) = (self.at(edge.org), self.at(self.border.dest(e)), self.at(to));
        let off = sub(sub(add(a, b), self.at(edge.apex)), to);
        let along = sub(a, b);
        let side = sub(to, if left { a } else { b });
        let down = excess(reach(off) | reach(along) | reach(side), 29);
        let square = |v: Vec3| dot(shift(v, down), shift(v, down)) as u64;
        let ratio = log4(square(off)) - log4(square(along) + square(side));
        (ratio + 16).clamp(0, GAPS - 1) as u32
    }

    /// What an ear is judged by: the way of the sweep, the gap, the triangles at the vertex that it would
    /// close.
    pub(super) fn ear_contexts(&self, gap: u32, pivot: u32, other: u32, e: u32) -> Contexts {
        let valence = |v: u32| u32::from(self.valence[v as usize]).min(9);
        let way = onward(self.border[e].org, self.border.dest(self.border[e].next));
        let main = (u32::from(way) * GAPS as u32 + gap) * 10 + valence(pivot);
        let kin = gap;
        if !M::MIXES {
            return Contexts {
                main,
                kin,
                more: [0; model::MORE],
            };
        }
        let across = self.gap_left(e);
        let apex = self.border[e].apex;
        Contexts {
            main,
            kin,
            more: [
                gap << 8 | across << 2,
                valence(pivot) << 8 | valence(other) << 4 | valence(apex),
                (gap / 2) << 12 | valence(pivot) << 8 | valence(other) << 4,
                (gap / 3) << 12 | (across / 3) << 8 | valence(pivot) << 4,
                gap,
                valence(pivot) << 4 | valence(apex),
                gap << 12 | across << 6 | valence(pivot),
                (gap / 4) << 12 | valence(pivot) << 8 | valence(other) << 4 | valence(apex),
            ],
        }
    }

    /// Codes what lies behind a gate.
    fn step(
        &mut self,
        e: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let edge = self.border[e];
        let (n, p) = (edge.next, edge.prev);
        let (a, b) = (edge.org, self.border[n].org);
        let x = truth.across(edge.corner);
        let known = x != NONE;
        let mut gaps = [None; 2];
        if n != p && self.border[n].open && !edge.not_right {
            // Nothing about it has changed since it was listed.
            let gap = u32::from(edge.gap);
            debug_assert_eq!(gap, self.gap_right(e));
            gaps[0] = Some(gap);
            let contexts = self.ear_contexts(gap, b, a, e);
            let bit = known && truth.opposite(prev(x)) == self.border[n].corner;
            if self.model.bit(coder, model::RIGHT, &contexts, bit) {
                self.ear_right(e, x, truth, coder)?;
                self.settle(e, truth, coder);
                return Ok(());
            }
        }
        if n != p && self.border[p].open && !edge.not_left {
            let gap = self.gap_left(e);
            gaps[1] = Some(gap);
            let contexts = self.ear_contexts(gap, a, b, e);
            let bit = known && truth.opposite(next(x)) == self.border[p].corner;
            if self.model.bit(coder, model::LEFT, &contexts, bit) {
                self.ear_left(e, x, truth, coder)?;
                self.settle(e, truth, coder);
                return Ok(());
            }
        }
        let ends = u32::from(self.border[n].open) + 2 * u32::from(self.border[p].open);
        let [right, left] = gaps.map(|gap| u32::from(gap.unwrap_or(UNASKED) > 12));
        let wide = right + 2 * left;
        let contexts = Contexts::of(ends * 4 + wide);
        if self.model.bit(coder, model::BORDER, &contexts, !known) {
            self.border[e].open = false;
            self.rim[a as usize] = b;
            self.touch(p);
            return Ok(());
        }
        self.tip(e, x, gaps, truth, coder)
    }
}
