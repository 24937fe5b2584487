//! A look at polygons and strips in a binary file, whose rows differ in length.
//!
//! Why a row can be found in the middle: the lengths of lists are small and corners name vertices
//! that there are. Where a good many rows in a row are like that, they are rows, nearly always;
//! where they are not, another byte is tried. Of strips too long for that a piece is found, by its
//! corners alone: where one ends and the next begins, a length is taken for a corner, and that is
//! little of a long strip. Nothing is checked here.
//!
//! Memory: the triangles asked for, and their bytes, 256 KiB at a time. I/O: those bytes, and a bound
//! on what lies between them; 4 MiB to tell how many triangles there are.

use super::Endian;
use super::cut::{RESTART, fan, strips};
use super::lines::{Column, MOST_ROW};
use super::look::number;
use super::sample::PART;
use crate::disk::DataFile;
use crate::error::Result;
use std::ops::Range;

/// Bytes that are read at a time.
const STEP: u64 = 256 << 10;
/// Bytes of a glance.
const GLANCE: u64 = 64 << 10;
/// Places at which the usual row is looked for.
const PLACES: u64 = 16;
/// Rows that must look like rows where a look begins.
const ALIKE: usize = 32;
/// A list is no longer.
const LONGEST: u64 = 1 << 10;
/// Bytes within which a row begins where lists are no longer than that, from a place among rows, and
/// from where their [`extent`](super::extent) begins.
const NEAR: u64 = 2 * PART;
const WITHIN: usize = 5 * PART as usize;
/// Corners that make a piece of a strip.
const PIECE: usize = 256;

/// Where polygons or strips of a binary file lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Polygons {
    /// Bytes of the rows, and how many there are.
    pub at: u64,
    pub end: u64,
    pub rows: u64,
    pub columns: Vec<Column>,
    pub endian: Endian,
    pub vertices: u64,
    /// Triangles that they are cut into, or about as many, and whether that is certain.
    pub triangles: u64,
    pub exact: bool,
}

/// What was found in a block.
#[derive(Default)]
struct Took {
    bytes: Range<usize>,
    rows: u64,
}

