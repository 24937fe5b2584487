//! What a finished writer hands in: runs in scratch files, or the few records that it kept.
//!
//! Memory: what the writer leased, less its buffers. I/O: none.

use super::Record;
use super::runs::Runs;
use crate::disk::Lease;
use crate::disk::journal::{Pen, Reader};
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// What a writer handed in.
pub(super) enum Held<R> {
    /// Runs in scratch files.
    Spilled { runs: Runs, _lease: Lease },
    /// Records in memory.
    Kept { records: Resident<R>, _lease: Lease },
}

/// Consecutive records of one bucket in kept memory.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Kept {
    pub bucket: u32,
    pub records: u32,
    /// Index of the first.
    pub at: usize,
}

/// Records that a writer kept in memory, with their places by bucket.
pub(super) struct Resident<R> {
    records: Vec<R>,
    parts: Vec<Kept>,
}

impl<R> Resident<R> {
    /// `parts` ascend by bucket, one for each that has records.
    pub(super) fn new(records: Vec<R>, parts: Vec<Kept>) -> Resident<R> {
        Resident { records, parts }
    }

    /// Number of records.
    pub(super) fn count(&self) -> u64 {
        self.records.len() as u64
    }

    /// The records of each bucket that has some.
    pub(super) fn all(&self) -> impl Iterator<Item = (usize, &[R])> {
        self.parts.iter().map(|part| {
            let records = &self.records[part.at..part.at + part.records as usize];
            (part.bucket as usize, records)
        })
    }

    /// The records of a bucket.
    pub(super) fn of(&self, bucket: u64) -> &[R] {
        let found = self
            .parts
            .binary_search_by_key(&bucket, |k| k.bucket.into());
        found.map_or(&[], |i| {
            let Kept { at, records, .. } = self.parts[i];
            &self.records[at..at + records as usize]
        })
    }
}

impl<R: Record> Held<R> {
    /// Writes it down.
    pub(super) fn keep(&self, to: &mut Pen) -> Result<()> {
        match self {
            Held::Spilled { runs, .. } => {
                to.number(0)?;
                to.number(runs.bytes())?;
                runs.keep(to)
            }
            Held::Kept { records, _lease } => {
                to.number(1)?;
                to.number(_lease.bytes())?;
                to.list(&records.records)?;
                to.list(&records.parts)
            }
        }
    }

    /// Reads it back.
    pub(super) fn restore(from: &mut Reader) -> Result<Held<R>> {
        let (kept, bytes) = (from.number()? == 1, from.number()?);
        let lease = from.budget.lease("what a shuffle holds", bytes)?;
        Ok(if kept {
            Held::Kept {
                records: Resident::new(from.list()?, from.list()?),
                _lease: lease,
            }
        } else {
            Held::Spilled {
                runs: Runs::restore(from)?,
                _lease: lease,
            }
        })
    }
}
