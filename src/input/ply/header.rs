//! The header of a PLY file: what elements follow, and how they are spelled.
//!
//! Lines end as the line "ply" does: at LF (a CR before it belongs to the line's end), or at
//! CR alone. That settles where binary data begins even when its first byte looks like the
//! end of a line. A line whose first word is not known is passed over and told, since some
//! writers forget the word `comment`; a known word with anything unclear behind it is an error.
//!
//! Memory: the properties, of at most [`MAX_BYTES`] of text. I/O: the header.
//! Source: Greg Turk, "The PLY Polygon File Format", 1994.

use crate::error::{Error, Result};
use crate::input::reader::ByteReader;
use crate::input::text::shown;
use std::fmt;

/// The longest header that is read.
const MAX_BYTES: u64 = 1 << 20;
/// The most of a line that is looked at.
const MAX_LINE: usize = 4096;

/// How values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

/// A scalar type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    const fn name(self) -> &'static str {
        match self {
            Scalar::I8 => "int8",
            Scalar::U8 => "uint8",
            Scalar::I16 => "int16",
            Scalar::U16 => "uint16",
            Scalar::I32 => "int32",
            Scalar::U32 => "uint32",
            Scalar::F32 => "float32",
            Scalar::F64 => "float64",
        }
    }

    fn named(name: &str) -> Option<Scalar> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    /// Size in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// True for the integer types.
    pub fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }

    /// True when every value of the type is an f4.
    pub fn fits_f4(self) -> bool {
        !matches!(self, Scalar::I32 | Scalar::U32 | Scalar::F64)
    }
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    One(Scalar),
    List { count: Scalar, item: Scalar },
}

impl fmt::Display for Shape {
    /// As a header has it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Shape::One(scalar) => f.write_str(scalar.name()),
            Shape::List { count, item } => write!(f, "list {} {}", count.name(), item.name()),
        }
    }
}

/// A property of an element.
#[derive(Clone, Debug)]
pub struct Property {
    pub name: String,
    pub shape: Shape,
}

/// An element: `count` rows with a value for each property.
#[derive(Clone, Debug)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

/// The whole header.
#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// The line behind the header.
    pub next_line: u64,
    /// Lines that were not understood: number and text.
    pub skipped: Vec<(u64, String)>,
}

impl Header {
    /// Reads the header; the reader stands at the first byte of data then.
    pub fn read(reader: &mut ByteReader) -> Result<Header> {
        let mut lines = Lines::new(reader);
        while lines.next()? && lines.words().is_empty() {}
        if lines.words() != ["ply"] {
            return Err(lines.error("the word `ply`", "the file is no PLY, or it is damaged"));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut skipped = Vec::new();
        loop {
            if !lines.next()? {
                let more = "a line `end_header`";
                return Err(lines.reader.cut_short(more));
            }
            match lines.words()[..] {
                [] | ["comment" | "obj_info", ..] => {}
                ["end_header"] => break,
                ["format", ref rest @ ..] => match (encoding, rest) {
                    (None, ["ascii", "1.0"]) => encoding = Some(Encoding::Ascii),
                    (None, ["binary_little_endian", "1.0"]) => encoding = Some(Encoding::Little),
                    (None, ["binary_big_endian", "1.0"]) => encoding = Some(Encoding::Big),
                    _ => {
                        let what = "one line `format`: ascii, binary_little_endian or \
                                    binary_big_endian, version 1.0";
                        return Err(lines.error(what, ""));
                    }
                },
                ["element", ref rest @ ..] => {
                    let element = lines.element(rest)?;
                    if elements.iter().any(|e| e.name == element.name) {
                        return Err(lines.error("each element once", ""));
                    }
                    elements.push(element);
                }
                ["property", ref rest @ ..] => {
                    let property = lines.property(rest)?;
                    let Some(element) = elements.last_mut() else {
                        return Err(lines.error("an element before its properties", ""));
                    };
                    element.properties.push(property);
                }
                _ if skipped.len() < 8 => skipped.push((lines.number, shown(&lines.text))),
                _ => {}
            }
        }
        Ok(Header {
            encoding: encoding
                .ok_or_else(|| lines.error("a line `format` before the end of the header", ""))?,
            next_line: lines.number + 1,
            elements,
            skipped,
        })
    }
}

/// The lines of a header.
struct Lines<'a> {
    reader: &'a mut ByteReader,
    /// The line, cut off at [`MAX_LINE`].
    text: Vec<u8>,
    number: u64,
    /// What ends a line, once known.
    end: Option<u8>,
}

