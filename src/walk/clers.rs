//! The swirl with the letters of Edgebreaker: which way it turns at each triangle, and why.
//!
//! The order is that of [`CornerTable::swirl`], triangle for triangle: right first, left when
//! all of that is done, across the first corner's opposite last. What is added is the *letter* of
//! each triangle, entered by the edge that its corner c faces:
//!
//! | letter | tip `c.v` | right `c.r` | left `c.l` | goes on |
//! |---|---|---|---|---|
//! | C | new | open | open | right; the left is met later, around the tip |
//! | L | | open | closed | right |
//! | R | | closed | open | left |
//! | S | known | open | open | right, and left when that is done: a *fork* |
//! | E | | closed | closed | back to the last fork |
//!
//! A side is *closed* when its triangle was visited, or when there is none (a border, a cut). A
//! tip is *known* when it was a tip or an end of the first edge before, or lies on a border of
//! its fan: the vertices of borders count as visited from the start, as in Rossignac's text.
//!
//! Why C needs no fork: the fan of an interior vertex that is new has no visited triangle (each
//! visited triangle has all its vertices known), so its triangles but this one are a chain from
//! right to left, none of them visited, and what begins at the right meets them all. So the
//! stack holds forks alone, and the order is still that of the swirl. By the same reasoning the
//! left of a fork may have been visited when the walk comes back to it: around a hole, a handle, a
//! non-manifold vertex or a twist. Such a fork was *joined*, and the walk says so.
//!
//! In a component where no corner lacks an opposite, with E, S, j for the number of letters and
//! of joined forks: S = E - 1 + j, C = V - 2 when each vertex is one fan, and j = 2 genus when it
//! is orientable; so a sphere has half of its letters C.
//!
//! Memory: T/8 + N/8 bytes of visited bits, and the stack: 4 KiB to 1 MiB, the rest of a deep
//! one on scratch. I/O: the pages of V and O of the component, each vertex's fan once more; the
//! search of an edge in the list of non-manifold ones for each side without opposite.

use super::Surface;
use super::bits::Bits;
use super::cuts::Cuts;
use super::stack::{self, Stack};
use crate::corner::{Corner, Triangle};
use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::table::CornerTable;

/// Which way the swirl turns at a triangle; see [`Clers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Letter {
    /// The tip is new: on to the right.
    C,
    /// The left is closed: on to the right.
    L,
    /// Both sides are closed: back.
    E,
    /// The right is closed: on to the left.
    R,
    /// The tip is known, and both sides are open: right, then left.
    S,
}

/// What lies to one side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// A triangle that was not visited, by the corner that faces the edge between.
    Open(Corner),
    /// A triangle that was visited.
    Visited(Corner),
    /// Nothing: the edge has one triangle.
    Border,
    /// The surface is cut: the edge has three triangles or more.
    Cut,
    /// Nothing: the triangle is degenerate.
    Degenerate,
}

/// What the vertex of the corner that a triangle was entered by is to the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tip {
    /// In no triangle visited so far.
    New,
    /// Met before.
    Visited,
    /// On a border or cut of its fan, and so known from the start; met for the first time.
    Border,
}

/// Where the walk came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entered {
    /// The first triangle.
    Start,
    /// From this triangle, to its right.
    Right(Triangle),
    /// From this triangle, to its left.
    Left(Triangle),
    /// Back at the first triangle, across the corner asked for.
    Across(Triangle),
}

/// One triangle of the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The corner that faces the edge by which its triangle was entered.
    pub corner: Corner,
    /// The letter.
    pub letter: Letter,
    /// `c.v`.
    pub tip: Tip,
    /// `c.r`.
    pub right: Side,
    /// `c.l`.
    pub left: Side,
    /// Where the walk came from.
    pub entered: Entered,
}

/// What the walk meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walked {
    /// A triangle, for the first time.
    Triangle(Step),
    /// The left of this fork, which was visited meanwhile.
    Joined(Corner),
}

/// The least budget in bytes with which [`Clers::new`] is not refused.
pub fn least_swirl_memory(table: &CornerTable) -> u64 {
    Bits::bytes(table.triangle_count()) + Bits::bytes(table.vertex_count()) + stack::LEAST
}

/// Iterator over the triangles of a corner's component in swirl order, each with its letter.
///
/// It ends after an error ([`Error::Input`] for a damaged folder, [`Error::Io`],
/// [`Error::DiskLimit`]).
///
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # by_hand::tetrahedron().write(&folder);
/// # let ws = by_hand::workspace(dir.path(), 1 << 20);
/// use cornermill::walk::{Clers, Walked};
/// use cornermill::{CornerTable, folder::Folder};
///
/// // ws: a Workspace of 1 MiB; folder: the mesh folder of a tetrahedron
/// let folder = Folder::open(&folder, &ws.io)?;
/// let table = CornerTable::from_folder(&folder)?;
/// let c = table.corner(0).expect("the table has a corner");
/// let mut letters = String::new();
/// for walked in Clers::new(&ws, &folder, &table, c)? {
///     if let Walked::Triangle(step) = walked? {
///         letters += &format!("{:?}", step.letter);
///     }
/// }
/// assert_eq!(letters, "CCRE");
/// # Ok::<(), cornermill::Error>(())
/// ```
pub struct Clers<'a> {
    surface: Surface<'a>,
    cuts: Cuts,
    triangles: Bits,
    vertices: Bits,
    /// Forks whose left is to come.
    forks: Stack<'a>,
    next: Option<(Corner, Entered)>,
    /// The corner asked for, until the walk comes back to it.
    first: Option<Corner>,
    done: bool,
}

