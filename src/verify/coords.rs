//! Coordinates: their frame, reading those of a run of triangles, and what a triangle adds
//! to its component.
//!
//! Why reading is bounded: the vertices of a chunk of triangles are looked at in ascending
//! order, so each block of G is read once for the chunk. Triangles whose vertices lie so far
//! apart that this would read much more than it uses are joined with G by sorting instead
//! (see [`far`](super::far)).
//!
//! Memory: a block of G a thread. I/O: G once for the frame; then for the chunks at most
//! [`WORTH`] bytes a corner.

use super::open::Arrays;
use super::tally::Tally;
use crate::disk::{DataFile, Workspace};
use crate::error::Result;
use crate::folder::npy::DATA_START;
use std::sync::Mutex;

/// Vertices of a block of G.
pub(super) const BLOCK_VERTICES: u64 = 1024;
/// Bytes of G worth reading for a corner: what the sorts would move instead.
pub(super) const WORTH: u64 = 128;

/// Where coordinates are read from.
pub(super) struct Coords<'a> {
    file: &'a DataFile,
    wide: bool,
    vertices: u64,
    pub(super) frame: Frame,
}

/// The box of the finite vertices: the reference point and the unit of length of all sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    /// A quarter of the largest extent: the difference of two doubles may overflow, that of
    /// their quarters does not.
    quarter: f64,
    /// The grid of volumes: halves of coordinates times this are steps, and a step is two to this
    /// power.
    steps: f64,
    exponent: i32,
    /// Vertices with a coordinate that is not finite.
    pub(super) nonfinite: u64,
}

impl Frame {
    fn empty() -> Frame {
        Frame {
            min: [f64::INFINITY; 3],
            max: [f64::NEG_INFINITY; 3],
            quarter: 0.0,
            steps: 1.0,
            exponent: 1,
            nonfinite: 0,
        }
    }

    fn add(&mut self, p: [f64; 3]) {
        if !p.iter().all(|x| x.is_finite()) {
            self.nonfinite += 1;
            return;
        }
        for (axis, x) in p.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(x);
            self.max[axis] = self.max[axis].max(x);
        }
    }

    fn absorb(&mut self, other: &Frame) {
        self.nonfinite += other.nonfinite;
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(other.min[axis]);
            self.max[axis] = self.max[axis].max(other.max[axis]);
        }
    }

    fn close(&mut self) {
        let mut half = 0.0f64;
        for axis in 0..3 {
            if self.min[axis] <= self.max[axis] {
                let extent = self.max[axis] * 0.25 - self.min[axis] * 0.25;
                self.quarter = self.quarter.max(extent);
                half = half.max(self.max[axis] * 0.5 - self.min[axis] * 0.5);
            }
        }
        if half > 0.0 {
            // The least power of two that half the extent is not above; far below what is normal
            // the grid is coarser.
            let e = (-980..).find(|&e| half <= 2f64.powi(e)).unwrap_or(1024);
            self.steps = 2f64.powi(30 - e);
            self.exponent = e + 1 - 30;
        }
    }

    /// A finite point of the box in whole steps of the grid: the nearest, of two the even one.
    fn on_grid(&self, p: [f64; 3]) -> [i64; 3] {
        [0, 1, 2].map(|axis| {
            let x = (p[axis] * 0.5 - self.min[axis] * 0.5) * self.steps;
            x.round_ties_even() as i64
        })
    }

    /// A volume in the units of the coordinates from one in steps.
    pub(super) fn volume(&self, steps: i128) -> f64 {
        let (mut volume, mut e) = (steps as f64, 3 * self.exponent);
        // In factors that leave the range of the type only when the result does.
        while e != 0 {
            let part = e.clamp(-900, 900);
            volume *= 2f64.powi(part);
            e -= part;
        }
        volume
    }

    /// An area in the units of the coordinates from one in squares of the largest extent, which
    /// may overflow where its quarter does not.
    pub(super) fn square(&self, x: f64) -> f64 {
        x * self.quarter * 4.0 * self.quarter * 4.0
    }

    /// A finite point in units of the largest extent, from the least corner of the box.
    fn unit(&self, p: [f64; 3]) -> [f64; 3] {
        let mut out = [0.0; 3];
        for axis in 0..3 {
            if self.quarter > 0.0 {
                out[axis] = (p[axis] * 0.25 - self.min[axis] * 0.25) / self.quarter;
            }
        }
        out
    }

    /// Adds to a component what a triangle has: box, volume, area, sides.
    pub(super) fn measure(&self, tally: &mut Tally, points: [[f64; 3]; 3]) {
        let mut finite = true;
        for p in points {
            if !p.iter().all(|x| x.is_finite()) {
                finite = false;
                continue;
            }
            for (axis, x) in p.into_iter().enumerate() {
                // A zero has no sign in a box.
                tally.min[axis] = tally.min[axis].min(x + 0.0);
                tally.max[axis] = tally.max[axis].max(x + 0.0);
            }
        }
        if !finite {
            tally.nonfinite += 1;
            return;
        }
        let [a, b, c] = points.map(|p| self.unit(p));
        let (ab, ac, bc) = (minus(b, a), minus(c, a), minus(c, b));
        let normal = cross(ab, ac);
        tally
            .volume
            .add(determinant(points.map(|p| self.on_grid(p))));
        tally.area.add(dot(normal, normal).sqrt() * 0.5);
        for side in [bc, ac, ab] {
            tally.sides.add(dot(side, side).sqrt());
        }
    }
}

