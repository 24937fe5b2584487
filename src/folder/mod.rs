//! The mesh folder `NAME.ct/`: names, types, versions, manifest, checksums.
//!
//! Every array is a plain little-endian `.npy` file (version 1.0 header, data from byte
//! [`npy::DATA_START`]) that NumPy, Rust and C++ map with no copy. `manifest.json` is written
//! last: a folder without it is unfinished. Opening costs O(1): it reads the manifest and
//! holds each file's header and length to it; the full check is [`crate::verify`].
//!
//! Memory: the manifest. I/O: the manifest and 4 KiB of each file.

pub mod npy;

mod manifest;
mod outputs;
mod replace;
mod rows;
mod seal;
mod warm;

pub use manifest::{
    Counts, FORMAT, FileEntry, InputDigest, InputEntry, Manifest, Measures, Options, Orient,
    VERSION, ValenceClass,
};
pub use outputs::Outputs;
pub use replace::{is_mesh_folder, not_replaceable};
pub use rows::{
    COMPONENT_DESCR, ComponentMeasures, ComponentRow, MEASURED_DESCR, Row, Rows, row_type,
};
pub use seal::{
    BLOCK, block_sums, checksum_bytes, digest_file, digest_of_blocks, digest_warm, warm_sums,
};
pub use warm::{WarmSums, sum_bytes};

use crate::disk::{Counters, DataFile, fs};
use crate::error::{Error, Result};
use bytemuck::{Pod, Zeroable};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Vertex of each corner, (T,3).
pub const V: &str = "V.npy";
/// Opposite of each corner or NONE, (T,3).
pub const O: &str = "O.npy";
/// Vertex coordinates, (N,3); absent for a mesh given as V alone.
pub const G: &str = "G.npy";
/// Component of each triangle or NONE, (T,).
pub const COMPONENT: &str = "component.npy";
/// Packed bits, little bit order: triangles whose orientation differs from the input.
pub const FLIPPED: &str = "flipped.npy";
/// The table of components.
pub const COMPONENTS: &str = "components.npy";
/// The non-manifold edges, sorted by (lo, hi).
pub const NONMANIFOLD_EDGES: &str = "nonmanifold_edges.npy";
/// The corners of the non-manifold edges, in the order of the edges, ascending within one.
pub const NONMANIFOLD_CORNERS: &str = "nonmanifold_corners.npy";
/// Vertices with more than one fan, ascending; in measured folders.
pub const NONMANIFOLD_VERTICES: &str = "nonmanifold_vertices.npy";
/// Triangles with the same three vertices as an earlier one, ascending; in measured folders.
pub const DUPLICATE: &str = "duplicate.npy";
/// Triangles with a repeated vertex, ascending.
pub const DEGENERATE: &str = "degenerate.npy";
/// Ids of the triangles in the folder that this one was filtered from.
pub const MAP_TRIANGLE: &str = "map_triangle.npy";
/// Ids of the vertices in the folder that this one was filtered from.
pub const MAP_VERTEX: &str = "map_vertex.npy";
/// What the folder holds and what was found; written last.
pub const MANIFEST: &str = "manifest.json";

/// True when indices of 4 bytes number the mesh: 3T and N stay below NONE, which is all ones.
pub fn fits_u4(triangles: u64, vertices: u64) -> bool {
    let none = u64::from(u32::MAX);
    triangles <= (none - 1) / 3 && vertices < none
}

/// A row of `nonmanifold_edges.npy`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct EdgeRow {
    /// Smaller vertex.
    pub lo: u64,
    /// Larger vertex.
    pub hi: u64,
    /// Number of corners that face the edge (3 or more).
    pub corners: u64,
    /// The smallest of them.
    pub first_corner: u64,
}

/// NumPy's description of [`EdgeRow`].
pub const EDGE_DESCR: &str =
    "[('lo', '<u8'), ('hi', '<u8'), ('corners', '<u8'), ('first_corner', '<u8')]";

/// True for the name of a file in the folder itself.
pub fn is_plain(name: &str) -> bool {
    !matches!(name, "" | "." | "..") && !name.contains(['/', '\\', '\0'])
}

/// Opens a file of a folder that may be anybody's: what the manifest names may lie elsewhere, or
/// be a pipe, which would wait for its writer.
fn open_plain(folder: &Path, name: &str, io: &Arc<Counters>) -> Result<DataFile> {
    let bad = |path: &Path, expected: &str, found: String| {
        let help = "the folder was changed or is none of ours; build it again";
        Err(Error::input(path, "", expected, found, help))
    };
    if !is_plain(name) {
        let found = format!("the name {name:?}");
        return bad(&folder.join(MANIFEST), "plain names of files", found);
    }
    let path = folder.join(name);
    let meta = match fs::metadata(&path) {
        Err(e) if e.kind() == ErrorKind::NotFound => {
            return bad(
                &path,
                "an array that the manifest names",
                "no such file".into(),
            );
        }
        meta => meta.map_err(|e| Error::io(&path, "ask what kind of file it is", e))?,
    };
    if !meta.is_file() {
        let found = if meta.is_dir() {
            "a folder"
        } else {
            "a pipe or device"
        };
        return bad(&path, "a regular file", found.into());
    }
    DataFile::open(&path, io)
}

/// A finished mesh folder, opened: manifest read and held to the files' headers.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    manifest: Manifest,
    io: Arc<Counters>,
}

impl Folder {
    /// Opens a finished folder in O(1): manifest, its checksum, and each file's header,
    /// type, shape and length. Contents are not read; `verify` does that.
    ///
    /// # Errors
    /// [`Error::Input`] when something is missing, of another version or size;
    /// [`Error::Io`] when it cannot be read.
    pub fn open(path: &Path, io: &Arc<Counters>) -> Result<Folder> {
        let manifest = Manifest::read(path)?;
        for entry in &manifest.files {
            let file = open_plain(path, &entry.name, io)?;
            let len = file.len()?;
            if len != entry.bytes {
                return Err(Error::input(
                    file.path(),
                    "",
                    format!("{} bytes, as the manifest says", entry.bytes),
                    format!("{len} bytes"),
                    "the folder was changed or copied in part; build it again",
                ));
            }
            let header = npy::Header::read(&file)?;
            if header.descr != entry.dtype || header.shape != entry.shape {
                return Err(Error::input(
                    file.path(),
                    "byte 0",
                    format!("type {} and shape {:?}", entry.dtype, entry.shape),
                    format!("{} and {:?}", header.descr, header.shape),
                    "the folder was changed; build it again",
                ));
            }
        }
        Ok(Folder {
            path: path.to_owned(),
            manifest,
            io: Arc::clone(io),
        })
    }

    /// The folder's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the folder says of itself.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// True when the folder has this array.
    pub fn has(&self, name: &str) -> bool {
        self.manifest.files.iter().any(|f| f.name == name)
    }

    /// What came of reading the arrays, unless one was cut short while it was mapped.
    ///
    /// # Errors
    /// Those of [`Counters::intact`].
    pub(crate) fn intact<T>(&self, done: Result<T>) -> Result<T> {
        self.io.intact(done)
    }

    /// Opens one of the arrays for reading; data starts at byte [`npy::DATA_START`].
    ///
    /// # Errors
    /// [`Error::Input`] when the folder has no such array, [`Error::Io`].
    pub fn file(&self, name: &str) -> Result<DataFile> {
        if !self.has(name) {
            return Err(Error::input(
                &self.path,
                "",
                format!("an array {name}"),
                "none",
                "build the folder again from an input that has it",
            ));
        }
        DataFile::open(&self.path.join(name), &self.io)
    }
}
