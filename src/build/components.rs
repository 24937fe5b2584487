//! Components: sums each component, decides its orientation, writes its row of the table.
//!
//! Why it works: an orientable component has two consistent orientations, the one of its
//! first triangle and the other; all sums are gathered for the first, and the choice is one
//! bit. The volume decides for orientable watertight components (their volume does not depend
//! on the reference point); all others keep what most of their triangles had.
//!
//! At a non-manifold edge a component's own corners cancel when as many run it one way as the
//! other: the corners come sorted by edge, are re-sorted by (component, edge) and counted.
//!
//! Memory: labels and bits by component, a tally, sorters and writers. I/O: the records of
//! local components once, non-manifold corners once more; the rows written once.

use super::Job;
use super::arrays::OutArray;
use super::chunks::Chunked;
use super::deferred::{Deferred, measure_deferred};
use super::nodes::Nodes;
use super::records::{EdgeCorner, LocalCount, MeasureRecord};
use super::scratch_items;
use super::stitch::{Bits, Labels, Union};
use super::tally::{Piece, Sums, Tally, reduce};
use crate::chunk::grid::Grid;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::Result;
use crate::folder::{self, ComponentRow, Counts, Orient};
use crate::shuffle::{Buckets, Record, Shuffle};
use bytemuck::{Pod, Zeroable};

/// What was decided.
pub struct Chosen {
    /// Components to be flipped against the orientation of their first triangle.
    pub flip: Bits,
    /// The table's file.
    pub table: OutArray,
    /// Corners on non-manifold edges, sorted by edge and corner.
    pub cuts: ScratchFile,
}

/// What the pass works with.
pub struct Given<'a, W: Index> {
    /// Numbers of the local components.
    pub nodes: Nodes<'a>,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// Local components of border edges at seams.
    pub borders: &'a ScratchFile,
    /// Corners on non-manifold edges.
    pub cuts: &'a Buckets<EdgeCorner<W>>,
    /// The grid of volumes.
    pub grid: &'a Grid,
}

/// What the chunks counted and measured, with what it takes to measure the rest.
pub struct ChunkSums<'a, W: Index> {
    /// Chunks.
    pub chunked: &'a Chunked,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// Local labels of the triangles.
    pub component: &'a OutArray,
    /// The grid of volumes.
    pub grid: &'a Grid,
}

/// A corner of a component on a non-manifold edge: component, edge, 1 or -1.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Side([u64; 3]);

impl Record for Side {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        self.0[level]
    }
}

/// Runs the pass; fills in the counts that it knows. `sum` adds up what local components counted
/// and measured, with tables of so many bytes a thread.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn components<W: Index>(
    job: &Job,
    given: &Given<W>,
    counts: &mut Counts,
    sum: impl FnOnce(&Shuffle<Piece>, u64) -> Result<()>,
) -> Result<Chosen> {
    let ws = job.ws;
    let number = given.labels.components;
    let threads = ws.workers.count() as u64;
    let plan = job.shuffle_plan(size_of::<Piece>(), number);
    let pieces = Shuffle::<Piece>::new(ws, "sums by component", 0..number.max(1), plan)?;
    let tally = ws.budget.free() / 16 / threads;
    sum(&pieces, tally)?;
    let cuts = ws.scratch.file("sorted corners of non-manifold edges")?;
    sum_seams(job, given, &pieces, tally, &cuts, counts)?;
    let pieces = pieces.finish()?;
    let mut flip = Bits::new(&ws.budget, "flips by component", number)?;
    let table = OutArray::create(
        job.dir,
        folder::COMPONENTS,
        folder::COMPONENT_DESCR,
        &[number],
        size_of::<ComponentRow>() as u64,
        ws,
    )?;
    let mut sorter = pieces.sorter(job.sort_memory(0))?;
    let mut rows: Vec<ComponentRow> = Vec::with_capacity(512);
    let mut written = 0;
    reduce(&pieces, &mut sorter, |component, sums| {
        if component != written + rows.len() as u64 {
            let what = format!(
                "component {component} came after {} rows",
                written + rows.len() as u64
            );
            return Err(crate::Error::Internal(what));
        }
        let (row, against) = decide(job, given, component, sums);
        if against {
            flip.set(component);
        }
        count(&row, counts);
        rows.push(row);
        if rows.len() == rows.capacity() {
            table.write(written, &rows)?;
            written += rows.len() as u64;
            rows.clear();
        }
        Ok(())
    })?;
    table.write(written, &rows)?;
    Ok(Chosen { flip, table, cuts })
}

