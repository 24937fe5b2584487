//! Normals chunk by chunk of consecutive triangles.
//!
//! Why it works: a vertex that one chunk alone names has all its triangles there, in ascending
//! order, so its sum is complete when the chunk is. At a *seam vertex*, which more chunks name, each
//! corner sends its triangle's cross product to [`stars`], where they are added in ascending
//! order again. Which vertices are seams decides time and never the sum: ids may share bits, and
//! a chunk whose own vertices lie scattered treats all as seams, rather than write row by row.
//!
//! A chunk reads positions when its vertices lie close together in G, or in a few places. Else its
//! corners ask for them ([`asked`]).
//!
//! Memory: a chunk of [`BYTES`] a triangle and two writers a thread; bits for the vertices, N/4
//! bytes or less. I/O: V twice; of G what chunks need; N once; seam corners as [`stars`] says.

use super::Job;
use super::asked::{self, Ask};
use super::cross::{add, degenerate, unit};
use super::ranges::Triangles;
use super::rows::Run;
use super::stars::{self, Part};
use crate::build::arrays::{CoordReader, TriangleReader};
use crate::build::scan::{Marker, Seams};
use crate::chunk::ids::{LocalIds, NARROW_SPAN, TABLE_BYTES};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::error::Result;
use crate::shuffle::{Shuffle, Writer};
use std::sync::atomic::Ordering;

/// Distinct vertices of a chunk, a triangle, at most.
const SPREAD: u64 = 3;
/// Bytes for each triangle of a chunk: V; local ids; positions, sums and flags of the vertices;
/// the rows of G read at a time; ids in ascending order; the normals of the triangles.
pub(super) const BYTES: u64 = TriangleReader::<u64>::BYTES
    + 12
    + TABLE_BYTES
    + SPREAD * (24 + 24 + 2)
    + NARROW_SPAN * CoordReader::<f64>::BYTES
    + SPREAD * 16
    + 12;
/// Rows of G between two vertices that are read rather than skipped.
const GAP: u64 = 1 << 10;
/// Triangles for each place in G that a chunk reads.
const PER_PLACE: usize = 256;
/// Rows of G, a triangle, that a chunk reads at most.
const MOST_ROWS: u64 = 8;
/// Rows of normals, on average, that are worth a write of their own.
const LEAST_RUN: usize = 8;

/// Sums and writes all normals.
pub(super) fn by_chunks<I: Index, X: Coord, S: Index>(job: &Job) -> Result<()> {
    let (ws, t) = (job.ws, job.triangles);
    let seams = find_seams::<I>(job)?;
    let plan = job.shuffle_plan(size_of::<Part<S>>(), 3 * t);
    let parts = Shuffle::<Part<S>>::new(ws, "cross products", 0..job.vertices.max(1), plan)?;
    let plan = job.shuffle_plan(size_of::<Ask<S>>(), 3 * t);
    let asks = Shuffle::<Ask<S>>::new(ws, "corners that ask", 0..job.vertices.max(1), plan)?;
    ws.progress.begin("normals", "triangles", t);
    {
        let _lease = chunk_lease(job)?;
        ws.workers.run(
            t.div_ceil(job.chunk),
            || {
                Ok(Thread::<I, X, S> {
                    triangles: Triangles::new(job),
                    coords: CoordReader::new(&job.g),
                    asks: asks.writer()?,
                    parts: parts.writer()?,
                    ids: LocalIds::default(),
                    sorted: Vec::new(),
                    send: Vec::new(),
                    named: Vec::new(),
                    positions: Vec::new(),
                    sums: Vec::new(),
                    faces: Vec::new(),
                    run: Run::new(&job.out),
                })
            },
            |thread, chunk| {
                let (first, count) = job.chunk_range(chunk);
                thread.chunk(job, &seams, first, count)?;
                ws.progress.advance(count);
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
                Ok(())
            },
            |mut thread| {
                thread.run.flush()?;
                thread.asks.finish()?;
                thread.parts.finish()
            },
        )?;
    }
    ws.progress.end();
    drop(seams);
    asked::answer::<X, S>(job, asks.finish()?, &parts)?;
    stars::sum(job, parts.finish()?)
}

