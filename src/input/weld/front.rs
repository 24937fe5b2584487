//! The first pass: keys of corners in; distinct keys with their first corner out, and for each
//! other corner the way back to it.
//!
//! A *window* is a run of corners of a fixed power of two. A *block* is a run of corners within
//! one window whose distinct keys its hash table holds. Corners of a block with the same key
//! are told apart here: the first goes on with its key, and each other says how many corners
//! before it the first is. Zero says that a corner is the first of its block, and is what a
//! file reads as where nothing was written.
//!
//! Why a block is enough of the mesh: in a coherent mesh nearly all uses of a vertex lie near
//! each other, so what must be compared with other blocks is each distinct key about once. In
//! a random order nearly all corners of a block are distinct and the table only costs; so each
//! block begins with a trial, and when that finds few repeats, all its corners go on with
//! their keys and nothing is written for it. Where blocks begin and end cannot show in the
//! result: equal keys of different blocks are joined later, whatever blocks there are.
//!
//! Memory: `key + rank + 8` bytes for each distinct key of a block, and a buffer. I/O: at most
//! 4 bytes a corner, written sequentially within a window.

use super::bits::Key;
use super::cut::Cut;
use crate::corner::Index;
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::{Error, Result};

/// Slots for each key: the table is at most half full.
const SLOTS: usize = 2;
/// A slot without a key.
const EMPTY: u32 = u32::MAX;
/// Keys that are looked at before the table.
const RECENT: usize = 4;
/// Corners of a trial.
const TRIAL: u64 = 1 << 13;
/// Keys that a block without a table hands on at a time.
const PIECE: u64 = 1 << 12;

/// A key with the corner that has it.
#[derive(Clone, Copy)]
pub struct Keyed<K, R> {
    /// The key.
    pub key: K,
    /// The corner.
    pub rank: R,
}

/// The distinct keys of a block in order of first use, found by hash.
struct Table<K, R> {
    keys: Vec<Keyed<K, R>>,
    room: usize,
    slots: Vec<u32>,
    /// Keys of the last corners that were told apart by hash, and which of these is oldest.
    recent: [u32; RECENT],
    oldest: usize,
}

impl<K: Key, R: Index> Table<K, R> {
    fn new(room: usize, slots: usize) -> Table<K, R> {
        Table {
            keys: Vec::with_capacity(room),
            room,
            slots: vec![EMPTY; slots],
            recent: [EMPTY; RECENT],
            oldest: 0,
        }
    }

    /// The first corner of the block with this key, `rank` when there was none.
    ///
    /// In a coherent mesh two of three corners are in the triangle before, too.
    #[inline]
    fn first(&mut self, key: K, rank: R) -> R {
        for number in self.recent {
            if let Some(known) = self.keys.get(number as usize)
                && known.key.same(key)
            {
                return known.rank;
            }
        }
        let number = self.find(key, rank);
        self.recent[self.oldest] = number;
        self.oldest = (self.oldest + 1) % RECENT;
        self.keys[number as usize].rank
    }

    /// The number of the key in the block, new if need be.
    #[inline]
    fn find(&mut self, key: K, rank: R) -> u32 {
        let mask = self.slots.len() - 1;
        let mut i = key.hash() as usize & mask;
        loop {
            let slot = self.slots[i];
            if slot == EMPTY {
                let number = self.keys.len() as u32;
                self.slots[i] = number;
                self.keys.push(Keyed { key, rank });
                return number;
            }
            if self.keys[slot as usize].key.same(key) {
                return slot;
            }
            i = (i + 1) & mask;
        }
    }

    /// Forgets by which slots the keys are found.
    fn forget(&mut self) {
        self.slots.fill(EMPTY);
        self.recent = [EMPTY; RECENT];
    }
}

/// Takes the distinct keys of blocks.
pub trait Takes<K, R> {
    /// Takes some of them.
    ///
    /// # Errors
    /// What the taker's files and memory may say.
    fn keys(&mut self, keys: &[Keyed<K, R>]) -> Result<()>;
}

/// What becomes of the corners at hand.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// Through the table, and whether that pays is not known yet.
    Trial,
    /// Through the table.
    Table,
    /// Straight on.
    Plain,
}

/// What came and what went on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counted {
    /// Corners.
    pub corners: u64,
    /// Keys that were handed on.
    pub keys: u64,
}

/// Takes the keys of corners in order, from any corner on.
pub struct Front<'a, K, R, T> {
    table: Table<K, R>,
    /// Where the ways back go, 4 bytes a corner.
    backs: &'a ScratchFile,
    /// Ways back of the corners before `next`.
    back: Vec<u32>,
    taker: T,
    window: u64,
    mode: Mode,
    /// The first corner of the block.
    begin: u64,
    next: u64,
    counted: Counted,
    /// The corner before which something is to be done; all room suffices up to there.
    event: u64,
    _lease: Lease,
}

