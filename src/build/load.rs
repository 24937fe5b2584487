//! The load of a build: how many records its passes hand to each other, how wide they are, and
//! so what each pass reads and writes and what lies in scratch at once.
//!
//! Why it holds: every width is taken from the record's own type, and what is alive together
//! follows from the order of the passes. What is only guessed is the number of records, from
//! the [nature](super::sample) of the mesh.
//!
//! Memory: none. I/O: none.

use super::asked::asked;
use super::cells::CellPlan;
use super::cells::records::{NodeCount, NodeMeasure};
use super::chunked::table_bytes;
use super::crowd::Crowd;
use super::fill::SPAN;
use super::piece::Piece;
use super::plan::{Plan, Shape};
use super::records::{EdgeCorner, Link, LocalCount, MeasureRecord, Patch};
use super::sample::{Nature, Rim};
use super::stars::records::Part;
use super::way::{Kind, fitting, helpful};
use crate::disk::IoCount;
use crate::folder::npy::DATA_START;
use crate::folder::row_type;
use crate::input::{CoordKind, Format, Survey, WeldCost, WeldSize};
use crate::shuffle::tail;

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

/// The most scratch space at once, but for V, of a mesh in random order that goes through cells;
/// `None` when it goes in file order.
fn through_cells(shape: &Shape, plan: &Plan, memory: u64, nature: &Nature) -> Option<u64> {
    let kind = fitting(shape, plan, memory).filter(|_| helpful(shape, plan))?;
    let cells = CellPlan::new(shape, memory, kind == Kind::Place, plan.buckets);
    let (t, w) = (shape.triangles, shape.record());
    let whole = CellPlan::maps_all(shape, memory);
    let spots = match kind {
        Kind::Place if shape.coord > 0 && !whole => shape.vertices * 4 * w.max(shape.coord),
        _ => 0,
    };
    // Patches of a surface have borders like discs; ranges of random ids have nothing else.
    // What a surface is expected to have is a quarter of what any may have.
    let (long, nodes) = match nature.looked {
        0 => (8, t / 32),
        _ => (2, 8 * cells.cells),
    };
    let (parted, nodes) = match kind {
        Kind::Place => ((t * long / (t / cells.cells).isqrt().max(1)).min(t), nodes),
        Kind::Id => (t, t),
    };
    // A triangle need not be parted to have a vertex elsewhere.
    let unmeasured = match kind {
        _ if shape.coord == 0 || whole => 0,
        Kind::Place => (2 * parted).min(t),
        Kind::Id => t,
    };
    let dealt = 4 * w * t + 3 * w * parted;
    let counted = size_of::<NodeCount>() + size_of::<NodeMeasure>();
    // Two or three triangles of each vertex between patches, each with a part of a fan.
    let parts = if shape.measures {
        (2 * parted).min(3 * t)
    } else {
        0
    };
    let crowd = Crowd::new(shape, nature).beside(5 * w * t);
    let told =
        5 * w * t + (6 * parted + 8 * parts) * w + nodes * counted as u64 + 5 * w * unmeasured;
    let asked = 3 * unmeasured * asked(w, shape.coord).iter().sum::<u64>();
    let rest = tail(dealt, shape.threads, plan.writer);
    Some((dealt + spots).max(told + rest.max(asked)).max(crowd))
}

/// How many records the passes of a build hand to each other, and how wide they are.
pub struct Load {
    shape: Shape,
    plan: Plan,
    nature: Nature,
    chunks: u64,
    /// Bytes of an id in a record.
    width: u64,
    /// Corners spilled by the chunks.
    spilled: u64,
    /// Components of one triangle.
    single: u64,
    /// Parts of fans.
    parts: u64,
    /// Triangles that may have twins.
    twins: u64,
    /// Local components.
    locals: u64,
    /// True when their labels do not fit in memory.
    contracts: bool,
    /// Triangles whose coordinates are brought to them through sorts.
    deferred: u64,
    /// Bytes in scratch when the mesh goes through cells instead, but for V.
    cells: Option<u64>,
    /// True when it goes through cells in a little less memory too.
    surely: bool,
    /// Bytes of V as the passes read it, and of it in scratch.
    v: [u64; 2],
    /// Bytes of G in the folder.
    g: u64,
    weld: WeldCost,
}

