//! Normals: for each vertex the normalised sum of the cross products of its triangles.
//!
//! A cross product is twice the triangle's area long, so each triangle weighs by its area. It is
//! taken of V as the folder has it: normals point outward where the folder's triangles do.
//!
//! **What counts.** All arithmetic is in f64, rounded to f4 at the end. A vertex's cross products
//! are added one after another in ascending order of their triangles, so the sum does not depend
//! on who computed it. Where the sum is zero (nothing names the vertex, all is flat, or it
//! cancels) the normal is (0, 0, 0). A degenerate triangle adds nothing. A triangle with a vertex
//! that is not finite adds nothing either, at none of its vertices, and is counted.
//!
//! **Two ways to the same bytes.**
//! 1. `ranges`: all of G and the sums of a range of vertices for each thread are in memory;
//!    each thread walks V from end to end and adds what concerns its range. Taken when G fits in
//!    half of the budget.
//! 2. `chunks`: V is cut into chunks of consecutive triangles. A vertex that one chunk alone names
//!    is summed and written there. Corners at the others, the *seam vertices*, send their
//!    triangle's cross product through the shuffle (`stars`), sorted by vertex and triangle. A
//!    chunk whose vertices lie far apart in G asks for their positions through the shuffle
//!    first (`asked`).
//!
//! Both add a vertex's cross products in the same order, from the same zero.
//!
//! Memory, all of it drawn from the budget; from [`least_memory`] on any budget will do. I/O: see
//! the two ways; N is written once, in parts twice where seam vertices lie between others.

mod asked;
mod chunks;
mod cross;
mod ranges;
mod rows;
mod stars;

use crate::build::plan::MIN_SORT;
use crate::build::records::narrow;
use crate::build::whole::Whole;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::{Target, Workspace};
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::folder::{self, Folder, Outputs};
use crate::input::{CoordArray, CoordKind, Endian, IndexArray, IndexKind, Source};
use crate::shuffle;
use cross::Cross;
use rows::RowFile;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Which way to go. The normals do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    /// What suits the mesh and the budget.
    #[default]
    Auto,
    /// By chunks of triangles, though all of G would fit.
    Chunks,
}

/// What to compute, and where to.
#[derive(Clone, Debug)]
pub struct NormalsRequest {
    /// The file for the normals of the vertices, (N,3) f4.
    pub target: PathBuf,
    /// The file for the normals of the triangles, (T,3) f4.
    pub triangles: Option<PathBuf>,
    /// Replace files that exist.
    pub force: bool,
    /// Which way to go.
    pub way: Way,
    /// Triangles of a chunk, when not as the budget suggests.
    pub chunk: Option<u64>,
}

impl NormalsRequest {
    /// The normals of the vertices, to this file, replacing nothing.
    pub fn new(target: impl Into<PathBuf>) -> NormalsRequest {
        NormalsRequest {
            target: target.into(),
            triangles: None,
            force: false,
            way: Way::Auto,
            chunk: None,
        }
    }
}

/// What was computed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NormalsCount {
    /// N.
    pub vertices: u64,
    /// Vertices whose sum is zero.
    pub zero: u64,
    /// Triangles, not degenerate, left out since a vertex of theirs is not finite.
    pub nonfinite_triangles: u64,
    /// The files.
    pub files: Vec<PathBuf>,
}

/// What every step knows of the work.
struct Job<'a> {
    ws: &'a Workspace,
    v: IndexArray,
    g: CoordArray,
    /// T.
    triangles: u64,
    /// N.
    vertices: u64,
    cross: Cross,
    /// Normals of the vertices.
    out: RowFile,
    /// Normals of the triangles.
    faces: Option<RowFile>,
    way: Way,
    /// Triangles of a chunk.
    chunk: u64,
    /// Memory of one writer of a shuffle.
    writer: u64,
    /// Vertices whose sum is not zero.
    nonzero: AtomicU64,
    /// Triangles that were left out.
    left_out: AtomicU64,
}

/// The least budget in bytes with which normals are not refused, by so many threads.
pub fn least_memory(threads: usize) -> u64 {
    let thread = MIN_CHUNK * chunks::BYTES + 2 * MIN_WRITER + 2 * MIN_SORT;
    (512 << 10) + threads as u64 * thread
}

