//! A look at some triangles of an input that was not read yet.
//!
//! Arrays, binary STL, and binary PLY files that have nothing but triangles keep each triangle in
//! as many bytes as the next, so they lie where their numbers say. In texts ([`lines`](super::lines))
//! and among polygons and strips ([`polygons`](super::polygons)) about where is known, and that does for a look.
//! Nothing is checked here: what is wrong with the rows is told when they are read.
//!
//! Memory: the triangles asked for, and their bytes, or 256 KiB of them. I/O: those bytes.

use super::lines::Lines;
use super::open::{begin, find, find_arrays};
use super::polygons::Polygons;
use super::survey::{self, workspace};
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

/// Where the triangles of an input lie.
#[derive(Debug)]
pub(super) enum Lies {
    /// At a fixed distance.
    Rows(Rows),
    /// In the lines of a text.
    Lines(Lines),
    /// Among polygons or strips in a binary file.
    Polygons(Polygons),
}

impl Lies {
    /// How many triangles there are, or about as many.
    pub fn triangles(&self) -> u64 {
        match self {
            Lies::Rows(rows) => rows.triangles,
            Lies::Lines(lines) => lines.triangles(),
            Lies::Polygons(polygons) => polygons.triangles,
        }
    }

    /// True when that is certain.
    pub fn exact(&self) -> bool {
        match self {
            Lies::Rows(_) => true,
            Lies::Lines(_) => false,
            Lies::Polygons(polygons) => polygons.exact,
        }
    }
}

/// Triangles to be looked at.
#[derive(Debug)]
pub struct Look {
    file: DataFile,
    lies: Lies,
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
        let lies = match reader {
            None => {
                let v = find_arrays(&ws, request, format)?.v;
                Some(Lies::Rows(Rows {
                    at: v.at,
                    row: 3 * v.kind.bytes(),
                    before: 0,
                    triangles: v.triangles,
                    corner: Corner::Id(v.kind, v.endian),
                }))
            }
            Some(mut reader) => {
                begin(&mut reader, format)?;
                match format {
                    Format::Ply => ply::lies(reader)?,
                    Format::Off => Some(Lies::Lines(survey::off_lines(reader)?)),
                    Format::Obj => Some(Lies::Lines(survey::obj_lines(&reader)?)),
                    _ => Some(match stl::stated(&mut reader)? {
                        Some(triangles) => Lies::Rows(Rows {
                            at: stl::HEAD,
                            row: stl::FACET as u64,
                            before: 12,
                            triangles,
                            corner: Corner::Position(4),
                        }),
                        None => Lies::Lines(survey::stl_lines(&reader)?),
                    }),
                }
            }
        };
        let open = |lies| Look::open(&request.path, lies);
        let look = lies.map(open).transpose()?;
        Ok(look.filter(|look| look.triangles() > 0))
    }

    fn open(path: &Path, lies: Lies) -> Result<Look> {
        Ok(Look {
            file: DataFile::open(path, &Default::default())?,
            lies,
            bytes: Vec::new(),
        })
    }

    /// How many triangles there are, or about as many.
    pub fn triangles(&self) -> u64 {
        self.lies.triangles()
    }

    /// True when corners are told apart by their positions.
    pub fn by_position(&self) -> bool {
        match &self.lies {
            Lies::Rows(rows) => matches!(rows.corner, Corner::Position(_)),
            Lies::Lines(lines) => lines.by_position(),
            Lies::Polygons(_) => false,
        }
    }

    /// Fills `into` with the corners of `count` triangles from `first`: ids, or what stands for
    /// their positions. Where triangles do not lie at a fixed distance they are about these, and may be
    /// fewer.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn read(&mut self, first: u64, count: u64, into: &mut Vec<[u64; 3]>) -> Result<()> {
        let Rows {
            at,
            row,
            before,
            corner,
            ..
        } = match &self.lies {
            Lies::Rows(rows) => *rows,
            Lies::Lines(lines) => return lines.read(first, count, into),
            Lies::Polygons(polygons) => return polygons.read(&self.file, first, count, into),
        };
        self.bytes.resize((row * count) as usize, 0);
        self.file.read_at(&mut self.bytes, at + row * first)?;
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
    match corner {
        Corner::Id(_, endian) => number(bytes, endian),
        Corner::Position(_) => xxh3_64(bytes),
    }
}

/// The unsigned number in these bytes.
pub(super) fn number(bytes: &[u8], endian: Endian) -> u64 {
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
            let mut look = Look::open(&path, Lies::Rows(rows)).unwrap();
            let mut found = Vec::new();
            look.read(1, 1, &mut found).unwrap();
            assert_eq!(found, [[7, 1 << 20, 9]]);
            assert!(look.read(1, 2, &mut found).is_err());
        }
    }
}
