//! A look at polygons in a binary file, whose rows differ in length.
//!
//! Why a row can be found in the middle: the lengths of lists are small and corners name vertices
//! that there are. Where a good many rows in a row are like that, they are rows, nearly always;
//! where they are not, another byte is tried. Nothing is checked here.
//!
//! Memory: the triangles asked for, and their bytes, 256 KiB at a time. I/O: those bytes.

use super::Endian;
use super::lines::{Column, fan};
use super::look::number;
use crate::disk::DataFile;
use crate::error::Result;

/// Bytes that are read at a time.
const STEP: usize = 256 << 10;
/// Places at which the usual polygon is looked for.
const PLACES: u64 = 16;
/// Rows that must look like rows where a look begins.
const ALIKE: usize = 32;
/// A list is no longer.
const LONGEST: u64 = 1 << 10;

/// Where polygons of a binary file lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Polygons {
    /// Bytes of the rows.
    pub at: u64,
    pub end: u64,
    pub columns: Vec<Column>,
    pub endian: Endian,
    pub vertices: u64,
    /// Triangles that they are cut into, about.
    pub triangles: u64,
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
        let mut corners = Vec::new();
        let mut block = vec![0; STEP];
        let mut lost = first > 0;
        while (into.len() as u64) < count && at < self.end {
            let length = (self.end - at).min(STEP as u64) as usize;
            let n = file.read_some_at(&mut block[..length], at)?;
            let mut rest = &block[..n];
            rest = &rest[self.begin(rest, std::mem::take(&mut lost), &mut corners)..];
            while let Some(row) = self.row(rest, &mut corners) {
                fan(&corners, into);
                rest = &rest[row..];
            }
            let read = (n - rest.len()) as u64;
            if read == 0 {
                break;
            }
            at += read;
        }
        into.truncate(count as usize);
        Ok(())
    }

    /// Triangles that a polygon is cut into, on average over those at some places.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn fans(&self, file: &DataFile) -> Result<Option<f64>> {
        let (mut rows, mut triangles) = (0u64, 0u64);
        let (mut block, mut corners) = (vec![0; STEP / PLACES as usize], Vec::new());
        let step = (self.end - self.at) / PLACES;
        for place in 0..PLACES {
            let n = file.read_some_at(&mut block, self.at + place * step)?;
            let mut rest = &block[..n];
            rest = &rest[self.begin(rest, place > 0, &mut corners)..];
            while let Some(row) = self.row(rest, &mut corners) {
                (rows, triangles) = (rows + 1, triangles + corners.len() as u64 - 2);
                rest = &rest[row..];
            }
        }
        Ok((rows > 0).then(|| triangles as f64 / rows as f64))
    }

    /// Where a row begins: here, unless that is not known.
    fn begin(&self, bytes: &[u8], lost: bool, corners: &mut Vec<u64>) -> usize {
        let mut places = 0..if lost { bytes.len() } else { 0 };
        let found = places.find(|&from| self.alike(&bytes[from..], corners));
        found.unwrap_or(places.end)
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
                Column::Face(count, item) => {
                    let count = number(take(count)?, self.endian);
                    let count = Some(count).filter(|n| (3..=LONGEST).contains(n))?;
                    let items = take(item * count)?.chunks_exact(item as usize);
                    corners.extend(items.map(|bytes| number(bytes, self.endian)));
                    if corners.iter().any(|&v| v >= self.vertices) {
                        return None;
                    }
                }
            }
        }
        Some(at)
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
            vertices: count.into(),
            triangles: 2 * u64::from(count),
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
        let fans = polygons.fans(&data).unwrap().unwrap();
        assert!((1.8..2.2).contains(&fans), "{fans}");
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
            assert_eq!(polygons.fans(&data).unwrap(), None);
        }
    }
}
