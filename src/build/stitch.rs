//! Stitch: joins local components over the links, with parity, and numbers the results.
//!
//! Why it works: local components are nodes, numbered by their first triangles, so the smallest
//! node of a set is the local component with the component's first triangle, and sets numbered by
//! their smallest nodes are components numbered by their first triangles. Both ways to find the
//! sets ([`graph`](super::graph)) say so: a union-find in memory, while a label for each node fits
//! beside what later passes need, and else a contraction in what memory there is.
//!
//! Memory: an index (4 or 8 bytes) and a bit for each local component, or what is free; a bit for
//! each component. I/O: links read once, sequentially; 16 bytes for each local component of chunks
//! that contradict themselves; for a contraction, see there.

pub use super::graph::labels::Labels;
use super::graph::sets::{Conflicts, Graph};
use super::nodes::Nodes;
use super::plan::Strategy;
use super::{Job, contraction_size};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::Result;

/// What there is to join.
pub struct Linked<'a> {
    /// Numbers of the local components.
    pub nodes: Nodes<'a>,
    /// [`Link`](super::records::Link)s.
    pub links: &'a ScratchFile,
    /// Hands the numbers of local components that contradict themselves to its argument.
    pub conflicts: &'a Conflicts<'a>,
}

/// Joins the local components; in memory when `fits` says that later passes have room beside
/// their labels.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn stitch<W: Index>(job: &Job, linked: &Linked, fits: bool) -> Result<Labels<W>> {
    let in_memory = match job.strategy {
        Strategy::Auto => fits,
        Strategy::Contract => false,
        Strategy::Memory | Strategy::ByPlace | Strategy::ById => true,
    };
    let nodes = linked.nodes;
    let graph = Graph {
        nodes: nodes.count(),
        number: |called| nodes.number(called),
        links: linked.links,
        conflicts: linked.conflicts,
    };
    let size = (!in_memory).then(|| contraction_size::<W>(job, nodes.count()));
    graph.labels(job.ws, size)
}
