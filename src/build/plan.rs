//! How the budget is cut up: chunk size, bits of the scan, buckets. None of it reaches the
//! output; only the memory and the time depend on it.
//!
//! Why the sizes: half of the budget goes to the chunks of all threads (larger chunks have
//! fewer seams), a quarter at most to the bits that find the seam vertices, and the writers of
//! the seam records get a sixteenth each. Passes after the chunks have the whole budget again.

use super::graph::contract::Size;
use super::records::narrow;
use super::stars::spill;
use crate::chunk::ids::{NARROW_SPAN, TABLE_BYTES};
use crate::chunk::measure::Measurer;
use crate::chunk::star::Stars;
use crate::error::{Error, Result};
use crate::folder::fits_u4;
use crate::input::CoordKind;

/// The largest chunk, in triangles: beyond it, chunks leave the cache and gain nothing.
const MAX_CHUNK: u64 = 512 << 10;
/// The smallest chunk that the plan chooses by itself.
const MIN_CHUNK: u64 = 1 << 10;
/// The least that one writer's buffers of a shuffle take.
const MIN_WRITER: u64 = 64 << 10;
/// The least memory for one sorter of a shuffle.
pub const MIN_SORT: u64 = 256 << 10;

/// Sizes that depend on the mesh.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// T.
    pub triangles: u64,
    /// N.
    pub vertices: u64,
    /// Bytes of an index in the folder: 4 or 8.
    pub index: u64,
    /// Bytes of a coordinate, or 0 without coordinates.
    pub coord: u64,
    /// Threads.
    pub threads: u64,
    /// True when vertices are measured.
    pub measures: bool,
}

/// Which way a build goes, and how local components are joined. The output does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// What suits the mesh and the budget.
    #[default]
    Auto,
    /// Through cells of vertices near in space, where there are coordinates; else by id.
    ByPlace,
    /// Through cells of vertices near in number; joined in memory, or refused.
    ById,
    /// In file order; joined in memory, or refused.
    Memory,
    /// In file order; joined by contraction, labels in a file.
    Contract,
}

/// The sizes that a build uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Triangles of a chunk.
    pub chunk: u64,
    /// Triangles that are measured again at a time, where a chunk did not measure its own.
    pub again: u64,
    /// Bits in each of the scan's two arrays.
    pub bits: u64,
    /// Memory of one writer of seam records, in bytes.
    pub writer: u64,
    /// Buckets when the user (a test) wants a number of them.
    pub buckets: Option<usize>,
}

/// Bytes of a field in a scratch record, at most.
const MOST_WIDTH: u64 = 8;
/// What a writer of a shuffle keeps in memory at most when it wrote nothing.
const KEPT: u64 = 256 << 10;
/// One part in so many of the budget is left for blocks of records in passing, and for what
/// shuffles note of more records than they were told to expect.
const SLACK: u64 = 16;

fn with_slack(bytes: u64) -> u64 {
    bytes.div_ceil(SLACK - 1) * SLACK + (64 << 10)
}

/// The least budget for any mesh on so many threads, but for the table of its chunks and the
/// bits of its components: a chunk of the least size, the widest types, a few bits, the least
/// sorters and writers, measures and all.
pub fn least(threads: u64) -> u64 {
    let widest = Shape {
        triangles: 1 << 40,
        vertices: 1 << 40,
        index: 8,
        coord: 8,
        threads,
        measures: true,
    };
    let plan = Plan {
        chunk: MIN_CHUNK,
        again: MIN_CHUNK,
        bits: 1 << 16,
        writer: MIN_WRITER,
        buckets: None,
    };
    // The seam pass sorts, and writes three kinds of records, on every thread.
    let seams = threads * (MIN_SORT + 8 * MIN_WRITER);
    let after = widest.least_after_chunks(&plan, 0, 0);
    // What comes after the chunks grows a little with the budget.
    with_slack(widest.pass_bytes(&plan).max(seams)).max(after + after / 6)
}

