//! The order of the passes, what each hands to the next, and what each cost.

use super::arrays::OutArray;
use super::by_cells::{by_cells, steps_of};
use super::clock::{Clock, PassReport};
use super::coords::{Placed, array_of, place};
use super::identity::Inputs;
use super::in_order::{self, in_order};
use super::plan::{Plan, Shape, Strategy};
use super::records::narrow;
use super::room::{check_after_read, with_need};
use super::scan::count_ids;
use super::steps::Opened;
use super::way::{Kind, Way, choose, with_least};
use super::{Job, staging::Staging};
use crate::chunk::grid::Bounds;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::DataFile;
use crate::error::{Error, Result};
use crate::folder::{self, Counts, FileEntry, Manifest, Measures, Orient, WarmSums};
use crate::input::{CoordKind, Mesh, Source};
use std::path::Path;

/// What a build did.
#[derive(Clone, Debug)]
pub struct BuildReport {
    /// The manifest of the finished folder.
    pub manifest: Manifest,
    /// The passes, in order.
    pub passes: Vec<PassReport>,
    /// The most memory that was drawn from the budget at once, in bytes.
    pub peak_budget: u64,
    /// The most scratch space in use at once, in bytes.
    pub peak_scratch: u64,
    /// Corners that the chunks could not settle.
    pub seam_corners: u64,
    /// Local components before stitching.
    pub local_components: u64,
    /// Triangles of a chunk.
    pub chunk_triangles: u64,
}

/// What the pipeline is given besides the mesh.
pub struct Wishes {
    /// How to orient.
    pub orient: Orient,
    /// Indices of 8 bytes whatever the counts.
    pub wide: bool,
    /// Indices of 4 bytes, or none.
    pub narrow: bool,
    /// Type of the stored coordinates; by default the input's.
    pub coords: Option<CoordKind>,
    /// Triangles of a chunk, for tests.
    pub chunk: Option<u64>,
    /// Buckets of a shuffle, for tests.
    pub buckets: Option<usize>,
    /// Which way to go, for tests.
    pub strategy: Strategy,
    /// Whether to measure the vertices.
    pub measures: bool,
}

/// Brings the mesh to where every pass begins: G in its place, and the vertices counted.
///
/// # Errors
/// Those of the passes.
pub fn settle_in(clock: &mut Clock, mesh: Mesh, wishes: &Wishes, dir: &Path) -> Result<Opened> {
    let ws = clock.workspace();
    let kind = mesh.g.as_ref().map(|g| wishes.coords.unwrap_or(g.kind));
    let placed = match (&mesh.g, kind) {
        (Some(g), Some(kind)) => {
            Some(
                clock.pass("coordinates", "vertices", g.vertices, || match kind {
                    CoordKind::F4 => place::<f32>(ws, dir, g, mesh.sums.get(1)),
                    CoordKind::F8 => place::<f64>(ws, dir, g, mesh.sums.get(1)),
                })?,
            )
        }
        _ => None,
    };
    let vertices = vertex_count(clock, &mesh)?;
    let opened = Opened {
        mesh,
        placed,
        vertices,
    };
    clock.opened(&opened)?;
    Ok(opened)
}

/// Builds the folder in `dir` from an opened mesh and seals it.
///
/// # Errors
/// Those of the passes.
pub fn run(
    mut clock: Clock,
    opened: &Opened,
    wishes: &Wishes,
    inputs: &Inputs,
    staging: &mut Staging,
) -> Result<BuildReport> {
    let ws = clock.workspace();
    let (mesh, vertices) = (&opened.mesh, opened.vertices);
    let placed = opened.placed.as_ref();
    let kind = placed.map(|placed| placed.array.kind);
    let triangles = mesh.v.triangles;
    let in_place = matches!(mesh.v.source, Source::Named(_));
    check_width(wishes.narrow, triangles, vertices)?;
    let shape = Shape::new(
        triangles,
        vertices,
        wishes.wide,
        kind,
        ws.workers.count(),
        wishes.measures,
    );
    // Only block sums are held now, which the plan's slack covers.
    let plan = Plan::new(&shape, ws.budget.limit(), wishes.chunk, wishes.buckets)?;
    let bounds = placed.map_or(Bounds::default(), |placed| placed.bounds);
    let g = match placed {
        Some(Placed { file, array, .. }) => Some(array_of(file, array.kind, &ws.io)?),
        None => None,
    };
    let job = Job {
        ws,
        opened,
        mesh,
        g,
        shape,
        plan,
        dir: staging.path(),
        orient: wishes.orient,
        strategy: wishes.strategy,
    };
    let doubles = kind == Some(CoordKind::F8);
    let job = &job;
    let built = match clock.restored(BUILT)? {
        Some(built) => Ok(built),
        None => {
            let widths = (shape.index == 8, narrow(triangles, vertices), doubles);
            let mut all = || match widths {
                (false, true, false) => passes::<u32, u32, f32>(&mut clock, job, &bounds),
                (false, true, true) => passes::<u32, u32, f64>(&mut clock, job, &bounds),
                (false, false, false) => passes::<u32, u64, f32>(&mut clock, job, &bounds),
                (false, false, true) => passes::<u32, u64, f64>(&mut clock, job, &bounds),
                (true, _, false) => passes::<u64, u64, f32>(&mut clock, job, &bounds),
                (true, _, true) => passes::<u64, u64, f64>(&mut clock, job, &bounds),
            };
            let built = if in_place {
                inputs.blamed(&ws.io, all)
            } else {
                all()
            };
            built.and_then(|built| {
                clock.done(BUILT, opened, &built)?;
                Ok(built)
            })
        }
    };
    let sealed = built.and_then(|built| {
        let manifest = seal(&mut clock, job, &built)?;
        Ok((built, manifest))
    });
    let (built, manifest) = sealed.map_err(|e| with_need(e, job))?;
    let (chunk_triangles, seam_corners) = (job.plan.chunk, built.seam_corners);
    clock.pass("rename", "", 0, || {
        // What was decoded was read long ago, and may be gone.
        if in_place {
            inputs.check(&ws.io)?;
        }
        staging.finish()
    })?;
    Ok(BuildReport {
        manifest,
        passes: clock.passes(),
        peak_budget: ws.budget.peak(),
        peak_scratch: ws.scratch.peak(),
        seam_corners,
        local_components: built.local_components,
        chunk_triangles,
    })
}

