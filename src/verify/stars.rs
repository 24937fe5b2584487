//! The stars of the vertices: how many fans each has, in how many components, and which
//! components meet there.
//!
//! Why one reading is enough: the shares of fans (see [`fans`](super::fans)), sorted by vertex
//! and component, bring all fans of a vertex together. A component's vertices are the pairs
//! (vertex, component) that occur, since every vertex of a component has a fan of it.
//!
//! Memory: the buffers of the merge, component sums, connectivity of components. I/O: the
//! shares and `nonmanifold_vertices.npy` once.

use super::fans::Share;
use super::links::Links;
use super::listing::Listing;
use super::sort::Merge;
use super::tally::Table;
use crate::disk::Workspace;
use crate::error::Result;

/// What the stars tell of the whole mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counted {
    pub(super) fans: u64,
    pub(super) nonmanifold: u64,
    /// Components when those that share a vertex are one.
    pub(super) joined: u64,
}

/// Everything that the pass reads and adds to.
pub(super) struct Pass<'a> {
    pub(super) ws: &'a Workspace,
    pub(super) components: u64,
    pub(super) table: Table<'a>,
    pub(super) listing: Listing<'a>,
    /// The graph of components.
    pub(super) meetings: Links,
}

impl Pass<'_> {
    /// Runs the pass.
    pub(super) fn run(mut self, mut shares: Merge<Share>) -> Result<Counted> {
        let progress = &self.ws.progress;
        progress.begin("verify: vertices", "vertices", 0);
        let mut counted = Counted::default();
        let mut seen = 0;
        let mut next = shares.next()?;
        while let Some(first) = next {
            let vertex = first.vertex;
            let (mut fans, mut before) = (0, u64::MAX);
            while let Some(share) = next.filter(|share| share.vertex == vertex) {
                let label = share.label();
                let mut halves = 0;
                while let Some(share) = next.filter(|s| (s.vertex, s.label()) == (vertex, label)) {
                    halves += share.halves();
                    next = shares.next()?;
                }
                fans += halves / 2;
                self.component(label, halves / 2, &mut before)?;
            }
            counted.fans += fans;
            if fans > 1 {
                counted.nonmanifold += 1;
                self.listing
                    .expect(vertex, || format!("it has {fans} fans"))?;
            }
            seen += 1;
            if seen % (1 << 16) == 0 {
                progress.advance(1 << 16);
            }
        }
        progress.end();
        self.listing.finish()?;
        self.table.finish()?;
        self.meetings.finish(|_, _| {
            counted.joined += 1;
            Ok(())
        })?;
        Ok(counted)
    }

    /// A component at a vertex; `before` is another one there.
    fn component(&mut self, label: u64, fans: u64, before: &mut u64) -> Result<()> {
        if label >= self.components {
            return Ok(());
        }
        let tally = self.table.of(label)?;
        tally.vertices += 1;
        tally.fans += fans;
        if *before != u64::MAX {
            self.meetings.push(*before, label, false)?;
        }
        *before = label;
        Ok(())
    }
}
