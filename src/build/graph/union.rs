//! Which components hang together at non-manifold edges: plain union-find while it fits, else
//! a contraction that only counts.
//!
//! Memory: 8 bytes a component, or that of the contraction. I/O: none, or the contraction's.

use super::contract::{Contraction, Size};
use crate::corner::Index;
use crate::disk::{Budget, Lease, Workspace};
use crate::error::Result;

/// Union-find without parity.
struct Union {
    parent: Vec<u64>,
    sets: u64,
    _lease: Lease,
}

impl Union {
    fn new(budget: &Budget, count: u64) -> Result<Union> {
        let what = format!("{count} components that non-manifold edges may join");
        Ok(Union {
            _lease: budget.lease(&what, count * 8)?,
            parent: (0..count).collect(),
            sets: count,
        })
    }

    fn find(&mut self, mut at: u64) -> u64 {
        while self.parent[at as usize] != at {
            let above = self.parent[self.parent[at as usize] as usize];
            self.parent[at as usize] = above;
            at = above;
        }
        at
    }

    fn join(&mut self, a: u64, b: u64) {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            self.parent[a.max(b) as usize] = a.min(b);
            self.sets -= 1;
        }
    }
}

/// Counts the sets that pairs leave.
pub struct Joins<'a, W: Index>(Kind<'a, W>);

enum Kind<'a, W: Index> {
    Memory(Union),
    Contract(Box<Contraction<'a, W>>),
}

impl<'a, W: Index> Joins<'a, W> {
    /// Bytes of so many sets in memory.
    pub fn bytes(count: u64) -> u64 {
        count * size_of::<u64>() as u64
    }

    /// `count` sets of one; `contract` when they are not to be in memory.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(ws: &'a Workspace, count: u64, contract: Option<Size>) -> Result<Self> {
        Ok(Joins(match contract {
            None => Kind::Memory(Union::new(&ws.budget, count)?),
            Some(size) => Kind::Contract(Box::new(Contraction::new(ws, count, size)?)),
        }))
    }

    /// Joins the sets of a and b.
    ///
    /// # Errors
    /// Those of [`Contraction::link`].
    pub fn join(&mut self, a: u64, b: u64) -> Result<()> {
        match &mut self.0 {
            Kind::Memory(union) => {
                union.join(a, b);
                Ok(())
            }
            Kind::Contract(graph) => graph.link(a, b, false),
        }
    }

    /// Number of sets.
    ///
    /// # Errors
    /// Those of [`Contraction::count`].
    pub fn sets(self) -> Result<u64> {
        match self.0 {
            Kind::Memory(union) => Ok(union.sets),
            Kind::Contract(graph) => graph.count(),
        }
    }
}
