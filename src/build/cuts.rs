//! The corners on non-manifold edges, sorted, each with the label of its local component: which
//! components they join, and where they do not cancel.
//!
//! Why it works: sorted by edge, all corners of an edge come together, so that the edge is written
//! once for all of them; their local components come in any order, so labels are looked up all at
//! once (through a sort, when they are in a file) and kept beside the corners. A component's own
//! corners cancel at an edge when as many run it one way as the other: they are sorted by
//! (component, edge) and counted.
//!
//! Memory: sorters and writers; 8 bytes a component, or a contraction. I/O: 2 words a corner and 3
//! an edge, a word for the label of each corner, 2 for its side.

use super::appender::{Appender, BLOCK, Records};
use super::graph::labels::{Labels, split};
use super::marks::{Kind, Mark, Marker};
use super::nodes::Nodes;
use super::records::EdgeCorner;
use super::{Job, SCRATCH_BLOCK, scratch_items};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Record, Shuffle};
use bytemuck::{Pod, Zeroable};

/// The corners, sorted by edge and corner.
pub struct Sorted {
    /// [`Edge`]s.
    edges: ScratchFile,
    /// [`Corner`]s.
    corners: ScratchFile,
}

/// The sorted corners with the labels of their local components.
pub struct Cuts {
    sorted: Sorted,
    labels: ScratchFile,
}

/// A non-manifold edge: its vertices, and how many corners face it.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Edge<W>([W; 3]);

/// What an [`EdgeCorner`] has besides its edge.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Corner<W>([W; 2]);

/// A corner of a component on a non-manifold edge: component; twice the edge's number, and 1 when
/// the corner runs it downwards.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Side<W>([W; 2]);

impl<W: Index> Record for Side<W> {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// What is done with a corner and its (component, flip).
pub type EachCut<'a, W> = dyn FnMut(&EdgeCorner<W>, (u64, bool)) -> Result<()> + 'a;

impl Sorted {
    /// Sorts the corners by edge and corner.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn new<W: Index>(job: &Job, cuts: &Buckets<EdgeCorner<W>>) -> Result<Sorted> {
        let ws = job.ws;
        let edges = ws.scratch.file("non-manifold edges")?;
        let corners = ws.scratch.file("corners of non-manifold edges")?;
        let what = "corners of non-manifold edges";
        let _lease = ws.budget.lease(what, 2 * BLOCK as u64)?;
        let mut to = Splitter::<W> {
            edges: Appender::new(&edges),
            corners: Appender::new(&corners),
            edge: Edge::zeroed(),
        };
        let mut sorter = cuts.sorter(job.sort_memory(0))?;
        cuts.sorted_all(&mut sorter, &mut |batch| {
            batch.iter().try_for_each(|corner| to.take(corner))
        })?;
        to.finish()?;
        Ok(Sorted { edges, corners })
    }
}

impl Keep for Sorted {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.file(&self.edges)?;
        to.file(&self.corners)
    }

    fn restore(from: &mut Reader) -> Result<Sorted> {
        Ok(Sorted {
            edges: from.file()?,
            corners: from.file()?,
        })
    }
}

impl Keep for Cuts {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.sorted.keep(to)?;
        to.file(&self.labels)
    }

    fn restore(from: &mut Reader) -> Result<Cuts> {
        Ok(Cuts {
            sorted: Sorted::restore(from)?,
            labels: from.file()?,
        })
    }
}

