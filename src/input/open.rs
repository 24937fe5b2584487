//! From the request to a mesh: which format it is, and what cannot go together.
//!
//! The format is what `--format` says; else `--raw-index` makes it raw; else the first bytes
//! of `.npy` and PLY, which nothing else begins with; else the extension of the name; else the
//! first bytes once more (OFF, OBJ, STL), which is all there is for standard input.
//!
//! Memory: the reader's buffer. I/O: the first 4 KiB.

use super::arrays::{self, Arrays};
use super::reader::{ByteReader, PEEK};
use super::reading::Reading;
use super::{Format, Mesh, Request, obj, off, ply, stl};
use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::is_mesh_folder;
use std::path::Path;

/// What is read, for messages.
const SUPPORTED: &str = "a mesh as PLY, STL, OBJ, OFF, .npy, or as raw arrays (with --raw-index)";

/// Opens or decodes the mesh that the request names, and welds it where that is asked for.
///
/// # Errors
/// As [`read`], and the passes of the weld.
pub fn open(ws: &Workspace, request: &Request) -> Result<Mesh> {
    read(ws, request)?.finish(ws, request)
}

/// Opens or reads the mesh that the request names; what is left of it is the weld.
///
/// Arrays (`.npy`, raw) are used where they lie; all else is read once, from its first byte to
/// its last. Indices of arrays are not checked against the number of vertices: the scan does that.
///
/// # Errors
/// [`Error::Usage`] for options that do not go together, [`Error::Input`] for an input that is
/// no mesh or a damaged one, [`Error::Io`], [`Error::Budget`], [`Error::DiskLimit`].
pub fn read(ws: &Workspace, request: &Request) -> Result<Reading> {
    let (format, reader) = find(ws, request)?;
    if let Some(reader) = reader {
        return decode(ws, reader, request, format);
    }
    let arrays = find_arrays(ws, request, format)?;
    let mut mesh = arrays::finish(ws, request, arrays, format.name())?;
    if request.weld != Some(true) {
        return Ok(Reading::Done(mesh));
    }
    // The weld reads the files in an order of its own, and replaces them.
    mesh.entry = mesh.input_entry(ws)?;
    mesh.sums.clear();
    Ok(Reading::Unwelded(mesh))
}

/// Finds the format, and refuses options that do not go with it. With a format to be decoded
/// comes its reader, at the first byte; arrays are used where they lie and have none.
///
/// # Errors
/// [`Error::Usage`], [`Error::Input`] for what is no mesh, [`Error::Io`], [`Error::Budget`].
pub(super) fn find(ws: &Workspace, request: &Request) -> Result<(Format, Option<ByteReader>)> {
    let stdin = request.path == Path::new("-");
    let named = named_format(request)?;
    let (format, reader) = match named {
        Some(format @ (Format::Npy | Format::Raw)) => (format, None),
        _ => {
            let mut reader = if stdin {
                ByteReader::from_stdin(ws)?
            } else {
                refuse_folder(&request.path)?;
                ByteReader::open(ws, &request.path)?
            };
            let first = reader.peek(PEEK)?.to_vec();
            if first.is_empty() {
                let help = "nothing was written to it";
                return Err(bad(&reader, SUPPORTED, "an empty file", help));
            }
            let format = match named {
                Some(format) => format,
                None => guessed_format(&reader, &first)?,
            };
            (format, Some(reader))
        }
    };
    check_options(request, format)?;
    if !matches!(format, Format::Npy | Format::Raw) {
        return Ok((format, reader));
    }
    if stdin {
        return Err(Error::Usage(
            "arrays (.npy, raw) cannot come from standard input: they are used where they lie, \
             and read more than once; give the name of a file"
                .into(),
        ));
    }
    Ok((format, None))
}

/// A folder is no mesh file, and least of all one that was built already.
fn refuse_folder(path: &Path) -> Result<()> {
    if !path.is_dir() {
        return Ok(());
    }
    let (found, help) = if is_mesh_folder(path) {
        let help = "it is built already: `cornermill info` says what it holds, `verify` checks it, \
                    `export` writes it as a mesh file";
        ("a mesh folder", help)
    } else {
        ("a folder (directory)", "give the name of a file in it")
    };
    Err(Error::input(path, "", SUPPORTED, found, help))
}

/// Decodes a streamable format.
fn decode(
    ws: &Workspace,
    mut reader: ByteReader,
    request: &Request,
    format: Format,
) -> Result<Reading> {
    let welding = welds(request, format);
    let mut request = request.clone();
    request.weld = welding.then_some(true);
    begin(&mut reader, format)?;
    let mesh = match format {
        Format::Ply => ply::read(ws, reader, &request)?,
        Format::Obj => obj::read(ws, reader, &request)?,
        Format::Off => off::read(ws, reader, &request)?,
        _ => return stl::read(ws, reader, &request),
    };
    Ok(match welding {
        true => Reading::Unwelded(mesh),
        false => Reading::Done(mesh),
    })
}

/// True when vertices of equal position become one.
pub(super) fn welds(request: &Request, format: Format) -> bool {
    request.weld == Some(true) || format == Format::Stl
}

