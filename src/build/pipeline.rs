//! The order of the passes, what each hands to the next, and what each cost.

use super::arrays::OutArray;
use super::chunks::{Chunked, Settled, Sinks, chunks};
use super::components::{Given, components};
use super::coords::{Placed, place};
use super::finish::{Found, Tables, apply, fill, list_cuts};
use super::plan::{Plan, Shape, Strategy};
use super::records::{EdgeCorner, Patch, narrow};
use super::scan::{count_ids, scan};
use super::seams::{Seamed, seams};
use super::stitch::stitch;
use super::{Job, staging::Staging};
use crate::chunk::grid::{Bounds, Grid};
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::{DataFile, IoCount, Workspace};
use crate::error::{Error, Result};
use crate::folder::{self, Counts, FileEntry, Manifest, Orient};
use crate::input::{CoordKind, Mesh};
use crate::shuffle::Shuffle;
use std::time::Instant;

/// What one pass cost.
#[derive(Clone, Debug)]
pub struct PassReport {
    /// Its name.
    pub name: &'static str,
    /// Wall time in seconds.
    pub seconds: f64,
    /// Bytes read and written, scratch included.
    pub io: IoCount,
}

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

/// Measures passes as they run.
pub struct Clock<'a> {
    ws: &'a Workspace,
    passes: Vec<PassReport>,
}

impl<'a> Clock<'a> {
    /// A clock before the first pass.
    pub fn new(ws: &'a Workspace) -> Self {
        Clock {
            ws,
            passes: Vec::new(),
        }
    }

    /// Runs and measures one pass of `total` units.
    ///
    /// # Errors
    /// Those of the pass.
    pub fn pass<T>(
        &mut self,
        name: &'static str,
        unit: &'static str,
        total: u64,
        run: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        let (start, before) = (Instant::now(), self.ws.io.now());
        self.ws.progress.begin(name, unit, total);
        let usage = || (self.ws.budget.used(), self.ws.scratch.used());
        self.ws.progress.usage(usage().0, usage().1);
        let done = run();
        self.ws.progress.usage(usage().0, usage().1);
        self.ws.progress.end();
        let after = self.ws.io.now();
        self.passes.push(PassReport {
            name,
            seconds: start.elapsed().as_secs_f64(),
            io: IoCount {
                read: after.read - before.read,
                written: after.written - before.written,
            },
        });
        done
    }
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
    /// How to join local components, for tests.
    pub strategy: Strategy,
}

