//! A relay: records wait at stops, which are passed in ascending order, and what is found at
//! one stop may send records on to later ones.
//!
//! ```text
//!   level 0   [ 0..16 ] [16..32 ] [32..48 ] ...   a slot holds the records of many stops
//!                  |  opened: poured into level 1
//!   level 1   [0] [1] [2] ... [15]                a slot of the last level holds one stop
//! ```
//!
//! Why no record is missed: a record for stop s goes to the coarsest level at which s and the
//! present stop lie in different slots. Slots before the present one are empty for good, and
//! a slot of a coarse level is poured into the next level when its first stop comes, at which
//! time that level is empty. So each record is moved once a level at most, and a stop has all
//! its records when it is opened, since records may only be sent to stops still to come.
//!
//! Memory: a block for each slot and two for reading, leased at the start; pages are touched as
//! slots get their first record. With `f` slots in each of `n` levels there may be `f^n` stops.
//! I/O: full blocks, each written and read once a level.

use super::Record;
use super::pool::{NONE, Pool, footer};
use crate::disk::{Lease, Workspace};
use crate::error::{Error, Result};
use std::ops::Range;

/// Blocks are not smaller than this while fewer slots in more levels will do.
const GOOD_BLOCK: u64 = 4 << 10;
/// Larger blocks gain nothing more.
const LARGE_BLOCK: u64 = 64 << 10;
/// What a slot holds besides its block.
const SLOT_BYTES: u64 = size_of::<Slot>() as u64;

/// Records of some stops: a chain of full blocks, and the last ones in memory.
#[derive(Clone, Copy)]
struct Slot {
    /// The block of the chain that was written last.
    head: u64,
    /// Where the slot's block lies in the arena; NONE before its first record.
    at: u64,
    /// Records in it.
    fill: u64,
}

/// How many levels and slots, and how large a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shape {
    levels: u32,
    /// Bits of a stop's number that a level looks at.
    bits: u32,
    slots: u64,
    block_bytes: u64,
}

impl Shape {
    /// For so many stops, within `memory` bytes when that is not absurdly little.
    fn within(stops: u64, memory: u64, record: u64) -> Shape {
        let all = 64 - stops.saturating_sub(1).leading_zeros();
        let mut levels = 1;
        loop {
            let bits = all.div_ceil(levels).max(1);
            let top = (stops.saturating_sub(1) >> ((levels - 1) * bits)) + 1;
            let slots = top.saturating_add((u64::from(levels) - 1) << bits);
            let share = memory / slots.saturating_add(2);
            if share >= GOOD_BLOCK + SLOT_BYTES || bits == 1 {
                let least = (footer_bytes(record) + record).max(256);
                let block = share.saturating_sub(SLOT_BYTES).min(LARGE_BLOCK).max(least);
                return Shape {
                    levels,
                    bits,
                    slots,
                    block_bytes: block / record * record,
                };
            }
            levels += 1;
        }
    }

    fn bytes(&self) -> u64 {
        self.slots * (self.block_bytes + SLOT_BYTES) + 2 * self.block_bytes
    }
}

fn footer_bytes(record: u64) -> u64 {
    8u64.div_ceil(record) * record
}

/// A place among the records of the present stop, for reading them without taking them.
pub struct Cursor {
    /// The next block of the chain; `None` before the records in memory.
    next: Option<u64>,
}

/// Records on their way to later stops. One thread sends and reads.
///
/// ```
/// # use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
/// # use cornermill::shuffle::{Record, Relay};
/// # use std::sync::Arc;
/// #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
/// #[repr(transparent)]
/// struct Number(u64);
/// impl Record for Number {
///     const LEVELS: usize = 1;
///     fn key(&self, _level: usize) -> u64 {
///         self.0
///     }
/// }
///
/// # let io = Arc::new(Counters::default());
/// # let ws = Workspace {
/// #     budget: Budget::new(1 << 20),
/// #     scratch: Scratch::new(&[std::env::temp_dir()], u64::MAX, &io)?,
/// #     io,
/// #     workers: Workers::new(1)?,
/// #     progress: Arc::new(NoProgress),
/// # };
/// // The sieve of Eratosthenes: each prime sends its multiples on, sixteen numbers a stop.
/// let mut relay = Relay::<Number>::new(&ws, "multiples", 0..160, 4, 64 << 10)?;
/// let mut block = relay.block();
/// let mut primes = Vec::new();
/// while let Some(numbers) = relay.advance()? {
///     let mut prime = [true; 16];
///     loop {
///         let n = relay.take(&mut block)?;
///         if n == 0 {
///             break;
///         }
///         for number in &block[..n] {
///             prime[(number.0 - numbers.start) as usize] = false;
///         }
///     }
///     for p in numbers.clone().filter(|&p| p > 1) {
///         if prime[(p - numbers.start) as usize] {
///             primes.push(p);
///             for multiple in (2 * p..160).step_by(p as usize) {
///                 if multiple < numbers.end {
///                     prime[(multiple - numbers.start) as usize] = false;
///                 } else {
///                     relay.push(Number(multiple))?;
///                 }
///             }
///         }
///     }
/// }
/// assert_eq!((primes.len(), primes.last()), (37, Some(&157)));
/// # Ok::<(), cornermill::Error>(())
/// ```
pub struct Relay<R> {
    what: &'static str,
    keys: Range<u64>,
    /// A stop has 2^shift keys.
    shift: u32,
    stops: u64,
    shape: Shape,
    /// The stop after the present one; nothing lies before it but the present stop's records.
    next: u64,
    slots: Vec<Slot>,
    arena: Vec<R>,
    /// Records of a full block, without its footer.
    per: usize,
    pool: Pool,
    /// A block on its way from level to level.
    pour: Vec<R>,
    sent: u64,
    poured: u64,
    _lease: Lease,
}

