//! A reader and writer of `.npy` files, version 1.0, plain and structured, as small as will do.
//!
//! It panics on anything unexpected: in a test, an odd header is a failure.

use std::path::Path;

/// One column of a structured array; a plain array has one column with an empty name.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: String,
    /// `u`, `i` or `f`.
    pub kind: char,
    /// Bytes of one scalar.
    pub size: usize,
    /// Scalars in the column (3 for a point).
    pub count: usize,
    /// Byte offset within a row.
    pub offset: usize,
}

/// A whole array in memory, bytes as the file has them.
#[derive(Debug, Clone)]
pub struct Npy {
    pub fields: Vec<Field>,
    pub shape: Vec<usize>,
    /// Where the data starts in the file.
    pub start: usize,
    pub data: Vec<u8>,
}

impl Npy {
    /// Reads `path`, and checks that the data is exactly as long as the header says.
    pub fn read(path: &Path) -> Npy {
        let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Npy::parse(&bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    /// Parses the bytes of a whole file.
    pub fn parse(bytes: &[u8]) -> Result<Npy, String> {
        if bytes.len() < 10 || &bytes[..6] != b"\x93NUMPY" {
            return Err("no NumPy magic".into());
        }
        if bytes[6..8] != [1, 0] {
            return Err(format!("version {:?}, expected 1.0", &bytes[6..8]));
        }
        let start = 10 + u16::from_le_bytes([bytes[8], bytes[9]]) as usize;
        let header = bytes.get(10..start).ok_or("header cut short")?;
        let header = std::str::from_utf8(header).map_err(|e| e.to_string())?;
        if !header.ends_with('\n') {
            return Err("header does not end in a newline".into());
        }
        if value_of(header, "fortran_order")?.split([',', '}']).next() != Some("False") {
            return Err("fortran order".into());
        }
        let fields = parse_descr(value_of(header, "descr")?)?;
        let shape = parse_shape(value_of(header, "shape")?)?;
        let npy = Npy {
            fields,
            shape,
            start,
            data: bytes[start..].to_vec(),
        };
        let expected = npy.shape.iter().product::<usize>() * npy.row_bytes();
        if npy.data.len() != expected {
            return Err(format!(
                "{} bytes of data, expected {expected}",
                npy.data.len()
            ));
        }
        Ok(npy)
    }

    /// Bytes of one element (one row of a structured array).
    pub fn row_bytes(&self) -> usize {
        self.fields.iter().map(|f| f.size * f.count).sum()
    }

    /// The array's type as NumPy writes it, such as `u4`; for plain arrays.
    pub fn dtype(&self) -> String {
        assert!(self.is_plain(), "a structured array has no single type");
        format!("{}{}", self.fields[0].kind, self.fields[0].size)
    }

    fn is_plain(&self) -> bool {
        self.fields.len() == 1 && self.fields[0].name.is_empty()
    }

    /// The scalars of a plain unsigned array in order, the all-ones value as `u64::MAX`.
    pub fn ids(&self) -> Vec<u64> {
        assert!(
            self.is_plain() && self.fields[0].kind == 'u',
            "not an array of ids"
        );
        let size = self.fields[0].size;
        let none = if size == 8 {
            u64::MAX
        } else {
            (1 << (8 * size)) - 1
        };
        self.data
            .chunks_exact(size)
            .map(|b| match little(b) {
                id if id == none => u64::MAX,
                id => id,
            })
            .collect()
    }

    /// One column of integers of a structured array, negative ones as their bits.
    pub fn counts(&self, name: &str) -> Vec<u64> {
        let field = self.field(name);
        assert!(
            "ui".contains(field.kind) && field.count == 1,
            "column {name}"
        );
        let (at, size) = (field.offset, field.size);
        self.data
            .chunks_exact(self.row_bytes())
            .map(|r| little(&r[at..at + size]))
            .collect()
    }

    /// One column of `f8` of a structured array, its scalars in a row each.
    pub fn floats(&self, name: &str) -> Vec<Vec<f64>> {
        let field = self.field(name);
        assert_eq!((field.kind, field.size), ('f', 8), "column {name}");
        let (at, end) = (field.offset, field.offset + 8 * field.count);
        let row = |r: &[u8]| {
            r[at..end]
                .chunks_exact(8)
                .map(|b| f64::from_bits(little(b)))
                .collect()
        };
        self.data.chunks_exact(self.row_bytes()).map(row).collect()
    }

    fn field(&self, name: &str) -> &Field {
        let found = self.fields.iter().find(|f| f.name == name);
        found.unwrap_or_else(|| panic!("no column {name} among {:?}", self.fields))
    }
}

/// An unsigned little-endian number of up to 8 bytes.
fn little(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .rev()
        .fold(0, |sum, &b| sum << 8 | u64::from(b))
}

/// The text after `'key': `.
fn value_of<'a>(header: &'a str, key: &str) -> Result<&'a str, String> {
    let quoted = format!("'{key}':");
    let at = header
        .find(&quoted)
        .ok_or(format!("no {key} in {header:?}"))?;
    Ok(header[at + quoted.len()..].trim_start())
}

fn parse_shape(text: &str) -> Result<Vec<usize>, String> {
    let inside = text
        .strip_prefix('(')
        .and_then(|t| t.split(')').next())
        .ok_or("bad shape")?;
    let numbers = inside.split(',').map(str::trim).filter(|n| !n.is_empty());
    numbers
        .map(|n| n.parse().map_err(|_| format!("bad shape {inside}")))
        .collect()
}

/// `'<u4'`, or a list of `('name', '<u8')` and `('name', '<f8', (3,))`.
fn parse_descr(text: &str) -> Result<Vec<Field>, String> {
    let structured = text.starts_with('[');
    let end = if structured {
        text.find(']')
    } else {
        text[1..].find('\'').map(|i| i + 2)
    };
    let text = &text[..end.ok_or("descr does not end")?];
    // Odd pieces stand between quotes; what follows a type before the next quote is its shape.
    let pieces: Vec<&str> = text.split('\'').collect();
    let mut fields = Vec::new();
    let mut offset = 0;
    let mut at = 1;
    while at + 1 < pieces.len() {
        let name = if structured { pieces[at] } else { "" };
        at += if structured { 2 } else { 0 };
        let descr = pieces.get(at).ok_or("a name without a type")?;
        let shape = pieces.get(at + 1).ok_or("a type without an end")?;
        let digits: String = shape.chars().filter(char::is_ascii_digit).collect();
        let count = if digits.is_empty() {
            1
        } else {
            digits.parse().map_err(|_| "bad count")?
        };
        let mut letters = descr.chars();
        let order = letters.next().ok_or("an empty type")?;
        let kind = letters.next().ok_or("a type without a kind")?;
        let size: usize = letters
            .as_str()
            .parse()
            .map_err(|_| format!("bad type {descr}"))?;
        if order != '<' && !(order == '|' && size == 1) {
            return Err(format!("type {descr} is not little-endian"));
        }
        fields.push(Field {
            name: name.into(),
            kind,
            size,
            count,
            offset,
        });
        offset += size * count;
        at += 2;
    }
    Ok(fields)
}

/// Writes a plain two-dimensional array with the header that NumPy itself would write.
pub fn write(path: &Path, descr: &str, rows: usize, columns: usize, data: &[u8]) {
    let dict =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let padding = 63 - (10 + dict.len()) % 64;
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend(((dict.len() + padding + 1) as u16).to_le_bytes());
    file.extend(dict.as_bytes());
    file.extend(std::iter::repeat_n(b' ', padding));
    file.push(b'\n');
    file.extend(data);
    std::fs::write(path, file).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}
