//! The file `MESH.cmz`: a head, the chunks one behind the other, the index, a tail.
//!
//! ```text
//!   head | chunk 0: triangles, references | chunk 1 | ... | entries of the index | tail
//! ```
//!
//! Everything but the coded bytes is little-endian with fixed places; `docs/format.md` has the
//! table. Head, each chunk and the index have an xxh3 checksum. Counts are held to each other and
//! to the length of the file before anything is sized by them.
//!
//! Memory: 120 bytes a chunk for the index and the numbers of first vertices, leased. I/O: head, tail and index.

use super::chunk::Piece;
use super::grid::Grid;
use super::walk::Extent;
use super::{Damaged, Level};
use crate::disk::{Budget, Counters, DataFile, Lease};
use crate::error::{Error, Result};
use bytemuck::{Pod, Zeroable};
use std::path::Path;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// The first bytes of a file.
pub const MAGIC: [u8; 8] = *b"\x89CMZ\r\n\x1a\n";
/// The last bytes of a file.
const END: [u8; 8] = *b"CMZ end\n";
/// The version that this program writes and reads.
pub const VERSION: u32 = 1;
/// The most triangles of a chunk; loose vertices count like triangles.
pub const MOST_TRIANGLES: u64 = 1 << 20;

/// The beginning of a file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Head {
    magic: [u8; 8],
    version: u32,
    /// 0 fast, 1 strong.
    pub level: u8,
    /// 0 no coordinates, 1 a grid, 2 bits of f4.
    pub grid: u8,
    /// Bytes of a coordinate that is handed out: 4, 8, or 0 for none.
    pub coords: u8,
    spare: u8,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Least coordinates of a grid.
    pub min: [f64; 3],
    /// The step of a grid.
    pub step: f64,
    sum: u64,
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
    /// Checksum of its bytes.
    pub sum: u64,
}

/// The end of a file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Tail {
    index_at: u64,
    chunks: u64,
    sum: u64,
    end: [u8; 8],
}

const HEAD: u64 = size_of::<Head>() as u64;
const ENTRY: u64 = size_of::<Entry>() as u64;
const TAIL: u64 = size_of::<Tail>() as u64;
const _: () = assert!(HEAD == 72 && ENTRY == 112 && TAIL == 32);

impl Head {
    /// The head of a mesh.
    pub fn new(level: Level, grid: Grid, wide: bool, triangles: u64, vertices: u64) -> Head {
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
            spare: 0,
            triangles,
            vertices,
            min,
            step,
            sum: 0,
        };
        head.sum = head.summed();
        head
    }

    fn summed(&self) -> u64 {
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

    fn fits(&self, at: u64, end: u64) -> bool {
        let small = |x: u64| x <= MOST_TRIANGLES;
        let sized = [self.bytes, self.reference_bytes]
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
    }
}

/// A file, opened: head and index read and checked.
#[derive(Debug)]
pub struct Packed {
    file: DataFile,
    /// The head.
    pub head: Head,
    /// How its integers are coordinates.
    pub grid: Grid,
    /// The chunks.
    pub entries: Vec<Entry>,
    /// Vertices before those of each chunk.
    pub first_vertex: Vec<u64>,
    _lease: Lease,
}

impl Packed {
    /// Opens a file.
    ///
    /// # Errors
    /// [`Error::Input`] when it is none, is damaged, cut short or of another version;
    /// [`Error::Budget`] when the index does not fit; [`Error::Io`].
    pub fn open(budget: &Budget, io: &Arc<Counters>, path: &Path) -> Result<Packed> {
        let file = DataFile::open(path, io)?;
        let len = file.len()?;
        let mut head = Head::zeroed();
        if len < HEAD + TAIL {
            return Err(cut(path, len));
        }
        file.read_at(bytemuck::bytes_of_mut(&mut head), 0)?;
        if head.magic != MAGIC {
            let help = "give a file that `cornermill encode` wrote";
            return Err(Error::input(
                path,
                "byte 0",
                "a .cmz file",
                "other bytes",
                help,
            ));
        }
        if head.version != VERSION {
            let (expected, found) = (format!("version {VERSION}"), head.version.to_string());
            let help = "use a program of the version that wrote it";
            return Err(Error::input(path, "byte 8", expected, found, help));
        }
        let grid = Grid::of_head(&head).filter(|_| head.sum == head.summed() && head.level < 2);
        let Some(grid) = grid else {
            return Err(damaged(path, 0, "a head that agrees with its checksum"));
        };
        let mut tail = Tail::zeroed();
        file.read_at(bytemuck::bytes_of_mut(&mut tail), len - TAIL)?;
        let room = len - HEAD - TAIL;
        let fits = tail.end == END
            && tail.chunks <= room / ENTRY
            && tail.index_at == len - TAIL - tail.chunks * ENTRY;
        if !fits {
            return Err(cut(path, len));
        }
        let bytes = tail.chunks * (ENTRY + 8);
        let lease = budget.lease("the index of the chunks", bytes)?;
        let mut entries = vec![Entry::zeroed(); tail.chunks as usize];
        file.read_at(bytemuck::cast_slice_mut(&mut entries), tail.index_at)?;
        if xxh3_64(bytemuck::cast_slice(&entries)) != tail.sum {
            let what = "an index that agrees with its checksum";
            return Err(damaged(path, tail.index_at, what));
        }
        let mut first_vertex = Vec::with_capacity(entries.len());
        let (mut at, mut triangles, mut vertices) = (HEAD, 0, 0);
        for (i, entry) in entries.iter().enumerate() {
            if !entry.fits(at, tail.index_at) {
                let place = tail.index_at + i as u64 * ENTRY;
                return Err(damaged(path, place, "an entry that agrees with the others"));
            }
            at += entry.bytes + entry.reference_bytes;
            first_vertex.push(vertices);
            triangles += entry.all_triangles();
            vertices += entry.own();
        }
        if (at, triangles, vertices) != (tail.index_at, head.triangles, head.vertices) {
            let what = "chunks that add up to the mesh of the head";
            return Err(damaged(path, tail.index_at, what));
        }
        Ok(Packed {
            file,
            head,
            grid,
            entries,
            first_vertex,
            _lease: lease,
        })
    }

