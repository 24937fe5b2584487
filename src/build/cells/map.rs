//! Which cell each vertex belongs to.
//!
//! Why any map will do: what an edge is does not depend on where it is settled, so a poor map
//! costs time alone. A good one makes cells of vertices that are near on the surface, and of
//! about equal load. With coordinates a cell is an interval of the Morton curve through the
//! bounding box; without, or when a word for each vertex does not fit, it is an interval of
//! ids. Where intervals end is read off a sample.
//!
//! Source: Morton, *A Computer Oriented Geodetic Data Base* (1966): interleaved coordinates.
//!
//! Memory: 2 bytes a vertex by place, at most 128 KiB by id; a sample of 1 MiB. I/O: G once.

use super::super::Job;
use super::super::arrays::{CoordReader, TriangleReader};
use crate::chunk::grid::Bounds;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::Lease;
use crate::error::{Error, Result};
use crate::input::CoordArray;
use std::sync::atomic::{AtomicU16, Ordering};

/// The most cells: their numbers take 16 bits.
pub const MOST_CELLS: u64 = 1 << 16;
/// Entries of a map by id, at most.
const BLOCKS: u64 = 1 << 16;
/// Places of the input that are looked at, and how much at each.
const PLACES: u64 = 2048;
const AT_PLACE: u64 = 32;
/// Vertices at a time.
const STEP: u64 = 16 << 10;
/// Bits of the Morton code by axis, and of the part that finds the interval at once.
const AXIS_BITS: u32 = 16;
const TOP_BITS: u32 = 15;

/// The cell of each vertex.
pub struct CellMap {
    table: Vec<AtomicU16>,
    /// Vertices of an entry, as a power of two: 0 by place.
    shift: u32,
    /// Number of cells.
    pub cells: u64,
    lease: Lease,
}

impl CellMap {
    /// The cell of vertex v.
    #[inline]
    pub fn of(&self, v: u64) -> u16 {
        self.table[(v >> self.shift) as usize].load(Ordering::Relaxed)
    }

    /// Bytes of this map.
    pub fn bytes(&self) -> u64 {
        self.lease.bytes()
    }

    /// Bytes of a map by place.
    pub fn bytes_by_place(vertices: u64) -> u64 {
        2 * vertices
    }
}

/// Ends of intervals of about equal load: keys at which the next interval begins.
fn ends(mut sample: Vec<u64>, cells: u64) -> Vec<u64> {
    sample.sort_unstable();
    let at = |i: u64| sample[(u128::from(i) * sample.len() as u128 / u128::from(cells)) as usize];
    let mut ends: Vec<u64> = if sample.is_empty() {
        Vec::new()
    } else {
        (1..cells).map(at).collect()
    };
    // A key with the load of several intervals makes one.
    ends.dedup();
    ends
}

/// A map by ids: vertices near in number share a cell.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::Input`].
pub fn by_id<I: Index>(job: &Job, cells: u64) -> Result<CellMap> {
    let (t, n) = (job.shape.triangles, job.shape.vertices.max(1));
    let budget = &job.ws.budget;
    let _lease = budget.lease("a sample of V", PLACES * AT_PLACE * 16)?;
    let mut sample = Vec::with_capacity((PLACES * AT_PLACE * 2) as usize);
    let mut reader = TriangleReader::<I>::new(&job.mesh.v);
    each_place(t, |first, count| {
        let rows = match reader.read(first, count) {
            Ok(v) => v.as_chunks::<3>().0,
            // What is wrong is told by the first full reading, which finds what is wrong first.
            Err(Error::Input { .. }) => return Ok(()),
            Err(e) => return Err(e),
        };
        for v in rows {
            // A triangle goes to the cell of its least vertex, an edge to that of the middle one.
            let mut ids = v.map(|v| v.wide().min(n - 1));
            ids.sort_unstable();
            sample.extend([ids[0], ids[1]]);
        }
        Ok(())
    })?;
    let ends = ends(sample, cells);
    let mut shift = 0;
    while (n - 1) >> shift >= BLOCKS {
        shift += 1;
    }
    let entries = ((n - 1) >> shift) + 1;
    let cell = |block: u64| ends.partition_point(|&end| end <= block << shift) as u16;
    Ok(CellMap {
        lease: budget.lease("cells by id", 2 * entries)?,
        table: (0..entries).map(|b| AtomicU16::new(cell(b))).collect(),
        shift,
        cells: ends.len() as u64 + 1,
    })
}

