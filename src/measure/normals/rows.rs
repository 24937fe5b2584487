//! Files of normals, (n,3) f4, and the two ways in which rows get there.
//!
//! Why zeros need not be written: a file has its full length from the start, and what is never
//! written reads as zeros.
//!
//! Memory: [`BLOCK`] rows for a [`Run`] or a [`Patch`]. I/O: each row once; a patch reads and
//! writes whole blocks.

use crate::disk::DataFile;
use crate::error::Result;
use crate::folder::npy::{DATA_START, header_bytes};
use std::ops::Range;

/// Rows that are held at a time.
const BLOCK: usize = 4 << 10;
/// Bytes of a row.
pub(super) const ROW: u64 = size_of::<[f32; 3]>() as u64;
/// Bytes that a [`Run`] or a [`Patch`] holds.
pub(super) const HELD: u64 = BLOCK as u64 * ROW;

/// A file of rows; threads share it and write different rows.
pub(super) struct RowFile {
    file: DataFile,
    rows: u64,
}

impl RowFile {
    /// Makes an empty file one of so many rows, all zero.
    pub(super) fn new(file: DataFile, rows: u64) -> Result<RowFile> {
        file.set_len(DATA_START + rows * ROW)?;
        file.write_at(&header_bytes("<f4", &[rows, 3]), 0)?;
        Ok(RowFile { file, rows })
    }

    /// Writes rows from row number `first`.
    pub(super) fn write(&self, first: u64, rows: &[[f32; 3]]) -> Result<()> {
        let at = DATA_START + first * ROW;
        if cfg!(target_endian = "little") {
            return self.file.write_at(bytemuck::cast_slice(rows), at);
        }
        let bytes = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes());
        self.file.write_at(&bytes.collect::<Vec<u8>>(), at)
    }

    fn read(&self, first: u64, rows: &mut [[f32; 3]]) -> Result<()> {
        let bytes = bytemuck::cast_slice_mut(rows);
        self.file.read_at(bytes, DATA_START + first * ROW)?;
        for x in rows.as_flattened_mut() {
            *x = f32::from_bits(u32::from_le(x.to_bits()));
        }
        Ok(())
    }
}

/// Gathers rows that follow each other, and writes them together.
pub(super) struct Run<'a> {
    file: &'a RowFile,
    first: u64,
    rows: Vec<[f32; 3]>,
}

impl<'a> Run<'a> {
    pub(super) fn new(file: &'a RowFile) -> Run<'a> {
        Run {
            file,
            first: 0,
            rows: Vec::with_capacity(BLOCK),
        }
    }

    /// Takes a row; those before it must be this thread's own when they follow each other.
    #[inline]
    pub(super) fn put(&mut self, at: u64, row: [f32; 3]) -> Result<()> {
        if self.first + self.rows.len() as u64 != at || self.rows.len() == BLOCK {
            self.flush()?;
            self.first = at;
        }
        self.rows.push(row);
        Ok(())
    }

    /// Writes what is left.
    pub(super) fn flush(&mut self) -> Result<()> {
        if !self.rows.is_empty() {
            self.file.write(self.first, &self.rows)?;
            self.rows.clear();
        }
        Ok(())
    }
}

/// Puts single rows, in ascending order, among others that are there already. No other thread
/// writes to the range at the same time.
pub(super) struct Patch<'a> {
    file: &'a RowFile,
    range: Range<u64>,
    first: u64,
    rows: Vec<[f32; 3]>,
}

impl<'a> Patch<'a> {
    pub(super) fn new(file: &'a RowFile) -> Patch<'a> {
        Patch {
            file,
            range: 0..0,
            first: 0,
            rows: Vec::with_capacity(BLOCK),
        }
    }

    /// Turns to another range of rows.
    pub(super) fn begin(&mut self, range: Range<u64>) -> Result<()> {
        self.flush()?;
        self.range = range.start..range.end.min(self.file.rows);
        Ok(())
    }

    /// Takes a row of the range, behind those taken before.
    #[inline]
    pub(super) fn put(&mut self, at: u64, row: [f32; 3]) -> Result<()> {
        if self.rows.is_empty() || at >= self.first + self.rows.len() as u64 {
            self.flush()?;
            let count = (self.range.end - at).min(BLOCK as u64);
            self.first = at;
            self.rows.resize(count as usize, [0.0; 3]);
            self.file.read(at, &mut self.rows)?;
        }
        self.rows[(at - self.first) as usize] = row;
        Ok(())
    }

    /// Writes the block that was changed last.
    pub(super) fn flush(&mut self) -> Result<()> {
        if !self.rows.is_empty() {
            self.file.write(self.first, &self.rows)?;
            self.rows.clear();
        }
        Ok(())
    }
}
