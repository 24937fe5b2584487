//! Streams test meshes of any size, and states exactly what they hold.
//!
//! Every kind of mesh is a pair of closed forms, `triangle(t)` and `position(v)`, that can be asked in
//! any order; everything else is index arithmetic around them:
//!
//! ```text
//!  kind (sphere, torus, ...)      closed forms and closed-form counts
//!    -> Defects                   a known number of faults, at sites far from each other
//!    -> View                      order of triangles, vertex ids, flips: keyed bijections
//!    -> write                     fixed-width records, so any thread can write any block
//! ```
//!
//! Nothing is kept per triangle or per vertex. Memory is one buffer of [`write::BLOCK`] bytes a thread
//! and some kilobytes of tables, whatever the size of the mesh; I/O is one write of the output.
//!
//! ```text
//! data-gen sphere -o sphere.npy --triangles 32M --shuffle --flip 0.3
//! data-gen torus -o torus.ply --size 300x900 --defects --seed 7
//! ```
//!
//! Beside OUT it writes `OUT.json`: the counts of [`Truth`], and what was asked for. They are exact for
//! every order, flips and faults included. Orders and flips change no count but `flipped` and
//! `inconsistent_edges`, and those two are counted over the closed-form neighbours while the triangles
//! are written.
//!
//! **Welding.** A STL file has no vertex ids, so the counts beside it are those after welding by exact
//! position: they differ from those of the mesh only in that unreferenced vertices do not exist. That
//! holds because positions of referenced vertices stay distinct when rounded to f4, up to the sizes in
//! each kind's [`Mesh::survives_welding`] (spheres: below 2^20 segments an edge, or 8.8e12 triangles);
//! beyond them, and for the Klein bottle, which meets itself, STL is refused. For the other formats
//! `welded_vertices` is the number of vertices after welding, null when that is not known.
//!
//! This crate is the oracle of Cornermill's tests and shares no code with it.

pub mod args;
pub mod blobs;
pub mod defects;
pub mod grid;
pub mod hash;
pub mod kinds;
pub mod loose;
pub mod mesh;
pub mod noise;
pub mod sphere;
pub mod truth;
pub mod turned;
pub mod view;
pub mod write;

pub use args::Args;
pub use mesh::{Link, Mesh};
pub use truth::Truth;
pub use view::View;

use std::fmt;
use std::path::{Path, PathBuf};

/// What can go wrong: an impossible request, or the disk.
#[derive(Debug)]
pub enum Error {
    /// The request cannot be met; the text says why, and what would do.
    Usage(String),
    /// Reading or writing this file failed.
    Io(PathBuf, std::io::Error),
}

impl Error {
    /// Attaches the file to an I/O error.
    pub fn io(path: &Path) -> impl Fn(std::io::Error) -> Error + '_ {
        |error| Error::Io(path.to_path_buf(), error)
    }

    /// The exit code: 2 for a wrong request, 4 for I/O.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Io(..) => 4,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Usage(text) => f.write_str(text),
            Error::Io(path, error) => write!(f, "{}: {error}", path.display()),
        }
    }
}

impl std::error::Error for Error {}
