//! What is recounted of each component: sums that triangles and edges add to in any order.
//!
//! Why it is bounded: a [`Table`] has a fixed number of places, a component's place is its
//! label modulo that number, and what a new label displaces goes to an external sort by
//! label, where the parts of a component meet again. When the components fit in the table
//! nothing is displaced, and each leaves one record at the end.
//!
//! Volumes are whole numbers of cubes of the grid, so their sums are exact. Lengths are in units
//! of the mesh's largest extent, so that no sum overflows whatever the coordinates; they and areas
//! are floating sums with a running correction (Neumaier's), good to a few units in the last place
//! of the sum of the magnitudes.
//!
//! Memory: 240 bytes a place, leased. I/O: 240 bytes for each displaced part.

use super::sort::{Filler, Record, Sorter};
use crate::disk::{Lease, Workspace};
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// A floating sum and its running correction.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Sum {
    sum: f64,
    rest: f64,
}

impl Sum {
    pub(super) fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.rest += if self.sum.abs() >= x.abs() {
            (self.sum - sum) + x
        } else {
            (x - sum) + self.sum
        };
        self.sum = sum;
    }

    fn absorb(&mut self, other: &Sum) {
        self.add(other.sum);
        self.rest += other.rest;
    }

    pub(super) fn value(&self) -> f64 {
        self.sum + self.rest
    }
}

/// An exact sum: the low and the high word of an `i128`, which would want another alignment.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Exact {
    low: u64,
    high: u64,
}

impl Exact {
    pub(super) fn add(&mut self, x: i128) {
        let sum = self.value().wrapping_add(x) as u128;
        (self.low, self.high) = (sum as u64, (sum >> 64) as u64);
    }

    pub(super) fn value(&self) -> i128 {
        (u128::from(self.high) << 64 | u128::from(self.low)) as i128
    }
}

/// What is known of a component, or of a part of it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Tally {
    pub(super) label: u64,
    pub(super) triangles: u64,
    pub(super) flipped: u64,
    /// Its first triangle, shifted left by one, and whether that is flipped.
    pub(super) first: u64,
    /// Edges with two, with one, and corners on edges with more incident corners.
    pub(super) regular: u64,
    pub(super) border: u64,
    pub(super) cut: u64,
    /// Regular edges whose triangles disagree, and the smallest corner that faces one.
    pub(super) disagree: u64,
    pub(super) disagree_corner: u64,
    /// Triangles with a vertex that is not finite; triangles that could not be measured.
    pub(super) nonfinite: u64,
    pub(super) unmeasured: u64,
    /// Six times the signed volume on the grid, the area, and the sides of all triangles.
    pub(super) volume: Exact,
    pub(super) area: Sum,
    pub(super) sides: Sum,
    /// Smallest and largest coordinates of its finite vertices, -0 as +0.
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    /// Pieces that connectivity found, the largest of their first triangles, and how many
    /// of them have no consistent orientation.
    pub(super) pieces: u64,
    pub(super) last_piece: u64,
    pub(super) odd: u64,
    /// Non-manifold edges at which the component's own corners do not cancel.
    pub(super) uneven: u64,
    /// Distinct vertices, fans, and loops of corners without an opposite.
    pub(super) vertices: u64,
    pub(super) fans: u64,
    pub(super) loops: u64,
}

impl Tally {
    pub(super) fn empty(label: u64) -> Tally {
        Tally {
            label,
            first: u64::MAX,
            disagree_corner: u64::MAX,
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            ..Tally::zeroed()
        }
    }

    /// Adds what another part of the component has.
    pub(super) fn absorb(&mut self, other: &Tally) {
        self.triangles += other.triangles;
        self.flipped += other.flipped;
        self.first = self.first.min(other.first);
        self.regular += other.regular;
        self.border += other.border;
        self.cut += other.cut;
        self.disagree += other.disagree;
        self.disagree_corner = self.disagree_corner.min(other.disagree_corner);
        self.nonfinite += other.nonfinite;
        self.unmeasured += other.unmeasured;
        self.volume.add(other.volume.value());
        self.area.absorb(&other.area);
        self.sides.absorb(&other.sides);
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(other.min[axis]);
            self.max[axis] = self.max[axis].max(other.max[axis]);
        }
        self.pieces += other.pieces;
        self.last_piece = self.last_piece.max(other.last_piece);
        self.odd += other.odd;
        self.uneven += other.uneven;
        self.vertices += other.vertices;
        self.fans += other.fans;
        self.loops += other.loops;
    }
}

impl Record for Tally {
    type Key = u64;
    fn key(&self) -> u64 {
        self.label
    }
}

/// Parts of components, each in its place until another displaces it.
pub(super) struct Table<'a> {
    places: Vec<Tally>,
    spill: Filler<'a, Tally>,
    _lease: Lease,
}

/// The label of an empty place.
const FREE: u64 = u64::MAX;

impl<'a> Table<'a> {
    /// A table of about `bytes` for the labels below `labels`, which spills to `sorter`.
    pub(super) fn new(
        ws: &Workspace,
        sorter: &'a Sorter<Tally>,
        labels: u64,
        bytes: u64,
    ) -> Result<Table<'a>> {
        let size = size_of::<Tally>() as u64;
        let places = (bytes / size).min(labels).max(1);
        let lease = ws.budget.lease("component sums", places * size)?;
        Ok(Table {
            places: vec![Tally::empty(FREE); places as usize],
            spill: sorter.filler(ws)?,
            _lease: lease,
        })
    }

    /// The sums of a component.
    #[inline]
    pub(super) fn of(&mut self, label: u64) -> Result<&mut Tally> {
        let n = self.places.len() as u64;
        let place = if label < n { label } else { label % n };
        let tally = &mut self.places[place as usize];
        if tally.label != label {
            if tally.label != FREE {
                self.spill.push(*tally)?;
            }
            *tally = Tally::empty(label);
        }
        Ok(tally)
    }

    /// Hands all sums to the sorter.
    pub(super) fn finish(mut self) -> Result<()> {
        for tally in &self.places {
            if tally.label != FREE {
                self.spill.push(*tally)?;
            }
        }
        self.spill.finish()
    }
}
