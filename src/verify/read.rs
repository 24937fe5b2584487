//! Arrays of a mesh folder, read through buffers.
//!
//! Ids come out as u64 with NONE as the all-ones value, whatever their width. Every read is of
//! a stated range that the caller has checked against the array's length.
//!
//! Memory: the buffers that callers hand in or have leased. I/O: what is asked for.

use crate::disk::{DataFile, Lease, Workspace};
use crate::error::Result;
use crate::folder::npy::DATA_START;
use bytemuck::Pod;

/// An array of ids.
pub(super) struct Ids {
    pub(super) file: DataFile,
    pub(super) wide: bool,
    /// Number of ids.
    pub(super) len: u64,
}

impl Ids {
    /// Bytes of an id.
    pub(super) fn width(&self) -> u64 {
        if self.wide { 8 } else { 4 }
    }

    /// Fills `out` with the ids from number `first` on; `raw` is working space.
    pub(super) fn read(&self, first: u64, out: &mut [u64], raw: &mut Vec<u8>) -> Result<()> {
        let width = self.width() as usize;
        raw.resize(out.len() * width, 0);
        self.file.read_at(raw, DATA_START + first * self.width())?;
        if self.wide {
            for (id, bytes) in out.iter_mut().zip(raw.as_chunks::<8>().0) {
                *id = u64::from_le_bytes(*bytes);
            }
        } else {
            for (id, bytes) in out.iter_mut().zip(raw.as_chunks::<4>().0) {
                let narrow = u32::from_le_bytes(*bytes);
                *id = if narrow == u32::MAX {
                    u64::MAX
                } else {
                    u64::from(narrow)
                };
            }
        }
        Ok(())
    }

    /// A single id.
    pub(super) fn one(&self, at: u64) -> Result<u64> {
        let mut id = [0];
        self.read(at, &mut id, &mut Vec::new())?;
        Ok(id[0])
    }

    /// Number of the first id that is not below `bound`, in an ascending array.
    pub(super) fn lower_bound(&self, bound: u64) -> Result<u64> {
        let (mut from, mut to) = (0, self.len);
        while from < to {
            let middle = from + (to - from) / 2;
            if self.one(middle)? < bound {
                from = middle + 1;
            } else {
                to = middle;
            }
        }
        Ok(from)
    }
}

/// Reads ids at places that only go up, through one buffer.
pub(super) struct IdReader<'a> {
    ids: &'a Ids,
    start: u64,
    buf: Vec<u64>,
    raw: Vec<u8>,
    cap: usize,
    _lease: Lease,
}

impl<'a> IdReader<'a> {
    /// A reader with about `bytes` of buffers.
    pub(super) fn new(ws: &Workspace, ids: &'a Ids, bytes: u64) -> Result<IdReader<'a>> {
        let lease = ws.budget.lease("reading ids", bytes)?;
        Ok(IdReader {
            ids,
            start: 0,
            buf: Vec::new(),
            raw: Vec::new(),
            cap: (bytes as usize / 16).max(1),
            _lease: lease,
        })
    }

    /// The id at place `at`, none beyond the end. Going back costs a new read.
    pub(super) fn get(&mut self, at: u64) -> Result<Option<u64>> {
        if at >= self.ids.len {
            return Ok(None);
        }
        if at < self.start || at >= self.start + self.buf.len() as u64 {
            let n = ((self.ids.len - at) as usize).min(self.cap);
            self.buf.resize(n, 0);
            self.ids.read(at, &mut self.buf, &mut self.raw)?;
            self.start = at;
        }
        Ok(Some(self.buf[(at - self.start) as usize]))
    }
}

/// Reads the rows of a structured array in order, through one buffer.
pub(super) struct Rows<'a, R> {
    file: &'a DataFile,
    len: u64,
    next: u64,
    buf: Vec<R>,
    at: usize,
    cap: usize,
    _lease: Lease,
}

impl<'a, R: Pod> Rows<'a, R> {
    /// A reader of `len` rows with a buffer of about `bytes`.
    pub(super) fn new(
        ws: &Workspace,
        file: &'a DataFile,
        len: u64,
        bytes: u64,
    ) -> Result<Rows<'a, R>> {
        Ok(Rows {
            file,
            len,
            next: 0,
            buf: Vec::new(),
            at: 0,
            cap: (bytes as usize / size_of::<R>()).max(1),
            _lease: ws.budget.lease("reading rows", bytes)?,
        })
    }

    /// The next row and its number; none at the end.
    pub(super) fn peek(&mut self) -> Result<Option<(u64, R)>> {
        if self.at == self.buf.len() {
            let n = ((self.len - self.next) as usize).min(self.cap);
            self.buf.resize(n, R::zeroed());
            let at = DATA_START + self.next * size_of::<R>() as u64;
            self.file
                .read_at(bytemuck::cast_slice_mut(&mut self.buf), at)?;
            self.next += n as u64;
            self.at = 0;
        }
        let number = self.next - (self.buf.len() - self.at) as u64;
        Ok(self.buf.get(self.at).map(|row| (number, *row)))
    }

    /// As [`peek`](Rows::peek), and goes on to the row after.
    pub(super) fn next(&mut self) -> Result<Option<(u64, R)>> {
        let row = self.peek()?;
        self.at += usize::from(row.is_some());
        Ok(row)
    }
}
