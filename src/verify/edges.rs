//! The pass over the edges: all corners of all triangles, sorted by the edge that they face.
//!
//! Why that proves O: the group of an edge holds *all* its corners in the mesh, so what each
//! corner's opposite must be follows from the group alone: NONE for one corner or for three
//! and more, each other for exactly two. When every corner has that, O[O[c]] = c, shared
//! edges and the absence of anything else follow. Labels, parities and the lists of
//! non-manifold edges are compared in the same groups; the lists are sorted like the groups.
//!
//! Memory: the buffers of the merge, component sums, and connectivity (see
//! [`links`](super::links)). I/O: the sorted corners once, the two lists once.

use super::edge_record::{EdgeRecord, Facing};
use super::fans::Feed;
use super::links::Links;
use super::open::Arrays;
use super::read::{IdReader, Rows};
use super::sort::{Filler, Merge, Record, Sorter};
use super::spool::Spool;
use super::tally::Table;
use super::verdict::{At, Check, Findings, id};
use crate::disk::Workspace;
use crate::error::Result;
use crate::folder::{COMPONENT, EdgeRow, NONMANIFOLD_CORNERS, NONMANIFOLD_EDGES, O};
use bytemuck::{Pod, Zeroable};

/// What the pass counts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counted {
    pub(super) regular: u64,
    pub(super) border: u64,
    pub(super) nonmanifold: u64,
    pub(super) nonmanifold_corners: u64,
    pub(super) inconsistent: u64,
}

/// A corner of a component on a non-manifold edge, and which way it goes along it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Side {
    pub(super) label: u64,
    /// Number of the edge among the non-manifold ones.
    pub(super) edge: u64,
    /// 1 upward, -1 downward.
    pub(super) way: i64,
}

impl Record for Side {
    type Key = (u64, u64);
    fn key(&self) -> (u64, u64) {
        (self.label, self.edge)
    }
}

/// Two components that meet at a non-manifold edge.
pub(super) type Meeting = [u64; 2];

/// Everything that the pass reads and adds to.
pub(super) struct Pass<'a> {
    pub(super) ws: &'a Workspace,
    pub(super) arrays: &'a Arrays,
    pub(super) findings: &'a Findings,
    pub(super) table: Table<'a>,
    pub(super) links: &'a mut Links,
    pub(super) sides: Filler<'a, Side>,
    pub(super) meetings: &'a mut Spool<Meeting>,
    /// In measured folders.
    pub(super) feed: Option<Feed<'a>>,
    pub(super) rows: Rows<'a, EdgeRow>,
    pub(super) corners: IdReader<'a>,
    /// Place in the list of corners.
    pub(super) place: u64,
    pub(super) counted: Counted,
}

impl Pass<'_> {
    /// Runs the pass.
    pub(super) fn run<E: EdgeRecord>(mut self, mut merge: Merge<E>) -> Result<Counted> {
        let progress = &self.ws.progress;
        progress.begin("verify: edges", "corners", self.arrays.triangles * 3);
        let mut next = merge.next()?.map(|r| r.unpack());
        let mut seen = 0u64;
        while let Some(first) = next {
            if seen >= 1 << 16 {
                progress.advance(seen);
                progress.usage(self.ws.budget.used(), self.ws.scratch.used());
                seen = 0;
            }
            let same = |f: &Facing| (f.lo, f.hi) == (first.lo, first.hi);
            let second = merge.next()?.map(|r| r.unpack());
            let Some(second) = second.filter(same) else {
                self.border(&first)?;
                next = second;
                seen += 1;
                continue;
            };
            let third = merge.next()?.map(|r| r.unpack());
            let Some(third) = third.filter(same) else {
                self.regular(&first, &second)?;
                next = third;
                seen += 2;
                continue;
            };
            let mut star = self.open_star(&first)?;
            for facing in [first, second, third] {
                self.star_corner(&mut star, &facing)?;
            }
            loop {
                next = merge.next()?.map(|r| r.unpack());
                let Some(facing) = next.filter(same) else {
                    break;
                };
                self.star_corner(&mut star, &facing)?;
            }
            self.close_star(&star)?;
            seen += star.corners;
        }
        progress.advance(seen);
        self.rest_of_lists()?;
        self.table.finish()?;
        self.sides.finish()?;
        if let Some(feed) = self.feed {
            feed.finish()?;
        }
        progress.end();
        Ok(self.counted)
    }

    /// A corner's opposite is what its edge says, or a finding.
    fn opposite(&self, facing: &Facing, expected: u64, why: &str) {
        let (c, o) = (facing.corner, facing.opposite);
        if o != expected {
            self.findings.add(Check::Opposite, O, At::Corner(c), || {
                let (lo, hi) = (id(facing.lo), id(facing.hi));
                let expected = id(expected);
                let found = format!("O[{c}] is {}", id(o));
                (found, format!("{expected} ({why} edge {{{lo}, {hi}}})"))
            });
        }
    }

    fn border(&mut self, facing: &Facing) -> Result<()> {
        self.counted.border += 1;
        self.opposite(facing, u64::MAX, "no other corner faces");
        if facing.label != u64::MAX {
            self.table.of(facing.label)?.border += 1;
        }
        match &mut self.feed {
            Some(feed) => feed.border(facing),
            None => Ok(()),
        }
    }

    fn regular(&mut self, a: &Facing, b: &Facing) -> Result<()> {
        self.counted.regular += 1;
        self.opposite(a, b.corner, "the only other corner that faces");
        self.opposite(b, a.corner, "the only other corner that faces");
        let disagree = a.upward == b.upward;
        let input = disagree ^ a.flipped ^ b.flipped;
        self.counted.inconsistent += u64::from(input);
        let (ta, tb) = (a.corner / 3, b.corner / 3);
        self.links.push(ta, tb, disagree)?;
        if let Some(feed) = &mut self.feed {
            feed.regular(a, b)?;
        }
        if a.label != b.label {
            let at = At::Triangle(ta.max(tb));
            self.findings.add(Check::Label, COMPONENT, at, || {
                let (high, low) = if ta > tb { (a, b) } else { (b, a) };
                let across = format!(
                    "{}, as triangle {} across corner {}",
                    id(low.label),
                    low.corner / 3,
                    high.corner
                );
                (format!("label {}", id(high.label)), across)
            });
        }
        if a.label != u64::MAX {
            let tally = self.table.of(a.label)?;
            tally.regular += 1;
            if disagree {
                tally.disagree += 1;
                tally.disagree_corner = tally.disagree_corner.min(a.corner);
            }
        }
        Ok(())
    }
}

