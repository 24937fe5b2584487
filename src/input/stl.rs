//! STL, binary and text: triangles without ids, welded as they stream past.
//!
//! Binary: 80 bytes of anything, a u4 count, and for each facet 50 bytes: normal and three
//! corners as twelve f4, and two attribute bytes, all little-endian. Text: `solid NAME`, then
//! `facet normal X Y Z outer loop vertex X Y Z` (three times) `endloop endfacet` for each
//! facet, then `endsolid NAME`, and any number of further solids; words in any letter case,
//! separated by blanks or line ends of any kind. Normals and attributes are not read: the
//! order of the corners says the same, and is kept.
//!
//! Why the two can be told apart: a text begins with `solid`, but so do many binary files. A
//! file is text when it does and either goes on with `facet` or `endsolid` in its second line
//! or has no control bytes at its start (a binary count below 2^24 has one, as has nearly
//! every facet). Only a length that agrees with the binary count, with control bytes, speaks
//! against that.
//!
//! Coordinates are f4: in a text the nearest to the digits, in a binary file the bits as they
//! are; `--coords f8` widens them exactly. No facet is dropped; a solid may be empty.
//!
//! Memory: the reader's buffer and the weld's. I/O: the input once, and the weld's; corners
//! go straight into the weld, so no file of triangles is written in between.
//! Source: 3D Systems, "StereoLithography Interface Specification", 1989.

use super::reader::{ByteReader, PEEK};
use super::reading::{Read, Reading};
use super::text::{BadNumber, Dialect, Lexer, parse_f4, shown};
use super::weld::{Bits, Expected, Soup, Welding, soup};
use super::{CoordKind, Request};
use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::{InputDigest, InputEntry};

/// Bytes before the first facet of a binary file.
pub(super) const HEAD: u64 = 84;
/// Bytes of a facet of a binary file.
pub(super) const FACET: usize = 50;
/// Bytes of a facet of a text, about: for planning only.
const TEXT_FACET: u64 = 200;
/// Bytes of a facet of a text, at least: its words and nine digits, each with a blank.
const LEAST_TEXT_FACET: u64 = 73;
/// Facets that are planned for when nothing is known.
const UNKNOWN: u64 = 1 << 24;

/// Reads an STL mesh, to be welded: vertices at equal positions are one, in order of first use.
///
/// # Errors
/// [`Error::Usage`] for `--no-weld`; [`Error::Input`] naming line or byte for what is no STL,
/// is cut short, or has a count that disagrees with its length; as [`super::weld::begin`].
pub fn read(ws: &Workspace, mut reader: ByteReader, request: &Request) -> Result<Reading> {
    if request.weld == Some(false) {
        return Err(Error::Usage(
            "--no-weld cannot be: STL gives each triangle three points of its own, so without \
             welding equal points no two triangles would share an edge"
                .into(),
        ));
    }
    let (form, facets) = look(&mut reader)?;
    if form == Form::Binary && reader.regular() {
        let kind = request.coords.unwrap_or(CoordKind::F4);
        return Ok(Reading::Facets(Facets::new(ws, reader, kind, facets)?));
    }
    match request.coords {
        Some(CoordKind::F8) => read_as::<u64>(ws, reader, form, facets),
        _ => read_as::<u32>(ws, reader, form, facets),
    }
}

/// The number of facets of a binary file; `None` for a text, which does not state it.
///
/// # Errors
/// As [`read`], for what the first bytes and the length show.
pub fn stated(reader: &mut ByteReader) -> Result<Option<u64>> {
    let (form, facets) = look(reader)?;
    Ok((form == Form::Binary).then_some(facets))
}

fn read_as<B: Bits>(
    ws: &Workspace,
    reader: ByteReader,
    form: Form,
    facets: u64,
) -> Result<Reading> {
    let (digest, weld) = match form {
        Form::Binary => soup::<B, _>(ws, exactly(facets), |soup| binary(reader, facets, soup))?,
        Form::Text => soup::<B, _>(ws, about(&reader, facets), |soup| text(reader, soup))?,
    };
    Ok(welding(digest, weld))
}

/// All corners were read.
pub(super) fn welding(digest: InputDigest, weld: Welding) -> Reading {
    let entry = InputEntry {
        format: "stl".into(),
        files: vec![digest],
    };
    let read = Read {
        entry,
        polygons_fanned: 0,
        vertices: None,
    };
    Reading::Welding(weld, read)
}

fn exactly(facets: u64) -> Expected {
    Expected {
        triangles: facets,
        most: Some(facets),
    }
}

