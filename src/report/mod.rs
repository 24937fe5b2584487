//! What a folder and a build say of themselves, for people and for programs.
//!
//! Gathered from the manifest, from a sequential reading of `components.npy` and from the
//! first few rows of the lists of culprits; the lists themselves stay in the folder.
//!
//! Memory: 64 KiB and a few rows. I/O: `components.npy` once (not for [`info`]).

mod check;
pub mod page;
pub mod picture;
mod predict;
mod survey;
mod text;

pub use check::{Checked, Culprit, Judged, Requirement, check, render_checked};
pub use predict::{Predicted, predicted, render_predicted};
pub use text::{info, render};

use crate::build::BuildReport;
use crate::disk::DataFile;
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::folder::{self, Counts, EdgeRow, Folder, Manifest, Measures};
use bytemuck::Pod;
use serde::Serialize;

/// Culprits of each kind that a report names.
pub const NAMED: usize = 8;

/// What a build found, as `--json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this report's keys.
    pub version: u32,
    /// Index type: "u4" or "u8".
    pub index: String,
    /// Coordinate type, or null.
    pub coords: Option<String>,
    /// Format of the input.
    pub format: String,
    /// The options that shape the output.
    pub options: folder::Options,
    /// The numbers of the whole mesh.
    pub counts: Counts,
    /// What the vertices tell; null for a folder without measures.
    pub measures: Option<Measures>,
    /// The first culprits of each kind.
    pub culprits: Culprits,
    /// The largest components.
    pub largest: Vec<Component>,
    /// Components by size: powers of two.
    pub sizes: Vec<SizeClass>,
    /// The arrays and what they cost.
    pub arrays: Vec<Array>,
    /// What the build cost; null for a folder read later.
    pub build: Option<Build>,
}

/// The first few culprits; the whole lists are in the folder's files.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Culprits {
    /// From `nonmanifold_edges.npy`.
    pub nonmanifold_edges: Vec<Edge>,
    /// From `nonmanifold_vertices.npy`; empty for a folder without measures.
    pub nonmanifold_vertices: Vec<u64>,
    /// From `degenerate.npy`.
    pub degenerate: Vec<u64>,
    /// From `duplicate.npy`; empty for a folder without measures.
    pub duplicate: Vec<u64>,
    /// Components that cannot be oriented.
    pub nonorientable_components: Vec<u64>,
    /// Components that are not watertight, so that `outward` does not apply to them; empty under
    /// another `--orient`.
    pub not_watertight_components: Vec<u64>,
}

/// A non-manifold edge.
#[derive(Clone, Debug, Serialize)]
pub struct Edge {
    /// Smaller vertex.
    pub lo: u64,
    /// Larger vertex.
    pub hi: u64,
    /// Corners on it.
    pub corners: u64,
    /// The smallest of them.
    pub first_corner: u64,
}

/// A component, from `components.npy`.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Its number.
    pub component: u64,
    /// Triangles.
    pub triangles: u64,
    /// Border edges.
    pub border_edges: u64,
    /// Whether it is closed.
    pub closed: bool,
    /// Whether it can be oriented.
    pub orientable: bool,
    /// Signed volume in cubed input units; null when unknown.
    pub volume: Option<f64>,
    /// Area in squared input units; null when unknown.
    pub area: Option<f64>,
    /// What its vertices tell; null for a folder without measures.
    pub measures: Option<Measured>,
}

/// What the vertices of a component tell, from `components.npy`.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Distinct vertices.
    pub vertices: u64,
    /// Fans.
    pub fans: u64,
    /// Border loops.
    pub border_loops: u64,
    /// Euler characteristic.
    pub euler: i64,
    /// Genus.
    pub genus: u64,
    /// Whether it is a simple mesh.
    pub is_smesh: bool,
}

/// Components of `from` to `to` triangles.
#[derive(Clone, Debug, Serialize)]
pub struct SizeClass {
    /// Least number of triangles.
    pub from: u64,
    /// Greatest number of triangles.
    pub to: u64,
    /// Components.
    pub components: u64,
    /// Their triangles together.
    pub triangles: u64,
}

/// An array of the folder.
#[derive(Clone, Debug, Serialize)]
pub struct Array {
    /// File name.
    pub name: String,
    /// NumPy type.
    pub dtype: String,
    /// Shape.
    pub shape: Vec<u64>,
    /// Bytes, header included.
    pub bytes: u64,
    /// Bits of data for each triangle of the mesh; null for an empty mesh.
    pub bits_per_triangle: Option<f64>,
}

