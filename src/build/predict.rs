//! What a build will take: memory, scratch space, output and passes, from counts alone.
//!
//! Why it can be known: the folder's arrays follow from T and N; what the passes hand to each
//! other are records of fixed widths, so only their numbers are open. Those depend on the order
//! of the triangles, for which two answers are given:
//!
//! - **coherent**: consecutive triangles are near on the surface, so that a chunk is a patch, or
//!   a strip as wide as the mesh: few corners are spilled. Where the surface closes, a strip
//!   names vertices far apart in G. One component, nothing to turn, no culprits.
//! - **the worst order**: triangles and ids at random. Every corner is spilled, every triangle
//!   is a local component, and coordinates come to the corners through two sorts. Still few
//!   components: a mesh of millions of them sends their sums through scratch as well.
//!
//! Memory: none. I/O: none.

use super::chunks::table_bytes;
use super::deferred::ASKED;
use super::finish::SPAN;
use super::plan::{Plan, Shape, check_least};
use super::records::{EdgeCorner, Link, LocalCount, MeasureRecord, Patch, narrow};
use crate::disk::IoCount;
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::folder::{self, BLOCK, COMPONENT_DESCR, ComponentRow, EDGE_DESCR, FileEntry};
use crate::input::{CoordKind, Format, Survey, WeldCost, WeldSize, closed_vertices};
use crate::shuffle::tail;

/// Beyond this no count is believed; products of counts and widths stay below 2^64.
const MOST: u64 = 1 << 50;
/// Bytes of a manifest without its checksums, about.
const MANIFEST_BYTES: u64 = 5 << 10;
/// Bytes of a manifest's line with a checksum.
const CHECKSUM_LINE: u64 = 29;

/// What a build would take.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// What is known of the input.
    pub survey: Survey,
    /// Sizes of the mesh; vertices are guessed when the survey does not have them.
    pub shape: Shape,
    /// The budget, in bytes.
    pub memory: u64,
    /// The least budget for a coherent mesh, in bytes.
    pub least_memory: u64,
    /// A budget that suffices for the worst order, in bytes.
    pub worst_memory: u64,
    /// How the budget would be cut up (the least one, when it is too small).
    pub plan: Plan,
    /// The arrays of the folder, without checksums.
    pub arrays: Vec<FileEntry>,
    /// Bytes of the finished folder: the arrays, and the manifest about.
    pub output: u64,
    /// The most scratch space at once for a coherent mesh, in bytes.
    pub scratch: u64,
    /// The most scratch space at once for the worst order, in bytes.
    pub worst_scratch: u64,
    /// The passes in order, for a coherent mesh.
    pub passes: Vec<PassPrediction>,
    /// True when the output is there already, so that a build needs `--force`.
    pub exists: bool,
}

/// What one pass would do.
#[derive(Clone, Debug)]
pub struct PassPrediction {
    /// Its name, as a build reports it.
    pub name: &'static str,
    /// What it counts.
    pub unit: &'static str,
    /// How many of them.
    pub units: u64,
    /// Bytes read and written, scratch included.
    pub io: IoCount,
}

/// What the options say of sizes.
pub struct Sizes {
    /// The budget in bytes.
    pub memory: u64,
    /// Threads.
    pub threads: usize,
    /// Indices of 8 bytes whatever the counts.
    pub wide: bool,
    /// Triangles of a chunk, for tests.
    pub chunk: Option<u64>,
    /// Buckets of a shuffle, for tests.
    pub buckets: Option<usize>,
}

impl Prediction {
    /// Predicts for a surveyed input.
    ///
    /// # Errors
    /// [`Error::Usage`] for counts beyond any mesh.
    pub fn new(survey: Survey, sizes: &Sizes, exists: bool) -> Result<Prediction> {
        let triangles = survey.triangles;
        let vertices = survey.vertices.unwrap_or(closed_vertices(triangles));
        if triangles.max(vertices) > MOST {
            return Err(Error::Usage(format!(
                "{triangles} triangles and {vertices} vertices are beyond any mesh"
            )));
        }
        let shape = Shape::new(
            triangles,
            vertices,
            sizes.wide,
            survey.coords,
            sizes.threads,
        );
        let least = shape.least();
        let plan = Plan::new(&shape, sizes.memory.max(least), sizes.chunk, sizes.buckets)?;
        let arrays = arrays(&shape);
        let checksums: u64 = arrays.iter().map(|a| a.bytes.div_ceil(BLOCK)).sum();
        let data: u64 = arrays.iter().map(|a| a.bytes).sum();
        let coherent = Load::new(&survey, shape, plan, sizes.memory.max(least), false);
        let worst = Load::new(&survey, shape, plan, sizes.memory.max(least), true);
        let manifest = MANIFEST_BYTES + CHECKSUM_LINE * checksums;
        Ok(Prediction {
            memory: sizes.memory,
            least_memory: least,
            worst_memory: enough(&shape, worst.locals, worst.width)?,
            plan,
            output: data + manifest,
            scratch: coherent.scratch(),
            worst_scratch: worst.scratch(),
            passes: coherent.passes(&survey, data, manifest),
            arrays,
            survey,
            shape,
            exists,
        })
    }