/// The smallest chunk that the budget may give.
const MIN_CHUNK: u64 = 1 << 10;
/// The largest: beyond it, chunks leave the cache and gain nothing.
const MAX_CHUNK: u64 = 128 << 10;
/// The least that a writer of a shuffle takes.
const MIN_WRITER: u64 = 64 << 10;
/// The most memory of one sorter.
const MOST_SORT: u64 = 64 << 20;

/// Computes the normals of a folder.
///
/// Files must not exist unless `force` is set, nor lie in a mesh folder. They appear under
/// their names when they are complete; on an error they do not.
///
/// # Errors
/// [`Error::Usage`] for a folder without coordinates or a target that exists; [`Error::Budget`]
/// naming the least that would do; [`Error::Input`] when the folder is damaged;
/// [`Error::DiskLimit`], [`Error::Io`].
///
/// # Example
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # let target = dir.path().join("tetrahedron.N.npy");
/// # by_hand::tetrahedron().write(&folder);
/// # let ws = by_hand::workspace(dir.path(), 2 << 20);
/// use cornermill::folder::Folder;
/// use cornermill::measure::normals::{NormalsRequest, normals};
///
/// // ws: a Workspace of 2 MiB; folder: the mesh folder of a tetrahedron
/// let folder = Folder::open(&folder, &ws.io)?;
/// let count = normals(&ws, &folder, &NormalsRequest::new(&target))?;
/// assert_eq!((count.vertices, count.zero), (4, 0));
/// # Ok::<(), cornermill::Error>(())
/// ```
pub fn normals(ws: &Workspace, folder: &Folder, request: &NormalsRequest) -> Result<NormalsCount> {
    if !folder.has(folder::G) {
        return Err(Error::Usage(format!(
            "{}: has no coordinates (it was built from V alone), so it has no normals",
            folder.path().display()
        )));
    }
    let least = least_memory(ws.workers.count());
    if least > ws.budget.free() {
        return Err(Error::Budget {
            what: "normals".into(),
            need: ws.budget.used() + least,
            have: ws.budget.limit(),
        });
    }
    let mut outputs = Outputs::new(&[folder.path()], request.force);
    let target = outputs.create(&request.target)?;
    let beside = request.triangles.as_deref();
    let beside = beside.map(|path| outputs.create(path));
    let beside = beside.transpose()?;
    let job = Job::new(ws, folder, request, (&target, beside.as_ref()))?;
    let done = match (job.v.kind, job.g.kind) {
        (IndexKind::U8, CoordKind::F4) => job.run::<u64, f32>(),
        (IndexKind::U8, CoordKind::F8) => job.run::<u64, f64>(),
        (_, CoordKind::F4) => job.run::<u32, f32>(),
        (_, CoordKind::F8) => job.run::<u32, f64>(),
    };
    folder.intact(done)?;
    let (vertices, left_out) = (job.vertices, job.left_out.load(Ordering::Relaxed));
    let zero = vertices - job.nonzero.load(Ordering::Relaxed);
    drop(job);
    let mut files = vec![target.keep()?];
    if let Some(beside) = beside {
        files.push(beside.keep()?);
    }
    Ok(NormalsCount {
        vertices,
        zero,
        nonfinite_triangles: left_out,
        files,
    })
}

/// Where the normals of a folder go unless a name is given: `NAME.N.npy` beside `NAME.ct`, for
/// triangles `NAME.NT.npy`.
pub fn default_target(folder: &Path, of_triangles: bool) -> PathBuf {
    let end = if of_triangles { "NT.npy" } else { "N.npy" };
    match folder.extension() {
        Some(ct) if ct.eq_ignore_ascii_case("ct") => folder.with_extension(end),
        _ => {
            let mut name = folder.as_os_str().to_owned();
            name.push(".");
            name.push(end);
            name.into()
        }
    }
}

