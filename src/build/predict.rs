//! What a build will take: memory, scratch space, output and passes, from counts, and from the
//! nature of the mesh where some triangles told it.
//!
//! Why it can be known: the folder's arrays follow from T and N; what the passes hand to each
//! other are records of fixed widths, so only their numbers are open. Those depend on the order
//! of the triangles, and on vertices and edges that a great part of them share: the
//! [nature](super::sample) of the mesh. Answers are given for the nature that some of its triangles
//! showed, and for three that bound it:
//!
//! - **coherent**: consecutive triangles are near on the surface, so that a chunk is a patch, or
//!   a strip as wide as the mesh: few corners are spilled. Where the surface closes, a strip
//!   names vertices far apart in G. One component, nothing to turn, no culprits.
//! - **the worst order**: triangles and ids at random. Every corner is spilled, every triangle
//!   is a local component, and coordinates come to the corners through two sorts. Still few
//!   components.
//! - **any mesh**: crowds in the worst order, around a vertex or all the same, so that every corner is
//!   sorted once more by its hub, or every triangle is a component.
//!
//! Memory: none. I/O: none.

use super::chunked::table_bytes;
use super::load::{Load, PassPrediction};
use super::phases::{Phase, phases};
use super::plan::{Plan, Shape};
use super::sample::{Hubs, Nature};
use super::way::fitting;
use crate::error::{Error, Result};
use crate::folder::npy::DATA_START;
use crate::folder::{self, BLOCK, EDGE_DESCR, FileEntry};
use crate::input::{Survey, closed_vertices};

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
    /// A budget that suffices, close to the least that does, in bytes.
    pub least_memory: u64,
    /// A budget with which labels stay in memory in the worst order, in bytes.
    pub label_memory: u64,
    /// How the budget would be cut up (the least one, when it is too small).
    pub plan: Plan,
    /// The plan, phase by phase.
    pub phases: Vec<Phase>,
    /// The arrays of the folder, without checksums.
    pub arrays: Vec<FileEntry>,
    /// Bytes of the finished folder: the arrays, and the manifest about.
    pub output: u64,
    /// The most scratch space at once that is expected of this mesh, in bytes: by what some of its
    /// triangles tell, where some were found, else as if it were coherent.
    pub expected_scratch: u64,
    /// Triangles that were looked at; none where none were found.
    pub looked_at: u64,
    /// The most scratch space at once for a coherent mesh, in bytes.
    pub scratch: u64,
    /// The most scratch space at once for the worst order, in bytes.
    pub worst_scratch: u64,
    /// The most scratch space at once for any mesh of these counts, in bytes.
    pub most_scratch: u64,
    /// The passes in order, for a coherent mesh.
    pub passes: Vec<PassPrediction>,
    /// True when the output is there already, so that a build needs `--force`.
    pub exists: bool,
    /// Sizes that the mesh has at least.
    pub(super) certain: Shape,
    /// What a build in file order takes for certain, where no other way fits the budget.
    hopeless: Option<u64>,
}

