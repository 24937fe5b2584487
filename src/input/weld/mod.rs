//! Welding: vertices at equal positions become one, out of core and exactly.
//!
//! Positions are equal when their coordinates are, bit for bit, -0 counting as +0 and a NaN
//! by its bits. New vertex ids follow the order of first use by corners 0..3T, and a vertex
//! keeps the coordinates of its first use. So the vertices of an indexed mesh that no triangle
//! names have no first use and are left out, which is told in a note.
//!
//! ```text
//!   corners ─> blocks: distinct keys with their first corner, the rank          front
//!                 │ (position, rank), by hash            │ way back to it, for each other corner
//!   equal positions: the least rank is the first use     │                      group
//!        │ (position, rank)          │ (rank, first rank) of all the others
//!        │ by corner                 │ by corner         │
//!   a bit for each first use, the id is their count; G   │                      firsts
//!        └────────────┬──────────────┴───────────────────┘
//!   ids of first uses, of others, of repeats in blocks: V                       corners
//! ```
//!
//! Why that is exact: a rank is the corner itself, so the least rank of all equal positions is
//! the first use in the whole mesh, and counting the first uses in order of rank numbers the
//! vertices in order of first use. Blocks, hashes, buffers, memory and threads decide only how
//! the groups are found.
//!
//! When bits and counts of all corners do not fit in memory, the others are sent to their
//! first uses instead, get their ids there window by window, and are sent back.
//!
//! Memory: [`LEAST`] at least; what the budget has is shared out by [`cut`], as the passes say.
//! Threads: corners in a file of facets are taken by all, in blocks of the file; a stream by
//! one; all later passes run on all. I/O, in bytes, f4 and up to 2^32 corners: for each key that
//! is distinct in its block 16 written and read (f8: 28); the same for each final vertex, and G;
//! 8 for each key that another block had before; 4 a corner written and read where blocks have
//! repeats; V, 4 a corner. Corners of an indexed mesh are read once; its G once, and once more
//! by ranges.

mod bits;
mod corners;
mod cost;
mod cut;
mod firsts;
mod front;
mod group;
mod indexed;
mod stage;
mod stream;
#[cfg(test)]
mod tests;
mod units;
mod windows;

use self::bits::{HASHES, Place};
use self::cut::Cut;
use self::front::{Counted, Front, Keyed, Takes};
use self::stage::{Known, Left, Weld};
use super::{CoordArray, CoordKind, IndexArray, Request};
use crate::corner::Index;
use crate::disk::{ScratchFile, Workspace};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Plan, Shuffle, Writer};

pub(super) use self::bits::Bits;
pub use self::cost::{WeldCost, WeldSize};
pub(super) use self::stage::{Next, STEPS, Welding};
pub(super) use self::units::Units;

/// The least memory in bytes that a weld works in.
pub const LEAST: u64 = 256 << 10;

/// What a weld makes.
pub(super) type Welded = (IndexArray, CoordArray);

/// What tests set to make small meshes take every path. It shapes no result.
#[derive(Clone, Copy, Debug, Default)]
struct Tuning {
    /// Distinct keys of a block.
    room: Option<usize>,
    /// Bytes of G that are fetched in one read.
    longest_read: Option<u64>,
    /// Corners of a window.
    window: Option<u64>,
    /// Keeps bits and counts of first uses in a file.
    filed: bool,
    /// Ranks of 8 bytes.
    wide: bool,
    /// How many threads share the memory, however little that is.
    threads: Option<u64>,
}

/// Begins to weld the vertices of a mesh: reads its corners. What comes of it is brought on by
/// [`Welding::on`] until it is V, a scratch file, and G, the file `request.g_path` (in the type that
/// `request.coords` asks for: coordinates are converted first and compared then). When the
/// mesh's own G is that file, the new one is written beside it and takes its name.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for an index without vertex, or a coordinate beyond the type
/// asked for; [`Error::Budget`](crate::Error::Budget) below [`LEAST`];
/// [`Error::Io`](crate::Error::Io), [`Error::DiskLimit`](crate::Error::DiskLimit).
pub(super) fn begin(
    ws: &Workspace,
    request: &Request,
    (v, g): (IndexArray, CoordArray),
) -> Result<Welding> {
    begin_tuned(ws, request, (v, g), Tuning::default())
}

fn begin_tuned(
    ws: &Workspace,
    request: &Request,
    (v, g): (IndexArray, CoordArray),
    tuning: Tuning,
) -> Result<Welding> {
    drop(ws.budget.lease("welding vertices", LEAST)?);
    let narrow = narrow(Some(v.triangles), tuning);
    match (request.coords.unwrap_or(g.kind), narrow) {
        (CoordKind::F4, true) => indexed::indexed::<u32, u32>(ws, v, g, request, tuning),
        (CoordKind::F4, false) => indexed::indexed::<u32, u64>(ws, v, g, request, tuning),
        (CoordKind::F8, true) => indexed::indexed::<u64, u32>(ws, v, g, request, tuning),
        (CoordKind::F8, false) => indexed::indexed::<u64, u64>(ws, v, g, request, tuning),
    }
}

