//! The passes behind the seams, which both ways share: stars, stitch, components.
//!
//! Why what lies between them is a value: each pass takes what the one before has left whole, and
//! leaves it with what it has found. So a build that is to be gone on with writes this one down
//! behind each of them, and one that goes on makes only what is not there.
//!
//! Memory and I/O: with each pass.

use super::Job;
use super::chunked::Settled;
use super::clock::Clock;
use super::components::{Chosen, Given, components};
use super::cuts::Sorted;
use super::nodes::Nodes;
use super::records::Patch;
use super::seams::Seamed;
use super::stars::Starred;
use super::stars::spill::Spilled;
use super::stitch::{Labels, Linked, stitch};
use super::tail::{Edges, join_stars};
use super::tally::Pieces;
use super::way::Way;
use crate::chunk::grid::{Bounds, Grid};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::folder::Counts;
use crate::shuffle::Buckets;

/// How the steps of a way behind the seams are called.
#[derive(Clone, Copy)]
pub struct Behind {
    /// The step behind which the stars are joined.
    pub stars: &'static str,
    /// The step behind which the components are known.
    pub stitch: &'static str,
    /// The step behind which they are summed, and their orientations chosen.
    pub components: &'static str,
}

/// What the first passes of a way left, as these passes ask for it.
pub trait First<W: Index>: Keep {
    /// What is to be summed.
    type Sums;

    /// What was counted of the edges.
    fn settled(&self) -> &Settled;

    /// Vertices that no triangle names.
    fn unreferenced(&self) -> u64;

    /// Its local components.
    fn nodes(&self, job: &Job) -> Nodes<'_>;

    /// What is left of vertex stars, when they are wanted; for the pass that joins them.
    fn stars(&mut self) -> Option<Spilled<W>>;

    /// Triangles that are local components of their own, whose stars nobody has found.
    fn alone(&self) -> Option<&ScratchFile>;

    /// Hands the numbers of local components that contradict themselves to `each`.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], and those of `each`.
    fn conflicts(&self, job: &Job, each: &mut dyn FnMut(u64) -> Result<()>) -> Result<()>;

    /// Whether the labels of local components may stay in memory.
    fn holds_labels(&self, job: &Job) -> bool;

    /// Refuses more components than the budget holds.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    fn check(&self, job: &Job, components: u64) -> Result<()>;

    /// The numbers of the local components at borders, of what the seams call them.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
    fn borders(&self, job: &Job, called: ScratchFile) -> Result<ScratchFile>;

    /// What is to be summed; for the pass that sums it.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    fn sums(&mut self, job: &Job) -> Result<Self::Sums>;

    /// Sums it, and uses it up.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
    fn sum(&self, job: &Job, sums: Self::Sums, labels: &Labels<W>, to: &Pieces) -> Result<()>;
}

/// What the passes up to the seams come to: what the first of them left, and the seams; or the way
/// that is better.
pub type UpToSeams<F, W> = Result<(F, Seamed<W>), Way>;

/// What is to be summed was asked for once more.
pub fn used_up() -> Error {
    Error::Internal("what is known of local components was summed before".into())
}

/// Behind the stars.
struct AtStitch<F, W: Index> {
    first: F,
    cuts: Sorted,
    patches: Buckets<Patch<W>>,
    links: ScratchFile,
    borders: ScratchFile,
    counts: Counts,
    stars: Option<Starred<W>>,
}

/// Behind the stitch.
struct AtComponents<F, W: Index> {
    first: F,
    cuts: Sorted,
    patches: Buckets<Patch<W>>,
    borders: ScratchFile,
    counts: Counts,
    stars: Option<Starred<W>>,
    labels: Labels<W>,
}

/// Behind the components: what the arrays are completed with.
pub struct AtEnd<F, W: Index> {
    /// What the first passes left.
    pub first: F,
    /// Opposites to fill into O, by triangle.
    pub patches: Buckets<Patch<W>>,
    /// What was counted.
    pub counts: Counts,
    /// Vertex stars, when they are wanted.
    pub stars: Option<Starred<W>>,
    /// Components of the local components.
    pub labels: Labels<W>,
    /// Orientations.
    pub chosen: Chosen,
}

/// Runs these passes, or those of them that a stopped build has not done; `seamed` are those
/// before, which may say which way is better.
///
/// # Errors
/// Those of the passes.
pub fn behind_seams<W: Index, F: First<W>>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    steps: &Behind,
    seamed: impl FnOnce(&mut Clock) -> Result<UpToSeams<F, W>>,
) -> Result<Result<AtEnd<F, W>, Way>> {
    if let Some(at) = clock.restored(steps.components)? {
        return Ok(Ok(at));
    }
    let at = match clock.restored(steps.stitch)? {
        Some(at) => at,
        None => {
            let at = match clock.restored(steps.stars)? {
                Some(at) => at,
                None => {
                    let seamed = match seamed(clock)? {
                        Ok(seamed) => seamed,
                        Err(better) => return Ok(Err(better)),
                    };
                    let at = at_stitch(clock, job, bounds, seamed)?;
                    clock.done(steps.stars, job.opened, &at)?;
                    at
                }
            };
            let at = at_components(clock, job, at)?;
            clock.done(steps.stitch, job.opened, &at)?;
            at
        }
    };
    let at = at_end(clock, job, bounds, at)?;
    clock.done(steps.components, job.opened, &at)?;
    Ok(Ok(at))
}

