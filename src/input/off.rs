//! OFF, the Object File Format of Geomview, in text.
//!
//! A line "OFF" (`ST`, `C`, `N` before it: texture coordinates, colour, normal for each vertex,
//! which are passed over), then the numbers of vertices, faces and edges, then a line for each
//! vertex and for each face. Behind the corners of a face may stand its colour; comments and
//! empty lines may stand anywhere. The numbers may follow on the line of the word, and the
//! number of edges, which means nothing, may be missing. Vertices of another dimension (`4`,
//! `n`) and the binary form are refused.
//!
//! Why a row may not leave its line: a value too many or too few is noticed where it stands.
//! Behind the last face nothing may follow, as that would be faces lost.
//!
//! Memory: the reader's and the sink's buffers; counts only say when to stop. I/O: the input
//! once; V and G once.
//! Source: the Geomview manual, section "OFF Files".

use super::reader::ByteReader;
use super::sink::MeshSink;
use super::text::{Dialect, Lexer, shown};
use super::{CoordKind, Mesh, Request};
use crate::disk::Workspace;
use crate::error::Result;

/// What the first word of a file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keyword {
    /// Vertices of three coordinates; true when more is on their lines.
    Plain(bool),
    /// Vertices of another dimension.
    Dimension,
}

/// Reads the first word: `[ST][C][N][4][n]OFF`.
pub fn keyword(word: &[u8]) -> Option<Keyword> {
    let mut prefix = word.strip_suffix(b"OFF")?;
    let mut more = false;
    for part in [&b"ST"[..], b"C", b"N"] {
        if let Some(rest) = prefix.strip_prefix(part) {
            prefix = rest;
            more = true;
        }
    }
    match prefix {
        b"" => Some(Keyword::Plain(more)),
        b"4" | b"n" | b"4n" => Some(Keyword::Dimension),
        _ => None,
    }
}

/// Decodes an OFF file.
///
/// # Errors
/// [`crate::Error::Input`] naming the line, [`crate::Error::Io`], [`crate::Error::Budget`],
/// [`crate::Error::DiskLimit`].
pub fn read(ws: &Workspace, reader: ByteReader, request: &Request) -> Result<Mesh> {
    let path = reader.path().to_owned();
    let (mut lexer, more, [vertices, faces]) = header(reader)?;
    let mut sink = MeshSink::new(ws, request, &path, CoordKind::F4)?;
    for row in 0..vertices {
        let name = || format!("vertex {row} of {vertices}");
        seek(&mut lexer, name)?;
        vertex(&mut lexer, &mut sink)?;
        if more {
            lexer.next_line()?;
        } else {
            end_of_row(&mut lexer, name)?;
        }
    }
    for row in 0..faces {
        seek(&mut lexer, || format!("face {row} of {faces}"))?;
        face(&mut lexer, &mut sink)?;
        lexer.next_line()?;
    }
    if lexer.seek_word()? {
        let found = shown(lexer.word()?.unwrap_or_default());
        let help = "the counts do not agree with the data; correct them, or cut the rest off";
        return Err(lexer.error("the end of the file", found, help));
    }
    sink.finish(ws, "off", lexer.into_reader().finish()?)
}

/// The numbers of vertices and faces that the file states, and the byte where its rows begin.
///
/// # Errors
/// As [`read`].
pub fn stated(reader: ByteReader) -> Result<([u64; 2], u64)> {
    let (lexer, _, counts) = header(reader)?;
    Ok((counts, lexer.into_reader().offset()))
}

/// Reads up to the first row; true when vertices have more than three values.
fn header(reader: ByteReader) -> Result<(Lexer, bool, [u64; 2])> {
    let mut lexer = Lexer::new(reader, Dialect::Comments, 1);
    let more = first_line(&mut lexer)?;
    let counts = counts(&mut lexer)?;
    Ok((lexer, more, counts))
}

/// Goes to the next row.
fn seek(lexer: &mut Lexer, what: impl FnOnce() -> String) -> Result<()> {
    if lexer.seek_word()? {
        return Ok(());
    }
    let help = "the file is cut short; write or copy it again";
    Err(lexer.error(what(), "the end of the input", help))
}