/// Goes past the mark that some editors write before a text, and refuses UTF-16.
///
/// # Errors
/// [`Error::Input`], [`Error::Io`].
pub(super) fn begin(reader: &mut ByteReader, format: Format) -> Result<()> {
    if format == Format::Stl {
        return Ok(());
    }
    let first = reader.peek(3)?;
    if first.starts_with(b"\xfe\xff") || first.starts_with(b"\xff\xfe") {
        let help = "save it as UTF-8 or plain ASCII";
        return Err(bad(reader, "text of one byte a character", "UTF-16", help));
    }
    if first == b"\xef\xbb\xbf" {
        reader.consume(3);
    }
    Ok(())
}

/// Opens arrays and holds them to their headers and lengths; their rows are not read.
///
/// # Errors
/// [`Error::Usage`] for a weld without coordinates; as [`arrays::npy`] and [`arrays::raw`].
pub(super) fn find_arrays(ws: &Workspace, request: &Request, format: Format) -> Result<Arrays> {
    let arrays = match format {
        Format::Npy => arrays::npy(ws, request)?,
        _ => arrays::raw(ws, request)?,
    };
    if request.weld == Some(true) && arrays.g.is_none() {
        return Err(Error::Usage(
            "--weld joins vertices of equal position, but this mesh has no coordinates; \
             give them with --positions"
                .into(),
        ));
    }
    if request.coords.is_some() && arrays.g.is_none() {
        return Err(Error::Usage(
            "--coords is the type of stored coordinates, but this mesh has none; give them with \
             --positions, or leave it away"
                .into(),
        ));
    }
    Ok(arrays)
}

/// The format that the options settle.
fn named_format(request: &Request) -> Result<Option<Format>> {
    match (request.format, request.raw_index) {
        (Some(Format::Raw), None) => Err(Error::Usage(
            "raw arrays need --raw-index: the type of their indices".into(),
        )),
        (Some(Format::Raw) | None, Some(_)) => Ok(Some(Format::Raw)),
        (Some(_), Some(_)) => Err(Error::Usage(
            "--raw-index is for raw arrays; leave it away, or leave --format away".into(),
        )),
        (format, None) => Ok(format),
    }
}

/// Refuses options that the format has no use for.
fn check_options(request: &Request, format: Format) -> Result<()> {
    let arrays = matches!(format, Format::Npy | Format::Raw);
    let refuse = |text: &str| Err(Error::Usage(text.into()));
    if !arrays && request.positions.is_some() {
        return refuse("--positions is for .npy and raw arrays; this format has its own");
    }
    if !arrays && request.vertices.is_some() {
        return refuse("--vertices is for .npy and raw arrays; this format has its own");
    }
    if format != Format::Raw && request.endian.is_some() {
        return refuse(
            "--endian is for raw arrays (--raw-index): every other format says itself what its byte \
             order is; leave it away",
        );
    }
    if format == Format::Stl && request.weld == Some(false) {
        return refuse(
            "--no-weld cannot be: STL gives each triangle three points of its own, so without \
             welding equal points no two triangles would share an edge",
        );
    }
    Ok(())
}

/// The format by the first bytes and the name.
fn guessed_format(reader: &ByteReader, first: &[u8]) -> Result<Format> {
    if first.starts_with(b"\x93NUMPY") {
        return Ok(Format::Npy);
    }
    let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first);
    let line_end = |b: Option<&u8>| b.is_none_or(u8::is_ascii_whitespace);
    let trimmed = text.trim_ascii_start();
    if trimmed.starts_with(b"ply") && line_end(trimmed.get(3)) {
        return Ok(Format::Ply);
    }
    let extension = reader.path().extension().and_then(|e| e.to_str());
    match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("ply") => return Ok(Format::Ply),
        Some("stl") => return Ok(Format::Stl),
        Some("obj") => return Ok(Format::Obj),
        Some("off") => return Ok(Format::Off),
        Some("npy") => return Ok(Format::Npy),
        _ => {}
    }
    let word = first_word(text);
    if off::keyword(word).is_some() {
        return Ok(Format::Off);
    }
    let count = first
        .get(80..84)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let binary_stl = count.map(|n| 84 + 50 * u64::from(n));
    if word == b"solid" || (binary_stl.is_some() && binary_stl == reader.length()) {
        return Ok(Format::Stl);
    }
    if obj::KEYWORDS.contains(&word) {
        return Ok(Format::Obj);
    }
    let start: String = String::from_utf8_lossy(&first[..first.len().min(16)])
        .chars()
        .flat_map(char::escape_default)
        .collect();
    let help = "if it is one of these, say which: --format ply, stl, obj, off or npy, or \
                --raw-index for a raw array; convert other formats first";
    let found = format!("a file that begins with `{start}`");
    Err(bad(reader, SUPPORTED, found, help))
}

/// The first word that is in no comment.
fn first_word(text: &[u8]) -> &[u8] {
    text.split(|&b| b == b'\n' || b == b'\r')
        .map(<[u8]>::trim_ascii)
        .find(|line| !line.is_empty() && line[0] != b'#')
        .and_then(|line| line.split(u8::is_ascii_whitespace).next())
        .unwrap_or_default()
}

fn bad(reader: &ByteReader, expected: &str, found: impl Into<String>, help: &str) -> Error {
    Error::input(reader.path(), "", expected, found, help)
}

#[cfg(test)]
#[path = "open_tests.rs"]
mod tests;