impl Polygons {
    /// Fills `into` with the corners of `count` triangles from about `first`, or fewer.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn read(
        &self,
        file: &DataFile,
        first: u64,
        count: u64,
        into: &mut Vec<[u64; 3]>,
    ) -> Result<()> {
        into.clear();
        let bytes = u128::from(self.end - self.at) * u128::from(first);
        let mut at = self.at + (bytes / u128::from(self.triangles.max(1))) as u64;
        let most = count.saturating_mul(MOST_ROW).max(STEP);
        let end = self.end.min(at.saturating_add(most));
        let mut lost = first > 0;
        let mut block = Vec::new();
        while (into.len() as u64) < count && at < end {
            self.fill(file, at, STEP, &mut block)?;
            let to = self.take(&block, lost, into).bytes.end as u64;
            if to == 0 && lost {
                break;
            }
            lost = to == 0;
            at += to;
        }
        into.truncate(count as usize);
        Ok(())
    }

    /// Triangles that the rows are cut into, by those at some places.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn guess(&self, file: &DataFile) -> Result<Option<u64>> {
        let length = self.end - self.at;
        let places = if length <= STEP { 1 } else { PLACES };
        let (mut block, mut found) = (Vec::new(), Vec::new());
        let (mut triangles, mut rows, mut bytes) = (0, 0, 0);
        for place in 0..places {
            let at = self.at + place * (length / places);
            self.fill(file, at, STEP, &mut block)?;
            found.clear();
            let mut took = self.take(&block, place > 0, &mut found);
            if took.bytes.is_empty() {
                took = self.take(&block, true, &mut found);
            }
            triangles += found.len();
            rows += took.rows;
            bytes += took.bytes.len() as u64;
        }
        let (seen, of) = match self.strips() {
            // Of long strips pieces are seen, not rows.
            Some(_) => (bytes, length),
            None => (rows, self.rows),
        };
        let by = of as f64 / seen as f64;
        Ok((seen > 0).then(|| (triangles as f64 * by).round() as u64))
    }

    /// True when the rows at a byte look like these.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn are_at(&self, file: &DataFile, at: u64) -> Result<bool> {
        let mut block = Vec::new();
        self.fill(file, at, GLANCE, &mut block)?;
        let bytes = self.take(&block, true, &mut Vec::new()).bytes;
        Ok(!bytes.is_empty() && (bytes.start as u64) < NEAR)
    }

    /// Fills a block of at most so many bytes.
    fn fill(&self, file: &DataFile, at: u64, most: u64, block: &mut Vec<u8>) -> Result<()> {
        block.resize((self.end - at).min(most) as usize, 0);
        let n = file.read_some_at(block, at)?;
        block.truncate(n);
        Ok(())
    }

    /// Appends the triangles of the rows in a block. They begin with it, unless that is not known.
    fn take(&self, block: &[u8], lost: bool, into: &mut Vec<[u64; 3]>) -> Took {
        let mut corners = Vec::new();
        let within = 0..block.len().min(WITHIN);
        let mut from = Some(0);
        if lost {
            let alike = |&from: &usize| self.alike(&block[from..], &mut corners);
            from = within.clone().find(alike);
        }
        if let Some(from) = from {
            let (mut to, mut rows) = (from, 0);
            while let Some(row) = self.row(&block[to..], &mut corners) {
                self.cut(&corners, into);
                (to, rows) = (to + row, rows + 1);
            }
            let bytes = from..to;
            return Took { bytes, rows };
        }
        for from in within {
            let piece = self.piece(&block[from..], &mut corners);
            if corners.len() >= PIECE {
                self.cut(&corners, into);
                let bytes = from..from + piece;
                return Took { bytes, rows: 0 };
            }
        }
        Took::default()
    }

    /// True when so many rows are here.
    fn alike(&self, bytes: &[u8], corners: &mut Vec<u64>) -> bool {
        let mut rest = bytes;
        for _ in 0..ALIKE {
            match self.row(rest, corners) {
                Some(row) => rest = &rest[row..],
                None => return false,
            }
        }
        true
    }

    /// Bytes of the row that begins here, whose corners are then in `corners`; none when it is no
    /// row, or not a whole one.
    fn row(&self, bytes: &[u8], corners: &mut Vec<u64>) -> Option<usize> {
        let mut at = 0usize;
        let mut take = |n: u64| {
            let part = bytes.get(at..at.checked_add(usize::try_from(n).ok()?)?)?;
            at += part.len();
            Some(part)
        };
        corners.clear();
        for column in &self.columns {
            match *column {
                Column::One(n) => _ = take(n)?,
                Column::List(count, item) => {
                    let count = number(take(count)?, self.endian);
                    take(item * Some(count).filter(|&n| n <= LONGEST)?)?;
                }
                Column::Face(count, item) | Column::Strip(count, item) => {
                    let count = number(take(count)?, self.endian);
                    let count = Some(count).filter(|n| (3..=LONGEST).contains(n))?;
                    for bytes in take(item * count)?.chunks_exact(item as usize) {
                        corners.push(self.corner(bytes)?);
                    }
                }
            }
        }
        Some(at)
    }

    /// Bytes of the piece of a strip that is here, whose corners are then in `corners`.
    fn piece(&self, bytes: &[u8], corners: &mut Vec<u64>) -> usize {
        corners.clear();
        let item = self.strips().unwrap_or(usize::MAX);
        let known = bytes.chunks_exact(item).map_while(|id| self.corner(id));
        corners.extend(known);
        corners.len() * item
    }

    /// The corner in these bytes.
    fn corner(&self, bytes: &[u8]) -> Option<u64> {
        let v = number(bytes, self.endian);
        let restart = || self.strips().is_some() && bytes.iter().all(|&b| b == u8::MAX);
        match v < self.vertices {
            true => Some(v),
            false => restart().then_some(RESTART),
        }
    }

    fn cut(&self, corners: &[u64], into: &mut Vec<[u64; 3]>) {
        match self.strips() {
            Some(_) => strips(corners, into),
            None => fan(corners, into),
        }
    }

    /// Bytes of a corner, when these are strips.
    fn strips(&self) -> Option<usize> {
        let item = |column: &Column| match *column {
            Column::Strip(_, item) => Some(item as usize),
            _ => None,
        };
        self.columns.iter().find_map(item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a flag, a list of shorts, and corners of which the first is the row's number.
    fn rows(count: u32) -> Vec<u8> {
        let mut bytes = vec![0xEE; 7];
        for i in 0..count {
            bytes.extend([3, (i % 3) as u8]);
            bytes.extend([1, 0].repeat(i as usize % 3));
            let corners = [i, 1, 2, 3, 4];
            let corners = &corners[..if i < count / 2 { 5 } else { 3 }];
            bytes.push(corners.len() as u8);
            bytes.extend(corners.iter().flat_map(|v| v.to_be_bytes()));
        }
        bytes
    }

    fn polygons(count: u32, bytes: u64) -> Polygons {
        Polygons {
            at: 7,
            end: bytes,
            columns: vec![Column::One(1), Column::List(1, 2), Column::Face(1, 4)],
            endian: Endian::Big,
            rows: count.into(),
            vertices: count.into(),
            triangles: 2 * u64::from(count),
            exact: false,
        }
    }

    fn written(bytes: &[u8]) -> (tempfile::NamedTempFile, DataFile) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let data = DataFile::open(file.path(), &Default::default()).unwrap();
        (file, data)
    }

    #[test]
    fn rows_are_found_in_the_middle() {
        let bytes = rows(100_000);
        let (_file, data) = written(&bytes);
        let polygons = polygons(100_000, bytes.len() as u64);
        let mut found = Vec::new();
        polygons.read(&data, 0, 5, &mut found).unwrap();
        assert_eq!(
            found,
            [[0, 1, 2], [0, 2, 3], [0, 3, 4], [1, 1, 2], [1, 2, 3]]
        );
        for share in [1, 4, 7] {
            polygons
                .read(&data, 20_000 * share, 30_000, &mut found)
                .unwrap();
            let ascends = |pair: &[[u64; 3]]| pair[1][0].wrapping_sub(pair[0][0]) < 2;
            assert!(found.windows(2).all(ascends), "other than rows");
            assert_eq!(found.len(), 30_000);
        }
        polygons.read(&data, 199_990, 30_000, &mut found).unwrap();
        assert!(found.len() < 30_000);
        let guess = polygons.guess(&data).unwrap().unwrap();
        assert!(guess.abs_diff(200_000) < 10_000, "{guess}");
    }

    #[test]
    fn bytes_that_are_no_rows_are_passed_over() {
        for byte in [0, 3, 0xFF] {
            let bytes = vec![byte; 400_000];
            let (_file, data) = written(&bytes);
            let polygons = polygons(1000, 400_000);
            let mut found = Vec::new();
            for first in [0, 1500] {
                polygons.read(&data, first, 100, &mut found).unwrap();
                assert!(found.is_empty());
            }
            assert_eq!(polygons.guess(&data).unwrap(), None);
        }
    }

    /// Lists of strips of so many words each; every word is its number in the file.
    fn strips(lists: &[u32], ends: u32) -> (Vec<u8>, Polygons) {
        let mut words: Vec<u32> = Vec::new();
        for &length in lists {
            words.push(length);
            for _ in 0..length {
                let word = words.len() as u32;
                let ends = word.is_multiple_of(ends);
                words.push(if ends { u32::MAX } else { word });
            }
        }
        let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        let polygons = Polygons {
            at: 0,
            end: bytes.len() as u64,
            rows: lists.len() as u64,
            columns: vec![Column::Strip(4, 4)],
            endian: Endian::Little,
            vertices: 1 << 30,
            triangles: words.len() as u64,
            exact: false,
        };
        (bytes, polygons)
    }

    #[test]
    fn strips_are_found_in_the_middle() {
        let ascend = |t: &[u64; 3]| t.iter().max().unwrap() - t.iter().min().unwrap() == 2;
        let mut found = Vec::new();
        for (lists, ends) in [
            (vec![20; 40_000], u32::MAX),
            (vec![800_000], 50),
            (vec![50_000; 16], 50),
        ] {
            let (bytes, polygons) = strips(&lists, ends);
            let (_file, data) = written(&bytes);
            for first in [0, 1000, 400_000, 700_000] {
                polygons.read(&data, first, 30_000, &mut found).unwrap();
                assert_eq!(found.len(), 30_000);
                assert!(
                    found[9][0].abs_diff(first) < 2000,
                    "{first}: {:?}",
                    found[9]
                );
                // Of long lists a length may be taken for a corner.
                let others = found.iter().filter(|t| !ascend(t)).count();
                assert!(others <= if lists[0] == 20 { 0 } else { 6 }, "{others}");
            }
            let [words, strips] =
                [1, if lists[0] == 20 { 21 } else { 50 }].map(|n| polygons.triangles / n);
            let right = words - 3 * strips;
            let guess = polygons.guess(&data).unwrap().unwrap();
            assert!(guess.abs_diff(right) <= right / 200, "{guess} of {right}");
        }
        let (bytes, polygons) = strips(&[5, 4], 9);
        let (_file, data) = written(&bytes);
        assert_eq!(polygons.guess(&data).unwrap(), Some(3));
        polygons.read(&data, 0, 9, &mut found).unwrap();
        assert_eq!(found, [[1, 2, 3], [3, 2, 4], [3, 4, 5]]);
    }
}