fn chunk_lease(job: &Job) -> Result<crate::disk::Lease> {
    let chunk = job.chunk.min(job.triangles) + 64;
    let bytes = job.ws.workers.count() as u64 * chunk * BYTES;
    job.ws.budget.lease("chunks of normals", bytes)
}

/// The vertices that more than one chunk names, and perhaps others.
fn find_seams<I: Index>(job: &Job) -> Result<Seams> {
    let (ws, t) = (job.ws, job.triangles);
    let exact = job.vertices.next_multiple_of(64).max(64);
    // Two arrays of bits in at most an eighth of the budget.
    let most = (job.ws.budget.limit() / 16 * 8).max(64);
    let bits = if exact <= most {
        exact
    } else {
        1 << most.ilog2()
    };
    let occurs = Seams::new(&ws.budget, bits, "marks of vertices")?;
    let seams = Seams::new(&ws.budget, bits, "seam marks")?;
    let _lease = chunk_lease(job)?;
    ws.progress.begin("seams of normals", "triangles", t);
    ws.workers.run(
        t.div_ceil(job.chunk),
        || Ok((Triangles::<I>::new(job), Marker::default())),
        |(triangles, marker), chunk| {
            let (first, count) = job.chunk_range(chunk);
            let rows = triangles.read(first, count)?;
            marker.mark(rows.as_flattened(), &occurs, &seams);
            ws.progress.advance(count);
            Ok(())
        },
        |_| Ok(()),
    )?;
    ws.progress.end();
    Ok(seams)
}

/// Scratch memory of one thread.
struct Thread<'a, I, X, S: Index> {
    triangles: Triangles<'a, I>,
    coords: CoordReader<'a, X>,
    asks: Writer<'a, Ask<S>>,
    parts: Writer<'a, Part<S>>,
    ids: LocalIds,
    /// Scattered chunks: global and local ids, ascending.
    sorted: Vec<(u64, u32)>,
    /// By local vertex: its cross products are sent on.
    send: Vec<bool>,
    /// By local vertex: the chunk names it.
    named: Vec<bool>,
    /// By local vertex; only of scattered chunks.
    positions: Vec<[X; 3]>,
    /// By local vertex.
    sums: Vec<[f64; 3]>,
    faces: Vec<[f32; 3]>,
    run: Run<'a>,
}

impl<I: Index, X: Coord, S: Index> Thread<'_, I, X, S> {
    fn chunk(&mut self, job: &Job, seams: &Seams, first: u64, count: u64) -> Result<()> {
        let rows = self.triangles.read(first, count)?;
        self.ids.assign(rows.as_flattened());
        let positions: &[[X; 3]] = match self.ids.window() {
            Some(lo) => self.coords.read(lo, self.ids.span() as u64)?,
            None => {
                sort_ids(&self.ids, &mut self.sorted);
                let (ids, to) = (&self.sorted, &mut self.positions);
                to.clear();
                to.resize(ids.len(), [X::zeroed(); 3]);
                if !read_places(&mut self.coords, ids, count, to)? {
                    return ask(rows, first, &mut self.asks);
                }
                to
            }
        };
        let (ids, sorted) = (&self.ids, &self.sorted);
        mark_sent(ids, sorted, seams, &mut self.named, &mut self.send);
        self.sums.clear();
        self.sums.resize(self.ids.span(), [0.0; 3]);
        self.faces.clear();
        let mut left_out = 0;
        for (t, local) in (first..).zip(self.ids.local().as_chunks::<3>().0) {
            let cross = if degenerate(local) {
                Some([0.0; 3])
            } else {
                job.cross.of(local.map(|l| positions[l as usize]))
            };
            left_out += u64::from(cross.is_none());
            let cross = cross.unwrap_or([0.0; 3]);
            if job.faces.is_some() {
                self.faces.push(unit(cross));
            }
            if cross == [0.0; 3] {
                continue;
            }
            for &l in local {
                if self.send[l as usize] {
                    self.parts.push(Part::new(self.ids.global(l), t, cross))?;
                } else {
                    add(&mut self.sums[l as usize], cross);
                }
            }
        }
        job.leave_out(left_out);
        if let Some(faces) = &job.faces {
            faces.write(first, &self.faces)?;
        }
        self.hand_out(job)
    }

    /// Writes the sums that are complete. A sum of zero is left as the zero that the file has:
    /// its vertex may be another chunk's, whose ids lie around this one's.
    fn hand_out(&mut self, job: &Job) -> Result<()> {
        let mut nonzero = 0;
        let (sums, run) = (&self.sums, &mut self.run);
        let mut put = |v: u64, l: usize| {
            if sums[l] == [0.0; 3] {
                return Ok(());
            }
            nonzero += 1;
            run.put(v, unit(sums[l]))
        };
        match self.ids.window() {
            Some(lo) => (0..sums.len()).try_for_each(|l| put(lo + l as u64, l))?,
            None => {
                let mut sorted = self.sorted.iter();
                sorted.try_for_each(|&(v, l)| put(v, l as usize))?
            }
        }
        job.nonzero.fetch_add(nonzero, Ordering::Relaxed);
        Ok(())
    }
}

