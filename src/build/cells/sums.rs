//! Sums by component of what the cells counted and measured, and of the triangles that they left
//! unmeasured.
//!
//! Why it works: all sums are integers, minima or maxima, so the order in which local components
//! and triangles arrive does not matter. Positions that are not at hand come through two
//! shuffles, so that G is read in ascending windows and never at random: a corner asks by
//! vertex, and is answered by triangle.
//!
//! Memory: a tally, a block, a sorter, a writer and a window of G a thread. I/O: 24 bytes a local
//! component and 112 where it was measured; 5 words an unmeasured triangle, and for each of its
//! corners 24 and 40 bytes written and read; G once more.

use super::super::Job;
use super::super::arrays::CoordReader;
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
use crate::input::CoordArray;
use crate::shuffle::{Buckets, Record, Shuffle, Writer};
use bytemuck::{Pod, Zeroable};

/// Records at a time.
const BLOCK: usize = 1024;
/// Vertices of G in one window.
const WINDOW: u64 = 4 << 10;

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

/// A corner asks for its vertex's position: vertex, `4t + k`, `2 * component + flip`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Ask([u64; 3]);

impl Record for Ask {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0[0]
    }
}

/// The position on its way to the corner: `4t + k`, `2 * component + flip`, bits of x, y, z.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Answer([u64; 5]);

impl Record for Answer {
    /// The triangle, then the place in it.
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        if level == 0 {
            self.0[0] >> 2
        } else {
            self.0[0] & 3
        }
    }
}

/// Bytes of a corner's question in scratch.
pub const ASK_BYTES: u64 = size_of::<Ask>() as u64;
/// Bytes of its answer.
pub const ANSWER_BYTES: u64 = size_of::<Answer>() as u64;

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
                let answers = self.fetch::<X>(g, self.ask()?)?;
                self.sum_answers(&answers, pieces, memory)
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
        let (ws, n) = (self.job.ws, self.job.shape.vertices.max(1));
        let corners = 3 * self.unmeasured.len() / size_of::<Unmeasured<W>>() as u64;
        let plan = self.job.shuffle_plan(size_of::<Ask>(), corners);
        let asks = Shuffle::<Ask>::new(ws, "questions for coordinates", 0..n, plan)?;
        self.blocks(
            self.unmeasured,
            || asks.writer(),
            |writer: &mut Writer<Ask>, triangle: &Unmeasured<W>| {
                let (component, flip) = self.label(triangle.called());
                let word = component << 1 | u64::from(flip);
                for (k, v) in triangle.v().into_iter().enumerate() {
                    writer.push(Ask([v, triangle.t() << 2 | k as u64, word]))?;
                }
                Ok(())
            },
            Writer::finish,
        )?;
        asks.finish()
    }

    /// Answers them from ascending windows of G.
    fn fetch<X: Coord>(&self, g: &CoordArray, asks: Buckets<Ask>) -> Result<Buckets<Answer>> {
        let (ws, t) = (self.job.ws, self.job.shape.triangles.max(1));
        let plan = self.job.shuffle_plan(size_of::<Answer>(), asks.records());
        let answers = Shuffle::<Answer>::new(ws, "coordinates", 0..t, plan)?;
        let threads = ws.workers.count() as u64;
        let window = WINDOW * CoordReader::<X>::BYTES + (64 << 10);
        let _lease = ws.budget.lease("windows of G", threads * window)?;
        let memory = self.job.sort_memory(threads * plan.writer_bytes());
        ws.workers.run(
            asks.count(),
            || Ok((asks.sorter(memory)?, Fetch::<X>::new(g, answers.writer()?))),
            |(sorter, fetch), bucket| {
                asks.sorted(bucket, sorter, &mut |batch| {
                    batch.iter().try_for_each(|ask| fetch.answer(ask))
                })
            },
            |(_, fetch)| fetch.answers.finish(),
        )?;
        drop(asks);
        answers.finish()
    }

    /// Brings the three positions of each triangle together and sums them.
    fn sum_answers(
        &self,
        answers: &Buckets<Answer>,
        pieces: &Shuffle<Piece>,
        tally: u64,
    ) -> Result<()> {
        let (ws, components) = (self.job.ws, self.labels.components);
        let threads = ws.workers.count() as u64;
        let memory = self
            .job
            .sort_memory(threads * (tally + self.job.plan.writer));
        ws.workers.run(
            answers.count(),
            || {
                let tally = Tally::new(&ws.budget, tally, components, pieces)?;
                Ok((answers.sorter(memory)?, tally))
            },
            |(sorter, tally), bucket| {
                let mut corners = [[0f64; 3]; 3];
                answers.sorted(bucket, sorter, &mut |batch| {
                    for Answer([corner, word, at @ ..]) in batch {
                        let k = (corner & 3) as usize;
                        corners[k] = at.map(f64::from_bits);
                        // Places come in order, so the third completes the triangle.
                        if k == 2 {
                            let measure = &mut tally.at(word >> 1)?.measure;
                            measure.add(self.grid, corners, word & 1 == 1);
                        }
                    }
                    Ok(())
                })
            },
            |(_, tally)| tally.finish(),
        )
    }
}

/// One thread that reads G in ascending windows and answers.
struct Fetch<'a, X> {
    coords: CoordReader<'a, X>,
    first: u64,
    window: Vec<[X; 3]>,
    vertices: u64,
    answers: Writer<'a, Answer>,
}

impl<'a, X: Coord> Fetch<'a, X> {
    fn new(g: &'a CoordArray, answers: Writer<'a, Answer>) -> Self {
        Fetch {
            coords: CoordReader::new(g),
            first: 0,
            window: Vec::new(),
            vertices: g.vertices,
            answers,
        }
    }

    fn answer(&mut self, ask: &Ask) -> Result<()> {
        let [v, corner, word] = ask.0;
        if v < self.first || v - self.first >= self.window.len() as u64 {
            let count = WINDOW.min(self.vertices - v);
            self.window.clear();
            self.window.extend_from_slice(self.coords.read(v, count)?);
            self.first = v;
        }
        let [x, y, z] = self.window[(v - self.first) as usize].map(|x| x.wide().to_bits());
        self.answers.push(Answer([corner, word, x, y, z]))
    }
}
