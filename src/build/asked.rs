//! Triangles whose corners ask for their positions, since their vertices lie far apart in G.
//!
//! Why it works: positions come to the corners through two shuffles, so that G is read in
//! ascending windows and never at random: a corner asks by vertex, and is answered by triangle.
//! Each carries what the triangle adds to along, so nothing is looked up on the way. Sums do not
//! depend on the order.
//!
//! Memory: a tally, a sorter, a writer and a window of G a thread. I/O: 24 and 40 bytes a corner
//! to scratch and back; G once.

use super::Job;
use super::arrays::CoordReader;
use super::tally::{Piece, Tally};
use crate::chunk::grid::Grid;
use crate::chunk::measure::Coord;
use crate::error::{Result, conserve};
use crate::input::CoordArray;
use crate::shuffle::{Buckets, Record, Shuffle, Writer};
use bytemuck::{Pod, Zeroable};

/// A corner asks for its vertex's position: vertex, `4t + k`, `2 * component + flip`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Ask([u64; 3]);

impl Ask {
    /// Corner k of triangle t asks for vertex v; the triangle belongs to a component, and is
    /// flipped, or not, against its first triangle.
    #[inline]
    pub fn new(v: u64, (t, k): (u64, usize), (component, flip): (u64, bool)) -> Ask {
        Ask([v, t << 2 | k as u64, component << 1 | u64::from(flip)])
    }
}

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

/// Bytes of a corner's question and of its answer in scratch.
pub const ASKED: [u64; 2] = [size_of::<Ask>() as u64, size_of::<Answer>() as u64];

/// Vertices of G in one window.
const WINDOW: u64 = 4 << 10;

/// Where measures go.
pub struct Sum<'a> {
    /// The grid of volumes.
    pub grid: &'a Grid,
    /// Sums by component.
    pub pieces: &'a Shuffle<Piece>,
    /// Number of components.
    pub components: u64,
    /// Bytes of each thread's tally.
    pub tally: u64,
}

/// A shuffle for the questions of so many corners.
///
/// # Errors
/// [`crate::Error::Internal`] for a plan beyond what a writer numbers.
pub fn questions(job: &Job, corners: u64) -> Result<Shuffle<Ask>> {
    let plan = job.shuffle_plan(size_of::<Ask>(), corners);
    let keys = 0..job.shape.vertices.max(1);
    Shuffle::new(job.ws, "questions for coordinates", keys, plan)
}

/// Answers the questions, and sums the triangles that asked.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn measure_asked<X: Coord>(
    job: &Job,
    g: &CoordArray,
    asks: Buckets<Ask>,
    sum: &Sum,
) -> Result<()> {
    if asks.records() == 0 {
        return Ok(());
    }
    let answers = fetch::<X>(job, g, asks)?;
    let (ws, threads) = (job.ws, job.ws.workers.count() as u64);
    let memory = job.sort_memory(threads * (sum.tally + job.plan.writer));
    ws.workers.run(
        answers.count(),
        || {
            let tally = Tally::new(&ws.budget, sum.tally, sum.components, sum.pieces)?;
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
                        measure.add(sum.grid, corners, word & 1 == 1);
                    }
                }
                Ok(())
            })
        },
        |(_, tally)| tally.finish(),
    )
}

/// Answers from ascending windows of G.
fn fetch<X: Coord>(job: &Job, g: &CoordArray, asks: Buckets<Ask>) -> Result<Buckets<Answer>> {
    let (ws, t) = (job.ws, job.shape.triangles.max(1));
    let plan = job.shuffle_plan(size_of::<Answer>(), asks.records());
    let answers = Shuffle::<Answer>::new(ws, "coordinates", 0..t, plan)?;
    let threads = ws.workers.count() as u64;
    let window = WINDOW * CoordReader::<X>::BYTES + (64 << 10);
    let _lease = ws.budget.lease("windows of G", threads * window)?;
    let memory = job.sort_memory(threads * plan.writer_bytes());
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
    let asked = asks.records();
    drop(asks);
    let answers = answers.finish()?;
    conserve(
        "components",
        "questions for coordinates",
        asked,
        answers.records(),
    )?;
    Ok(answers)
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
