//! Triangles whose corners ask for their positions, since their vertices lie far apart in G.
//!
//! Why it works: positions come to the corners through two shuffles, so that G is read in
//! ascending windows and never at random: a corner asks by vertex, and is answered by triangle.
//! Each carries what the triangle adds to along, so nothing is looked up on the way. Sums do not
//! depend on the order.
//!
//! Memory: a tally, a sorter, a writer and a window of G a thread. I/O: 12 and 20 bytes a corner
//! to scratch and back, 24 and 40 for wide ids (40 for wide coordinates); G once.

use super::Job;
use super::arrays::CoordReader;
use super::tally::{Pieces, Tally};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::error::{Result, conserve};
use crate::input::CoordArray;
use crate::shuffle::{Buckets, Record, Shuffle, Writer};
use bytemuck::{Pod, Zeroable};

/// What a triangle adds to: its component, whether it is flipped against the component's first,
/// and whether it is a local component of its own that is to be counted, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Adds {
    /// The component.
    pub component: u64,
    /// Whether it is flipped.
    pub flip: bool,
    /// Whether it is counted.
    pub counted: bool,
}

impl Adds {
    fn word(self) -> u64 {
        self.component << 2 | u64::from(self.counted) << 1 | u64::from(self.flip)
    }

    fn of(word: u64) -> Adds {
        Adds {
            component: word >> 2,
            counted: word >> 1 & 1 == 1,
            flip: word & 1 == 1,
        }
    }

    /// Adds triangle t, with its corners where they are known.
    ///
    /// # Errors
    /// As a push to the shuffle of sums.
    #[inline]
    pub fn add(self, tally: &mut Tally, t: u64, corners: Option<[[f64; 3]; 3]>) -> Result<()> {
        if self.counted {
            tally.at(self.component)?.count_alone(t, self.flip);
        }
        match corners {
            Some(corners) => tally.add(self.component, corners, self.flip),
            None => Ok(()),
        }
    }
}

/// A corner asks for its vertex's position: vertex, `4t + k`, what its triangle adds to.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Ask<W>([W; 3]);

impl<W: Index> Ask<W> {
    /// Corner k of triangle t asks for vertex v.
    #[inline]
    pub fn new(v: u64, (t, k): (u64, usize), adds: Adds) -> Self {
        Ask([v, t << 2 | k as u64, adds.word()].map(W::of))
    }
}

impl<W: Index> Record for Ask<W> {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// The position on its way to the corner: `4t + k`, what the triangle adds to, bits of x, y, z.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Answer<S>([S; 5]);

impl<S: Bits> Record for Answer<S> {
    /// The triangle, then the place in it.
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        let corner = self.0[0].wide();
        if level == 0 { corner >> 2 } else { corner & 3 }
    }
}

/// A word that holds an id, or the bits of a coordinate.
trait Bits: Index {
    /// The bits of a coordinate that has no more.
    fn bits(x: f64) -> Self;
    /// The coordinate back.
    fn float(self) -> f64;
}

impl Bits for u32 {
    fn bits(x: f64) -> u32 {
        (x as f32).to_bits()
    }
    fn float(self) -> f64 {
        f64::from(f32::from_bits(self))
    }
}

impl Bits for u64 {
    fn bits(x: f64) -> u64 {
        x.to_bits()
    }
    fn float(self) -> f64 {
        f64::from_bits(self)
    }
}

/// Bytes of a corner's question and of its answer in scratch, for ids and coordinates of so many
/// bytes.
pub fn asked(width: u64, coord: u64) -> [u64; 2] {
    [3 * width, 5 * width.max(coord)]
}

/// Vertices of G in one window.
const WINDOW: u64 = 4 << 10;

/// A shuffle for the questions of so many corners.
///
/// # Errors
/// [`crate::Error::Internal`] for a plan beyond what a writer numbers.
pub fn questions<W: Index>(job: &Job, corners: u64) -> Result<Shuffle<Ask<W>>> {
    let plan = job.shuffle_plan(size_of::<Ask<W>>(), corners);
    let keys = 0..job.shape.vertices.max(1);
    Shuffle::new(job.ws, "questions for coordinates", keys, plan)
}

