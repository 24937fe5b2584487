//! Triangles to chunks: by where they lie, whatever their order in the folder.
//!
//! Why a chunk need not follow the surface: its vertices are cheap when neighbours are in the same
//! chunk, and a compact piece of space has few that are not. Space is [`cut`](super::cut) into boxes
//! with about equal shares of the vertices, the *intervals*; a triangle goes to the least interval of
//! its vertices, so a vertex all of whose triangles go to its own interval is in no other. The others
//! are marked. An interval with too many triangles is cut in file order.
//!
//! Memory: 2 bytes and 2 bits a vertex of the mesh, 2.5 MiB for the cubes, a writer of the shuffle.
//! I/O: G twice, V once; 20 bytes a triangle written (40 when ids are wide).

use super::cut::Cubes;
use super::grid::Grid;
use crate::corner::Index;
use crate::disk::{DataFile, Lease, Workspace};
use crate::error::{Error, Result, conserve};
use crate::folder::npy::DATA_START;
use crate::folder::{self, Folder};
use crate::shuffle::{Buckets, Plan, Record, Shuffle};
use crate::table::array::{self, Coords, Width};
use bytemuck::{Pod, Zeroable};

/// The least memory of the writer of triangles.
const LEAST_WRITER: u64 = 1 << 20;
/// Rows of V or G that are read at a time.
const ROWS: u64 = 1 << 13;

/// A triangle on its way to its chunk: interval, number, vertices. A vertex that no triangle
/// names has the number T + v, itself and two NONEs.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Dealt<W>([W; 5]);

impl<W: Index> Dealt<W> {
    /// The interval.
    #[inline]
    pub fn interval(&self) -> u64 {
        self.0[0].wide()
    }

    /// The number: T + v of a vertex that no triangle names.
    #[inline]
    pub fn number(&self) -> u64 {
        self.0[1].wide()
    }

    /// The vertices.
    #[inline]
    pub fn vertices(&self) -> [W; 3] {
        [self.0[2], self.0[3], self.0[4]]
    }
}

impl<W: Index> Record for Dealt<W> {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        self.0[level].wide()
    }
}

/// Bits by vertex.
#[derive(Debug)]
pub(super) struct Marks(Vec<u64>);

impl Marks {
    fn new(vertices: u64) -> Marks {
        Marks(vec![0; vertices.div_ceil(64) as usize])
    }

    fn set(&mut self, v: u64) {
        self.0[(v / 64) as usize] |= 1 << (v % 64);
    }

    /// True when it was marked.
    #[inline]
    pub fn has(&self, v: u64) -> bool {
        self.0[(v / 64) as usize] >> (v % 64) & 1 == 1
    }
}

/// What was dealt.
pub(super) struct Deal<W> {
    /// The triangles by interval, in the order of the folder.
    pub buckets: Buckets<Dealt<W>>,
    /// Records of each interval.
    pub counts: Vec<u64>,
    /// No more than so many vertices are named in each interval.
    pub vertices: Vec<u64>,
    /// Vertices that may be in several chunks.
    pub shared: Marks,
    _lease: Lease,
}

/// Intervals of a mesh for chunks of `most` triangles: of some fewer, since shares are equal only
/// about.
pub(super) fn intervals(triangles: u64, vertices: u64, most: u64) -> u64 {
    (triangles.max(vertices) / (most * 3 / 4).max(1) + 1).min(u64::from(u16::MAX))
}

/// Bytes of a bit for each vertex: what is held when all is dealt.
pub(super) fn mark_bytes(vertices: u64) -> u64 {
    vertices.div_ceil(64) * 8
}

/// Bytes that are held besides while triangles are dealt, but for the writer.
fn passing_bytes(vertices: u64, intervals: u64) -> u64 {
    let map = if intervals > 1 {
        2 * vertices + Cubes::BYTES
    } else {
        0
    };
    map + mark_bytes(vertices) + 48 * ROWS
}

/// The least memory that dealing does with.
pub(super) fn least(triangles: u64, vertices: u64, most: u64) -> u64 {
    let passing = passing_bytes(vertices, intervals(triangles, vertices, most));
    mark_bytes(vertices) + passing + LEAST_WRITER
}

