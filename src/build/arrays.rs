//! Reading the input's arrays in ranges, and the files of the new folder.
//!
//! Why ranges: a pass looks at one range, in a window or buffer of its own, then at the next;
//! no array is ever whole in memory.
//!
//! Memory: the range asked for, twice when it must be converted. I/O: what is asked for.

use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::{DataFile, Window, Workspace};
use crate::error::{Error, Result};
use crate::folder::npy::{DATA_START, header_bytes};
use crate::folder::{self, WarmSums};
use crate::input::{CoordArray, CoordKind, Endian, IndexArray, IndexKind};
use std::ops::Range;
use std::path::Path;

/// True when an array of this kind can be used as it lies.
fn native<I: Index>(array: &IndexArray) -> bool {
    let little = array.endian == Endian::Little && cfg!(target_endian = "little");
    let same = match array.kind {
        IndexKind::U4 => I::BYTES == 4,
        IndexKind::U8 => I::BYTES == 8,
        IndexKind::I4 | IndexKind::I8 => false,
    };
    little && same && array.at.is_multiple_of(I::BYTES as u64)
}

fn kind_bytes(kind: IndexKind) -> u64 {
    match kind {
        IndexKind::U4 | IndexKind::I4 => 4,
        IndexKind::U8 | IndexKind::I8 => 8,
    }
}

/// Reads ranges of triangles as type I. One for each thread; buffers are reused.
pub struct TriangleReader<'a, I> {
    array: &'a IndexArray,
    /// The bytes read last, when they are not needed again after them.
    done: Option<Range<u64>>,
    last: bool,
    window: Option<Window>,
    raw: Vec<u8>,
    buf: Vec<I>,
}

impl<'a, I: Index> TriangleReader<'a, I> {
    /// Bytes a triangle that a reader holds at most: the window or the read buffer, and the
    /// converted copy.
    pub const BYTES: u64 = 24 + 3 * I::BYTES as u64;

    /// A reader of the array.
    pub fn new(array: &'a IndexArray) -> Self {
        TriangleReader {
            array,
            done: None,
            last: false,
            window: None,
            raw: Vec::new(),
            buf: Vec::new(),
        }
    }

    /// A reader whose triangles hardly any pass after it reads again: those of a long file leave
    /// the page cache behind it.
    pub fn last(array: &'a IndexArray) -> Self {
        TriangleReader {
            last: true,
            ..TriangleReader::new(array)
        }
    }

    /// The vertices of the corners of `count` triangles from `first`.
    ///
    /// # Errors
    /// [`Error::Input`] for an index that no mesh of this width can have, or a file that
    /// became shorter; [`Error::Io`].
    pub fn read(&mut self, first: u64, count: u64) -> Result<&[I]> {
        let item = kind_bytes(self.array.kind);
        let at = self.array.at + first * 3 * item;
        let bytes = (count * 3 * item) as usize;
        // The window before is unmapped first, so that at most one is resident.
        self.window = None;
        let file = self.array.source.data();
        if self.last
            && let Some(done) = self.done.replace(at..at + bytes as u64)
        {
            let rows = self.array.triangles * 3 * item;
            file.release(done, rows);
        }
        if native::<I>(self.array) {
            let window =
                self.window
                    .insert(Window::populated(self.array.source.data(), at, bytes)?);
            if let Some(v) = window.slice() {
                return Ok(v);
            }
            return Err(Error::Internal("an aligned window was not aligned".into()));
        }
        self.raw.resize(bytes, 0);
        self.array.source.data().read_at(&mut self.raw, at)?;
        self.convert(first)?;
        Ok(&self.buf)
    }

