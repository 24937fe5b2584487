//! The corners on non-manifold edges, sorted, each with the label of its local component: which
//! components they join, and where they do not cancel.
//!
//! Why it works: sorted by edge, all corners of an edge come together; their local components come
//! in any order, so labels are looked up all at once (through a sort, when they are in a
//! file) and kept beside the corners. A component's own corners cancel at an edge when as many
//! run it one way as the other: they are sorted by (component, edge) and counted.
//!
//! Memory: sorters and writers; 8 bytes a component, or a contraction. I/O: the corners twice
//! more, a word for the label of each, 24 bytes for its side.

use super::appender::{Appender, BLOCK};
use super::graph::labels::{Labels, split};
use super::nodes::Nodes;
use super::records::EdgeCorner;
use super::{Job, SCRATCH_BLOCK, scratch_items};
use crate::corner::Index;
use crate::disk::{Budget, Lease, ScratchFile};
use crate::error::Result;
use crate::shuffle::{Buckets, Record, Shuffle};
use bytemuck::{Pod, Zeroable};

/// The corners, sorted by edge and corner.
pub struct Cuts {
    corners: ScratchFile,
    labels: ScratchFile,
}

/// A corner of a component on a non-manifold edge: component, edge, 1 or -1.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Side([u64; 3]);

impl Record for Side {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        self.0[level]
    }
}

/// What is done with a corner and its (component, flip).
pub type EachCut<'a, W> = dyn FnMut(&EdgeCorner<W>, (u64, bool)) -> Result<()> + 'a;

/// Local components that are written at a time.
const RUN: usize = 4 << 10;

impl Cuts {
    /// Sorts the corners by edge and corner, and finds the labels of their local components.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn sorted<W: Index>(
        job: &Job,
        nodes: &Nodes,
        labels: &Labels<W>,
        cuts: &Buckets<EdgeCorner<W>>,
    ) -> Result<Cuts> {
        let ws = job.ws;
        let corners = ws.scratch.file("sorted corners of non-manifold edges")?;
        let locals = ws.scratch.file("local components at non-manifold edges")?;
        let lease = ws
            .budget
            .lease("local components", (RUN * W::BYTES) as u64)?;
        let mut block: Vec<W> = Vec::with_capacity(RUN);
        let mut sorter = cuts.sorter(job.sort_memory(0))?;
        cuts.sorted_all(&mut sorter, &mut |batch| {
            corners.append(bytemuck::cast_slice(batch))?;
            for some in batch.chunks(RUN) {
                block.clear();
                let local = |corner| W::of(nodes.of_corner(corner));
                block.extend(some.iter().map(local));
                locals.append(bytemuck::cast_slice(&block))?;
            }
            Ok(())
        })?;
        drop((sorter, block, lease));
        let labels = job.labels_of_list(labels, nodes.count(), &locals)?;
        Ok(Cuts { corners, labels })
    }

    /// Number of corners.
    pub fn count<W: Index>(&self) -> u64 {
        self.corners.len() / size_of::<EdgeCorner<W>>() as u64
    }

    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Hands the corners to `each`, in their order.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], and those of `each`.
    pub fn each<W: Index>(&self, job: &Job, each: &mut EachCut<W>) -> Result<()> {
        let mut at = 0;
        let _lease = job
            .ws
            .budget
            .lease("labels of corners", SCRATCH_BLOCK as u64)?;
        let mut block: Vec<W> = Vec::new();
        let (file, bytes) = (&self.corners, self.corners.len());
        scratch_items(job.ws, file, 0, bytes, &mut |corners: &[EdgeCorner<
            W,
        >]| {
            block.resize(corners.len(), W::NONE);
            self.labels
                .read_at(bytemuck::cast_slice_mut(&mut block), at)?;
            at += (corners.len() * W::BYTES) as u64;
            let mut pairs = corners.iter().zip(&block);
            pairs.try_for_each(|(corner, &label)| each(corner, split(label)))
        })
    }

    /// The number of sets of components when the edges join them.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn join<W: Index>(&self, job: &Job, components: u64) -> Result<u64> {
        let mut joins = job.joins::<W>(components)?;
        let (mut edge, mut before) = (None, 0);
        self.each(job, &mut |corner: &EdgeCorner<W>, (component, _)| {
            if edge.replace(corner.edge()) == Some(corner.edge()) {
                joins.join(before, component)?;
            }
            before = component;
            Ok(())
        })?;
        joins.sets()
    }

    /// Counts the corners of each component, and finds the components whose corners do not
    /// cancel at some edge: [`CutCount`]s by component, ascending.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn counts<W: Index>(&self, job: &Job, labels: &Labels<W>) -> Result<CutCounts> {
        let ws = job.ws;
        let file = ws
            .scratch
            .file("corners of components at non-manifold edges")?;
        let sides = self.sides(job, labels)?;
        let _lease = ws.budget.lease("counts of corners", BLOCK as u64)?;
        let mut counts = Appender::<CutCount>::new(&file);
        let (mut at, mut balance) = ((0, 0), 0u64);
        let mut now = CutCount::zeroed();
        let mut sorter = sides.sorter(job.sort_memory(0))?;
        sides.sorted_all(&mut sorter, &mut |batch| {
            for &Side([component, edge, side]) in batch {
                if at != (component, edge) {
                    now.unbalanced |= u64::from(balance != 0);
                    (at, balance) = ((component, edge), 0);
                }
                if now.component != component {
                    if now.cuts > 0 {
                        counts.push(now)?;
                    }
                    now = CutCount::zeroed();
                    now.component = component;
                }
                now.cuts += 1;
                balance = balance.wrapping_add(side);
            }
            Ok(())
        })?;
        now.unbalanced |= u64::from(balance != 0);
        if now.cuts > 0 {
            counts.push(now)?;
        }
        counts.flush()?;
        CutCounts::new(&ws.budget, file)
    }

    /// The corners by component and edge, each with its direction.
    fn sides<W: Index>(&self, job: &Job, labels: &Labels<W>) -> Result<Buckets<Side>> {
        let plan = job.single_plan(size_of::<Side>(), self.count::<W>());
        let (what, keys) = ("sides of non-manifold edges", 0..labels.components.max(1));
        let sides = Shuffle::<Side>::new(job.ws, what, keys, plan)?;
        let mut writer = sides.writer()?;
        let (mut edge, mut ordinal) = (None, 0u64);
        self.each(job, &mut |corner: &EdgeCorner<W>, (component, flip)| {
            if edge.replace(corner.edge()) != Some(corner.edge()) {
                ordinal += 1;
            }
            // The directions of the finished table: the input's, where nothing is turned. (A
            // component turned as a whole has them all reversed, which cancels as well.)
            let down = if !job.applies_flips() || labels.nonorientable.get(component) {
                corner.input_down()
            } else {
                corner.down() ^ flip
            };
            writer.push(Side([component, ordinal, if down { 1 } else { u64::MAX }]))
        })?;
        writer.finish()?;
        sides.finish()
    }
}

