//! Where the vertices of a cell are.
//!
//! Why it works: a cell that is measured needs the positions of its own vertices, and of a few
//! that belong to its neighbours. When all of G fits the budget, it is mapped whole and looked
//! up. When it does not, each position is dealt to its vertex's cell, and triangles with a vertex
//! of another cell are left for later ([`sums`](super::sums)).
//!
//! Memory: G, or what passes by. I/O: G read once more; when it is dealt, 4 words a vertex
//! written and read.

use super::super::Job;
use super::super::arrays::CoordReader;
use super::super::whole::Whole;
use super::map::CellMap;
use super::records::Spot;
use crate::chunk::ids::LocalIds;
use crate::chunk::measure::Coord;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::Result;
use crate::input::CoordArray;
use crate::shuffle::{Buckets, Plan, Shuffle};

/// Positions that pass by at a time.
const PASSING: usize = 4096;
/// Vertices that are dealt at a time.
const STEP: u64 = 16 << 10;

/// The positions of a mesh's vertices.
pub enum Places<X> {
    /// The mesh has none.
    None,
    /// They are for later.
    Later,
    /// All of G.
    Whole(Whole<X>),
    /// By cell, in 4 bytes a word.
    Narrow(Buckets<Spot<u32>>),
    /// By cell, in 8 bytes a word.
    Wide(Buckets<Spot<u64>>),
}

/// Deals the positions of all vertices to their cells.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
pub fn deal_places<W: Index, X: Coord>(
    job: &Job,
    g: &CoordArray,
    map: &CellMap,
    plan: Plan,
) -> Result<Places<X>> {
    if W::BYTES == 4 && X::BYTES == 4 {
        // The value is that of an f32, so this is exact.
        let word = |x: X| (x.wide() as f32).to_bits();
        Ok(Places::Narrow(deal(job, g, map, plan, word)?))
    } else {
        let word = |x: X| x.wide().to_bits();
        Ok(Places::Wide(deal(job, g, map, plan, word)?))
    }
}

fn deal<S: Index, X: Coord>(
    job: &Job,
    g: &CoordArray,
    map: &CellMap,
    plan: Plan,
    word: impl Fn(X) -> S + Sync,
) -> Result<Buckets<Spot<S>>> {
    let ws = job.ws;
    let spots = Shuffle::<Spot<S>>::new(ws, "positions by cell", 0..map.cells, plan)?;
    let reading = ws.workers.count() as u64 * STEP * CoordReader::<X>::BYTES;
    let _lease = ws.budget.lease("positions to deal", reading)?;
    ws.workers.run(
        g.vertices.div_ceil(STEP),
        || Ok((CoordReader::<X>::new(g), spots.writer()?)),
        |(reader, writer), unit| {
            let first = unit * STEP;
            let rows = reader.read(first, STEP.min(g.vertices - first))?;
            for (v, p) in (first..).zip(rows) {
                let [x, y, z] = p.map(&word);
                writer.push_at(u64::from(map.of(v)), Spot([S::of(v), x, y, z]))?;
            }
            Ok(())
        },
        |(_, writer)| writer.finish(),
    )?;
    spots.finish()
}

/// The positions of one cell's vertices. One for each thread; reused from cell to cell.
pub struct Positions<'a, X> {
    places: &'a Places<X>,
    rows: Vec<[X; 3]>,
    absent: Vec<bool>,
    narrow: Vec<Spot<u32>>,
    wide: Vec<Spot<u64>>,
}

/// What is known of the positions of a cell's vertices.
pub enum AtHand<'a, X> {
    /// The mesh has none.
    None,
    /// Nothing now.
    Later,
    /// By local vertex; those marked in `absent` belong to other cells (empty: none).
    Here {
        /// Coordinates.
        positions: &'a [[X; 3]],
        /// Which of them are not known.
        absent: &'a [bool],
    },
}