    fn convert(&mut self, first: u64) -> Result<()> {
        let big = self.array.endian == Endian::Big;
        self.buf.clear();
        macro_rules! each {
            ($t:ty) => {
                for (i, x) in self
                    .raw
                    .as_chunks::<{ size_of::<$t>() }>()
                    .0
                    .iter()
                    .enumerate()
                {
                    let x = if big {
                        <$t>::from_be_bytes(*x)
                    } else {
                        <$t>::from_le_bytes(*x)
                    };
                    match u64::try_from(x).ok().and_then(I::narrow) {
                        Some(id) if id != I::NONE => self.buf.push(id),
                        _ => return Err(bad_index(self.array, 3 * first + i as u64, x)),
                    }
                }
            };
        }
        match self.array.kind {
            IndexKind::U4 => each!(u32),
            IndexKind::U8 => each!(u64),
            IndexKind::I4 => each!(i32),
            IndexKind::I8 => each!(i64),
        }
        Ok(())
    }
}

/// An index that names no vertex.
pub fn bad_index(array: &IndexArray, corner: u64, found: impl std::fmt::Display) -> Error {
    Error::input(
        array.source.data().path(),
        format!("triangle {}, corner {}", corner / 3, corner % 3),
        "the index of a vertex of the mesh",
        found.to_string(),
        "indices count from 0 and stay below the number of vertices; mend the file or give \
         the right --vertices",
    )
}

/// Reads ranges of coordinates as type X. One for each thread; buffers are reused.
pub struct CoordReader<'a, X> {
    array: &'a CoordArray,
    window: Option<Window>,
    raw: Vec<u8>,
    buf: Vec<[X; 3]>,
}

impl<'a, X: Coord> CoordReader<'a, X> {
    /// Bytes a vertex that a reader holds at most.
    pub const BYTES: u64 = 24 + 3 * X::BYTES as u64;

    /// A reader of the array.
    pub fn new(array: &'a CoordArray) -> Self {
        CoordReader {
            array,
            window: None,
            raw: Vec::new(),
            buf: Vec::new(),
        }
    }

    /// The coordinates of `count` vertices from `first`.
    ///
    /// # Errors
    /// [`Error::Input`] when the file became shorter, or for a finite coordinate beyond X;
    /// [`Error::Io`].
    pub fn read(&mut self, first: u64, count: u64) -> Result<&[[X; 3]]> {
        let item = match self.array.kind {
            CoordKind::F4 => 4,
            CoordKind::F8 => 8,
        };
        let at = self.array.at + first * 3 * item;
        let bytes = (count * 3 * item) as usize;
        self.window = None;
        let little = self.array.endian == Endian::Little && cfg!(target_endian = "little");
        if little && item == X::BYTES as u64 && at.is_multiple_of(item) {
            let window =
                self.window
                    .insert(Window::populated(self.array.source.data(), at, bytes)?);
            if let Some(g) = window.slice() {
                return Ok(g);
            }
            return Err(Error::Internal("an aligned window was not aligned".into()));
        }
        self.raw.resize(bytes, 0);
        self.array.source.data().read_at(&mut self.raw, at)?;
        self.convert();
        self.refuse_overflow(first)?;
        Ok(&self.buf)
    }

    /// A finite coordinate that became infinite does not fit the type asked for.
    fn refuse_overflow(&self, first: u64) -> Result<()> {
        if self.array.kind == CoordKind::F4 || X::BYTES == 8 {
            return Ok(());
        }
        let infinite = |i: &usize| self.buf[i / 3][i % 3].wide().is_infinite();
        for i in (0..3 * self.buf.len()).filter(infinite) {
            let was = self.f8(&self.raw.as_chunks::<8>().0[i]);
            if was.is_finite() {
                return Err(Error::input(
                    self.array.source.data().path(),
                    format!("vertex {}", first + i as u64 / 3),
                    "a coordinate that 4 bytes hold",
                    format!("{was:e}"),
                    "store coordinates as 8 bytes: --coords f8",
                ));
            }
        }
        Ok(())
    }

    fn f8(&self, bytes: &[u8; 8]) -> f64 {
        f64::from_bits(match self.array.endian {
            Endian::Big => u64::from_be_bytes(*bytes),
            Endian::Little => u64::from_le_bytes(*bytes),
        })
    }

