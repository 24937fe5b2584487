//! The way in file order: chunks of consecutive triangles are patches of surface, or nearly.

use super::Job;
use super::chunks::{Chunked, Sinks, chunks};
use super::components::{ChunkSums, Given, components, sum_chunks};
use super::finish::{Found, apply, fill, list};
use super::nodes::Nodes;
use super::pipeline::{Built, Clock};
use super::records::{EdgeCorner, Patch};
use super::scan::scan;
use super::seams::{Seaming, seams};
use super::stars::spill::Spilled;
use super::stitch::{Linked, stitch};
use super::tail::{Edges, Rows, join_stars};
use super::way::Way;
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Shuffle};

/// The step behind which the chunks are settled.
pub const CHUNKED: &str = "chunks";

/// What the chunks left.
struct First<W: Index> {
    rows: Rows,
    edges: Buckets<EdgeCorner<W>>,
    cuts: Shuffle<EdgeCorner<W>>,
    stars: Option<Spilled<W>>,
    chunked: Chunked,
    unreferenced: u64,
}

impl<W: Index> Keep for First<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.rows.keep(to)?;
        self.edges.keep(to)?;
        self.cuts.keep(to)?;
        self.stars.keep(to)?;
        self.chunked.keep(to)?;
        to.number(self.unreferenced)
    }

    fn restore(from: &mut Reader) -> Result<First<W>> {
        Ok(First {
            rows: Rows::restore(from)?,
            edges: Buckets::restore(from)?,
            cuts: Shuffle::restore(from)?,
            stars: Option::restore(from)?,
            chunked: Chunked::restore(from)?,
            unreferenced: from.number()?,
        })
    }
}

/// Runs the passes; or says, when the scan finds the order to be no help and `whatever` is not
/// set, which way is better.
///
/// # Errors
/// Those of the passes.
pub fn in_order<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    whatever: bool,
) -> Result<Result<Built, Way>> {
    let (ws, t) = (job.ws, job.shape.triangles);
    let grid = Grid::new(bounds);
    let first = match clock.restored(CHUNKED)? {
        Some(first) => first,
        None => match chunk_all::<I, W, X>(clock, job, &grid, whatever)? {
            Ok(first) => {
                clock.done(CHUNKED, job.opened, &first)?;
                first
            }
            Err(better) => return Ok(Err(better)),
        },
    };
    let First {
        rows,
        edges,
        cuts,
        stars,
        chunked,
        unreferenced,
    } = first;
    let nodes = Nodes::InOrder(&chunked, job.plan.chunk);
    check_held(job, &chunked, 0)?;
    let spilled = chunked.settled.spilled;
    let plan = job.shuffle_plan(size_of::<Patch<W>>(), edges.records());
    let patches = Shuffle::<Patch<W>>::new(ws, "opposites", 0..t.max(1), plan)?;
    let links = ws.scratch.file("links")?;
    let borders = ws.scratch.file("borders at seams")?;
    let seamed = clock.pass("seams", "corners", spilled, || {
        let seaming = Seaming {
            edges: &edges,
            cuts: &cuts,
            patches: &patches,
            links: &links,
            borders: &borders,
        };
        seams(job, &seaming, plan.writer_bytes(), |corner| {
            nodes.of_corner(corner)
        })
    })?;
    drop(edges);
    let (cuts, patches) = (cuts.finish()?, patches.finish()?);
    let settled = Edges {
        first: &chunked.settled,
        seams: &seamed,
        cut_corners: cuts.records(),
        unreferenced,
        bounds,
    };
    let mut counts = settled.counts(job)?;
    let stars = join_stars(clock, job, &nodes, stars, counts.degenerate)?;
    let records = links.len() / (2 * W::BYTES as u64);
    let labels = clock.pass("stitch", "links", records, || {
        let linked = Linked {
            nodes,
            links: &links,
            conflicts: &|each| chunked.conflicts(ws, each),
        };
        let table = chunked.table_bytes();
        let held = (job.shape).fits_labels(&job.plan, nodes.count(), W::BYTES as u64, table);
        stitch::<W>(job, &linked, held <= ws.budget.limit())
    })?;
    drop(links);
    check_held(job, &chunked, labels.components)?;
    let mut chosen = clock.pass("components", "", 0, || {
        let given = Given {
            nodes,
            labels: &labels,
            borders: &borders,
            cuts: &cuts,
            grid: &grid,
            stars: stars.as_ref(),
        };
        let sums = ChunkSums {
            chunked: &chunked,
            labels: &labels,
            component: &rows.component,
            grid: &grid,
        };
        components(job, &given, &mut counts, |pieces, memory| {
            sum_chunks::<I, W, X>(job, &sums, pieces, memory)
        })
    })?;
    drop(cuts);
    // The rows are changed in place from now on.
    clock.back(job.opened)?;
    let arrays = rows.marked::<I>(job, counts.degenerate)?;
    let tables = arrays.tables();
    let found = Found {
        labels: &labels,
        chosen: &chosen,
    };
    let lists = clock.pass("finish", "items", t + patches.records(), || {
        apply::<I, W>(job, &chunked, &found, &tables)?;
        fill::<I, W>(job, &found, &patches, &tables, counts.flipped_triangles > 0)?;
        list::<I, W>(job, &found, counts.nonmanifold_edges, stars.as_ref())
    })?;
    let measures = chosen.stars.take().map(|stars| stars.measures);
    let counted = (counts, measures);
    let made = (chosen.table, lists);
    Ok(Ok(arrays.built(made, counted, spilled, nodes.count())))
}

