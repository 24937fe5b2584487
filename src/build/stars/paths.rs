//! Nodes joined end to end: which hang together, and one of each set, for any number of nodes.
//!
//! Memory: a label for each node, or a contraction; a block. I/O: links once, a word for each node.

use super::super::appender::{Appender, BLOCK};
use super::super::graph::labels::{LabelRange, Labels};
use super::super::graph::sets::Graph;
use super::super::plan::Strategy;
use super::super::records::Link;
use super::super::{Job, contraction_size};
use crate::corner::Index;
use crate::disk::{Lease, ScratchFile};
use crate::error::Result;

/// Links between nodes, on their way to a file.
pub struct Links<'a, W> {
    to: Appender<'a, Link<W>>,
    _lease: Lease,
}

impl<'a, W: Index> Links<'a, W> {
    /// None yet.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(job: &Job, file: &'a ScratchFile) -> Result<Self> {
        Ok(Links {
            to: Appender::new(file),
            _lease: job.ws.budget.lease("links", BLOCK as u64)?,
        })
    }

    /// Joins two nodes.
    ///
    /// # Errors
    /// Those of the file.
    pub fn join(&mut self, a: W, b: W) -> Result<()> {
        self.to.push(Link::new(a.wide(), b.wide(), false))
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// Those of the file.
    pub fn finish(&mut self) -> Result<()> {
        self.to.flush()
    }
}

/// The set of each node.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn sets<W: Index>(job: &Job, nodes: u64, links: &ScratchFile) -> Result<Labels<W>> {
    let bytes = nodes * W::BYTES as u64 + nodes / 4;
    let in_memory = match job.strategy {
        Strategy::Auto => bytes <= job.ws.budget.free() / 2,
        Strategy::Contract => false,
        Strategy::Memory | Strategy::ByPlace | Strategy::ById => true,
    };
    let graph = Graph {
        nodes,
        number: |node| node,
        links,
        conflicts: &|_| Ok(()),
    };
    let size = (!in_memory).then(|| contraction_size::<W>(job, nodes));
    graph.labels(job.ws, size)
}

/// Tells, for nodes in ascending order, their sets and which are the first of them: sets are
/// numbered by their smallest nodes.
pub struct Firsts<'a, W> {
    range: LabelRange<'a, W>,
    node: u64,
    sets: u64,
    nodes: u64,
}

impl<'a, W: Index> Firsts<'a, W> {
    /// Labels that are read at a time.
    const READ: u64 = 8 << 10;

    /// Before the first node.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(job: &Job, labels: &'a Labels<W>, nodes: u64) -> Result<Self> {
        Ok(Firsts {
            range: labels.range(&job.ws.budget, Self::READ)?,
            node: 0,
            sets: 0,
            nodes,
        })
    }

    /// The set of the next node, and whether it is its first.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn advance(&mut self) -> Result<(u64, bool)> {
        let first = self.node / Self::READ * Self::READ;
        self.range
            .load(first..(first + Self::READ).min(self.nodes))?;
        let set = self.range.get(self.node).0;
        self.node += 1;
        let new = set == self.sets;
        self.sets += u64::from(new);
        Ok((set, new))
    }
}
