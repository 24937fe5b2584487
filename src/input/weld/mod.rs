//! Welding: vertices at equal positions become one, out of core and exactly.
//!
//! Positions are equal when their coordinates are, bit for bit, -0 counting as +0 and a NaN
//! by its bits. New vertex ids follow the order of first use by corners 0..3T, and a vertex
//! keeps the coordinates of its first use. So the vertices of an indexed mesh that no triangle
//! names have no first use and are left out, which is told in a note.
//!
//! ```text
//!   corners ─> blocks: distinct keys, ranked in order of first use      front: one sequential pass
//!                 │ (position, rank)                     │ number in its block, for each corner
//!   sorted by hash and position: the least rank of a group is its first use      join: group
//!        │ (rank, position)          │ (first rank, rank) of all the others
//!   sorted by rank: the id is the place in that order; G is written            join: place
//!        │ ranks of ids              │
//!   merged: (rank, id) of all the others, sorted by rank                       join: resolve
//!                                    │
//!   ranks in order, block by block: ids of a block's keys, then of its corners join: corners
//! ```
//!
//! Why that is exact: ranks ascend with first use in every block and from block to block, so
//! the least rank of all equal positions is the first use in the whole mesh, and counting the
//! first uses in order of rank numbers the vertices in order of first use. Blocks, hashes,
//! buckets and memory decide only how the groups are found.
//!
//! An indexed mesh goes by vertex id within a block (equal ids are equal positions), and its
//! positions are fetched once for each distinct id of a block: in one read when the ids lie
//! near each other, else sorted by id and merged with G.
//!
//! Memory: [`LEAST`] at least; what the budget has is shared out between a hash table (20 or
//! 32 bytes for each of at most 2^18 keys), sorters, the buffers of at most two shuffles and a
//! few stream buffers. One thread. I/O, in bytes: 4 a corner written, read and written again
//! (8 for wide indices); for each key that is distinct in its block 20 (f4) or 32 (f8) written
//! and read; the same for each final vertex, and G; 32 for each key that another block had
//! before. Corners of an indexed mesh are read once; its G once, and once more by ranges.

mod bits;
mod cost;
mod front;
mod join;
mod stream;
#[cfg(test)]
mod tests;

use self::bits::{HASHES, Pair, Place};
use self::front::{Front, Takes};
use super::{CoordArray, CoordKind, IndexArray, IndexKind, Mesh, Request};
use crate::disk::{Lease, Workspace};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Plan, Shuffle, Sorter, Writer};
use std::path::Path;

pub(super) use self::bits::Bits;
pub use self::cost::{WeldCost, WeldSize};

/// The least memory in bytes that a weld works in.
pub const LEAST: u64 = 256 << 10;
/// Ranges of G longer than this are not fetched in one read.
const LONGEST_READ: u64 = 16 << 20;
/// Nor are ranges with more rows than this for each row that is wanted.
const SPARSEST_READ: u64 = 8;

/// What tests set to make small meshes take every path. It shapes no result.
#[derive(Clone, Copy, Debug, Default)]
struct Tuning {
    /// Distinct keys of a block.
    room: Option<usize>,
    /// Bytes of G that are fetched in one read.
    longest_read: Option<u64>,
}

/// Welds the vertices of a mesh that has coordinates; one that is welded stays as it is.
///
/// The result's V is a scratch file, its G the file `request.g_path` (in the type that
/// `request.coords` asks for: coordinates are converted first and compared then). When the
/// mesh's own G is that file, the new one is written beside it and takes its name.
///
/// # Errors
/// [`Error::Usage`] for a mesh without coordinates, [`Error::Input`] for an index without
/// vertex, or a coordinate beyond the type asked for; [`Error::Budget`] below [`LEAST`];
/// [`Error::Io`], [`Error::DiskLimit`].
pub fn weld(ws: &Workspace, mesh: Mesh, request: &Request) -> Result<Mesh> {
    weld_tuned(ws, mesh, request, Tuning::default())
}

fn weld_tuned(ws: &Workspace, mesh: Mesh, request: &Request, tuning: Tuning) -> Result<Mesh> {
    if mesh.welded {
        return Ok(mesh);
    }
    let Some(g) = mesh.g else {
        return Err(Error::Usage(
            "--weld joins vertices at equal positions, but this mesh has no coordinates; give \
             them with --positions, or leave --weld out"
                .into(),
        ));
    };
    let before = g.vertices;
    let (v, g) = match request.coords.unwrap_or(g.kind) {
        CoordKind::F4 => indexed::<u32>(ws, mesh.v, g, request, tuning)?,
        CoordKind::F8 => indexed::<u64>(ws, mesh.v, g, request, tuning)?,
    };
    ws.progress.note(&format!(
        "welded: {} vertices of {before} are left; those that no triangle names are not among \
         them",
        g.vertices
    ));
    Ok(Mesh {
        v,
        vertices: Some(g.vertices),
        g: Some(g),
        polygons_fanned: mesh.polygons_fanned,
        welded: true,
        entry: mesh.entry,
        sums: Vec::new(),
    })
}