    /// Holds the budget to the least.
    ///
    /// # Errors
    /// [`Error::Budget`], as the build would say it.
    pub fn check(&self) -> Result<()> {
        check_least(self.memory, self.shape.threads)
    }
}

/// A budget that suffices when `nodes` local components are left by the chunks.
fn enough(shape: &Shape, nodes: u64, width: u64) -> Result<u64> {
    let mut memory = shape.least();
    loop {
        // Chunks and writers grow with the budget, but less than it.
        let plan = Plan::new(shape, memory, None, None)?;
        let table = table_bytes(plan.chunks(shape.triangles));
        let need = shape.least_after_chunks(&plan, nodes, width, table);
        if need <= memory {
            return Ok(memory);
        }
        memory = need + (need - memory) / 4;
    }
}

/// The arrays of a folder with one component and no culprits.
fn arrays(shape: &Shape) -> Vec<FileEntry> {
    let (t, index) = (shape.triangles, shape.index);
    let id = format!("<u{index}");
    let entry = |name: &str, dtype: &str, dims: &[u64], row: u64| FileEntry {
        name: name.to_owned(),
        dtype: dtype.to_owned(),
        shape: dims.to_vec(),
        bytes: DATA_START + dims[0] * row,
        blocks: Vec::new(),
    };
    let mut arrays = vec![
        entry(folder::V, &id, &[t, 3], 3 * index),
        entry(folder::O, &id, &[t, 3], 3 * index),
        entry(folder::COMPONENT, &id, &[t], index),
        entry(folder::FLIPPED, "|u1", &[t.div_ceil(8)], 1),
        entry(
            folder::COMPONENTS,
            COMPONENT_DESCR,
            &[t.min(1)],
            size_of::<ComponentRow>() as u64,
        ),
        entry(folder::NONMANIFOLD_EDGES, EDGE_DESCR, &[0], 0),
        entry(folder::NONMANIFOLD_CORNERS, &id, &[0], 0),
        entry(folder::DEGENERATE, &id, &[0], 0),
    ];
    if shape.coord > 0 {
        let dtype = format!("<f{}", shape.coord);
        let dims = [shape.vertices, 3];
        arrays.push(entry(folder::G, &dtype, &dims, 3 * shape.coord));
    }
    arrays.sort_by(|a, b| a.name.cmp(&b.name));
    arrays
}

/// How many records the passes of a build hand to each other, and how wide they are.
struct Load {
    shape: Shape,
    plan: Plan,
    chunks: u64,
    /// Bytes of an id in a record.
    width: u64,
    /// Corners spilled by the chunks.
    spilled: u64,
    /// Local components.
    locals: u64,
    /// Triangles whose coordinates are brought to them through sorts.
    deferred: u64,
    /// Bytes of V as the passes read it, and of it in scratch.
    v: [u64; 2],
    /// Bytes of G in the folder.
    g: u64,
    weld: WeldCost,
}

impl Load {
    fn new(survey: &Survey, shape: Shape, plan: Plan, memory: u64, worst: bool) -> Load {
        let (t, n) = (shape.triangles, shape.vertices);
        let chunks = plan.chunks(t);
        // Two corners on each edge of a border as long as a strip's. When ids share the bits of
        // the scan, nearly every vertex counts as one between chunks.
        let strip = 4 * t.isqrt();
        let spilled = if worst || plan.bits < n {
            3 * t
        } else if chunks < 2 {
            0
        } else {
            (chunks * strip).min(3 * t)
        };
        let v = t * survey.v_row;
        let g = 3 * n * shape.coord;
        let weld = WeldSize {
            triangles: t,
            vertices: n,
            coords: survey.coords.unwrap_or(CoordKind::F4),
            memory,
            wide: survey.v_row == 24,
            indexed: survey.rows.map(|[v, g]| [v * t, g * n]),
            decoded: !matches!(survey.format, Format::Npy | Format::Raw),
            worst,
        };
        let width = if shape.index == 4 && narrow(t, n) {
            4
        } else {
            8
        };
        Load {
            shape,
            plan,
            chunks,
            width,
            spilled,
            locals: if worst { t } else { t.min(16 * chunks) },
            deferred: match (worst, chunks) {
                _ if shape.coord == 0 => 0,
                (true, _) => t,
                (false, 0 | 1) => 0,
                (false, _) => (plan.chunk + strip).min(t),
            },
            v: [v, if survey.decoded { v } else { 0 }],
            g,
            weld: if survey.welded {
                weld.cost()
            } else {
                WeldCost::default()
            },
        }
    }
    /// Bytes of the spilled corners, and of the opposites and links that they become.
    fn seams(&self) -> [u64; 3] {
        // Records of every width have the same number of ids.
        let ids = |record: usize| (record / size_of::<u32>()) as u64 * self.width;
        [
            self.spilled * ids(size_of::<EdgeCorner<u32>>()),
            self.spilled * ids(size_of::<Patch<u32>>()),
            self.spilled / 2 * ids(size_of::<Link<u32>>()),
        ]
    }

