//! Formats to V and G: PLY, STL, OBJ, OFF, `.npy` and raw arrays; welding.
//!
//! Two ways in. Arrays ([`arrays`]) are used where they lie: the build reads their
//! triangles straight from the user's file. Everything else is decoded in one streaming pass:
//! indices go to a scratch file, coordinates to the file that becomes the folder's `G.npy`.
//! Indices of decoded formats are checked against the number of vertices when both are known,
//! at the end (elements come in any order); those of arrays by the build's scan.
//!
//! Memory: fixed buffers, whatever the file claims. I/O: the input once; V and G written once.

pub mod arrays;
mod cut;
mod extent;
mod keep;
mod lines;
mod look;
mod number;
mod obj;
mod off;
mod open;
mod ply;
mod polygons;
pub mod reader;
mod reading;
mod rounded;
mod sample;
pub mod sink;
mod stl;
mod survey;
#[cfg(test)]
pub(crate) mod testing;
pub mod text;
mod weld;

pub use look::Look;
pub use open::{open, read};
pub use reading::{Reading, STEPS};
pub use survey::{Survey, closed_vertices, survey};
pub use weld::{WeldCost, WeldSize};

use crate::disk::{DataFile, ScratchFile, Workspace};
use crate::error::Result;
use crate::folder::{InputEntry, WarmSums, digest_warm};
use std::path::PathBuf;

/// Type of an index in an array on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexKind {
    /// Unsigned, 4 bytes.
    U4,
    /// Unsigned, 8 bytes.
    U8,
    /// Signed, 4 bytes; negative values are errors.
    I4,
    /// Signed, 8 bytes; negative values are errors.
    I8,
}

/// Type of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordKind {
    /// IEEE 754, 4 bytes.
    F4,
    /// IEEE 754, 8 bytes.
    F8,
}

/// Byte order of an array on disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Endian {
    /// Least significant byte first.
    #[default]
    Little,
    /// Most significant byte first.
    Big,
}

/// A file of the user's, or one of ours.
#[derive(Debug)]
pub enum Source {
    /// A named file, left as it is.
    Named(DataFile),
    /// A scratch file, gone when dropped.
    Scratch(ScratchFile),
}

impl Source {
    /// The file itself.
    pub fn data(&self) -> &DataFile {
        match self {
            Source::Named(file) => file,
            Source::Scratch(file) => file.data(),
        }
    }
}

/// Where the vertex of each corner lies: (T,3), row by row.
#[derive(Debug)]
pub struct IndexArray {
    /// The file.
    pub source: Source,
    /// Byte where the data begins.
    pub at: u64,
    /// Type of an index.
    pub kind: IndexKind,
    /// Byte order.
    pub endian: Endian,
    /// T.
    pub triangles: u64,
}

/// Where the coordinates lie: (N,3), row by row.
#[derive(Debug)]
pub struct CoordArray {
    /// The file.
    pub source: Source,
    /// Byte where the data begins.
    pub at: u64,
    /// Type of a coordinate.
    pub kind: CoordKind,
    /// Byte order.
    pub endian: Endian,
    /// N.
    pub vertices: u64,
    /// True when the file is the new folder's `G.npy` itself (little-endian, data from byte
    /// 4096, header still to be written), so that nothing needs to be copied.
    pub placed: bool,
}

/// A mesh ready to be built: V, and G when the input has coordinates.
#[derive(Debug)]
pub struct Mesh {
    /// The indices.
    pub v: IndexArray,
    /// The coordinates.
    pub g: Option<CoordArray>,
    /// Number of vertices when the user or the file states it apart from G.
    pub vertices: Option<u64>,
    /// Faces with more than three corners that were cut into fans.
    pub polygons_fanned: u64,
    /// True when vertices were welded by position.
    pub welded: bool,
    /// Format, and the digests of the files but for those in `sums`.
    pub entry: InputEntry,
    /// For arrays that are used where they lie: the sums of V's file, and of G's, which the
    /// passes complete as they read.
    pub sums: Vec<WarmSums>,
}

impl Mesh {
    /// Format and digests, for the manifest; reads what no pass has read.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`].
    pub fn input_entry(&self, ws: &Workspace) -> Result<InputEntry> {
        let mut entry = self.entry.clone();
        let sources = [Some(&self.v.source), self.g.as_ref().map(|g| &g.source)];
        for (source, sums) in sources.into_iter().flatten().zip(&self.sums) {
            entry.files.push(digest_warm(ws, source.data(), sums)?);
        }
        Ok(entry)
    }
}

/// Which format the input is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stanford PLY.
    Ply,
    /// STL, binary or ascii.
    Stl,
    /// Wavefront OBJ.
    Obj,
    /// Object File Format.
    Off,
    /// NumPy arrays.
    Npy,
    /// Plain arrays without header.
    Raw,
}

impl Format {
    /// Its name, as the manifest has it.
    pub const fn name(self) -> &'static str {
        match self {
            Format::Ply => "ply",
            Format::Stl => "stl",
            Format::Obj => "obj",
            Format::Off => "off",
            Format::Npy => "npy",
            Format::Raw => "raw",
        }
    }
}

/// What the user asked to read, and how.
#[derive(Clone, Debug)]
pub struct Request {
    /// The mesh file; `-` is standard input.
    pub path: PathBuf,
    /// File of coordinates beside an `.npy` or raw V.
    pub positions: Option<PathBuf>,
    /// `--weld` (true), `--no-weld` (false), or neither.
    pub weld: Option<bool>,
    /// `--coords`: type of coordinates to store; by default as the input has them, f4 for text.
    pub coords: Option<CoordKind>,
    /// Index type of a raw V; its presence makes the input raw.
    pub raw_index: Option<IndexKind>,
    /// `--endian`: byte order of raw arrays; little when nothing is said.
    pub endian: Option<Endian>,
    /// Number of vertices of a raw or `.npy` V.
    pub vertices: Option<u64>,
    /// `--format`: instead of looking at the name and the first bytes.
    pub format: Option<Format>,
    /// True when indices are to be stored as 8 bytes whatever the counts.
    pub wide: bool,
    /// Where decoded coordinates go: the new folder's `G.npy`. Data starts at byte 4096.
    pub g_path: PathBuf,
}
