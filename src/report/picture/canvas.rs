//! The samples of the image: of each the nearest triangle, and its paint.
//!
//! A sample keeps the smallest *key* that was drawn there: depth in the upper bits, the
//! triangle's number in the lower ones. Why the picture is the same for every number of
//! threads: the smallest of some keys does not depend on their order, and keys of two triangles
//! are never equal.
//!
//! Threads share the samples, in tiles of 64 by 64 with a lock each, which is taken once for a
//! triangle that covers some sample of the tile, never for one that covers none.
//!
//! Memory: 12 bytes a sample, leased whole; tiles that nothing covers are never touched.
//! I/O: none.

use super::colour::Paint;
use super::facet::{Area, Facet, Line};
use crate::disk::{Budget, Lease};
use crate::error::Result;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Samples along a side of a tile.
const SIDE: i32 = 64;
const TILE: usize = (SIDE * SIDE) as usize;
/// Bytes of a sample: key and paint.
const SAMPLE_BYTES: u64 = 12;
/// The key of a sample that nothing covers.
const NOTHING: u64 = u64::MAX;

/// Something that covers samples.
pub(super) trait Shape {
    /// The samples that it may cover.
    fn bounds(&self) -> &Area;
    /// Calls `f` with each sample in an area that it covers, and the depth there.
    fn cover(&self, area: &Area, f: impl FnMut(i32, i32, u32));
}

impl Shape for Facet {
    fn bounds(&self) -> &Area {
        &self.bounds
    }

    #[inline]
    fn cover(&self, area: &Area, f: impl FnMut(i32, i32, u32)) {
        Facet::cover(self, area, f);
    }
}

impl Shape for Line {
    fn bounds(&self) -> &Area {
        &self.bounds
    }

    fn cover(&self, area: &Area, f: impl FnMut(i32, i32, u32)) {
        Line::cover(self, area, f);
    }
}

/// Keys and paints of a tile, row by row; empty until something is drawn.
#[derive(Default)]
struct Tile {
    keys: Vec<u64>,
    paints: Vec<u32>,
}

impl Tile {
    fn open(&mut self) {
        if self.keys.is_empty() {
            self.keys = vec![NOTHING; TILE];
            self.paints = vec![0; TILE];
        }
    }
}

/// All samples.
pub(super) struct Canvas {
    tiles: Vec<Mutex<Tile>>,
    across: usize,
    pub(super) width: i32,
    pub(super) height: i32,
    /// Bits of a key that hold the triangle.
    id_bits: u32,
    _lease: Lease,
}

impl Canvas {
    /// Bytes for so many samples.
    pub(super) fn bytes([width, height]: [u32; 2]) -> u64 {
        let tiles = |n: u32| u64::from(n.div_ceil(SIDE as u32));
        let each = SAMPLE_BYTES * TILE as u64 + size_of::<Mutex<Tile>>() as u64;
        tiles(width) * tiles(height) * each
    }

    /// For so many samples, at most 2^14 each way, and so many triangles.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub(super) fn new(budget: &Budget, samples: [u32; 2], triangles: u64) -> Result<Canvas> {
        let lease = budget.lease("the samples of the picture", Canvas::bytes(samples))?;
        let [across, down] = samples.map(|n| n.div_ceil(SIDE as u32) as usize);
        Ok(Canvas {
            tiles: (0..across * down).map(|_| Mutex::default()).collect(),
            across,
            width: samples[0] as i32,
            height: samples[1] as i32,
            // By the mesh, not by the width of its index, so that both give one picture.
            id_bits: (64 - triangles.leading_zeros()).max(32),
            _lease: lease,
        })
    }

    /// Draws a shape of triangle `id`; `paint` is asked once when it covers some sample.
    #[inline]
    pub(super) fn draw(&self, shape: &impl Shape, id: u64, paint: impl Fn() -> Paint) {
        let Area { x, y } = shape.bounds();
        let tiles = |range: &std::ops::Range<i32>| range.start / SIDE..(range.end - 1) / SIDE + 1;
        for row in tiles(y) {
            for column in tiles(x) {
                self.draw_in(row, column, shape, id, &paint);
            }
        }
    }

    fn draw_in(
        &self,
        row: i32,
        column: i32,
        shape: &impl Shape,
        id: u64,
        paint: &impl Fn() -> Paint,
    ) {
        let (left, top) = (column * SIDE, row * SIDE);
        let area = Area {
            x: left..left + SIDE,
            y: top..top + SIDE,
        };
        let mut open: Option<(MutexGuard<Tile>, u32)> = None;
        shape.cover(&area, |x, y, depth| {
            let (tile, paint) = open.get_or_insert_with(|| {
                let lock = &self.tiles[row as usize * self.across + column as usize];
                let mut tile = lock.lock().unwrap_or_else(PoisonError::into_inner);
                tile.open();
                (tile, paint().0)
            });
            let at = ((y - top) * SIDE + (x - left)) as usize;
            let key = u64::from(depth) >> (self.id_bits - 32) << self.id_bits | id;
            if key < tile.keys[at] {
                tile.keys[at] = key;
                tile.paints[at] = *paint;
            }
        });
    }

    /// The paints of a row of samples, `None` where nothing was drawn.
    pub(super) fn row(&mut self, y: u32, into: &mut [Option<Paint>]) {
        let (row, within) = (y as usize / SIDE as usize, y as usize % SIDE as usize);
        for (column, part) in into.chunks_mut(SIDE as usize).enumerate() {
            let tile = self.tiles[row * self.across + column].get_mut();
            let tile = tile.unwrap_or_else(PoisonError::into_inner);
            for (i, slot) in part.iter_mut().enumerate() {
                let at = within * SIDE as usize + i;
                let drawn = tile.keys.get(at).is_some_and(|&key| key != NOTHING);
                *slot = drawn.then(|| Paint(tile.paints[at]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_wins_and_of_equals_the_smallest_number() {
        let budget = Budget::new(1 << 20);
        for triangles in [100, 1 << 36] {
            let mut canvas = Canvas::new(&budget, [100, 70], triangles).unwrap();
            let corner = |x: i32, y: i32, z: i32| [x << 14, y << 14, z << 14];
            let facet = |z| {
                let spots = [
                    corner(-10, -10, z),
                    corner(-10, 900, z),
                    corner(900, -10, z),
                ];
                Facet::new(spots, 100, 70).unwrap()
            };
            for (id, z) in [(9, 50), (7, 40), (5, 40), (6, 40), (1, 60)] {
                canvas.draw(&facet(z), id, || Paint(id as u32));
            }
            let mut row = [None; 100];
            for y in [0, 63, 64, 69] {
                canvas.row(y, &mut row);
                assert!(row.iter().all(|&p| p == Some(Paint(5))));
            }
        }
        assert_eq!(budget.used(), 0);
    }
}
