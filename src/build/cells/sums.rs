//! Sums by component of what the cells counted and measured, and of the triangles that they left
//! unmeasured.
//!
//! Why it works: all sums are integers, minima or maxima, so the order in which local components
//! and triangles arrive does not matter. Positions that are not at hand are
//! [asked for](super::super::asked).
//!
//! Memory: a tally and a block a thread, and what asking takes. I/O: 24 bytes a local component
//! and 112 where it was measured; 5 words an unmeasured triangle, and what asking takes.

use super::super::asked::{Adds, Ask, measure_asked, questions};
use super::super::stitch::Labels;
use super::super::tally::{Pieces, Tally};
use super::super::{Job, scratch_items};
use super::names::Names;
use super::places::Places;
use super::records::{Called, NodeCount, NodeMeasure, Unmeasured};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{ScratchFile, Workspace};
use crate::error::Result;
use crate::shuffle::{Buckets, Writer};
use bytemuck::Pod;

/// Records at a time.
const BLOCK: usize = 1024;

/// What the cells left in scratch: used up as it is summed.
pub struct Left {
    /// [`NodeCount`]s.
    pub counts: ScratchFile,
    /// [`NodeMeasure`]s.
    pub measures: ScratchFile,
    /// [`Unmeasured`] triangles.
    pub unmeasured: ScratchFile,
    /// [`Unmeasured`] triangles that are local components of their own, and not counted.
    pub alone: ScratchFile,
}

impl Keep for Left {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let Left {
            counts,
            measures,
            unmeasured,
            alone,
        } = self;
        let mut files = [counts, measures, unmeasured, alone].into_iter();
        files.try_for_each(|file| to.file(file))
    }

    fn restore(from: &mut Reader) -> Result<Left> {
        Ok(Left {
            counts: from.file()?,
            measures: from.file()?,
            unmeasured: from.file()?,
            alone: from.file()?,
        })
    }
}

impl Left {
    /// Nothing yet.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn new(ws: &Workspace) -> Result<Left> {
        Ok(Left {
            counts: ws.scratch.file("counts of local components")?,
            measures: ws.scratch.file("measures of local components")?,
            unmeasured: ws.scratch.file("triangles to measure")?,
            alone: ws.scratch.file("triangles of large cells")?,
        })
    }

    /// Hands the numbers of local components that contradict themselves to `each`.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], and those of `each`.
    pub fn conflicts(
        &self,
        job: &Job,
        names: &Names,
        each: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let file = &self.counts;
        scratch_items(
            job.ws,
            file,
            0,
            file.len(),
            &mut |counts: &[NodeCount]| {
                let marked = counts.iter().filter(|count| count.conflict != 0);
                let mut numbers = marked.map(|count| names.number(count.name));
                numbers.try_for_each(&mut *each)
            },
        )
    }
}

/// What it takes to sum them.
pub struct Sums<'a, W> {
    /// The job.
    pub job: &'a Job<'a>,
    /// Numbers of the names.
    pub names: &'a Names,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
}

impl<W: Index> Sums<'_, W> {
    /// (component, flip against its first triangle) of what is called so.
    #[inline]
    fn label(&self, called: Called) -> (u64, bool) {
        let (component, flip) = self.labels.get(self.names.number(called.name));
        (component, flip ^ called.flip)
    }

    /// Sums everything into `pieces`.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
    pub fn sum<X: Coord>(&self, left: Left, places: &Places<X>, pieces: &Pieces) -> Result<()> {
        let Left {
            counts,
            measures,
            unmeasured,
            alone,
        } = left;
        self.each(&counts, pieces, |tally, node: &NodeCount| {
            let (component, flip) = self.label(Called::itself(node.name));
            let sums = tally.at(component)?;
            let (triangles, flipped) = (node.triangles, node.flipped);
            sums.first = sums.first.min(node.name);
            sums.triangles += u64::from(triangles);
            sums.flipped += u64::from(if flip { triangles - flipped } else { flipped });
            sums.rims([node.borders, node.rings, node.loops].map(u64::from));
            Ok(())
        })?;
        drop(counts);
        self.each(&measures, pieces, |tally, node: &NodeMeasure| {
            let (component, flip) = self.label(Called::itself(node.name));
            tally.merge(component, &node.measure.get(), flip)
        })?;
        drop(measures);
        let files = [(&unmeasured, false), (&alone, true)];
        let g = match (places, &self.job.g) {
            (Places::Whole(whole), _) => Some(whole.rows()?),
            (_, Some(g)) => {
                return measure_asked::<W, X>(self.job, g, self.ask(files)?, pieces);
            }
            _ => None,
        };
        for (file, counted) in files {
            if let Places::Whole(whole) = places {
                whole.took(3 * file.len() as usize / size_of::<Unmeasured<W>>());
            }
            self.each(file, pieces, |tally, triangle: &Unmeasured<W>| {
                let at = |v: u64| g.map(|g| g[v as usize].map(Coord::wide));
                let [a, b, c] = triangle.v().map(at);
                let corners = a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]);
                let adds = self.adds(triangle, counted);
                adds.add(tally, triangle.t(), corners)
            })?;
        }
        Ok(())
    }

    /// What a triangle adds to.
    #[inline]
    fn adds(&self, triangle: &Unmeasured<W>, counted: bool) -> Adds {
        let (component, flip) = self.label(triangle.called());
        Adds {
            component,
            flip,
            counted,
        }
    }

    /// Hands all records of a file to `take`, with a tally for each thread.
    fn each<T: Pod>(
        &self,
        file: &ScratchFile,
        pieces: &Pieces,
        take: impl Fn(&mut Tally, &T) -> Result<()> + Sync,
    ) -> Result<()> {
        self.blocks(file, || pieces.tally(), take, Tally::finish)
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

    /// The corners of the triangles in these files, by vertex; with each whether its triangles are
    /// to be counted.
    fn ask(&self, files: [(&ScratchFile, bool); 2]) -> Result<Buckets<Ask<W>>> {
        let bytes: u64 = files.iter().map(|(file, _)| file.len()).sum();
        let corners = 3 * bytes / size_of::<Unmeasured<W>>() as u64;
        let asks = questions::<W>(self.job, corners)?;
        for (file, counted) in files {
            self.blocks(
                file,
                || asks.writer(),
                |writer: &mut Writer<Ask<W>>, triangle: &Unmeasured<W>| {
                    let adds = self.adds(triangle, counted);
                    for (k, v) in triangle.v().into_iter().enumerate() {
                        writer.push(Ask::new(v, (triangle.t(), k), adds))?;
                    }
                    Ok(())
                },
                Writer::finish,
            )?;
        }
        asks.finish()
    }
}
