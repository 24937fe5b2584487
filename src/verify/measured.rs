//! What a measured folder has beyond others: the sorts and the graph that its measures are
//! recounted in, one after the other, and the measures of the whole mesh.
//!
//! Memory: while the edges pass by, a graph of corners (a quarter of the memory) and small
//! buffers; afterwards the buffers of one pass at a time. I/O: see [`fans`](super::fans),
//! [`stars`](super::stars) and [`duplicates`](super::duplicates).

use super::duplicates::{self, Repeat, Twin};
use super::fans::{self, Feed, Share};
use super::links::Links;
use super::listing::{DUPLICATES, Listing, VERTICES};
use super::open::{Arrays, Lists};
use super::sort::Sorter;
use super::stars;
use super::tally::{Table, Tally};
use super::verdict::Findings;
use crate::disk::Workspace;
use crate::error::Result;

/// The sorts of a measured folder.
pub(super) struct Measured<'a> {
    ws: &'a Workspace,
    arrays: &'a Arrays,
    findings: &'a Findings,
    memory: u64,
    lists: &'a Lists,
    shares: Sorter<Share>,
    twins: Sorter<Twin>,
    repeats: Sorter<Repeat>,
}

/// What was recounted of the whole mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told {
    pub(super) loops: u64,
    pub(super) stars: stars::Counted,
    pub(super) duplicates: u64,
}

impl<'a> Measured<'a> {
    /// The sorts, none when the folder is not measured.
    pub(super) fn new(
        ws: &'a Workspace,
        arrays: &'a Arrays,
        findings: &'a Findings,
        memory: u64,
    ) -> Result<Option<Measured<'a>>> {
        let Some(lists) = &arrays.measured else {
            return Ok(None);
        };
        Ok(Some(Measured {
            ws,
            arrays,
            findings,
            memory,
            lists,
            shares: Sorter::new(ws, "fans by vertex", memory / 64)?,
            twins: Sorter::new(ws, "triangles on non-manifold edges", memory / 64)?,
            repeats: Sorter::new(ws, "triangles met before", memory / 128)?,
        }))
    }

    /// The graph of all corners, without links.
    pub(super) fn corners(&self) -> Result<Links> {
        Links::new(self.ws, self.arrays.triangles * 3, self.memory / 4)
    }

    /// What the pass over the edges sends records and links by.
    pub(super) fn feed<'b>(&'b self, corners: &'b mut Links) -> Result<Feed<'b>> {
        Ok(Feed {
            corners,
            shares: self.shares.filler(self.ws)?,
            twins: self.twins.filler(self.ws)?,
            repeats: self.repeats.filler(self.ws)?,
        })
    }

    /// Settles the graph of corners; returns the number of border loops.
    pub(super) fn loops(&self, corners: Links, tallies: &Sorter<Tally>) -> Result<u64> {
        let shares = self.shares.filler(self.ws)?;
        fans::settle(self.ws, self.arrays, corners, self.table(tallies)?, shares)
    }

    /// The passes over the stars and the duplicates.
    pub(super) fn finish(self, loops: u64, tallies: &Sorter<Tally>) -> Result<Told> {
        let (ws, memory, lists) = (self.ws, self.memory, self.lists);
        let components = self.arrays.components;
        let table = self.table(tallies)?;
        let list = |list, ids| Listing::new(ws, list, ids, self.findings);
        let shares = self.shares.merge(ws, memory / 4)?;
        let pass = stars::Pass {
            ws,
            components,
            table,
            listing: list(VERTICES, &lists.nonmanifold_vertices)?,
            meetings: Links::new(ws, components, memory / 2)?,
        };
        let stars = pass.run(shares)?;
        let listing = list(DUPLICATES, &lists.duplicate)?;
        let duplicates = duplicates::run(ws, self.twins, self.repeats, listing, memory / 2)?;
        Ok(Told {
            loops,
            stars,
            duplicates,
        })
    }

    fn table<'b>(&self, tallies: &'b Sorter<Tally>) -> Result<Table<'b>> {
        let components = self.arrays.components;
        Table::new(self.ws, tallies, components, self.memory / 16)
    }
}
