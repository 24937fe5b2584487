//! A list of ids that grows at its end and is read from either side: in memory while it fits,
//! on scratch from then on.
//!
//! Entries wait in a *tail* in memory. When the tail is full, all of it is appended to a scratch
//! file, and what lies there is read through a *block*, which holds the entries from the one
//! asked for (or up to it, for a reader that goes down). Readers go along the list, so each block
//! is used whole. Whatever the sizes of tail and block, the entries are the same.
//!
//! Memory: what [`Log::new`] leases, [`LEAST`] at least. I/O: nothing while the tail holds all;
//! else each entry is written once, and read once for each time the list is read.

use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::Result;
use crate::table::array::Width;

/// Bytes of a block at least, and of a tail.
const BLOCK: u64 = 4 << 10;
/// Bytes of a block at most: more makes no reader faster.
const LARGE: u64 = 256 << 10;
/// The least that a log takes.
pub(super) const LEAST: u64 = 2 * BLOCK;

/// Where a reader goes to after this entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Toward {
    End,
    Start,
}

pub(super) struct Log<'a> {
    ws: &'a Workspace,
    what: &'static str,
    width: Width,
    /// The last entries, at most `room` bytes of them.
    tail: Vec<u8>,
    room: usize,
    /// The entries before the tail.
    file: Option<ScratchFile>,
    filed: u64,
    /// Entries of the file from number `first` on.
    block: Vec<u8>,
    first: u64,
    size: u64,
    _lease: Lease,
}

impl<'a> Log<'a> {
    /// For up to `entries` ids; takes at most half of what the budget has free, if that is more
    /// than [`LEAST`].
    pub(super) fn new(
        ws: &'a Workspace,
        what: &'static str,
        width: Width,
        entries: u64,
    ) -> Result<Log<'a>> {
        let all = entries.saturating_mul(width.bytes() as u64);
        let share = (ws.budget.free() / 2).max(LEAST);
        let block = (share / 8).clamp(BLOCK, LARGE) / 8 * 8;
        // A list that fits whole leaves its block unused; a tail holds whole entries.
        let room = (share - block).min(all.max(BLOCK)) / 8 * 8;
        let lease = ws.budget.lease(what, block + room)?;
        Ok(Log {
            ws,
            what,
            width,
            tail: Vec::with_capacity(room as usize),
            room: room as usize,
            file: None,
            filed: 0,
            block: Vec::with_capacity(block as usize),
            first: 0,
            size: block / width.bytes() as u64,
            _lease: lease,
        })
    }

    /// Number of entries.
    pub(super) fn len(&self) -> u64 {
        self.filed + (self.tail.len() / self.width.bytes()) as u64
    }

    /// Appends an id below NONE of the width, or `u64::MAX`, which is NONE.
    pub(super) fn push(&mut self, id: u64) -> Result<()> {
        if self.tail.len() == self.room {
            if self.file.is_none() {
                self.file = Some(self.ws.scratch.file(self.what)?);
            }
            if let Some(file) = &self.file {
                file.append(&self.tail)?;
            }
            self.filed = self.len();
            self.tail.clear();
        }
        self.width.put(&mut self.tail, id);
        Ok(())
    }

    /// Entry number i, below [`len`](Log::len); the next one asked for lies toward there.
    pub(super) fn get(&mut self, i: u64, toward: Toward) -> Result<u64> {
        if i >= self.filed {
            return Ok(self.width.get(&self.tail, (i - self.filed) as usize));
        }
        let width = self.width.bytes();
        let held = (self.block.len() / width) as u64;
        if i < self.first || i >= self.first + held {
            self.first = match toward {
                Toward::End => i,
                Toward::Start => (i + 1).saturating_sub(self.size),
            };
            let count = self.size.min(self.filed - self.first);
            self.block.resize(count as usize * width, 0);
            if let Some(file) = &self.file {
                file.read_at(&mut self.block, self.first * width as u64)?;
            }
        }
        Ok(self.width.get(&self.block, (i - self.first) as usize))
    }
}
