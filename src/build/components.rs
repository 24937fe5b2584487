//! Components: sums each component, decides its orientation, writes its row of the table.
//!
//! Why it works: an orientable component has two consistent orientations, the one of its
//! first triangle and the other; all sums are gathered for the first, and the choice is one
//! bit. The volume decides for orientable watertight components (their volume does not depend
//! on the reference point); all others keep what most of their triangles had.
//!
//! Memory: labels and bits by component, a tally, sorters and writers. I/O: the records of
//! local components once, non-manifold corners once more; marks and pieces of sums written and read;
//! the rows written once.

use super::Job;
use super::arrays::OutArray;
use super::chunked::{Chunked, LocalRecords};
use super::cuts::{Cuts, Sorted};
use super::deferred::{Deferred, measure_deferred};
use super::graph::bits::Bits;
use super::marks::{Kind, Mark, Marked, Marker, Told, mark_all, marks};
use super::nodes::Nodes;
use super::records::{LocalCount, MeasureRecord};
use super::rows::{Table, measured};
use super::stars::Starred;
use super::stars::shared::{Meetings, meet};
use super::stitch::Labels;
use super::tally::{Pieces, Sums, reduce};
use super::{SCRATCH_BLOCK, scratch_items};
use crate::chunk::grid::Grid;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::{Result, conserve};
use crate::folder::{ComponentRow, Counts, Measures, Orient};
use crate::shuffle::Shuffle;

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
    /// The grid of volumes.
    pub grid: &'a Grid,
    /// Vertex stars, when they are wanted.
    pub stars: Option<&'a Starred<W>>,
}

/// What the chunks counted and measured, with what it takes to measure the rest.
pub struct ChunkSums<'a, W: Index> {
    /// Chunks.
    pub chunked: &'a Chunked,
    /// What they know of their local components, which is used up.
    pub records: LocalRecords,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// Local labels of the triangles.
    pub component: &'a OutArray,
}

/// Runs the pass; fills in the counts that it knows. `sum` adds up what local components counted
/// and measured.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn components<W: Index>(
    job: &Job,
    given: &Given<W>,
    (cuts, counts): (Sorted, &mut Counts),
    sum: impl FnOnce(&Pieces) -> Result<()>,
) -> Result<Chosen> {
    let ws = job.ws;
    let number = given.labels.components;
    // What has a word or two for each corner comes first: sums are wider.
    let cuts = Cuts::labelled(job, cuts, &given.nodes, given.labels)?;
    let marked = marks::<W>(job, number)?;
    cuts.mark(job, given.labels, &marked)?;
    let labels = (given.labels, given.nodes.count());
    mark_all(job, labels, given.borders, Kind::Border, &marked)?;
    let mut stars = match given.stars {
        Some(stars) => Some(mark_stars(job, given, stars, &marked)?),
        None => None,
    };
    let marked = marked.finish()?;
    let mut told = Told::new(job, &marked)?;
    drop(marked);
    counts.components_joined = if cuts.is_empty() {
        number
    } else {
        cuts.join::<W>(job, number)?
    };
    let pieces = Pieces::new(job, given.grid, number)?;
    sum(&pieces)?;
    let pieces = pieces.finish()?;
    let mut flip = Bits::new(&ws.budget, "flips by component", number)?;
    let mut table = Table::new(job, number, stars.is_some())?;
    let mut sorter = pieces.sorter(job.sort_memory(0))?;
    let mut triangles = counts.degenerate;
    reduce(&pieces, &mut sorter, given.grid, |component, sums| {
        if component != table.rows() {
            let what = format!("component {component} came after {} rows", table.rows());
            return Err(crate::Error::Internal(what));
        }
        let mut sums = *sums;
        let marked = told.of(component)?;
        sums.rims([Kind::Border, Kind::Ring, Kind::Loop].map(|kind| marked.of(kind)));
        let (row, against) = decide(job, given, component, (&sums, &marked));
        if against {
            flip.set(component);
        }
        count(&row, counts);
        triangles += row.triangles;
        let measures = match &mut stars {
            Some(stars) => Some(measured(&row, (&sums, &marked), &mut stars.measures)?),
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

/// Marks what vertex stars say of components.
fn mark_stars<W: Index>(
    job: &Job,
    given: &Given<W>,
    stars: &Starred<W>,
    to: &Shuffle<Mark<W>>,
) -> Result<Measured> {
    let labels = (given.labels, given.nodes.count());
    mark_all(job, labels, &stars.rings, Kind::Ring, to)?;
    mark_all(job, labels, &stars.loops, Kind::Loop, to)?;
    let mut marker = Marker::new(&job.ws.budget, given.labels.components, to)?;
    let mut again = |component, times| marker.mark(component, Kind::Again, times);
    let meetings = meet(job, &given.nodes, given.labels, &stars.shared, &mut again)?;
    marker.finish()?;
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
    (s, marked): (&Sums, &Marked),
) -> (ComponentRow, bool) {
    let m = &s.measure(given.grid);
    let (cuts, unbalanced) = (marked.of(Kind::Cut), marked.of(Kind::Unbalanced));
    let orientable = !given.labels.nonorientable.get(component);
    let closed = s.borders == 0 && cuts == 0;
    let watertight = closed || (s.borders == 0 && unbalanced == 0);
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
        edges: (3 * s.triangles - s.borders - cuts) / 2 + s.borders + cuts,
        border_edges: s.borders,
        cut_edges: cuts,
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
    given: ChunkSums<W>,
    pieces: &Pieces,
) -> Result<()> {
    let (ws, chunked, labels) = (job.ws, given.chunked, given.labels);
    let records = &given.records;
    if let Some(g) = &job.g {
        let deferred = Deferred {
            job,
            chunked,
            records,
            labels,
            component: given.component,
            pieces,
        };
        measure_deferred::<I, W, X>(&deferred, g)?;
    }
    ws.workers.run(
        chunked.infos.len() as u64,
        || Ok((pieces.tally()?, labels.range(&ws.budget, RUN)?)),
        |(tally, range), chunk| {
            let info = &chunked.infos[chunk as usize];
            if job.g.is_some() && info.measures_at.is_none() {
                // Counted when it was measured.
                return Ok(());
            }
            let (first, base) = (job.chunk_range(chunk).0, chunked.base[chunk as usize]);
            let bytes = u64::from(info.locals) * size_of::<LocalCount>() as u64;
            let mut local = base;
            scratch_items(ws, &records.counts, info.counts_at, bytes, &mut |counts| {
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
            scratch_items(ws, &records.measures, at, bytes, &mut |measures| {
                range.load(local..local + measures.len() as u64)?;
                for record in measures as &[MeasureRecord] {
                    let (component, flip) = range.get(local);
                    tally.merge(component, &record.get(), flip)?;
                    local += 1;
                }
                Ok(())
            })
        },
        |(tally, _)| tally.finish(),
    )
}
