//! Headers of `.npy` files (NumPy's format, versions 1.0 and 2.0 read, 1.0 written).
//!
//! A header is at most [`MAX_HEADER`] bytes whatever it claims, and shapes are checked against
//! the file's length before anything is mapped.
//!
//! Memory: the header. I/O: the header.
//! Source: NumPy Enhancement Proposal 1, "A Simple File Format for NumPy Arrays".

use crate::disk::DataFile;
use crate::error::{Error, Result};

/// Byte where the data of every array of a mesh folder begins.
pub const DATA_START: u64 = 4096;
/// The longest header that is read.
pub const MAX_HEADER: usize = 64 << 10;

const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// The parsed header of an `.npy` file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// Type: `<u4`, or the bracketed list of a structured type, as the file spells it.
    pub descr: String,
    /// True for column-major arrays.
    pub fortran: bool,
    /// Shape.
    pub shape: Vec<u64>,
    /// Byte where the data begins.
    pub data_start: u64,
}

/// Size in bytes of a simple type (`<u4`, `|u1`, `>f8`), or of a structured one of ours.
fn item_bytes(descr: &str) -> Option<u64> {
    if descr.starts_with('[') {
        return match descr {
            super::COMPONENT_DESCR => Some(super::row_type(false).1),
            super::MEASURED_DESCR => Some(super::row_type(true).1),
            super::EDGE_DESCR => Some(size_of::<super::EdgeRow>() as u64),
            _ => None,
        };
    }
    descr.get(2..)?.parse().ok()
}

/// The header of a new array, exactly [`DATA_START`] bytes.
pub fn header_bytes(descr: &str, shape: &[u64]) -> Vec<u8> {
    let mut dims: String = shape.iter().map(|d| format!("{d}, ")).collect();
    // NumPy writes (5,) and (5, 3): a comma after the only dimension alone.
    dims.truncate(
        dims.len()
            .saturating_sub(if shape.len() == 1 { 1 } else { 2 }),
    );
    let descr = if descr.starts_with('[') {
        descr.to_owned()
    } else {
        format!("'{descr}'")
    };
    let dict = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': ({dims}), }}");
    let mut bytes = Vec::with_capacity(DATA_START as usize);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&[1, 0]);
    bytes.extend_from_slice(&((DATA_START - 10) as u16).to_le_bytes());
    bytes.extend_from_slice(dict.as_bytes());
    bytes.resize(DATA_START as usize - 1, b' ');
    bytes.push(b'\n');
    bytes
}

impl Header {
    /// Reads and checks the header, and that the file holds the data that it promises.
    ///
    /// # Errors
    /// [`Error::Input`] naming the byte, [`Error::Io`].
    pub fn read(file: &DataFile) -> Result<Header> {
        let bad = |at: u64, expected: &str, found: String| {
            Error::input(
                file.path(),
                format!("byte {at}"),
                expected,
                found,
                "the file is no .npy array, or it is damaged",
            )
        };
        let mut start = [0u8; 12];
        let got = file.read_some_at(&mut start, 0)?;
        if got < 10 || &start[..6] != MAGIC {
            return Err(bad(0, "the magic \\x93NUMPY", "something else".into()));
        }
        let (text_start, text_len) = match start[6] {
            1 => (10u64, usize::from(u16::from_le_bytes([start[8], start[9]]))),
            2 | 3 if got == 12 => (
                12,
                u32::from_le_bytes([start[8], start[9], start[10], start[11]]) as usize,
            ),
            v => return Err(bad(6, "format version 1, 2 or 3", format!("version {v}"))),
        };
        if text_len > MAX_HEADER {
            return Err(bad(
                8,
                "a header of at most 64 KiB",
                format!("{text_len} bytes"),
            ));
        }
        let mut text = vec![0; text_len];
        if file.read_some_at(&mut text, text_start)? < text_len {
            return Err(bad(8, "a whole header", "the end of the file".into()));
        }
        let text = String::from_utf8(text).map_err(|_| {
            bad(
                text_start,
                "a header in text",
                "bytes that are no text".into(),
            )
        })?;
        let header = Header::parse(&text, text_start + text_len as u64).ok_or_else(|| {
            bad(
                text_start,
                "descr, fortran_order and shape",
                text.trim().into(),
            )
        })?;
        header.check_length(file)?;
        Ok(header)
    }

    /// Number of items in the array; `None` when the product passes 2^64.
    pub fn items(&self) -> Option<u64> {
        self.shape.iter().try_fold(1u64, |n, &d| n.checked_mul(d))
    }

    /// Reads the dictionary as Python would: in any order, with either quotes.
    fn parse(text: &str, data_start: u64) -> Option<Header> {
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        let mut rest = Literal(text).after("{")?;
        while rest.after("}").is_none() {
            let (key, value) = rest.string()?;
            rest = value.after(":")?;
            match key {
                "descr" => {
                    let (found, next) = rest.string().or_else(|| rest.list())?;
                    (descr, rest) = (Some(found.to_owned()), next);
                }
                "fortran_order" => {
                    let yes = rest.after("True").map(|next| (true, next));
                    let (found, next) = yes.or_else(|| Some((false, rest.after("False")?)))?;
                    (fortran, rest) = (Some(found), next);
                }
                "shape" => {
                    let (found, next) = rest.numbers()?;
                    (shape, rest) = (Some(found), next);
                }
                _ => return None,
            }
            rest = match rest.after(",") {
                Some(next) => next,
                None => rest.after("}").map(|_| rest)?,
            };
        }
        Some(Header {
            descr: descr?,
            fortran: fortran?,
            shape: shape?,
            data_start,
        })
    }

