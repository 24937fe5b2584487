//! Arrays that already lie on disk as V and G: `.npy` files and raw ones. Nothing is copied.
//!
//! Why nothing is copied: a `.npy` or raw array in C order *is* V or G row by row, whatever
//! its type and byte order, so it is enough to name the file, the byte where the data begins,
//! the type and the order. The build's scan reads the rows from there, checks every index and
//! converts on the way. What can be known without reading the rows is checked here: type,
//! shape, order of the axes, the file's length against them, V and G against each other.
//!
//! Memory: the headers (at most 64 KiB each), 48 bytes for each 64 MiB. I/O: the headers; the
//! digests of the files are taken as later passes read them.
//! Source: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

use super::{CoordArray, CoordKind, Endian, IndexArray, IndexKind, Mesh, Request, Source};
use crate::disk::{Budget, DataFile, Workspace, fs};
use crate::error::{Error, Result};
use crate::folder::npy::Header;
use crate::folder::{InputEntry, WarmSums};
use std::ops::Range;
use std::path::Path;

impl IndexKind {
    /// Bytes of one index.
    pub const fn bytes(self) -> u64 {
        match self {
            IndexKind::U4 | IndexKind::I4 => 4,
            IndexKind::U8 | IndexKind::I8 => 8,
        }
    }
}

impl CoordKind {
    /// Bytes of one coordinate.
    pub const fn bytes(self) -> u64 {
        match self {
            CoordKind::F4 => 4,
            CoordKind::F8 => 8,
        }
    }
}

/// V and G where they lie, held to their headers, their lengths and each other.
#[derive(Debug)]
pub struct Arrays {
    /// The indices.
    pub v: IndexArray,
    /// The coordinates.
    pub g: Option<CoordArray>,
}

/// Finds a mesh given as `.npy`: V from `request.path`, shape (T,3) or (3T,), of u4, u8, i4
/// or i8 in either byte order; G from `request.positions` when there is one, shape (N,3), of
/// f4 or f8. Both in C order, used where they lie.
///
/// Without G the number of vertices is `request.vertices`, or left open for the scan, which
/// takes the largest index plus one.
///
/// # Errors
/// [`Error::Input`] for another type, shape or order, saying how NumPy converts it;
/// [`Error::Usage`] for standard input; [`Error::Io`].
pub fn npy(ws: &Workspace, request: &Request) -> Result<Arrays> {
    let v = npy_indices(ws, &request.path)?;
    let g = match &request.positions {
        Some(path) => Some(npy_coords(ws, path)?),
        None => None,
    };
    check_count(request, g.as_ref())?;
    Ok(Arrays { v, g })
}

/// Finds a mesh given as arrays without any header: indices of type `request.raw_index` in
/// `request.path`, three to a triangle, and coordinates in `request.positions` when there is
/// one, three to a vertex, all in the byte order `request.endian`.
///
/// The type of the coordinates follows from `request.vertices` and the length of the file (12
/// or 24 bytes a vertex); when the number of vertices is not given, `request.coords` names
/// the type (f4 unless it says f8) and the length gives the number.
///
/// # Errors
/// [`Error::Input`] when a length does not fit, [`Error::Usage`] when the index type is not
/// given or the input is standard input; [`Error::Io`].
pub fn raw(ws: &Workspace, request: &Request) -> Result<Arrays> {
    let Some(kind) = request.raw_index else {
        return Err(Error::Usage(
            "a raw array does not say what it holds; name its type with --raw-index u4, u8, i4 \
             or i8"
                .into(),
        ));
    };
    let file = open_regular(ws, &request.path)?;
    let bytes = file.len()?;
    let row = 3 * kind.bytes();
    if !bytes.is_multiple_of(row) {
        return Err(Error::input(
            file.path(),
            format!("byte {}", bytes / row * row),
            format!(
                "whole triangles of {row} bytes (--raw-index {})",
                kind.name()
            ),
            format!("{} bytes at the end of {bytes}", bytes % row),
            "check --raw-index; a raw array has no header and nothing behind its data",
        ));
    }
    let v = IndexArray {
        source: Source::Named(file),
        at: 0,
        kind,
        endian: request.endian.unwrap_or_default(),
        triangles: bytes / row,
    };
    let g = match &request.positions {
        Some(path) => Some(raw_coords(ws, path, request)?),
        None => None,
    };
    check_count(request, g.as_ref())?;
    Ok(Arrays { v, g })
}

impl IndexKind {
    const fn name(self) -> &'static str {
        match self {
            IndexKind::U4 => "u4",
            IndexKind::U8 => "u8",
            IndexKind::I4 => "i4",
            IndexKind::I8 => "i8",
        }
    }
}