impl<'a> Clers<'a> {
    /// A walk from corner c, as [`CornerTable::swirl`] goes.
    ///
    /// # Errors
    /// [`Error::Usage`] for a corner that the table does not have; [`Error::Budget`] when a bit a
    /// triangle, one a vertex and 4 KiB do not fit; [`Error::Input`] when the folder is damaged.
    pub fn new(
        ws: &'a Workspace,
        folder: &'a Folder,
        table: &'a CornerTable,
        c: Corner,
    ) -> Result<Clers<'a>> {
        let surface = Surface { folder, table };
        let c = surface.own(c)?;
        let least = least_swirl_memory(table);
        if least > ws.budget.free() {
            return Err(Error::Budget {
                what: "a swirl: a bit for each triangle and each vertex, and a stack".into(),
                need: ws.budget.used() + least,
                have: ws.budget.limit(),
            });
        }
        let mut vertices = Bits::new(&ws.budget, "visited vertices", table.vertex_count())?;
        for end in [c.n(), c.p()] {
            vertices.insert(surface.vertex(end)?.id());
        }
        Ok(Clers {
            surface,
            cuts: Cuts::open(&surface)?,
            triangles: Bits::new(&ws.budget, "visited triangles", table.triangle_count())?,
            vertices,
            forks: Stack::new(ws, "the forks of a swirl")?,
            next: Some((c, Entered::Start)),
            first: Some(c),
            done: false,
        })
    }

    fn walk(&mut self) -> Result<Option<Walked>> {
        if let Some((c, entered)) = self.next.take() {
            return self.visit(c, entered).map(Some);
        }
        if let Some(fork) = self.forks.pop()?.map(Corner::new) {
            return match self.side(fork.p())? {
                Side::Open(left) => self.visit(left, Entered::Left(fork.t())).map(Some),
                _ => Ok(Some(Walked::Joined(fork))),
            };
        }
        let Some(first) = self.first.take() else {
            return Ok(None);
        };
        match self.side(first)? {
            Side::Open(across) => self.visit(across, Entered::Across(first.t())).map(Some),
            _ => Ok(None),
        }
    }

    /// Visits the triangle of c, and decides where to go on.
    fn visit(&mut self, c: Corner, entered: Entered) -> Result<Walked> {
        self.triangles.insert(c.t().id());
        let (right, left, tip) = (self.side(c.n())?, self.side(c.p())?, self.tip(c)?);
        let on_right = |to| Some((to, Entered::Right(c.t())));
        let letter = match (right, left) {
            (Side::Open(to), Side::Open(_)) => {
                self.next = on_right(to);
                if tip == Tip::New {
                    Letter::C
                } else {
                    self.forks.push(c.id())?;
                    Letter::S
                }
            }
            (Side::Open(to), _) => {
                self.next = on_right(to);
                Letter::L
            }
            (_, Side::Open(to)) => {
                self.next = Some((to, Entered::Left(c.t())));
                Letter::R
            }
            _ => Letter::E,
        };
        Ok(Walked::Triangle(Step {
            corner: c,
            letter,
            tip,
            right,
            left,
            entered,
        }))
    }

    /// What lies across the edge that c faces.
    fn side(&self, c: Corner) -> Result<Side> {
        Ok(match self.surface.across(c)? {
            Some(o) if self.triangles.has(o.t().id()) => Side::Visited(o),
            Some(o) => Side::Open(o),
            None => self.cuts.why(&self.surface, c)?,
        })
    }

    /// Looks at the vertex of c, which is known from then on.
    fn tip(&mut self, c: Corner) -> Result<Tip> {
        if !self.vertices.insert(self.surface.vertex(c)?.id()) {
            return Ok(Tip::Visited);
        }
        // A fan is open when at its first corner one of the two edges at the vertex leads nowhere.
        let open = self.surface.table.fan(c).next().is_some_and(|first| {
            [first.n(), first.p()]
                .iter()
                .any(|&side| self.surface.table.o(side).is_none())
        });
        Ok(if open { Tip::Border } else { Tip::New })
    }
}

impl Iterator for Clers<'_> {
    type Item = Result<Walked>;

    fn next(&mut self) -> Option<Result<Walked>> {
        if self.done {
            return None;
        }
        let walked = self.walk().transpose();
        self.done = !matches!(walked, Some(Ok(_)));
        walked
    }
}

impl std::iter::FusedIterator for Clers<'_> {}
