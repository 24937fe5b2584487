//! Components: sums each component, decides its orientation, writes its row of the table.
//!
//! Why it works: an orientable component has two consistent orientations, the one of its
//! first triangle and the other; all sums are gathered for the first, and the choice is one
//! bit. The volume decides for orientable watertight components (their volume does not depend
//! on the reference point); all others keep what most of their triangles had.
//!
//! Memory: labels and bits by component, a tally, sorters and writers. I/O: the records of
//! local components once, non-manifold corners once more; the rows written once.

use super::Job;
use super::arrays::OutArray;
use super::chunked::Chunked;
use super::cuts::{CutCount, Cuts};
use super::deferred::{Deferred, measure_deferred};
use super::graph::bits::Bits;
use super::graph::labels::split;
use super::nodes::Nodes;
use super::records::{EdgeCorner, LocalCount, MeasureRecord};
use super::rows::{Table, measured};
use super::stars::Starred;
use super::stars::shared::{Meetings, meet};
use super::stitch::Labels;
use super::tally::{Piece, Sums, Tally, reduce};
use super::{SCRATCH_BLOCK, scratch_items};
use crate::chunk::grid::Grid;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::{Result, conserve};
use crate::folder::{ComponentRow, Counts, Measures, Orient};
use crate::shuffle::{Buckets, Shuffle};

/// What was decided.
pub struct Chosen {
    /// Components to be flipped against the orientation of their first triangle.
    pub flip: Bits,
    /// The table's file.
    pub table: OutArray,
    /// Corners on non-manifold edges.
    pub cuts: Cuts,
    /// What the vertices tell, when they are measured.
    pub stars: Option<Measured>,
}

/// What the vertices tell of the components.
pub struct Measured {
    /// The numbers of the whole mesh.
    pub measures: Measures,
    /// The vertices that several fans share.
    pub meetings: Meetings,
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
    /// Vertex stars, when they are wanted.
    pub stars: Option<&'a Starred<W>>,
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
    let cuts = Cuts::sorted(job, &given.nodes, given.labels, given.cuts)?;
    sum_marks(job, given, (&pieces, tally), given.borders, |s| {
        s.borders += 1
    })?;
    let mut stars = match given.stars {
        Some(stars) => Some(sum_stars(job, given, (&pieces, tally), stars)?),
        None => None,
    };
    counts.components_joined = if cuts.is_empty() {
        number
    } else {
        cuts.join::<W>(job, number)?
    };
    let mut cut_counts = cuts.counts(job, given.labels)?;
    let pieces = pieces.finish()?;
    let mut flip = Bits::new(&ws.budget, "flips by component", number)?;
    let mut table = Table::new(job, number, stars.is_some())?;
    let mut sorter = pieces.sorter(job.sort_memory(0))?;
    let mut triangles = counts.degenerate;
    reduce(&pieces, &mut sorter, |component, sums| {
        if component != table.rows() {
            let what = format!("component {component} came after {} rows", table.rows());
            return Err(crate::Error::Internal(what));
        }
        let cut = cut_counts.of(component)?;
        let (row, against) = decide(job, given, component, (sums, &cut));
        if against {
            flip.set(component);
        }
        count(&row, counts);
        triangles += row.triangles;
        let measures = match &mut stars {
            Some(stars) => Some(measured(&row, sums, &mut stars.measures)?),
            None => None,
        };
        table.push(&row, measures.as_ref())
    })?;
    conserve("components", "components", number, table.rows())?;
    conserve("components", "triangles", job.shape.triangles, triangles)?;
    Ok(Chosen {
        flip,
        table: table.finish()?,
        cuts,
        stars,
    })
}

