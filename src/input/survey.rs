//! What an input will be, from its beginning and its length: for `--dry-run`.
//!
//! Why it may be trusted: formats are told apart and headers read by the very code that a
//! build uses, so what a build refuses at the first glance is refused here with the same
//! words. Where no header states a count, the lines of a text are sampled
//! ([`sample`](super::sample)); [`Survey::exact`] says which it was.
//!
//! Memory: buffers of 1 MiB. I/O: the header; of a text 1 MiB. Nothing is written.

use super::arrays::Arrays;
use super::lines::{Column, Form, Lines, Rows};
use super::open::{begin, find, find_arrays, welds};
use super::reader::ByteReader;
use super::{CoordKind, Format, Request, off, ply, stl};
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace, fs};
use crate::error::{Error, Result};
use crate::folder::fits_u4;
use std::path::Path;
use std::sync::Arc;

/// What is known of an input that was not read yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Survey {
    /// Its format.
    pub format: Format,
    /// T.
    pub triangles: u64,
    /// N, before a weld; `None` for indices alone, when nobody said it.
    pub vertices: Option<u64>,
    /// Type of the coordinates in the new folder; `None` without coordinates.
    pub coords: Option<CoordKind>,
    /// True when the counts are certain, false when they are estimates.
    pub exact: bool,
    /// Triangles and vertices that the mesh has at least, or is no mesh.
    pub least: [u64; 2],
    /// Bytes of the input's files.
    pub input_bytes: u64,
    /// True when V is decoded to a scratch file, false when it is used where it lies.
    pub decoded: bool,
    /// True when vertices of equal position become one.
    pub welded: bool,
    /// Bytes of a triangle in the array that the passes read.
    pub v_row: u64,
    /// Bytes of a triangle and of a vertex (0 without coordinates) in the input's arrays, or in
    /// the files that it is decoded to; `None` when corners go straight to the weld (STL).
    pub rows: Option<[u64; 2]>,
}

/// What a streamable format states or shows of its counts.
pub(super) struct Counted {
    pub triangles: u64,
    pub vertices: u64,
    pub coords: CoordKind,
    pub exact: bool,
    pub least: [u64; 2],
}

/// Surveys the input that the request names.
///
/// # Errors
/// [`Error::Usage`] for standard input and pipes, which cannot be looked at twice, and for
/// options that do not go together; [`Error::Input`] for what is no mesh or claims more than
/// it holds; [`Error::Io`].
pub fn survey(request: &Request) -> Result<Survey> {
    refuse_streams(&request.path)?;
    let ws = workspace()?;
    match find(&ws, request)? {
        (format, None) => {
            let arrays = find_arrays(&ws, request, format)?;
            survey_arrays(request, format, &arrays)
        }
        (format, Some(mut reader)) => {
            begin(&mut reader, format)?;
            survey_stream(request, format, reader)
        }
    }
}

/// Enough for a reader with a whole buffer. Its scratch space is never asked for a file.
pub(super) fn workspace() -> Result<Workspace> {
    let io = Arc::new(Counters::default());
    Ok(Workspace {
        budget: Budget::new(16 << 20),
        scratch: Scratch::new(&["".into()], 0, &io)?,
        io,
        workers: Workers::new(1)?,
        progress: Arc::new(NoProgress),
    })
}

fn refuse_streams(path: &Path) -> Result<()> {
    let stdin = path == Path::new("-");
    let pipe = || {
        let meta = fs::metadata(path);
        meta.map(|m| !m.is_file() && !m.is_dir())
            .map_err(|e| Error::io(path, "ask what kind of file it is", e))
    };
    if stdin || pipe()? {
        return Err(Error::Usage(
            "a dry run looks at the beginning of a file and leaves it as it is, which standard \
             input and pipes do not allow; give the name of a file"
                .into(),
        ));
    }
    Ok(())
}

fn survey_arrays(request: &Request, format: Format, arrays: &Arrays) -> Result<Survey> {
    let Arrays { v, g } = arrays;
    let mut input_bytes = v.source.data().len()?;
    if let Some(g) = g {
        input_bytes += g.source.data().len()?;
    }
    let welded = welds(request, format);
    let vertices = g.as_ref().map(|g| g.vertices).or(request.vertices);
    Ok(Survey {
        format,
        triangles: v.triangles,
        vertices,
        coords: g.as_ref().map(|g| request.coords.unwrap_or(g.kind)),
        exact: !welded,
        least: at_least([v.triangles, vertices.unwrap_or(0)], welded),
        input_bytes,
        decoded: welded,
        welded,
        v_row: if welded {
            decoded_row(request, v.triangles)
        } else {
            3 * v.kind.bytes()
        },
        rows: Some([
            3 * v.kind.bytes(),
            g.as_ref().map_or(0, |g| 3 * g.kind.bytes()),
        ]),
    })
}