/// Holds G to the stated number of vertices.
fn check_count(request: &Request, g: Option<&CoordArray>) -> Result<()> {
    if let (Some(g), Some(stated)) = (g, request.vertices)
        && g.vertices != stated
    {
        return Err(Error::input(
            g.source.data().path(),
            "",
            format!("the coordinates of {stated} vertices (--vertices)"),
            format!("those of {}", g.vertices),
            "leave --vertices out, or give the file that belongs to this mesh",
        ));
    }
    Ok(())
}

/// Makes a mesh of them. The digests of the files come as the passes read them.
///
/// # Errors
/// [`Error::Budget`], [`Error::Io`].
pub fn finish(ws: &Workspace, request: &Request, arrays: Arrays, format: &str) -> Result<Mesh> {
    let Arrays { v, g } = arrays;
    let sums = sums_of(&ws.budget, &v, g.as_ref())?;
    Ok(Mesh {
        v,
        g,
        vertices: request.vertices,
        polygons_fanned: 0,
        welded: false,
        entry: InputEntry {
            format: format.to_owned(),
            files: Vec::new(),
        },
        sums,
    })
}

/// What the digests of arrays that are used in place are taken by.
pub(super) fn sums_of(
    budget: &Budget,
    v: &IndexArray,
    g: Option<&CoordArray>,
) -> Result<Vec<WarmSums>> {
    let rows = 3 * v.kind.bytes() * v.triangles;
    let mut sums = vec![sums(budget, v.source.data(), v.at..v.at + rows)?];
    if let Some(g) = g {
        let rows = 3 * g.kind.bytes() * g.vertices;
        sums.push(self::sums(budget, g.source.data(), g.at..g.at + rows)?);
    }
    Ok(sums)
}

/// The sums of a file of which no pass will read more than `rows`.
fn sums(budget: &Budget, file: &DataFile, rows: Range<u64>) -> Result<WarmSums> {
    let bytes = file.len()?;
    let sums = WarmSums::new(budget, bytes, true)?;
    sums.seen(file, 0, rows.start)?;
    sums.seen(file, rows.end, bytes.saturating_sub(rows.end))?;
    Ok(sums)
}

/// Opens a file that will be read in place: it must have a length and be readable anywhere.
fn open_regular(ws: &Workspace, path: &Path) -> Result<DataFile> {
    if path == Path::new("-") {
        return Err(Error::Usage(
            "arrays are used where they lie, which standard input cannot offer; give a file, or \
             pipe a PLY, STL, OBJ or OFF mesh instead"
                .into(),
        ));
    }
    // Asked before opening: opening a pipe waits for its writer.
    let meta = fs::metadata(path).map_err(|e| Error::io(path, "ask what kind of file it is", e))?;
    if !meta.is_file() {
        let found = if meta.is_dir() {
            "a folder"
        } else {
            "a pipe or device"
        };
        return Err(Error::input(
            path,
            "",
            "a regular file, since arrays are used where they lie",
            found,
            "write the array to a file first",
        ));
    }
    DataFile::open(path, &ws.io)
}

/// A header's type as byte order and NumPy's letter and size, when it is a plain number.
fn number_type(descr: &str) -> Option<(Endian, &str)> {
    let endian = match descr.as_bytes().first()? {
        b'<' => Endian::Little,
        b'>' => Endian::Big,
        _ => return None,
    };
    Some((endian, &descr[1..]))
}

fn npy_indices(ws: &Workspace, path: &Path) -> Result<IndexArray> {
    const EXPECTED: &str = "an index array (T,3) or (3T,) of u4, u8, i4 or i8";
    let file = open_regular(ws, path)?;
    let header = Header::read(&file)?;
    let bad = |help: String| mismatch(&file, &header, EXPECTED, help);
    let typed = number_type(&header.descr);
    let (endian, kind) = match typed {
        Some((endian, "u4")) => (endian, IndexKind::U4),
        Some((endian, "u8")) => (endian, IndexKind::U8),
        Some((endian, "i4")) => (endian, IndexKind::I4),
        Some((endian, "i8")) => (endian, IndexKind::I8),
        Some((_, "f2" | "f4" | "f8")) if header.shape.len() == 2 && header.shape[1] == 3 => {
            return Err(bad(format!(
                "these look like vertex coordinates (G): give the array of indices (V) as the \
                 mesh, and this one with --positions {}",
                path.display()
            )));
        }
        _ => {
            return Err(bad(
                "convert it in NumPy: np.save(\"V.npy\", V.astype(\"<u4\")), or \"<u8\" for more \
                 than 4 billion vertices"
                    .into(),
            ));
        }
    };
    let triangles = match header.shape[..] {
        [triangles, 3] => triangles,
        [corners] if corners.is_multiple_of(3) => corners / 3,
        [corners] => {
            return Err(bad(format!(
                "{corners} is no multiple of 3: this is cut short, or no list of triangles"
            )));
        }
        _ => {
            return Err(bad(
                "three indices make a triangle: convert it in NumPy with \
                 np.save(\"V.npy\", V.reshape(-1, 3)) if its order in memory is that; faces of \
                 more corners must be cut into triangles first"
                    .into(),
            ));
        }
    };
    refuse_fortran(&file, &header, EXPECTED, "V")?;
    note_excess(ws, &file, &header, 3 * triangles * kind.bytes())?;
    Ok(IndexArray {
        at: header.data_start,
        source: Source::Named(file),
        kind,
        endian,
        triangles,
    })
}