/// Builds the folder in `staging` from an opened mesh, seals it and puts it in its place.
///
/// # Errors
/// Those of the passes.
pub fn run(
    mut clock: Clock,
    mesh: &Mesh,
    wishes: &Wishes,
    staging: Staging,
) -> Result<BuildReport> {
    let ws = clock.ws;
    let kind = mesh.g.as_ref().map(|g| wishes.coords.unwrap_or(g.kind));
    let placed = match (&mesh.g, kind) {
        (Some(g), Some(kind)) => {
            Some(
                clock.pass("coordinates", "vertices", g.vertices, || match kind {
                    CoordKind::F4 => place::<f32>(ws, staging.path(), g),
                    CoordKind::F8 => place::<f64>(ws, staging.path(), g),
                })?,
            )
        }
        _ => None,
    };
    let vertices = vertex_count(&mut clock, mesh)?;
    let triangles = mesh.v.triangles;
    check_width(wishes.narrow, triangles, vertices)?;
    let shape = Shape::new(triangles, vertices, wishes.wide, kind, ws.workers.count());
    let plan = Plan::new(&shape, ws.budget.free(), wishes.chunk, wishes.buckets)?;
    let (bounds, g, g_file) = match placed {
        Some(Placed {
            file,
            array,
            bounds,
        }) => (bounds, Some(array), Some(file)),
        None => (Bounds::default(), None, None),
    };
    let job = Job {
        ws,
        mesh,
        g,
        shape,
        plan,
        dir: staging.path(),
        orient: wishes.orient,
        strategy: wishes.strategy,
    };
    let doubles = kind == Some(CoordKind::F8);
    let built = match (shape.index == 8, narrow(triangles, vertices), doubles) {
        (false, true, false) => passes::<u32, u32, f32>(&mut clock, &job, &bounds),
        (false, true, true) => passes::<u32, u32, f64>(&mut clock, &job, &bounds),
        (false, false, false) => passes::<u32, u64, f32>(&mut clock, &job, &bounds),
        (false, false, true) => passes::<u32, u64, f64>(&mut clock, &job, &bounds),
        (true, _, false) => passes::<u64, u64, f32>(&mut clock, &job, &bounds),
        (true, _, true) => passes::<u64, u64, f64>(&mut clock, &job, &bounds),
    }?;
    let manifest = seal(&mut clock, &job, &built, g_file)?;
    let (chunk_triangles, seam_corners) = (job.plan.chunk, built.seam_corners);
    clock.pass("rename", "", 0, || staging.finish())?;
    Ok(BuildReport {
        manifest,
        passes: clock.passes,
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

/// More vertices than any mesh has: ids are packed beside a few bits.
const MOST_VERTICES: u64 = 1 << 56;

/// N: the rows of G, what the user said, or the largest index plus one.
fn vertex_count(clock: &mut Clock, mesh: &Mesh) -> Result<u64> {
    let n = match (&mesh.g, mesh.vertices) {
        (Some(g), _) => g.vertices,
        (None, Some(n)) => n,
        (None, None) => {
            let ws = clock.ws;
            clock.pass("count ids", "triangles", mesh.v.triangles, || {
                count_ids(ws, &mesh.v)
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
struct Built {
    files: Vec<OutArray>,
    counts: Counts,
    seam_corners: u64,
    local_components: u64,
}

fn passes<I: Index, W: Index, X: Coord>(
    clock: &mut Clock,
    job: &Job,
    bounds: &Bounds,
) -> Result<Built> {
    let (ws, t) = (job.ws, job.shape.triangles);
    let create =
        |name, shape: &[u64], row| OutArray::create(job.dir, name, I::DESCR, shape, row, &ws.io);
    let row = 3 * I::BYTES as u64;
    let v = create(folder::V, &[t, 3], row)?;
    let o = create(folder::O, &[t, 3], row)?;
    let component = create(folder::COMPONENT, &[t], I::BYTES as u64)?;
    let grid = Grid::new(bounds);
    let (seam_bits, unreferenced) = clock.pass("scan", "triangles", t, || scan::<I>(job))?;
    let n = job.shape.vertices.max(1);
    let record = size_of::<EdgeCorner<W>>();
    // A surface has about three edges a vertex, each with two corners.
    let expected = (6 * seam_bits.count()).min(3 * t);
    let edges = Shuffle::new(ws, "seam corners", 0..n, job.shuffle_plan(record, expected))?;
    let cuts = Shuffle::new(
        ws,
        "non-manifold corners",
        0..n,
        job.shuffle_plan(record, t / 64),
    )?;
    let chunked = clock.pass("chunks", "triangles", t, || {
        let sinks = Sinks {
            edges: &edges,
            cuts: &cuts,
            v: &v,
            o: &o,
            component: &component,
        };
        chunks::<I, W, X>(job, &seam_bits, &grid, &sinks)
    })?;
    drop(seam_bits);
    check_held(job, &chunked, 0)?;
    let spilled = chunked.settled.spilled;
    let seamed = clock.pass("seams", "corners", spilled, || {
        seams(job, &chunked, &edges.finish()?, &cuts)
    })?;
    let cuts = cuts.finish()?;
    let mut counts = tally_edges(job, &chunked, &seamed, bounds, cuts.records(), unreferenced);
    conserve(t, &counts, spilled, &seamed.settled, cuts.records())?;
    let links = seamed.links.len() / (2 * W::BYTES as u64);
    let labels = clock.pass("stitch", "links", links, || {
        stitch::<W>(job, &chunked, &seamed.links)
    })?;
    check_held(job, &chunked, labels.components)?;
    let chosen = clock.pass("components", "", 0, || {
        let given = Given {
            chunked: &chunked,
            labels: &labels,
            borders: &seamed.borders,
            cuts: &cuts,
            component: &component,
            grid: &grid,
        };
        components::<I, W, X>(job, &given, &mut counts)
    })?;
    drop(cuts);
    let flipped = OutArray::create(job.dir, folder::FLIPPED, "|u1", &[t.div_ceil(8)], 1, &ws.io)?;
    let degenerate = create(folder::DEGENERATE, &[counts.degenerate], I::BYTES as u64)?;
    let tables = Tables {
        v: &v,
        o: &o,
        component: &component,
        flipped: &flipped,
        degenerate: &degenerate,
    };
    let found = Found {
        chunked: &chunked,
        labels: &labels,
        chosen: &chosen,
    };
    let patches: &crate::shuffle::Buckets<Patch<W>> = &seamed.patches;
    let lists = clock.pass("finish", "items", t + patches.records(), || {
        apply::<I, W>(job, &found, &tables)?;
        fill::<I, W>(job, &found, patches, &tables, counts.flipped_triangles > 0)?;
        list_cuts::<I, W>(job, &found, counts.nonmanifold_edges)
    })?;
    let local_components = chunked.locals();
    let [cut_edges, cut_corners] = lists;
    Ok(Built {
        files: vec![
            v,
            o,
            component,
            flipped,
            chosen.table,
            cut_edges,
            cut_corners,
            degenerate,
        ],
        counts,
        seam_corners: spilled,
        local_components,
    })
}

/// Refuses, now that the table of chunks is there, a budget that is too small for what comes
/// after it; and, once the components are counted, for two bits for each of them.
fn check_held(job: &Job, chunked: &Chunked, components: u64) -> Result<()> {
    let table = chunked.table_bytes();
    let need = job.shape.least_after_chunks(&job.plan, components, table);
    let have = job.ws.budget.limit();
    if need > have {
        return Err(Error::Budget {
            what: match components {
                0 => format!("the table of {} chunks", chunked.infos.len()),
                _ => format!("two bits for each of {components} components"),
            },
            // A quarter more than what is short: the other parts grow with the budget.
            need: need + (need - have) / 4,
            have,
        });
    }
    Ok(())
}

/// The counts of edges and vertices, known before the components are.
fn tally_edges<W: Index>(
    job: &Job,
    chunked: &Chunked,
    seamed: &Seamed<W>,
    bounds: &Bounds,
    cut_corners: u64,
    unreferenced: u64,
) -> Counts {
    let (a, b) = (&chunked.settled, &seamed.settled);
    let regular = a.regular + b.regular;
    let border = a.borders + b.borders;
    let nonmanifold = a.nonmanifold + b.nonmanifold;
    Counts {
        triangles: job.shape.triangles,
        vertices: job.shape.vertices,
        unreferenced_vertices: unreferenced,
        nonfinite_vertices: bounds.nonfinite,
        degenerate: a.degenerate,
        distinct_edges: regular + border + nonmanifold,
        regular_edges: regular,
        border_edges: border,
        nonmanifold_edges: nonmanifold,
        nonmanifold_corners: cut_corners,
        inconsistent_edges: a.inconsistent + b.inconsistent,
        polygons_fanned: job.mesh.polygons_fanned,
        ..Counts::default()
    }
}

/// Every corner is accounted for once: a mismatch is a fault of this program.
fn conserve(triangles: u64, c: &Counts, spilled: u64, seams: &Settled, cuts: u64) -> Result<()> {
    let corners = 2 * c.regular_edges + c.border_edges + cuts + 3 * c.degenerate;
    if corners != 3 * triangles {
        return Err(Error::Internal(format!(
            "the chunk and seam passes settled {corners} of {} corners",
            3 * triangles
        )));
    }
    if 2 * seams.regular + seams.borders > spilled {
        return Err(Error::Internal(format!(
            "the seam pass settled more corners than the {spilled} that were spilled"
        )));
    }
    Ok(())
}

/// Checksums, manifest, sync.
fn seal(clock: &mut Clock, job: &Job, built: &Built, g: Option<OutArray>) -> Result<Manifest> {
    let ws = job.ws;
    let mut files: Vec<&OutArray> = built.files.iter().collect();
    files.extend(&g);
    files.sort_by_key(|f| f.name);
    let data: Vec<&DataFile> = files.iter().map(|f| &f.file).collect();
    let mut bytes = Vec::new();
    for file in &data {
        bytes.push(file.len()?);
    }
    let total = bytes.iter().sum();
    let sums = clock.pass("checksums", "bytes", total, || {
        folder::block_sums(ws, &data)
    })?;
    let entry = |((file, sums), &bytes): ((&&OutArray, &Vec<u64>), &u64)| FileEntry {
        name: file.name.to_owned(),
        dtype: file.descr.clone(),
        shape: file.shape.clone(),
        bytes,
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
        input: job.mesh.entry.clone(),
        files: files.iter().zip(&sums).zip(&bytes).map(entry).collect(),
        checksum: String::new(),
    };
    clock.pass("sync", "", 0, || {
        for file in &data {
            file.sync()?;
        }
        let path = job.dir.join(folder::MANIFEST);
        let file = DataFile::create_new(&path, &ws.io)?;
        file.write_at(manifest.to_text().as_bytes(), 0)?;
        file.sync()
    })?;
    Ok(manifest)
}
