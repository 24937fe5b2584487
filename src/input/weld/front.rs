//! The first pass: corners in, block by block; distinct keys and block-local numbers out.
//!
//! Why a block is enough of the mesh: a block ends when it has seen as many distinct keys as
//! its table holds, so in a coherent mesh nearly all uses of a vertex fall in one block, and
//! what must be compared with other blocks is each distinct key once, not each corner. Where
//! a block ends cannot show in the result: equal keys of different blocks are joined later.
//!
//! Keys get ranks: those of the first block in order of first use, then those of the second,
//! and so on. So among equal positions the least rank is the first use in the whole mesh.
//!
//! Memory: `key + 8` bytes for each distinct key of a block, and two buffers. I/O: 4 bytes a
//! corner and 16 a block, written sequentially.

use super::bits::Key;
use super::stream::SeqWriter;
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::Result;

/// More distinct keys in a block gain nothing but cache misses.
pub(super) const MOST_KEYS: u64 = 1 << 18;
/// A slot without a key.
const EMPTY: u32 = u32::MAX;
/// Slots for each key: the table is at most half full.
const SLOTS: usize = 2;

/// The distinct keys of a block in order of first use, found by hash.
struct Table<K> {
    keys: Vec<K>,
    room: usize,
    slots: Vec<u32>,
    _lease: Lease,
}

impl<K: Key> Table<K> {
    /// A table for as many keys as `memory` bytes hold, a power of two.
    fn new(ws: &Workspace, memory: u64, room: Option<usize>) -> Result<Table<K>> {
        let each = (size_of::<K>() + SLOTS * size_of::<u32>()) as u64;
        let fits = (memory / each).clamp(16, MOST_KEYS);
        let room = room.unwrap_or(1 << fits.ilog2());
        let lease = ws
            .budget
            .lease("the hash table of a weld", room as u64 * each)?;
        Ok(Table {
            keys: Vec::with_capacity(room),
            room,
            slots: vec![EMPTY; (room * SLOTS).next_power_of_two()],
            _lease: lease,
        })
    }

    /// The number of `key` in this block, new if need be; `None` when the table is full.
    #[inline]
    fn number(&mut self, key: K) -> Option<u32> {
        let mask = self.slots.len() - 1;
        let mut i = key.hash() as usize & mask;
        loop {
            let slot = self.slots[i];
            if slot == EMPTY {
                if self.keys.len() == self.room {
                    return None;
                }
                let number = self.keys.len() as u32;
                self.slots[i] = number;
                self.keys.push(key);
                return Some(number);
            }
            if self.keys[slot as usize].same(key) {
                return Some(slot);
            }
            i = (i + 1) & mask;
        }
    }

    fn clear(&mut self) {
        self.keys.clear();
        self.slots.fill(EMPTY);
    }
}

/// Takes the distinct keys of a finished block, and the rank of the first of them.
pub trait Takes<K> {
    /// Takes them.
    ///
    /// # Errors
    /// What the taker's files and memory may say.
    fn block(&mut self, keys: &[K], first_rank: u64) -> Result<()>;
}

/// Takes corners in order.
pub struct Front<'a, K, T> {
    table: Table<K>,
    locals: SeqWriter<ScratchFile>,
    blocks: SeqWriter<ScratchFile>,
    taker: &'a mut T,
    in_block: u64,
    done: Fronted,
}

/// What the first pass found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fronted {
    /// Corners taken.
    pub corners: u64,
    /// Ranks given.
    pub ranks: u64,
    /// Blocks.
    pub blocks: u64,
    /// The most distinct keys of a block.
    pub widest: u64,
}

impl<'a, K: Key, T: Takes<K>> Front<'a, K, T> {
    /// A table of `memory` bytes (or for `room` keys), and two buffers.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`] for the scratch files.
    pub fn new(
        ws: &Workspace,
        memory: u64,
        room: Option<usize>,
        taker: &'a mut T,
    ) -> Result<Front<'a, K, T>> {
        let locals = ws.scratch.file("welded corners")?;
        let blocks = ws.scratch.file("blocks of a weld")?;
        Ok(Front {
            table: Table::new(ws, memory, room)?,
            locals: SeqWriter::new(&ws.budget, locals, 0)?,
            blocks: SeqWriter::new(&ws.budget, blocks, 0)?,
            taker,
            in_block: 0,
            done: Fronted::default(),
        })
    }

    /// Takes the key of the next corner.
    ///
    /// # Errors
    /// What the taker or the scratch files may say.
    #[inline]
    pub fn corner(&mut self, key: K) -> Result<()> {
        let number = match self.table.number(key) {
            Some(number) => number,
            None => {
                self.end_block()?;
                // An empty table has room for one key at least.
                self.table.number(key).unwrap_or(0)
            }
        };
        self.in_block += 1;
        self.locals.push(&number.to_le_bytes())
    }

    #[cold]
    fn end_block(&mut self) -> Result<()> {
        let keys = self.table.keys.len() as u64;
        if keys == 0 {
            return Ok(());
        }
        self.taker.block(&self.table.keys, self.done.ranks)?;
        self.blocks.push(&keys.to_le_bytes())?;
        self.blocks.push(&self.in_block.to_le_bytes())?;
        self.done.ranks += keys;
        self.done.corners += self.in_block;
        self.done.blocks += 1;
        self.done.widest = self.done.widest.max(keys);
        self.in_block = 0;
        self.table.clear();
        Ok(())
    }

    /// Ends the last block; gives the numbers in their blocks (u4 for each corner), and the
    /// blocks (distinct keys and corners, u8 each).
    ///
    /// # Errors
    /// As [`corner`](Front::corner).
    pub fn finish(mut self) -> Result<(ScratchFile, ScratchFile, Fronted)> {
        self.end_block()?;
        Ok((self.locals.finish()?.0, self.blocks.finish()?.0, self.done))
    }
}