fn survey_stream(request: &Request, format: Format, reader: ByteReader) -> Result<Survey> {
    let length = reader.length().unwrap_or(0);
    let counted = match format {
        Format::Ply => ply::count(reader, length)?,
        Format::Off => count_off(reader, length)?,
        Format::Obj => count_obj(&reader)?,
        _ => count_stl(reader)?,
    };
    let welded = welds(request, format);
    let coords = request.coords.unwrap_or(counted.coords);
    let v_row = decoded_row(request, counted.triangles);
    Ok(Survey {
        format,
        triangles: counted.triangles,
        vertices: Some(counted.vertices),
        coords: Some(coords),
        exact: counted.exact && !welded,
        least: at_least(counted.least, welded),
        input_bytes: length,
        decoded: true,
        welded,
        v_row,
        rows: (format != Format::Stl).then_some([v_row, 3 * coords.bytes()]),
    })
}

/// What a weld leaves for certain of so many triangles and vertices: of the latter one, perhaps.
fn at_least([triangles, vertices]: [u64; 2], welded: bool) -> [u64; 2] {
    let most = if welded { 1 } else { u64::MAX };
    [triangles, vertices.min(most)]
}

/// Bytes of a triangle in the scratch file of indices.
fn decoded_row(request: &Request, triangles: u64) -> u64 {
    let wide = request.wide || !fits_u4(triangles, 0);
    if wide { 24 } else { 12 }
}

/// Refuses a header whose counts need `least` bytes of data where there are `have`.
pub(super) fn refuse_beyond(path: &Path, least: u64, have: u64) -> Result<()> {
    if least <= have {
        return Ok(());
    }
    Err(Error::input(
        path,
        "",
        format!("at least {least} bytes of data, since the header's counts need them"),
        format!("{have} bytes"),
        "the file is cut short, or its counts are wrong; write or copy it again",
    ))
}

fn count_off(reader: ByteReader, length: u64) -> Result<Counted> {
    let path = reader.path().to_owned();
    let ([vertices, faces], from) = off::stated(reader)?;
    // The shortest rows, `0 0 0` and `3 0 0 0`, with the ends of their lines.
    let rows = vertices.saturating_mul(6);
    refuse_beyond(&path, rows.saturating_add(faces.saturating_mul(8)), length)?;
    let lines = Lines::map(&path, off_form([vertices, faces]), from)?;
    Ok(Counted {
        triangles: lines.triangles(),
        vertices,
        coords: CoordKind::F4,
        exact: false,
        least: [faces, vertices],
    })
}

/// Behind the corners of a face may stand its colour.
fn off_form([vertices, faces]: [u64; 2]) -> Form {
    Form::Rows(Rows {
        columns: vec![Column::Face(0, 0)],
        exactly: false,
        beside: [vertices > 0, false],
        number: faces,
    })
}

/// The triangles of an OFF file.
///
/// # Errors
/// As [`off::stated`].
pub(super) fn off_lines(reader: ByteReader) -> Result<Lines> {
    let path = reader.path().to_owned();
    let (counts, from) = off::stated(reader)?;
    Lines::map(&path, off_form(counts), from)
}

/// The triangles of an OBJ file.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn obj_lines(reader: &ByteReader) -> Result<Lines> {
    Lines::map(reader.path(), Form::Statements, 0)
}

/// The triangles of an STL file in text.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn stl_lines(reader: &ByteReader) -> Result<Lines> {
    Lines::map(reader.path(), Form::Facets, 0)
}

fn count_obj(reader: &ByteReader) -> Result<Counted> {
    let lines = obj_lines(reader)?;
    Ok(Counted {
        triangles: lines.triangles(),
        vertices: lines.vertices,
        coords: CoordKind::F4,
        exact: false,
        least: [0, 0],
    })
}

fn count_stl(mut reader: ByteReader) -> Result<Counted> {
    let stated = stl::stated(&mut reader)?;
    let triangles = match stated {
        Some(facets) => facets,
        None => stl_lines(&reader)?.triangles(),
    };
    Ok(Counted {
        triangles,
        vertices: closed_vertices(triangles),
        coords: CoordKind::F4,
        exact: false,
        least: [stated.unwrap_or(0), 0],
    })
}

/// Vertices of a closed surface of that many triangles, which is what most meshes are about.
pub fn closed_vertices(triangles: u64) -> u64 {
    match triangles {
        0 => 0,
        t => (t / 2 + 2).min(t.saturating_mul(3)),
    }
}

#[cfg(test)]
#[path = "survey_tests.rs"]
mod tests;
