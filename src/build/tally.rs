//! Sums by component, for any number of components in bounded memory.
//!
//! Why it works: a thread gathers into a table indexed by the low bits of the component; a
//! component that finds its place taken sends the former owner's sums to the shuffle. All sums
//! are integers, minima or maxima, so it does not matter in how many pieces they arrive; the
//! shuffle brings the pieces of a component together. Few components never spill.
//!
//! Memory: a table of 192 bytes a slot and one writer for each thread. I/O: 168 bytes for each
//! piece, written and read once.

use super::records::{LocalCount, MeasureRecord};
use crate::chunk::measure::Measure;
use crate::disk::Lease;
use crate::error::Result;
use crate::shuffle::{Buckets, Record, Shuffle, Sorter, Writer};
use bytemuck::{Pod, Zeroable};

/// What is known of a component, or of a part of it.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    /// First triangle.
    pub first: u64,
    /// Triangles.
    pub triangles: u64,
    /// Triangles that differ in orientation from the component's first.
    pub flipped: u64,
    /// Border edges.
    pub borders: u64,
    /// Fans that are rings.
    pub rings: u64,
    /// Loops of corners without opposite.
    pub loops: u64,
    /// Fans that meet another fan of the component at their vertex: all but one at each vertex.
    pub again: u64,
    /// Geometry, oriented like the component's first triangle.
    pub measure: Measure,
}

impl Default for Sums {
    fn default() -> Self {
        Sums {
            first: u64::MAX,
            triangles: 0,
            flipped: 0,
            borders: 0,
            rings: 0,
            loops: 0,
            again: 0,
            measure: Measure::default(),
        }
    }
}

impl Sums {
    /// Takes in what a chunk that begins with triangle `start` counted of a local component,
    /// whose first triangle is flipped against the component's when `flip`.
    pub fn count(&mut self, local: &LocalCount, start: u64, flip: bool) {
        let (triangles, flipped) = (local.triangles, local.flipped);
        self.first = self.first.min(start + u64::from(local.first));
        self.triangles += u64::from(triangles);
        self.flipped += u64::from(if flip { triangles - flipped } else { flipped });
        self.borders += u64::from(local.borders & !LocalCount::CONFLICT);
        self.rings += u64::from(local.rings);
        self.loops += u64::from(local.loops);
    }

    fn merge(&mut self, other: &Sums) {
        self.first = self.first.min(other.first);
        self.triangles += other.triangles;
        self.flipped += other.flipped;
        self.borders += other.borders;
        self.rings += other.rings;
        self.loops += other.loops;
        self.again += other.again;
        self.measure.merge(&other.measure, false);
    }
}

/// [`Sums`] of a part of a component, as plain words.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Piece {
    component: u64,
    counts: [u64; 7],
    measure: MeasureRecord,
}

impl Piece {
    fn new(component: u64, s: &Sums) -> Piece {
        Piece {
            component,
            counts: [
                s.first,
                s.triangles,
                s.flipped,
                s.borders,
                s.rings,
                s.loops,
                s.again,
            ],
            measure: MeasureRecord::new(&s.measure),
        }
    }

    fn sums(&self) -> Sums {
        let [first, triangles, flipped, borders, rings, loops, again] = self.counts;
        Sums {
            first,
            triangles,
            flipped,
            borders,
            rings,
            loops,
            again,
            measure: self.measure.get(),
        }
    }
}

impl Record for Piece {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.component
    }
}

/// One thread's table.
pub struct Tally<'a> {
    slots: Vec<(u64, Sums)>,
    writer: Writer<'a, Piece>,
    _lease: Lease,
}

/// No component: the slot is free.
const FREE: u64 = u64::MAX;

impl<'a> Tally<'a> {
    /// Bytes of a slot.
    const SLOT: u64 = size_of::<(u64, Sums)>() as u64;

    /// A table of at most `memory` bytes (at least one slot) before the shuffle `to`; more
    /// slots than `components` are not made.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(
        budget: &crate::disk::Budget,
        memory: u64,
        components: u64,
        to: &'a Shuffle<Piece>,
    ) -> Result<Self> {
        let most = (memory / Self::SLOT).max(1);
        let slots = (1u64 << most.ilog2()).min(components.max(1).next_power_of_two());
        Ok(Tally {
            _lease: budget.lease("sums by component", slots * Self::SLOT)?,
            slots: vec![(FREE, Sums::default()); slots as usize],
            writer: to.writer()?,
        })
    }

    /// The sums to add to for a component.
    ///
    /// # Errors
    /// As a push to the shuffle.
    #[inline]
    pub fn at(&mut self, component: u64) -> Result<&mut Sums> {
        let slot = (component & (self.slots.len() as u64 - 1)) as usize;
        let (owner, sums) = &mut self.slots[slot];
        if *owner != component {
            if *owner != FREE {
                self.writer.push(Piece::new(*owner, sums))?;
            }
            *owner = component;
            *sums = Sums::default();
        }
        Ok(sums)
    }

    /// Sends what is left to the shuffle.
    ///
    /// # Errors
    /// As a push to the shuffle.
    pub fn finish(mut self) -> Result<()> {
        for (owner, sums) in self.slots.iter().filter(|(owner, _)| *owner != FREE) {
            self.writer.push(Piece::new(*owner, sums))?;
        }
        self.writer.finish()
    }
}

/// Hands the sums of each component to `each`, components ascending.
///
/// # Errors
/// Those of `each` and of the sorter.
pub fn reduce(
    pieces: &Buckets<Piece>,
    sorter: &mut Sorter<Piece>,
    mut each: impl FnMut(u64, &Sums) -> Result<()>,
) -> Result<()> {
    let mut now: Option<(u64, Sums)> = None;
    pieces.sorted_all(sorter, &mut |batch| {
        for piece in batch {
            match &mut now {
                Some((component, sums)) if *component == piece.component => {
                    sums.merge(&piece.sums());
                }
                _ => {
                    if let Some((component, sums)) = now.replace((piece.component, piece.sums())) {
                        each(component, &sums)?;
                    }
                }
            }
        }
        Ok(())
    })?;
    match now {
        Some((component, sums)) => each(component, &sums),
        None => Ok(()),
    }
}
