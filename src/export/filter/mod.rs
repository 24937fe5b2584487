//! Chosen components of a folder as a folder of their own.
//!
//! What hangs together over regular edges stays so, thus opposites and labels are those of the
//! source, renumbered in the same order; nothing is paired anew. What does change is found again:
//! - the grid of volumes lies over the box of the vertices that are left, so volumes and areas
//!   are summed again, and where the sign of a volume is seen now, or no longer, the component is
//!   oriented anew by the rules of `build`;
//! - a non-manifold edge of which one corner is left becomes a border; two that are left become
//!   opposite and join their components. Such sets are oriented anew, or found not to be
//!   orientable. (Under `--orient keep` the source does not say how triangles of a component
//!   agree: there such a selection is refused, naming the edge.)
//!
//! Vertices that no chosen triangle names are left out, and so are degenerate triangles, which
//! belong to no component. `map_triangle.npy` and `map_vertex.npy` hold the ids that triangles and
//! vertices had in the source; ids are as narrow as they can be. The manifest names the source by the digest of its manifest. The
//! result has no measures of vertices.
//!
//! Why numbers keep their order: a new id is the number of marks before the old one, and by the
//! first triangles components keep theirs.
//!
//! Memory, all of it drawn from the budget: 17/64 byte a triangle and 9/64 a vertex of the source,
//! 3/8 byte a chosen triangle, 320 bytes a chosen component, 24 for each corner of the non-manifold edge
//! that has most, and fixed buffers. I/O: labels, flips
//! and V three times, O once, G twice, more often in random order (it is read block by block of
//! triangles, in the order of use); everything chosen written once.

mod edges;
mod least;
mod sets;
mod source;
mod table;
mod write;

use super::job::MIN_STEP;
use super::select::{self, Chosen};
use super::selection::Selection;
use super::used::Used;
use super::{faces, gather};
use crate::build::arrays::OutArray;
use crate::build::{Former, Staging};
use crate::chunk::grid::Bounds;
use crate::corner::Index;
use crate::disk::{DataFile, Workspace};
use crate::error::{Error, Result};
use crate::folder::{self, Counts, FileEntry, Folder, InputEntry, Manifest, WarmSums};
use source::Source;
use std::path::PathBuf;

/// What to take, and where to.
#[derive(Clone, Debug)]
pub struct FilterRequest {
    /// The folder to make.
    pub target: PathBuf,
    /// Which components.
    pub selection: Selection,
    /// Replace a mesh folder that exists.
    pub force: bool,
}

/// The marks of what is taken.
struct Taken<'a> {
    chosen: &'a Chosen,
    triangles: Used,
    vertices: Used,
    /// Bits of the source's triangles that are taken and were turned.
    flips: Vec<u64>,
}

impl Taken<'_> {
    /// True when a triangle that is taken was turned.
    #[inline]
    fn flipped(&self, t: u64) -> bool {
        self.flips[(t / 64) as usize] >> (t % 64) & 1 == 1
    }
}

/// Bytes for each triangle of a block: what is read, what is looked up, what is written.
const BYTES_PER_TRIANGLE: u64 = faces::BYTES_PER_TRIANGLE + gather::BYTES_PER_TRIANGLE + 160;
/// Most triangles in a block.
const MAX_STEP: u64 = 1 << 16;

/// Makes a folder of the chosen components; returns its manifest.
///
/// # Errors
/// [`Error::Usage`] for a selection that chooses nothing, a target that exists, an edge that would
/// join what was cut; [`Error::Budget`]; [`Error::Input`] when the folder is damaged;
/// [`Error::Io`].
pub fn filter(ws: &Workspace, folder: &Folder, request: &FilterRequest) -> Result<Manifest> {
    request.selection.check(folder)?;
    if request.selection.is_empty() {
        let what = "no component is left out; give a selection, or copy the folder";
        return Err(Error::Usage(what.into()));
    }
    let staging = Staging::new(
        &request.target,
        request.force,
        if request.force {
            Former::Remove
        } else {
            Former::Refuse
        },
        &[folder.path()],
    )?;
    let any = least::any(ws, folder, &request.selection);
    let choose = || select::choose(ws, folder, &request.selection);
    let Some(mut chosen) = ws.budget.within(any, choose)? else {
        return Err(Error::Internal("a selection chose everything".into()));
    };
    chosen.seal();
    let triangles = folder.manifest().counts.triangles.min(chosen.triangles);
    let passes = least::passes(ws, folder, chosen.count, triangles);
    let enough = least::mark_bytes(folder) + MIN_STEP * BYTES_PER_TRIANGLE + passes;
    let take = || take(ws, folder, staging, &chosen, passes);
    ws.budget.within(enough, take)
}

