//! The second pass: bucket by bucket, which positions are equal, and whose use is the first.
//!
//! Why that is exact: equal positions have equal hashes, so all of a group lie in one bucket;
//! and a rank is the corner itself, so the least rank of a group is its first use in the whole
//! mesh, in whatever order its places arrive.
//!
//! A bucket that fits is grouped by a hash table of places. One that does not is sorted out of
//! core, by hash, position and rank, so that groups come one after another, the first use at
//! the head of each: a position of any number of uses passes in constant memory.
//!
//! Memory: for each thread a quarter of its share, at most 40 bytes for each place of a bucket;
//! buffers of two shuffles; a sorter when some bucket does not fit. I/O: places read once (once
//! more for each split of the sorter), what is sent written once.

use super::bits::{Bits, First, Key, Pair, Place, same};
use super::cut::Cut;
use crate::corner::Index;
use crate::disk::{Lease, Workspace};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Shuffle, Sorter, Writer};

/// No place.
const EMPTY: u32 = u32::MAX;

/// What the groups are: first uses, sent to their corners, and for each other place the rank of
/// its first use.
pub struct Groups<B, R> {
    /// Positions at first uses.
    pub firsts: Buckets<First<B, R>>,
    /// All others, sent to their own corners with the first one's rank, or the other way round.
    pub others: Buckets<Pair<R>>,
}

/// Groups the places of all blocks. `by_first` sends the others to their first uses.
///
/// # Errors
/// As [`super::begin`].
pub fn group<B: Bits, R: Index>(
    ws: &Workspace,
    cut: &Cut,
    places: Buckets<Place<B, R>>,
    corners: u64,
    by_first: bool,
) -> Result<Groups<B, R>> {
    let share = cut.memory / 8;
    let plan = cut.by_window(corners, size_of::<First<B, R>>(), share);
    let firsts = Shuffle::new(ws, "first uses of a weld", 0..corners, plan)?;
    let plan = cut.by_window(corners, size_of::<Pair<R>>(), share);
    let others = Shuffle::new(ws, "joined positions of a weld", 0..corners, plan)?;
    ws.progress
        .begin("weld: group", "positions", places.records());
    cut.run(
        ws,
        places.count(),
        || {
            let out = Out {
                firsts: firsts.writer()?,
                others: others.writer()?,
                by_first,
            };
            Grouper::new(ws, cut, &places, out)
        },
        |grouper, b| {
            let records = places.records_of(b);
            grouper.bucket(&places, b, records)?;
            ws.progress.advance(records);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |grouper| {
            grouper.out.firsts.finish()?;
            grouper.out.others.finish()
        },
    )?;
    ws.progress.end();
    let given = places.records();
    drop(places);
    let groups = Groups {
        firsts: firsts.finish()?,
        others: others.finish()?,
    };
    let sent = groups.firsts.records() + groups.others.records();
    conserve("weld: group", "positions", given, sent)?;
    Ok(groups)
}

/// Where groups go.
struct Out<'a, B, R> {
    firsts: Writer<'a, First<B, R>>,
    others: Writer<'a, Pair<R>>,
    by_first: bool,
}

impl<B: Bits, R: Index> Out<'_, B, R> {
    #[inline]
    fn first(&mut self, place: &Place<B, R>) -> Result<()> {
        let (at, rank) = (place.at, place.rank);
        self.firsts.push(First { at, rank })
    }

    #[inline]
    fn other(&mut self, rank: R, first: R) -> Result<()> {
        let (key, value) = if self.by_first {
            (first, rank)
        } else {
            (rank, first)
        };
        self.others.push(Pair { key, value })
    }
}

