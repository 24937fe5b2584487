//! The way through cells between its passes: what was dealt and how much of it is settled, and what
//! the cells left.
//!
//! Memory: of its own none; the marks of names and of open vertices. I/O: none but what is asked
//! for.

use super::cells::deal::Hands;
use super::cells::names::{Marks, Names};
use super::cells::places::Places;
use super::cells::records::Reply;
use super::cells::sums::Left;
use super::chunked::Settled;
use super::records::{EdgeCorner, Patch};
use super::seams::Seaming;
use super::stars::spill::Spilled;
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
pub type AtSeams<W> = (Settling<W>, Seaming<W>);

/// What the cells left, but for the edges of those that did not fit.
pub struct Settling<W: Index> {
    /// Answers to the triangles.
    pub replies: Buckets<Reply<W>>,
    /// Names of local components.
    pub names: Names,
    /// Records of local components.
    pub left: Left,
    /// Degenerate triangles of each window.
    pub degenerate: Vec<u64>,
    /// Vertices that no triangle names.
    pub unreferenced: u64,
    /// Totals of the cells.
    pub settled: Settled,
    /// What is left of vertex stars, when they are wanted.
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

impl<W: Index> Keep for Settling<W> {
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

    fn restore(from: &mut Reader) -> Result<Settling<W>> {
        Ok(Settling {
            replies: Buckets::restore(from)?,
            names: Names::restore(from)?,
            left: Left::restore(from)?,
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
    pub fn finish(self) -> Result<(AtSeams<W>, Places<X>)> {
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
        let settling = Settling {
            replies: self.replies.finish()?,
            names: self.marks.seal(),
            left: self.left,
            degenerate: self.hands.degenerate,
            unreferenced: self.hands.unreferenced,
            settled: Settled {
                degenerate,
                ..self.settled
            },
            stars: self.stars,
            windows: self.windows,
        };
        Ok(((settling, seaming), self.places))
    }
}

/// The numbers of what faces a border and is called so in `file`.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
pub fn numbered<W: Index>(job: &Job, names: &Names, file: &ScratchFile) -> Result<ScratchFile> {
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