impl Load {
    /// The load of a surveyed mesh of this nature under a plan.
    pub fn new(survey: &Survey, shape: Shape, plan: Plan, memory: u64, nature: Nature) -> Load {
        let (t, n) = (shape.triangles, shape.vertices);
        let chunks = plan.chunks(t);
        let part = |share: f64| (share * t as f64) as u64;
        let own = nature.rim(plan.chunk);
        let rim = if chunks < 2 { Rim::default() } else { own };
        let all = |of_chunk: f64, most: u64| ((chunks as f64 * of_chunk) as u64).min(most);
        // When ids share the bits of the scan, nearly every vertex counts as one between chunks.
        let spilled = if plan.bits < n {
            3 * t
        } else {
            all(rim.corners, 3 * t)
        };
        let scattered = spilled == 3 * t;
        let of = |of_chunk, most| if scattered { most } else { all(of_chunk, most) };
        // What shares nothing with others is a component.
        let isolated = own.vertices <= nature.hubs.number as f64;
        let locals = match chunks < 2 && !isolated {
            true => (16 + part(nature.hubs.knotted)).min(t),
            false => of(own.locals, t),
        };
        let single = match isolated {
            true => locals,
            false => part(nature.hubs.knotted),
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
            worst: nature.scattered,
        };
        let width = shape.record();
        let labels = shape.fits_labels(&plan, locals, width, table_bytes(chunks));
        let held = if labels > memory { 0 } else { locals * width } + n / 8;
        let cells = |memory| through_cells(&shape, &plan, memory, &nature);
        // Rims are shared by two chunks.
        let seams = (all(rim.vertices, 2 * n) / 2).max(nature.hubs.number);
        let to_cells = nature.scattered || chunks > 1 && 3 * seams > n;
        Load {
            chunks,
            width,
            spilled,
            single,
            parts: of(rim.parts, 3 * t),
            twins: of(rim.twins, t),
            locals,
            contracts: labels > memory,
            deferred: match chunks {
                // When they are measured, labels are held, and half of the rest may map G whole.
                _ if g <= (memory / 16 * 15).saturating_sub(held) / 2 => 0,
                _ if nature.scattered => t,
                0 | 1 => part(nature.far),
                // The chunk where the surface closes names vertices far apart.
                _ => part(nature.far)
                    .max(plan.chunk + rim.vertices as u64)
                    .min(t),
            },
            cells: cells(memory).filter(|_| to_cells),
            // What the build holds all the time is not known here to the byte.
            surely: cells(memory / 8 * 7).is_some(),
            v: [v, if survey.decoded { v } else { 0 }],
            g,
            weld: if survey.welded {
                weld.cost()
            } else {
                WeldCost::default()
            },
            shape,
            plan,
            nature,
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

    /// Bytes of the parts, and of the triangles that may have twins.
    fn stars(&self) -> u64 {
        if !self.shape.measures {
            return 0;
        }
        let parts = size_of::<Part<u32>>() as u64 / 4 * self.width;
        self.parts * parts + self.twins * 4 * self.width
    }

    /// Bytes of what the chunks know of their local components.
    fn known(&self) -> [u64; 2] {
        let measured = self.shape.coord > 0 && self.deferred < self.shape.triangles.max(1);
        // Chunks of crowds do not measure.
        let measured = measured && 16 * self.locals < self.shape.triangles + 128 * self.chunks;
        [
            self.locals * size_of::<LocalCount>() as u64,
            u64::from(measured) * self.locals * size_of::<MeasureRecord>() as u64,
        ]
    }

    /// The most scratch space at once.
    pub fn scratch(&self) -> u64 {
        let through_cells = self.weld.scratch.max(self.v[1] + self.cells.unwrap_or(0));
        if self.cells.is_some() && self.surely {
            return through_cells;
        }
        through_cells.max(self.in_order())
    }

    /// The same when the mesh goes in file order.
    fn in_order(&self) -> u64 {
        let rest = |bytes| tail(bytes, self.shape.threads, self.plan.writer);
        let flips = self.chunks * self.plan.chunk.div_ceil(8);
        let held = self.v[1] + flips + self.known().iter().sum::<u64>();
        let [corners, opposites, links] = self.seams();
        let seams = held + self.stars() + corners.max(opposites + links) + rest(corners);
        let mut most = self.weld.scratch.max(seams);
        let mut crowd = Crowd::new(&self.shape, &self.nature);
        crowd.single = self.single;
        let settled = held + opposites + 2 * self.width * crowd.cuts;
        most = most.max(settled + crowd.sums());
        if self.deferred > 0 {
            let [asks, answers] = self.asked();
            let pieces = self.single * size_of::<Piece>() as u64;
            most = most.max(settled + pieces + asks.max(answers) + rest(asks));
        }
        if self.contracts {
            most = most.max(held + opposites + links + links + self.contracted());
        }
        most
    }

    /// Bytes that a contraction keeps besides the links: each node's word and label, what it tells
    /// its parent and asks of it.
    fn contracted(&self) -> u64 {
        self.locals * (4 + 5 * self.width)
    }

    /// Bytes of the questions for coordinates, and of the answers.
    fn asked(&self) -> [u64; 2] {
        asked(self.width, self.shape.coord).map(|bytes| 3 * self.deferred * bytes)
    }

    /// The passes, with what each reads and writes.
    pub fn passes(&self, survey: &Survey, data: u64, manifest: u64) -> Vec<PassPrediction> {
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
        // Arrays in place are summed for their digest by the passes that read them first, and
        // what is written once is summed as it was: all that is read once more.
        let in_place = !survey.decoded && !survey.welded;
        let first_read = if in_place { bytes - own_g } else { 0 };
        let read = if in_place { 0 } else { bytes };
        pass("read", "bytes", bytes, read + self.weld.read, decoded);
        if coord > 0 {
            let (read, written) = if survey.decoded {
                (self.g, 0)
            } else if in_place {
                (2 * own_g, self.g)
            } else {
                (own_g, self.g)
            };
            pass(
                "coordinates",
                "vertices",
                n,
                read + self.g,
                DATA_START + written,
            );
        }
        let counted = survey.vertices.is_none();
        if counted {
            pass("count ids", "triangles", t, v + first_read, 0);
        }
        let ranges = if self.plan.bits < n {
            n.div_ceil(self.plan.bits)
        } else {
            0
        };
        let digest = if counted { 0 } else { first_read };
        pass("scan", "triangles", t, v * (1 + ranges) + digest, 0);
        let [corners, opposites, links] = self.seams();
        let [counts, measures] = self.known();
        let rows = 7 * index * t;
        let written = rows + corners + counts + measures + self.stars();
        let summed = 3 * index * t;
        pass("chunks", "triangles", t, v + self.g + summed, written);
        pass("seams", "corners", self.spilled, corners, opposites + links);
        if self.shape.measures {
            pass("stars", "parts of fans", self.parts, self.stars(), 0);
        }
        pass("stitch", "links", self.spilled / 2, links + counts, 0);
        let table = DATA_START + row_type(self.shape.measures).1;
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
        let left = data.saturating_sub(summed + self.g);
        pass("checksums", "bytes", left, left, 0);
        pass("sync", "", 0, 0, manifest);
        pass("rename", "", 0, 0, 0);
        passes
    }
}