/// Groups buckets on one thread.
struct Grouper<'a, B, R> {
    places: Vec<Place<B, R>>,
    /// The slot of each place's group.
    slot_of: Vec<u32>,
    /// The place of least rank in each group.
    slots: Vec<u32>,
    /// Slots in use: twice as many as the last bucket had groups, at least.
    used: usize,
    /// Places that fit.
    room: u64,
    sorter: Option<Sorter<Place<B, R>>>,
    out: Out<'a, B, R>,
    _lease: Lease,
}

impl<'a, B: Bits, R: Index> Grouper<'a, B, R> {
    fn new(
        ws: &Workspace,
        cut: &Cut,
        places: &Buckets<Place<B, R>>,
        out: Out<'a, B, R>,
    ) -> Result<Grouper<'a, B, R>> {
        // Slots are a power of two, so up to twice as many as are asked for.
        let each = (size_of::<Place<B, R>>() + 4 + 4 * 4) as u64;
        let fits = (cut.each(4) / each).min(1 << 28);
        let most = (0..places.count()).map(|b| places.records_of(b)).max();
        let most = most.unwrap_or(0);
        let room = fits.min(most);
        let slots = (2 * room).next_power_of_two();
        let bytes = room * (size_of::<Place<B, R>>() as u64 + 4) + 4 * slots;
        let lease = ws.budget.lease("places of a weld", bytes)?;
        let sorter = (most > room)
            .then(|| places.sorter(cut.each(8).max(Sorter::<Place<B, R>>::least())))
            .transpose()?;
        Ok(Grouper {
            places: Vec::with_capacity(room as usize),
            slot_of: Vec::with_capacity(room as usize),
            slots: vec![EMPTY; slots as usize],
            used: slots.min(1 << 10) as usize,
            room,
            sorter,
            out,
            _lease: lease,
        })
    }

    fn bucket(&mut self, from: &Buckets<Place<B, R>>, b: u64, records: u64) -> Result<()> {
        match &mut self.sorter {
            Some(sorter) if records > self.room => sorted(from, b, sorter, &mut self.out),
            _ => {
                from.unsorted(b, &mut self.places)?;
                while !self.find() {
                    self.used *= 2;
                }
                self.send()
            }
        }
    }

    /// Finds the group of each place; false when the slots in use are too few.
    fn find(&mut self) -> bool {
        let slots = &mut self.slots[..self.used];
        slots.fill(EMPTY);
        self.slot_of.clear();
        let mask = slots.len() - 1;
        let mut groups = 0;
        for (i, place) in (0u32..).zip(&self.places) {
            let (at, rank) = (place.at, place.rank);
            let mut s = Key::hash(at) as usize & mask;
            loop {
                let Some(known) = self.places.get(slots[s] as usize) else {
                    groups += 1;
                    slots[s] = i;
                    break;
                };
                if same(known.at, at) {
                    if rank < { known.rank } {
                        slots[s] = i;
                    }
                    break;
                }
                s = (s + 1) & mask;
            }
            self.slot_of.push(s as u32);
            if 2 * groups > slots.len() {
                return false;
            }
        }
        true
    }

    fn send(&mut self) -> Result<()> {
        for ((i, place), &slot) in (0u32..).zip(&self.places).zip(&self.slot_of) {
            let first = self.slots[slot as usize];
            if first == i {
                self.out.first(place)?;
            } else {
                self.out
                    .other(place.rank, self.places[first as usize].rank)?;
            }
        }
        Ok(())
    }
}

/// Groups a bucket that does not fit.
fn sorted<B: Bits, R: Index>(
    from: &Buckets<Place<B, R>>,
    b: u64,
    sorter: &mut Sorter<Place<B, R>>,
    out: &mut Out<'_, B, R>,
) -> Result<()> {
    let mut first: Option<Place<B, R>> = None;
    from.sorted(b, sorter, &mut |slice| {
        for place in slice {
            match first {
                Some(first) if same(first.at, place.at) => out.other(place.rank, first.rank)?,
                _ => {
                    out.first(place)?;
                    first = Some(*place);
                }
            }
        }
        Ok(())
    })
}
