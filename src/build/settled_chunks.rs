//! What settled chunks leave for the passes behind the seams.
//!
//! Memory: the table of chunks. I/O: none but what is asked for.

use super::Job;
use super::behind::{First, used_up};
use super::chunked::{Chunked, LocalRecords, Settled};
use super::components::{ChunkSums, sum_chunks};
use super::nodes::Nodes;
use super::stars::spill::Spilled;
use super::stitch::Labels;
use super::tail::Rows;
use super::tally::Pieces;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use std::marker::PhantomData;

/// What the chunks left, but for the seams.
pub struct Chunks<I, W: Index, X> {
    /// The rows as if every local component kept its label and orientation.
    pub rows: Rows,
    /// What is left of vertex stars, until these are joined.
    pub stars: Option<Spilled<W>>,
    /// The chunks.
    pub chunked: Chunked,
    /// What they know of their local components, until it is summed.
    pub records: Option<LocalRecords>,
    /// Vertices that no triangle names.
    pub unreferenced: u64,
    /// The types of rows and coordinates.
    pub kinds: PhantomData<(I, X)>,
}

impl<I: Index, W: Index, X: Coord> First<W> for Chunks<I, W, X> {
    type Sums = Option<LocalRecords>;

    fn settled(&self) -> &Settled {
        &self.chunked.settled
    }

    fn unreferenced(&self) -> u64 {
        self.unreferenced
    }

    fn nodes(&self, job: &Job) -> Nodes<'_> {
        Nodes::InOrder(&self.chunked, job.plan.chunk)
    }

    fn stars(&mut self) -> Option<Spilled<W>> {
        self.stars.take()
    }

    fn alone(&self) -> Option<&ScratchFile> {
        None
    }

    fn conflicts(&self, job: &Job, each: &mut dyn FnMut(u64) -> Result<()>) -> Result<()> {
        let records = self.records.as_ref().ok_or_else(used_up)?;
        self.chunked.conflicts(job.ws, records, each)
    }

    fn holds_labels(&self, job: &Job) -> bool {
        let (nodes, table) = (self.chunked.locals(), self.chunked.table_bytes());
        let held = (job.shape).fits_labels(&job.plan, nodes, W::BYTES as u64, table);
        held <= job.ws.budget.limit()
    }

    fn check(&self, job: &Job, components: u64) -> Result<()> {
        check_held(job, &self.chunked, components)
    }

    /// Chunks call them by number.
    fn borders(&self, _: &Job, called: ScratchFile) -> Result<ScratchFile> {
        Ok(called)
    }

    fn sums(&mut self, _: &Job) -> Result<Option<LocalRecords>> {
        Ok(self.records.take())
    }

    fn sum(
        &self,
        job: &Job,
        records: Option<LocalRecords>,
        labels: &Labels<W>,
        to: &Pieces,
    ) -> Result<()> {
        let sums = ChunkSums {
            chunked: &self.chunked,
            records: records.ok_or_else(used_up)?,
            labels,
            component: &self.rows.component,
        };
        sum_chunks::<I, W, X>(job, sums, to)
    }
}

impl<I, W: Index, X> Keep for Chunks<I, W, X> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.rows.keep(to)?;
        self.stars.keep(to)?;
        self.chunked.keep(to)?;
        self.records.keep(to)?;
        to.number(self.unreferenced)
    }

    fn restore(from: &mut Reader) -> Result<Self> {
        Ok(Chunks {
            rows: Rows::restore(from)?,
            stars: Option::restore(from)?,
            chunked: Chunked::restore(from)?,
            records: Option::restore(from)?,
            unreferenced: from.number()?,
            kinds: PhantomData,
        })
    }
}

/// Refuses, now that the table of chunks is there, a budget that is too small for what comes
/// after it; and, once the components are counted, for two bits for each of them.
pub fn check_held(job: &Job, chunked: &Chunked, components: u64) -> Result<()> {
    let table = chunked.table_bytes();
    let need = job.shape.least_after_chunks(&job.plan, components, table);
    let have = job.ws.budget.limit();
    if need > have {
        return Err(Error::Budget {
            what: match components {
                0 => format!("the table of {} chunks", chunked.infos.len()),
                _ => format!("two bits for each of {components} components"),
            },
            // A quarter more than what is short: the other parts grow with the budget.
            need: need + (need - have) / 4,
            have,
        });
    }
    Ok(())
}
