//! The way in file order: chunks of consecutive triangles are patches of surface, or nearly.

use super::Job;
use super::changes::Changes;
use super::chunked::{Chunked, LocalRecords, Settled};
use super::chunks::{Sinks, chunks};
use super::clock::Clock;
use super::components::{ChunkSums, Given, components, sum_chunks};
use super::fill::fill;
use super::finish::{Found, apply};
use super::graph::bits::Bits;
use super::lists::list;
use super::nodes::Nodes;
use super::pipeline::Built;
use super::records::{EdgeCorner, Patch};
use super::scan::{Seams, scan};
use super::seams::{Seamed, Seaming, seams};
use super::stars::spill::Spilled;
use super::steps::At;
use super::stitch::{Linked, stitch};
use super::tail::{Edges, Rows, join_stars};
use super::way::Way;
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Shuffle};

/// The step behind which the seam vertices are known.
pub const SCANNED: &str = "scan";
/// The step behind which the chunks are settled.
pub const CHUNKED: &str = "chunks";
/// The step behind which the rows that change lie aside.
pub const DECIDED: &str = "decisions";

/// The seam vertices, and what the chunks left so far.
struct Scanned<W: Index> {
    seam: Seams,
    rows: Rows,
    edges: Shuffle<EdgeCorner<W>>,
    cuts: Shuffle<EdgeCorner<W>>,
    stars: Option<Spilled<W>>,
    chunked: Chunked,
    records: LocalRecords,
    unreferenced: u64,
}

impl<W: Index> Keep for Scanned<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.seam.keep(to)?;
        self.rows.keep(to)?;
        self.edges.keep(to)?;
        self.cuts.keep(to)?;
        self.stars.keep(to)?;
        self.chunked.keep(to)?;
        self.records.keep(to)?;
        to.number(self.unreferenced)
    }

    fn restore(from: &mut Reader) -> Result<Scanned<W>> {
        Ok(Scanned {
            seam: Seams::restore(from)?,
            rows: Rows::restore(from)?,
            edges: Shuffle::restore(from)?,
            cuts: Shuffle::restore(from)?,
            stars: Option::restore(from)?,
            chunked: Chunked::restore(from)?,
            records: LocalRecords::restore(from)?,
            unreferenced: from.number()?,
        })
    }
}

/// All but rows: what they must become is known, and lies aside or is in place.
struct Decided<W: Index> {
    built: Built,
    patches: Buckets<Patch<W>>,
    aside: Option<Changes>,
    nonorientable: Bits,
}

impl<W: Index> Keep for Decided<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.built.keep(to)?;
        self.patches.keep(to)?;
        self.aside.keep(to)?;
        self.nonorientable.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Decided<W>> {
        Ok(Decided {
            built: Built::restore(from)?,
            patches: Buckets::restore(from)?,
            aside: Option::restore(from)?,
            nonorientable: Bits::restore(from)?,
        })
    }
}

/// What is written down while the seams are settled: they are, and what the chunks left besides.
type AtSeams<W> = (First<W>, Seaming<W>);

/// What the chunks left, but for the seams.
struct First<W: Index> {
    rows: Rows,
    stars: Option<Spilled<W>>,
    chunked: Chunked,
    records: LocalRecords,
    unreferenced: u64,
}

