//! The steps of a walk: what a triangle does to the border, by where its tip is.
//!
//! Why the border stays in order: an ear takes one edge off it, an open gate becomes two edges, and a
//! link exchanges the successors of two edges. Edges that come to lie there and back beside each
//! other are taken off when they are one. A step that no encoder takes is refused where it would
//! make a triangle name a vertex twice.
//!
//! Memory: the walk's. O(1) time a step, but for links, which look along the border for [`NEAR`]
//! edges either way.

use super::model::{self, Contexts, Model};
use super::range::Coder;
use super::truth::{Truth, next, prev};
use super::walk::{UNASKED, Walk};
use super::{Damaged, NONE};

/// A link is searched along the border so far either way.
const NEAR: i64 = 128;

impl<M: Model> Walk<M> {
    /// The triangle that closes b: its tip is the next vertex of the border. Looking for edges that
    /// come to lie against each other ([`Walk::zips`]), and listing, is left to the caller.
    pub(super) fn ear_right(
        &mut self,
        e: u32,
        x: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let n = self.border[e].next;
        let (a, b, c) = (self.border[e].org, self.border[n].org, self.border.dest(n));
        self.emit([c, b, a], x, truth, coder)?;
        let after = self.border[n].next;
        self.border.remove(n);
        self.border.join(e, after);
        self.renew(e, a, b, next(x), truth);
        Ok(())
    }

    /// The triangle that closes a: its tip is the vertex of the border before. The rest is left to
    /// the caller, too.
    pub(super) fn ear_left(
        &mut self,
        e: u32,
        x: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let p = self.border[e].prev;
        let (z, a, b) = (self.border[p].org, self.border[e].org, self.border.dest(e));
        self.emit([z, b, a], x, truth, coder)?;
        let before = self.border[p].prev;
        self.border.remove(p);
        self.border.join(before, e);
        self.renew(e, z, a, prev(x), truth);
        Ok(())
    }

    /// An edge of the border is now that of another triangle.
    fn renew(&mut self, e: u32, org: u32, apex: u32, corner: u32, truth: &mut impl Truth) {
        let edge = &mut self.border[e];
        (edge.org, edge.far) = (org, edge.apex);
        (edge.apex, edge.corner) = (apex, corner);
        (edge.not_left, edge.not_right) = (false, false);
        let (n, p) = (edge.next, edge.prev);
        self.border[n].not_left = false;
        self.border[p].not_right = false;
        truth.faces(corner, e);
    }

    /// After an ear: the edge may have come to lie against one beside it. False when it has not.
    pub(super) fn zips(&mut self, e: u32, truth: &mut impl Truth, coder: &mut impl Coder) -> bool {
        let p = self.border[e].prev;
        let two = self.border[e].next == p;
        self.zip(p, truth, coder) || (!two && self.zip(e, truth, coder))
    }

    /// After an ear: the edge and that before are listed, unless they are one with others.
    pub(super) fn settle(&mut self, e: u32, truth: &mut impl Truth, coder: &mut impl Coder) {
        if !self.zips(e, truth, coder) {
            self.touch(e);
            self.touch(self.border[e].prev);
        }
    }

    /// Two successive edges that run there and back between the same vertices may be one.
    fn zip(&mut self, first: u32, truth: &mut impl Truth, coder: &mut impl Coder) -> bool {
        let second = self.border[first].next;
        let after = self.border[second].next;
        let (f, s) = (self.border[first], self.border[second]);
        if first == second || !f.open || !s.open || f.org != self.border[after].org {
            return false;
        }
        let two = after == first;
        let bit = truth.opposite(f.corner) == s.corner;
        let contexts = Contexts::of(u32::from(two));
        if !self.model.bit(coder, model::ZIP, &contexts, bit) {
            return false;
        }
        self.border.remove(first);
        self.border.remove(second);
        if !two {
            self.border.join(f.prev, after);
            self.border[f.prev].not_right = false;
            self.border[after].not_left = false;
            self.touch(f.prev);
        }
        true
    }

    /// The triangle's tip is none of the neighbours. `gaps` are those at the right and left, as far
    /// as they are known.
    pub(super) fn tip(
        &mut self,
        e: u32,
        x: u32,
        gaps: [Option<u32>; 2],
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let number = truth.number(x);
        let target = if number == NONE {
            NONE
        } else {
            truth.link(x, &self.border)
        };
        let [right, left] = gaps.map(|gap| gap.unwrap_or(UNASKED));
        let contexts = Contexts::of(right.min(left));
        if !self.model.bit(coder, model::NEW, &contexts, target == NONE) {
            let m = self.target(e, target, coder)?;
            return self.link(e, m, x, truth, coder);
        }
        match self.met(x, 2, truth, coder)? {
            Some(v) => {
                let f = self.open(e, v, x, truth, coder)?;
                let p = self.border[e].prev;
                [p, e, f].iter().for_each(|&e| self.touch(e));
                Ok(())
            }
            None => self.fresh(e, x, gaps, truth, coder),
        }
    }

