//! All of G, mapped, when it fits the budget: for triangles whose vertices lie far apart.
//!
//! Why it is bounded: the whole mapping is drawn from the budget, though only pages that are
//! touched become resident.
//!
//! Memory: G. I/O: the pages that are touched; the rows that are taken are counted.

use super::Job;
use crate::chunk::measure::Coord;
use crate::disk::{Counters, Lease, Window, Workspace};
use crate::error::{Error, Result};
use crate::input::CoordArray;
use std::marker::PhantomData;
use std::sync::Arc;

/// All of G.
pub struct Whole<X> {
    window: Window,
    io: Arc<Counters>,
    _lease: Lease,
    _type: PhantomData<X>,
}

impl<X: Coord> Whole<X> {
    /// Maps all of G as it lies in the new folder, unless there is none, or it would leave less
    /// than `reserved` bytes of the budget.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn within(job: &Job, reserved: u64) -> Result<Option<Whole<X>>> {
        match &job.g {
            Some(g) => Whole::of(job.ws, g, reserved),
            None => Ok(None),
        }
    }

    /// Maps all of a G that lies in a folder, unless it would leave less than `reserved` bytes of
    /// the budget.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn of(ws: &Workspace, g: &CoordArray, reserved: u64) -> Result<Option<Whole<X>>> {
        let budget = &ws.budget;
        let bytes = g.vertices * 3 * X::BYTES as u64;
        // A mapping begins at a multiple of 64 KiB.
        let leased = bytes + (64 << 10);
        let readable = cfg!(target_endian = "little") && g.placed;
        if !readable || budget.free() < leased.saturating_add(reserved) {
            return Ok(None);
        }
        let whole = Whole {
            _lease: budget.lease("all coordinates", leased)?,
            window: Window::uncounted(g.source.data(), g.at, bytes as usize)?,
            io: Arc::clone(&ws.io),
            _type: PhantomData,
        };
        whole.rows()?;
        Ok(Some(whole))
    }

    /// Counts so many rows as read.
    pub fn took(&self, rows: usize) {
        self.io.add_read((rows * size_of::<[X; 3]>()) as u64);
    }

    /// The rows of G.
    ///
    /// # Errors
    /// [`Error::Internal`] when they are not aligned.
    pub fn rows(&self) -> Result<&[[X; 3]]> {
        let aligned = self.window.slice();
        aligned.ok_or_else(|| Error::Internal("an aligned window was not aligned".into()))
    }
}