/// The word OFF; true when vertices have more than three values.
fn first_line(lexer: &mut Lexer) -> Result<bool> {
    seek(lexer, || "the word `OFF`".into())?;
    let word = lexer.word()?.unwrap_or_default();
    let found = shown(word);
    match keyword(word) {
        Some(Keyword::Plain(more)) => Ok(more),
        Some(Keyword::Dimension) => {
            let help = "project it to three dimensions first";
            Err(lexer.error("vertices of three coordinates", found, help))
        }
        None => {
            let help = "the file is no OFF, or it is damaged";
            Err(lexer.error("the word `OFF`, `COFF`, `NOFF` or `STOFF`", found, help))
        }
    }
}

/// The numbers of vertices and faces.
fn counts(lexer: &mut Lexer) -> Result<[u64; 2]> {
    seek(lexer, || "the number of vertices".into())?;
    if lexer.peek_word(b"BINARY")? {
        let help = "convert it to text, or to PLY";
        return Err(lexer.error("an OFF in text", "the binary form", help));
    }
    let vertices = lexer.count("the number of vertices")?;
    let faces = lexer.count("the number of faces")?;
    if !lexer.line_ended()? {
        lexer.count("the number of edges")?;
    }
    end_of_row(lexer, || "the counts".into())?;
    Ok([vertices, faces])
}

fn end_of_row(lexer: &mut Lexer, what: impl FnOnce() -> String) -> Result<()> {
    if lexer.line_ended()? {
        return Ok(());
    }
    let found = shown(lexer.word()?.unwrap_or_default());
    let expected = format!("the end of the line after {}", what());
    let help = "correct the line or the counts; vertices with colours or normals need COFF or NOFF";
    Err(lexer.error(expected, found, help))
}

fn vertex(lexer: &mut Lexer, sink: &mut MeshSink) -> Result<()> {
    let what = "a coordinate of the vertex";
    match sink.kind() {
        CoordKind::F4 => {
            let at = [lexer.f4(what)?, lexer.f4(what)?, lexer.f4(what)?];
            sink.rounded4(at)
        }
        CoordKind::F8 => {
            let at = [lexer.f8(what)?, lexer.f8(what)?, lexer.f8(what)?];
            sink.vertex8(at)
        }
    }
}

