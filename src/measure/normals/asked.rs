//! Triangles whose corners ask for their positions, since their vertices lie far apart in G.
//!
//! Why it works: positions come to the corners through two shuffles, so that G is read in
//! ascending windows and never at random: a corner asks by vertex, and is answered by triangle.
//! The answer carries the vertex along, so that the cross product can be sent on to it.
//!
//! Memory: a sorter and a writer a thread, and a window of G. I/O: for each corner 8 and 20 bytes to
//! scratch and back (twice for large meshes or coordinates of 8 bytes); G once.

use super::Job;
use super::cross::unit;
use super::rows::{HELD, Run};
use super::stars::Part;
use crate::build::arrays::CoordReader;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::error::Result;
use crate::shuffle::{Buckets, Record, Shuffle, Writer};
use bytemuck::{Pod, Zeroable};

/// Rows of G in one window.
const WINDOW: u64 = 4 << 10;

/// A corner asks for its vertex's position: vertex, `4t + k`.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Ask<S>([S; 2]);

impl<S: Index> Ask<S> {
    /// Corner k of triangle t asks for vertex v.
    #[inline]
    pub(super) fn new(v: u64, t: u64, k: usize) -> Self {
        Ask([S::of(v), S::of(t << 2 | k as u64)])
    }
}

impl<S: Index> Record for Ask<S> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// The position on its way to the corner.
#[repr(C, packed)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Answer<S, X> {
    /// `4t + k`.
    corner: S,
    /// Vertex.
    vertex: S,
    position: [X; 3],
}

impl<S: Index, X: Coord> Record for Answer<S, X> {
    /// The triangle, then the place in it.
    const LEVELS: usize = 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        let corner = { self.corner }.wide();
        if level == 0 { corner >> 2 } else { corner & 3 }
    }
}

/// Answers the corners that asked, and sends the cross products of their triangles on.
pub(super) fn answer<X: Coord, S: Index>(
    job: &Job,
    asks: Buckets<Ask<S>>,
    parts: &Shuffle<Part<S>>,
) -> Result<()> {
    if asks.records() == 0 {
        return Ok(());
    }
    let (ws, threads) = (job.ws, job.ws.workers.count() as u64);
    let corners = asks.records();
    let answers = fetch::<X, S>(job, asks)?;
    let memory = job.sort_memory(threads * (job.writer + HELD));
    ws.progress.begin("cross products", "corners", corners);
    let _lease = ws.budget.lease("normals of triangles", threads * HELD)?;
    ws.workers.run(
        answers.count(),
        || {
            let thread = Thread {
                job,
                parts: parts.writer()?,
                faces: job.faces.as_ref().map(Run::new),
                vertices: [0; 3],
                corners: [[X::zeroed(); 3]; 3],
                left_out: 0,
            };
            Ok((answers.sorter(memory)?, thread))
        },
        |(sorter, thread), bucket| {
            answers.sorted(bucket, sorter, &mut |batch| {
                ws.progress.advance(batch.len() as u64);
                batch.iter().try_for_each(|answer| thread.take(answer))
            })
        },
        |(_, thread)| thread.finish(),
    )?;
    ws.progress.end();
    Ok(())
}

/// One thread that puts triangles together.
struct Thread<'a, X, S: Index> {
    job: &'a Job<'a>,
    parts: Writer<'a, Part<S>>,
    faces: Option<Run<'a>>,
    vertices: [u64; 3],
    corners: [[X; 3]; 3],
    left_out: u64,
}

impl<X: Coord, S: Index> Thread<'_, X, S> {
    fn take(&mut self, answer: &Answer<S, X>) -> Result<()> {
        let corner = { answer.corner }.wide();
        let k = (corner & 3) as usize;
        self.vertices[k] = { answer.vertex }.wide();
        self.corners[k] = answer.position;
        // Places come in order, so the third completes the triangle.
        if k < 2 {
            return Ok(());
        }
        let t = corner >> 2;
        let cross = self.job.cross.of(self.corners);
        self.left_out += u64::from(cross.is_none());
        let cross = cross.unwrap_or([0.0; 3]);
        if let Some(faces) = &mut self.faces {
            faces.put(t, unit(cross))?;
        }
        if cross != [0.0; 3] {
            for v in self.vertices {
                self.parts.push(Part::new(v, t, cross))?;
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<()> {
        self.job.leave_out(self.left_out);
        if let Some(mut faces) = self.faces {
            faces.flush()?;
        }
        self.parts.finish()
    }
}

/// Answers from ascending windows of G.
fn fetch<X: Coord, S: Index>(job: &Job, asks: Buckets<Ask<S>>) -> Result<Buckets<Answer<S, X>>> {
    let (ws, t) = (job.ws, job.triangles.max(1));
    let plan = job.shuffle_plan(size_of::<Answer<S, X>>(), asks.records());
    let answers = Shuffle::<Answer<S, X>>::new(ws, "positions by triangle", 0..t, plan)?;
    let threads = ws.workers.count() as u64;
    let window = WINDOW * CoordReader::<X>::BYTES + (64 << 10);
    let _lease = ws.budget.lease("windows of G", threads * window)?;
    let memory = job.sort_memory(threads * plan.writer_bytes());
    ws.progress
        .begin("positions that are far", "corners", asks.records());
    ws.workers.run(
        asks.count(),
        || {
            let fetch = Fetch {
                coords: CoordReader::new(&job.g),
                first: 0,
                window: Vec::new(),
                vertices: job.vertices,
                answers: answers.writer()?,
            };
            Ok((asks.sorter(memory)?, fetch))
        },
        |(sorter, fetch), bucket| {
            asks.sorted(bucket, sorter, &mut |batch| {
                ws.progress.advance(batch.len() as u64);
                batch.iter().try_for_each(|ask| fetch.answer(ask))
            })
        },
        |(_, fetch)| fetch.answers.finish(),
    )?;
    ws.progress.end();
    drop(asks);
    answers.finish()
}

/// One thread that reads G in ascending windows and answers.
struct Fetch<'a, X, S: Index> {
    coords: CoordReader<'a, X>,
    first: u64,
    window: Vec<[X; 3]>,
    vertices: u64,
    answers: Writer<'a, Answer<S, X>>,
}

impl<X: Coord, S: Index> Fetch<'_, X, S> {
    fn answer(&mut self, ask: &Ask<S>) -> Result<()> {
        let [vertex, corner] = ask.0;
        let v = vertex.wide();
        if v < self.first || v - self.first >= self.window.len() as u64 {
            let count = WINDOW.min(self.vertices - v);
            self.window.clear();
            self.window.extend_from_slice(self.coords.read(v, count)?);
            self.first = v;
        }
        let position = self.window[(v - self.first) as usize];
        self.answers.push(Answer {
            corner,
            vertex,
            position,
        })
    }
}
