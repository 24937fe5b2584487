//! A mesh folder, or chosen components of it, as PLY, STL, OBJ, OFF or `.npy`, streamed.
//!
//! Vertices are written in ascending order of their ids, triangles in theirs, so that a whole
//! folder leaves as it came in, vertex for vertex. With a selection the vertices that no chosen
//! triangle names are left out and the others numbered anew, in the same order: a first pass
//! over V marks the vertices in a bit array, and the number of a vertex is the count of marks
//! before it.
//!
//! Why nothing half-written is left under the target's name: files are written under a
//! temporary name beside the target and renamed when complete.
//!
//! Memory, all of it drawn from the budget: fixed buffers (at least [`least_memory`]; more
//! when there is more, which changes no byte of the output). A selection adds 9/64 byte a
//! component and, except for STL, 9/64 byte a vertex of the mesh (marks and their counts);
//! `largest` adds 16 bytes for each component asked for, while choosing. When that does not
//! fit, the export is refused and the message names the least that would do.
//! I/O: V once (twice with a selection), labels with it when there is a selection, the flip
//! bits when they are undone, and G once. STL needs the coordinates at each triangle: G is
//! read in the order of use, block by block of triangles, which for a mesh in random order
//! reads all of G again and again: correct, and slow.

mod faces;
pub mod filter;
mod gather;
mod job;
mod npy;
mod number;
mod plain;
mod ply;
mod select;
mod selection;
mod sink;
mod source;
mod stl;
mod strip;
mod used;

use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::{self, Folder, Outputs};
use job::Job;
use sink::Sink;
use source::Source;
use std::io::Write;
use std::path::{Path, PathBuf};

pub use job::{least_memory, least_strip_memory};
pub use selection::{Bbox, Numbers, Selection};
pub use strip::Strip;

/// A file format to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stanford PLY, binary little-endian, or ascii. Coordinates as the folder has them (float
    /// or double); indices `int` while all stay below 2^31, `uint` to 2^32.
    Ply,
    /// STL, binary: three f4 positions and a normal for each triangle, at most 2^32 - 1 of
    /// them. f8 coordinates are rounded; one that is too large for f4 is refused.
    Stl,
    /// Wavefront OBJ, text.
    Obj,
    /// Object File Format, text.
    Off,
    /// NumPy arrays: `NAME.npy` is V, (T,3), u4 or (when ids need it) u8, and `NAME.G.npy` is
    /// G, (N,3), as the folder has it. The one format for a folder without coordinates.
    Npy,
}

impl Format {
    /// The format that a file name ends in, whatever the case.
    ///
    /// ```
    /// use cornermill::export::Format;
    /// assert_eq!(Format::of("scan.PLY".as_ref()), Some(Format::Ply));
    /// assert_eq!(Format::of("scan.gz".as_ref()), None);
    /// ```
    pub fn of(path: &Path) -> Option<Format> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "ply" => Some(Format::Ply),
            "stl" => Some(Format::Stl),
            "obj" => Some(Format::Obj),
            "off" => Some(Format::Off),
            "npy" => Some(Format::Npy),
            _ => None,
        }
    }
}

/// The files that an export to this name writes.
pub fn files(target: &Path, points: bool) -> Vec<PathBuf> {
    let mut files = vec![target.to_owned()];
    if points && Format::of(target) == Some(Format::Npy) {
        files.push(npy::path_of_g(target));
    }
    files
}

/// What to export, and where to.
///
/// A selection chooses whole components. Degenerate triangles belong to none: a selection leaves
/// them out, an export without selection has everything.
#[derive(Clone, Debug)]
pub struct ExportRequest {
    /// The format.
    pub format: Format,
    /// The file to write; `-` is standard output (not for `.npy`, which are two files).
    pub target: PathBuf,
    /// Text instead of binary, for PLY. OBJ and OFF are text in any case.
    pub ascii: bool,
    /// Only these components.
    pub selection: Selection,
    /// Every triangle as the input had it: the flips are undone.
    pub input_orientation: bool,
    /// Replace a file that exists.
    pub force: bool,
}

impl ExportRequest {
    /// A request for everything, binary, as the folder has it, replacing nothing.
    pub fn new(format: Format, target: impl Into<PathBuf>) -> ExportRequest {
        ExportRequest {
            format,
            target: target.into(),
            ascii: false,
            selection: Selection::default(),
            input_orientation: false,
            force: false,
        }
    }

    fn selects(&self) -> bool {
        !self.selection.is_empty()
    }

    /// What makes no sense is refused before anything is read.
    fn check(&self, folder: &Folder) -> Result<()> {
        self.fits(folder.has(folder::G))?;
        self.selection.check(folder)
    }

    /// The format has what is asked of it, and what there is.
    fn fits(&self, points: bool) -> Result<()> {
        let refuse = |what: &str| Err(Error::Usage(what.into()));
        if self.ascii && matches!(self.format, Format::Stl | Format::Npy) {
            return refuse("--ascii is for ply; stl and npy are written in binary only");
        }
        if self.format != Format::Npy && !points {
            return refuse(
                "the folder has no coordinates (it was built from V alone), \
                 so only npy can be written",
            );
        }
        Ok(())
    }
}

/// What an export wrote.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportCount {
    /// Triangles.
    pub triangles: u64,
    /// Coordinate triples: vertices, or 3 a triangle for STL; 0 without coordinates.
    pub vertices: u64,
    /// Components chosen; `None` without a selection.
    pub components: Option<u64>,
    /// Bytes.
    pub bytes: u64,
    /// The files; none for a stream.
    pub files: Vec<PathBuf>,
}

