//! The first pass over corners that lie in units, which threads take by turns, and which stops
//! between two of them.
//!
//! Why it may stop there: a front ends its block with each unit, and what writers have in their
//! buffers is in files once they are finished. Units are handed out in ascending order, so all
//! before one are taken.
//!
//! Memory: a front and a writer a thread. I/O: see [`front`](super::front).

use super::bits::{Bits, Place};
use super::cut::Cut;
use super::front::{Counted, Front};
use super::stage::Known;
use super::{LEAST, Soup, ToPlaces, Tuning, Welding, all_read, shuffle_places};
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{ScratchFile, Workspace};
use crate::error::Result;
use crate::shuffle::Shuffle;
use std::sync::Mutex;
use std::time::Instant;

/// Triangles without ids that lie in units, as far as they are taken.
pub struct Units<B: Bits, R: Index> {
    known: Known,
    backs: ScratchFile,
    places: Shuffle<Place<B, R>>,
    counted: Counted,
    units: u64,
    /// Units that were taken.
    done: u64,
    /// Distinct keys of a block, for tests.
    room: Option<usize>,
}

impl<B: Bits, R: Index> Units<B, R> {
    /// Exactly `triangles` triangles in `units`, of which none is taken yet.
    ///
    /// # Errors
    /// As [`super::begin`].
    pub(super) fn tuned(
        ws: &Workspace,
        (triangles, units): (u64, u64),
        tuning: Tuning,
    ) -> Result<Units<B, R>> {
        drop(ws.budget.lease("welding vertices", LEAST)?);
        let corners = 3 * triangles;
        let cut = Cut::new(ws.budget.free(), ws.workers.count() as u64, corners, tuning);
        Ok(Units {
            backs: ws.scratch.file("welded corners")?,
            places: shuffle_places(ws, &cut, corners)?,
            known: Known::new(cut, tuning, corners),
            counted: Counted::default(),
            units,
            done: 0,
            room: tuning.room,
        })
    }

    /// The same, as the memory says.
    ///
    /// # Errors
    /// As [`super::begin`].
    pub fn new(ws: &Workspace, of: (u64, u64)) -> Result<Units<B, R>> {
        Units::tuned(ws, of, Tuning::default())
    }

    /// Takes units until all are taken or `until` is past; true when all are. `feed` gives the
    /// triangles of one unit, in order, with the thread's own state from `start`.
    ///
    /// # Errors
    /// Those of `start` and `feed`; as [`super::begin`].
    pub fn take<S>(
        &mut self,
        ws: &Workspace,
        until: Option<Instant>,
        start: impl Fn() -> Result<S> + Sync,
        feed: impl Fn(&mut S, &mut dyn Soup<B>, u64) -> Result<()> + Sync,
    ) -> Result<bool> {
        let (cut, backs, places, room) = (&self.known.cut, &self.backs, &self.places, self.room);
        let counted = Mutex::new(&mut self.counted);
        self.done = cut.round(
            ws,
            (self.done..self.units, until),
            || {
                let taker = ToPlaces(places.writer()?);
                let front = Front::new(ws, cut, room, backs, taker)?;
                Ok((front, start()?))
            },
            |(front, state), unit| {
                feed(state, front, unit)?;
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
                front.end()
            },
            |(front, _)| {
                let (taker, own) = front.into_taker();
                let mut all = counted.lock().unwrap_or_else(|e| e.into_inner());
                all.corners += own.corners;
                all.keys += own.keys;
                taker.0.finish()
            },
        )?;
        Ok(self.done == self.units)
    }

    /// All were taken.
    ///
    /// # Errors
    /// [`crate::Error::Internal`] when a corner was not.
    pub fn end(self) -> Result<Welding> {
        all_read(
            self.known,
            self.counted,
            (self.backs, self.places.finish()?),
        )
    }
}

impl<B: Bits, R: Index> std::fmt::Debug for Units<B, R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {} units", self.done, self.units)
    }
}

impl<B: Bits, R: Index> Keep for Units<B, R> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.known.keep(to)?;
        to.file(&self.backs)?;
        self.places.keep(to)?;
        for number in [
            self.counted.corners,
            self.counted.keys,
            self.units,
            self.done,
        ] {
            to.number(number)?;
        }
        Ok(())
    }

    fn restore(from: &mut Reader) -> Result<Units<B, R>> {
        Ok(Units {
            known: Known::restore(from)?,
            backs: from.file()?,
            places: Shuffle::restore(from)?,
            counted: Counted {
                corners: from.number()?,
                keys: from.number()?,
            },
            units: from.number()?,
            done: from.number()?,
            room: None,
        })
    }
}
