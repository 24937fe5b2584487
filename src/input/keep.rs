//! The opened mesh written down, and opened again.

use super::{CoordArray, CoordKind, Endian, IndexArray, IndexKind, Mesh, Source, arrays};
use crate::disk::DataFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};

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

impl Keep for Mesh {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let (v, json) = (&self.v, serde_json::to_string(&self.entry));
        v.source.keep(to)?;
        put(to, &INDICES, &v.kind)?;
        put(to, &ENDIANS, &v.endian)?;
        for number in [v.at, v.triangles, u64::from(self.g.is_some())] {
            to.number(number)?;
        }
        if let Some(g) = &self.g {
            g.source.keep(to)?;
            put(to, &COORDS, &g.kind)?;
            put(to, &ENDIANS, &g.endian)?;
            for number in [g.at, g.vertices, u64::from(g.placed)] {
                to.number(number)?;
            }
        }
        // One more than the number that was given, or none.
        to.number(self.vertices.map_or(0, |n| n + 1))?;
        for number in [
            self.polygons_fanned,
            u64::from(self.welded),
            self.sums.len() as u64,
        ] {
            to.number(number)?;
        }
        to.text(&json.map_err(|e| Error::Internal(format!("an entry that is no JSON: {e}")))?)
    }

    /// Digests that were being taken are taken anew, by whoever needs them.
    fn restore(from: &mut Reader) -> Result<Mesh> {
        let source = Source::restore(from)?;
        let (kind, endian) = (get(from, &INDICES)?, get(from, &ENDIANS)?);
        let v = IndexArray {
            source,
            kind,
            endian,
            at: from.number()?,
            triangles: from.number()?,
        };
        let g = match from.number()? {
            0 => None,
            _ => Some(CoordArray {
                source: Source::restore(from)?,
                kind: get(from, &COORDS)?,
                endian: get(from, &ENDIANS)?,
                at: from.number()?,
                vertices: from.number()?,
                placed: from.number()? == 1,
            }),
        };
        let vertices = from.number()?.checked_sub(1);
        let (polygons_fanned, welded) = (from.number()?, from.number()? == 1);
        let sums = from.number()?;
        let entry = serde_json::from_str(&from.text()?)
            .map_err(|e| Error::Internal(format!("an entry that is no JSON: {e}")))?;
        let mut mesh = Mesh {
            v,
            g,
            vertices,
            polygons_fanned,
            welded,
            entry,
            sums: Vec::new(),
        };
        if sums > 0 {
            mesh.sums = arrays::sums_of(&from.budget, &mesh.v, mesh.g.as_ref())?;
        }
        Ok(mesh)
    }
}