/// Scans, and settles the chunks; or says which way is better.
fn chunk_all<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    grid: &Grid,
    whatever: bool,
) -> Result<Result<First<W>, Way>> {
    let (ws, t) = (job.ws, job.shape.triangles);
    let (seam_bits, unreferenced) = clock.pass("scan", "triangles", t, || scan::<I>(job))?;
    if !whatever && let Some(better) = Way::after_scan(job, seam_bits.count()) {
        return Ok(Err(better));
    }
    let rows = Rows::create::<I>(job)?;
    let n = job.shape.vertices.max(1);
    let record = size_of::<EdgeCorner<W>>();
    // A surface has about three edges a vertex, each with two corners.
    let expected = (6 * seam_bits.count()).min(3 * t);
    let edges = Shuffle::new(ws, "seam corners", 0..n, job.shuffle_plan(record, expected))?;
    let plan = job.shuffle_plan(record, t / 64);
    let cuts = Shuffle::new(ws, "non-manifold corners", 0..n, plan)?;
    // A part on either side of a seam, at each of its vertices.
    let parts = (2 * seam_bits.count()).min(3 * t);
    let stars = Spilled::wanted(job, parts)?;
    let chunked = clock.pass("chunks", "triangles", t, || {
        let sinks = Sinks {
            edges: &edges,
            cuts: &cuts,
            v: &rows.v,
            o: &rows.o,
            component: &rows.component,
            stars: stars.as_ref(),
        };
        chunks::<I, W, X>(job, &seam_bits, grid, &sinks)
    })?;
    Ok(Ok(First {
        rows,
        edges: edges.finish()?,
        cuts,
        stars,
        chunked,
        unreferenced,
    }))
}

/// Refuses, now that the table of chunks is there, a budget that is too small for what comes
/// after it; and, once the components are counted, for two bits for each of them.
fn check_held(job: &Job, chunked: &Chunked, components: u64) -> Result<()> {
    let table = chunked.table_bytes();
    let need = job.shape.least_after_chunks(&job.plan, components, table);
    let have = job.ws.budget.limit();
    if need > have {
        return Err(Error::Budget {
            what: match components {
                0 => format!("the table of {} chunks", chunked.infos.len()),
                _ => format!("two bits for each of {components} components"),
            },
            // A quarter more than what is short: the other parts grow with the budget.
            need: need + (need - have) / 4,
            have,
        });
    }
    Ok(())
}