/// Global and local ids of a scattered chunk, ascending.
fn sort_ids(ids: &LocalIds, to: &mut Vec<(u64, u32)>) {
    to.clear();
    to.extend(ids.table().iter().copied().zip(0..));
    to.sort_unstable();
}

/// Reads the positions of a chunk of `count` triangles whose vertices lie in a few places of G;
/// false when they are many.
fn read_places<X: Coord>(
    coords: &mut CoordReader<X>,
    ids: &[(u64, u32)],
    count: u64,
    to: &mut [[X; 3]],
) -> Result<bool> {
    let near = |a: &(u64, u32), b: &(u64, u32)| b.0 - a.0 <= GAP;
    let (mut places, mut rows) = (0, 0);
    for place in ids.chunk_by(near) {
        places += 1;
        rows += place[place.len() - 1].0 - place[0].0 + 1;
    }
    if places > 2 + count as usize / PER_PLACE || rows > MOST_ROWS * count {
        return Ok(false);
    }
    // As many rows at a time as the window of a narrow chunk has.
    let most = (NARROW_SPAN * count).max(1);
    for place in ids.chunk_by(near) {
        let mut rest = place;
        while let (Some(&(lo, _)), Some(&(hi, _))) = (rest.first(), rest.last()) {
            let window = coords.read(lo, (hi - lo + 1).min(most))?;
            let end = rest.partition_point(|&(v, _)| v - lo < window.len() as u64);
            for &(v, l) in &rest[..end] {
                to[l as usize] = window[(v - lo) as usize];
            }
            rest = &rest[end..];
        }
    }
    Ok(true)
}

/// Asks for the positions of all corners that count.
fn ask<I: Index, S: Index>(rows: &[[I; 3]], first: u64, asks: &mut Writer<Ask<S>>) -> Result<()> {
    for (t, row) in (first..).zip(rows) {
        if !degenerate(row) {
            for (k, v) in row.iter().enumerate() {
                asks.push(Ask::new(v.wide(), t, k))?;
            }
        }
    }
    Ok(())
}

/// Marks the vertices whose cross products are sent on: the seam vertices, or all when the
/// others lie so scattered that nearly each would be a write of its own.
fn mark_sent(
    ids: &LocalIds,
    sorted: &[(u64, u32)],
    seams: &Seams,
    named: &mut Vec<bool>,
    send: &mut Vec<bool>,
) {
    seams.flags(ids, send);
    named.clear();
    named.resize(ids.span(), false);
    ids.local().iter().for_each(|&l| named[l as usize] = true);
    let (mut own, mut runs, mut next) = (0, 0, u64::MAX);
    let mut look = |v: u64, l: usize| {
        if named[l] && !send[l] {
            own += 1;
            runs += usize::from(v != next);
            next = v + 1;
        }
    };
    match ids.window() {
        Some(lo) => (lo..).zip(0..ids.span()).for_each(|(v, l)| look(v, l)),
        None => sorted.iter().for_each(|&(v, l)| look(v, l as usize)),
    }
    if runs * LEAST_RUN > own {
        send.fill(true);
    }
}