impl<X: Coord> Places<X> {
    /// What is needed of them once the cells are settled, for a build that is gone on with.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn again(job: &Job) -> Result<Places<X>> {
        if job.g.is_none() {
            return Ok(Places::None);
        }
        // As much is left to later passes as when the map of cells was made.
        let whole = Whole::within(job, job.ws.budget.limit() / 2)?;
        Ok(whole.map_or(Places::Later, Places::Whole))
    }

    /// These as they were read back, with all of G mapped if that is at hand.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn opened(self, job: &Job) -> Result<Places<X>> {
        match self {
            Places::Later => Places::again(job),
            dealt => Ok(dealt),
        }
    }
}

/// All of G is mapped again when the build goes on, or else left for later.
impl<X: Coord> Keep for Places<X> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        match self {
            Places::None => to.number(0),
            Places::Later | Places::Whole(_) => to.number(1),
            Places::Narrow(spots) => {
                to.number(2)?;
                spots.keep(to)
            }
            Places::Wide(spots) => {
                to.number(3)?;
                spots.keep(to)
            }
        }
    }

    fn restore(from: &mut Reader) -> Result<Places<X>> {
        Ok(match from.number()? {
            0 => Places::None,
            1 => Places::Later,
            2 => Places::Narrow(Buckets::restore(from)?),
            _ => Places::Wide(Buckets::restore(from)?),
        })
    }
}

impl<'a, X: Coord> Positions<'a, X> {
    /// Bytes held for each local vertex.
    pub const BYTES: u64 = 3 * X::BYTES as u64 + 1;
    /// Bytes held for what passes by.
    pub const PASSING: u64 = (PASSING * size_of::<Spot<u64>>()) as u64;

    /// A reader.
    pub fn new(places: &'a Places<X>) -> Self {
        Positions {
            places,
            rows: Vec::new(),
            absent: Vec::new(),
            narrow: Vec::new(),
            wide: Vec::new(),
        }
    }

    /// True when the mesh has coordinates.
    pub fn any(&self) -> bool {
        !matches!(self.places, Places::None)
    }

    /// The positions of the vertices of `cell`, whose local ids are `ids`; none are fetched
    /// unless they fit in memory.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn load(&mut self, cell: u64, ids: &LocalIds, fits: bool) -> Result<AtHand<'_, X>> {
        let places = self.places;
        self.rows.clear();
        self.absent.clear();
        match places {
            Places::None => return Ok(AtHand::None),
            Places::Later => return Ok(AtHand::Later),
            _ if !fits => return Ok(AtHand::Later),
            Places::Whole(whole) => {
                let g = whole.rows()?;
                let globals = (0..ids.span() as u32).map(|local| ids.global(local));
                self.rows.extend(globals.map(|v| g[v as usize]));
                whole.took(self.rows.len());
            }
            Places::Narrow(spots) => {
                self.make_room(ids.span());
                self.narrow.resize(PASSING, Spot([0; 4]));
                let (rows, absent) = (&mut self.rows, &mut self.absent);
                // The value came from a 4-byte coordinate, so this is exact.
                let at = |bits: u32| X::of(f64::from(f32::from_bits(bits)));
                spots.streamed(cell, &mut self.narrow, &mut |spots| {
                    take(spots, ids, rows, absent, at);
                    Ok(())
                })?;
            }
            Places::Wide(spots) => {
                self.make_room(ids.span());
                self.wide.resize(PASSING, Spot([0; 4]));
                let (rows, absent) = (&mut self.rows, &mut self.absent);
                let at = |bits: u64| X::of(f64::from_bits(bits));
                spots.streamed(cell, &mut self.wide, &mut |spots| {
                    take(spots, ids, rows, absent, at);
                    Ok(())
                })?;
            }
        }
        Ok(AtHand::Here {
            positions: &self.rows,
            absent: &self.absent,
        })
    }

    fn make_room(&mut self, span: usize) {
        self.rows.resize(span, [X::zeroed(); 3]);
        self.absent.resize(span, true);
    }
}

/// Puts positions that pass by where the cell has their vertices.
fn take<S: Index, X: Coord>(
    spots: &[Spot<S>],
    ids: &LocalIds,
    rows: &mut [[X; 3]],
    absent: &mut [bool],
    at: impl Fn(S) -> X,
) {
    for Spot([v, x, y, z]) in spots {
        if let Some(local) = ids.find(v.wide()) {
            rows[local as usize] = [*x, *y, *z].map(&at);
            absent[local as usize] = false;
        }
    }
}