/// Refuses `--index u4` for a mesh that it cannot number.
///
/// # Errors
/// [`Error::Usage`].
pub fn check_width(narrow: bool, triangles: u64, vertices: u64) -> Result<()> {
    if narrow && !folder::fits_u4(triangles, vertices) {
        return Err(Error::Usage(format!(
            "--index u4 cannot number {triangles} triangles and {vertices} vertices; \
             use auto or u8"
        )));
    }
    Ok(())
}

/// The step behind which all arrays are complete.
const BUILT: &str = "finish";

/// More vertices than any mesh has: ids are packed beside a few bits.
const MOST_VERTICES: u64 = 1 << 56;

/// N: the rows of G, what the user said, or the largest index plus one.
fn vertex_count(clock: &mut Clock, mesh: &Mesh) -> Result<u64> {
    let n = match (&mesh.g, mesh.vertices) {
        (Some(g), _) => g.vertices,
        (None, Some(n)) => n,
        (None, None) => {
            let ws = clock.workspace();
            clock.pass("count ids", "triangles", mesh.v.triangles, || {
                count_ids(ws, mesh)
            })?
        }
    };
    if n > MOST_VERTICES {
        return Err(Error::input(
            mesh.v.source.data().path(),
            "",
            "at most 2^56 vertices",
            n.to_string(),
            "the indices or --vertices are wrong (another type or byte order, perhaps)",
        ));
    }
    Ok(n)
}

/// The finished arrays, before they are sealed.
pub struct Built {
    /// All but G.
    pub files: Vec<OutArray>,
    /// What was counted.
    pub counts: Counts,
    /// What the vertices tell, when they were measured.
    pub measures: Option<Measures>,
    /// Corners that went to the seam pass.
    pub seam_corners: u64,
    /// Local components before stitching.
    pub local_components: u64,
}

/// The passes between the scan and the seal, by the way that suits the mesh and the budget.
fn passes<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
) -> Result<Built> {
    let left = clock.left().unwrap_or_default();
    let among = |kind: &Kind| steps_of(*kind).has(left);
    let mut way = if in_order::is_step(left) {
        Way::InOrder { whatever: true }
    } else if let Some(kind) = [Kind::Place, Kind::Id].into_iter().find(among) {
        Way::Cells(kind)
    } else {
        let way = choose::<I>(job)?;
        check_after_read(job, way)?;
        way
    };
    loop {
        let done = match way {
            Way::InOrder { whatever } => in_order::<I, W, X>(clock, job, bounds, whatever)?,
            Way::Cells(kind) => match by_cells::<I, W, X>(clock, job, bounds, kind) {
                // What does not fit here fits in file order, or the error comes again.
                Err(Error::Budget { .. }) if job.strategy == Strategy::Auto => {
                    Err(Way::InOrder { whatever: true })
                }
                done => done.map_err(|e| with_least(e, job, kind))?,
            },
        };
        match done {
            Ok(built) => return Ok(built),
            Err(next) => {
                clock.back(job.opened)?;
                way = next;
            }
        }
    }
}

/// Checksums, manifest, sync.
fn seal(clock: &mut Clock, job: &Job, built: &Built) -> Result<Manifest> {
    let ws = job.ws;
    let g = job.opened.placed.as_ref().map(|placed| &placed.file);
    let mut files: Vec<&OutArray> = built.files.iter().collect();
    files.extend(g);
    files.sort_by_key(|f| f.name);
    let warm: Vec<(&DataFile, &WarmSums)> = files.iter().map(|f| (&f.file, &f.sums)).collect();
    let all = warm.iter().map(|(_, sums)| *sums).chain(&job.mesh.sums);
    let left = all.map(WarmSums::left).sum();
    let (sums, input) = clock.pass("checksums", "bytes", left, || {
        Ok((folder::warm_sums(ws, &warm)?, job.mesh.input_entry(ws)?))
    })?;
    let entry = |(file, sums): (&&OutArray, &Vec<u64>)| FileEntry {
        name: file.name.to_owned(),
        dtype: file.descr.clone(),
        shape: file.shape.clone(),
        bytes: file.sums.bytes(),
        blocks: sums.iter().map(|s| format!("{s:016x}")).collect(),
    };
    let coords = g.as_ref().map(|g| g.descr[1..].to_owned());
    let manifest = Manifest {
        format: folder::FORMAT.to_owned(),
        version: folder::VERSION,
        conventions: Manifest::conventions(),
        index: format!("u{}", job.shape.index),
        coords,
        options: folder::Options {
            orient: job.orient,
            weld: job.mesh.welded,
        },
        counts: built.counts.clone(),
        measures: built.measures.clone(),
        input,
        files: files.iter().zip(&sums).map(entry).collect(),
        checksum: String::new(),
    };
    clock.pass("sync", "", 0, || {
        for (file, _) in &warm {
            file.sync()?;
        }
        let path = job.dir.join(folder::MANIFEST);
        let file = DataFile::create_new(&path, &ws.io)?;
        file.write_at(manifest.to_text().as_bytes(), 0)?;
        file.sync()
    })?;
    Ok(manifest)
}
