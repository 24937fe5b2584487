//! The shortest path between two corners: fewest triangles, and among those the smallest corners.
//!
//! A *path* from corner a to corner b is a sequence of corners. Each but the last faces the edge
//! that is crossed next: the corner after it lies in the triangle of its opposite. The first is a
//! corner of the triangle of a, the last is b itself. So its corners name triangles that hang
//! together edge by edge, from that of a to that of b, and say which edges. (Of a only the
//! triangle matters: the corner that the path begins with is the one that faces the first edge.)
//! Of all paths with the fewest triangles it is the one whose sequence of corner ids is smallest,
//! compared from the first on.
//!
//! Why it is found: a breadth-first search from the triangle of b meets the triangles in levels,
//! those of level k being k edges away. Each triangle of level k + 1 has a corner that leads to
//! level k, and a path of fewest triangles goes down one level with each step. So from the
//! triangle of a, the smallest corner that leads to the level below is the first of the smallest
//! path, whatever follows, and so on from there.
//!
//! The levels stand in a [`Log`], one behind the other, each ended by NONE, written once in the
//! order of discovery. A level is complete when the one before it has been read. Going down, the
//! log is read from its end: which of at most three neighbours lie in the level below is seen by
//! passing over it. So neither distances nor predecessors are kept, and the boundaries of the
//! levels (as many as triangles, in a long strip) take no memory.
//!
//! Memory: T/8 bytes of visited bits while searching, and the log, from 8 KiB up to half of what
//! the budget has free. The budget changes no path. I/O: the pages of O around the levels; when
//! the log does not fit, at most two ids for each triangle met, written once, and read once in the
//! search and once for each time that the corners are listed.

use super::Surface;
use super::bits::Bits;
use super::log::{self, Log, Toward};
use crate::corner::{Corner, Triangle};
use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::{self, Folder};
use crate::table::{CornerTable, array::Width};

/// What ends a level in the log.
const END: u64 = u64::MAX;

/// Bytes that a [`Path`] holds at least, when it was found.
pub const LEAST_FOUND_MEMORY: u64 = log::LEAST;

/// The least budget in bytes with which [`path`] is not refused.
pub fn least_path_memory(table: &CornerTable) -> u64 {
    Bits::bytes(table.triangle_count()) + log::LEAST
}

/// What [`path`] found.
pub enum Search<'a> {
    /// The path.
    Found(Box<Path<'a>>),
    /// None: the corners lie in these components, which no edge with an opposite joins; `None`
    /// for a degenerate triangle, which lies in none.
    Apart {
        /// Component of the first corner.
        from: Option<u64>,
        /// Component of the last.
        to: Option<u64>,
    },
}

/// A shortest path: its length, and its corners as often as asked.
pub struct Path<'a> {
    surface: Surface<'a>,
    log: Log<'a>,
    from: Triangle,
    to: Corner,
    /// Levels below that of `from`: all of them complete.
    steps: u64,
    /// Where the highest of them ends: the place of its NONE.
    end: u64,
}

/// Finds the path with the fewest triangles from corner `from` to corner `to` over opposites, and
/// among those the one with the smallest corners.
///
/// Each corner of the path faces the edge that is crossed next; the last is `to`. Corners of one
/// triangle are joined by the path that consists of `to` alone.
///
/// # Errors
/// [`Error::Usage`] for a corner that the table does not have; [`Error::Budget`] when a bit a
/// triangle and 8 KiB do not fit; [`Error::Input`] when the folder is damaged; [`Error::Io`] and
/// [`Error::DiskLimit`] from scratch space.
///
/// # Example
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # by_hand::tetrahedron().write(&folder);
/// # let ws = by_hand::workspace(dir.path(), 1 << 20);
/// use cornermill::walk::{Search, path};
/// use cornermill::{CornerTable, folder::Folder};
///
/// // ws: a Workspace of 1 MiB; folder: the mesh folder of a tetrahedron
/// let folder = Folder::open(&folder, &ws.io)?;
/// let table = CornerTable::from_folder(&folder)?;
/// let [from, to] = [0, 11].map(|id| table.corner(id).expect("the table has it"));
/// let Search::Found(mut path) = path(&ws, &folder, &table, from, to)? else {
///     panic!("a tetrahedron is one component");
/// };
/// assert_eq!(path.triangles(), 2);
/// let corners = path.corners().collect::<Result<Vec<_>, _>>()?;
/// assert_eq!(table.o(corners[0]).map(|o| o.t()), Some(to.t()));
/// assert_eq!(corners[1], to);
/// # Ok::<(), cornermill::Error>(())
/// ```
pub fn path<'a>(
    ws: &'a Workspace,
    folder: &'a Folder,
    table: &'a CornerTable,
    from: Corner,
    to: Corner,
) -> Result<Search<'a>> {
    let surface = Surface { folder, table };
    let (from, to) = (surface.own(from)?, surface.own(to)?);
    let least = least_path_memory(table);
    if least > ws.budget.free() {
        return Err(Error::Budget {
            what: "a path: a bit for each triangle, and two buffers".into(),
            need: ws.budget.used() + least,
            have: ws.budget.limit(),
        });
    }
    let labels = [from, to].map(|c| table.component(c.t()));
    if from.t() != to.t() && (labels[0] != labels[1] || labels[0].is_none()) {
        let [from, to] = labels;
        return Ok(Search::Apart { from, to });
    }
    let seen = Bits::new(&ws.budget, "visited triangles", table.triangle_count())?;
    // Each triangle once, and each level's end.
    let entries = 2 * table.triangle_count() + 1;
    let log = Log::new(ws, "the levels of a path", Width::of(folder)?, entries)?;
    let mut path = Path {
        surface,
        log,
        from: from.t(),
        to,
        steps: 0,
        end: 0,
    };
    ws.progress
        .begin("path", "triangles", table.triangle_count());
    let found = path.search(ws, seen);
    table.intact()?;
    found?;
    ws.progress.end();
    Ok(Search::Found(Box::new(path)))
}

