//! What both ways share behind their first passes: the counts of edges with the laws that they
//! must keep, the stars, and the arrays that they make.
//!
//! Memory: none. I/O: the headers of the arrays.

use super::Job;
use super::arrays::OutArray;
use super::cells::records::Unmeasured;
use super::chunked::Settled;
use super::clock::Clock;
use super::finish::Tables;
use super::nodes::Nodes;
use super::pipeline::Built;
use super::stars::Starred;
use super::stars::spill::Spilled;
use crate::chunk::grid::Bounds;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::folder::{self, Counts, Measures};
use bytemuck::Zeroable;

/// What is known of the edges and vertices before the components are.
pub struct Edges<'a> {
    /// Totals of the chunks, or of the cells.
    pub first: &'a Settled,
    /// Totals of the seams.
    pub seams: &'a Settled,
    /// Corners on non-manifold edges.
    pub cut_corners: u64,
    /// Vertices that no triangle names.
    pub unreferenced: u64,
    /// Box of the finite vertices.
    pub bounds: &'a Bounds,
}

impl Edges<'_> {
    /// The counts, when every corner is accounted for once.
    ///
    /// # Errors
    /// [`Error::Internal`]: a mismatch is a fault of this program.
    pub fn counts(&self, job: &Job) -> Result<Counts> {
        let (a, b) = (self.first, self.seams);
        let regular = a.regular + b.regular;
        let border = a.borders + b.borders;
        let nonmanifold = a.nonmanifold + b.nonmanifold;
        let triangles = job.shape.triangles;
        let corners = 2 * regular + border + self.cut_corners + 3 * a.degenerate;
        if corners != 3 * triangles {
            return Err(Error::Internal(format!(
                "{corners} of {} corners were settled",
                3 * triangles
            )));
        }
        if 2 * b.regular + b.borders > a.spilled {
            return Err(Error::Internal(format!(
                "the seam pass settled more corners than the {} that were spilled",
                a.spilled
            )));
        }
        Ok(Counts {
            triangles,
            vertices: job.shape.vertices,
            unreferenced_vertices: self.unreferenced,
            nonfinite_vertices: self.bounds.nonfinite,
            degenerate: a.degenerate,
            distinct_edges: regular + border + nonmanifold,
            regular_edges: regular,
            border_edges: border,
            nonmanifold_edges: nonmanifold,
            nonmanifold_corners: self.cut_corners,
            inconsistent_edges: a.inconsistent + b.inconsistent,
            polygons_fanned: job.mesh.polygons_fanned,
            ..Counts::default()
        })
    }
}

/// Joins what chunks or cells left of vertex stars, when they are wanted.
///
/// # Errors
/// Those of the pass; [`Error::Internal`] when not every corner of a triangle that is not
/// degenerate was counted at one vertex.
pub fn join_stars<W: Index>(
    clock: &mut Clock,
    job: &Job,
    (nodes, alone): (&Nodes, Option<&ScratchFile>),
    spilled: Option<Spilled<W>>,
    degenerate: u64,
) -> Result<Option<Starred<W>>> {
    let Some(spilled) = spilled else {
        return Ok(None);
    };
    let more = alone.map_or(0, |file| 3 * file.len() / size_of::<Unmeasured<W>>() as u64);
    let parts = spilled.parts() + more;
    let stars = clock.pass("stars", "parts of fans", parts, || {
        if let Some(alone) = alone {
            spill_alone(job, &spilled, alone)?;
        }
        Starred::new(job, nodes, spilled.finish()?)
    })?;
    let found = stars.valences.corners;
    let expected = 3 * (job.shape.triangles - degenerate);
    if found != expected {
        return Err(Error::Internal(format!(
            "the pass over stars counted {found} of {expected} corners"
        )));
    }
    Ok(Some(stars))
}

/// Triangles that are handed out at a time.
const BLOCK: u64 = 1 << 10;