/// What the options say of sizes.
pub struct Sizes {
    /// The budget in bytes.
    pub memory: u64,
    /// Threads.
    pub threads: usize,
    /// Whether to measure the vertices.
    pub measures: bool,
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
        let shape = |[triangles, vertices]: [u64; 2]| {
            let (coords, threads) = (survey.coords, sizes.threads);
            let (wide, measures) = (sizes.wide, sizes.measures);
            Shape::new(triangles, vertices, wide, coords, threads, measures)
        };
        let (certain, shape) = (shape(survey.least), shape([triangles, vertices]));
        let least = enough(&shape, 0)?;
        let plan = Plan::new(&shape, sizes.memory.max(least), sizes.chunk, sizes.buckets)?;
        let arrays = arrays(&shape, &Parts::new(&survey, &shape, &Hubs::default()));
        let (data, manifest) = sizes_of(&arrays);
        let memory = sizes.memory.max(least);
        let load = |nature| Load::new(&survey, shape, plan, memory, nature);
        let coherent = load(Nature::coherent(triangles));
        let worst = load(Nature::random()).scratch();
        let crowds = [false, true].map(|knotted| load(Nature::crowd(knotted)).scratch());
        Ok(Prediction {
            memory: sizes.memory,
            least_memory: least,
            label_memory: enough(&shape, triangles)?,
            phases: phases(&shape, &plan, sizes.memory.max(least)),
            plan,
            output: data + manifest,
            expected_scratch: coherent.scratch(),
            looked_at: 0,
            scratch: coherent.scratch(),
            worst_scratch: worst,
            // What chunks, cells and sorts hold besides is not known to the byte.
            most_scratch: crowds.into_iter().fold(worst, u64::max) / 4 * 5,
            passes: coherent.passes(&survey, data, manifest),
            arrays,
            hopeless: hopeless(&survey, certain, sizes),
            certain,
            survey,
            shape,
            exists,
        })
    }

    /// Expects what a mesh of this nature takes.
    pub fn expect(&mut self, nature: Nature) {
        let memory = self.memory.max(self.least_memory);
        let load = Load::new(&self.survey, self.shape, self.plan, memory, nature);
        (self.expected_scratch, self.looked_at) = (load.scratch(), nature.looked);
        let parts = Parts::new(&self.survey, &self.shape, &nature.hubs);
        self.arrays = arrays(&self.shape, &parts);
        let (data, manifest) = sizes_of(&self.arrays);
        self.output = data + manifest;
    }

    /// Refuses a budget that is certain to be too small; one below the least may do, when the
    /// triangles turn out to lie in no order.
    ///
    /// # Errors
    /// [`Error::Budget`] with the least, like a build.
    pub(super) fn check_certain(&self) -> Result<()> {
        match self.hopeless {
            Some(need) => Err(self.too_small(need)),
            None => Ok(()),
        }
    }

    /// Holds the budget to the least.
    ///
    /// # Errors
    /// [`Error::Budget`] with the least, like a build.
    pub fn check(&self) -> Result<()> {
        if self.memory >= self.least_memory {
            return Ok(());
        }
        Err(self.too_small(self.least_memory))
    }

    fn too_small(&self, need: u64) -> Error {
        let Shape {
            triangles, threads, ..
        } = self.shape;
        Error::Budget {
            what: format!("{triangles} triangles on {threads} threads"),
            need: need.max(self.least_memory),
            have: self.memory,
        }
    }
}

/// What a build in file order takes in memory at least, when that is more than there is, and the
/// triangles, which are counted, cannot go through cells either.
fn hopeless(survey: &Survey, certain: Shape, sizes: &Sizes) -> Option<u64> {
    if certain.triangles != survey.triangles {
        return None;
    }
    // The more bits the scan takes, the less is left for writers, and so to be held.
    let vertices = match survey.exact {
        true => certain.vertices,
        false => 3 * certain.triangles,
    };
    let most = Shape {
        vertices,
        ..certain
    };
    let plan = Plan::new(&most, sizes.memory, sizes.chunk, sizes.buckets).ok()?;
    let table = table_bytes(plan.chunks(certain.triangles));
    let need = certain.least_after_chunks(&plan, 0, table);
    let cells = fitting(&certain, &plan, sizes.memory);
    // A quarter more than what is short, as the build itself says.
    (need > sizes.memory && cells.is_none()).then(|| need + (need - sizes.memory) / 4)
}

/// A budget that suffices, close to the least that does, with so many labels in memory.
fn enough(shape: &Shape, labels: u64) -> Result<u64> {
    let mut memory = shape.least();
    loop {
        // Chunks and writers grow with the budget, but less than it.
        let plan = Plan::new(shape, memory, None, None)?;
        let table = table_bytes(plan.chunks(shape.triangles));
        let need = match labels {
            0 => shape.least_after_chunks(&plan, 1, table),
            _ => shape.fits_labels(&plan, labels, shape.record(), table),
        };
        if need <= memory {
            return Ok(memory);
        }
        memory = need + (need - memory) / 4;
    }
}