impl<'a> Path<'a> {
    /// Number of triangles, those of both ends included.
    pub fn triangles(&self) -> u64 {
        self.steps + 1
    }

    /// The corners of the path, from the first to the last.
    pub fn corners(&mut self) -> Corners<'_, 'a> {
        Corners {
            at: self.from,
            left: self.steps + 1,
            next: self.end,
            path: self,
        }
    }

    /// Fills the log with levels until `from` is met.
    fn search(&mut self, ws: &Workspace, mut seen: Bits) -> Result<()> {
        const TOLD: u64 = 1 << 16;
        if self.from == self.to.t() {
            return Ok(());
        }
        let start = self.to.t();
        seen.insert(start.id());
        self.log.push(start.id())?;
        self.log.push(END)?;
        (self.steps, self.end) = (1, 1);
        let mut read = 0;
        while read < self.log.len() {
            let id = self.log.get(read, Toward::End)?;
            read += 1;
            if read.is_multiple_of(TOLD) {
                ws.progress.advance(TOLD);
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
            }
            if id == END {
                // All of this level was read, so all of the next was found.
                if read < self.log.len() {
                    self.steps += 1;
                    self.end = self.log.len();
                    self.log.push(END)?;
                }
                continue;
            }
            for c in Triangle::new(id).corners() {
                let Some(o) = self.surface.across(c)? else {
                    continue;
                };
                if o.t() == self.from {
                    return Ok(());
                }
                if seen.insert(o.t().id()) {
                    self.log.push(o.t().id())?;
                }
            }
        }
        Err(self.surface.damaged(
            folder::COMPONENT,
            format!("triangle {}", self.from),
            "the label of triangles that opposites join to it alone",
            format!("that of triangle {start} too, which none joins to it"),
        ))
    }
}

/// Iterator over the corners of a [`Path`], from the first to the last; from [`Path::corners`].
///
/// It ends after an error.
pub struct Corners<'p, 'a> {
    path: &'p mut Path<'a>,
    at: Triangle,
    /// Corners to come.
    left: u64,
    /// The entry of the log that ends the next level down.
    next: u64,
}

impl Corners<'_, '_> {
    /// The smallest corner of this triangle that leads to the level below, and where it leads.
    fn step(&mut self) -> Result<(Corner, Triangle)> {
        let mut ways = [None; 3];
        for (way, c) in ways.iter_mut().zip(self.at.corners()) {
            *way = self.path.surface.across(c)?.map(|o| (c, o.t(), false));
        }
        while self.next > 0 {
            self.next -= 1;
            let id = self.path.log.get(self.next, Toward::Start)?;
            if id == END {
                break;
            }
            for (_, t, below) in ways.iter_mut().flatten() {
                *below |= t.id() == id;
            }
        }
        let first = ways.into_iter().flatten().find(|&(_, _, below)| below);
        first.map(|(c, t, _)| (c, t)).ok_or_else(|| {
            Error::Internal(format!(
                "triangle {} of a path has no neighbour in the level below",
                self.at
            ))
        })
    }
}

impl Iterator for Corners<'_, '_> {
    type Item = Result<Corner>;

    fn next(&mut self) -> Option<Result<Corner>> {
        self.left = self.left.checked_sub(1)?;
        if self.left == 0 {
            return Some(Ok(self.path.to));
        }
        Some(match self.step() {
            Ok((corner, beyond)) => {
                self.at = beyond;
                Ok(corner)
            }
            Err(e) => {
                self.left = 0;
                Err(e)
            }
        })
    }
}

impl std::iter::FusedIterator for Corners<'_, '_> {}
