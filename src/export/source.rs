//! What an export reads: the arrays of a folder, or two that belong to none.
//!
//! Memory: none. I/O: the headers of the arrays.

use crate::corner::Index;
use crate::disk::{Counters, DataFile};
use crate::error::{Error, Result};
use crate::folder::{self, Folder, npy};
use crate::table::array::{self, Coords, Width};
use std::path::Path;
use std::sync::Arc;

/// V and G.
pub(super) struct Source<'a> {
    /// The folder that they are of. Without one there are no components, and no flips.
    pub(super) folder: Option<&'a Folder>,
    pub(super) v: DataFile,
    pub(super) width: Width,
    /// G, and the type of its coordinates.
    pub(super) g: Option<(Coords, DataFile)>,
    pub(super) triangles: u64,
    pub(super) vertices: u64,
}

impl<'a> Source<'a> {
    /// The arrays of a folder.
    pub(super) fn of(folder: &'a Folder) -> Result<Source<'a>> {
        let counts = &folder.manifest().counts;
        let (t, n) = (counts.triangles, counts.vertices);
        let width = Width::of(folder)?;
        let g = match Coords::of(folder)? {
            Some(kind) => {
                let file = array::open(folder, folder::G, kind.descr(), &[n, 3])?;
                Some((kind, file))
            }
            None => None,
        };
        Ok(Source {
            folder: Some(folder),
            v: array::open(folder, folder::V, width.descr(), &[t, 3])?,
            width,
            g,
            triangles: t,
            vertices: n,
        })
    }

    /// Two arrays as a folder would have them.
    pub(super) fn arrays(
        v: &Path,
        g: Option<&Path>,
        vertices: u64,
        io: &Arc<Counters>,
    ) -> Result<Source<'static>> {
        let (v, descr, triangles) = rows(v, io)?;
        let width = [Width::U4, Width::U8];
        let width = width.into_iter().find(|w| w.descr() == descr);
        let g = match g {
            None => None,
            Some(path) => {
                let (file, descr, _) = rows(path, io)?;
                let kind = [Coords::F4, Coords::F8];
                let kind = kind.into_iter().find(|k| k.descr() == descr);
                Some((
                    kind.ok_or_else(|| other(&file, "<f4 or <f8", &descr))?,
                    file,
                ))
            }
        };
        Ok(Source {
            folder: None,
            width: width.ok_or_else(|| {
                let ids = format!("{} or {}", u32::DESCR, u64::DESCR);
                other(&v, &ids, &descr)
            })?,
            v,
            g,
            triangles,
            vertices,
        })
    }
}

/// An array with rows of three: its file, its type, how many there are.
fn rows(path: &Path, io: &Arc<Counters>) -> Result<(DataFile, String, u64)> {
    let file = DataFile::open(path, io)?;
    let header = npy::Header::read(&file)?;
    match header.shape[..] {
        [n, 3] if header.data_start == npy::DATA_START && !header.fortran => {
            Ok((file, header.descr, n))
        }
        _ => Err(other(&file, "rows of three", &format!("{header:?}"))),
    }
}

fn other(file: &DataFile, expected: &str, found: &str) -> Error {
    let help = "the array was changed; decode it again";
    Error::input(file.path(), "byte 0", expected, found, help)
}