/// A map by place: vertices near in space share a cell.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::Input`].
pub fn by_place<X: Coord>(
    job: &Job,
    g: &CoordArray,
    bounds: &Bounds,
    cells: u64,
) -> Result<CellMap> {
    let (ws, n) = (job.ws, g.vertices);
    let threads = ws.workers.count() as u64;
    let curve = Curve::new(bounds);
    let _lease = ws.budget.lease(
        "a sample of G",
        PLACES * AT_PLACE * 8 + threads * STEP * CoordReader::<X>::BYTES,
    )?;
    let mut sample = Vec::with_capacity((PLACES * AT_PLACE) as usize);
    let mut reader = CoordReader::<X>::new(g);
    each_place(n, |first, count| {
        let rows = reader.read(first, count)?;
        sample.extend(rows.iter().map(|p| curve.code(p.map(Coord::wide))));
        Ok(())
    })?;
    drop(reader);
    let intervals = Intervals::new(ends(sample, cells));
    let map = CellMap {
        lease: ws
            .budget
            .lease("cells by place", CellMap::bytes_by_place(n))?,
        table: (0..n).map(|_| AtomicU16::new(0)).collect(),
        shift: 0,
        cells: intervals.ends.len() as u64 + 1,
    };
    ws.workers.run(
        n.div_ceil(STEP),
        || Ok(CoordReader::<X>::new(g)),
        |reader, unit| {
            let first = unit * STEP;
            let rows = reader.read(first, STEP.min(n - first))?;
            let table = &map.table[first as usize..];
            for (p, entry) in rows.iter().zip(table) {
                let cell = intervals.find(curve.code(p.map(Coord::wide)));
                entry.store(cell, Ordering::Relaxed);
            }
            ws.progress.advance(rows.len() as u64);
            Ok(())
        },
        |_| Ok(()),
    )?;
    Ok(map)
}

/// Hands (first, count) of up to [`PLACES`] pieces of `0..total`, spread evenly, to `look`.
pub(super) fn each_place(total: u64, mut look: impl FnMut(u64, u64) -> Result<()>) -> Result<()> {
    let step = total.div_ceil(PLACES).max(AT_PLACE);
    (0..total)
        .step_by(step as usize)
        .try_for_each(|first| look(first, AT_PLACE.min(total - first)))
}

/// The Morton curve through a cube over the bounding box.
struct Curve {
    min: [f64; 3],
    scale: f64,
}

impl Curve {
    fn new(bounds: &Bounds) -> Curve {
        let side = (0..3)
            .map(|a| bounds.max[a] * 0.5 - bounds.min[a] * 0.5)
            .fold(0.0, f64::max);
        let steps = f64::from((1u32 << AXIS_BITS) - 1);
        Curve {
            min: bounds.min,
            scale: if side > 0.0 { steps / side * 0.5 } else { 0.0 },
        }
    }

    /// The place along the curve; any will do for a point that is not finite.
    #[inline]
    fn code(&self, p: [f64; 3]) -> u64 {
        // Casts saturate, and take NaN for 0.
        let step = |a: usize| ((p[a] - self.min[a]) * self.scale) as u16;
        spread(step(0)) | spread(step(1)) << 1 | spread(step(2)) << 2
    }
}

/// Puts two zeros before each bit.
#[inline]
fn spread(x: u16) -> u64 {
    let x = u64::from(x);
    let x = (x | x << 16) & 0xff00_00ff;
    let x = (x | x << 8) & 0x00f0_0f00_f00f;
    let x = (x | x << 4) & 0x0c30_c30c_30c3;
    (x | x << 2) & 0x2492_4924_9249
}

/// Which interval a code lies in.
struct Intervals {
    ends: Vec<u64>,
    /// Intervals that end before each value of the code's top bits.
    tops: Vec<u32>,
}

impl Intervals {
    fn new(ends: Vec<u64>) -> Intervals {
        let below = |top: u64| ends.partition_point(|&end| end <= top << Self::SHIFT) as u32;
        let tops = (0..=1 << TOP_BITS).map(below).collect();
        Intervals { ends, tops }
    }

    const SHIFT: u32 = 3 * AXIS_BITS - TOP_BITS;

    #[inline]
    fn find(&self, code: u64) -> u16 {
        let top = (code >> Self::SHIFT) as usize;
        let (from, to) = (self.tops[top] as usize, self.tops[top + 1] as usize);
        (from + self.ends[from..to].partition_point(|&end| end <= code)) as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_bits() {
        for x in [0u16, 1, 2, 0x8000, 0xffff, 0xa5c3, 0x1234] {
            let naive: u64 = (0..16).map(|i| (u64::from(x) >> i & 1) << (3 * i)).sum();
            assert_eq!(spread(x), naive, "{x:x}");
        }
    }

    #[test]
    fn intervals_agree_with_a_search_and_share_the_load() {
        let sample: Vec<u64> = (0..5000u64).map(|i| i * i * 11_259 % (1 << 48)).collect();
        let ends = ends(sample.clone(), 100);
        let intervals = Intervals::new(ends.clone());
        let mut load = vec![0; ends.len() + 1];
        for &code in &sample {
            let found = intervals.find(code);
            let naive = ends.iter().filter(|&&end| end <= code).count();
            assert_eq!(usize::from(found), naive);
            load[naive] += 1;
        }
        assert!(load.iter().all(|&n| (40..=60).contains(&n)), "{load:?}");
        assert_eq!(super::ends(vec![7; 50], 10), [7]);
        assert!(super::ends(Vec::new(), 10).is_empty());
    }

    #[test]
    fn points_that_are_not_finite_have_a_place_too() {
        let mut bounds = Bounds::default();
        bounds.add([-1.7e308, 0.0, 2.0]);
        bounds.add([1.7e308, 1.0, 2.0]);
        let curve = Curve::new(&bounds);
        assert!(curve.code([1.7e308, 1.0, 2.0]) < 1 << 48);
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(curve.code([x, x, x]) < 1 << 48);
        }
        let empty = Curve::new(&Bounds::default());
        assert!(empty.code([1.0, 2.0, 3.0]) < 1 << 48);
    }
}
