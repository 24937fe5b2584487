//! Which vertices occur: spans of consecutive ids, from each chunk of triangles.
//!
//! Why spans: near triangles name near vertices, so a chunk leaves few of them; a sort brings
//! those of all chunks in order, and one reading unites them.
//!
//! Memory: the buffers of the merge. I/O: 16 bytes a span written and read.

use super::sort::{Record, Sorter};
use crate::disk::Workspace;
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// Vertices that occur, from the first up to but not including the last.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Span {
    pub(super) from: u64,
    pub(super) to: u64,
}

impl Record for Span {
    type Key = u64;
    fn key(&self) -> u64 {
        self.from
    }
}

/// Number of vertices that occur in any triangle.
pub(super) fn referenced(ws: &Workspace, spans: Sorter<Span>, memory: u64) -> Result<u64> {
    let mut merge = spans.merge(ws, memory)?;
    let (mut seen, mut end) = (0, 0);
    while let Some(span) = merge.next()? {
        seen += span.to.saturating_sub(span.from.max(end));
        end = end.max(span.to);
    }
    Ok(seen)
}