    /// Bytes of what the chunks know of their local components.
    fn known(&self) -> [u64; 2] {
        let measured = self.shape.coord > 0 && self.deferred < self.shape.triangles.max(1);
        [
            self.locals * size_of::<LocalCount>() as u64,
            u64::from(measured) * self.locals * size_of::<MeasureRecord>() as u64,
        ]
    }

    /// The most scratch space at once.
    fn scratch(&self) -> u64 {
        let rest = |bytes| tail(bytes, self.shape.threads, self.plan.writer);
        let flips = self.chunks * self.plan.chunk.div_ceil(8);
        let held = self.v[1] + flips + self.known().iter().sum::<u64>();
        let [corners, opposites, links] = self.seams();
        let seams = held + corners.max(opposites + links) + rest(corners);
        let mut most = self.weld.scratch.max(seams);
        if self.deferred > 0 {
            let [asks, answers] = self.asked();
            most = most.max(held + opposites + links + asks.max(answers) + rest(asks));
        }
        most
    }

    /// Bytes of the questions for coordinates, and of the answers.
    fn asked(&self) -> [u64; 2] {
        ASKED.map(|bytes| 3 * self.deferred * bytes)
    }

    /// The passes, with what each reads and writes.
    fn passes(&self, survey: &Survey, data: u64, manifest: u64) -> Vec<PassPrediction> {
        let Shape {
            triangles: t,
            vertices: n,
            index,
            coord,
            ..
        } = self.shape;
        let mut passes = Vec::new();
        let mut pass = |name, unit, units, read, written| {
            let io = IoCount { read, written };
            passes.push(PassPrediction {
                name,
                unit,
                units,
                io,
            });
        };
        let [v, in_scratch] = self.v;
        let own_g = survey.rows.map_or(0, |[_, g]| g * n);
        let decoded = match (survey.decoded, survey.welded) {
            (false, _) => 0,
            (_, false) => in_scratch + self.g,
            (_, true) if matches!(survey.format, Format::Npy | Format::Raw) => self.weld.written,
            (_, true) => self.weld.written + survey.rows.map_or(0, |[v, g]| v * t + g * n),
        };
        let bytes = survey.input_bytes;
        pass("read", "bytes", bytes, bytes + self.weld.read, decoded);
        if coord > 0 {
            let (read, written) = if survey.decoded {
                (self.g, 0)
            } else {
                (own_g, self.g)
            };
            pass("coordinates", "vertices", n, read, DATA_START + written);
        }
        if survey.vertices.is_none() {
            pass("count ids", "triangles", t, v, 0);
        }
        let ranges = if self.plan.bits < n {
            n.div_ceil(self.plan.bits)
        } else {
            0
        };
        pass("scan", "triangles", t, v * (1 + ranges), 0);
        let [corners, opposites, links] = self.seams();
        let [counts, measures] = self.known();
        let rows = 7 * index * t;
        let written = rows + corners + counts + measures;
        pass("chunks", "triangles", t, v + self.g, written);
        pass("seams", "corners", self.spilled, corners, opposites + links);
        pass("stitch", "links", self.spilled / 2, links + counts, 0);
        let table = DATA_START + size_of::<ComponentRow>() as u64;
        let asked: u64 = self.asked().iter().sum();
        let again = self.deferred * (survey.v_row + 3 * coord);
        let read = counts + measures + asked + again;
        pass("components", "", 0, read, table + asked);
        // An opposite lies in a row of triangles along a border, read in spans and written back.
        let touched = (6 * self.spilled + 2 * SPAN * self.chunks).min(3 * t);
        let spans = if self.spilled > 0 { index * touched } else { 0 };
        let items = t + self.spilled;
        pass(
            "finish",
            "items",
            items,
            opposites + spans,
            2 * DATA_START + spans,
        );
        pass("checksums", "bytes", data, data, 0);
        pass("sync", "", 0, 0, manifest);
        pass("rename", "", 0, 0, 0);
        passes
    }
}
