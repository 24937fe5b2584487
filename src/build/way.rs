//! Which way a build goes: in file order, or through cells.
//!
//! Why it may be guessed: every way gives the same folder. A wrong guess costs time, and a way
//! that turns out not to fit the budget is left for one that does.
//!
//! Memory: a block of V. I/O: four blocks of V.

use super::Job;
use super::arrays::TriangleReader;
use super::cells::CellPlan;
use super::cells::map::CellMap;
use super::plan::{Plan, Shape, Strategy};
use crate::chunk::ids::{LocalIds, TABLE_BYTES};
use crate::corner::Index;
use crate::error::{Error, Result};

/// Triangles of a block that is looked at.
pub const BLOCK: u64 = 64 << 10;
/// Blocks that are looked at.
pub const BLOCKS: u64 = 4;

/// No machine has more memory.
const MOST_MEMORY: u64 = 1 << 50;

/// What cells are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Vertices near in space.
    Place,
    /// Vertices near in number.
    Id,
}

/// A way through the passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// In file order; `whatever` the scan may find.
    InOrder {
        /// False when the scan may find cells to be better.
        whatever: bool,
    },
    /// Through cells.
    Cells(Kind),
}

/// Chooses a way by the strategy, the sizes and a look at some blocks of V.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::Input`].
pub fn choose<I: Index>(job: &Job) -> Result<Way> {
    let in_order = Way::InOrder { whatever: true };
    Ok(match job.strategy {
        Strategy::Memory | Strategy::Contract => in_order,
        Strategy::ByPlace if job.g.is_some() => Way::Cells(Kind::Place),
        Strategy::ByPlace | Strategy::ById => Way::Cells(Kind::Id),
        Strategy::Auto => match fitting(&job.shape, &job.plan, job.ws.budget.free()) {
            Some(kind) if scattered::<I>(job)? => Way::Cells(kind),
            Some(_) => Way::InOrder { whatever: false },
            None => in_order,
        },
    })
}

impl Way {
    /// The better way when a scan found so many seam vertices, if there is one.
    pub fn after_scan(job: &Job, seams: u64) -> Option<Way> {
        let many = 3 * seams > job.shape.vertices && helpful(&job.shape, &job.plan);
        let kind = fitting(&job.shape, &job.plan, job.ws.budget.free());
        kind.filter(|_| many).map(Way::Cells)
    }
}

/// True when cells could help at all: the mesh has several chunks, and triangles that touch.
pub fn helpful(shape: &Shape, plan: &Plan) -> bool {
    shape.triangles > 2 * plan.chunk && shape.vertices < 2 * shape.triangles
}

/// The kind of cells that fits so much memory: by place few local components are expected, by id
/// as many as triangles.
pub fn fitting(shape: &Shape, plan: &Plan, memory: u64) -> Option<Kind> {
    let kind = if holds(shape, memory, Kind::Place) {
        Kind::Place
    } else {
        Kind::Id
    };
    Some(kind).filter(|kind| fits(shape, plan, memory, *kind))
}

/// True when what is held through all passes of a kind leaves room for them.
fn holds(shape: &Shape, memory: u64, kind: Kind) -> bool {
    let held = CellPlan::held(shape) + shape.vertices / 8;
    match kind {
        Kind::Place => {
            let map = CellMap::bytes_by_place(shape.vertices);
            shape.coord > 0 && held + map <= memory / 8 * 5
        }
        Kind::Id => {
            // A word and two bits for each triangle, as if each were a local component.
            let labels = shape.triangles * shape.record() + shape.triangles / 2;
            held + labels <= memory / 2
        }
    }
}

fn fits(shape: &Shape, plan: &Plan, memory: u64, kind: Kind) -> bool {
    let by_place = kind == Kind::Place;
    let cells = CellPlan::new(shape, memory, by_place, plan.buckets);
    holds(shape, memory, kind) && cells.suits(shape, plan, memory, by_place)
}

/// A refusal of memory on the way through cells, with a budget that suffices for that way: what one
/// pass wants says nothing of the next.
pub fn with_least(error: Error, job: &Job, kind: Kind) -> Error {
    let Error::Budget { what, need, have } = error else {
        return error;
    };
    let mut enough = have;
    while enough < MOST_MEMORY {
        enough = (enough + enough / 16).max(need.min(MOST_MEMORY));
        let plan = Plan::new(&job.shape, enough, None, job.plan.buckets);
        if plan.is_ok_and(|plan| fits(&job.shape, &plan, enough, kind)) {
            break;
        }
    }
    let need = need.max(enough);
    Error::Budget { what, need, have }
}

/// True when consecutive triangles hardly ever share vertices, though triangles touch.
fn scattered<I: Index>(job: &Job) -> Result<bool> {
    if !helpful(&job.shape, &job.plan) {
        return Ok(false);
    }
    let t = job.shape.triangles;
    let count = BLOCK.min(job.plan.chunk).min(t);
    let bytes = count * (TriangleReader::<I>::BYTES + 12 + TABLE_BYTES);
    let _lease = job.ws.budget.lease("a look at V", bytes)?;
    let mut reader = TriangleReader::<I>::new(&job.mesh.v);
    let mut ids = LocalIds::default();
    let (mut distinct, mut corners) = (0, 0);
    for block in 0..BLOCKS {
        let first = (t - count) / (BLOCKS - 1) * block;
        let v = match reader.read(first, count) {
            Ok(v) => v,
            // What is wrong is told by the first full reading, which finds what is wrong first.
            Err(Error::Input { .. }) => return Ok(false),
            Err(e) => return Err(e),
        };
        ids.assign(v);
        // Ids in a narrow range are near each other.
        distinct += ids.table().len();
        corners += v.len();
    }
    // Patches have about half a vertex a triangle, strips about one, what is scattered three.
    Ok(10 * distinct > 6 * corners)
}