/// Of three points whose coordinates are at most 2^30: no sum of two products reaches 2^63.
fn determinant([a, b, c]: [[i64; 3]; 3]) -> i128 {
    (0..3)
        .map(|k| {
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            i128::from(a[k]) * i128::from(b[l] * c[m] - b[m] * c[l])
        })
        .sum()
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl<'a> Coords<'a> {
    /// Reads G once and takes its frame; none for a folder without G.
    pub(super) fn scan(ws: &Workspace, arrays: &'a Arrays) -> Result<Option<Coords<'a>>> {
        let Some((file, wide)) = &arrays.g else {
            return Ok(None);
        };
        let mut coords = Coords {
            file,
            wide: *wide,
            vertices: arrays.vertices,
            frame: Frame::empty(),
        };
        ws.progress
            .begin("verify: coordinates", "vertices", arrays.vertices);
        let total = Mutex::new(Frame::empty());
        let units = arrays.vertices.div_ceil(BLOCK_VERTICES * 16);
        let lease = ws.budget.lease(
            "blocks of coordinates",
            ws.workers.count() as u64 * Block::BYTES,
        )?;
        ws.workers.run(
            units,
            || Ok((Block::new(), Frame::empty())),
            |(block, frame), unit| {
                let first = unit * BLOCK_VERTICES * 16;
                let end = coords.vertices.min(first + BLOCK_VERTICES * 16);
                for v in first..end {
                    frame.add(block.point(&coords, v)?);
                }
                ws.progress.advance(end - first);
                Ok(())
            },
            |(_, frame)| {
                let mut total = total.lock().unwrap_or_else(|e| e.into_inner());
                total.absorb(&frame);
                Ok(())
            },
        )?;
        drop(lease);
        coords.frame = total.into_inner().unwrap_or_else(|e| e.into_inner());
        coords.frame.close();
        ws.progress.end();
        Ok(Some(coords))
    }

    fn item(&self) -> u64 {
        if self.wide { 8 } else { 4 }
    }

    /// True when reading the coordinates of these vertices (ascending, with repeats) where
    /// they lie costs no more than sorting would.
    pub(super) fn near(&self, vertices: impl Iterator<Item = u64>) -> bool {
        let (mut corners, mut blocks, mut last) = (0u64, 0u64, u64::MAX);
        for v in vertices {
            corners += 1;
            let block = v / BLOCK_VERTICES;
            blocks += u64::from(block != last);
            last = block;
        }
        // A few blocks are always worth it.
        let bytes = blocks.saturating_sub(8) * BLOCK_VERTICES * 3 * self.item();
        bytes <= corners * WORTH
    }
}

/// A block of G in memory.
pub(super) struct Block {
    number: u64,
    raw: Vec<u8>,
}

impl Block {
    /// Bytes of memory at most.
    pub(super) const BYTES: u64 = BLOCK_VERTICES * 24;

    pub(super) fn new() -> Block {
        Block {
            number: u64::MAX,
            raw: Vec::with_capacity(Block::BYTES as usize),
        }
    }

    /// The coordinates of a vertex below N; reads its block unless it is the one held.
    pub(super) fn point(&mut self, coords: &Coords, v: u64) -> Result<[f64; 3]> {
        let row = coords.item() * 3;
        let number = v / BLOCK_VERTICES;
        if number != self.number {
            let first = number * BLOCK_VERTICES;
            let n = (coords.vertices - first).min(BLOCK_VERTICES);
            self.number = u64::MAX;
            self.raw.resize((n * row) as usize, 0);
            coords
                .file
                .read_at(&mut self.raw, DATA_START + first * row)?;
            self.number = number;
        }
        let at = (v % BLOCK_VERTICES * row) as usize;
        let mut p = [0.0; 3];
        if coords.wide {
            for (x, bytes) in p.iter_mut().zip(self.raw[at..].as_chunks::<8>().0) {
                *x = f64::from_le_bytes(*bytes);
            }
        } else {
            for (x, bytes) in p.iter_mut().zip(self.raw[at..].as_chunks::<4>().0) {
                *x = f64::from(f32::from_le_bytes(*bytes));
            }
        }
        Ok(p)
    }
}
