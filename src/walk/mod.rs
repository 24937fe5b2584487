//! Walks over the triangles of a mesh folder: the shortest path between two corners, and the
//! swirl with the letters of Edgebreaker.
//!
//! Both need to know which triangles they have seen, and that is the one thing that they keep in
//! memory in proportion to the mesh: a bit a triangle (the swirl a bit a vertex besides), drawn
//! from the budget. What else may grow, frontiers and stacks, goes to scratch space when it has
//! outgrown its share.
//!
//! Memory: T/8 bytes for a [`path()`], T/8 + N/8 for [`Clers`], and buffers from 8 KiB up, all drawn
//! from the budget; a budget that is too small is refused with the least that would do. The pages
//! of V and O that a walk touches are those of the [`CornerTable`], which maps these arrays whole:
//! they are the system's to keep or drop, and draw on no budget. I/O: those pages, in the order of
//! the walk (random access, where the mesh lies in random order), and scratch as the walks say.
//!
//! Sources: J. Rossignac, "Edgebreaker: connectivity compression for triangle meshes", IEEE
//! TVCG 5 (1), 1999; J. Rossignac, A. Safonova, A. Szymczak, "3D compression made simple:
//! Edgebreaker with ZipAndWrap on a corner table", Shape Modeling International 2001.

mod bits;
mod clers;
mod cuts;
mod log;
mod path;
mod stack;

pub use clers::{Clers, Entered, Letter, Side, Step, Tip, Walked, least_swirl_memory};
pub use path::{Corners, LEAST_FOUND_MEMORY, Path, Search, least_path_memory, path};

use crate::corner::{Corner, Vertex};
use crate::error::{Error, Result};
use crate::folder::{self, Folder};
use crate::table::CornerTable;

/// Vertex of c, held to the bounds of the table: for what looks things up by it.
///
/// # Errors
/// [`Error::Input`] naming the corner.
pub fn vertex(folder: &Folder, table: &CornerTable, c: Corner) -> Result<Vertex> {
    Surface { folder, table }.vertex(c)
}

/// A folder and its table: the operators, held to what they promise.
#[derive(Clone, Copy, Debug)]
struct Surface<'a> {
    folder: &'a Folder,
    table: &'a CornerTable,
}

impl Surface<'_> {
    /// `c.o`, checked: a corner of the table whose own opposite is c. What a walk relies on is
    /// checked where it goes, so a damaged folder ends it with a name and not with a panic.
    fn across(&self, c: Corner) -> Result<Option<Corner>> {
        let Some(o) = self.table.o(c) else {
            return Ok(None);
        };
        let known = self.table.corner(o.id());
        if known.is_some_and(|o| self.table.o(o) == Some(c)) {
            return Ok(known);
        }
        Err(self.damaged(
            folder::O,
            format!("corner {c}"),
            "NONE, or a corner whose opposite is this one",
            o.to_string(),
        ))
    }

    /// `c.v`, checked.
    fn vertex(&self, c: Corner) -> Result<Vertex> {
        let v = self.table.v(c);
        self.table.vertex(v.id()).ok_or_else(|| {
            let expected = format!("a vertex below {}", self.table.vertex_count());
            self.damaged(folder::V, format!("corner {c}"), &expected, v.to_string())
        })
    }

    fn damaged(&self, name: &str, at: String, expected: &str, found: String) -> Error {
        Error::input(
            &self.folder.path().join(name),
            at,
            expected,
            found,
            "the folder is damaged; `cornermill verify` says how; build it again",
        )
    }

    /// A corner of the table, or a refusal that says which there are.
    fn own(&self, c: Corner) -> Result<Corner> {
        self.table.corner(c.id()).ok_or_else(|| {
            Error::Usage(match self.table.triangle_count() {
                0 => format!("there is no corner {c}: the mesh has no triangle"),
                t => format!(
                    "there is no corner {c}: the mesh has {t} triangles, whose corners are \
                     numbered 0 to {}",
                    3 * t - 1
                ),
            })
        })
    }
}