/// Deals all triangles, and the vertices that none of them names, to chunks of `most` of them.
///
/// # Errors
/// [`Error::Budget`], [`Error::Io`], [`Error::DiskLimit`]; [`Error::Input`] for a damaged folder.
pub(super) fn deal<W: Index>(
    ws: &Workspace,
    folder: &Folder,
    g: Option<&(Coords, DataFile)>,
    grid: Grid,
    most: u64,
) -> Result<Deal<W>> {
    let counts = &folder.manifest().counts;
    let (t, n) = (counts.triangles, counts.vertices);
    let intervals = intervals(t, n, most);
    let marks = ws.budget.lease("marks of shared vertices", mark_bytes(n))?;
    let passing = passing_bytes(n, intervals);
    let passing = ws.budget.lease("the interval of each vertex", passing)?;
    let map = Map::new(ws, g, grid, n, intervals)?;
    let record = size_of::<Dealt<W>>();
    let memory = (ws.budget.free() / 4).clamp(LEAST_WRITER, 32 << 20);
    let plan = Plan::within(memory, 1, record, t + counts.unreferenced_vertices, memory);
    let shuffle = Shuffle::new(ws, "triangles by chunk", 0..intervals, plan)?;
    let mut writer = shuffle.writer()?;
    let mut shared = Marks::new(n);
    let mut named = Marks::new(n);
    let mut sizes = vec![0; intervals as usize];
    let mut vertices = map.sizes(n, intervals);
    each_triangle(ws, folder, |number, tri| {
        let places = tri.map(|v| map.of(v));
        let to = places[0].min(places[1]).min(places[2]);
        for (v, place) in tri.into_iter().zip(places) {
            named.set(v);
            if place != to {
                vertices[to as usize] += 1;
                shared.set(v);
            }
        }
        sizes[to as usize] += 1;
        let [a, b, c] = tri.map(W::of);
        writer.push(Dealt([W::of(to), W::of(number), a, b, c]))
    })?;
    let mut loose = 0;
    for v in (0..n).filter(|&v| !named.has(v)) {
        loose += 1;
        let to = map.of(v);
        sizes[to as usize] += 1;
        writer.push(Dealt([W::of(to), W::of(t + v), W::of(v), W::NONE, W::NONE]))?;
    }
    writer.finish()?;
    drop(passing);
    let buckets = shuffle.finish()?;
    let what = "triangles and loose vertices";
    conserve("deal triangles", what, t + loose, buckets.records())?;
    Ok(Deal {
        buckets,
        counts: sizes,
        vertices,
        shared,
        _lease: marks,
    })
}

/// The interval of each vertex; empty when there is one.
struct Map {
    of: Vec<u16>,
}

impl Map {
    fn of(&self, v: u64) -> u64 {
        self.of.get(v as usize).map_or(0, |&i| i.into())
    }

    /// Vertices of each interval.
    fn sizes(&self, vertices: u64, intervals: u64) -> Vec<u64> {
        if self.of.is_empty() {
            return vec![vertices; intervals as usize];
        }
        let mut sizes = vec![0; intervals as usize];
        self.of.iter().for_each(|&i| sizes[usize::from(i)] += 1);
        sizes
    }

    fn new(
        ws: &Workspace,
        g: Option<&(Coords, DataFile)>,
        grid: Grid,
        vertices: u64,
        intervals: u64,
    ) -> Result<Map> {
        let mut of = Vec::new();
        if intervals == 1 {
            return Ok(Map { of });
        }
        of.reserve_exact(vertices as usize);
        let Some((kind, file)) = g else {
            let interval =
                |v: u64| (u128::from(v) * u128::from(intervals) / u128::from(vertices)) as u16;
            of.extend((0..vertices).map(interval));
            return Ok(Map { of });
        };
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        each_vertex(ws, *kind, file, grid, vertices, |at| {
            for k in 0..3 {
                low[k] = low[k].min(at[k]);
                high[k] = high[k].max(at[k]);
            }
        })?;
        let mut cubes = Cubes::new(low, high);
        each_vertex(ws, *kind, file, grid, vertices, |at| cubes.add(at))?;
        let parts = cubes.cut(intervals);
        each_vertex(ws, *kind, file, grid, vertices, |at| of.push(parts.of(at)))?;
        Ok(Map { of })
    }
}

/// Hands out the integers of all vertices.
fn each_vertex(
    ws: &Workspace,
    kind: Coords,
    file: &DataFile,
    grid: Grid,
    vertices: u64,
    mut each: impl FnMut([i32; 3]),
) -> Result<()> {
    let row = kind.row_bytes() as u64;
    let mut buf = vec![0; (ROWS * row) as usize];
    ws.progress.begin("cut space", "vertices", vertices);
    let mut from = 0;
    while from < vertices {
        let n = ROWS.min(vertices - from);
        let bytes = &mut buf[..(n * row) as usize];
        file.read_at(bytes, DATA_START + from * row)?;
        (0..n as usize).for_each(|i| each(grid.integers(kind, bytes, i)));
        ws.progress.advance(n);
        from += n;
    }
    ws.progress.end();
    Ok(())
}

/// Hands out the vertices of all triangles, held to their bounds.
fn each_triangle(
    ws: &Workspace,
    folder: &Folder,
    mut each: impl FnMut(u64, [u64; 3]) -> Result<()>,
) -> Result<()> {
    let counts = &folder.manifest().counts;
    let (t, n) = (counts.triangles, counts.vertices);
    let width = Width::of(folder)?;
    let file = array::open(folder, folder::V, width.descr(), &[t, 3])?;
    let row = 3 * width.bytes() as u64;
    let mut buf = vec![0; (ROWS * row) as usize];
    ws.progress.begin("deal triangles", "triangles", t);
    let mut from = 0;
    while from < t {
        let rows = ROWS.min(t - from);
        let bytes = &mut buf[..(rows * row) as usize];
        file.read_at(bytes, DATA_START + from * row)?;
        for i in 0..rows as usize {
            let tri = [0, 1, 2].map(|k| width.get(bytes, 3 * i + k));
            if let Some(v) = tri.iter().find(|v| **v >= n) {
                return Err(Error::input(
                    file.path(),
                    format!("triangle {}", from + i as u64),
                    format!("a vertex below {n}"),
                    v.to_string(),
                    "the folder is damaged; `cornermill verify` says how; build it again",
                ));
            }
            each(from + i as u64, tri)?;
        }
        ws.progress.advance(rows);
        from += rows;
    }
    ws.progress.end();
    Ok(())
}
