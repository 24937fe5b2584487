//! A compressed file, opened: what its index says, and its chunks one by one.
//!
//! Memory: 160 bytes a chunk for the index and the numbers of first vertices, leased. I/O: head,
//! tail and index when it is opened; then the chunks that are asked for.

use super::chunk::Piece;
use super::file::{END, ENTRY, Entry, HEAD, Head, MAGIC, TAIL, Tail, VERSION};
use super::grid::Grid;
use super::numbers::{self, Numbers};
use super::seam::{self, Reference};
use super::{Damaged, Level};
use crate::disk::{Budget, Counters, DataFile, Lease};
use crate::error::{Error, Result};
use bytemuck::Zeroable;
use std::path::Path;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// A chunk, decoded.
pub(super) struct Unpacked {
    /// Its triangles and positions.
    pub piece: Piece,
    /// The number of the vertex at each place.
    pub places: Vec<u32>,
    /// Its vertices of earlier chunks, ascending.
    pub references: Vec<Reference>,
    /// The numbers that the folder had, when they were kept.
    pub numbers: Numbers,
}

impl Unpacked {
    /// Hands out the number of each vertex, in the order of their places, where it lies, and the
    /// reference that it is.
    pub(super) fn each_vertex(&self, mut each: impl FnMut(usize, [i32; 3], Option<&Reference>)) {
        let mut rest = self.references.iter().peekable();
        for (place, &number) in (0..).zip(&self.places) {
            let number = number as usize;
            let at = self.piece.positions[number];
            each(number, at, rest.next_if(|r| r.place == place));
        }
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
        let Some(grid) = grid.filter(|_| head.ordered < 2) else {
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
            if !entry.fits(at, tail.index_at, head.ordered == 1) {
                let place = tail.index_at + i as u64 * ENTRY;
                return Err(damaged(path, place, "an entry that agrees with the others"));
            }
            at = entry.end();
            first_vertex.push(vertices);
            triangles += entry.all_triangles();
            vertices += entry.own();
        }
        let components = entries.iter().map(|e| e.end_component).max();
        if (at, triangles, vertices) != (tail.index_at, head.triangles, head.vertices)
            || components > Some(head.triangles)
        {
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

    /// Appends the row of G at integer coordinates.
    pub(super) fn restore(&self, at: [i32; 3], row: &mut Vec<u8>) {
        self.grid.restore(self.head.coords == 8, at, row);
    }

    /// Number of components.
    pub fn components(&self) -> u64 {
        let ends = self.entries.iter().map(|e| e.end_component);
        ends.max().unwrap_or(0)
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
        let (labels, numbers) = (sum(|e| e.label_bytes), sum(|e| e.number_bytes));
        let components = self.components();
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
             positions {positions} bytes: {:.3} bits a vertex\n\
             {components} components {labels} bytes: {:.3} bits a triangle\n{}",
            sum(|e| e.degenerate),
            sum(|e| e.loose),
            self.entries.len(),
            per(bytes, t),
            per(connectivity, t),
            sum(|e| e.references),
            per(positions, n),
            per(labels, t),
            match self.head.ordered {
                0 => String::new(),
                _ => format!(
                    "order {numbers} bytes: {:.3} bits a triangle\n",
                    per(numbers, t)
                ),
            },
        ))
    }

    /// Reads and decodes a chunk. The memory is the caller's.
    ///
    /// # Errors
    /// [`Error::Input`] when it is damaged; [`Error::Io`].
    pub(super) fn chunk(&self, chunk: usize) -> Result<Unpacked> {
        let entry = &self.entries[chunk];
        let coded = entry.bytes + entry.reference_bytes;
        let mut bytes = vec![0; (coded + entry.number_bytes) as usize];
        self.file.read_at(&mut bytes, entry.at)?;
        let bad = |what| self.bad(chunk, what);
        if xxh3_64(&bytes) != entry.sum {
            return Err(bad(Damaged("bytes that contradict its checksum")));
        }
        let (coded, numbers) = bytes.split_at(coded as usize);
        let (body, references) = coded.split_at(entry.bytes as usize);
        let decoded = super::chunk::decode(body, entry.extent(), self.head.level());
        let (piece, places) = decoded.map_err(bad)?;
        let earlier = &self.entries[..chunk];
        let references = seam::decode(references, entry, earlier).map_err(bad)?;
        let numbers = match self.head.ordered {
            0 => Numbers::default(),
            _ => {
                let counts = [entry.all_triangles(), entry.vertices];
                let all = [self.head.triangles, self.head.vertices];
                numbers::decode(numbers, counts, all).map_err(bad)?
            }
        };
        Ok(Unpacked {
            piece,
            places,
            references,
            numbers,
        })
    }

    /// Reads nothing of a chunk but the components of its triangles, and hands out their runs, in
    /// the order in which triangles are coded; those that name a vertex twice have none.
    ///
    /// # Errors
    /// [`Error::Input`] when they are damaged; [`Error::Io`].
    pub(super) fn labels(&self, chunk: usize, mut each: impl FnMut(u64, u64)) -> Result<()> {
        let entry = &self.entries[chunk];
        if entry.label_bytes == 0 {
            each(entry.triangles, entry.first_component);
            return Ok(());
        }
        let mut bytes = vec![0; entry.label_bytes as usize];
        self.file
            .read_at(&mut bytes, entry.end() - entry.label_bytes)?;
        if xxh3_64(&bytes) != entry.label_sum {
            let what = "bytes that contradict the checksum of its components";
            return Err(self.bad(chunk, Damaged(what)));
        }
        let runs = super::labels::decode(&bytes, entry.triangles, &entry.components(), each);
        runs.map_err(|what| self.bad(chunk, what))
    }

    fn bad(&self, chunk: usize, what: Damaged) -> Error {
        let help = "the file is damaged; get it anew, or encode the mesh again";
        let at = format!("chunk {chunk} at byte {}", self.entries[chunk].at);
        Error::input(self.path(), at, "a chunk as it was written", what.0, help)
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