/// What a component has to do with non-manifold edges.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct CutCount {
    component: u64,
    /// Its corners on them.
    pub cuts: u64,
    /// 1 when its corners do not cancel at some edge.
    pub unbalanced: u64,
}

/// [`CutCount`]s, asked for in ascending order of components.
pub struct CutCounts {
    file: ScratchFile,
    block: Vec<CutCount>,
    next: usize,
    at: u64,
    _lease: Lease,
}

impl CutCounts {
    /// Counts read at a time.
    const READ: usize = 1 << 10;

    fn new(budget: &Budget, file: ScratchFile) -> Result<CutCounts> {
        let bytes = (Self::READ * size_of::<CutCount>()) as u64;
        Ok(CutCounts {
            _lease: budget.lease("counts of corners", bytes)?,
            file,
            block: Vec::new(),
            next: 0,
            at: 0,
        })
    }

    /// The count of a component, which is greater than all that were asked for before.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn of(&mut self, component: u64) -> Result<CutCount> {
        if self.next == self.block.len() {
            let item = size_of::<CutCount>() as u64;
            let left = (self.file.len() - self.at) / item;
            self.block
                .resize((Self::READ as u64).min(left) as usize, CutCount::zeroed());
            let bytes = bytemuck::cast_slice_mut(&mut self.block);
            self.file.read_at(bytes, self.at)?;
            self.at += self.block.len() as u64 * item;
            self.next = 0;
        }
        match self.block.get(self.next) {
            Some(&count) if count.component == component => {
                self.next += 1;
                Ok(count)
            }
            _ => Ok(CutCount {
                component,
                ..CutCount::zeroed()
            }),
        }
    }
}