impl<W: Index> Keep for First<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.rows.keep(to)?;
        self.stars.keep(to)?;
        self.chunked.keep(to)?;
        self.records.keep(to)?;
        to.number(self.unreferenced)
    }

    fn restore(from: &mut Reader) -> Result<First<W>> {
        Ok(First {
            rows: Rows::restore(from)?,
            stars: Option::restore(from)?,
            chunked: Chunked::restore(from)?,
            records: LocalRecords::restore(from)?,
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
    if let Some(decided) = clock.restored::<Decided<W>>(DECIDED)? {
        let patches = decided.patches.records();
        let built = clock.pass("finish", "items", patches, || decided.make::<I>(job))?;
        return Ok(Ok(built));
    }
    let state = match clock.restored(CHUNKED)? {
        Some(state) => state,
        None => match chunk_all::<I, W, X>(clock, job, &grid, whatever)? {
            Ok(state) => state,
            Err(better) => return Ok(Err(better)),
        },
    };
    let spilled = state.0.chunked.settled.spilled;
    let (first, seamed) = clock.rounds_and(
        ("seams", "corners", spilled),
        (CHUNKED, job.opened),
        state,
        |(first, seaming): &mut AtSeams<W>, until| {
            let nodes = Nodes::InOrder(&first.chunked, job.plan.chunk);
            seams(job, seaming, until, |corner| nodes.of_corner(corner))
        },
        |(first, seaming)| Ok((first, seaming.finish(job)?)),
    )?;
    let First {
        rows,
        stars,
        chunked,
        records,
        unreferenced,
    } = first;
    let Seamed {
        cuts,
        cut_corners,
        patches,
        links,
        borders,
        settled: seamed,
    } = seamed;
    let nodes = Nodes::InOrder(&chunked, job.plan.chunk);
    let settled = Edges {
        first: &chunked.settled,
        seams: &seamed,
        cut_corners,
        unreferenced,
        bounds,
    };
    let mut counts = settled.counts(job)?;
    let stars = join_stars(clock, job, (&nodes, None), stars, counts.degenerate)?;
    let linked = links.len() / (2 * W::BYTES as u64);
    let labels = clock.pass("stitch", "links", linked, || {
        let linked = Linked {
            nodes,
            links: &links,
            conflicts: &|each| chunked.conflicts(ws, &records, each),
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
            grid: &grid,
            stars: stars.as_ref(),
        };
        let sums = ChunkSums {
            chunked: &chunked,
            records,
            labels: &labels,
            component: &rows.component,
        };
        components(job, &given, (cuts, &mut counts), |pieces| {
            sum_chunks::<I, W, X>(job, sums, pieces)
        })
    })?;
    let arrays = rows.marked::<I>(job, counts.degenerate)?;
    // What was written down names the rows as they are.
    let aside = clock.at_stake().then(|| Changes::new(ws)).transpose()?;
    let locals = nodes.count();
    let pass = ("finish", "items", t + patches.records());
    let built = clock.measured(pass, |steps, ws| {
        let found = Found {
            labels: &labels,
            chosen: &chosen,
        };
        let tables = arrays.tables();
        let applied = |aside: Option<&Changes>| {
            ws.io
                .intact(apply::<I, W>(job, &chunked, &found, &tables, aside))
        };
        let aside = match applied(aside.as_ref()) {
            Err(e) if aside.is_some() && e.is_no_room() => {
                // What was put aside so far takes the room that is wanted.
                drop(aside);
                steps.back(ws, job.opened)?;
                applied(None)?;
                None
            }
            done => done.map(|()| aside)?,
        };
        let edges = counts.nonmanifold_edges;
        let lists = list::<I, W>(job, &found, edges, stars.as_ref())?;
        drop((stars, chunked));
        let measures = chosen.stars.take().map(|stars| stars.measures);
        let (made, counted) = ((chosen.table, lists), (counts, measures));
        let decided = Decided {
            built: arrays.built(made, counted, spilled, locals),
            patches,
            aside,
            nonorientable: labels.nonorientable,
        };
        let at = At::behind(DECIDED, job.opened);
        if decided.aside.is_some() && !steps.put(ws, at, &decided)? {
            steps.back(ws, job.opened)?;
        }
        ws.io.intact(decided.make::<I>(job))
    })?;
    Ok(Ok(built))
}

impl<W: Index> Decided<W> {
    /// Makes the changes that are aside, and fills the opposites in. Twice is harmless.
    fn make<I: Index>(self, job: &Job) -> Result<Built> {
        let tables = self.built.tables()?;
        if let Some(changes) = &self.aside {
            changes.make(job, &tables)?;
        }
        let any_flip = self.built.counts.flipped_triangles > 0;
        fill::<I, W>(job, &self.nonorientable, &self.patches, &tables, any_flip)?;
        Ok(self.built)
    }
}

/// Scans, and settles the chunks; or says which way is better.
fn chunk_all<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    grid: &Grid,
    whatever: bool,
) -> Result<Result<AtSeams<W>, Way>> {
    let (ws, t) = (job.ws, job.shape.triangles);
    let mut scanned = match clock.restored(SCANNED)? {
        Some(scanned) => scanned,
        None => {
            let found = clock.pass("scan", "triangles", t, || scan::<I>(job))?;
            if !whatever && let Some(better) = Way::after_scan(job, found.0.count()) {
                return Ok(Err(better));
            }
            Scanned::new::<I>(job, found)?
        }
    };
    let pass = ("chunks", "triangles", t);
    clock.rounds(
        pass,
        (SCANNED, job.opened),
        &mut scanned,
        |scanned, until| {
            let sinks = Sinks {
                edges: &scanned.edges,
                cuts: &scanned.cuts,
                v: &scanned.rows.v,
                o: &scanned.rows.o,
                component: &scanned.rows.component,
                stars: scanned.stars.as_ref(),
            };
            let so_far = (&mut scanned.chunked, &scanned.records, until);
            chunks::<I, W, X>(job, &scanned.seam, grid, &sinks, so_far)
        },
    )?;
    let Scanned {
        rows,
        edges,
        cuts,
        stars,
        chunked,
        records,
        unreferenced,
        ..
    } = scanned;
    let edges = edges.finish()?;
    check_held(job, &chunked, 0)?;
    let plan = job.shuffle_plan(size_of::<Patch<W>>(), edges.records());
    let seaming = Seaming {
        patches: Shuffle::new(ws, "opposites", 0..t.max(1), plan)?,
        links: ws.scratch.file("links")?,
        borders: ws.scratch.file("borders at seams")?,
        settled: Settled::default(),
        done: 0,
        edges,
        cuts,
    };
    let first = First {
        rows,
        stars,
        chunked,
        records,
        unreferenced,
    };
    Ok(Ok((first, seaming)))
}

impl<W: Index> Scanned<W> {
    /// What chunks write to, with nothing in it.
    fn new<I: Index>(job: &Job, (seam, unreferenced): (Seams, u64)) -> Result<Scanned<W>> {
        let (ws, t) = (job.ws, job.shape.triangles);
        let rows = Rows::create::<I>(job)?;
        let n = job.shape.vertices.max(1);
        let record = size_of::<EdgeCorner<W>>();
        // A surface has about three edges a vertex, each with two corners.
        let expected = (6 * seam.count()).min(3 * t);
        let plan = job.shuffle_plan(record, expected);
        let edges = Shuffle::new(ws, "seam corners", 0..n, plan)?;
        let plan = job.shuffle_plan(record, t / 64);
        let cuts = Shuffle::new(ws, "non-manifold corners", 0..n, plan)?;
        // A part on either side of a seam, at each of its vertices.
        let parts = (2 * seam.count()).min(3 * t);
        Ok(Scanned {
            stars: Spilled::wanted(job, parts)?,
            chunked: Chunked::new(ws, job.plan.chunks(t))?,
            records: LocalRecords::new(ws)?,
            seam,
            rows,
            edges,
            cuts,
            unreferenced,
        })
    }
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
