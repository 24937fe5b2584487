//! `manifest.json`: what the folder holds, by what conventions, and what was found.
//!
//! It names no time, path, memory or thread count, so that equal input and options give equal
//! bytes. Its own checksum is the xxh3 (64 bits) of its text with `checksum` left empty.
//!
//! Memory: the text (O(files + blocks of 64 MiB)). I/O: the text.

use crate::disk::fs;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// What `manifest.json` says the folder is.
pub const FORMAT: &str = "cornermill mesh folder";
/// The version of the folder format that this program writes.
pub const VERSION: u32 = 1;
/// The longest manifest that is read: room for the checksums of 64 TiB.
pub(super) const MAX_BYTES: u64 = 64 << 20;

/// How triangles are oriented.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orient {
    /// Orientable watertight components outward by signed volume, the rest by majority.
    #[default]
    Outward,
    /// Each orientable component as most of its triangles were; a tie goes to the first.
    Majority,
    /// Each orientable component as its first triangle was.
    First,
    /// As the input had them; nothing is flipped.
    Keep,
}

/// The options that shape the output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Options {
    /// `--orient`.
    pub orient: Orient,
    /// True when vertices were welded by position.
    pub weld: bool,
}

/// The numbers of the whole mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// T.
    pub triangles: u64,
    /// N: rows of G, or the number of ids for a mesh given as V alone.
    pub vertices: u64,
    /// Vertices that no triangle names.
    pub unreferenced_vertices: u64,
    /// Vertices with a coordinate that is not finite.
    pub nonfinite_vertices: u64,
    /// Triangles with a repeated vertex.
    pub degenerate: u64,
    /// Unordered vertex pairs that some corner faces.
    pub distinct_edges: u64,
    /// Edges with exactly two incident corners.
    pub regular_edges: u64,
    /// Edges with one.
    pub border_edges: u64,
    /// Edges with three or more.
    pub nonmanifold_edges: u64,
    /// Corners on those.
    pub nonmanifold_corners: u64,
    /// Regular edges whose two triangles disagreed in the input.
    pub inconsistent_edges: u64,
    /// Components: triangles joined across regular edges.
    pub components: u64,
    /// Components when non-manifold edges join too.
    pub components_joined: u64,
    /// Components that cannot be oriented.
    pub nonorientable_components: u64,
    /// Components in which every corner has an opposite.
    pub closed_components: u64,
    /// Components that are watertight.
    pub watertight_components: u64,
    /// Triangles whose orientation differs from the input.
    pub flipped_triangles: u64,
    /// Components flipped as a whole.
    pub flipped_components: u64,
    /// Faces of the input with more than three corners, cut into fans.
    pub polygons_fanned: u64,
}

/// What the vertices of the whole mesh tell; `--no-measures` leaves it out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Measures {
    /// Fans: maximal sets of corners at one vertex that hang together over regular edges.
    pub fans: u64,
    /// Loops of the corners that have no opposite.
    pub border_loops: u64,
    /// Euler characteristic of the surface as O has it: fans - edges + triangles.
    pub euler: i64,
    /// Vertices with more than one fan.
    pub nonmanifold_vertices: u64,
    /// Non-degenerate triangles with the same three vertices as an earlier one.
    pub duplicate: u64,
    /// Components when triangles that share a vertex are joined.
    pub components_joined_at_vertices: u64,
    /// Components that are simple meshes: closed, orientable, manifold, with T = 2V - 4.
    pub smesh_components: u64,
    /// The largest valence of a vertex.
    pub largest_valence: u64,
    /// Vertices by valence, ascending; classes without vertices are left out.
    pub valences: Vec<ValenceClass>,
}

/// Vertices of valence `from` to `to`. The valence of a vertex is the number of non-degenerate
/// triangles that have it. Each valence below 64 is a class, then each power of two begins one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ValenceClass {
    /// Least valence.
    pub from: u64,
    /// Greatest valence.
    pub to: u64,
    /// Vertices.
    pub vertices: u64,
}

/// Digest of one file of the input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputDigest {
    /// Its length in bytes.
    pub bytes: u64,
    /// xxh3 (64 bits, hexadecimal) over the little-endian xxh3 of each 64 MiB of it.
    pub xxh3: String,
}

/// What the input was.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputEntry {
    /// Its format: "ply", "stl", "obj", "off", "npy" or "raw".
    pub format: String,
    /// Its files, in order: the mesh, then the positions when they are a file of their own.
    pub files: Vec<InputDigest>,
}

