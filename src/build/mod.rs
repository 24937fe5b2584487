//! The passes over a mesh larger than memory: one sequential pass, and a small remainder.
//!
//! 1. [`scan`]: reads V, checks it, finds the *seam vertices* that more than one chunk names.
//! 2. [`chunks`]: settles every edge with a non-seam vertex inside its chunk, swirls, writes V,
//!    O and local labels; spills the corners between seam vertices.
//! 3. [`seams`]: sorts the spilled corners by edge; finds the remaining opposites and the
//!    links between local components.
//! 4. [`stars`]: joins the fans of corners at seam vertices.
//! 5. [`stitch`]: joins local components with parity ([`graph`]); [`components`] sums and orients
//!    them.
//! 6. [`finish`]: applies labels, flips and the opposites from the seams.
//!
//! Passes meet only in files and records ([`records`]); this module hands them on.

pub mod appender;
pub mod arrays;
pub mod asked;
pub mod cells;
pub mod changes;
pub mod chunk_rows;
pub mod chunked;
pub mod chunks;
pub mod components;
pub mod coords;
pub mod cuts;
mod dealt;
pub mod deferred;
pub mod fill;
pub mod finish;
pub mod graph;
pub mod marks;
pub mod nodes;
pub mod piece;
pub mod plan;
pub mod records;
pub mod rows;
pub mod scan;
pub mod seams;
pub mod stars;
pub mod stitch;
pub mod tally;
pub mod whole;

mod assembling;
mod behind;
mod builder;
mod by_cells;
mod clock;
mod crowd;
mod first_read;
mod foretell;
mod identity;
mod in_order;
mod kept;
mod lists;
mod load;
mod phases;
mod pipeline;
mod predict;
mod read;
mod room;
mod sample;
mod settled_chunks;
mod staging;
mod steps;
mod tail;
mod way;
mod working;

pub use crate::disk::parent;
pub use builder::{Builder, Index as IndexChoice};
pub use clock::PassReport;
pub use load::PassPrediction;
pub use phases::Phase;
pub use pipeline::BuildReport;
pub use plan::Strategy;
pub use predict::Prediction;
pub use staging::{Former, Staging};
pub use working::state_of;

use self::graph::contract::Size;
use self::graph::labels::{Labels, labels_of};
use self::graph::union::Joins;
use self::plan::{MIN_SORT, Plan, Shape};
use self::steps::Opened;
use crate::corner::Index;
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::Result;
use crate::folder::Orient;
use crate::input::{CoordArray, Mesh};
use crate::shuffle;
use std::path::Path;

/// What every pass of one build knows.
pub struct Job<'a> {
    /// Memory, scratch, threads, counters, progress.
    pub ws: &'a Workspace,
    /// The input, opened.
    pub opened: &'a Opened,
    /// The input.
    pub mesh: &'a Mesh,
    /// The coordinates as they are stored in the new folder.
    pub g: Option<CoordArray>,
    /// Sizes of the mesh.
    pub shape: Shape,
    /// Sizes that the budget gave.
    pub plan: Plan,
    /// The folder under construction.
    pub dir: &'a Path,
    /// How to orient.
    pub orient: Orient,
    /// Which way to go, and how to join local components.
    pub strategy: Strategy,
}

/// The most memory that one sorter takes: more would leave the cache and gain nothing.
const MOST_SORT: u64 = 64 << 20;

