//! One cell in memory: its triangles and lone edges, paired, walked and named.
//!
//! Why it works: see [`pair`](crate::chunk::pair) and [`swirl`](crate::chunk::swirl). A local
//! component is named by its first triangle, so it is called the same in whatever order its
//! triangles arrived.
//!
//! Memory: [`TRIANGLE_BYTES`] for each triangle, [`LONE_BYTES`] for each lone edge, at most,
//! twice that for wide ids. I/O: none.

use super::super::records::EdgeCorner;
use super::super::stars::spill::{Block, Spiller};
use super::deal::VertexBits;
use super::records::{Called, Dealt, Lone};
use crate::chunk::ids::{LocalIds, TABLE_BYTES};
use crate::chunk::pair::Pairs;
use crate::chunk::star::{Settled, StarCount, Stars};
use crate::chunk::swirl::{Local, Swirl};
use crate::corner::Index;
use crate::error::Result;

/// Bytes for each triangle: record, ids, local ids and their table, lists, opposites, labels,
/// stack, local components and their names.
pub const TRIANGLE_BYTES: u64 =
    16 + 12 + 12 + TABLE_BYTES + 1 + 24 + 12 + 12 + 8 + 20 + 16 + STAR_BYTES;
/// Bytes for the star of each triangle: flags and heads of three vertices, at worst, and the rest.
const STAR_BYTES: u64 =
    3 * (1 + Stars::VERTEX_BYTES) + Stars::TRIANGLE_BYTES + size_of::<StarCount>() as u64;
/// Bytes for each lone edge: record, ids, local ids and their table, list, opposite.
pub const LONE_BYTES: u64 = 12 + 8 + 8 + TABLE_BYTES + 8 + 8 + 4 + 2 * (1 + Stars::VERTEX_BYTES);

/// Bytes of a cell, without measuring.
pub fn cell_bytes<W: Index>(triangles: u64, lone: u64) -> u64 {
    W::BYTES as u64 / 4 * (triangles * TRIANGLE_BYTES + lone * LONE_BYTES)
}

/// What a thread's buffers have room for. They are reused, and each keeps its largest size: one
/// cell may have many triangles, and another many lone edges.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kept {
    triangles: u64,
    lone: u64,
    /// Bytes for measuring.
    pub measured: u64,
}

impl Kept {
    /// Grows to a cell that fits in `share` bytes by itself. Gives the bytes that are left for
    /// measuring, and whether all fits together; if not, the buffers are to be dropped first.
    pub fn grow<W: Index>(&mut self, triangles: u64, lone: u64, share: u64) -> (u64, bool) {
        let grown = Kept {
            triangles: self.triangles.max(triangles),
            lone: self.lone.max(lone),
            ..*self
        };
        let bytes = cell_bytes::<W>(grown.triangles, grown.lone) + grown.measured;
        let fits = bytes <= share;
        *self = if fits {
            grown
        } else {
            Kept {
                triangles,
                lone,
                measured: 0,
            }
        };
        (share - cell_bytes::<W>(self.triangles, self.lone), fits)
    }
}

/// The name of a local component, and the flip of the triangle that names it against the one
/// that the swirl began with.
#[derive(Clone, Copy)]
struct Named {
    name: u64,
    flip: bool,
}

/// A cell. Reused from cell to cell.
pub struct Cell<W> {
    /// Its triangles.
    pub triangles: Vec<Dealt<W>>,
    /// Its edges whose triangles lie in other cells.
    pub lone: Vec<Lone<W>>,
    /// Local ids of the vertices: of the triangles' corners, then of the lone edges.
    pub ids: LocalIds,
    /// Opposites: of the triangles' corners, then of the corners that face the lone edges.
    pub pairs: Pairs,
    /// Labels of the triangles.
    pub swirl: Swirl,
    v: Vec<W>,
    aside: Vec<u8>,
    named: Vec<Named>,
    open: Vec<bool>,
}

impl<W> Default for Cell<W> {
    fn default() -> Self {
        Cell {
            triangles: Vec::new(),
            lone: Vec::new(),
            ids: LocalIds::default(),
            pairs: Pairs::default(),
            swirl: Swirl::default(),
            v: Vec::new(),
            aside: Vec::new(),
            named: Vec::new(),
            open: Vec::new(),
        }
    }
}

impl<W: Index> Cell<W> {
    /// Pairs and walks the triangles and lone edges that were put in.
    pub fn settle(&mut self) {
        self.v.clear();
        self.v.extend(self.triangles.iter().flat_map(Dealt::v));
        self.v.extend(self.lone.iter().flat_map(Lone::ends));
        self.aside.clear();
        self.aside.extend(self.triangles.iter().map(Dealt::aside));
        self.ids.assign(&self.v);
        let (local, lone) = self.ids.local().split_at(3 * self.triangles.len());
        let span = self.ids.span();
        self.pairs.pair_dealt(local, &self.aside, lone, span);
        let corners = local.len();
        self.swirl.walk(&self.pairs.opposite[..corners]);
        self.name();
    }

