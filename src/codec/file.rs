//! The file `MESH.cmz`: a head, the chunks one behind the other, the index, a tail.
//!
//! ```text
//!   head | chunk 0: triangles, references, numbers, components | chunk 1 | ... | entries | tail
//! ```
//!
//! Everything but the coded bytes is little-endian with fixed places; `docs/format.md` has the
//! table. Head, each chunk and the index have an xxh3 checksum. Counts are held to each other and
//! to the length of the file before anything is sized by them.
//!
//! Memory, I/O: none; see [`packed`](super::packed).

use super::Level;
use super::grid::Grid;
use super::walk::Extent;
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use xxhash_rust::xxh3::xxh3_64;

/// The first bytes of a file.
pub const MAGIC: [u8; 8] = *b"\x89CMZ\r\n\x1a\n";
/// The last bytes of a file.
pub(super) const END: [u8; 8] = *b"CMZ end\n";
/// The version that this program writes and reads.
pub const VERSION: u32 = 1;
/// The most triangles of a chunk; loose vertices count like triangles.
pub const MOST_TRIANGLES: u64 = 1 << 20;

/// The beginning of a file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Head {
    pub(super) magic: [u8; 8],
    pub(super) version: u32,
    /// 0 fast, 1 strong.
    pub level: u8,
    /// 0 no coordinates, 1 a grid, 2 bits of f4.
    pub grid: u8,
    /// Bytes of a coordinate that is handed out: 4, 8, or 0 for none.
    pub coords: u8,
    /// 1 when the order of the folder was kept, else 0.
    pub ordered: u8,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Least coordinates of a grid.
    pub min: [f64; 3],
    /// The step of a grid.
    pub step: f64,
    pub(super) sum: u64,
}

/// What the index says of a chunk.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Entry {
    /// Where its bytes begin.
    pub at: u64,
    /// Bytes of its triangles.
    pub bytes: u64,
    /// Bytes of its references, behind them.
    pub reference_bytes: u64,
    /// Bytes of the numbers that its triangles and vertices had, behind those.
    pub number_bytes: u64,
    /// Bytes of the components of its triangles, the last; 0 when there is no more than one.
    pub label_bytes: u64,
    /// Triangles without those that name a vertex twice.
    pub triangles: u64,
    /// Triangles that name a vertex twice.
    pub degenerate: u64,
    /// Its vertices, with those of earlier chunks.
    pub vertices: u64,
    /// Vertices that no triangle names.
    pub loose: u64,
    /// Vertices of earlier chunks.
    pub references: u64,
    /// 1 when triangles are turned against their neighbours.
    pub turns: u64,
    /// About how many of its bytes are connectivity; the rest are positions.
    pub connectivity: u64,
    /// Least integer coordinates.
    pub low: [i32; 3],
    /// Largest integer coordinates.
    pub high: [i32; 3],
    /// The least component of its triangles.
    pub first_component: u64,
    /// One more than the largest; the same as the least when it has none.
    pub end_component: u64,
    /// Checksum of its bytes but the components.
    pub sum: u64,
    /// Checksum of the bytes of the components.
    pub label_sum: u64,
}

/// The end of a file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Tail {
    pub index_at: u64,
    pub chunks: u64,
    pub sum: u64,
    pub end: [u8; 8],
}

pub(super) const HEAD: u64 = size_of::<Head>() as u64;
pub(super) const ENTRY: u64 = size_of::<Entry>() as u64;
pub(super) const TAIL: u64 = size_of::<Tail>() as u64;
const _: () = assert!(HEAD == 72 && ENTRY == 152 && TAIL == 32);

impl Head {
    /// The head of a mesh.
    pub fn new(
        level: Level,
        grid: Grid,
        (wide, ordered): (bool, bool),
        triangles: u64,
        vertices: u64,
    ) -> Head {
        let (kind, min, step) = grid.to_head();
        let mut head = Head {
            magic: MAGIC,
            version: VERSION,
            level: u8::from(level == Level::Strong),
            grid: kind,
            coords: match (kind, wide) {
                (0, _) => 0,
                (_, false) => 4,
                (_, true) => 8,
            },
            ordered: ordered.into(),
            triangles,
            vertices,
            min,
            step,
            sum: 0,
        };
        head.sum = head.summed();
        head
    }

    pub(super) fn summed(&self) -> u64 {
        xxh3_64(&bytemuck::bytes_of(self)[..HEAD as usize - 8])
    }

    /// The level.
    pub fn level(&self) -> Level {
        if self.level == 0 {
            Level::Fast
        } else {
            Level::Strong
        }
    }
}

impl Entry {
    /// What a decoder must be told.
    pub fn extent(&self) -> Extent {
        Extent {
            triangles: self.triangles as usize,
            degenerate: self.degenerate as usize,
            vertices: self.vertices as usize,
            loose: self.loose as usize,
            turns: self.turns == 1,
        }
    }

    /// Vertices that no earlier chunk has.
    pub fn own(&self) -> u64 {
        self.vertices - self.references
    }

    /// All its triangles.
    pub fn all_triangles(&self) -> u64 {
        self.triangles + self.degenerate
    }

    /// Where it ends.
    pub(super) fn end(&self) -> u64 {
        let bytes = self.bytes + self.reference_bytes + self.number_bytes + self.label_bytes;
        self.at + bytes
    }

    /// The components of its triangles lie in this range.
    pub fn components(&self) -> Range<u64> {
        self.first_component..self.end_component
    }

    /// True when it begins at `at`, ends before `end`, and its counts agree with each other.
    pub(super) fn fits(&self, at: u64, end: u64, ordered: bool) -> bool {
        let small = |x: u64| x <= MOST_TRIANGLES;
        let parts = [
            self.bytes,
            self.reference_bytes,
            self.number_bytes,
            self.label_bytes,
        ];
        let components = self.end_component.checked_sub(self.first_component);
        let sized = parts
            .iter()
            .try_fold(at, |sum, &b| sum.checked_add(b))
            .is_some_and(|sum| sum <= end);
        self.at == at
            && sized
            && [self.triangles, self.degenerate, self.loose]
                .into_iter()
                .all(small)
            && self.all_triangles() + self.loose <= MOST_TRIANGLES
            && self.vertices <= 3 * self.all_triangles() + self.loose
            && self.loose <= self.vertices
            && self.references <= self.vertices
            && self.turns <= 1
            && self.connectivity <= self.bytes
            && (self.number_bytes > 0) == (ordered && self.all_triangles() + self.vertices > 0)
            && components.is_some_and(|n| (n > 0) == (self.triangles > 0))
            && (self.label_bytes > 0) == (components > Some(1))
    }
}

/// The bytes behind the chunks: the index and the tail.
pub fn ending(entries: &[Entry], index_at: u64) -> Vec<u8> {
    let index: &[u8] = bytemuck::cast_slice(entries);
    let tail = Tail {
        index_at,
        chunks: entries.len() as u64,
        sum: xxh3_64(index),
        end: END,
    };
    [index, bytemuck::bytes_of(&tail)].concat()
}