/// Exports a folder to a file, to two (`.npy`), or to standard output.
///
/// The target must not exist unless `force` is set, nor lie in a mesh folder. It appears
/// under its name when it is complete; on an error it does not.
///
/// # Errors
/// [`Error::Usage`] for a request that makes no sense or chooses nothing, a target that exists,
/// a count that the format cannot hold; [`Error::Budget`] naming the least that would do;
/// [`Error::Input`] when the folder is damaged; [`Error::Io`].
///
/// # Example
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # let target = dir.path().join("tetrahedron.obj");
/// # by_hand::tetrahedron().write(&folder);
/// # let ws = by_hand::workspace(dir.path(), 1 << 20);
/// use cornermill::export::{ExportRequest, Format, export};
/// use cornermill::folder::Folder;
///
/// // ws: a Workspace of 1 MiB; folder: the mesh folder of a tetrahedron
/// let folder = Folder::open(&folder, &ws.io)?;
/// let mut request = ExportRequest::new(Format::Obj, &target);
/// request.selection.largest = Some(1);
/// let count = export(&ws, &folder, &request)?;
/// assert_eq!((count.triangles, count.vertices), (4, 4));
/// assert!(std::fs::read_to_string(&target).unwrap().starts_with("v 0 0 0\n"));
/// # Ok::<(), cornermill::Error>(())
/// ```
pub fn export(ws: &Workspace, folder: &Folder, request: &ExportRequest) -> Result<ExportCount> {
    if request.target.as_os_str() == "-" {
        return export_to(ws, folder, request, &mut std::io::stdout().lock());
    }
    request.check(folder)?;
    export_file(ws, (&[folder.path()], Source::of(folder)?), request, None)
}

/// As [`export`], of two arrays that belong to no folder, but are as those of one: V with ids below
/// `vertices`, and G. The target is a file, and nothing is selected.
///
/// # Errors
/// As [`export`]; [`Error::Input`] for other arrays.
pub fn export_arrays(
    ws: &Workspace,
    v: &Path,
    g: Option<&Path>,
    vertices: u64,
    request: &ExportRequest,
) -> Result<ExportCount> {
    if request.selects() || request.input_orientation || request.target.as_os_str() == "-" {
        return Err(Error::Usage(
            "arrays without a folder are written whole, as they are, to a file".into(),
        ));
    }
    request.fits(g.is_some())?;
    let inputs: Vec<&Path> = [Some(v), g].into_iter().flatten().collect();
    export_file(
        ws,
        (&inputs, Source::arrays(v, g, vertices, &ws.io)?),
        request,
        None,
    )
}

/// As [`export`], of these triangles alone, in their order; the request selects nothing, and the
/// target is a file.
///
/// # Errors
/// As [`export`], and those of the strip.
pub fn export_strip<'a>(
    ws: &'a Workspace,
    folder: &'a Folder,
    request: &'a ExportRequest,
    strip: &'a mut (dyn Strip + 'a),
) -> Result<ExportCount> {
    if request.selects() || request.input_orientation || request.target.as_os_str() == "-" {
        return Err(Error::Usage(
            "listed triangles are written to a file, as the folder has them; \
             leave out the selection of components and --input-orientation"
                .into(),
        ));
    }
    request.check(folder)?;
    export_file(
        ws,
        (&[folder.path()], Source::of(folder)?),
        request,
        Some(strip),
    )
}

fn export_file<'a>(
    ws: &'a Workspace,
    (inputs, source): (&[&Path], Source<'a>),
    request: &'a ExportRequest,
    strip: Option<&'a mut (dyn Strip + 'a)>,
) -> Result<ExportCount> {
    let mut outputs = Outputs::new(inputs, request.force);
    let mut target = outputs.create(&request.target)?;
    let mut beside = None;
    if request.format == Format::Npy {
        let path = npy::path_of_g(&request.target);
        if source.g.is_some() {
            beside = Some(outputs.create(&path)?);
        } else if path.symlink_metadata().is_ok() {
            return Err(Error::Usage(format!(
                "{}: exists, and would be taken for the coordinates of a mesh that has none; \
                 remove it, or give another name",
                path.display()
            )));
        }
    }
    let mut job = Job::start(ws, source, request, strip)?;
    let mut bytes = 0;
    let mut files = Vec::new();
    let mut complete = None;
    if let Some(mut beside) = beside {
        let mut sink = Sink::new(beside.file(), npy::path_of_g(&request.target), &ws.io);
        npy::write_g(&mut job, &mut sink)?;
        bytes += sink.finish()?;
        complete = Some(beside);
    }
    let mut sink = Sink::new(target.file(), request.target.clone(), &ws.io);
    job.write(&mut sink)?;
    bytes += sink.finish()?;
    // G before V: where NAME.npy is, its coordinates are complete too.
    if let Some(beside) = complete {
        files.push(beside.keep()?);
    }
    files.push(target.keep()?);
    Ok(job.count(bytes, files))
}

/// Exports a folder to a stream. As [`export`], which see; the target's name is used in
/// messages only. When it fails, part of the mesh may have been written.
///
/// # Errors
/// As [`export`]; [`Error::Usage`] for `.npy`, which are two files.
pub fn export_to(
    ws: &Workspace,
    folder: &Folder,
    request: &ExportRequest,
    out: &mut dyn Write,
) -> Result<ExportCount> {
    request.check(folder)?;
    if request.format == Format::Npy {
        return Err(Error::Usage(
            "npy is written as files, NAME.npy and NAME.G.npy; give a name instead of -".into(),
        ));
    }
    let mut job = Job::start(ws, Source::of(folder)?, request, None)?;
    let mut sink = Sink::new(out, request.target.clone(), &ws.io);
    job.write(&mut sink)?;
    let bytes = sink.finish()?;
    Ok(job.count(bytes, Vec::new()))
}
