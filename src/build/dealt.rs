//! The way through cells between its passes: what was dealt and how much of it is settled, and what
//! the cells left.
//!
//! Memory: of its own none; the marks of names and of open vertices. I/O: none but what is asked
//! for.

use super::behind::{First, used_up};
use super::cells::deal::Hands;
use super::cells::names::{Marks, Names};
use super::cells::places::Places;
use super::cells::records::Reply;
use super::cells::sums::{Left, Sums};
use super::chunked::Settled;
use super::nodes::Nodes;
use super::records::{EdgeCorner, Patch};
use super::seams::Seaming;
use super::stars::spill::Spilled;
use super::stitch::Labels;
use super::tally::Pieces;
use super::{Job, SCRATCH_BLOCK, scratch_items};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::Result;
use crate::shuffle::{Buckets, Shuffle};

/// What was dealt, and what the cells left so far.
pub struct Dealt<W: Index, X> {
    /// Triangles and edges by cell.
    pub hands: Hands<W>,
    /// Where the vertices of a cell are.
    pub places: Places<X>,
    /// Names of local components.
    pub marks: Marks,
    /// Answers to the triangles.
    pub replies: Shuffle<Reply<W>>,
    /// Opposites of corners whose triangles lie in other cells.
    pub patches: Shuffle<Patch<W>>,
    /// Corners on non-manifold edges.
    pub cuts: Shuffle<EdgeCorner<W>>,
    /// Corners of cells that do not fit, for the seam pass.
    pub edges: Shuffle<EdgeCorner<W>>,
    /// Links between names.
    pub links: ScratchFile,
    /// Names of triangles that face a border from another cell.
    pub borders: ScratchFile,
    /// Records of local components.
    pub left: Left,
    /// What is left of vertex stars, when they are wanted.
    pub stars: Option<Spilled<W>>,
    /// Totals.
    pub settled: Settled,
    /// Cells that are settled.
    pub done: u64,
    /// Windows that the replies are for.
    pub windows: u64,
}

/// What is written down while the seams are settled: they are, and what the cells left besides.
pub type AtSeams<W, X> = (Cells<W, X>, Seaming<W>);

/// What the cells left, but for the edges of those that did not fit.
pub struct Cells<W: Index, X> {
    /// Answers to the triangles.
    pub replies: Buckets<Reply<W>>,
    /// Names of local components.
    pub names: Names,
    /// Records of local components, until they are summed.
    pub left: Option<Left>,
    /// Where the vertices are, until then; in a build that is gone on with they are looked for anew.
    pub places: Option<Places<X>>,
    /// Degenerate triangles of each window.
    pub degenerate: Vec<u64>,
    /// Vertices that no triangle names.
    pub unreferenced: u64,
    /// Totals of the cells.
    pub settled: Settled,
    /// What is left of vertex stars, when they are wanted, until these are joined.
    pub stars: Option<Spilled<W>>,
    /// Windows that the replies are for.
    pub windows: u64,
}

impl<W: Index, X: Coord> Keep for Dealt<W, X> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.hands.keep(to)?;
        self.places.keep(to)?;
        self.marks.keep(to)?;
        self.replies.keep(to)?;
        self.patches.keep(to)?;
        self.cuts.keep(to)?;
        self.edges.keep(to)?;
        to.file(&self.links)?;
        to.file(&self.borders)?;
        self.left.keep(to)?;
        self.stars.keep(to)?;
        self.settled.keep(to)?;
        to.number(self.done)?;
        to.number(self.windows)
    }

    fn restore(from: &mut Reader) -> Result<Dealt<W, X>> {
        Ok(Dealt {
            hands: Hands::restore(from)?,
            places: Places::restore(from)?,
            marks: Marks::restore(from)?,
            replies: Shuffle::restore(from)?,
            patches: Shuffle::restore(from)?,
            cuts: Shuffle::restore(from)?,
            edges: Shuffle::restore(from)?,
            links: from.file()?,
            borders: from.file()?,
            left: Left::restore(from)?,
            stars: Option::restore(from)?,
            settled: Settled::restore(from)?,
            done: from.number()?,
            windows: from.number()?,
        })
    }
}

