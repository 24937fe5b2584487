//! Sums by component of what the cells counted and measured, and of the triangles that they left
//! unmeasured.
//!
//! Why it works: all sums are integers, minima or maxima, so the order in which local components
//! and triangles arrive does not matter. Positions that are not at hand are
//! [asked for](super::super::asked).
//!
//! Memory: a tally and a block a thread, and what asking takes. I/O: 24 bytes a local component
//! and 112 where it was measured; 5 words an unmeasured triangle, and what asking takes.

use super::super::Job;
use super::super::asked::{Ask, Sum, measure_asked, questions};
use super::super::stitch::Labels;
use super::super::tally::{Piece, Tally};
use super::names::Names;
use super::places::Places;
use super::records::{Called, NodeCount, NodeMeasure, Unmeasured};
use crate::chunk::grid::Grid;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::Result;
use crate::shuffle::{Buckets, Shuffle, Writer};
use bytemuck::Pod;

/// Records at a time.
const BLOCK: usize = 1024;

/// What the cells left in scratch.
pub struct Sums<'a, W> {
    /// The job.
    pub job: &'a Job<'a>,
    /// Numbers of the names.
    pub names: &'a Names,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// The grid of volumes.
    pub grid: &'a Grid,
    /// [`NodeCount`]s.
    pub counts: &'a ScratchFile,
    /// [`NodeMeasure`]s.
    pub measures: &'a ScratchFile,
    /// [`Unmeasured`] triangles.
    pub unmeasured: &'a ScratchFile,
}

impl<W: Index> Sums<'_, W> {
    /// (component, flip against its first triangle) of what is called so.
    #[inline]
    fn label(&self, called: Called) -> (u64, bool) {
        let (component, flip) = self.labels.get(self.names.number(called.name));
        (component, flip ^ called.flip)
    }

    /// Sums everything into `pieces`, with tables of `memory` bytes a thread.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
    pub fn sum<X: Coord>(
        &self,
        places: &Places<X>,
        pieces: &Shuffle<Piece>,
        memory: u64,
    ) -> Result<()> {
        self.each(self.counts, pieces, memory, |tally, node: &NodeCount| {
            let (component, flip) = self.label(Called::itself(node.name));
            let sums = tally.at(component)?;
            let (triangles, flipped) = (node.triangles, node.flipped);
            sums.first = sums.first.min(node.name);
            sums.triangles += u64::from(triangles);
            sums.flipped += u64::from(if flip { triangles - flipped } else { flipped });
            sums.borders += u64::from(node.borders);
            sums.rings += u64::from(node.rings);
            sums.loops += u64::from(node.loops);
            Ok(())
        })?;
        self.each(
            self.measures,
            pieces,
            memory,
            |tally, node: &NodeMeasure| {
                let (component, flip) = self.label(Called::itself(node.name));
                let measure = &mut tally.at(component)?.measure;
                measure.merge(&node.measure.get(), flip);
                Ok(())
            },
        )?;
        match (places, &self.job.g) {
            (Places::Whole(whole), _) => {
                let g = whole.rows()?;
                whole.took(3 * self.unmeasured.len() as usize / size_of::<Unmeasured<W>>());
                let each = |tally: &mut Tally, triangle: &Unmeasured<W>| {
                    let (component, flip) = self.label(triangle.called());
                    let corners = triangle.v().map(|v| g[v as usize].map(Coord::wide));
                    let measure = &mut tally.at(component)?.measure;
                    measure.add(self.grid, corners, flip);
                    Ok(())
                };
                self.each(self.unmeasured, pieces, memory, each)
            }
            (_, Some(g)) if !self.unmeasured.is_empty() => {
                let sum = Sum {
                    grid: self.grid,
                    pieces,
                    components: self.labels.components,
                    tally: memory,
                };
                measure_asked::<X>(self.job, g, self.ask()?, &sum)
            }
            _ => Ok(()),
        }
    }

    /// Hands all records of a file to `take`, with a tally for each thread.
    fn each<T: Pod>(
        &self,
        file: &ScratchFile,
        pieces: &Shuffle<Piece>,
        memory: u64,
        take: impl Fn(&mut Tally, &T) -> Result<()> + Sync,
    ) -> Result<()> {
        let (ws, components) = (self.job.ws, self.labels.components);
        let start = || Tally::new(&ws.budget, memory, components, pieces);
        self.blocks(file, start, take, Tally::finish)
    }

    /// Hands all records of a file to `take`, with a state for each thread.
    fn blocks<T: Pod, S>(
        &self,
        file: &ScratchFile,
        start: impl Fn() -> Result<S> + Sync,
        take: impl Fn(&mut S, &T) -> Result<()> + Sync,
        close: impl Fn(S) -> Result<()> + Sync,
    ) -> Result<()> {
        let ws = self.job.ws;
        let records = file.len() / size_of::<T>() as u64;
        let block = BLOCK as u64;
        let bytes = ws.workers.count() as u64 * block * size_of::<T>() as u64;
        let _lease = ws.budget.lease("records of local components", bytes)?;
        ws.workers.run(
            records.div_ceil(block),
            || Ok((vec![T::zeroed(); BLOCK], start()?)),
            |(buffer, state), unit| {
                let n = block.min(records - unit * block) as usize;
                let at = unit * block * size_of::<T>() as u64;
                file.read_at(bytemuck::cast_slice_mut(&mut buffer[..n]), at)?;
                buffer[..n]
                    .iter()
                    .try_for_each(|record| take(state, record))
            },
            |(_, state)| close(state),
        )
    }

    /// The corners of the unmeasured triangles, by vertex.
    fn ask(&self) -> Result<Buckets<Ask>> {
        let corners = 3 * self.unmeasured.len() / size_of::<Unmeasured<W>>() as u64;
        let asks = questions(self.job, corners)?;
        self.blocks(
            self.unmeasured,
            || asks.writer(),
            |writer: &mut Writer<Ask>, triangle: &Unmeasured<W>| {
                let label = self.label(triangle.called());
                for (k, v) in triangle.v().into_iter().enumerate() {
                    writer.push(Ask::new(v, (triangle.t(), k), label))?;
                }
                Ok(())
            },
            Writer::finish,
        )?;
        asks.finish()
    }
}
