//! The way through cells, for meshes whose triangles lie in no order that helps.

use super::cells::CellPlan;
use super::cells::assemble::{Said, assemble};
use super::cells::deal::{Hands, deal};
use super::cells::map::{by_id, by_place};
use super::cells::names::{Marks, Names};
use super::cells::places::{Places, deal_places};
use super::cells::records::{NodeCount, Reply};
use super::cells::settle::{APPENDED, Sinks, settle};
use super::cells::sums::Sums;
use super::chunks::Settled;
use super::components::{Given, components};
use super::finish::{Found, list};
use super::nodes::Nodes;
use super::pipeline::{Built, Clock};
use super::records::{EdgeCorner, Patch};
use super::seams::{Seaming, seams};
use super::stars::spill::Spilled;
use super::stitch::{Linked, stitch};
use super::tail::{Edges, Rows, join_stars};
use super::way::{Kind, Way};
use super::whole::Whole;
use super::{Job, SCRATCH_BLOCK, scratch_items};
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Shuffle};

/// What the cells left.
struct Settling<W: Index> {
    replies: Buckets<Reply<W>>,
    patches: Shuffle<Patch<W>>,
    cuts: Shuffle<EdgeCorner<W>>,
    edges: Buckets<EdgeCorner<W>>,
    names: Names,
    files: Files,
    degenerate: Vec<u64>,
    unreferenced: u64,
    settled: Settled,
    stars: Option<Spilled<W>>,
    /// Windows that the replies are for.
    windows: u64,
}

/// The step behind which the cells are settled.
pub const fn settled_by(kind: Kind) -> &'static str {
    match kind {
        Kind::Place => "settle by place",
        Kind::Id => "settle by id",
    }
}

impl<W: Index> Keep for Settling<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.replies.keep(to)?;
        self.patches.keep(to)?;
        self.cuts.keep(to)?;
        self.edges.keep(to)?;
        self.names.keep(to)?;
        let Files {
            links,
            borders,
            counts,
            measures,
            unmeasured,
        } = &self.files;
        for file in [links, borders, counts, measures, unmeasured] {
            to.file(file)?;
        }
        to.list(&self.degenerate)?;
        to.number(self.unreferenced)?;
        self.settled.keep(to)?;
        self.stars.keep(to)?;
        to.number(self.windows)
    }

    fn restore(from: &mut Reader) -> Result<Settling<W>> {
        Ok(Settling {
            replies: Buckets::restore(from)?,
            patches: Shuffle::restore(from)?,
            cuts: Shuffle::restore(from)?,
            edges: Buckets::restore(from)?,
            names: Names::restore(from)?,
            files: Files {
                links: from.file()?,
                borders: from.file()?,
                counts: from.file()?,
                measures: from.file()?,
                unmeasured: from.file()?,
            },
            degenerate: from.list()?,
            unreferenced: from.number()?,
            settled: Settled::restore(from)?,
            stars: Option::restore(from)?,
            windows: from.number()?,
        })
    }
}

/// Records in order of arrival.
struct Files {
    links: ScratchFile,
    borders: ScratchFile,
    counts: ScratchFile,
    measures: ScratchFile,
    unmeasured: ScratchFile,
}

impl Files {
    /// Hands the numbers of local components that contradict themselves to `each`.
    fn conflicts(
        &self,
        job: &Job,
        names: &Names,
        each: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let file = &self.counts;
        scratch_items(
            job.ws,
            file,
            0,
            file.len(),
            &mut |counts: &[NodeCount]| {
                let marked = counts.iter().filter(|count| count.conflict != 0);
                let mut numbers = marked.map(|count| names.number(count.name));
                numbers.try_for_each(&mut *each)
            },
        )
    }

    /// The numbers of what faces a border, in a file.
    fn borders<W: Index>(&self, job: &Job, names: &Names) -> Result<ScratchFile> {
        let (ws, file) = (job.ws, &self.borders);
        let numbers = ws.scratch.file("numbers at borders")?;
        let _lease = ws
            .budget
            .lease("numbers at borders", SCRATCH_BLOCK as u64)?;
        let mut block: Vec<W> = Vec::new();
        scratch_items(ws, file, 0, file.len(), &mut |called: &[W]| {
            block.clear();
            block.extend(called.iter().map(|name| W::of(names.number(name.wide()))));
            numbers.append(bytemuck::cast_slice(&block))?;
            Ok(())
        })?;
        Ok(numbers)
    }
}