impl<'a, K: Key, R: Index, T: Takes<K, R>> Front<'a, K, R, T> {
    /// A front that takes an eighth of the memory of `cut`, for one of its threads.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(
        ws: &Workspace,
        cut: &Cut,
        room: Option<usize>,
        backs: &'a ScratchFile,
        taker: T,
    ) -> Result<Front<'a, K, R, T>> {
        let each = (size_of::<Keyed<K, R>>() + SLOTS * size_of::<u32>()) as u64;
        let fits = 1 << (cut.each(10) / each).max(16).ilog2();
        // Blocks that would need more have too few repeats to gain by a table.
        let room = room.unwrap_or(fits.min(cut.window / 4).max(16) as usize);
        let back = (cut.each(40) / 4).clamp(64, 1 << 16) as usize;
        let slots = (room * SLOTS).next_power_of_two();
        let bytes = room * size_of::<Keyed<K, R>>() + 4 * (slots + back);
        let lease = ws.budget.lease("the hash table of a weld", bytes as u64)?;
        Ok(Front {
            table: Table::new(room, slots),
            backs,
            back: Vec::with_capacity(back),
            taker,
            window: cut.window,
            mode: Mode::Trial,
            begin: 0,
            next: 0,
            counted: Counted::default(),
            event: 0,
            _lease: lease,
        })
    }

    /// Goes on with this corner, after [`end`](Front::end) when others were taken before.
    pub fn begin(&mut self, corner: u64) {
        (self.begin, self.next, self.event) = (corner, corner, corner);
        self.mode = Mode::Trial;
    }

    /// What took the keys, after [`end`](Front::end), and how many there were.
    pub fn into_taker(self) -> (T, Counted) {
        (self.taker, self.counted)
    }

    /// The corner that comes next.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Takes the key of the next corner.
    ///
    /// # Errors
    /// What the taker or the scratch file may say.
    #[inline]
    pub fn corner(&mut self, key: K) -> Result<()> {
        if self.next == self.event {
            self.turn()?;
        }
        let rank = R::of(self.next);
        if self.mode == Mode::Plain {
            self.table.keys.push(Keyed { key, rank });
        } else {
            let first = self.table.first(key, rank);
            self.back.push((self.next - first.wide()) as u32);
        }
        self.next += 1;
        self.counted.corners += 1;
        Ok(())
    }

    /// Does what is due before the next corner, and finds out when something will be again.
    #[cold]
    fn turn(&mut self) -> Result<()> {
        let full = self.table.keys.len() == self.table.room;
        let trial = self.begin + TRIAL;
        if self.next.is_multiple_of(self.window) || (full && self.mode != Mode::Plain) {
            self.end()?;
            self.begin(self.next);
        } else if self.mode == Mode::Trial && self.next == trial {
            let few = 4 * self.table.keys.len() as u64 > 3 * TRIAL;
            // All that is known of the corners so far must still be here, and fit as keys.
            let here = self.back.len() as u64 == TRIAL && self.table.room as u64 >= TRIAL;
            self.mode = Mode::Table;
            if few && here {
                self.make_plain();
            }
        }
        if self.back.len() == self.back.capacity() {
            self.flush_back()?;
        }
        if self.mode == Mode::Plain && !self.table.keys.is_empty() {
            self.hand_on()?;
        }
        let room = (self.table.room - self.table.keys.len()) as u64;
        let room = match self.mode {
            Mode::Plain => room.min(PIECE),
            _ => room.min((self.back.capacity() - self.back.len()) as u64),
        };
        let window_end = (self.next / self.window + 1) * self.window;
        self.event = window_end.min(self.next + room);
        let trial = self.begin + TRIAL;
        if self.mode == Mode::Trial && self.next < trial {
            self.event = self.event.min(trial);
        }
        if R::narrow(self.event).is_none() {
            return Err(Error::Internal(format!(
                "a weld of more than {} corners was not foreseen",
                self.next
            )));
        }
        Ok(())
    }

    /// Turns the block into one whose corners all go on: each repeat with the key that it
    /// repeats, whose bits are those of an earlier use.
    fn make_plain(&mut self) {
        let keys = &mut self.table.keys;
        let firsts = keys.len();
        for (i, &back) in (0..).zip(&self.back) {
            if back > 0 {
                let rank = R::of(self.begin + i - u64::from(back));
                let at = keys[..firsts].partition_point(|k| k.rank < rank);
                let (key, rank) = (keys[at].key, R::of(self.begin + i));
                keys.push(Keyed { key, rank });
            }
        }
        self.back.clear();
        self.table.forget();
        self.mode = Mode::Plain;
    }

    /// Ends the block.
    ///
    /// # Errors
    /// As [`corner`](Front::corner).
    pub fn end(&mut self) -> Result<()> {
        self.hand_on()?;
        if self.mode != Mode::Plain {
            self.table.forget();
        }
        self.flush_back()
    }

    fn hand_on(&mut self) -> Result<()> {
        self.counted.keys += self.table.keys.len() as u64;
        self.taker.keys(&self.table.keys)?;
        self.table.keys.clear();
        Ok(())
    }

    fn flush_back(&mut self) -> Result<()> {
        if !self.back.is_empty() {
            let at = 4 * (self.next - self.back.len() as u64);
            self.backs.write_at(bytemuck::cast_slice(&self.back), at)?;
            self.back.clear();
        }
        Ok(())
    }
}
