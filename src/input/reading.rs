//! A mesh on its way from the file to V and G: what was read, and how far it is welded.
//!
//! Why a value: reading and the passes of a weld are long, so a build that is to be gone on with
//! writes this one down between them.
//!
//! Memory: see [`weld`]. I/O: none but what is asked for.

use super::stl::{self, Facets};
use super::weld::{self, Next, Welding};
use super::{Mesh, Request, Source};
use crate::disk::Workspace;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::folder::InputEntry;
use std::time::Instant;

/// The steps behind which a mesh can be gone on with, before it is opened.
pub const STEPS: [&str; 6] = [
    FACETS,
    DECODED,
    weld::STEPS[0],
    weld::STEPS[1],
    weld::STEPS[2],
    WELDED,
];
const FACETS: &str = "some facets";
const DECODED: &str = "read";
const WELDED: &str = "weld";

/// A mesh on its way.
#[derive(Debug)]
pub enum Reading {
    /// It is a file of facets, some of which were read.
    Facets(Facets),
    /// It was read, and is to be welded.
    Unwelded(Mesh),
    /// It is being welded.
    Welding(Welding, Read),
    /// It is as it shall be.
    Done(Mesh),
}

/// What is known of the mesh besides while it is being welded.
#[derive(Debug)]
pub struct Read {
    /// Format, and the digests of the files.
    pub entry: InputEntry,
    /// Faces with more than three corners that were cut into fans.
    pub polygons_fanned: u64,
    /// Number of vertices before, where they had ids.
    pub vertices: Option<u64>,
}

impl Reading {
    /// The one of [`STEPS`] behind which it is.
    pub fn step(&self) -> &'static str {
        match self {
            Reading::Facets(_) => FACETS,
            Reading::Unwelded(_) => DECODED,
            Reading::Welding(weld, _) => weld.step(),
            Reading::Done(mesh) if mesh.welded => WELDED,
            Reading::Done(_) => DECODED,
        }
    }

    /// True as long as the mesh, or a part of it, is still to be read from the user's files.
    pub fn lies_in_input(&self) -> bool {
        match self {
            Reading::Facets(_) => true,
            Reading::Unwelded(mesh) | Reading::Done(mesh) => {
                matches!(mesh.v.source, Source::Named(_))
            }
            Reading::Welding(..) => false,
        }
    }

    /// Runs the next pass; one that can stop in between does, once `until` is past.
    ///
    /// # Errors
    /// [`Error::Usage`] for a mesh without coordinates; as the passes of the weld.
    pub fn on(self, ws: &Workspace, request: &Request, until: Option<Instant>) -> Result<Reading> {
        match self {
            Reading::Facets(mut facets) => Ok(match facets.some(ws, &request.path, until)? {
                true => {
                    let (digest, weld) = facets.end()?;
                    stl::welding(digest, weld)
                }
                false => Reading::Facets(facets),
            }),
            Reading::Unwelded(mesh) => begin(ws, mesh, request),
            Reading::Welding(weld, read) => Ok(match weld.on(ws, request)? {
                Next::Going(weld) => Reading::Welding(weld, read),
                Next::Done((v, g)) => {
                    if let Some(before) = read.vertices {
                        ws.progress.note(&format!(
                            "welded: {} vertices of {before} are left; those that no triangle \
                             names are not among them",
                            g.vertices
                        ));
                    }
                    Reading::Done(Mesh {
                        v,
                        vertices: Some(g.vertices),
                        g: Some(g),
                        polygons_fanned: read.polygons_fanned,
                        welded: true,
                        entry: read.entry,
                        sums: Vec::new(),
                    })
                }
            }),
            Reading::Done(mesh) => Ok(Reading::Done(mesh)),
        }
    }

    /// Runs all passes that are left.
    ///
    /// # Errors
    /// As [`on`](Reading::on).
    pub fn finish(mut self, ws: &Workspace, request: &Request) -> Result<Mesh> {
        loop {
            self = match self.on(ws, request, None)? {
                Reading::Done(mesh) => return Ok(mesh),
                reading => reading,
            };
        }
    }
}

/// Begins to weld a mesh that has coordinates.
fn begin(ws: &Workspace, mesh: Mesh, request: &Request) -> Result<Reading> {
    let Some(g) = mesh.g else {
        return Err(Error::Usage(
            "--weld joins vertices at equal positions, but this mesh has no coordinates; give \
             them with --positions, or leave --weld out"
                .into(),
        ));
    };
    let read = Read {
        entry: mesh.entry,
        polygons_fanned: mesh.polygons_fanned,
        vertices: Some(g.vertices),
    };
    Ok(Reading::Welding(
        weld::begin(ws, request, (mesh.v, g))?,
        read,
    ))
}

impl Keep for Reading {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        match self {
            Reading::Unwelded(mesh) => {
                to.number(0)?;
                mesh.keep(to)
            }
            Reading::Done(mesh) => {
                to.number(1)?;
                mesh.keep(to)
            }
            Reading::Facets(facets) => {
                to.number(3)?;
                facets.keep(to)
            }
            Reading::Welding(weld, read) => {
                to.number(2)?;
                weld.keep(to)?;
                read.entry.keep(to)?;
                to.number(read.polygons_fanned)?;
                // One more than the number, or none.
                to.number(read.vertices.map_or(0, |n| n + 1))
            }
        }
    }

    fn restore(from: &mut Reader) -> Result<Reading> {
        Ok(match from.number()? {
            0 => Reading::Unwelded(Mesh::restore(from)?),
            1 => Reading::Done(Mesh::restore(from)?),
            3 => Reading::Facets(Facets::restore(from)?),
            _ => Reading::Welding(
                Welding::restore(from)?,
                Read {
                    entry: InputEntry::restore(from)?,
                    polygons_fanned: from.number()?,
                    vertices: from.number()?.checked_sub(1),
                },
            ),
        })
    }
}