/// What a build cost.
#[derive(Clone, Debug, Serialize)]
pub struct Build {
    /// The passes in order.
    pub passes: Vec<Pass>,
    /// Seconds of all passes.
    pub seconds: f64,
    /// The most resident memory of the process in bytes, file-backed pages included; null
    /// where the system does not tell.
    pub peak_resident: Option<u64>,
    /// The most memory drawn from the budget at once, in bytes.
    pub peak_budget: u64,
    /// The most scratch space in use at once, in bytes.
    pub peak_scratch: u64,
    /// Triangles of a chunk.
    pub chunk_triangles: u64,
    /// Corners that chunks could not settle.
    pub seam_corners: u64,
    /// Local components before stitching.
    pub local_components: u64,
}

/// One pass.
#[derive(Clone, Debug, Serialize)]
pub struct Pass {
    /// Its name.
    pub name: String,
    /// Wall time.
    pub seconds: f64,
    /// Bytes read, scratch included.
    pub read: u64,
    /// Bytes written, scratch included.
    pub written: u64,
}

/// Gathers the report of a folder, and of the build that made it when that is known.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Input`] when the folder was changed.
pub fn gather(folder: &Folder, build: Option<&BuildReport>) -> Result<Report> {
    let manifest = folder.manifest();
    let mut report = Report {
        version: 1,
        index: manifest.index.clone(),
        coords: manifest.coords.clone(),
        format: manifest.input.format.clone(),
        options: manifest.options.clone(),
        counts: manifest.counts.clone(),
        measures: manifest.measures.clone(),
        culprits: Culprits {
            nonmanifold_edges: first_edges(folder)?,
            nonmanifold_vertices: first_ids(folder, folder::NONMANIFOLD_VERTICES)?,
            degenerate: first_ids(folder, folder::DEGENERATE)?,
            duplicate: first_ids(folder, folder::DUPLICATE)?,
            ..Culprits::default()
        },
        largest: Vec::new(),
        sizes: Vec::new(),
        arrays: arrays(manifest),
        build: build.map(cost),
    };
    survey::survey(folder, &mut report)?;
    Ok(report)
}

/// The arrays of a folder with their cost.
pub fn arrays(manifest: &Manifest) -> Vec<Array> {
    array_rows(&manifest.files, manifest.counts.triangles)
}

fn array_rows(files: &[folder::FileEntry], t: u64) -> Vec<Array> {
    let each = |f: &folder::FileEntry| Array {
        name: f.name.clone(),
        dtype: f.dtype.clone(),
        shape: f.shape.clone(),
        bytes: f.bytes,
        bits_per_triangle: (t > 0).then(|| (f.bytes - DATA_START) as f64 * 8.0 / t as f64),
    };
    files.iter().map(each).collect()
}

fn cost(build: &BuildReport) -> Build {
    let passes: Vec<Pass> = build
        .passes
        .iter()
        .map(|p| Pass {
            name: p.name.to_owned(),
            seconds: p.seconds,
            read: p.io.read,
            written: p.io.written,
        })
        .collect();
    Build {
        seconds: passes.iter().map(|p| p.seconds).sum(),
        passes,
        peak_resident: peak_resident(),
        peak_budget: build.peak_budget,
        peak_scratch: build.peak_scratch,
        chunk_triangles: build.chunk_triangles,
        seam_corners: build.seam_corners,
        local_components: build.local_components,
    }
}

/// The most resident memory that this process ever had, in bytes, as the system tells it.
fn peak_resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib << 10)
}

/// Rows of an array, `count` at most, from row `from`.
fn rows<T: Pod>(file: &DataFile, from: u64, count: u64) -> Result<Vec<T>> {
    let mut rows = vec![T::zeroed(); count as usize];
    let at = DATA_START + from * size_of::<T>() as u64;
    file.read_at(bytemuck::cast_slice_mut(&mut rows), at)?;
    Ok(rows)
}

fn length(folder: &Folder, name: &str) -> u64 {
    let entry = folder.manifest().files.iter().find(|f| f.name == name);
    entry.and_then(|f| f.shape.first().copied()).unwrap_or(0)
}

fn first_edges(folder: &Folder) -> Result<Vec<Edge>> {
    let count = length(folder, folder::NONMANIFOLD_EDGES).min(NAMED as u64);
    let file = folder.file(folder::NONMANIFOLD_EDGES)?;
    let edge = |r: &EdgeRow| Edge {
        lo: r.lo,
        hi: r.hi,
        corners: r.corners,
        first_corner: r.first_corner,
    };
    Ok(rows::<EdgeRow>(&file, 0, count)?.iter().map(edge).collect())
}

/// The first rows of a list of ids; none when the folder has no such list.
fn first_ids(folder: &Folder, name: &str) -> Result<Vec<u64>> {
    if !folder.has(name) {
        return Ok(Vec::new());
    }
    let count = length(folder, name).min(NAMED as u64);
    let file = folder.file(name)?;
    if folder.manifest().index == "u4" {
        let ids = rows::<u32>(&file, 0, count)?;
        return Ok(ids.into_iter().map(u64::from).collect());
    }
    rows::<u64>(&file, 0, count)
}