impl Cuts {
    /// Finds the labels of the corners' local components.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn labelled<W: Index>(
        job: &Job,
        sorted: Sorted,
        nodes: &Nodes,
        labels: &Labels<W>,
    ) -> Result<Cuts> {
        let ws = job.ws;
        let locals = ws.scratch.file("local components at non-manifold edges")?;
        {
            let _lease = ws.budget.lease("local components", BLOCK as u64)?;
            let mut list = Appender::<W>::new(&locals);
            let (file, bytes) = (&sorted.corners, sorted.corners.len());
            scratch_items(ws, file, 0, bytes, &mut |corners: &[Corner<W>]| {
                corners.iter().try_for_each(|&Corner(corner)| {
                    let corner = EdgeCorner::of_halves([W::NONE; 2], corner);
                    list.push(W::of(nodes.of_corner(&corner)))
                })
            })?;
            list.flush()?;
        }
        let labels = job.labels_of_list(labels, nodes.count(), &locals)?;
        Ok(Cuts { sorted, labels })
    }

    /// Number of corners.
    pub fn count<W: Index>(&self) -> u64 {
        self.sorted.corners.len() / size_of::<Corner<W>>() as u64
    }

    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.sorted.corners.is_empty()
    }

    /// Hands the corners to `each`, in their order.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], and those of `each`.
    pub fn each<W: Index>(&self, job: &Job, each: &mut EachCut<W>) -> Result<()> {
        let mut at = 0;
        let budget = &job.ws.budget;
        let _lease = budget.lease("labels of corners", SCRATCH_BLOCK as u64)?;
        let mut edges = Records::<Edge<W>>::new(budget)?;
        let mut block: Vec<W> = Vec::new();
        let (file, bytes) = (&self.sorted.corners, self.sorted.corners.len());
        let (mut ends, mut left) = ([W::NONE; 2], 0);
        scratch_items(job.ws, file, 0, bytes, &mut |corners: &[Corner<W>]| {
            block.resize(corners.len(), W::NONE);
            self.labels
                .read_at(bytemuck::cast_slice_mut(&mut block), at)?;
            at += (corners.len() * W::BYTES) as u64;
            for (&Corner(corner), &label) in corners.iter().zip(&block) {
                if left == 0
                    && let Some(Edge([lo, hi, count])) = edges.peek(&self.sorted.edges)?
                {
                    (ends, left) = ([lo, hi], count.wide());
                    edges.take();
                }
                left = match u64::checked_sub(left, 1) {
                    Some(left) => left,
                    None => return conserve("components", "corners of edges", at, 0),
                };
                each(&EdgeCorner::of_halves(ends, corner), split(label))?;
            }
            Ok(())
        })?;
        conserve("components", "corners of the last edge", 0, left)
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

    /// Marks the corners of each component, and the edges at which its corners do not cancel.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn mark<W: Index>(
        &self,
        job: &Job,
        labels: &Labels<W>,
        to: &Shuffle<Mark<W>>,
    ) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        let sides = self.sides(job, labels)?;
        let mut marker = Marker::new(&job.ws.budget, labels.components, to)?;
        let (mut at, mut balance) = ((0, 0), 0i64);
        let mut sorter = sides.sorter(job.sort_memory(0))?;
        sides.sorted_all(&mut sorter, &mut |batch| {
            for Side([component, side]) in batch {
                let (component, edge) = (component.wide(), side.wide() >> 1);
                if at != (component, edge) {
                    if balance != 0 {
                        marker.mark(at.0, Kind::Unbalanced, 1)?;
                    }
                    (at, balance) = ((component, edge), 0);
                }
                balance += if side.wide() & 1 == 1 { 1 } else { -1 };
                marker.mark(component, Kind::Cut, 1)?;
            }
            Ok(())
        })?;
        if balance != 0 {
            marker.mark(at.0, Kind::Unbalanced, 1)?;
        }
        marker.finish()
    }

    /// The corners by component and edge, each with its direction.
    fn sides<W: Index>(&self, job: &Job, labels: &Labels<W>) -> Result<Buckets<Side<W>>> {
        let plan = job.single_plan(size_of::<Side<W>>(), self.count::<W>());
        let (what, keys) = ("sides of non-manifold edges", 0..labels.components.max(1));
        let sides = Shuffle::<Side<W>>::new(job.ws, what, keys, plan)?;
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
            let side = ordinal << 1 | u64::from(down);
            writer.push(Side([component, side].map(W::of)))
        })?;
        writer.finish()?;
        sides.finish()
    }
}

/// The sorted corners on their way to files.
struct Splitter<'a, W> {
    edges: Appender<'a, Edge<W>>,
    corners: Appender<'a, Corner<W>>,
    /// The edge whose corners are arriving.
    edge: Edge<W>,
}

impl<W: Index> Splitter<'_, W> {
    fn take(&mut self, corner: &EdgeCorner<W>) -> Result<()> {
        let ([lo, hi], rest) = corner.halves();
        let Edge([own_lo, own_hi, count]) = self.edge;
        if (own_lo, own_hi) != (lo, hi) {
            self.close()?;
            self.edge = Edge([lo, hi, W::of(1)]);
        } else {
            self.edge = Edge([lo, hi, W::of(count.wide() + 1)]);
        }
        self.corners.push(Corner(rest))
    }

    /// All corners of the edge have come.
    fn close(&mut self) -> Result<()> {
        let Edge([_, _, count]) = self.edge;
        // No edge runs from a vertex to itself, so none is taken for the one before the first.
        match count.wide() {
            0 => Ok(()),
            _ => self.edges.push(self.edge),
        }
    }

    fn finish(mut self) -> Result<()> {
        self.close()?;
        self.edges.flush()?;
        self.corners.flush()
    }
}
