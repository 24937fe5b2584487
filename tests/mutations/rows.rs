//! Changes of the rows and numbers of binary files.

use proptest::prelude::*;
use proptest::sample::Index;

/// Numbers of four bytes that are easily taken wrong: counts, ids, and floats by their bits.
const NUMBERS: [u32; 14] = [
    0,
    1,
    3,
    0xff,
    0x100,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_fffe,
    0xffff_ffff,
    0x7fc0_0000,
    0x7f80_0000,
    0xff80_0000,
    0x7f7f_ffff,
    1 << 24,
];

/// A change of rows.
#[derive(Clone, Debug)]
pub enum Edit {
    /// Another number of [`NUMBERS`], at a multiple of four bytes or anywhere.
    Number(Index, Index, bool),
    Drop(Index),
    Repeat(Index),
    Swap(Index, Index),
    /// So many bytes less, or more, somewhere.
    Shift(Index, i8),
    /// From here on as the other file is from there on.
    Splice(Index, Index),
    Cut(Index),
}

pub fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let i = any::<Index>;
    let edit = prop_oneof![
        5 => (i(), i(), any::<bool>()).prop_map(|(a, x, even)| Edit::Number(a, x, even)),
        2 => i().prop_map(Edit::Drop),
        2 => i().prop_map(Edit::Repeat),
        2 => (i(), i()).prop_map(|(a, b)| Edit::Swap(a, b)),
        1 => (i(), -4i8..5).prop_map(|(a, by)| Edit::Shift(a, by)),
        1 => (i(), i()).prop_map(|(a, b)| Edit::Splice(a, b)),
        1 => i().prop_map(Edit::Cut),
    ];
    prop::collection::vec(edit, 1..4)
}

/// A file as a head and rows behind it.
#[derive(Clone, Debug)]
pub struct Rows {
    pub head: String,
    pub body: Vec<u8>,
    /// Bytes of a row.
    pub row: usize,
    /// Numbers are big-endian.
    pub big: bool,
}

impl Rows {
    /// The rows lie behind a text that ends so.
    pub fn behind(file: &[u8], end: &[u8], row: usize, big: bool) -> Rows {
        let at = file
            .windows(end.len())
            .position(|w| w == end)
            .expect("an end")
            + end.len();
        Rows {
            big,
            ..Rows::at(file, at, row)
        }
    }

    /// The rows lie from byte `at` on.
    pub fn at(file: &[u8], at: usize, row: usize) -> Rows {
        Rows {
            head: file[..at].iter().map(|&b| char::from(b)).collect(),
            body: file[at..].to_vec(),
            row,
            big: false,
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let head = self.head.chars().map(|c| u8::try_from(c).unwrap_or(b'?'));
        head.chain(self.body.iter().copied()).collect()
    }

    /// As an `.npy` file whose dict is the head.
    pub fn array(&self) -> Vec<u8> {
        let dict = self.head.as_bytes();
        let length = (10 + dict.len() + 1).next_multiple_of(64) - 10;
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((length as u16).to_le_bytes());
        bytes.extend(dict);
        bytes.resize(10 + length - 1, b' ');
        bytes.push(b'\n');
        bytes.extend(&self.body);
        bytes
    }

    pub fn change(&mut self, other: &Rows, edits: &[Edit]) {
        edits.iter().for_each(|edit| self.change_once(other, edit));
    }

    fn change_once(&mut self, other: &Rows, edit: &Edit) {
        let (row, rows) = (self.row, self.body.len() / self.row);
        if rows == 0 {
            return;
        }
        let at = |i: &Index| i.index(rows) * row;
        match edit {
            Edit::Number(place, number, even) => {
                let place = place.index(self.body.len() - 3);
                let place = if *even { place / 4 * 4 } else { place };
                let number = NUMBERS[number.index(NUMBERS.len())];
                let bytes = if self.big {
                    number.to_be_bytes()
                } else {
                    number.to_le_bytes()
                };
                self.body[place..place + 4].copy_from_slice(&bytes);
            }
            Edit::Drop(i) => drop(self.body.drain(at(i)..at(i) + row)),
            Edit::Repeat(i) => {
                let copy = self.body[at(i)..at(i) + row].to_vec();
                self.body.splice(at(i)..at(i), copy);
            }
            Edit::Swap(a, b) => {
                let (a, b) = (at(a), at(b));
                (0..row).for_each(|k| self.body.swap(a + k, b + k));
            }
            Edit::Shift(i, by) if *by < 0 => {
                let from = at(i);
                let end = (from + usize::from(by.unsigned_abs())).min(self.body.len());
                self.body.drain(from..end);
            }
            Edit::Shift(i, by) => {
                let more = vec![0x41; usize::from(by.unsigned_abs())];
                self.body.splice(at(i)..at(i), more);
            }
            Edit::Splice(here, there) => {
                self.body.truncate(at(here));
                let from = there.index(other.body.len().max(1)) / row * row;
                self.body.extend(&other.body[from..]);
            }
            Edit::Cut(i) => self.body.truncate(at(i) + row / 2),
        }
    }
}
