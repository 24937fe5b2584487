//! The last pass of the way through cells, which stops between windows of triangles.
//!
//! Why a stop may come anywhere: a window is written whole, from what does not depend on the rows
//! that are there. So the windows behind a stop are written again, to the same bytes.
//!
//! Memory and I/O: see [`assemble`](super::cells::assemble).

use super::Job;
use super::behind::AtEnd;
use super::by_cells::StepNames;
use super::cells::CellPlan;
use super::cells::assemble::{Said, assemble};
use super::clock::Clock;
use super::dealt::Cells;
use super::finish::Found;
use super::lists::list;
use super::pipeline::Built;
use super::tail::{Marked, Rows};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use std::time::Instant;

/// What the arrays are assembled from, and how far they are.
pub struct Assembling<W: Index, X> {
    at: AtEnd<Cells<W, X>, W>,
    arrays: Marked,
    /// Windows that are assembled.
    done: u64,
}

impl<W: Index, X> Keep for Assembling<W, X> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.at.keep(to)?;
        self.arrays.keep(to)?;
        to.number(self.done)
    }

    fn restore(from: &mut Reader) -> Result<Self> {
        Ok(Assembling {
            at: AtEnd::restore(from)?,
            arrays: Marked::restore(from)?,
            done: from.number()?,
        })
    }
}

impl<W: Index, X: Coord> Assembling<W, X> {
    /// Nothing is assembled yet.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn new<I: Index>(job: &Job, at: AtEnd<Cells<W, X>, W>) -> Result<Assembling<W, X>> {
        Ok(Assembling {
            arrays: Rows::create::<I>(job)?.marked::<I>(job, at.counts.degenerate)?,
            at,
            done: 0,
        })
    }

    /// Brings everything back to the triangles.
    ///
    /// # Errors
    /// As [`assemble`], and [`list`].
    pub fn finish<I: Index>(
        self,
        clock: &mut Clock,
        job: &Job,
        plan: &CellPlan,
        steps: &StepNames,
    ) -> Result<Built> {
        let (was, is) = (self.at.first.windows, plan.windows.count);
        if was != is {
            let what = format!("{was} windows of triangles became {is}");
            return Err(Error::Internal(what));
        }
        clock.rounds_and(
            ("assemble", "triangles", job.shape.triangles),
            (steps.assembled, job.opened),
            self,
            |assembling, until| assembling.some::<I>(job, plan, until),
            |assembling| assembling.built::<I>(job),
        )
    }

    fn some<I: Index>(
        &mut self,
        job: &Job,
        plan: &CellPlan,
        until: Option<Instant>,
    ) -> Result<bool> {
        let (at, cells) = (&self.at, &self.at.first);
        let said = Said {
            replies: &cells.replies,
            patches: &at.patches,
            names: &cells.names,
            labels: &at.labels,
            chosen: &at.chosen,
            degenerate: &cells.degenerate,
        };
        let (tables, from) = (self.arrays.tables(), (self.done, until));
        self.done = assemble::<I, W>(job, &plan.windows, &said, &tables, from)?;
        Ok(self.done == plan.windows.count)
    }

    fn built<I: Index>(self, job: &Job) -> Result<Built> {
        let AtEnd {
            first,
            counts,
            stars,
            labels,
            mut chosen,
            ..
        } = self.at;
        let found = Found {
            labels: &labels,
            chosen: &chosen,
        };
        let lists = list::<I, W>(job, &found, counts.nonmanifold_edges, stars.as_ref())?;
        let measures = chosen.stars.take().map(|stars| stars.measures);
        let (made, counted) = ((chosen.table, lists), (counts, measures));
        let (spilled, locals) = (first.settled.spilled, first.names.count());
        Ok(self.arrays.built(made, counted, spilled, locals))
    }
}
