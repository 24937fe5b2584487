//! The mesh written down, and opened again.

use super::{CoordArray, CoordKind, Endian, IndexArray, IndexKind, Mesh, Source, arrays};
use crate::disk::journal::{Keep, Pen, Reader, check_length};
use crate::disk::{DataFile, fs};
use crate::error::{Error, Result};
use crate::folder::InputEntry;
use std::path::Path;

const INDICES: [IndexKind; 4] = [IndexKind::U4, IndexKind::U8, IndexKind::I4, IndexKind::I8];
const COORDS: [CoordKind; 2] = [CoordKind::F4, CoordKind::F8];
const ENDIANS: [Endian; 2] = [Endian::Little, Endian::Big];

fn put<T: PartialEq>(to: &mut Pen, all: &[T], one: &T) -> Result<()> {
    to.number(all.iter().position(|each| each == one).unwrap_or(0) as u64)
}

fn get<T: Copy>(from: &mut Reader, all: &[T]) -> Result<T> {
    let at = from.number()?;
    let unknown = || Error::Internal(format!("a journal with a type of number {at}"));
    all.get(at as usize).copied().ok_or_else(unknown)
}

impl Keep for Source {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        match self {
            Source::Scratch(file) => {
                to.number(1)?;
                to.file(file)
            }
            Source::Named(file) => {
                to.number(0)?;
                to.path(file.path())
            }
        }
    }

    fn restore(from: &mut Reader) -> Result<Source> {
        if from.number()? == 1 {
            return Ok(Source::Scratch(from.file()?));
        }
        let path = from.path()?;
        Ok(Source::Named(DataFile::open(&path, &from.io)?))
    }
}

impl Keep for InputEntry {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let json = serde_json::to_string(self);
        to.text(&json.map_err(|e| Error::Internal(format!("an entry that is no JSON: {e}")))?)
    }

    fn restore(from: &mut Reader) -> Result<InputEntry> {
        serde_json::from_str(&from.text()?)
            .map_err(|e| Error::Internal(format!("an entry that is no JSON: {e}")))
    }
}

impl Keep for IndexArray {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.source.keep(to)?;
        put(to, &INDICES, &self.kind)?;
        put(to, &ENDIANS, &self.endian)?;
        to.number(self.at)?;
        to.number(self.triangles)
    }

    fn restore(from: &mut Reader) -> Result<IndexArray> {
        Ok(IndexArray {
            source: Source::restore(from)?,
            kind: get(from, &INDICES)?,
            endian: get(from, &ENDIANS)?,
            at: from.number()?,
            triangles: from.number()?,
        })
    }
}

impl CoordArray {
    /// First byte behind the rows.
    fn end(&self) -> u64 {
        self.at + 3 * self.kind.bytes() * self.vertices
    }
}

impl Keep for CoordArray {
    /// One that lies in the new folder is synced, as scratch files are.
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.source.keep(to)?;
        put(to, &COORDS, &self.kind)?;
        put(to, &ENDIANS, &self.endian)?;
        for number in [self.at, self.vertices, u64::from(self.placed)] {
            to.number(number)?;
        }
        if self.placed {
            let file = self.source.data();
            file.sync()?;
            let dir = file.path().parent().unwrap_or(Path::new("."));
            fs::sync_dir(dir).map_err(|e| Error::io(dir, "sync the folder", e))?;
        }
        Ok(())
    }

    fn restore(from: &mut Reader) -> Result<CoordArray> {
        let g = CoordArray {
            source: Source::restore(from)?,
            kind: get(from, &COORDS)?,
            endian: get(from, &ENDIANS)?,
            at: from.number()?,
            vertices: from.number()?,
            placed: from.number()? == 1,
        };
        if g.placed {
            let file = g.source.data();
            check_length(file, g.end())?;
            from.stays(file.path().file_name().unwrap_or_default());
        }
        Ok(g)
    }
}

impl Keep for Mesh {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.v.keep(to)?;
        self.g.keep(to)?;
        // One more than the number that was given, or none.
        to.number(self.vertices.map_or(0, |n| n + 1))?;
        to.number(self.polygons_fanned)?;
        to.number(u64::from(self.welded))?;
        to.number(self.sums.len() as u64)?;
        self.entry.keep(to)
    }

    /// Digests that were being taken are taken anew, by whoever needs them.
    fn restore(from: &mut Reader) -> Result<Mesh> {
        let mut mesh = Mesh {
            v: IndexArray::restore(from)?,
            g: Option::restore(from)?,
            vertices: from.number()?.checked_sub(1),
            polygons_fanned: from.number()?,
            welded: from.number()? == 1,
            sums: Vec::new(),
            entry: InputEntry {
                format: String::new(),
                files: Vec::new(),
            },
        };
        let sums = from.number()?;
        mesh.entry = InputEntry::restore(from)?;
        if sums > 0 {
            mesh.sums = arrays::sums_of(&from.budget, &mesh.v, mesh.g.as_ref())?;
        }
        Ok(mesh)
    }
}