fn face(lexer: &mut Lexer, sink: &mut MeshSink) -> Result<()> {
    let line = lexer.line();
    let corners = lexer.count("the number of corners")?;
    sink.begin_face();
    for _ in 0..corners {
        let v = lexer.count("an index of a vertex")?;
        sink.corner(v)?;
    }
    sink.end_face(|| format!("line {line}"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::{self, Decoded, decode, refused};

    fn good(text: &str) -> Decoded {
        let whole = decode(read, text.as_bytes(), usize::MAX, None).unwrap();
        assert_eq!(decode(read, text.as_bytes(), 1, None).unwrap(), whole);
        whole
    }

    const PYRAMID: &str = "OFF\n5 5 8\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 -1\n\
                           4 0 1 2 3\n3 1 0 4\n3 2 1 4\n3 3 2 4\n3 0 3 4\n";

    #[test]
    fn the_same_pyramid_in_every_spelling() {
        let whole = good(PYRAMID);
        assert_eq!(whole.triangles.len(), 6);
        assert_eq!(whole.triangles[..3], [[0, 1, 2], [0, 2, 3], [1, 0, 4]]);
        assert_eq!((whole.fanned, whole.kind), (1, CoordKind::F4));
        assert_eq!(whole.bits[12], u64::from(0.5f32.to_bits()));
        for (from, to) in [
            ("OFF\n5 5 8", "OFF 5 5 8"),
            ("OFF\n5 5 8", "OFF\n\n# c\n 5 5"),
            ("OFF", "# c\n\nOFF # c"),
            ("3 1 0 4\n", "3 1 0 4 0.5 0.5 0.5 1\n\n"),
            ("3 1 0 4\n", "3 1 0 4 # red\n"),
            ("3 0 3 4\n", "3 0 3 4"),
            ("\n", "\r\n"),
            ("\n", "\r"),
            ("\n", "\n#\n"),
        ] {
            assert_eq!(good(&PYRAMID.replace(from, to)), whole, "{to:?}");
        }
        for (word, row) in [
            ("COFF", " 0 0 0 1"),
            ("NOFF", " 0 0 1"),
            ("STOFF", " 0 1"),
            ("STCNOFF", " x"),
        ] {
            let text = PYRAMID
                .replace("OFF", word)
                .replace(" 0\n", &format!(" 0{row}\n"));
            assert_eq!(good(&text), whole);
        }
        let wide = decode(read, PYRAMID.as_bytes(), 3, Some(CoordKind::F8)).unwrap();
        assert_eq!(wide.bits[12], 0.5f64.to_bits());
        assert!(good("OFF\n0 0 0\n").triangles.is_empty());
    }

    #[test]
    fn what_cannot_be() {
        for (from, to, parts) in [
            (
                "OFF",
                "4OFF",
                &["line 1", "three coordinates", "`4OFF`"][..],
            ),
            ("OFF", "nOFF", &["line 1", "three coordinates"]),
            ("OFF", "OFFX", &["line 1", "the word `OFF`", "`OFFX`"]),
            ("OFF\n", "", &["line 1", "the word `OFF`", "`5`"]),
            ("OFF", "OFF BINARY", &["line 1", "the binary form"]),
            ("5 5 8", "5 -5 8", &["line 2", "not negative"]),
            (
                "5 5 8",
                "5 5 8 1",
                &["line 2", "the end of the line", "`1`"],
            ),
            (
                "5 5 8",
                "5",
                &["line 2", "the number of faces", "the end of the line"],
            ),
            (
                "5 5 8",
                "353535235358 5 8",
                &["line 8", "vertex 5 of 353535235358", "`2`"],
            ),
            ("5 5 8", "5 6 8", &["face 5 of 6", "the end of the input"]),
            ("5 5 8", "5 4 8", &["line 12", "the end of the file", "`3`"]),
            ("1 1 0\n", "1 1 0 255 0 0\n", &["line 5", "`255`", "COFF"]),
            (
                "1 1 0\n",
                "1 1\n",
                &["line 5", "a coordinate", "the end of the line"],
            ),
            ("3 1 0 4", "2 1 0", &["line 9", "at least 3", "2 corners"]),
            (
                "3 1 0 4",
                "3 1 0",
                &["line 9", "an index", "the end of the line"],
            ),
            ("3 1 0 4", "3 1 -1 4", &["line 9", "not negative", "`-1`"]),
            ("3 1 0 4", "3 1 0.0 4", &["line 9", "`0.0`"]),
        ] {
            assert!(PYRAMID.contains(from));
            refused(read, PYRAMID.replacen(from, to, 1).as_bytes(), parts);
        }
        refused(
            read,
            b"OFF\n3 4\n0 0 0\n1 0 0\n0 1 0\n0\n",
            &["line 6", "0 corners"],
        );
        refused(
            read,
            b"\n# nothing\n",
            &["the word `OFF`", "the end of the input"],
        );
    }

    #[test]
    fn claims_of_billions_end_with_the_file() {
        let text = "OFF\n353535235358 6 0\n-0.5 -0.5 0.5\n";
        refused(
            read,
            text.as_bytes(),
            &["vertex 1 of 353535235358", "cut short"],
        );
        let text = "OFF\n0 18446744073709551615 0\n";
        refused(read, text.as_bytes(), &["the number of faces"]);
        let text = "OFF\n0 1 0\n9000000000000 1 2 3\n";
        refused(
            read,
            text.as_bytes(),
            &["line 3", "an index", "the end of the line"],
        );
    }

    #[test]
    fn truncation_at_every_byte() {
        testing::truncated(read, PYRAMID.as_bytes(), PYRAMID.len() - 1);
    }
}