impl Lines<'_> {
    fn new(reader: &mut ByteReader) -> Lines<'_> {
        Lines {
            reader,
            text: Vec::new(),
            number: 0,
            end: None,
        }
    }

    /// Reads the next line; false when the input has ended.
    fn next(&mut self) -> Result<bool> {
        self.text.clear();
        self.number += 1;
        let mut begun = false;
        loop {
            let buf = self.reader.buffer()?;
            if buf.is_empty() {
                return Ok(begun);
            }
            begun = true;
            let end = self.end;
            let is_end = |&b: &u8| match end {
                Some(end) => b == end,
                None => b == b'\n' || b == b'\r',
            };
            let stop = buf.iter().position(is_end);
            let part = &buf[..stop.unwrap_or(buf.len())];
            let room = MAX_LINE - self.text.len();
            self.text.extend_from_slice(&part[..part.len().min(room)]);
            self.reader.consume(stop.unwrap_or(usize::MAX));
            if self.reader.offset() > MAX_BYTES {
                return Err(self.error("a line `end_header` within the first MiB", ""));
            }
            if stop.is_some() {
                let pair = self.reader.peek(2)?;
                let ends_with_lf = pair == b"\r\n" || pair.starts_with(b"\n");
                let bytes = 1 + usize::from(self.end.is_none() && pair == b"\r\n");
                if self.end.is_none() {
                    self.end = Some(if ends_with_lf { b'\n' } else { b'\r' });
                }
                self.reader.consume(bytes);
                return Ok(true);
            }
        }
    }

    /// The words of the line; a word that is no text reads as a question mark.
    fn words(&self) -> Vec<&str> {
        self.text
            .split(|b| b.is_ascii_whitespace())
            .filter(|w| !w.is_empty())
            .map(|w| std::str::from_utf8(w).unwrap_or("?"))
            .collect()
    }

    fn error(&self, expected: &str, help: &str) -> Error {
        Error::input(
            self.reader.path(),
            format!("line {}", self.number),
            expected,
            shown(self.text.trim_ascii()),
            if help.is_empty() {
                "the header is damaged; write the file again"
            } else {
                help
            },
        )
    }

    fn element(&self, rest: &[&str]) -> Result<Element> {
        let [name, count] = rest else {
            return Err(self.error("`element NAME COUNT`", ""));
        };
        let count: u64 = count
            .parse()
            .map_err(|_| self.error("a count that is an integer and not negative", ""))?;
        Ok(Element {
            name: (*name).to_owned(),
            count,
            properties: Vec::new(),
        })
    }

    fn property(&self, rest: &[&str]) -> Result<Property> {
        let scalar = |name: &str| {
            let types = "a type of char uchar short ushort int uint float double, or of \
                         int8 uint8 int16 uint16 int32 uint32 float32 float64";
            Scalar::named(name).ok_or_else(|| self.error(types, ""))
        };
        let (shape, name) = match rest {
            ["list", count, item, name] => {
                let count = scalar(count)?;
                if !count.is_integer() {
                    return Err(self.error("a list whose count is of an integer type", ""));
                }
                let item = scalar(item)?;
                (Shape::List { count, item }, name)
            }
            [kind, name] => (Shape::One(scalar(kind)?), name),
            _ => {
                let forms = "`property TYPE NAME` or `property list TYPE TYPE NAME`";
                return Err(self.error(forms, ""));
            }
        };
        Ok(Property {
            name: (*name).to_owned(),
            shape,
        })
    }
}