/// The orientation and the row of one component.
fn decide<W: Index>(job: &Job, given: &Given<W>, component: u64, s: &Sums) -> (ComponentRow, bool) {
    let m = &s.measure;
    let orientable = !given.labels.nonorientable.get(component);
    let closed = s.borders == 0 && s.cuts == 0;
    let watertight = closed || (s.borders == 0 && !s.unbalanced);
    let measured = job.g.is_some() && !m.nonfinite;
    let by_volume = job.orient == Orient::Outward
        && orientable
        && watertight
        && measured
        && m.six_oriented != 0;
    let keeps_input = job.orient == Orient::Keep || !orientable;
    let against = if keeps_input || job.orient == Orient::First {
        false
    } else if by_volume {
        m.six_oriented < 0
    } else {
        2 * s.flipped > s.triangles
    };
    let six = match (keeps_input, against) {
        (true, _) => m.six_input,
        (_, true) => -m.six_oriented,
        (_, false) => m.six_oriented,
    };
    let flipped = match (keeps_input, against) {
        (true, _) => 0,
        (_, true) => s.triangles - s.flipped,
        (_, false) => s.flipped,
    };
    let or_nan = |x: f64| if measured { x } else { f64::NAN };
    let boxed = m.min[0] <= m.max[0];
    let row = ComponentRow {
        first_triangle: s.first,
        triangles: s.triangles,
        flipped,
        // Each of the other corners shares its edge with one more.
        edges: (3 * s.triangles - s.borders - s.cuts) / 2 + s.borders + s.cuts,
        border_edges: s.borders,
        cut_edges: s.cuts,
        orientable: u8::from(orientable),
        closed: u8::from(closed),
        watertight: u8::from(watertight),
        outward: u8::from(by_volume),
        six_volume: or_nan(given.grid.six_volume(six)),
        area: or_nan(given.grid.area(m.area)),
        bbox_min: if boxed { m.min } else { [f64::NAN; 3] },
        bbox_max: if boxed { m.max } else { [f64::NAN; 3] },
    };
    (row, against)
}

fn count(row: &ComponentRow, counts: &mut Counts) {
    counts.components += 1;
    counts.nonorientable_components += u64::from(row.orientable == 0);
    counts.closed_components += u64::from(row.closed);
    counts.watertight_components += u64::from(row.watertight);
    counts.flipped_triangles += row.flipped;
    counts.flipped_components += u64::from(row.flipped == row.triangles);
}

/// Sums what the chunks counted and measured, and measures what they left.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn sum_chunks<I: Index, W: Index, X: Coord>(
    job: &Job,
    given: &ChunkSums<W>,
    pieces: &Shuffle<Piece>,
    memory: u64,
) -> Result<()> {
    let (ws, chunked) = (job.ws, given.chunked);
    if let Some(g) = &job.g {
        let deferred = Deferred {
            job,
            chunked,
            labels: given.labels,
            grid: given.grid,
            component: given.component,
            pieces,
            tally: memory,
        };
        measure_deferred::<I, W, X>(&deferred, g)?;
    }
    ws.workers.run(
        chunked.infos.len() as u64,
        || Tally::new(&ws.budget, memory, given.labels.components, pieces),
        |tally, chunk| {
            let info = &chunked.infos[chunk as usize];
            let (first, base) = (job.chunk_range(chunk).0, chunked.base[chunk as usize]);
            let bytes = u64::from(info.locals) * size_of::<LocalCount>() as u64;
            let mut local = base;
            scratch_items(ws, &chunked.counts, info.counts_at, bytes, &mut |counts| {
                for count in counts as &[LocalCount] {
                    let (component, flip) = given.labels.get(local);
                    let sums = tally.at(component)?;
                    let borders = count.borders & !LocalCount::CONFLICT;
                    let (triangles, flipped) = (count.triangles, count.flipped);
                    sums.first = sums.first.min(first + u64::from(count.first));
                    sums.triangles += u64::from(triangles);
                    sums.flipped += u64::from(if flip { triangles - flipped } else { flipped });
                    sums.borders += u64::from(borders);
                    local += 1;
                }
                Ok(())
            })?;
            let Some(at) = info.measures_at else {
                return Ok(());
            };
            let bytes = u64::from(info.locals) * size_of::<MeasureRecord>() as u64;
            let mut local = base;
            scratch_items(ws, &chunked.measures, at, bytes, &mut |measures| {
                for record in measures as &[MeasureRecord] {
                    let (component, flip) = given.labels.get(local);
                    tally.at(component)?.measure.merge(&record.get(), flip);
                    local += 1;
                }
                Ok(())
            })
        },
        Tally::finish,
    )
}