/// Refuses a budget below the least for any mesh.
///
/// # Errors
/// [`Error::Budget`].
pub fn check_least(memory: u64, threads: u64) -> Result<()> {
    let need = least(threads);
    if memory < need {
        return Err(Error::Budget {
            what: format!("a build on {threads} threads"),
            need,
            have: memory,
        });
    }
    Ok(())
}

impl Shape {
    /// The shape of a mesh whose indices are 8 bytes when its counts, or the user, demand it.
    pub fn new(
        triangles: u64,
        vertices: u64,
        wide: bool,
        coords: Option<CoordKind>,
        threads: usize,
        measures: bool,
    ) -> Shape {
        let wide = wide || !fits_u4(triangles, vertices);
        Shape {
            triangles,
            vertices,
            index: if wide { 8 } else { 4 },
            coord: coords.map_or(0, CoordKind::bytes),
            threads: threads as u64,
            measures,
        }
    }

    /// Bytes of an id in a record: 4 while all packed fields fit, else 8, whatever the folder has.
    pub fn record(&self) -> u64 {
        if self.index == 4 && narrow(self.triangles, self.vertices) {
            4
        } else {
            8
        }
    }

    /// Bytes of scratch memory that the chunk pass holds for each triangle of a chunk, at worst:
    /// readers, local ids, lists, results, output rows.
    pub fn chunk_bytes(&self) -> u64 {
        let reader = 24 + 3 * self.index;
        let ids = 12 + TABLE_BYTES + NARROW_SPAN;
        let pairs = 12 + 24 + 12 + 12 + 4 * NARROW_SPAN;
        let swirl = 4 + 4 + 20;
        let counts = 16 + 8;
        let out = 4 * self.index;
        let positions = NARROW_SPAN * (24 + 3 * self.coord + Measurer::BYTES);
        let stars = 3 * Stars::VERTEX_BYTES + Stars::TRIANGLE_BYTES + 8;
        let at_most = |bytes: u64, wanted: bool| if wanted { bytes } else { 0 };
        reader
            + ids
            + pairs
            + swirl
            + counts
            + out
            + at_most(positions, self.coord > 0)
            + at_most(stars, self.measures)
    }

    /// Bytes of each thread's writers and blocks in the chunk pass.
    pub fn writer_bytes(&self, plan: &Plan) -> u64 {
        let stars = if self.measures {
            spill::WRITERS * plan.writer + spill::APPENDED
        } else {
            0
        };
        2 * plan.writer + stars
    }

    /// Bytes for each triangle that is measured again at a time: reader, ids, coordinates.
    pub fn again_bytes(&self) -> u64 {
        let reader = 24 + 3 * self.index;
        let ids = 12 + TABLE_BYTES;
        reader + ids + NARROW_SPAN * (24 + 3 * self.coord)
    }

    /// Bytes of the chunk pass: scratch of all threads, writers of all shuffles, the bits.
    pub fn pass_bytes(&self, plan: &Plan) -> u64 {
        let thread = (plan.chunk + 64) * self.chunk_bytes() + self.writer_bytes(plan);
        self.threads * thread + plan.bits / 4
    }

    /// The least budget for any mesh on so many threads.
    pub fn least(&self) -> u64 {
        least(self.threads)
    }

    /// The least budget for what comes after the chunk pass, with labels in a file: a chunk's
    /// labels and coordinates once more, sorters and writers, a contraction; two bits for each of
    /// `components`; `table` bytes are the table of chunks. What the writers of shuffles may
    /// keep in memory is counted whether or not they do.
    pub fn least_after_chunks(&self, plan: &Plan, components: u64, table: u64) -> u64 {
        self.held_bytes(plan, table) + components / 4 + self.passing_bytes(plan)
    }

    /// The least budget with which a label of `width` bytes for each of `nodes` local components
    /// stays in memory, and the bits of as many components.
    pub fn fits_labels(&self, plan: &Plan, nodes: u64, width: u64, table: u64) -> u64 {
        self.held_bytes(plan, table) + nodes * width + nodes / 2 + self.passing_bytes(plan)
    }