/// What a mesh falls into, as counts and hubs tell.
struct Parts {
    components: u64,
    /// Corners of edges of many triangles.
    cut: u64,
    /// Triangles that are there more than once.
    duplicate: u64,
}

impl Parts {
    /// Why counts tell: a component of t triangles, which edges join, names t + 2 vertices or fewer.
    ///
    /// Why hubs tell: an edge between two of them has many triangles and joins none. So a triangle
    /// with three corners at hubs is a component of its own, and others with two are joined only where
    /// they name the same third vertex.
    fn new(survey: &Survey, shape: &Shape, hubs: &Hubs) -> Parts {
        let t = shape.triangles;
        let vertices = match survey.welded {
            true => 0,
            false => shape.vertices,
        };
        let part = |share: f64| (share * t as f64) as u64;
        let (knotted, enclosed) = (part(hubs.knotted), part(hubs.enclosed()));
        let at_hubs = enclosed + knotted.saturating_sub(enclosed).min(vertices);
        let apart = vertices.saturating_sub(t) / 2;
        Parts {
            components: apart.max(at_hubs).max(1).min(t),
            cut: part(hubs.knots),
            duplicate: enclosed,
        }
    }
}

/// Bytes of these arrays, and of their manifest about.
fn sizes_of(arrays: &[FileEntry]) -> (u64, u64) {
    let checksums: u64 = arrays.iter().map(|a| a.bytes.div_ceil(BLOCK)).sum();
    let data = arrays.iter().map(|a| a.bytes).sum();
    (data, MANIFEST_BYTES + CHECKSUM_LINE * checksums)
}

/// The arrays of a folder with one component and no culprits.
pub fn least_arrays(shape: &Shape) -> Vec<FileEntry> {
    let parts = Parts {
        components: shape.triangles.min(1),
        cut: 0,
        duplicate: 0,
    };
    arrays(shape, &parts)
}

/// The arrays of a folder of so many components and culprits.
fn arrays(shape: &Shape, parts: &Parts) -> Vec<FileEntry> {
    let (t, index) = (shape.triangles, shape.index);
    let id = format!("<u{index}");
    let entry = |name: &str, dtype: &str, dims: &[u64], row: u64| FileEntry {
        name: name.to_owned(),
        dtype: dtype.to_owned(),
        shape: dims.to_vec(),
        bytes: DATA_START + dims[0] * row,
        blocks: Vec::new(),
    };
    let (table, row) = folder::row_type(shape.measures);
    let mut arrays = vec![
        entry(folder::V, &id, &[t, 3], 3 * index),
        entry(folder::O, &id, &[t, 3], 3 * index),
        entry(folder::COMPONENT, &id, &[t], index),
        entry(folder::FLIPPED, "|u1", &[t.div_ceil(8)], 1),
        entry(folder::COMPONENTS, table, &[parts.components], row),
        entry(folder::NONMANIFOLD_EDGES, EDGE_DESCR, &[0], 0),
        entry(folder::NONMANIFOLD_CORNERS, &id, &[parts.cut], index),
        entry(folder::DEGENERATE, &id, &[0], 0),
    ];
    if shape.measures {
        arrays.push(entry(folder::NONMANIFOLD_VERTICES, &id, &[0], 0));
        arrays.push(entry(folder::DUPLICATE, &id, &[parts.duplicate], index));
    }
    if shape.coord > 0 {
        let dtype = format!("<f{}", shape.coord);
        let dims = [shape.vertices, 3];
        arrays.push(entry(folder::G, &dtype, &dims, 3 * shape.coord));
    }
    arrays.sort_by(|a, b| a.name.cmp(&b.name));
    arrays
}