/// One array of the folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileEntry {
    /// File name in the folder.
    pub name: String,
    /// NumPy type.
    pub dtype: String,
    /// Shape.
    pub shape: Vec<u64>,
    /// Length of the file in bytes, header included.
    pub bytes: u64,
    /// xxh3 (64 bits, hexadecimal) of every 64 MiB of the file, header included.
    pub blocks: Vec<String>,
}

/// The whole manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// The conventions in words, for a reader who has only the folder.
    pub conventions: Vec<String>,
    /// Index type: "u4" or "u8".
    pub index: String,
    /// Coordinate type: "f4" or "f8"; null without G.
    pub coords: Option<String>,
    /// The options that shape the output.
    pub options: Options,
    /// What was found.
    pub counts: Counts,
    /// What the vertices tell; null under `--no-measures`.
    pub measures: Option<Measures>,
    /// Digest of the input's bytes.
    pub input: InputEntry,
    /// The arrays.
    pub files: Vec<FileEntry>,
    /// xxh3 (64 bits, hexadecimal) of this text with this field empty.
    pub checksum: String,
}

/// What is read before anything else, and says whether the rest can be.
#[derive(Deserialize)]
struct Versioned {
    version: u64,
}

impl Manifest {
    /// The conventions in words.
    pub fn conventions() -> Vec<String> {
        [
            "corner c = 3t + k is corner k of triangle t; next n and previous p go round the triangle",
            "corner c faces the edge {V[n(c)], V[p(c)]}; O[c] is the corner that faces it from the other side",
            "NONE is the all-ones value: no opposite (border, non-manifold cut, degenerate), no component (degenerate)",
            "outward is counterclockwise seen from outside: the sum of (PA x PB).PC is positive",
        ]
        .map(String::from)
        .to_vec()
    }

    /// The text of the file, checksum filled in.
    pub fn to_text(&self) -> String {
        let mut sealed = self.clone();
        sealed.checksum = format!("{:016x}", self.sum());
        sealed.text()
    }

    fn sum(&self) -> u64 {
        let mut open = self.clone();
        open.checksum.clear();
        xxh3_64(open.text().as_bytes())
    }

    fn text(&self) -> String {
        // A struct of strings and numbers always serialises.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Reads and checks the manifest of a folder.
    ///
    /// # Errors
    /// [`Error::Input`] when it is missing, damaged or of another version.
    pub fn read(folder: &Path) -> Result<Manifest> {
        let path = folder.join(super::MANIFEST);
        let bad = |expected: &str, found: String, help: &str| {
            Err(Error::input(&path, "", expected, found, help))
        };
        let meta = match fs::metadata(&path) {
            Ok(meta) => meta,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return bad(
                    "the manifest of a finished mesh folder",
                    "no such file".into(),
                    "the folder is unfinished or no mesh folder; run `cornermill build` first",
                );
            }
            Err(e) if e.kind() == std::io::ErrorKind::NotADirectory => {
                return Err(Error::input(
                    folder,
                    "",
                    "a mesh folder",
                    "a file",
                    "`cornermill build` makes one of a mesh, `cornermill decode` of a .cmz file",
                ));
            }
            Err(e) => return Err(Error::io(&path, "read it", e)),
        };
        if !meta.is_file() {
            // Reading a pipe would wait for its writer.
            let found = if meta.is_dir() {
                "a folder"
            } else {
                "a pipe or device"
            };
            return bad("a regular file", found.into(), "the folder is none of ours");
        }
        if meta.len() > MAX_BYTES {
            return bad("at most 64 MiB", format!("{} bytes", meta.len()), "");
        }
        let text = fs::read_up_to(&path, MAX_BYTES).map_err(|e| Error::io(&path, "read it", e))?;
        let rebuild = "the folder is damaged or of a newer version; build it again, \
                       or use the program that wrote it";
        let versioned = serde_json::from_slice::<Versioned>(&text).ok();
        if let Some(Versioned { version }) = versioned
            && version > u64::from(VERSION)
        {
            let found = format!("version {version}");
            return bad(
                &format!("format version {VERSION} or older"),
                found,
                rebuild,
            );
        }
        let manifest: Manifest = match serde_json::from_slice(&text) {
            Ok(manifest) => manifest,
            Err(e) => return bad("the keys of a manifest", e.to_string(), rebuild),
        };
        if manifest.format != FORMAT {
            return bad(FORMAT, manifest.format.clone(), rebuild);
        }
        if manifest.to_text().as_bytes() != text {
            let found = format!("{} or another spelling", manifest.checksum);
            return bad("a text that agrees with its checksum", found, rebuild);
        }
        Ok(manifest)
    }
}