/// A text says nothing of its facets, but each takes some bytes.
fn about(reader: &ByteReader, facets: u64) -> Expected {
    Expected {
        triangles: facets,
        most: reader.length().map(|n| n / LEAST_TEXT_FACET),
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Binary,
    Text,
}

/// Decides which form it is, and about how many facets there are (exactly, for binary).
fn look(reader: &mut ByteReader) -> Result<(Form, u64)> {
    let length = reader.length();
    let head = reader.peek(PEEK)?.to_vec();
    let count = head.get(80..84).map_or(0, |b| {
        u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    });
    let bytes = HEAD + count * FACET as u64;
    let agrees = head.len() as u64 >= HEAD && length == Some(bytes);
    let control = head.iter().any(|b| matches!(b, 0..=8 | 14..=31));
    if let Some(rest) = after_solid(&head) {
        if !control || has_facets(rest) && !agrees {
            return Ok((Form::Text, length.map_or(UNKNOWN, |n| n / TEXT_FACET)));
        }
    } else if !agrees && !control && !head.is_empty() {
        return Err(no_stl(reader, &head));
    }
    if (head.len() as u64) < HEAD {
        return Err(reader.cut_short("the 84 bytes that binary STL begins with"));
    }
    match length {
        Some(found) if found != bytes => Err(wrong_length(reader, count, found)),
        _ => Ok((Form::Binary, count)),
    }
}

/// A text without the mark that some editors write before UTF-8, and without blanks before
/// its first word.
fn trimmed(head: &[u8]) -> &[u8] {
    head.strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(head)
        .trim_ascii_start()
}

/// What follows the word `solid` at the start; `None` when something else is there.
fn after_solid(head: &[u8]) -> Option<&[u8]> {
    let (word, rest) = trimmed(head).split_at_checked(5)?;
    let ended = rest.first().is_none_or(u8::is_ascii_whitespace);
    (word.eq_ignore_ascii_case(b"solid") && ended).then_some(rest)
}

/// True when the second line begins as that of a text does.
fn has_facets(rest: &[u8]) -> bool {
    let Some(end) = rest.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
        return false;
    };
    let next = rest[end..].trim_ascii_start();
    let is = |word: &[u8]| {
        next.get(..word.len())
            .is_some_and(|w| w.eq_ignore_ascii_case(word))
    };
    is(b"facet") || is(b"endsolid")
}

fn no_stl(reader: &ByteReader, head: &[u8]) -> Error {
    let word = head.split(|b| b.is_ascii_whitespace());
    Error::input(
        reader.path(),
        "byte 0",
        "STL: a text that begins with `solid`, or a binary file",
        format!(
            "text that begins with {}",
            shown(word.into_iter().find(|w| !w.is_empty()).unwrap_or_default())
        ),
        "if it is a mesh of another format, say which with --format",
    )
}

fn wrong_length(reader: &ByteReader, count: u64, found: u64) -> Error {
    let bytes = HEAD + count * FACET as u64;
    let (what, help) = if found < bytes {
        (
            format!(
                "{found} bytes: facet {} ends beyond them",
                found.saturating_sub(HEAD) / FACET as u64
            ),
            "the file is cut short, or its count is wrong; write or copy it again",
        )
    } else {
        (
            format!("{found} bytes: {} too many", found - bytes),
            "the count is wrong, or something was appended; export the mesh again",
        )
    };
    Error::input(
        reader.path(),
        "byte 80",
        format!("a file of {bytes} bytes, since the count there says {count} facets"),
        what,
        help,
    )
}

fn binary<B: Bits>(
    mut reader: ByteReader,
    facets: u64,
    soup: &mut dyn Soup<B>,
) -> Result<InputDigest> {
    reader.skip(HEAD)?;
    let mut left = facets;
    while left > 0 {
        // A whole buffer at a time; `peek` joins a facet that lies across its end.
        if reader.peek(FACET)?.len() < FACET {
            return Err(reader.cut_short(format!(
                "50 bytes of facet {} (the count says {facets} facets)",
                facets - left
            )));
        }
        let mut taken = 0;
        let whole = reader.buffered().chunks_exact(FACET);
        for facet in whole.take(usize::try_from(left).unwrap_or(usize::MAX)) {
            soup.corners(&corners(facet))?;
            taken += 1;
        }
        reader.consume(taken * FACET);
        left -= taken as u64;
    }
    if !reader.buffer()?.is_empty() {
        return Err(Error::input(
            reader.path(),
            format!("byte {}", reader.offset()),
            format!("the end of the input, since the count says {facets} facets"),
            "more bytes",
            "the count is wrong, or something was appended; export the mesh again",
        ));
    }
    reader.finish()
}