/// Runs the passes; or says that file order is the way to go, when there turn out to be more
/// local components than the budget holds.
///
/// # Errors
/// Those of the passes.
pub fn by_cells<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    kind: Kind,
) -> Result<Result<Built, Way>> {
    let (ws, t) = (job.ws, job.shape.triangles);
    let grid = Grid::new(bounds);
    let plan = CellPlan::new(
        &job.shape,
        ws.budget.free(),
        kind == Kind::Place,
        job.plan.buckets,
    );
    let step = settled_by(kind);
    let (settling, places) = match clock.restored::<Settling<W>>(step)? {
        Some(settling) => (settling, Places::again(job)?),
        None => {
            let (settling, places) = first_passes::<I, W, X>(clock, job, bounds, (kind, &plan))?;
            clock.done(step, job.opened, &settling)?;
            (settling, places)
        }
    };
    if settling.windows != plan.windows.count {
        return Err(Error::Internal(format!(
            "{} windows of triangles became {}",
            settling.windows, plan.windows.count
        )));
    }
    let Settling {
        replies,
        patches,
        cuts,
        edges,
        names,
        files,
        ..
    } = settling;
    let spilled = settling.settled.spilled;
    let seamed = clock.pass("seams", "corners", spilled, || {
        let seaming = Seaming {
            edges: &edges,
            cuts: &cuts,
            patches: &patches,
            links: &files.links,
            borders: &files.borders,
        };
        seams(
            job,
            &seaming,
            plan.patches.writer_bytes(),
            EdgeCorner::local,
        )
    })?;
    drop(edges);
    let (cuts, patches) = (cuts.finish()?, patches.finish()?);
    let settled = Edges {
        first: &settling.settled,
        seams: &seamed,
        cut_corners: cuts.records(),
        unreferenced: settling.unreferenced,
        bounds,
    };
    let mut counts = settled.counts(job)?;
    let nodes = Nodes::ByName(&names);
    let labels = nodes.count() * W::BYTES as u64 + nodes.count() / 2;
    let windows = ws.workers.count() as u64 * plan.windows.bytes::<I, W>();
    if labels + windows > ws.budget.free() / 8 * 7 {
        return Ok(Err(Way::InOrder { whatever: true }));
    }
    let stars = join_stars(clock, job, &nodes, settling.stars, counts.degenerate)?;
    let records = files.links.len() / (2 * W::BYTES as u64);
    let labels = clock.pass("stitch", "links", records, || {
        let linked = Linked {
            nodes,
            links: &files.links,
            conflicts: &|each| files.conflicts(job, &names, each),
        };
        stitch::<W>(job, &linked, true)
    })?;
    let borders = files.borders::<W>(job, &names)?;
    let mut chosen = clock.pass("components", "", 0, || {
        let given = Given {
            nodes,
            labels: &labels,
            borders: &borders,
            cuts: &cuts,
            grid: &grid,
            stars: stars.as_ref(),
        };
        let sums = Sums {
            job,
            names: &names,
            labels: &labels,
            grid: &grid,
            counts: &files.counts,
            measures: &files.measures,
            unmeasured: &files.unmeasured,
        };
        components(job, &given, &mut counts, |pieces, memory| {
            sums.sum::<X>(&places, pieces, memory)
        })
    })?;
    drop((cuts, places, files, borders));
    let arrays = Rows::create::<I>(job)?.marked::<I>(job, counts.degenerate)?;
    let said = Said {
        replies: &replies,
        patches: &patches,
        names: &names,
        labels: &labels,
        chosen: &chosen,
        degenerate: &settling.degenerate,
    };
    let found = Found {
        labels: &labels,
        chosen: &chosen,
    };
    let lists = clock.pass("assemble", "triangles", t, || {
        assemble::<I, W>(job, &plan.windows, &said, &arrays.tables())?;
        list::<I, W>(job, &found, counts.nonmanifold_edges, stars.as_ref())
    })?;
    let measures = chosen.stars.take().map(|stars| stars.measures);
    let counted = (counts, measures);
    let made = (chosen.table, lists);
    Ok(Ok(arrays.built(made, counted, spilled, nodes.count())))
}