impl<'a> Job<'a> {
    fn new(
        ws: &'a Workspace,
        folder: &Folder,
        request: &NormalsRequest,
        (target, beside): (&Target, Option<&Target>),
    ) -> Result<Job<'a>> {
        let manifest = folder.manifest();
        let (t, n) = (manifest.counts.triangles, manifest.counts.vertices);
        let wide = manifest.index == "u8";
        let double = manifest.coords.as_deref() == Some("f8");
        let v = IndexArray {
            source: Source::Named(array(
                folder,
                folder::V,
                if wide { "<u8" } else { "<u4" },
                t,
            )?),
            at: DATA_START,
            kind: if wide { IndexKind::U8 } else { IndexKind::U4 },
            endian: Endian::Little,
            triangles: t,
        };
        let real = if double { "<f8" } else { "<f4" };
        let g = CoordArray {
            source: Source::Named(array(folder, folder::G, real, n)?),
            at: DATA_START,
            kind: if double { CoordKind::F8 } else { CoordKind::F4 },
            endian: Endian::Little,
            vertices: n,
            placed: true,
        };
        let threads = ws.workers.count() as u64;
        let share = ws.budget.free() / threads;
        let chunk = (share / 4 / chunks::BYTES).clamp(MIN_CHUNK, MAX_CHUNK);
        let faces = beside.map(|file| RowFile::new(file.data(&ws.io)?, t));
        Ok(Job {
            ws,
            v,
            g,
            triangles: t,
            vertices: n,
            cross: Cross::new(folder, double)?,
            out: RowFile::new(target.data(&ws.io)?, n)?,
            faces: faces.transpose()?,
            way: request.way,
            chunk: request.chunk.unwrap_or(chunk).max(1),
            writer: (share / 16).max(MIN_WRITER),
            nonzero: AtomicU64::new(0),
            left_out: AtomicU64::new(0),
        })
    }

    fn run<I: Index, X: Coord>(&self) -> Result<()> {
        let least = least_memory(self.ws.workers.count());
        let reserved = (self.ws.budget.free() / 2).max(least);
        if self.way == Way::Auto
            && let Some(whole) = Whole::<X>::of(self.ws, &self.g, reserved)?
        {
            return ranges::by_ranges::<I, X>(self, &whole);
        }
        if narrow(self.triangles, self.vertices) {
            chunks::by_chunks::<I, X, u32>(self)
        } else {
            chunks::by_chunks::<I, X, u64>(self)
        }
    }

    /// First triangle of a chunk and number of its triangles.
    fn chunk_range(&self, chunk: u64) -> (u64, u64) {
        let first = chunk * self.chunk;
        (first, self.chunk.min(self.triangles - first))
    }

    /// A plan for a shuffle of about `expected` records, one writer a thread.
    fn shuffle_plan(&self, record_bytes: usize, expected: u64) -> shuffle::Plan {
        let threads = self.ws.workers.count();
        let sort = (self.ws.budget.limit() / 4 / threads as u64).min(MOST_SORT);
        let writers = self.writer * threads as u64;
        shuffle::Plan::within(writers, threads, record_bytes, expected, sort)
    }

    /// Memory of one thread's sorter when `reserved` bytes more are still to be drawn.
    fn sort_memory(&self, reserved: u64) -> u64 {
        // A quarter stays free for what a shuffle holds besides its buffers.
        let free = self.ws.budget.free().saturating_sub(reserved) / 4 * 3;
        (free / self.ws.workers.count() as u64).clamp(MIN_SORT, MOST_SORT)
    }

    /// Counts triangles that were left out.
    fn leave_out(&self, triangles: u64) {
        self.left_out.fetch_add(triangles, Ordering::Relaxed);
    }
}

/// Opens an array of a folder with three columns, whose type is held to `descr`.
fn array(folder: &Folder, name: &str, descr: &str, rows: u64) -> Result<crate::disk::DataFile> {
    crate::table::array::open(folder, name, descr, &[rows, 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_named_after_the_folder() {
        let name = |path: &str, of| default_target(path.as_ref(), of);
        assert_eq!(name("a/x.ct", false), Path::new("a/x.N.npy"));
        assert_eq!(name("a/x.ct", true), Path::new("a/x.NT.npy"));
        assert_eq!(name("x.1", false), Path::new("x.1.N.npy"));
    }
}