/// Takes triangles without ids: three positions each.
pub(super) struct Soup<'f, 's, B: Bits> {
    front: Front<'f, [B; 3], ToPlaces<'s, B>>,
}

impl<B: Bits> Soup<'_, '_, B> {
    /// Takes the next triangle.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::DiskLimit`], [`Error::Budget`].
    #[inline]
    pub fn triangle(&mut self, corners: [[B; 3]; 3]) -> Result<()> {
        corners.into_iter().try_for_each(|at| self.front.corner(at))
    }
}

/// Welds the triangles that `feed` gives, about `expected` of them, as [`weld`] does, and
/// gives back what `feed` returns.
///
/// # Errors
/// Those of `feed`; else as [`weld`].
pub(super) fn soup<B: Bits, T>(
    ws: &Workspace,
    request: &Request,
    expected: u64,
    feed: impl FnOnce(&mut Soup<'_, '_, B>) -> Result<T>,
) -> Result<(T, IndexArray, CoordArray)> {
    soup_tuned(ws, request, expected, feed, Tuning::default())
}

fn soup_tuned<B: Bits, T>(
    ws: &Workspace,
    request: &Request,
    expected: u64,
    feed: impl FnOnce(&mut Soup<'_, '_, B>) -> Result<T>,
    tuning: Tuning,
) -> Result<(T, IndexArray, CoordArray)> {
    drop(ws.budget.lease("welding vertices", LEAST)?);
    let free = ws.budget.free();
    let places = shuffle_places::<B>(ws, expected)?;
    let mut taker = ToPlaces(places.writer()?);
    let front = Front::new(ws, free / 8, tuning.room, &mut taker)?;
    let mut soup = Soup { front };
    let fed = feed(&mut soup)?;
    let fronted = soup.front.finish()?;
    taker.0.finish()?;
    let (v, g) = join::join(ws, request, false, fronted, places.finish()?)?;
    Ok((fed, v, g))
}

fn shuffle_places<B: Bits>(ws: &Workspace, expected: u64) -> Result<Shuffle<Place<B>>> {
    let free = ws.budget.free();
    let plan = Plan::within(free / 4, 1, size_of::<Place<B>>(), expected, free / 2);
    Shuffle::new(ws, "positions of a weld", 0..HASHES, plan)
}

/// Half of the free memory for a sorter, or the least that one works with.
fn sorter<R: crate::shuffle::Record>(ws: &Workspace, of: &Buckets<R>) -> Result<Sorter<R>> {
    of.sorter((ws.budget.free() / 2).max(Sorter::<R>::least()))
}

struct ToPlaces<'s, B: Bits>(Writer<'s, Place<B>>);

impl<B: Bits> Takes<[B; 3]> for ToPlaces<'_, B> {
    fn block(&mut self, keys: &[[B; 3]], first_rank: u64) -> Result<()> {
        let mut ranks = first_rank..;
        keys.iter()
            .zip(&mut ranks)
            .try_for_each(|(&at, rank)| self.0.push(Place { at, rank }))
    }
}

/// Welds a mesh with ids.
fn indexed<B: Bits>(
    ws: &Workspace,
    v: IndexArray,
    g: CoordArray,
    request: &Request,
    tuning: Tuning,
) -> Result<(IndexArray, CoordArray)> {
    drop(ws.budget.lease("welding vertices", LEAST)?);
    let free = ws.budget.free();
    let places = shuffle_places::<B>(ws, g.vertices.saturating_mul(2))?;
    let plan = Plan::within(free / 8, 1, size_of::<Pair>(), 3 * v.triangles, free / 4);
    let apart = Shuffle::new(ws, "vertices of a weld", 0..g.vertices, plan)?;
    let room = tuning.longest_read.unwrap_or(free / 8).min(LONGEST_READ);
    let mut taker = Gather {
        g: &g,
        path: &request.path,
        lease: ws.budget.lease("coordinates of a weld", room)?,
        rows: Vec::new(),
        near: places.writer()?,
        apart: apart.writer()?,
    };
    let mut front = Front::new(ws, free / 8, tuning.room, &mut taker)?;
    read_corners(ws, &v, &request.path, g.vertices, &mut front)?;
    let fronted = front.finish()?;
    drop(v);
    let Gather {
        near,
        apart: far,
        lease,
        rows,
        ..
    } = taker;
    drop((rows, lease));
    far.finish()?;
    fetch_apart(ws, &g, &request.path, apart.finish()?, near)?;
    let placed = g.placed;
    drop(g);
    join::join(ws, request, placed, fronted, places.finish()?)
}