/// A non-manifold edge while its corners go by.
struct Star {
    first: Facing,
    corners: u64,
    /// Its row in the list, when it has one.
    row: Option<(u64, EdgeRow)>,
    /// Label of the corner before.
    label: u64,
}

impl Pass<'_> {
    fn open_star(&mut self, first: &Facing) -> Result<Star> {
        let key = (first.lo, first.hi);
        let row = loop {
            match self.rows.peek()? {
                Some((number, row)) if (row.lo, row.hi) < key => {
                    self.stray_row(number, &row);
                    self.rows.next()?;
                    self.place = self.place.saturating_add(row.corners);
                }
                Some((_, row)) if (row.lo, row.hi) == key => break self.rows.next()?,
                _ => break None,
            }
        };
        if row.is_none() {
            let at = At::Edge(first.lo, first.hi);
            let check = Check::NonmanifoldEdges;
            self.findings.add(check, NONMANIFOLD_EDGES, at, || {
                let found = format!("not listed (it faces corner {})", first.corner);
                (found, "every edge that three or more corners face".into())
            });
        }
        Ok(Star {
            first: *first,
            corners: 0,
            row,
            label: first.label,
        })
    }

    fn stray_row(&self, number: u64, row: &EdgeRow) {
        let at = At::Row(number);
        self.findings
            .add(Check::NonmanifoldEdges, NONMANIFOLD_EDGES, at, || {
                let found = format!("edge {{{}, {}}}", row.lo, row.hi);
                (found, "edges of three or more corners, ascending".into())
            });
    }

    fn star_corner(&mut self, star: &mut Star, facing: &Facing) -> Result<()> {
        self.opposite(facing, u64::MAX, "three or more corners face");
        if let Some((_, row)) = star.row
            && star.corners < row.corners
        {
            let place = self.place.saturating_add(star.corners);
            let found = self.corners.get(place)?;
            if found != Some(facing.corner) {
                let at = At::Row(place);
                let check = Check::NonmanifoldCorners;
                self.findings.add(check, NONMANIFOLD_CORNERS, at, || {
                    let edge = format!("edge {{{}, {}}}", facing.lo, facing.hi);
                    let found = found.map_or("the end of the list".into(), |c| {
                        format!("corner {}", id(c))
                    });
                    (found, format!("{} ({edge})", facing.corner))
                });
            }
        }
        star.corners += 1;
        if let Some(feed) = &mut self.feed {
            feed.cut(facing, self.counted.nonmanifold)?;
        }
        if facing.label != u64::MAX {
            self.table.of(facing.label)?.cut += 1;
            self.sides.push(Side {
                label: facing.label,
                edge: self.counted.nonmanifold,
                way: if facing.upward { 1 } else { -1 },
            })?;
            if star.label != u64::MAX && star.label != facing.label {
                let both = [star.label, facing.label];
                self.meetings.push(&self.ws.scratch, both)?;
            }
            star.label = facing.label;
        }
        Ok(())
    }

    fn close_star(&mut self, star: &Star) -> Result<()> {
        self.counted.nonmanifold += 1;
        self.counted.nonmanifold_corners += star.corners;
        let Some((number, row)) = star.row else {
            return Ok(());
        };
        let (at, check) = (At::Row(number), Check::NonmanifoldEdges);
        let findings = self.findings;
        let file = NONMANIFOLD_EDGES;
        findings.equal(check, file, at, "corners", row.corners, star.corners);
        let first = star.first.corner;
        findings.equal(check, file, at, "first_corner", row.first_corner, first);
        self.place = self.place.saturating_add(row.corners);
        Ok(())
    }

    /// What is left in the lists after the last edge does not belong there.
    fn rest_of_lists(&mut self) -> Result<()> {
        while let Some((number, row)) = self.rows.next()? {
            self.stray_row(number, &row);
            self.place = self.place.saturating_add(row.corners);
        }
        let found = self.arrays.nonmanifold_corners.len;
        if found != self.counted.nonmanifold_corners {
            let check = Check::NonmanifoldCorners;
            self.findings.add(check, NONMANIFOLD_CORNERS, At::File, || {
                let expected = self.counted.nonmanifold_corners;
                (format!("{found} corners"), expected.to_string())
            });
        }
        Ok(())
    }
}

/// Adds to each component the non-manifold edges at which its own corners do not cancel.
pub(super) fn cancel(
    ws: &Workspace,
    sides: Sorter<Side>,
    mut table: Table,
    memory: u64,
) -> Result<()> {
    let mut merge = sides.merge(ws, memory)?;
    let mut next = merge.next()?;
    while let Some(mut sum) = next {
        loop {
            next = merge.next()?;
            match next.filter(|side| side.key() == sum.key()) {
                Some(side) => sum.way += side.way,
                None => break,
            }
        }
        if sum.way != 0 {
            table.of(sum.label)?.uneven += 1;
        }
    }
    table.finish()
}