    fn convert(&mut self) {
        let big = self.array.endian == Endian::Big;
        self.buf.clear();
        let f4 = |b: &[u8; 4]| {
            let bits = if big {
                u32::from_be_bytes(*b)
            } else {
                u32::from_le_bytes(*b)
            };
            f32::from_bits(bits)
        };
        match self.array.kind {
            CoordKind::F4 => {
                let rows = self.raw.as_chunks::<4>().0.as_chunks::<3>().0;
                self.buf.extend(rows.iter().map(|r| {
                    // Equal widths keep the bits, so that a NaN keeps its payload.
                    [0, 1, 2].map(|a| same_or(f4(&r[a])))
                }));
            }
            CoordKind::F8 => {
                let rows = self.raw.as_chunks::<8>().0.as_chunks::<3>().0;
                let mut buf = std::mem::take(&mut self.buf);
                buf.extend(
                    rows.iter()
                        .map(|r| [0, 1, 2].map(|a| same_or(self.f8(&r[a])))),
                );
                self.buf = buf;
            }
        }
    }
}

/// Converts between coordinate types; the same type keeps its bits.
fn same_or<A: Coord, B: Coord>(x: A) -> B {
    bytemuck::try_cast(x).unwrap_or_else(|_| B::of(x.wide()))
}

/// One array file of the folder under construction.
#[derive(Debug)]
pub struct OutArray {
    /// The file.
    pub file: DataFile,
    /// Name in the folder.
    pub name: &'static str,
    /// NumPy type.
    pub descr: String,
    /// Shape.
    pub shape: Vec<u64>,
    /// Checksums, taken as blocks become whole.
    pub sums: WarmSums,
}

impl OutArray {
    /// Creates the file with its header and its full length (unwritten parts read as zeros).
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(
        dir: &Path,
        name: &'static str,
        descr: &str,
        shape: &[u64],
        row_bytes: u64,
        ws: &Workspace,
    ) -> Result<OutArray> {
        let path = dir.join(name);
        // G may lie there already, decoded to its place.
        let file = if path.exists() {
            DataFile::open_rw(&path, &ws.io)?
        } else {
            DataFile::create_new(&path, &ws.io)?
        };
        let bytes = DATA_START + shape[0] * row_bytes;
        file.set_len(bytes)?;
        // The last pass changes O and the labels a little nearly everywhere: sums taken before
        // would be for nothing.
        let early = ![folder::O, folder::COMPONENT].contains(&name);
        let sums = WarmSums::new(&ws.budget, bytes, early)?;
        let array = OutArray {
            file,
            name,
            descr: descr.to_owned(),
            shape: shape.to_vec(),
            sums,
        };
        array.write_at(&header_bytes(descr, shape), 0)?;
        Ok(array)
    }

    fn write_at(&self, bytes: &[u8], at: u64) -> Result<()> {
        self.file.write_at(bytes, at)?;
        self.sums.wrote(&self.file, at, bytes.len() as u64)
    }

    /// Writes items from item number `first` of an array of such items.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write<T: bytemuck::Pod>(&self, first: u64, items: &[T]) -> Result<()> {
        let at = DATA_START + first * size_of::<T>() as u64;
        self.write_at(bytemuck::cast_slice(items), at)
    }

    /// So many items from item number `first` were there already, and were read just now.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn seen<T: bytemuck::Pod>(&self, first: u64, items: &[T]) -> Result<()> {
        let at = DATA_START + first * size_of::<T>() as u64;
        self.sums.seen(&self.file, at, size_of_val(items) as u64)
    }

    /// Reads items from item number `first`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read<T: bytemuck::Pod>(&self, first: u64, items: &mut [T]) -> Result<()> {
        let at = DATA_START + first * size_of::<T>() as u64;
        self.file.read_at(bytemuck::cast_slice_mut(items), at)
    }
}
