//! A look at some triangles of an input that was not read yet, where they lie at a fixed distance.
//!
//! Why that is often so: arrays, binary STL, and binary PLY files that have nothing but triangles
//! keep each triangle in as many bytes as the next. Texts and polygons do not, and are not looked
//! at. Nothing is checked here: what is wrong with the rows is told when they are read.
//!
//! Memory: the triangles asked for, and their bytes. I/O: those bytes.

use super::open::{begin, find, find_arrays};
use super::survey::workspace;
use super::{Endian, Format, IndexKind, Request, ply, stl};
use crate::disk::DataFile;
use crate::error::Result;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// Where the triangles of a file lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rows {
    /// Byte of the first.
    pub at: u64,
    /// Bytes from one to the next.
    pub row: u64,
    /// Bytes of a row before its corners.
    pub before: u64,
    /// How many there are.
    pub triangles: u64,
    /// What a corner is.
    pub corner: Corner,
}

/// What the rows have for a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Corner {
    /// The id of a vertex.
    Id(IndexKind, Endian),
    /// Three coordinates of so many bytes each: equal positions are one vertex.
    Position(u64),
}

impl Corner {
    fn bytes(self) -> u64 {
        match self {
            Corner::Id(kind, _) => kind.bytes(),
            Corner::Position(bytes) => 3 * bytes,
        }
    }
}

/// Triangles to be looked at.
#[derive(Debug)]
pub struct Look {
    file: DataFile,
    rows: Rows,
    bytes: Vec<u8>,
}

impl Look {
    /// A way to the triangles of the input, or `None` where they must be decoded to be told apart.
    ///
    /// # Errors
    /// As [`survey`](super::survey()).
    pub fn at(request: &Request) -> Result<Option<Look>> {
        let ws = workspace()?;
        let (format, reader) = find(&ws, request)?;
        let rows = match reader {
            None => {
                let v = find_arrays(&ws, request, format)?.v;
                Some(Rows {
                    at: v.at,
                    row: 3 * v.kind.bytes(),
                    before: 0,
                    triangles: v.triangles,
                    corner: Corner::Id(v.kind, v.endian),
                })
            }
            Some(mut reader) => {
                begin(&mut reader, format)?;
                match format {
                    Format::Ply => ply::rows(reader)?,
                    Format::Stl => stl::stated(&mut reader)?.map(|triangles| Rows {
                        at: stl::HEAD,
                        row: stl::FACET as u64,
                        before: 12,
                        triangles,
                        corner: Corner::Position(4),
                    }),
                    _ => None,
                }
            }
        };
        let open = |rows| Look::open(&request.path, rows);
        rows.filter(|rows| rows.triangles > 0).map(open).transpose()
    }

    fn open(path: &Path, rows: Rows) -> Result<Look> {
        Ok(Look {
            file: DataFile::open(path, &Default::default())?,
            rows,
            bytes: Vec::new(),
        })
    }

    /// How many triangles there are.
    pub fn triangles(&self) -> u64 {
        self.rows.triangles
    }

    /// True when corners are told apart by their positions.
    pub fn by_position(&self) -> bool {
        matches!(self.rows.corner, Corner::Position(_))
    }

    /// Fills `into` with the corners of `count` triangles from `first`: ids, or what stands for
    /// their positions.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn read(&mut self, first: u64, count: u64, into: &mut Vec<[u64; 3]>) -> Result<()> {
        let Rows {
            at, row, before, ..
        } = self.rows;
        self.bytes.resize((row * count) as usize, 0);
        self.file.read_at(&mut self.bytes, at + row * first)?;
        let corner = self.rows.corner;
        let width = corner.bytes() as usize;
        into.clear();
        into.extend(self.bytes.chunks_exact(row as usize).map(|row| {
            let corners = &row[before as usize..];
            [0, 1, 2].map(|k| word(&corners[k * width..][..width], corner))
        }));
        Ok(())
    }
}

/// The id in these bytes, or what stands for the position.
fn word(bytes: &[u8], corner: Corner) -> u64 {
    let Corner::Id(_, endian) = corner else {
        return xxh3_64(bytes);
    };
    let fold = |id: u64, byte: &u8| id << 8 | u64::from(*byte);
    match endian {
        Endian::Little => bytes.iter().rev().fold(0, fold),
        Endian::Big => bytes.iter().fold(0, fold),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_and_read_in_either_order() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rows");
        for (endian, ids) in [
            (Endian::Little, [7u32, 1 << 20, 9].map(u32::to_le_bytes)),
            (Endian::Big, [7u32, 1 << 20, 9].map(u32::to_be_bytes)),
        ] {
            let row = [&[0xAA; 5][..], &[3], ids.as_flattened()].concat();
            std::fs::write(&path, [&[0; 9][..], &row, &row].concat()).unwrap();
            let rows = Rows {
                at: 9,
                row: row.len() as u64,
                before: 6,
                triangles: 2,
                corner: Corner::Id(IndexKind::U4, endian),
            };
            let mut look = Look::open(&path, rows).unwrap();
            let mut found = Vec::new();
            look.read(1, 1, &mut found).unwrap();
            assert_eq!(found, [[7, 1 << 20, 9]]);
            assert!(look.read(1, 2, &mut found).is_err());
        }
    }
}
