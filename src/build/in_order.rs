//! The way in file order: chunks of consecutive triangles are patches of surface, or nearly.

use super::Job;
use super::behind::{AtEnd, Behind, UpToSeams, behind_seams};
use super::changes::Changes;
use super::chunked::{Chunked, LocalRecords, Settled};
use super::chunks::{Sinks, chunks};
use super::clock::Clock;
use super::fill::fill;
use super::finish::{Found, apply};
use super::graph::bits::Bits;
use super::lists::list;
use super::nodes::Nodes;
use super::pipeline::Built;
use super::records::{EdgeCorner, Patch};
use super::scan::{Seams, scan};
use super::seams::{Seaming, seams};
use super::settled_chunks::{Chunks, check_held};
use super::stars::spill::Spilled;
use super::steps::At;
use super::tail::Rows;
use super::way::Way;
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::Result;
use crate::shuffle::{Buckets, Shuffle};
use std::marker::PhantomData;

/// The step behind which the seam vertices are known.
const SCANNED: &str = "scan";
/// The step behind which the chunks are settled.
const CHUNKED: &str = "chunks";
/// The step behind which the rows that change lie aside.
const DECIDED: &str = "decisions";

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
type AtSeams<I, W, X> = (Chunks<I, W, X>, Seaming<W>);

/// How the steps behind the seams are called.
const BEHIND: Behind = Behind {
    stars: "stars",
    stitch: "stitch",
    components: "components",
};

/// True when a build that was stopped behind this step went this way.
pub fn is_step(step: &str) -> bool {
    let behind = [BEHIND.stars, BEHIND.stitch, BEHIND.components];
    [SCANNED, CHUNKED, DECIDED].contains(&step) || behind.contains(&step)
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
    if let Some(decided) = clock.restored::<Decided<W>>(DECIDED)? {
        let patches = decided.patches.records();
        let built = clock.pass("finish", "items", patches, || decided.make::<I>(job))?;
        return Ok(Ok(built));
    }
    let at = behind_seams(clock, job, bounds, &BEHIND, |clock| {
        seam_all::<I, W, X>(clock, job, bounds, whatever)
    })?;
    match at {
        Ok(at) => finish::<I, W, X>(clock, job, at).map(Ok),
        Err(better) => Ok(Err(better)),
    }
}

/// Scans, settles the chunks and their seams; or says which way is better.
fn seam_all<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    whatever: bool,
) -> Result<UpToSeams<Chunks<I, W, X>, W>> {
    let state = match clock.restored(CHUNKED)? {
        Some(state) => state,
        None => match chunk_all::<I, W, X>(clock, job, &Grid::new(bounds), whatever)? {
            Ok(state) => state,
            Err(better) => return Ok(Err(better)),
        },
    };
    let spilled = state.0.chunked.settled.spilled;
    let seamed = clock.rounds_and(
        ("seams", "corners", spilled),
        (CHUNKED, job.opened),
        state,
        |(first, seaming): &mut AtSeams<I, W, X>, until| {
            let nodes = Nodes::InOrder(&first.chunked, job.plan.chunk);
            seams(job, seaming, until, |corner| nodes.of_corner(corner))
        },
        |(first, seaming)| Ok((first, seaming.finish(job)?)),
    )?;
    Ok(Ok(seamed))
}

/// Completes the arrays.
fn finish<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    at: AtEnd<Chunks<I, W, X>, W>,
) -> Result<Built> {
    let AtEnd {
        first: Chunks { rows, chunked, .. },
        patches,
        counts,
        stars,
        labels,
        mut chosen,
    } = at;
    let arrays = rows.marked::<I>(job, counts.degenerate)?;
    // What was written down names the rows as they are.
    let aside = clock.at_stake().then(|| Changes::new(job.ws)).transpose()?;
    let (spilled, locals) = (chunked.settled.spilled, chunked.locals());
    let pass = ("finish", "items", job.shape.triangles + patches.records());
    clock.measured(pass, |steps, ws| {
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
    })
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
) -> Result<Result<AtSeams<I, W, X>, Way>> {
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
    let first = Chunks {
        rows,
        stars,
        chunked,
        records: Some(records),
        unreferenced,
        kinds: PhantomData,
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