/// Feeds every corner's vertex to the first pass.
fn read_corners<T: Takes<u64>>(
    ws: &Workspace,
    v: &IndexArray,
    path: &Path,
    vertices: u64,
    front: &mut Front<'_, u64, T>,
) -> Result<()> {
    let width = v.kind.bytes() as usize;
    let file = v.source.data();
    let mut rows = stream::SeqReader::new(&ws.budget, file, v.at, 3 * width, v.triangles)?;
    // The first value that is negative when read as a signed one.
    let negative = match v.kind {
        IndexKind::I4 => 1 << 31,
        IndexKind::I8 => 1 << 63,
        _ => u64::MAX,
    };
    let end = vertices.min(negative);
    ws.progress.begin("weld: read", "triangles", v.triangles);
    let mut triangle = 0u64;
    while let Some(row) = rows.next()? {
        for (k, bytes) in row.chunks_exact(width).enumerate() {
            let vertex = bits::unsigned(bytes, v.endian);
            if vertex >= end {
                let found = match v.kind {
                    IndexKind::I4 => i64::from(vertex as u32 as i32).to_string(),
                    IndexKind::I8 => (vertex as i64).to_string(),
                    _ => vertex.to_string(),
                };
                return Err(Error::input(
                    path,
                    format!("triangle {triangle}, corner {k}"),
                    format!("a vertex from 0 to below {vertices}"),
                    format!("vertex {found}"),
                    "the indices do not belong to these coordinates, or the file is damaged",
                ));
            }
            front.corner(vertex)?;
        }
        triangle += 1;
        if triangle.is_multiple_of(1 << 16) {
            ws.progress.advance(1 << 16);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
        }
    }
    ws.progress.advance(triangle % (1 << 16));
    ws.progress.end();
    Ok(())
}

/// Fetches the positions of a block's vertices, or puts them off.
struct Gather<'g, 'n, 'a, B: Bits> {
    g: &'g CoordArray,
    path: &'g Path,
    /// Covers `rows`.
    lease: Lease,
    rows: Vec<u8>,
    near: Writer<'n, Place<B>>,
    apart: Writer<'a, Pair>,
}

impl<B: Bits> Takes<u64> for Gather<'_, '_, '_, B> {
    fn block(&mut self, keys: &[u64], first_rank: u64) -> Result<()> {
        let (Some(&lo), Some(&hi)) = (keys.iter().min(), keys.iter().max()) else {
            return Ok(());
        };
        let width = 3 * self.g.kind.bytes();
        let ranks = first_rank..;
        let rows = hi - lo + 1;
        if rows > (self.lease.bytes() / width).min(SPARSEST_READ * keys.len() as u64) {
            let mut pairs = keys.iter().zip(ranks);
            return pairs.try_for_each(|(&key, value)| self.apart.push(Pair { key, value }));
        }
        if self.rows.is_empty() {
            self.rows = vec![0; self.lease.bytes() as usize];
        }
        let bytes = &mut self.rows[..(rows * width) as usize];
        self.g
            .source
            .data()
            .read_at(bytes, self.g.at + lo * width)?;
        for (&vertex, rank) in keys.iter().zip(ranks) {
            let row = &bytes[((vertex - lo) * width) as usize..][..width as usize];
            let at = position_of(self.g, self.path, vertex, row)?;
            self.near.push(Place { at, rank })?;
        }
        Ok(())
    }
}

/// Merges the vertices that were put off, sorted by id, with G.
fn fetch_apart<B: Bits>(
    ws: &Workspace,
    g: &CoordArray,
    path: &Path,
    apart: Buckets<Pair>,
    mut places: Writer<'_, Place<B>>,
) -> Result<()> {
    if apart.records() > 0 {
        ws.progress
            .begin("weld: fetch", "vertices", apart.records());
        let mut sorter = sorter(ws, &apart)?;
        let width = 3 * g.kind.bytes() as usize;
        let mut rows =
            stream::SeqReader::new(&ws.budget, g.source.data(), g.at, width, g.vertices)?;
        let mut last = (u64::MAX, [B::from_f4(0); 3]);
        let mut next = 0;
        apart.sorted_all(&mut sorter, &mut |slice| {
            for pair in slice {
                if pair.key != last.0 {
                    rows.skip(pair.key - next);
                    next = pair.key + 1;
                    let row = rows.next()?.unwrap_or_default();
                    last = (pair.key, position_of(g, path, pair.key, row)?);
                }
                let (at, rank) = (last.1, pair.value);
                places.push(Place { at, rank })?;
            }
            ws.progress.advance(slice.len() as u64);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        })?;
        ws.progress.end();
    }
    places.finish()
}

fn position_of<B: Bits>(g: &CoordArray, path: &Path, vertex: u64, row: &[u8]) -> Result<[B; 3]> {
    bits::position(row, g.kind, g.endian).ok_or_else(|| {
        let wide = bits::position::<u64>(row, g.kind, g.endian).unwrap_or_default();
        Error::input(
            path,
            format!("vertex {vertex}"),
            "coordinates that 4 bytes hold",
            format!("{:?}", wide.map(f64::from_bits)),
            "store coordinates as 8 bytes: --coords f8",
        )
    })
}