impl Job<'_> {
    /// First triangle of a chunk and number of its triangles.
    pub fn chunk_range(&self, chunk: u64) -> (u64, u64) {
        let first = chunk * self.plan.chunk;
        (first, self.plan.chunk.min(self.shape.triangles - first))
    }

    /// Bytes of the flip bits of one chunk in scratch.
    pub fn flip_bytes(&self) -> u64 {
        self.plan.chunk.div_ceil(8)
    }

    /// True when V and O are written with flips applied.
    pub fn applies_flips(&self) -> bool {
        self.orient != Orient::Keep
    }

    /// Draws the scratch memory of all threads for one chunk each.
    fn chunk_lease(&self, what: &str) -> Result<Lease> {
        let chunk = self.plan.chunk.min(self.shape.triangles) + 64;
        let bytes = self.ws.workers.count() as u64 * chunk * self.shape.chunk_bytes();
        self.ws.budget.lease(what, bytes)
    }

    /// A plan for a shuffle of about `expected` records, one writer a thread.
    fn shuffle_plan(&self, record_bytes: usize, expected: u64) -> shuffle::Plan {
        let threads = self.ws.workers.count() as u64;
        let writer = self.plan.writer.min(self.ws.budget.free() / 8 / threads);
        if let Some(buckets) = self.plan.buckets {
            return shuffle::Plan::of(buckets, writer, record_bytes, expected);
        }
        let sort = (self.ws.budget.limit() / 4 / threads).min(MOST_SORT);
        shuffle::Plan::within(
            writer * threads,
            threads as usize,
            record_bytes,
            expected,
            sort,
        )
    }

    /// The same for a shuffle with one writer, whatever the number of threads.
    fn single_plan(&self, record_bytes: usize, expected: u64) -> shuffle::Plan {
        let mut plan = self.shuffle_plan(record_bytes, expected);
        plan.buckets = plan.buckets.min(256);
        plan
    }

    /// The labels of those of `nodes` nodes that a file lists, in its order.
    fn labels_of_list<W: Index>(
        &self,
        labels: &Labels<W>,
        nodes: u64,
        list: &ScratchFile,
    ) -> Result<ScratchFile> {
        let plan = self.single_plan(2 * W::BYTES, list.len() / W::BYTES as u64);
        let sort = self.sort_memory(2 * plan.writer_bytes());
        labels_of(self.ws, labels, (list, nodes), plan, sort)
    }

    /// Counts the sets that components are joined to, in memory or by contraction.
    fn joins<W: Index>(&self, components: u64) -> Result<Joins<'_, W>> {
        let fits = match self.strategy {
            Strategy::Auto => Joins::<W>::bytes(components) <= self.ws.budget.free() / 2,
            Strategy::Memory | Strategy::ByPlace | Strategy::ById => true,
            Strategy::Contract => false,
        };
        let size = (!fits).then(|| contraction_size::<W>(self, components));
        Joins::<W>::new(self.ws, components, size)
    }

    /// Memory of one thread's sorter when `reserved` bytes more are still to be drawn.
    fn sort_memory(&self, reserved: u64) -> u64 {
        // A quarter stays free for what a shuffle holds besides its buffers.
        let free = self.ws.budget.free().saturating_sub(reserved) / 4 * 3;
        (free / self.ws.workers.count() as u64).clamp(MIN_SORT, MOST_SORT)
    }
}

/// The memory of a contraction: what is free, but for blocks of records in passing. A test that
/// wants many buckets gets many runs of nodes.
fn contraction_size<W: Index>(job: &Job, nodes: u64) -> Size {
    let width = W::BYTES as u64;
    let memory = (job.ws.budget.free() / 8 * 7).max(Size::least(width));
    let mut size = Size::within(memory, nodes, width);
    if let Some(buckets) = job.plan.buckets {
        let run = nodes.div_ceil(buckets as u64).next_power_of_two();
        size.shift = size.shift.min(run.ilog2());
    }
    size
}

/// Bytes of a scratch file that are read at a time.
const SCRATCH_BLOCK: usize = 64 << 10;

/// Hands the records in a range of a scratch file to `each`, 64 KiB at a time.
fn scratch_items<T: bytemuck::Pod>(
    ws: &Workspace,
    file: &ScratchFile,
    at: u64,
    bytes: u64,
    each: &mut dyn FnMut(&[T]) -> Result<()>,
) -> Result<()> {
    let item = size_of::<T>() as u64;
    let per_block = (SCRATCH_BLOCK as u64 / item).max(1).min(bytes / item);
    let _lease = ws.budget.lease("a block of records", per_block * item)?;
    let mut block = vec![T::zeroed(); per_block as usize];
    let mut done = 0;
    while done < bytes {
        let n = per_block.min((bytes - done) / item) as usize;
        file.read_at(bytemuck::cast_slice_mut(&mut block[..n]), at + done)?;
        each(&block[..n])?;
        done += n as u64 * item;
    }
    Ok(())
}

/// Hands all records in a scratch file to `each`, 64 KiB at a time, and frees what was read: for
/// files that nobody reads again. What the file system, or a journal, does not let go of stays until
/// the file is dropped.
fn consumed_items<T: bytemuck::Pod>(
    ws: &Workspace,
    file: &ScratchFile,
    each: &mut dyn FnMut(&[T]) -> Result<()>,
) -> Result<()> {
    let (mut read, mut freed) = (0, 0);
    let bytes = file.len();
    scratch_items(ws, file, 0, bytes, &mut |items: &[T]| {
        each(items)?;
        read += size_of_val(items) as u64;
        freed += file.free_before(freed, read);
        Ok(())
    })
}