fn npy_coords(ws: &Workspace, path: &Path) -> Result<CoordArray> {
    const EXPECTED: &str = "a coordinate array (N,3) of f4 or f8";
    let file = open_regular(ws, path)?;
    let header = Header::read(&file)?;
    let bad = |help: &str| mismatch(&file, &header, EXPECTED, help.into());
    let (endian, kind) = match number_type(&header.descr) {
        Some((endian, "f4")) => (endian, CoordKind::F4),
        Some((endian, "f8")) => (endian, CoordKind::F8),
        _ => {
            return Err(bad(
                "convert it in NumPy: np.save(\"G.npy\", G.astype(\"<f4\")), or \"<f8\"",
            ));
        }
    };
    let [vertices, 3] = header.shape[..] else {
        return Err(bad(
            "three coordinates make a vertex: convert it in NumPy with \
             np.save(\"G.npy\", G.reshape(-1, 3)) if its order in memory is that, or keep three \
             columns of it",
        ));
    };
    refuse_fortran(&file, &header, EXPECTED, "G")?;
    note_excess(ws, &file, &header, 3 * vertices * kind.bytes())?;
    Ok(CoordArray {
        at: header.data_start,
        source: Source::Named(file),
        kind,
        endian,
        vertices,
        placed: false,
    })
}

fn raw_coords(ws: &Workspace, path: &Path, request: &Request) -> Result<CoordArray> {
    let file = open_regular(ws, path)?;
    let bytes = file.len()?;
    let asked = match (request.coords, request.vertices) {
        (Some(kind), _) => kind,
        (None, Some(_)) => CoordKind::F4,
        // A guess would read the one as twice as many of the other.
        (None, None) => {
            return Err(Error::Usage(format!(
                "{}: raw positions do not say what they are; give --coords f4 or f8, or --vertices N",
                path.display()
            )));
        }
    };
    let fits = |kind: CoordKind| match request.vertices {
        Some(n) => n.checked_mul(3 * kind.bytes()) == Some(bytes),
        None => bytes.is_multiple_of(3 * kind.bytes()),
    };
    let kind = match request.vertices {
        Some(n) if n > 0 => [CoordKind::F4, CoordKind::F8]
            .into_iter()
            .find(|&k| fits(k)),
        _ => Some(asked).filter(|&k| fits(k)),
    };
    let Some(kind) = kind else {
        let expected = match request.vertices {
            Some(n) => format!("12 bytes (f4) or 24 (f8) for each of {n} vertices"),
            None => format!("a multiple of {} bytes, a vertex each", 3 * asked.bytes()),
        };
        return Err(Error::input(
            file.path(),
            "",
            expected,
            format!("{bytes} bytes"),
            "check --vertices and --coords; a raw array has no header and nothing behind its data",
        ));
    };
    Ok(CoordArray {
        source: Source::Named(file),
        at: 0,
        kind,
        endian: request.endian.unwrap_or_default(),
        vertices: bytes / (3 * kind.bytes()),
        placed: false,
    })
}

fn mismatch(file: &DataFile, header: &Header, expected: &str, help: String) -> Error {
    let shape: Vec<String> = header.shape.iter().map(u64::to_string).collect();
    let order = if header.fortran {
        " in Fortran order"
    } else {
        ""
    };
    let found = format!(
        "type {} of shape ({}){order}",
        header.descr,
        shape.join(",")
    );
    Error::input(file.path(), "", expected, found, help)
}

/// Column-major rows do not lie together. With at most one row the two orders are the same.
fn refuse_fortran(file: &DataFile, header: &Header, expected: &str, name: &str) -> Result<()> {
    if header.fortran && header.shape.len() > 1 && header.shape[0] > 1 {
        return Err(mismatch(
            file,
            header,
            &format!("{expected} in C order"),
            format!("convert it in NumPy: np.save(\"{name}.npy\", np.ascontiguousarray({name}))"),
        ));
    }
    Ok(())
}

/// NumPy ignores what lies behind the data, so it is allowed, but said.
fn note_excess(ws: &Workspace, file: &DataFile, header: &Header, data: u64) -> Result<()> {
    let (have, end) = (file.len()?, header.data_start + data);
    if have > end {
        ws.progress.note(&format!(
            "{}: the {} bytes from byte {end} on lie behind the array and are not read",
            file.path().display(),
            have - end
        ));
    }
    Ok(())
}

#[cfg(test)]
#[path = "arrays_tests.rs"]
mod tests;
