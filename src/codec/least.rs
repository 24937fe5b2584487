//! What encoding takes at least: so that a refusal names a budget that suffices.
//!
//! Why two figures: before the triangles are dealt, the counts bound what a chunk may have, and
//! the budget that is named is of that bound; behind it, what the largest has is known. Nothing is
//! refused for the bound alone: dealing begins when it has what it takes itself.
//!
//! Memory, I/O: none.

use super::chunk::{self, MODEL_BYTES};
use super::deal::{self, Dealt};
use super::gather::Gather;
use super::seam;
use crate::corner::Index;
use crate::disk::Budget;
use crate::error::{Error, Result};
use crate::folder::Counts;
use crate::shuffle::Plan;

/// Bytes a triangle while a chunk is coded, without its record: local ids and the table that they
/// come from, and what [`chunk::encode`] takes.
pub const TRIANGLE_BYTES: u64 = 12 + 32 + 12 + chunk::TRIANGLE_BYTES;
/// Bytes a vertex: its ids, its position, and what [`chunk::encode`] takes.
pub const VERTEX_BYTES: u64 = 8 + 16 + 12 + 4 + chunk::VERTEX_BYTES;
/// The least sorter of dealt triangles.
pub(super) const SORTER: u64 = 1 << 20;
/// What shuffles hold of what they wrote, at most, and some more.
const SLACK: u64 = 1 << 20;

/// Bytes that a chunk of so many triangles takes, which name no more than so many vertices, when
/// each record takes `record` bytes.
pub(super) fn chunk_bytes(triangles: u64, named: u64, record: u64) -> u64 {
    triangles * (TRIANGLE_BYTES + record) + named.min(3 * triangles) * VERTEX_BYTES
}

/// Bytes a triangle while what is kept besides the mesh is coded: the numbers and components of
/// triangles, with their bytes; the bytes of the order.
pub(super) fn extra_bytes(labels: bool, order: bool) -> u64 {
    (if labels { 8 + 8 + 8 + 8 } else { 0 }) + if order { 24 } else { 0 }
}

/// The shuffle of uses of shared vertices, of so many records that were dealt.
pub(super) fn uses(dealt: u64) -> Plan {
    seam::plan(24, 8 * dealt.isqrt())
}

/// Bytes of a thread that codes chunks of `chunk` bytes, but for its sorter.
pub(super) fn thread_bytes(chunk: u64, uses: &Plan) -> u64 {
    chunk + MODEL_BYTES + uses.writer_bytes() + Gather::BYTES
}

/// Bytes of the table of so many chunks.
pub(super) fn table_bytes(chunks: u64) -> u64 {
    200 * chunks
}

/// What one thread of `own` bytes, and then the resolving of `uses`, does with.
fn coding(own: u64, uses: u64) -> u64 {
    // Some is left for what shuffles note of more than they expected.
    let thread = (own + SORTER).div_ceil(15) * 16;
    thread.max(seam::least(uses)) + SLACK
}

/// Refuses a budget in which not even the dealing begins; a triangle takes `extra` bytes more.
///
/// # Errors
/// [`Error::Budget`] with one that suffices, whatever the mesh turns out to be.
pub(super) fn check<W: Index>(
    budget: &Budget,
    counts: &Counts,
    most: u64,
    extra: u64,
) -> Result<()> {
    let (t, n) = (counts.triangles, counts.vertices);
    let dealing = deal::least(t, n, most);
    if dealing <= budget.free() {
        return Ok(());
    }
    let records = t.saturating_add(n);
    let largest = records.min(most);
    let chunk = chunk_bytes(largest, n, size_of::<Dealt<W>>() as u64 + extra);
    let own = thread_bytes(chunk, &uses(records));
    let chunks = deal::intervals(t, n, most) + records / most.max(1);
    let shared = if chunks > 1 {
        records.saturating_mul(3)
    } else {
        0
    };
    let held = deal::mark_bytes(n) + table_bytes(chunks);
    let need = (held + coding(own, shared)).max(dealing + SLACK);
    Err(Error::Budget {
        what: "encoding".into(),
        need: budget.used().saturating_add(need),
        have: budget.limit(),
    })
}

/// Refuses a budget in which one thread does not code the largest chunk.
///
/// # Errors
/// [`Error::Budget`] with one that suffices.
pub(super) fn check_chunk(budget: &Budget, own: u64, uses: u64) -> Result<()> {
    if own + SORTER <= budget.free() {
        return Ok(());
    }
    budget.check("coding a chunk", coding(own, uses))
}