/// The corners of a binary facet; the normal before them is passed over.
#[inline]
fn corners<B: Bits>(facet: &[u8]) -> [[B; 3]; 3] {
    let bits = |at: usize| {
        let b = &facet[at..at + 4];
        B::from_f4(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    };
    [12, 24, 36].map(|at| [bits(at), bits(at + 4), bits(at + 8)])
}

fn text<B: Bits>(mut reader: ByteReader, soup: &mut dyn Soup<B>) -> Result<InputDigest> {
    if reader.peek(3)? == b"\xef\xbb\xbf" {
        reader.consume(3);
    }
    let mut lexer = Lexer::new(reader, Dialect::Plain, 1);
    while lexer.seek_word()? {
        expect(&mut lexer, "solid")?;
        // The rest of the line is the name, which may hold anything.
        lexer.next_line()?;
        while facet_follows(&mut lexer)? {
            soup.corners(&facet(&mut lexer)?)?;
        }
        lexer.next_line()?;
    }
    lexer.into_reader().finish()
}

/// Takes `facet` (true) or `endsolid` (false).
fn facet_follows(lexer: &mut Lexer) -> Result<bool> {
    const EXPECTED: &str = "`facet` or `endsolid`";
    let word = next(lexer, EXPECTED)?;
    if word.eq_ignore_ascii_case(b"facet") {
        return Ok(true);
    }
    if word.eq_ignore_ascii_case(b"endsolid") {
        return Ok(false);
    }
    let found = shown(word);
    Err(lexer.error(
        EXPECTED,
        found,
        "correct the line, or export the mesh again",
    ))
}

/// The corners of a facet whose first word was taken.
fn facet<B: Bits>(lexer: &mut Lexer) -> Result<[[B; 3]; 3]> {
    let mut words = 0;
    // Some programs leave the normal out, or write numbers there that are none.
    while !next(lexer, "`outer loop`")?.eq_ignore_ascii_case(b"outer") {
        words += 1;
        if words > 4 {
            return Err(lexer.error(
                "`outer loop` behind the normal",
                "more words",
                "correct the facet, or export the mesh again",
            ));
        }
    }
    expect(lexer, "loop")?;
    let mut at = [[B::from_f4(0); 3]; 3];
    for corner in &mut at {
        expect(lexer, "vertex")?;
        for c in corner {
            *c = B::from_f4(coordinate(lexer)?);
        }
    }
    expect(lexer, "endloop")?;
    expect(lexer, "endfacet")?;
    Ok(at)
}

/// The next word, on this line or a later one.
#[inline]
fn next<'a>(lexer: &'a mut Lexer, expected: &str) -> Result<&'a [u8]> {
    if !lexer.seek_word()? {
        let help = "the file is cut short; write or copy it again";
        return Err(lexer.error(expected, "the end of the input", help));
    }
    lexer.need(expected)
}

/// Takes the given word, in any letter case.
#[inline]
fn expect(lexer: &mut Lexer, expected: &'static str) -> Result<()> {
    let word = next(lexer, expected)?;
    if word.eq_ignore_ascii_case(expected.as_bytes()) {
        return Ok(());
    }
    let help = if word.eq_ignore_ascii_case(b"vertex") {
        "facets of STL are triangles; cut larger ones, or use OBJ or PLY"
    } else {
        "correct the line, or export the mesh again"
    };
    let found = shown(word);
    Err(lexer.error(format!("`{expected}`"), found, help))
}

#[inline]
fn coordinate(lexer: &mut Lexer) -> Result<u32> {
    const EXPECTED: &str = "a coordinate";
    let word = next(lexer, EXPECTED)?;
    match parse_f4(word) {
        Ok(value) => Ok(value.to_bits()),
        Err(bad) => {
            let found = shown(word);
            Err(match bad {
                BadNumber::Garbage => lexer.error(EXPECTED, found, "correct the number"),
                BadNumber::Large => lexer.error(
                    "a coordinate that 4 bytes hold, as all of STL are",
                    found,
                    "scale the mesh down, or use a format with 8-byte coordinates",
                ),
            })
        }
    }
}

#[path = "stl_facets.rs"]
mod facets;
pub(super) use self::facets::Facets;
#[cfg(test)]
#[path = "stl_tests.rs"]
mod tests;