    fn check_length(&self, file: &DataFile) -> Result<()> {
        let Some(item) = item_bytes(&self.descr) else {
            return Ok(());
        };
        let have = file.len()?.saturating_sub(self.data_start);
        let need = self.items().and_then(|n| n.checked_mul(item));
        if need.is_none_or(|need| need > have) {
            return Err(Error::input(
                file.path(),
                format!("byte {}", self.data_start),
                format!("the data of {} x {:?}", self.descr, self.shape),
                format!("only {have} bytes"),
                "the file is cut short; write or copy it again",
            ));
        }
        Ok(())
    }
}

/// The rest of a Python literal, as far as headers have them.
#[derive(Clone, Copy)]
struct Literal<'a>(&'a str);

impl<'a> Literal<'a> {
    /// What comes after `token`, if that comes next.
    fn after(self, token: &str) -> Option<Self> {
        self.0.trim_start().strip_prefix(token).map(Literal)
    }

    /// A string without escapes, which no name and no type of a number has.
    fn string(self) -> Option<(&'a str, Self)> {
        let text = self.0.trim_start();
        let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
        let (found, rest) = text[1..].split_once(quote)?;
        (!found.contains('\\')).then_some((found, Literal(rest)))
    }

    /// A list of a structured type, as it is spelled.
    fn list(self) -> Option<(&'a str, Self)> {
        let text = self.0.trim_start();
        let (mut depth, mut quote) = (0u32, None);
        for (at, c) in text.char_indices() {
            match (quote, c) {
                (Some(open), _) if open == c => quote = None,
                (None, '\'' | '"') => quote = Some(c),
                (None, '[' | '(') => depth += 1,
                (None, ']' | ')') => depth = depth.checked_sub(1)?,
                _ => {}
            }
            if depth == 0 && quote.is_none() {
                let (list, rest) = text.split_at(at + c.len_utf8());
                return list.starts_with('[').then_some((list, Literal(rest)));
            }
        }
        None
    }

    /// A tuple of integers, which Python 2 ended with an L when they were long.
    fn numbers(self) -> Option<(Vec<u64>, Self)> {
        let (inner, rest) = self.after("(")?.0.split_once(')')?;
        let number = |word: &str| word.strip_suffix('L').unwrap_or(word).parse().ok();
        let words = inner.split(',').map(str::trim).filter(|w| !w.is_empty());
        Some((words.map(number).collect::<Option<_>>()?, Literal(rest)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_headers_parse_back() {
        for (descr, shape) in [
            ("<u4", vec![5, 3]),
            ("|u1", vec![0]),
            (super::super::COMPONENT_DESCR, vec![7]),
            (super::super::EDGE_DESCR, vec![0]),
        ] {
            let bytes = header_bytes(descr, &shape);
            assert_eq!(bytes.len() as u64, DATA_START);
            let text = std::str::from_utf8(&bytes[10..]).unwrap();
            let header = Header::parse(text, DATA_START).unwrap();
            // A structured type ends at the first ']', so the whole list must come back.
            assert_eq!(header.descr, descr);
            assert_eq!((header.shape, header.fortran), (shape, false));
        }
        assert_eq!(item_bytes(super::super::COMPONENT_DESCR), Some(116));
    }

    #[test]
    fn headers_of_other_writers_are_read() {
        for text in [
            "{'descr': '<u4', 'fortran_order': False, 'shape': (5, 3)}",
            "{\"descr\": \"<u4\", \"fortran_order\": False, \"shape\": (5, 3), }",
            "{'shape':(5,3,),\"fortran_order\":False,'descr':'<u4'}",
            "  { 'shape' : ( 5L , 3L ) ,\n 'descr' : \"<u4\" ,\t'fortran_order' : False , }  \n",
        ] {
            let header = Header::parse(text, 64).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(
                (&*header.descr, header.fortran, &*header.shape),
                ("<u4", false, &[5, 3][..]),
                "{text}"
            );
        }
        let list = "[(\"a]\", '<u4', (2, 3)), ('b', [('c', '|u1')])]";
        let text = format!("{{'descr': {list}, 'fortran_order': True, 'shape': ()}}");
        let header = Header::parse(&text, 64).unwrap();
        assert_eq!((&*header.descr, header.fortran), (list, true));
        assert!(header.shape.is_empty());
        for text in [
            "",
            "{}",
            "{'descr': '<u4', 'fortran_order': False}",
            "{'descr': '<u4', 'fortran_order': False, 'shape': (5, 3), 'more': 1}",
            "{'descr': '<u4\", 'fortran_order': False, 'shape': (5, 3)}",
            "{'descr': '<\\x75', 'fortran_order': False, 'shape': (5, 3)}",
            "{'descr': '<u4', 'fortran_order': Maybe, 'shape': (5, 3)}",
            "{'descr': '<u4' 'fortran_order': False, 'shape': (5, 3)}",
            "{'descr': '<u4', 'fortran_order': False, 'shape': (5, -3)}",
            "{'descr': '<u4', 'fortran_order': False, 'shape': (5, 3)",
            "{'descr': ]'<u4', 'fortran_order': False, 'shape': (5, 3)}",
            &"{'descr': [".repeat(9000),
        ] {
            assert_eq!(Header::parse(text, 64), None, "{text}");
        }
    }
}