/// Hands out the parts of fans of triangles that are local components of their own.
fn spill_alone<W: Index>(job: &Job, spilled: &Spilled<W>, alone: &ScratchFile) -> Result<()> {
    let (ws, size) = (job.ws, size_of::<Unmeasured<W>>() as u64);
    let triangles = alone.len() / size;
    if triangles == 0 {
        return Ok(());
    }
    let bytes = ws.workers.count() as u64 * BLOCK * size;
    let _lease = ws.budget.lease("triangles of large cells", bytes)?;
    ws.workers.run(
        triangles.div_ceil(BLOCK),
        || {
            let block = vec![Unmeasured::<W>::zeroed(); BLOCK as usize];
            Ok((block, spilled.spiller()?))
        },
        |(block, spiller), unit| {
            let count = BLOCK.min(triangles - unit * BLOCK) as usize;
            let bytes = bytemuck::cast_slice_mut(&mut block[..count]);
            alone.read_at(bytes, unit * BLOCK * size)?;
            let mut each = block[..count].iter();
            each.try_for_each(|triangle| spiller.alone(triangle.t(), triangle.v()))
        },
        |(_, spiller)| spiller.finish(),
    )
}

/// The arrays by triangle.
pub struct Rows {
    /// V.
    pub v: OutArray,
    /// O.
    pub o: OutArray,
    /// Component.
    pub component: OutArray,
}

impl Rows {
    /// Creates them, with nothing in their rows.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn create<I: Index>(job: &Job) -> Result<Rows> {
        let (t, id) = (job.shape.triangles, I::BYTES as u64);
        Ok(Rows {
            v: create::<I>(job, folder::V, &[t, 3], 3 * id)?,
            o: create::<I>(job, folder::O, &[t, 3], 3 * id)?,
            component: create::<I>(job, folder::COMPONENT, &[t], id)?,
        })
    }

    /// Adds those that wait for the components: what is flipped, and what is degenerate.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`].
    pub fn marked<I: Index>(self, job: &Job, degenerate: u64) -> Result<Marked> {
        let (bytes, dir, ws) = (job.shape.triangles.div_ceil(8), job.dir, job.ws);
        Ok(Marked {
            flipped: OutArray::create(dir, folder::FLIPPED, "|u1", &[bytes], 1, ws)?,
            degenerate: create::<I>(job, folder::DEGENERATE, &[degenerate], I::BYTES as u64)?,
            rows: self,
        })
    }
}

/// The arrays that the last pass completes.
pub struct Marked {
    rows: Rows,
    flipped: OutArray,
    degenerate: OutArray,
}

impl Marked {
    /// As the last pass takes them.
    pub fn tables(&self) -> Tables<'_> {
        Tables {
            v: &self.rows.v,
            o: &self.rows.o,
            component: &self.rows.component,
            flipped: &self.flipped,
            degenerate: &self.degenerate,
        }
    }

    /// What is to be sealed: these, `table` and `lists`, with what was counted.
    pub fn built(
        self,
        (table, lists): (OutArray, Vec<OutArray>),
        (counts, measures): (Counts, Option<Measures>),
        seam_corners: u64,
        local_components: u64,
    ) -> Built {
        let Rows { v, o, component } = self.rows;
        let Marked {
            flipped,
            degenerate,
            ..
        } = self;
        let mut files = vec![v, o, component, flipped, table, degenerate];
        files.extend(lists);
        Built {
            files,
            counts,
            measures,
            seam_corners,
            local_components,
        }
    }
}

impl Keep for Marked {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.rows.keep(to)?;
        self.flipped.keep(to)?;
        self.degenerate.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Marked> {
        Ok(Marked {
            rows: Rows::restore(from)?,
            flipped: OutArray::restore(from)?,
            degenerate: OutArray::restore(from)?,
        })
    }
}

fn create<I: Index>(job: &Job, name: &'static str, shape: &[u64], row: u64) -> Result<OutArray> {
    OutArray::create(job.dir, name, I::DESCR, shape, row, job.ws)
}

impl Built {
    /// As the last pass takes them.
    ///
    /// # Errors
    /// [`Error::Internal`] when one is not there.
    pub fn tables(&self) -> Result<Tables<'_>> {
        let find = |name| {
            let array = self.files.iter().find(|array| array.name == name);
            array.ok_or_else(|| Error::Internal(format!("{name} was not made")))
        };
        Ok(Tables {
            v: find(folder::V)?,
            o: find(folder::O)?,
            component: find(folder::COMPONENT)?,
            flipped: find(folder::FLIPPED)?,
            degenerate: find(folder::DEGENERATE)?,
        })
    }
}
