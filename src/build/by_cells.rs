//! The way through cells, for meshes whose triangles lie in no order that helps.

use super::Job;
use super::assembling::Assembling;
use super::behind::{Behind, UpToSeams, behind_seams};
use super::cells::CellPlan;
use super::cells::deal::deal;
use super::cells::map::{by_id, by_place};
use super::cells::names::Marks;
use super::cells::places::{Places, deal_places};
use super::cells::settle::{Sinks, settle};
use super::cells::sums::Left;
use super::chunked::Settled;
use super::clock::Clock;
use super::dealt::{AtSeams, Cells, Dealt};
use super::pipeline::Built;
use super::records::EdgeCorner;
use super::seams::seams;
use super::stars::spill::Spilled;
use super::way::{Kind, Way};
use super::whole::Whole;
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::error::Result;
use crate::shuffle::Shuffle;
use std::time::Instant;

/// The steps of a way through cells.
pub struct StepNames {
    /// The step behind which the triangles are dealt.
    pub dealt: &'static str,
    /// The step behind which the cells are settled.
    pub settled: &'static str,
    /// Those behind the seams.
    pub behind: Behind,
    /// The step behind which some windows of triangles are assembled.
    pub assembled: &'static str,
}

impl StepNames {
    /// True when a build that was stopped behind this step went this way.
    pub fn has(&self, step: &str) -> bool {
        let Behind {
            stars,
            stitch,
            components,
        } = self.behind;
        let behind = [stars, stitch, components, self.assembled];
        [self.dealt, self.settled].contains(&step) || behind.contains(&step)
    }
}

/// How the steps of this way are called.
pub const fn steps_of(kind: Kind) -> StepNames {
    match kind {
        Kind::Place => StepNames {
            dealt: "deal by place",
            settled: "settle by place",
            behind: Behind {
                stars: "stars by place",
                stitch: "stitch by place",
                components: "components by place",
            },
            assembled: "assemble by place",
        },
        Kind::Id => StepNames {
            dealt: "deal by id",
            settled: "settle by id",
            behind: Behind {
                stars: "stars by id",
                stitch: "stitch by id",
                components: "components by id",
            },
            assembled: "assemble by id",
        },
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
    let plan = CellPlan::new(
        &job.shape,
        job.ws.budget.free(),
        kind == Kind::Place,
        job.plan.buckets,
    );
    let steps = steps_of(kind);
    let assembling = match clock.restored(steps.assembled)? {
        Some(assembling) => assembling,
        None => {
            let at = behind_seams(clock, job, bounds, &steps.behind, |clock| {
                seam_all::<I, W, X>(clock, job, bounds, (kind, &plan))
            })?;
            match at {
                Ok(at) => Assembling::new::<I>(job, at)?,
                Err(better) => return Ok(Err(better)),
            }
        }
    };
    assembling.finish::<I>(clock, job, &plan, &steps).map(Ok)
}

/// Settles the cells, and the edges of those that do not fit; or says that file order is the way
/// to go.
fn seam_all<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    (kind, plan): (Kind, &CellPlan),
) -> Result<UpToSeams<Cells<W, X>, W>> {
    let ws = job.ws;
    let settled = steps_of(kind).settled;
    let (mut cells, seaming) = match clock.restored::<AtSeams<W, X>>(settled)? {
        Some(state) => state,
        None => settle_all::<I, W, X>(clock, job, bounds, (kind, plan))?,
    };
    // While there is most room for it.
    if cells.places.is_none() {
        cells.places = Some(Places::again(job)?);
    }
    let spilled = cells.settled.spilled;
    let (cells, seamed) = clock.rounds_and(
        ("seams", "corners", spilled),
        (settled, job.opened),
        (cells, seaming),
        |(_, seaming), until| seams(job, seaming, until, EdgeCorner::local),
        |(cells, seaming)| Ok((cells, seaming.finish(job)?)),
    )?;
    let nodes = cells.names.count();
    let labels = nodes * W::BYTES as u64 + nodes / 2;
    let windows = ws.workers.count() as u64 * plan.windows.bytes::<I, W>();
    if labels + windows > ws.budget.free() / 8 * 7 {
        return Ok(Err(Way::InOrder { whatever: true }));
    }
    Ok(Ok((cells, seamed)))
}

/// Maps, deals and settles.
fn settle_all<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    (kind, plan): (Kind, &CellPlan),
) -> Result<AtSeams<W, X>> {
    let step = steps_of(kind).dealt;
    let mut dealt = match clock.restored::<Dealt<W, X>>(step)? {
        Some(dealt) => Dealt {
            places: dealt.places.opened(job)?,
            ..dealt
        },
        None => deal_all::<I, W, X>(clock, job, bounds, (kind, plan))?,
    };
    let (grid, pass) = (
        Grid::new(bounds),
        ("settle", "triangles", job.shape.triangles),
    );
    clock.rounds(pass, (step, job.opened), &mut dealt, |dealt, until| {
        settle_some(job, dealt, &grid, until)
    })?;
    dealt.finish()
}

/// Maps and deals, and makes what cells write to.
fn deal_all<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    (kind, plan): (Kind, &CellPlan),
) -> Result<Dealt<W, X>> {
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
    let (keys, n) = (0..t.max(1), n.max(1));
    // Few, but for hubs and the like.
    let rare = job.shuffle_plan(size_of::<EdgeCorner<W>>(), t.max(1) / 64);
    Ok(Dealt {
        hands,
        places,
        marks,
        replies: Shuffle::new(ws, "replies", keys.clone(), plan.replies)?,
        patches: Shuffle::new(ws, "opposites", keys, plan.patches)?,
        cuts: Shuffle::new(ws, "non-manifold corners", 0..n, rare)?,
        edges: Shuffle::new(ws, "corners of large cells", 0..n, rare)?,
        links: ws.scratch.file("links")?,
        borders: ws.scratch.file("borders")?,
        left: Left::new(ws)?,
        stars: Spilled::wanted(job, plan.parts(t.max(1)))?,
        settled: Settled::default(),
        done: 0,
        windows: plan.windows.count,
    })
}

/// Settles cells until all are settled or `until` is past; true when all are.
fn settle_some<W: Index, X: Coord>(
    job: &Job,
    dealt: &mut Dealt<W, X>,
    grid: &Grid,
    until: Option<Instant>,
) -> Result<bool> {
    let sinks = Sinks {
        replies: &dealt.replies,
        patches: &dealt.patches,
        cuts: &dealt.cuts,
        edges: &dealt.edges,
        names: &dealt.marks,
        links: &dealt.links,
        borders: &dealt.borders,
        counts: &dealt.left.counts,
        measures: &dealt.left.measures,
        unmeasured: &dealt.left.unmeasured,
        alone: &dealt.left.alone,
        stars: dealt.stars.as_ref(),
    };
    let budget = &job.ws.budget;
    // An eighth stays free for what the shuffles note of what they wrote.
    let free = budget.free() / 8 * 7;
    let share = free / job.ws.workers.count() as u64;
    let share = share.saturating_sub(sinks.thread_bytes());
    let of = (&dealt.hands, &dealt.places);
    let (settled, done) = settle(job, of, grid, share, &sinks, (dealt.done, until))?;
    dealt.settled.merge(&settled);
    dealt.done = done;
    Ok(done == dealt.hands.triangles.count())
}
