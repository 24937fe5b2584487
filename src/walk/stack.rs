//! A stack of ids of which the lower part lies on scratch when it has grown deep.
//!
//! The upper part is in memory. When that is full, its lower half is written behind what lies in
//! the file; when it is empty, the last of the file comes back. So between a write and a read
//! lie at least half a buffer of pushes or pops, and whatever its size the ids are the same.
//!
//! Memory: what [`Stack::new`] leases, [`LEAST`] at least. I/O: nothing while all fits; else at
//! most a write and a read of each id for each time that the stack grows over and falls below it.

use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::Result;

/// The least that a stack takes, in bytes.
pub(super) const LEAST: u64 = 4 << 10;
/// The most.
const MOST: u64 = 1 << 20;

pub(super) struct Stack<'a> {
    ws: &'a Workspace,
    what: &'static str,
    top: Vec<u64>,
    room: usize,
    file: Option<ScratchFile>,
    filed: u64,
    _lease: Lease,
}

impl<'a> Stack<'a> {
    pub(super) fn new(ws: &'a Workspace, what: &'static str) -> Result<Stack<'a>> {
        let bytes = (ws.budget.free() / 2).clamp(LEAST, MOST) / 16 * 16;
        let lease = ws.budget.lease(what, bytes)?;
        let room = bytes as usize / 8;
        Ok(Stack {
            ws,
            what,
            top: Vec::with_capacity(room),
            room,
            file: None,
            filed: 0,
            _lease: lease,
        })
    }

    pub(super) fn push(&mut self, id: u64) -> Result<()> {
        if self.top.len() == self.room {
            let half = self.room / 2;
            if self.file.is_none() {
                self.file = Some(self.ws.scratch.file(self.what)?);
            }
            if let Some(file) = &self.file {
                file.write_at(bytemuck::cast_slice(&self.top[..half]), 8 * self.filed)?;
            }
            self.filed += half as u64;
            self.top.drain(..half);
        }
        self.top.push(id);
        Ok(())
    }

    pub(super) fn pop(&mut self) -> Result<Option<u64>> {
        if self.top.is_empty() && self.filed > 0 {
            // What was written is a whole number of halves.
            let half = self.room / 2;
            self.filed -= half as u64;
            self.top.resize(half, 0);
            if let Some(file) = &self.file {
                let bytes = bytemuck::cast_slice_mut(&mut self.top);
                file.read_at(bytes, 8 * self.filed)?;
            }
        }
        Ok(self.top.pop())
    }
}