/// Sums what vertex stars say of components.
fn sum_stars<W: Index>(
    job: &Job,
    given: &Given<W>,
    (pieces, memory): (&Shuffle<Piece>, u64),
    stars: &Starred<W>,
) -> Result<Measured> {
    let to = (pieces, memory);
    sum_marks(job, given, to, &stars.rings, |s| s.rings += 1)?;
    sum_marks(job, given, to, &stars.loops, |s| s.loops += 1)?;
    let components = given.labels.components;
    let mut tally = Tally::new(&job.ws.budget, memory, components, pieces)?;
    let mut again = |component, times| {
        tally.at(component)?.again += times;
        Ok(())
    };
    let meetings = meet(job, &given.nodes, given.labels, &stars.shared, &mut again)?;
    tally.finish()?;
    let measures = Measures {
        nonmanifold_vertices: meetings.count::<W>(),
        duplicate: stars.duplicates(),
        components_joined_at_vertices: meetings.joined,
        largest_valence: stars.valences.largest,
        valences: stars.valences.classes(job.shape.vertices)?,
        ..Measures::default()
    };
    Ok(Measured { measures, meetings })
}

/// The orientation and the row of one component.
fn decide<W: Index>(
    job: &Job,
    given: &Given<W>,
    component: u64,
    (s, cut): (&Sums, &CutCount),
) -> (ComponentRow, bool) {
    let m = &s.measure;
    let orientable = !given.labels.nonorientable.get(component);
    let closed = s.borders == 0 && cut.cuts == 0;
    let watertight = closed || (s.borders == 0 && cut.unbalanced == 0);
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
        edges: (3 * s.triangles - s.borders - cut.cuts) / 2 + s.borders + cut.cuts,
        border_edges: s.borders,
        cut_edges: cut.cuts,
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

/// Local components whose counts or measures are read at a time, at most.
const RUN: u64 = (SCRATCH_BLOCK / size_of::<LocalCount>()) as u64;

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
    let (ws, chunked, labels) = (job.ws, given.chunked, given.labels);
    if let Some(g) = &job.g {
        let deferred = Deferred {
            job,
            chunked,
            labels,
            grid: given.grid,
            component: given.component,
            pieces,
            tally: memory,
        };
        measure_deferred::<I, W, X>(&deferred, g)?;
    }
    ws.workers.run(
        chunked.infos.len() as u64,
        || {
            let tally = Tally::new(&ws.budget, memory, labels.components, pieces)?;
            Ok((tally, labels.range(&ws.budget, RUN)?))
        },
        |(tally, range), chunk| {
            let info = &chunked.infos[chunk as usize];
            if job.g.is_some() && info.measures_at.is_none() {
                // Counted when it was measured.
                return Ok(());
            }
            let (first, base) = (job.chunk_range(chunk).0, chunked.base[chunk as usize]);
            let bytes = u64::from(info.locals) * size_of::<LocalCount>() as u64;
            let mut local = base;
            scratch_items(ws, &chunked.counts, info.counts_at, bytes, &mut |counts| {
                range.load(local..local + counts.len() as u64)?;
                for count in counts as &[LocalCount] {
                    let (component, flip) = range.get(local);
                    tally.at(component)?.count(count, first, flip);
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
                range.load(local..local + measures.len() as u64)?;
                for record in measures as &[MeasureRecord] {
                    let (component, flip) = range.get(local);
                    tally.at(component)?.measure.merge(&record.get(), flip);
                    local += 1;
                }
                Ok(())
            })
        },
        |(tally, _)| tally.finish(),
    )
}

/// Sums what is marked by the numbers of local components in a file.
fn sum_marks<W: Index>(
    job: &Job,
    given: &Given<W>,
    (pieces, memory): (&Shuffle<Piece>, u64),
    marks: &ScratchFile,
    add: impl Fn(&mut Sums),
) -> Result<()> {
    if marks.is_empty() {
        return Ok(());
    }
    let (ws, components) = (job.ws, given.labels.components);
    let marks = job.labels_of_list(given.labels, given.nodes.count(), marks)?;
    let mut tally = Tally::new(&ws.budget, memory, components, pieces)?;
    scratch_items(ws, &marks, 0, marks.len(), &mut |labels: &[W]| {
        for &label in labels {
            add(tally.at(split(label).0)?);
        }
        Ok(())
    })?;
    tally.finish()
}