/// Makes the folder of what was chosen; `passes` take so many bytes at most.
fn take(
    ws: &Workspace,
    folder: &Folder,
    staging: Staging,
    chosen: &Chosen,
    passes: u64,
) -> Result<Manifest> {
    let counts = &folder.manifest().counts;
    let marks = least::mark_bytes(folder);
    let _marks = ws.budget.lease("marks of what is taken", marks)?;
    let mut step = MIN_STEP;
    // Larger blocks from a quarter of what is left, but not from what the passes may want.
    let free = ws.budget.free();
    let spare = (free / 4).min(free.saturating_sub(passes));
    while step < MAX_STEP && 2 * step * BYTES_PER_TRIANGLE <= spare {
        step *= 2;
    }
    let _blocks = ws
        .budget
        .lease("blocks of triangles", step * BYTES_PER_TRIANGLE)?;
    let source = Source::open(ws, folder, step)?;
    let mut taken = Taken {
        chosen,
        triangles: Used::new(counts.triangles),
        vertices: Used::new(counts.vertices),
        flips: vec![0; counts.triangles.div_ceil(64) as usize],
    };
    let triangles = source.mark(&mut taken)?;
    if triangles != chosen.triangles {
        return Err(source.miscounted(chosen.triangles, triangles));
    }
    let vertices = taken.vertices.seal();
    let job = Job {
        ws,
        folder,
        source,
        staging,
        taken,
        triangles,
        vertices,
        step,
    };
    if folder::fits_u4(triangles, vertices) {
        job.run::<u32>()
    } else {
        job.run::<u64>()
    }
}

/// One filter under way.
struct Job<'a> {
    ws: &'a Workspace,
    folder: &'a Folder,
    source: Source<'a>,
    staging: Staging,
    taken: Taken<'a>,
    /// Triangles that are taken.
    triangles: u64,
    /// Vertices that are taken.
    vertices: u64,
    step: u64,
}

impl Job<'_> {
    fn run<I: Index>(self) -> Result<Manifest> {
        let edges = edges::settle(&self)?;
        let mut files = Vec::new();
        let mut bounds = Bounds::default();
        if let Some(g) = self.source.write_g(&self, &mut bounds)? {
            files.push(g);
        }
        let table = table::decide(&self, &edges, &bounds)?;
        let mut counts = Counts {
            triangles: self.triangles,
            vertices: self.vertices,
            nonfinite_vertices: bounds.nonfinite,
            nonmanifold_edges: edges.kept,
            nonmanifold_corners: edges.corners,
            components_joined: edges.joined,
            ..Counts::default()
        };
        files.push(table.write(&self, &mut counts)?);
        files.extend(write::triangles::<I>(
            &self,
            &table,
            &edges.links,
            &mut counts,
        )?);
        counts.distinct_edges = counts.regular_edges + counts.border_edges + edges.kept;
        files.extend(edges::write::<I>(&self, &table, &edges)?);
        files.push(write::vertices(&self)?);
        drop(table);
        drop(edges);
        self.seal::<I>(files, counts)
    }

    /// An array of the new folder.
    fn array(&self, name: &'static str, descr: &str, shape: &[u64], row: u64) -> Result<OutArray> {
        OutArray::create(self.staging.path(), name, descr, shape, row, self.ws)
    }

    /// Sums, manifest, sync, rename.
    fn seal<I: Index>(mut self, mut files: Vec<OutArray>, counts: Counts) -> Result<Manifest> {
        let ws = self.ws;
        files.sort_by_key(|f| f.name);
        let warm: Vec<(&DataFile, &WarmSums)> = files.iter().map(|f| (&f.file, &f.sums)).collect();
        let left = warm.iter().map(|(_, sums)| sums.left()).sum();
        ws.progress.begin("checksums", "bytes", left);
        let sums = folder::warm_sums(ws, &warm)?;
        ws.progress.end();
        let entry = |(file, sums): (&OutArray, &Vec<u64>)| FileEntry {
            name: file.name.to_owned(),
            dtype: file.descr.clone(),
            shape: file.shape.clone(),
            bytes: file.sums.bytes(),
            blocks: sums.iter().map(|s| format!("{s:016x}")).collect(),
        };
        let before = self.folder.manifest();
        let own = DataFile::open(&self.folder.path().join(folder::MANIFEST), &ws.io)?;
        let manifest = Manifest {
            format: folder::FORMAT.to_owned(),
            version: folder::VERSION,
            conventions: Manifest::conventions(),
            index: I::DESCR[1..].to_owned(),
            coords: before.coords.clone(),
            options: before.options.clone(),
            counts,
            measures: None,
            input: InputEntry {
                format: "filter".into(),
                files: vec![folder::digest_file(ws, &own)?],
            },
            files: files.iter().zip(&sums).map(entry).collect(),
            checksum: String::new(),
        };
        for (file, _) in &warm {
            file.sync()?;
        }
        let path = self.staging.path().join(folder::MANIFEST);
        let file = DataFile::create_new(&path, &ws.io)?;
        file.write_at(manifest.to_text().as_bytes(), 0)?;
        file.sync()?;
        self.staging.finish()?;
        Ok(manifest)
    }
}
