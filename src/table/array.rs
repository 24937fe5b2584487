//! The arrays of a mesh folder as rows of ids or coordinates, whatever their width.
//!
//! Values are read from bytes in little-endian order, so neither alignment nor the machine's
//! byte order matters.
//!
//! Memory: none. I/O: the header of an array when it is opened.

use crate::corner::Index;
use crate::disk::DataFile;
use crate::error::{Error, Result};
use crate::folder::{self, Folder, npy};

/// The width of the ids of a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Width {
    U4,
    U8,
}

impl Width {
    /// The width that the folder's manifest names.
    pub(crate) fn of(folder: &Folder) -> Result<Width> {
        match folder.manifest().index.as_str() {
            "u4" => Ok(Width::U4),
            "u8" => Ok(Width::U8),
            other => Err(bad_type(folder, "index type u4 or u8", other)),
        }
    }

    pub(crate) fn bytes(self) -> usize {
        match self {
            Width::U4 => u32::BYTES,
            Width::U8 => u64::BYTES,
        }
    }

    pub(crate) fn descr(self) -> &'static str {
        match self {
            Width::U4 => u32::DESCR,
            Width::U8 => u64::DESCR,
        }
    }

    /// Appends an id, which must fit; `u64::MAX` is NONE at both widths.
    #[inline]
    pub(crate) fn put(self, bytes: &mut Vec<u8>, id: u64) {
        match self {
            Width::U4 => bytes.extend_from_slice(&u32::of(id).to_le_bytes()),
            Width::U8 => bytes.extend_from_slice(&u64::of(id).to_le_bytes()),
        }
    }

    /// The id number `i` of an array; NONE is `u64::MAX` at both widths.
    #[inline]
    pub(crate) fn get(self, bytes: &[u8], i: usize) -> u64 {
        match self {
            Width::U4 => u32::from_le_bytes(take(bytes, i)).wide(),
            Width::U8 => u64::from_le_bytes(take(bytes, i)),
        }
    }
}

/// The type of the coordinates of a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coords {
    F4,
    F8,
}

impl Coords {
    /// The type that the folder's manifest names; `None` for a mesh given as V alone.
    pub(crate) fn of(folder: &Folder) -> Result<Option<Coords>> {
        match folder.manifest().coords.as_deref() {
            None => Ok(None),
            Some("f4") => Ok(Some(Coords::F4)),
            Some("f8") => Ok(Some(Coords::F8)),
            Some(other) => Err(bad_type(folder, "coordinate type f4 or f8", other)),
        }
    }

    /// Bytes of a row of (N,3).
    pub(crate) fn row_bytes(self) -> usize {
        match self {
            Coords::F4 => 12,
            Coords::F8 => 24,
        }
    }

    pub(crate) fn descr(self) -> &'static str {
        match self {
            Coords::F4 => "<f4",
            Coords::F8 => "<f8",
        }
    }

    /// The row number `i` of (N,3); f4 widens exactly.
    #[inline]
    pub(crate) fn row(self, bytes: &[u8], i: usize) -> [f64; 3] {
        [0, 1, 2].map(|k| match self {
            Coords::F4 => f64::from(f32::from_le_bytes(take(bytes, 3 * i + k))),
            Coords::F8 => f64::from_le_bytes(take(bytes, 3 * i + k)),
        })
    }
}

#[inline]
fn take<const B: usize>(bytes: &[u8], i: usize) -> [u8; B] {
    let mut item = [0; B];
    item.copy_from_slice(&bytes[i * B..][..B]);
    item
}

fn bad_type(folder: &Folder, expected: &str, found: &str) -> Error {
    Error::input(
        &folder.path().join(folder::MANIFEST),
        "",
        expected,
        format!("{found:?}"),
        "the folder is of another version; use the program that wrote it",
    )
}

/// Opens an array that must have this type and shape, row by row from [`npy::DATA_START`].
///
/// # Errors
/// [`Error::Input`] when the folder has no such array, or another; [`Error::Io`].
pub(crate) fn open(folder: &Folder, name: &str, descr: &str, shape: &[u64]) -> Result<DataFile> {
    let file = folder.file(name)?;
    let header = npy::Header::read(&file)?;
    let fits = header.descr == descr && header.shape == shape;
    if fits && !header.fortran && header.data_start == npy::DATA_START {
        return Ok(file);
    }
    Err(Error::input(
        file.path(),
        "byte 0",
        format!(
            "type {descr} and shape {shape:?}, row by row from byte {}",
            npy::DATA_START
        ),
        format!(
            "type {} and shape {:?}, {} from byte {}",
            header.descr,
            header.shape,
            if header.fortran {
                "column by column"
            } else {
                "row by row"
            },
            header.data_start
        ),
        "the folder was changed; build it again",
    ))
}