    /// What passes after the chunks draw and give back, at least.
    fn passing_bytes(&self, plan: &Plan) -> u64 {
        let labels = plan.chunk.min(self.triangles) * (self.index + 1 + MOST_WIDTH);
        let again = plan.again * self.again_bytes() + labels;
        let thread = again + MIN_SORT + 6 * MIN_WRITER;
        let one = Size::least(MOST_WIDTH).max(2 * MIN_SORT + 4 * MIN_WRITER);
        with_slack((self.threads * thread).max(one))
    }

    /// What is held from the chunk pass to the end.
    fn held_bytes(&self, plan: &Plan, table: u64) -> u64 {
        // Parts of fans, and what may have twins, are used up before components are known.
        let held = if self.measures { 3 } else { 2 };
        table + held * self.threads * plan.writer.min(KEPT)
    }

    /// The number of bits for N ids that fits `limit` bits: one each, or a power of two.
    fn bits_within(&self, limit: u64) -> u64 {
        let exact = self.vertices.div_ceil(64).max(1) * 64;
        if exact <= limit {
            exact
        } else {
            1 << limit.max(64).ilog2()
        }
    }
}

impl Plan {
    /// Cuts up a budget of `memory` bytes.
    ///
    /// # Errors
    /// [`Error::Budget`] with the least that would do.
    pub fn new(
        shape: &Shape,
        memory: u64,
        chunk: Option<u64>,
        buckets: Option<usize>,
    ) -> Result<Plan> {
        check_least(memory, shape.threads)?;
        let memory = memory / SLACK * (SLACK - 1);
        let mut plan = Plan {
            chunk: chunk.unwrap_or(MIN_CHUNK),
            again: (memory / 64 / shape.threads / shape.again_bytes()).max(MIN_CHUNK),
            // Two arrays, an eighth of the budget each: memory / 8 bytes are memory bits.
            bits: shape.bits_within(memory),
            writer: (memory / 16 / shape.threads).max(MIN_WRITER),
            buckets,
        };
        // What the bits may not have when every other part is at its least.
        while plan.bits > 64 && shape.pass_bytes(&plan) > memory && plan.writer == MIN_WRITER {
            plan.bits = 1 << (plan.bits - 1).ilog2();
        }
        if chunk.is_none() {
            while plan.chunk < MAX_CHUNK
                && plan.chunk < shape.triangles
                && 2 * plan.chunk * shape.chunk_bytes() * shape.threads <= memory / 2
            {
                plan.chunk *= 2;
            }
        }
        while plan.writer > MIN_WRITER && shape.pass_bytes(&plan) > memory {
            plan.writer = (plan.writer / 2).max(MIN_WRITER);
        }
        Ok(plan)
    }

    /// Number of chunks.
    pub fn chunks(&self, triangles: u64) -> u64 {
        triangles.div_ceil(self.chunk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_plan_fits_its_budget_and_less_than_the_least_is_refused() {
        for triangles in [0, 1, 1000, 1 << 20, 1 << 30] {
            for (index, coord, threads) in [(4, 4, 1), (4, 4, 2), (8, 8, 5), (4, 0, 2)] {
                let shape = Shape {
                    triangles,
                    vertices: triangles / 2 + 3,
                    index,
                    coord,
                    threads,
                    measures: true,
                };
                let least = shape.least();
                assert!(least < threads * (2 << 20), "{shape:?}: {least}");
                assert!(Plan::new(&shape, least - 1, None, None).is_err());
                for memory in [least, least + 1, 32 << 20, 64 << 20, 512 << 20, 8 << 30] {
                    let plan = Plan::new(&shape, memory.max(least), None, None).unwrap();
                    let need = shape.pass_bytes(&plan);
                    assert!(
                        need <= memory.max(least),
                        "{shape:?} {plan:?}: {need} > {memory}"
                    );
                }
            }
        }
    }
}