    /// The gate opens to a tip: two edges in its place. Returns the second; that they and the edge
    /// before are listed is left to the caller.
    fn open(
        &mut self,
        e: u32,
        v: u32,
        x: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<u32, Damaged> {
        let n = self.border[e].next;
        let (a, b) = (self.border[e].org, self.border[n].org);
        self.emit([v, b, a], x, truth, coder)?;
        let f = self.border.add(v, a, prev(x));
        self.border[f].far = self.border[e].apex;
        truth.faces(prev(x), f);
        self.border.join(e, f);
        self.border.join(f, n);
        self.renew(e, a, b, next(x), truth);
        self.border[n].not_left = false;
        Ok(f)
    }

    /// A new vertex: the fan to the right and left, then its position.
    fn fresh(
        &mut self,
        e: u32,
        x: u32,
        gaps: [Option<u32>; 2],
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let edge = self.border[e];
        let (n, p) = (edge.next, edge.prev);
        let (a, b) = (edge.org, self.border[n].org);
        let gap_right = gaps[0].unwrap_or_else(|| self.gap_right(e));
        let gap_left = gaps[1].unwrap_or_else(|| self.gap_left(e));
        let edges = [edge, self.border[n], self.border[p]];
        let mut around =
            self.places
                .around(self.row(e), edges.map(|e| e.apex), edges.map(|e| e.far));
        let bend = |gap: u32| usize::from(gap > 9) + usize::from(gap > 14);
        around.bends = [bend(gap_right), bend(gap_left)];
        let right = self.ear_contexts(gap_right, b, a, e);
        let left = self.ear_contexts(gap_left, a, b, e);
        let v = self.places.len() as u32;
        truth.meet(x, v);
        self.places.reserve(around.guess_of_parallelogram());
        self.valence.push(0);
        self.rim.push(NONE);
        let f = self.open(e, v, x, truth, coder)?;
        if n != e && self.border[n].open {
            let y = truth.across(prev(x));
            let bit = y != NONE && truth.opposite(prev(y)) == self.border[n].corner;
            if self.model.bit(coder, model::FAN_RIGHT, &right, bit) {
                around.class += 2;
                self.ear_right(f, y, truth, coder)?;
                self.zips(f, truth, coder);
            } else {
                self.border[f].not_right = true;
            }
        }
        if self.border.alive(e) && self.border[e].prev == p && p != f && self.border[p].open {
            let y = truth.across(next(x));
            let bit = y != NONE && truth.opposite(next(y)) == self.border[p].corner;
            if self.model.bit(coder, model::FAN_LEFT, &left, bit) {
                around.class += 1;
                self.ear_left(e, y, truth, coder)?;
                self.zips(e, truth, coder);
            } else {
                self.border[e].not_left = true;
            }
        }
        let position = truth.position(x);
        self.places
            .fresh(&mut self.model, coder, &around, position)?;
        // What is listed twice counts as listed last.
        let after = self.border.alive(f).then(|| self.border[f].prev);
        if self.border.alive(e) {
            let p = self.border[e].prev;
            if after != Some(e) {
                self.touch(e);
            }
            self.touch(p);
        }
        if let Some(p) = after {
            self.touch(f);
            self.touch(p);
        }
        Ok(())
    }

    /// The vertices of the border about a gate: a, b, c, z, d, y.
    fn row(&self, e: u32) -> [u32; 6] {
        let border = &self.border;
        let (n, p) = (border[e].next, border[e].prev);
        let a = border[e].org;
        let (b, c, z) = (border[n].org, border.dest(n), border[p].org);
        let d = border.dest(border[n].next);
        [a, b, c, z, d, border[border[p].prev].org]
    }

    /// Codes which edge of the border starts at the tip.
    fn target(&mut self, e: u32, target: u32, coder: &mut impl Coder) -> Result<u32, Damaged> {
        let n = self.border[e].next;
        let (start, stop) = (self.border[n].next, self.border[e].prev);
        let mut steps = 0;
        let (mut ahead, mut back) = (start, stop);
        for i in 1..=NEAR {
            if target == NONE {
                break;
            }
            if ahead == target || back == target {
                steps = if ahead == target { i } else { -i };
                break;
            }
            ahead = self.border[ahead].next;
            back = self.border[back].prev;
        }
        let contexts = Contexts::of(0);
        let steps = self
            .model
            .number(coder, model::LINK, &contexts, (3, 0), steps);
        if steps == 0 {
            let slots = self.border.slots();
            let m = coder.plain(32 - slots.leading_zeros(), u64::from(target)) as u32;
            if !self.border.alive(m) {
                return Err(Damaged("a link to no edge of the border"));
            }
            return Ok(m);
        }
        if steps.abs() > NEAR {
            return Err(Damaged("a link beyond the near part of the border"));
        }
        let mut m = if steps > 0 { start } else { stop };
        for _ in 1..steps.abs() {
            m = if steps > 0 {
                self.border[m].next
            } else {
                self.border[m].prev
            };
        }
        Ok(m)
    }

    /// The tip is on the border at the start of `m`: a loop splits, or two become one.
    fn link(
        &mut self,
        e: u32,
        m: u32,
        x: u32,
        truth: &mut impl Truth,
        coder: &mut impl Coder,
    ) -> Result<(), Damaged> {
        let n = self.border[e].next;
        let (a, b, v) = (self.border[e].org, self.border[n].org, self.border[m].org);
        self.emit([v, b, a], x, truth, coder)?;
        let before = self.border[m].prev;
        let f = self.border.add(v, a, prev(x));
        truth.faces(prev(x), f);
        self.border.join(before, f);
        self.border.join(f, n);
        self.border.join(e, m);
        self.border[before].not_right = false;
        self.renew(f, v, a, prev(x), truth);
        self.border[f].far = self.border[e].apex;
        self.renew(e, a, b, next(x), truth);
        let p = self.border[e].prev;
        [p, e, before, f].iter().for_each(|&e| self.touch(e));
        Ok(())
    }
}