/// Maps, deals and settles.
fn first_passes<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    (kind, plan): (Kind, &CellPlan),
) -> Result<(Settling<W>, Places<X>)> {
    let (ws, t, n) = (job.ws, job.shape.triangles, job.shape.vertices);
    let marks = Marks::new(&ws.budget, t)?;
    let map = clock.pass("cells", "vertices", n, || match (&job.g, kind) {
        (Some(g), Kind::Place) => by_place::<X>(job, g, bounds, plan.cells),
        _ => by_id::<I>(job, plan.cells),
    })?;
    // The other half is for writers and cells.
    let half = ws.budget.limit() / 2;
    let reserved = half.checked_sub(map.bytes());
    let whole = match reserved {
        Some(reserved) => Whole::<X>::within(job, reserved)?,
        None => None,
    };
    let (hands, places) = clock.pass("deal", "triangles", t, || {
        let places = match (&job.g, whole, kind) {
            (None, ..) => Places::None,
            (_, Some(whole), _) => Places::Whole(whole),
            (Some(g), None, Kind::Place) => deal_places::<W, X>(job, g, &map, plan.spots)?,
            (Some(_), None, Kind::Id) => Places::Later,
        };
        Ok((deal::<I, W>(job, plan, &plan.windows, &map)?, places))
    })?;
    drop(map);
    let settling = clock.pass("settle", "triangles", t, || {
        settle_all(job, hands, &places, &Grid::new(bounds), plan, marks)
    })?;
    Ok((settling, places))
}

fn settle_all<W: Index, X: Coord>(
    job: &Job,
    hands: Hands<W>,
    places: &Places<X>,
    grid: &Grid,
    plan: &CellPlan,
    marks: Marks,
) -> Result<Settling<W>> {
    let (ws, t, n) = (
        job.ws,
        job.shape.triangles.max(1),
        job.shape.vertices.max(1),
    );
    let replies = Shuffle::new(ws, "replies", 0..t, plan.replies)?;
    let patches = Shuffle::new(ws, "opposites", 0..t, plan.patches)?;
    // Few, but for hubs and the like.
    let rare = job.shuffle_plan(size_of::<EdgeCorner<W>>(), t / 64);
    let cuts = Shuffle::new(ws, "non-manifold corners", 0..n, rare)?;
    let edges = Shuffle::new(ws, "corners of large cells", 0..n, rare)?;
    let files = Files {
        links: ws.scratch.file("links")?,
        borders: ws.scratch.file("borders")?,
        counts: ws.scratch.file("counts of local components")?,
        measures: ws.scratch.file("measures of local components")?,
        unmeasured: ws.scratch.file("triangles to measure")?,
    };
    let threads = ws.workers.count() as u64;
    let parts = plan.parts(t);
    let stars = Spilled::wanted(job, parts)?;
    let writers = plan.replies.writer_bytes()
        + plan.patches.writer_bytes()
        + 2 * rare.writer_bytes()
        + APPENDED
        + stars.as_ref().map_or(0, Spilled::thread_bytes);
    // An eighth stays free for what the shuffles note of what they wrote.
    let free = ws.budget.free() / 8 * 7;
    let share = (free / threads).saturating_sub(writers);
    let settled = {
        let sinks = Sinks {
            replies: &replies,
            patches: &patches,
            cuts: &cuts,
            edges: &edges,
            names: &marks,
            links: &files.links,
            borders: &files.borders,
            counts: &files.counts,
            measures: &files.measures,
            unmeasured: &files.unmeasured,
            stars: stars.as_ref(),
        };
        settle(job, &hands, places, grid, share, &sinks)?
    };
    let degenerate: u64 = hands.degenerate.iter().sum();
    Ok(Settling {
        replies: replies.finish()?,
        patches,
        cuts,
        edges: edges.finish()?,
        names: marks.seal(),
        files,
        degenerate: hands.degenerate,
        unreferenced: hands.unreferenced,
        stars,
        windows: plan.windows.count,
        settled: Settled {
            degenerate,
            ..settled
        },
    })
}
