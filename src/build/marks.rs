//! Marks: what a component has one by one, as later passes find it: border edges and loops between
//! chunks, rings, fans that meet another of its own, corners on non-manifold edges.
//!
//! Why apart from the [sums](super::tally): there may be several for each component of a crowd, and
//! a mark is a word and a number where a sum is many. Sorted by component they lie in a file, and
//! are taken up where the sums of the component are.
//!
//! Memory: a table of `SLOT` bytes a slot, a writer, later a block. I/O: 2 words for each number
//! that leaves the table, written and read twice.

use super::appender::{Appender, BLOCK, Records};
use super::graph::labels::{Labels, split};
use super::{Job, scratch_items};
use crate::corner::Index;
use crate::disk::{Budget, Lease, ScratchFile};
use crate::error::Result;
use crate::shuffle::{Buckets, Record, Shuffle, Writer};
use bytemuck::{Pod, Zeroable};

/// What is marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A border edge.
    Border,
    /// A fan that is a ring.
    Ring,
    /// A loop of corners without opposite.
    Loop,
    /// A fan that meets another of the component at their vertex.
    Again,
    /// A corner on a non-manifold edge.
    Cut,
    /// A non-manifold edge where the component's corners do not cancel.
    Unbalanced,
}

const KINDS: usize = 6;
/// Bits of the kind.
const BITS: u64 = 3;

/// How often each kind was marked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Marked([u64; KINDS]);

impl Marked {
    /// How often one was.
    pub fn of(&self, kind: Kind) -> u64 {
        self.0[kind as usize]
    }
}

/// `8 * component + kind`, and how often.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Mark<W>([W; 2]);

impl<W: Index> Mark<W> {
    fn component(&self) -> u64 {
        self.0[0].wide() >> BITS
    }
}

impl<W: Index> Record for Mark<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.component()
    }
}

/// Where marks go.
///
/// # Errors
/// [`crate::Error::Internal`] for a plan beyond what a writer numbers.
pub fn marks<W: Index>(job: &Job, components: u64) -> Result<Shuffle<Mark<W>>> {
    let plan = job.single_plan(size_of::<Mark<W>>(), components);
    Shuffle::new(job.ws, "marks by component", 0..components.max(1), plan)
}

/// Takes marks, and adds up those of a component while it can.
pub struct Marker<'a, W> {
    slots: Vec<(u64, Marked)>,
    writer: Writer<'a, Mark<W>>,
    _lease: Lease,
}

/// No component: the slot is free.
const FREE: u64 = u64::MAX;
/// Bytes of a slot.
const SLOT: u64 = size_of::<(u64, Marked)>() as u64;
/// Slots at most: more would leave the cache.
const MOST_SLOTS: u64 = 4 << 10;

impl<'a, W: Index> Marker<'a, W> {
    /// A table before the shuffle `to`, of no more slots than `components`.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, components: u64, to: &'a Shuffle<Mark<W>>) -> Result<Self> {
        let most = (budget.free() / 32 / SLOT).clamp(1, MOST_SLOTS);
        let slots = (1u64 << most.ilog2()).min(components.max(1).next_power_of_two());
        Ok(Marker {
            _lease: budget.lease("marks by component", slots * SLOT)?,
            slots: vec![(FREE, Marked::default()); slots as usize],
            writer: to.writer()?,
        })
    }

    /// Marks a component so often.
    ///
    /// # Errors
    /// As a push to the shuffle.
    #[inline]
    pub fn mark(&mut self, component: u64, kind: Kind, times: u64) -> Result<()> {
        let slot = (component & (self.slots.len() as u64 - 1)) as usize;
        if self.slots[slot].0 != component {
            self.send(slot)?;
            self.slots[slot] = (component, Marked::default());
        }
        self.slots[slot].1.0[kind as usize] += times;
        Ok(())
    }

    fn send(&mut self, slot: usize) -> Result<()> {
        let (component, marked) = self.slots[slot];
        for (kind, &times) in (0..).zip(&marked.0).filter(|(_, times)| **times > 0) {
            let mark = [component << BITS | kind, times].map(W::of);
            self.writer.push(Mark(mark))?;
        }
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

/// Marks the components of the local components whose numbers are in a file.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn mark_all<W: Index>(
    job: &Job,
    (labels, nodes): (&Labels<W>, u64),
    list: &ScratchFile,
    kind: Kind,
    to: &Shuffle<Mark<W>>,
) -> Result<()> {
    if list.is_empty() {
        return Ok(());
    }
    let found = job.labels_of_list(labels, nodes, list)?;
    let mut marker = Marker::new(&job.ws.budget, labels.components, to)?;
    scratch_items(job.ws, &found, 0, found.len(), &mut |labels: &[W]| {
        let mut components = labels.iter().map(|&label| split(label).0);
        components.try_for_each(|component| marker.mark(component, kind, 1))
    })?;
    marker.finish()
}

/// The marks of components that are asked for in ascending order.
pub struct Told<W> {
    file: ScratchFile,
    marks: Records<Mark<W>>,
}

impl<W: Index> Told<W> {
    /// Sorts all marks.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn new(job: &Job, marks: &Buckets<Mark<W>>) -> Result<Told<W>> {
        let file = job.ws.scratch.file("sorted marks")?;
        let _lease = job.ws.budget.lease("marks by component", BLOCK as u64)?;
        let mut sorted = Appender::<Mark<W>>::new(&file);
        let mut sorter = marks.sorter(job.sort_memory(0))?;
        marks.sorted_all(&mut sorter, &mut |batch| {
            batch.iter().try_for_each(|&mark| sorted.push(mark))
        })?;
        sorted.flush()?;
        drop(sorted);
        Ok(Told {
            file,
            marks: Records::new(&job.ws.budget)?,
        })
    }

    /// The marks of a component, which is greater than all that were asked for before.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn of(&mut self, component: u64) -> Result<Marked> {
        let mut found = Marked::default();
        while let Some(mark) = self.marks.peek(&self.file)? {
            if mark.component() > component {
                break;
            }
            let kind = mark.0[0].wide() & ((1 << BITS) - 1);
            found.0[kind as usize] += mark.0[1].wide();
            self.marks.take();
        }
        Ok(found)
    }
}