/// Counts the edges, and joins the stars.
fn at_stitch<W: Index, F: First<W>>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    (mut first, seamed): (F, Seamed<W>),
) -> Result<AtStitch<F, W>> {
    let Seamed {
        cuts,
        cut_corners,
        patches,
        links,
        borders,
        settled,
    } = seamed;
    let edges = Edges {
        first: first.settled(),
        seams: &settled,
        cut_corners,
        unreferenced: first.unreferenced(),
        bounds,
    };
    let counts = edges.counts(job)?;
    let spilled = first.stars();
    let of = (&first.nodes(job), first.alone());
    let stars = join_stars(clock, job, of, spilled, counts.degenerate)?;
    Ok(AtStitch {
        first,
        cuts,
        patches,
        links,
        borders,
        counts,
        stars,
    })
}

/// Joins the local components.
fn at_components<W: Index, F: First<W>>(
    clock: &mut Clock,
    job: &Job,
    at: AtStitch<F, W>,
) -> Result<AtComponents<F, W>> {
    let AtStitch {
        first,
        cuts,
        patches,
        links,
        borders,
        counts,
        stars,
    } = at;
    let records = links.len() / (2 * W::BYTES as u64);
    let labels = clock.pass("stitch", "links", records, || {
        let linked = Linked {
            nodes: first.nodes(job),
            links: &links,
            conflicts: &|each| first.conflicts(job, each),
        };
        stitch::<W>(job, &linked, first.holds_labels(job))
    })?;
    first.check(job, labels.components)?;
    Ok(AtComponents {
        borders: first.borders(job, borders)?,
        first,
        cuts,
        patches,
        counts,
        stars,
        labels,
    })
}

/// Sums the components, and chooses their orientations.
fn at_end<W: Index, F: First<W>>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
    at: AtComponents<F, W>,
) -> Result<AtEnd<F, W>> {
    let AtComponents {
        mut first,
        cuts,
        patches,
        borders,
        mut counts,
        stars,
        labels,
    } = at;
    let chosen = clock.pass("components", "", 0, || {
        let sums = first.sums(job)?;
        let given = Given {
            nodes: first.nodes(job),
            labels: &labels,
            borders: &borders,
            grid: &Grid::new(bounds),
            stars: stars.as_ref(),
        };
        components(job, &given, (cuts, &mut counts), |pieces| {
            first.sum(job, sums, &labels, pieces)
        })
    })?;
    Ok(AtEnd {
        first,
        patches,
        counts,
        stars,
        labels,
        chosen,
    })
}

impl<F: Keep, W: Index> Keep for AtStitch<F, W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.first.keep(to)?;
        self.cuts.keep(to)?;
        self.patches.keep(to)?;
        to.file(&self.links)?;
        to.file(&self.borders)?;
        self.counts.keep(to)?;
        self.stars.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Self> {
        Ok(AtStitch {
            first: F::restore(from)?,
            cuts: Sorted::restore(from)?,
            patches: Buckets::restore(from)?,
            links: from.file()?,
            borders: from.file()?,
            counts: Counts::restore(from)?,
            stars: Option::restore(from)?,
        })
    }
}

impl<F: Keep, W: Index> Keep for AtComponents<F, W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.first.keep(to)?;
        self.cuts.keep(to)?;
        self.patches.keep(to)?;
        to.file(&self.borders)?;
        self.counts.keep(to)?;
        self.stars.keep(to)?;
        self.labels.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Self> {
        Ok(AtComponents {
            first: F::restore(from)?,
            cuts: Sorted::restore(from)?,
            patches: Buckets::restore(from)?,
            borders: from.file()?,
            counts: Counts::restore(from)?,
            stars: Option::restore(from)?,
            labels: Labels::restore(from)?,
        })
    }
}

impl<F: Keep, W: Index> Keep for AtEnd<F, W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.first.keep(to)?;
        self.patches.keep(to)?;
        self.counts.keep(to)?;
        self.stars.keep(to)?;
        self.labels.keep(to)?;
        self.chosen.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Self> {
        Ok(AtEnd {
            first: F::restore(from)?,
            patches: Buckets::restore(from)?,
            counts: Counts::restore(from)?,
            stars: Option::restore(from)?,
            labels: Labels::restore(from)?,
            chosen: Chosen::restore(from)?,
        })
    }
}