/// True when corners of exactly so many triangles have numbers of 4 bytes.
pub(super) fn few(triangles: u64) -> bool {
    narrow(Some(triangles), Tuning::default())
}

/// True when ranks of 4 bytes suffice for at most so many triangles.
fn narrow(most_triangles: Option<u64>, tuning: Tuning) -> bool {
    let corners = most_triangles.and_then(|t| t.checked_mul(3));
    corners.is_some_and(|c| c < u64::from(u32::MAX)) && !tuning.wide
}

/// Takes triangles without ids: three positions each.
pub(super) trait Soup<B> {
    /// Goes on with this triangle, which is the first of all or follows no other that was taken
    /// here since the last call.
    fn begin(&mut self, triangle: u64);

    /// Takes the positions of the next corners.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::DiskLimit`], [`Error::Budget`].
    fn corners(&mut self, at: &[[B; 3]]) -> Result<()>;
}

impl<B: Bits, R: Index> Soup<B> for Front<'_, [B; 3], R, ToPlaces<'_, B, R>> {
    fn begin(&mut self, triangle: u64) {
        Front::begin(self, 3 * triangle);
    }

    fn corners(&mut self, at: &[[B; 3]]) -> Result<()> {
        at.iter().try_for_each(|&at| self.corner(at))
    }
}

/// How many triangles a soup has.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected {
    /// About: for planning only.
    pub triangles: u64,
    /// At most, when that is known for certain.
    pub most: Option<u64>,
}

/// Begins to weld the triangles that `feed` gives in order, as [`begin`] does, and gives back what
/// `feed` returns.
///
/// # Errors
/// Those of `feed`; else as [`begin`].
pub(super) fn soup<B: Bits, T>(
    ws: &Workspace,
    expected: Expected,
    feed: impl FnOnce(&mut dyn Soup<B>) -> Result<T>,
) -> Result<(T, Welding)> {
    soup_tuned(ws, expected, feed, Tuning::default())
}

fn soup_tuned<B: Bits, T>(
    ws: &Workspace,
    expected: Expected,
    feed: impl FnOnce(&mut dyn Soup<B>) -> Result<T>,
    tuning: Tuning,
) -> Result<(T, Welding)> {
    if narrow(expected.most, tuning) {
        in_order::<B, u32, T>(ws, expected, feed, tuning)
    } else {
        in_order::<B, u64, T>(ws, expected, feed, tuning)
    }
}

fn in_order<B: Bits, R: Index, T>(
    ws: &Workspace,
    expected: Expected,
    feed: impl FnOnce(&mut dyn Soup<B>) -> Result<T>,
    tuning: Tuning,
) -> Result<(T, Welding)> {
    drop(ws.budget.lease("welding vertices", LEAST)?);
    let corners = expected.triangles.saturating_mul(3);
    let all = Cut::new(ws.budget.free(), ws.workers.count() as u64, corners, tuning);
    // A stream comes in order, so one thread takes it.
    let cut = Cut { threads: 1, ..all };
    let backs = ws.scratch.file("welded corners")?;
    let places = shuffle_places::<B, R>(ws, &cut, corners)?;
    let taker = ToPlaces(places.writer()?);
    let mut front = Front::new(ws, &cut, tuning.room, &backs, taker)?;
    let fed = feed(&mut front)?;
    front.end()?;
    let corners = front.next();
    let (taker, counted) = front.into_taker();
    taker.0.finish()?;
    let known = Known::new(all, tuning, corners);
    Ok((fed, all_read(known, counted, (backs, places.finish()?))?))
}

/// All corners were read: every one was taken, and every key that went on is a place.
fn all_read<B: Bits, R: Index>(
    known: Known,
    counted: Counted,
    (backs, places): (ScratchFile, Buckets<Place<B, R>>),
) -> Result<Welding> {
    conserve("weld: read", "corners", known.count, counted.corners)?;
    conserve("weld: read", "positions", counted.keys, places.records())?;
    let left = Left::Places(places);
    Ok(Welding::new(Weld { known, backs, left }))
}

fn shuffle_places<B: Bits, R: Index>(
    ws: &Workspace,
    cut: &Cut,
    expected: u64,
) -> Result<Shuffle<Place<B, R>>> {
    let record = size_of::<Place<B, R>>();
    let (memory, threads) = (cut.memory / 4, cut.threads as usize);
    let plan = Plan::within(memory, threads, record, expected, cut.each(8));
    Shuffle::new(ws, "positions of a weld", 0..HASHES, plan)
}

struct ToPlaces<'s, B, R>(Writer<'s, Place<B, R>>);

impl<B: Bits, R: Index> Takes<[B; 3], R> for ToPlaces<'_, B, R> {
    fn keys(&mut self, keys: &[Keyed<[B; 3], R>]) -> Result<()> {
        keys.iter()
            .try_for_each(|&Keyed { key: at, rank }| self.0.push(Place { at, rank }))
    }
}