    fn name(&mut self) {
        self.named.clear();
        let first = |local: &Local| Named {
            name: self.triangles[local.first as usize].t(),
            flip: false,
        };
        self.named.extend(self.swirl.components.iter().map(first));
        for (triangle, label) in self.triangles.iter().zip(&self.swirl.label) {
            let named = &mut self.named[(label >> 1) as usize];
            if triangle.t() < named.name {
                *named = Named {
                    name: triangle.t(),
                    flip: label & 1 == 1,
                };
            }
        }
    }

    /// Finds the stars of the cell, in which all triangles lie at the vertices that are not `open`;
    /// gives what its local components count.
    ///
    /// # Errors
    /// Those of the spiller.
    pub fn stars<'s>(
        &mut self,
        stars: &'s mut Spiller<'_, W>,
        open: &VertexBits,
    ) -> Result<&'s [StarCount]> {
        let mut flags = std::mem::take(&mut self.open);
        flags.clear();
        let ids = &self.ids;
        flags.extend((0..ids.span() as u32).map(|local| open.get(ids.global(local))));
        self.open = flags;
        let settled = Settled {
            local: self.corners(),
            span: self.ids.span(),
            label: &self.swirl.label,
            open: &self.open,
        };
        stars.settle(&settled, &self.pairs, self.swirl.components.len(), &*self)
    }

    /// Local ids of the triangles' corners.
    pub fn corners(&self) -> &[u32] {
        &self.ids.local()[..3 * self.triangles.len()]
    }

    /// The local components, each with its name and whether the triangle that names it is flipped
    /// against the one that the swirl began with.
    pub fn named(&self) -> impl Iterator<Item = (&Local, u64, bool)> {
        let named = self.swirl.components.iter().zip(&self.named);
        named.map(|(local, named)| (local, named.name, named.flip))
    }

    /// What triangle number i of the cell is called by.
    #[inline]
    pub fn called(&self, i: usize) -> Called {
        let label = self.swirl.label[i];
        let Named { name, flip } = self.named[(label >> 1) as usize];
        Called {
            name,
            flip: flip ^ (label & 1 == 1),
        }
    }

    /// (triangle, place) of a corner of the cell, and whether the triangle lies here.
    #[inline]
    pub fn corner(&self, corner: u32) -> ((u64, usize), bool) {
        let (at, here) = (corner as usize, 3 * self.triangles.len());
        if at < here {
            ((self.triangles[at / 3].t(), at % 3), true)
        } else {
            (self.lone[at - here].corner(), false)
        }
    }

    /// A corner of the cell as other passes know it.
    pub fn edge_corner(&self, corner: u32) -> EdgeCorner<W> {
        let ((t, k), here) = self.corner(corner);
        let i = corner as usize / 3;
        if here {
            edge_corner(self.triangles[i].edge(k), (t, k), self.called(i))
        } else {
            let lone = &self.lone[corner as usize - 3 * self.triangles.len()];
            edge_corner(lone.edge(), (t, k), Called::itself(t))
        }
    }
}

impl<W: Index> Block for Cell<W> {
    #[inline]
    fn corner(&self, corner: u32) -> (u64, usize) {
        (self.triangles[corner as usize / 3].t(), corner as usize % 3)
    }

    #[inline]
    fn vertex(&self, local: u32) -> u64 {
        self.ids.global(local)
    }

    #[inline]
    fn called(&self, triangle: u32) -> u64 {
        Cell::called(self, triangle as usize).name
    }
}

/// A corner on the edge (from, to) as other passes know it.
pub fn edge_corner<W: Index>(
    (from, to): (u64, u64),
    (t, k): (u64, usize),
    called: Called,
) -> EdgeCorner<W> {
    EdgeCorner::new(
        (from.min(to), from.max(to)),
        t,
        k as u64,
        called.flip,
        called.name,
        (from > to) ^ called.flip,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_never_keep_more_than_the_share() {
        const SHARE: u64 = 1 << 20;
        let (mut kept, mut dropped) = (Kept::default(), 0);
        for i in 0..1000u64 {
            // Some cells are all triangles, some all lone edges, and measuring takes what is left.
            let (triangles, lone) = match i % 3 {
                0 => (i * 7919 % (SHARE / TRIANGLE_BYTES), 0),
                1 => (0, i * 6007 % (SHARE / LONE_BYTES)),
                _ => (100, 100),
            };
            let (room, fits) = kept.grow::<u32>(triangles, lone, SHARE);
            dropped += u64::from(!fits);
            let cell = cell_bytes::<u32>(kept.triangles, kept.lone);
            assert!(cell >= cell_bytes::<u32>(triangles, lone));
            assert_eq!(cell + room, SHARE);
            assert!(kept.measured <= room);
            kept.measured = kept.measured.max(room / (1 + i % 5));
            assert!(cell + kept.measured <= SHARE);
        }
        assert!(dropped > 10);
        let once = cell_bytes::<u64>(50, 20);
        assert_eq!(once, 2 * cell_bytes::<u32>(50, 20));
        assert_eq!(Kept::default().grow::<u64>(50, 20, once), (0, true));
    }
}