impl<W: Index, X> Keep for Cells<W, X> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.replies.keep(to)?;
        self.names.keep(to)?;
        self.left.keep(to)?;
        to.list(&self.degenerate)?;
        to.number(self.unreferenced)?;
        self.settled.keep(to)?;
        self.stars.keep(to)?;
        to.number(self.windows)
    }

    fn restore(from: &mut Reader) -> Result<Self> {
        Ok(Cells {
            replies: Buckets::restore(from)?,
            names: Names::restore(from)?,
            left: Option::restore(from)?,
            places: None,
            degenerate: from.list()?,
            unreferenced: from.number()?,
            settled: Settled::restore(from)?,
            stars: Option::restore(from)?,
            windows: from.number()?,
        })
    }
}

impl<W: Index, X> Dealt<W, X> {
    /// All cells are settled.
    ///
    /// # Errors
    /// As [`Shuffle::finish`].
    pub fn finish(self) -> Result<AtSeams<W, X>> {
        let degenerate: u64 = self.hands.degenerate.iter().sum();
        let seaming = Seaming {
            edges: self.edges.finish()?,
            cuts: self.cuts,
            patches: self.patches,
            links: self.links,
            borders: self.borders,
            settled: Settled::default(),
            done: 0,
        };
        let cells = Cells {
            replies: self.replies.finish()?,
            names: self.marks.seal(),
            left: Some(self.left),
            places: Some(self.places),
            degenerate: self.hands.degenerate,
            unreferenced: self.hands.unreferenced,
            settled: Settled {
                degenerate,
                ..self.settled
            },
            stars: self.stars,
            windows: self.windows,
        };
        Ok((cells, seaming))
    }
}

impl<W: Index, X: Coord> First<W> for Cells<W, X> {
    type Sums = (Option<Left>, Places<X>);

    fn settled(&self) -> &Settled {
        &self.settled
    }

    fn unreferenced(&self) -> u64 {
        self.unreferenced
    }

    fn nodes(&self, _: &Job) -> Nodes<'_> {
        Nodes::ByName(&self.names)
    }

    fn stars(&mut self) -> Option<Spilled<W>> {
        self.stars.take()
    }

    fn alone(&self) -> Option<&ScratchFile> {
        self.left.as_ref().map(|left| &left.alone)
    }

    fn conflicts(&self, job: &Job, each: &mut dyn FnMut(u64) -> Result<()>) -> Result<()> {
        let left = self.left.as_ref().ok_or_else(used_up)?;
        left.conflicts(job, &self.names, each)
    }

    /// This way was chosen because they fit.
    fn holds_labels(&self, _: &Job) -> bool {
        true
    }

    fn check(&self, _: &Job, _: u64) -> Result<()> {
        Ok(())
    }

    fn borders(&self, job: &Job, called: ScratchFile) -> Result<ScratchFile> {
        numbered::<W>(job, &self.names, &called)
    }

    fn sums(&mut self, job: &Job) -> Result<Self::Sums> {
        let places = match self.places.take() {
            Some(places) => places,
            None => Places::again(job)?,
        };
        Ok((self.left.take(), places))
    }

    fn sum(
        &self,
        job: &Job,
        (left, places): Self::Sums,
        labels: &Labels<W>,
        to: &Pieces,
    ) -> Result<()> {
        let sums = Sums {
            job,
            names: &self.names,
            labels,
        };
        sums.sum::<X>(left.ok_or_else(used_up)?, &places, to)
    }
}

/// The numbers of what faces a border and is called so in `file`.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
fn numbered<W: Index>(job: &Job, names: &Names, file: &ScratchFile) -> Result<ScratchFile> {
    let ws = job.ws;
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
