//! Sums by component, for any number of components in bounded memory.
//!
//! Why it works: a thread gathers into a table indexed by the low bits of the component; a
//! component that finds its place taken sends the former owner's sums to the shuffle. All sums
//! are integers, minima or maxima, so it does not matter in how many pieces they arrive; the
//! shuffle brings the pieces of a component together. Few components never spill.
//!
//! Memory: a table of [`SLOT`] bytes a slot and one writer for each thread. I/O: what leaves a table,
//! in [pieces](super::piece), written and read once.

use super::Job;
use super::piece::Piece;
use super::records::LocalCount;
use crate::chunk::grid::Grid;
use crate::chunk::measure::Measure;
use crate::disk::{Budget, Lease};
use crate::error::Result;
use crate::shuffle::{Buckets, Shuffle, Sorter, Writer};

/// The geometry of a component, or of a part of it, oriented like the component's first triangle.
#[derive(Clone, Copy, Debug, Default)]
pub enum Measured {
    /// Nothing.
    #[default]
    Nothing,
    /// The corners of one triangle, and whether it is flipped against the first.
    One([[f64; 3]; 3], bool),
    /// The sums of several.
    Many(Measure),
}

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
    /// Geometry.
    pub measured: Measured,
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
            measured: Measured::Nothing,
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
        let borders = local.borders & !LocalCount::CONFLICT;
        self.rims([borders, local.rings, local.loops].map(u64::from));
    }

    /// Counts a triangle that is a local component of its own, and flipped, or not, against the
    /// component's first.
    pub fn count_alone(&mut self, t: u64, flip: bool) {
        self.first = self.first.min(t);
        self.triangles += 1;
        self.flipped += u64::from(flip);
    }

    /// Counts borders, rings and loops.
    #[inline]
    pub fn rims(&mut self, [borders, rings, loops]: [u64; 3]) {
        self.borders += borders;
        self.rings += rings;
        self.loops += loops;
    }

    /// Measures one triangle: see [`Measure::add`].
    #[inline]
    pub fn add(&mut self, grid: &Grid, corners: [[f64; 3]; 3], flip: bool) {
        match &mut self.measured {
            Measured::Nothing => self.measured = Measured::One(corners, flip),
            Measured::Many(measure) => measure.add(grid, corners, flip),
            Measured::One(..) => {
                let mut both = self.measure(grid);
                both.add(grid, corners, flip);
                self.measured = Measured::Many(both);
            }
        }
    }

    /// Takes in what others measured: see [`Measure::merge`].
    pub fn merge_measure(&mut self, grid: &Grid, other: &Measure, flip: bool) {
        let mut both = self.measure(grid);
        both.merge(other, flip);
        self.measured = Measured::Many(both);
    }

    /// The measure of all.
    pub fn measure(&self, grid: &Grid) -> Measure {
        match self.measured {
            Measured::Nothing => Measure::default(),
            Measured::One(corners, flip) => {
                let mut measure = Measure::default();
                measure.add(grid, corners, flip);
                measure
            }
            Measured::Many(measure) => measure,
        }
    }
}

/// Where sums go.
pub struct Pieces<'a> {
    shuffle: Shuffle<Piece>,
    /// The grid of volumes.
    pub grid: &'a Grid,
    /// Number of components.
    pub components: u64,
    /// Bytes of each thread's table.
    pub memory: u64,
    budget: &'a Budget,
}

impl<'a> Pieces<'a> {
    /// None yet, of so many components.
    ///
    /// # Errors
    /// [`crate::Error::Internal`] for a plan beyond what a writer numbers.
    pub fn new(job: &Job<'a>, grid: &'a Grid, components: u64) -> Result<Pieces<'a>> {
        let ws = job.ws;
        let plan = job.shuffle_plan(size_of::<Piece>(), components);
        let keys = 0..components.max(1);
        Ok(Pieces {
            shuffle: Shuffle::new(ws, "sums by component", keys, plan)?,
            grid,
            components,
            memory: ws.budget.free() / 16 / ws.workers.count() as u64,
            budget: &ws.budget,
        })
    }

    /// A thread's table.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn tally(&self) -> Result<Tally<'_>> {
        let most = (self.memory / SLOT).max(1);
        let slots = (1u64 << most.ilog2()).min(self.components.max(1).next_power_of_two());
        Ok(Tally {
            _lease: self.budget.lease("sums by component", slots * SLOT)?,
            slots: vec![(FREE, Sums::default()); slots as usize],
            writer: self.shuffle.writer()?,
            grid: self.grid,
        })
    }

    /// All tables are finished.
    ///
    /// # Errors
    /// As [`Shuffle::finish`].
    pub fn finish(self) -> Result<Buckets<Piece>> {
        self.shuffle.finish()
    }
}

/// One thread's table.
pub struct Tally<'a> {
    slots: Vec<(u64, Sums)>,
    writer: Writer<'a, Piece>,
    grid: &'a Grid,
    _lease: Lease,
}

/// No component: the slot is free.
const FREE: u64 = u64::MAX;
/// Bytes of a slot.
pub const SLOT: u64 = size_of::<(u64, Sums)>() as u64;

impl Tally<'_> {
    /// The sums to add to for a component.
    ///
    /// # Errors
    /// As a push to the shuffle.
    #[inline]
    pub fn at(&mut self, component: u64) -> Result<&mut Sums> {
        let slot = (component & (self.slots.len() as u64 - 1)) as usize;
        if self.slots[slot].0 != component {
            self.send(slot)?;
            self.slots[slot] = (component, Sums::default());
        }
        Ok(&mut self.slots[slot].1)
    }

    /// Sends what a slot holds to the shuffle.
    fn send(&mut self, slot: usize) -> Result<()> {
        let (owner, sums) = &self.slots[slot];
        if *owner == FREE {
            return Ok(());
        }
        let writer = &mut self.writer;
        Piece::all_of(*owner, sums, self.grid, &mut |piece| writer.push(piece))
    }

    /// Measures one triangle of a component: see [`Sums::add`].
    ///
    /// # Errors
    /// As a push to the shuffle.
    #[inline]
    pub fn add(&mut self, component: u64, corners: [[f64; 3]; 3], flip: bool) -> Result<()> {
        let grid = self.grid;
        self.at(component)?.add(grid, corners, flip);
        Ok(())
    }

    /// Takes in a measure of a part of a component: see [`Sums::merge_measure`].
    ///
    /// # Errors
    /// As a push to the shuffle.
    pub fn merge(&mut self, component: u64, other: &Measure, flip: bool) -> Result<()> {
        let grid = self.grid;
        self.at(component)?.merge_measure(grid, other, flip);
        Ok(())
    }

    /// Sends what is left to the shuffle.
    ///
    /// # Errors
    /// As a push to the shuffle.
    pub fn finish(mut self) -> Result<()> {
        (0..self.slots.len()).try_for_each(|slot| self.send(slot))?;
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
    grid: &Grid,
    mut each: impl FnMut(u64, &Sums) -> Result<()>,
) -> Result<()> {
    let mut now: Option<(u64, Sums)> = None;
    pieces.sorted_all(sorter, &mut |batch| {
        for piece in batch {
            let component = piece.component();
            if let Some((done, sums)) = now.take_if(|(other, _)| *other != component) {
                each(done, &sums)?;
            }
            let (_, sums) = now.get_or_insert((component, Sums::default()));
            piece.add_to(sums, grid);
        }
        Ok(())
    })?;
    match now {
        Some((component, sums)) => each(component, &sums),
        None => Ok(()),
    }
}