/// Sums what the seams found: borders, and the corners on non-manifold edges.
fn sum_seams<W: Index>(
    job: &Job,
    given: &Given<W>,
    pieces: &Shuffle<Piece>,
    memory: u64,
    sorted: &ScratchFile,
    counts: &mut Counts,
) -> Result<()> {
    let (ws, labels) = (job.ws, given.labels);
    let mut tally = Tally::new(&ws.budget, memory, labels.components, pieces)?;
    scratch_items(
        ws,
        given.borders,
        0,
        given.borders.len(),
        &mut |locals: &[W]| {
            for local in locals {
                let node = given.nodes.number(local.wide());
                tally.at(labels.get(node).0)?.borders += 1;
            }
            Ok(())
        },
    )?;
    let mut joined = None;
    if given.cuts.records() > 0 {
        let mut union = Union::new(&ws.budget, labels.components)?;
        sum_cuts(job, given, &mut tally, &mut union, sorted)?;
        joined = Some(union.sets());
    }
    counts.components_joined = joined.unwrap_or(labels.components);
    tally.finish()
}

/// Counts the corners on non-manifold edges, keeps them sorted for the finish pass, and finds
/// the components whose corners do not cancel at some edge.
fn sum_cuts<W: Index>(
    job: &Job,
    given: &Given<W>,
    tally: &mut Tally,
    union: &mut Union,
    sorted: &ScratchFile,
) -> Result<()> {
    let (ws, labels) = (job.ws, given.labels);
    let mut plan = job.shuffle_plan(size_of::<Side>(), given.cuts.records());
    // One writer here, whatever the number of threads.
    plan.buckets = plan.buckets.min(256);
    let sides = Shuffle::<Side>::new(
        ws,
        "sides of non-manifold edges",
        0..labels.components,
        plan,
    )?;
    let mut writer = sides.writer()?;
    let mut sorter = given.cuts.sorter(job.sort_memory(0))?;
    let (mut edge, mut ordinal, mut first) = (None, 0u64, 0);
    given.cuts.sorted_all(&mut sorter, &mut |batch| {
        sorted.append(bytemuck::cast_slice(batch))?;
        for corner in batch {
            let (component, flip) = labels.get(given.nodes.of_corner(corner));
            if edge != Some(corner.edge()) {
                edge = Some(corner.edge());
                ordinal += 1;
                first = component;
            }
            union.join(first, component);
            let sums = tally.at(component)?;
            sums.cuts += 1;
            // The directions of the finished table: the input's, where nothing is turned. (A
            // component turned as a whole has them all reversed, which cancels as well.)
            let down = if !job.applies_flips() || labels.nonorientable.get(component) {
                corner.input_down()
            } else {
                corner.down() ^ flip
            };
            writer.push(Side([component, ordinal, if down { 1 } else { u64::MAX }]))?;
        }
        Ok(())
    })?;
    drop(sorter);
    writer.finish()?;
    let sides = sides.finish()?;
    let mut sorter = sides.sorter(job.sort_memory(0))?;
    let (mut at, mut balance) = ((0, 0), 0u64);
    sides.sorted_all(&mut sorter, &mut |batch| {
        for &Side([component, edge, side]) in batch {
            if at != (component, edge) {
                if balance != 0 {
                    tally.at(at.0)?.unbalanced = true;
                }
                (at, balance) = ((component, edge), 0);
            }
            balance = balance.wrapping_add(side);
        }
        Ok(())
    })?;
    if balance != 0 {
        tally.at(at.0)?.unbalanced = true;
    }
    Ok(())
}