/// Answers the questions, and sums the triangles that asked.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn measure_asked<W: Index, X: Coord>(
    job: &Job,
    g: &CoordArray,
    asks: Buckets<Ask<W>>,
    pieces: &Pieces,
) -> Result<()> {
    if asks.records() == 0 {
        return Ok(());
    }
    if W::BYTES.max(X::BYTES) == 4 {
        sum(job, &fetch::<W, X, u32>(job, g, asks)?, pieces)
    } else {
        sum(job, &fetch::<W, X, u64>(job, g, asks)?, pieces)
    }
}

/// Sums the triangles, whose corners come with their positions.
fn sum<S: Bits>(job: &Job, answers: &Buckets<Answer<S>>, pieces: &Pieces) -> Result<()> {
    let (ws, threads) = (job.ws, job.ws.workers.count() as u64);
    let memory = job.sort_memory(threads * (pieces.memory + job.plan.writer));
    ws.workers.run(
        answers.count(),
        || {
            let tally = pieces.tally()?;
            Ok((answers.sorter(memory)?, tally))
        },
        |(sorter, tally), bucket| {
            let mut corners = [[0f64; 3]; 3];
            answers.sorted(bucket, sorter, &mut |batch| {
                for Answer([corner, adds, at @ ..]) in batch {
                    let (t, k) = (corner.wide() >> 2, (corner.wide() & 3) as usize);
                    corners[k] = at.map(S::float);
                    // Places come in order, so the third completes the triangle.
                    if k == 2 {
                        Adds::of(adds.wide()).add(tally, t, Some(corners))?;
                    }
                }
                Ok(())
            })
        },
        |(_, tally)| tally.finish(),
    )
}

/// Answers from ascending windows of G.
fn fetch<W: Index, X: Coord, S: Bits>(
    job: &Job,
    g: &CoordArray,
    asks: Buckets<Ask<W>>,
) -> Result<Buckets<Answer<S>>> {
    let (ws, t) = (job.ws, job.shape.triangles.max(1));
    let plan = job.shuffle_plan(size_of::<Answer<S>>(), asks.records());
    let answers = Shuffle::<Answer<S>>::new(ws, "coordinates", 0..t, plan)?;
    let threads = ws.workers.count() as u64;
    let window = WINDOW * CoordReader::<X>::BYTES + (64 << 10);
    let _lease = ws.budget.lease("windows of G", threads * window)?;
    let memory = job.sort_memory(threads * plan.writer_bytes());
    ws.workers.run(
        asks.count(),
        || {
            let fetch = Fetch::<X, S>::new(g, answers.writer()?);
            Ok((asks.sorter(memory)?, fetch))
        },
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
struct Fetch<'a, X, S> {
    coords: CoordReader<'a, X>,
    first: u64,
    window: Vec<[X; 3]>,
    vertices: u64,
    answers: Writer<'a, Answer<S>>,
}

impl<'a, X: Coord, S: Bits> Fetch<'a, X, S> {
    fn new(g: &'a CoordArray, answers: Writer<'a, Answer<S>>) -> Self {
        Fetch {
            coords: CoordReader::new(g),
            first: 0,
            window: Vec::new(),
            vertices: g.vertices,
            answers,
        }
    }

    fn answer<W: Index>(&mut self, ask: &Ask<W>) -> Result<()> {
        let [v, corner, adds] = ask.0.map(W::wide);
        if v < self.first || v - self.first >= self.window.len() as u64 {
            let count = WINDOW.min(self.vertices - v);
            self.window.clear();
            self.window.extend_from_slice(self.coords.read(v, count)?);
            self.first = v;
        }
        let [x, y, z] = self.window[(v - self.first) as usize].map(|x| S::bits(x.wide()));
        self.answers
            .push(Answer([S::of(corner), S::of(adds), x, y, z]))
    }
}
