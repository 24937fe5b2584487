//! Normals by ranges of vertices: all of G is in memory, and the sums of a range for each thread.
//!
//! Why it works: a thread walks V from the first triangle to the last and adds a cross product
//! where a corner's vertex lies in its range, so each vertex's sum has one owner and grows in
//! ascending order of triangles. No two threads share anything that is written.
//!
//! When G takes half of the budget, the sums of all vertices take twice the rest, so V is walked
//! a few times at most.
//!
//! Memory: all of G; t ranges of 24 bytes a vertex, t blocks of V. I/O: V once for each range, the
//! rows of G that are taken, N once.

use super::Job;
use super::cross::{add, degenerate, unit};
use super::rows::{HELD, Run};
use crate::build::arrays::TriangleReader;
use crate::build::whole::Whole;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::error::{Error, Result};
use std::sync::atomic::Ordering;

/// Triangles of V read at a time.
const STEP: u64 = 16 << 10;
/// Bytes of a sum.
const SUM: u64 = size_of::<[f64; 3]>() as u64;
/// More ranges at a time than this walk V more often than they share work.
const MOST_RANGES: u64 = 8;

/// Reads triangles, with every vertex held to its bound.
pub(super) struct Triangles<'a, I> {
    reader: TriangleReader<'a, I>,
    job: &'a Job<'a>,
}

impl<'a, I: Index> Triangles<'a, I> {
    pub(super) fn new(job: &'a Job<'a>) -> Self {
        let reader = TriangleReader::new(&job.v);
        Triangles { reader, job }
    }

    /// The vertices of `count` triangles from `first`.
    pub(super) fn read(&mut self, first: u64, count: u64) -> Result<&[[I; 3]]> {
        let v = self.reader.read(first, count)?;
        let top = v.iter().max().map_or(0, |top| top.wide());
        if top >= self.job.vertices && !v.is_empty() {
            let corner = v.iter().position(|x| x.wide() >= self.job.vertices);
            let triangle = first + corner.unwrap_or(0) as u64 / 3;
            return Err(Error::input(
                self.job.v.source.data().path(),
                format!("triangle {triangle}"),
                format!("a vertex below {}", self.job.vertices),
                top.to_string(),
                "the folder is damaged; `cornermill verify` says how; build it again",
            ));
        }
        Ok(v.as_chunks().0)
    }
}

/// Threads that work, and vertices of the range of each.
fn plan(job: &Job) -> (u64, u64) {
    let threads = (job.ws.workers.count() as u64).min(MOST_RANGES);
    // An eighth stays for what is small.
    let memory = job.ws.budget.free() / 8 * 7 / threads;
    let fixed = STEP * TriangleReader::<u64>::BYTES + HELD;
    let fits = memory.saturating_sub(fixed) / SUM;
    let even = job.vertices.div_ceil(threads).max(1);
    (threads, fits.clamp(1, even))
}

/// Sums and writes all normals.
pub(super) fn by_ranges<I: Index, X: Coord>(job: &Job, g: &Whole<X>) -> Result<()> {
    let (ws, t) = (job.ws, job.triangles);
    let (threads, range) = plan(job);
    let units = job.vertices.div_ceil(range);
    let reading = STEP * TriangleReader::<u64>::BYTES + HELD;
    let _lease = ws
        .budget
        .lease("sums of normals", threads * (range * SUM + reading))?;
    ws.progress.begin("normals", "triangles", t * units);
    ws.workers.run(
        units,
        || Ok((Triangles::<I>::new(job), Vec::new())),
        |(triangles, sums), unit| {
            let first = unit * range;
            sums.clear();
            sums.resize(range.min(job.vertices - first) as usize, [0.0; 3]);
            sum_range(job, g, triangles, first, sums)?;
            write_range(job, first, sums)
        },
        |_| Ok(()),
    )?;
    ws.progress.end();
    write_faces::<I, X>(job, g)
}

/// Adds up what concerns the vertices from `lo` on.
fn sum_range<I: Index, X: Coord>(
    job: &Job,
    g: &Whole<X>,
    triangles: &mut Triangles<I>,
    lo: u64,
    sums: &mut [[f64; 3]],
) -> Result<()> {
    let rows = g.rows()?;
    let span = sums.len() as u64;
    for first in (0..job.triangles).step_by(STEP as usize) {
        let count = STEP.min(job.triangles - first);
        let (mut taken, mut left_out) = (0, 0);
        for v in triangles.read(first, count)? {
            let place = v.map(|v| v.wide().wrapping_sub(lo));
            if place.iter().all(|&p| p >= span) || degenerate(v) {
                continue;
            }
            taken += 3;
            match job.cross.of(v.map(|v| rows[v.wide() as usize])) {
                Some(cross) => {
                    for p in place.into_iter().filter(|&p| p < span) {
                        add(&mut sums[p as usize], cross);
                    }
                }
                // Counted by the owner of the first corner.
                None => left_out += u64::from(place[0] < span),
            }
        }
        g.took(taken);
        job.leave_out(left_out);
        job.ws.progress.advance(count);
    }
    Ok(())
}

fn write_range(job: &Job, first: u64, sums: &[[f64; 3]]) -> Result<()> {
    let mut run = Run::new(&job.out);
    let mut nonzero = 0;
    for (v, &sum) in (first..).zip(sums) {
        nonzero += u64::from(sum != [0.0; 3]);
        run.put(v, unit(sum))?;
    }
    job.nonzero.fetch_add(nonzero, Ordering::Relaxed);
    run.flush()
}

/// The normals of the triangles, when they are asked for.
fn write_faces<I: Index, X: Coord>(job: &Job, g: &Whole<X>) -> Result<()> {
    let (Some(faces), ws, t) = (&job.faces, job.ws, job.triangles) else {
        return Ok(());
    };
    let thread = STEP * TriangleReader::<I>::BYTES + HELD;
    let bytes = ws.workers.count() as u64 * thread;
    let _lease = ws.budget.lease("triangles", bytes)?;
    ws.progress.begin("normals of triangles", "triangles", t);
    let rows = g.rows()?;
    ws.workers.run(
        t.div_ceil(STEP),
        || Ok((Triangles::<I>::new(job), Run::new(faces))),
        |(triangles, run), block| {
            let first = block * STEP;
            let count = STEP.min(t - first);
            for (t, v) in (first..).zip(triangles.read(first, count)?) {
                let cross = job.cross.of(v.map(|v| rows[v.wide() as usize]));
                let cross = cross.filter(|_| !degenerate(v)).unwrap_or([0.0; 3]);
                run.put(t, unit(cross))?;
            }
            g.took(3 * count as usize);
            ws.progress.advance(count);
            Ok(())
        },
        |(_, mut run)| run.flush(),
    )?;
    ws.progress.end();
    Ok(())
}