impl<R: Record> Relay<R> {
    /// A relay named `what` for records whose level-0 keys lie in `keys`, 2^`shift` keys a stop,
    /// that leases about `memory` bytes at most.
    ///
    /// # Errors
    /// [`Error::Budget`].
    pub fn new(
        ws: &Workspace,
        what: &'static str,
        keys: Range<u64>,
        shift: u32,
        memory: u64,
    ) -> Result<Relay<R>> {
        const { assert!(R::LEVELS > 0 && size_of::<R>() > 0) };
        let stops = (keys.end.saturating_sub(keys.start)).div_ceil(1 << shift);
        let record = size_of::<R>() as u64;
        let shape = Shape::within(stops, memory, record);
        let lease = ws.budget.lease(what, shape.bytes())?;
        let block = (shape.block_bytes / record) as usize;
        let empty = Slot {
            head: NONE,
            at: NONE,
            fill: 0,
        };
        Ok(Relay {
            what,
            keys,
            shift,
            stops,
            shape,
            next: 0,
            slots: vec![empty; shape.slots as usize],
            arena: Vec::with_capacity(shape.slots as usize * block),
            per: block - footer::<R>(),
            pool: Pool::new(&ws.scratch, what, shape.block_bytes),
            pour: Vec::new(),
            sent: 0,
            poured: 0,
            _lease: lease,
        })
    }

    /// A block to read records into; its memory is the relay's.
    pub fn block(&self) -> Vec<R> {
        vec![R::zeroed(); self.per + footer::<R>()]
    }

    /// Sends a record to its stop.
    ///
    /// # Errors
    /// [`Error::Internal`] when its key is out of range, or its stop was opened before; what the
    /// write of a full block may say.
    #[inline]
    pub fn push(&mut self, record: R) -> Result<()> {
        let key = record.key(0);
        let stop = key.wrapping_sub(self.keys.start) >> self.shift;
        if stop < self.next || key < self.keys.start || key >= self.keys.end {
            return Err(self.misled(key));
        }
        self.sent += 1;
        self.put(stop, record)
    }

    #[cold]
    fn misled(&self, key: u64) -> Error {
        let start = self.keys.start + (self.next << self.shift);
        Error::Internal(format!(
            "{}: key {key} is outside of {start}..{}, which is still to come",
            self.what, self.keys.end
        ))
    }

    /// The slot where records of a stop wait now.
    #[inline]
    fn slot(&self, stop: u64) -> usize {
        let Shape { levels, bits, .. } = self.shape;
        if levels == 1 {
            return stop as usize;
        }
        // Before the first stop all slots of the coarsest level are ahead.
        let differs = match self.next.checked_sub(1) {
            Some(now) => 63 - (stop ^ now | 1).leading_zeros(),
            None => (levels - 1) * bits,
        };
        // The level whose digit has the highest bit that differs, counted from the finest.
        let up = (differs / bits).min(levels - 1);
        self.slot_at(stop, up)
    }

    /// The slot of a stop at the level `up` above the finest.
    #[inline]
    fn slot_at(&self, stop: u64, up: u32) -> usize {
        let Shape { levels, bits, .. } = self.shape;
        let digit = stop >> (up * bits);
        if up == levels - 1 {
            // The coarsest level has as many slots as it needs, and lies last.
            return (u64::from(up) << bits) as usize + digit as usize;
        }
        (u64::from(up) << bits) as usize + (digit & ((1 << bits) - 1)) as usize
    }

    #[inline]
    fn put(&mut self, stop: u64, record: R) -> Result<()> {
        let slot = self.slot(stop);
        self.put_in(slot, record)
    }

    #[inline]
    fn put_in(&mut self, i: usize, record: R) -> Result<()> {
        if self.slots[i].at == NONE || self.slots[i].fill == self.per as u64 {
            self.make_room(i)?;
        }
        let slot = &mut self.slots[i];
        self.arena[(slot.at + slot.fill) as usize] = record;
        slot.fill += 1;
        Ok(())
    }