    /// The file's path.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Length of the file in bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn bytes(&self) -> Result<u64> {
        self.file.len()
    }

    /// The least and the largest coordinates of a chunk; `None` when there are none.
    pub fn bounds(&self, chunk: usize) -> Option<[[f64; 3]; 2]> {
        let entry = &self.entries[chunk];
        let of = |at| {
            let mut row = Vec::new();
            self.grid.restore(true, at, &mut row);
            // All bits of f4 come back in 4 bytes each, a grid's nodes in 8.
            let coordinate = |k: usize| match row.len() {
                24 => f64::from_le_bytes(std::array::from_fn(|i| row[8 * k + i])),
                _ => f32::from_le_bytes(std::array::from_fn(|i| row[4 * k + i])).into(),
            };
            [0, 1, 2].map(coordinate)
        };
        (self.head.coords > 0).then(|| [of(entry.low), of(entry.high)])
    }

    /// What the index says, for people: counts, and where the bytes go.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn describe(&self) -> Result<String> {
        let sum = |of: fn(&Entry) -> u64| self.entries.iter().map(of).sum::<u64>();
        let bytes = self.bytes()?;
        let references = sum(|e| e.reference_bytes);
        let connectivity = sum(|e| e.connectivity) + references;
        let positions = sum(|e| e.bytes - e.connectivity);
        let per = |bytes: u64, n: u64| 8.0 * bytes as f64 / n.max(1) as f64;
        let (t, n) = (self.head.triangles, self.head.vertices);
        let grid = match self.grid {
            Grid::None => "no coordinates".to_owned(),
            Grid::Bits => "coordinates: all bits of f4".to_owned(),
            Grid::Nodes { min, step } => {
                format!("coordinates: a grid of step {step} from {min:?}")
            }
        };
        let level = match self.head.level() {
            Level::Fast => "fast",
            Level::Strong => "strong",
        };
        Ok(format!(
            "{t} triangles ({} of them degenerate), {n} vertices ({} of them loose)\n\
             {} chunks, level {level}, {grid}\n\
             {bytes} bytes: {:.3} bits a triangle\n\
             connectivity {connectivity} bytes: {:.3} bits a triangle, of which {} references \
             take {references} bytes\n\
             positions {positions} bytes: {:.3} bits a vertex\n",
            sum(|e| e.degenerate),
            sum(|e| e.loose),
            self.entries.len(),
            per(bytes, t),
            per(connectivity, t),
            sum(|e| e.references),
            per(positions, n),
        ))
    }

    /// Reads and decodes a chunk, with the references of its vertices, ascending. The memory is
    /// the caller's.
    ///
    /// # Errors
    /// [`Error::Input`] when it is damaged; [`Error::Io`].
    pub fn chunk(&self, chunk: usize) -> Result<(Piece, Vec<super::seam::Reference>)> {
        let entry = &self.entries[chunk];
        let mut bytes = vec![0; (entry.bytes + entry.reference_bytes) as usize];
        self.file.read_at(&mut bytes, entry.at)?;
        let bad = |what: Damaged| {
            let help = "the file is damaged; get it anew, or encode the mesh again";
            let (path, at) = (self.path(), format!("chunk {chunk} at byte {}", entry.at));
            Error::input(path, at, "a chunk as it was written", what.0, help)
        };
        if xxh3_64(&bytes) != entry.sum {
            return Err(bad(Damaged("bytes that contradict its checksum")));
        }
        let (body, references) = bytes.split_at(entry.bytes as usize);
        let piece = super::chunk::decode(body, entry.extent(), self.head.level()).map_err(bad)?;
        let earlier = &self.entries[..chunk];
        let references = super::seam::decode(references, entry, earlier).map_err(bad)?;
        Ok((piece, references))
    }
}

fn cut(path: &Path, len: u64) -> Error {
    let found = format!("{len} bytes without it");
    let help = "the file is cut short or none of ours; get it anew, or encode the mesh again";
    Error::input(path, "its end", "the index of a .cmz file", found, help)
}

fn damaged(path: &Path, at: u64, expected: &str) -> Error {
    let help = "the file is damaged; get it anew, or encode the mesh again";
    Error::input(path, format!("byte {at}"), expected, "another", help)
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