    /// Gives a slot its block, or empties the full one.
    #[cold]
    fn make_room(&mut self, i: usize) -> Result<()> {
        let block = self.per + footer::<R>();
        let slot = &mut self.slots[i];
        if slot.at == NONE {
            slot.at = self.arena.len() as u64;
            // The arena's capacity holds a block for each slot, so this never moves it.
            self.arena.resize(self.arena.len() + block, R::zeroed());
            return Ok(());
        }
        let records = &mut self.arena[slot.at as usize..][..block];
        slot.head = self.pool.write(records, slot.head)?;
        slot.fill = 0;
        Ok(())
    }

    /// Opens the next stop and gives its keys; `None` behind the last.
    ///
    /// # Errors
    /// [`Error::Internal`] when records of the stop before were not taken; what moving records
    /// from level to level may say.
    pub fn advance(&mut self) -> Result<Option<Range<u64>>> {
        if let Some(now) = self.next.checked_sub(1)
            && !self.is_empty(self.slot_at(now, 0))
        {
            let what = format!("{}: stop {now} was left with records", self.what);
            return Err(Error::Internal(what));
        }
        if self.next == self.stops {
            return Ok(None);
        }
        let stop = self.next;
        self.next += 1;
        let Shape { levels, bits, .. } = self.shape;
        for up in (1..levels).rev() {
            if stop.trailing_zeros() >= up * bits {
                self.pour(self.slot_at(stop, up), up - 1)?;
            }
        }
        let start = self.keys.start + (stop << self.shift);
        let end = self.keys.end - start;
        Ok(Some(start..start + end.min(1 << self.shift)))
    }

    /// Moves the records of a slot to the level `up` above the finest.
    fn pour(&mut self, from: usize, up: u32) -> Result<()> {
        let mut block = std::mem::take(&mut self.pour);
        block.resize(self.per + footer::<R>(), R::zeroed());
        loop {
            let n = self.take_from(from, &mut block)?;
            if n == 0 {
                break;
            }
            self.poured += n as u64;
            for record in &block[..n] {
                let stop = (record.key(0) - self.keys.start) >> self.shift;
                self.put_in(self.slot_at(stop, up), *record)?;
            }
        }
        self.pour = block;
        Ok(())
    }

    fn is_empty(&self, i: usize) -> bool {
        self.slots[i].fill == 0 && self.slots[i].head == NONE
    }

    /// Takes some records of the present stop, in no order; 0 when none is left.
    ///
    /// # Errors
    /// [`Error::Internal`] before the first stop; what reading may say.
    pub fn take(&mut self, block: &mut [R]) -> Result<usize> {
        let slot = self.present()?;
        self.take_from(slot, block)
    }

    fn present(&self) -> Result<usize> {
        match self.next.checked_sub(1) {
            Some(now) => Ok(self.slot_at(now, 0)),
            None => Err(Error::Internal(format!("{}: no stop is open", self.what))),
        }
    }

    fn take_from(&mut self, i: usize, block: &mut [R]) -> Result<usize> {
        let slot = &mut self.slots[i];
        let n = slot.fill as usize;
        if n > 0 {
            block[..n].copy_from_slice(&self.arena[slot.at as usize..][..n]);
            slot.fill = 0;
            return Ok(n);
        }
        if slot.head == NONE {
            return Ok(0);
        }
        let head = slot.head;
        slot.head = self.pool.read(block, head)?;
        self.pool.give::<R>(head, block.len())?;
        Ok(self.per)
    }

    /// A cursor before the records of the present stop.
    pub fn cursor(&self) -> Cursor {
        Cursor { next: None }
    }

    /// Reads some records of the present stop and leaves them there; 0 behind the last. No record
    /// may be taken meanwhile.
    ///
    /// # Errors
    /// As [`take`](Relay::take).
    pub fn read(&self, cursor: &mut Cursor, block: &mut [R]) -> Result<usize> {
        let slot = self.slots[self.present()?];
        let at = match cursor.next {
            Some(at) => at,
            None => {
                cursor.next = Some(slot.head);
                let n = slot.fill as usize;
                if n > 0 {
                    block[..n].copy_from_slice(&self.arena[slot.at as usize..][..n]);
                    return Ok(n);
                }
                slot.head
            }
        };
        if at == NONE {
            return Ok(0);
        }
        cursor.next = Some(self.pool.read(block, at)?);
        Ok(self.per)
    }

    /// Number of stops.
    pub fn stops(&self) -> u64 {
        self.stops
    }

    /// A stop has 2^shift keys.
    pub fn shift(&self) -> u32 {
        self.shift
    }

    /// Records that were sent.
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// Records that were moved from a level to the next, each time counted.
    pub fn poured(&self) -> u64 {
        self.poured
    }

    /// The most records that [`take`](Relay::take) and [`read`](Relay::read) give at once.
    pub fn per_block(&self) -> usize {
        self.per
    }
}

#[cfg(test)]
#[path = "relay_tests.rs"]
mod tests;
