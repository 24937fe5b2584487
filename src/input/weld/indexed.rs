//! A mesh with ids: vertices are told apart by id within a block, and their positions fetched.
//!
//! Why by id: equal ids are equal positions, so a block needs no position to find repeats, and
//! fetches one for each distinct id: in one read when the ids lie near each other, else sorted
//! by id and merged with G.
//!
//! Memory: a sixteenth of what is free for rows of G, an eighth for the ids that are put off.
//! I/O: V once; G once by ranges, and once more for what was put off.

use super::bits::{Bits, Pair, Place, position, unsigned};
use super::cut::Cut;
use super::front::{Front, Keyed, Takes};
use super::stage::Known;
use super::stream::SeqReader;
use super::{Tuning, Welding, all_read, shuffle_places};
use crate::corner::Index;
use crate::disk::{Lease, Workspace};
use crate::error::{Error, Result};
use crate::input::{CoordArray, IndexArray, IndexKind, Request};
use crate::shuffle::{Buckets, Plan, Shuffle, Sorter, Writer};
use std::path::Path;

/// Ranges of G longer than this are not fetched in one read.
const LONGEST_READ: u64 = 16 << 20;
/// Nor are ranges with more rows than this for each row that is wanted.
const SPARSEST_READ: u64 = 8;

/// Reads the corners of a mesh with ids.
///
/// # Errors
/// As [`super::begin`].
pub fn indexed<B: Bits, R: Index>(
    ws: &Workspace,
    v: IndexArray,
    g: CoordArray,
    request: &Request,
    tuning: Tuning,
) -> Result<Welding> {
    let free = ws.budget.free();
    let corners = 3 * v.triangles;
    // Corners come in order, so one thread takes them; all others go on from there.
    let all = Cut::new(free, ws.workers.count() as u64, corners, tuning);
    let cut = Cut { threads: 1, ..all };
    let backs = ws.scratch.file("welded corners")?;
    let places = shuffle_places::<B, R>(ws, &cut, corners)?;
    let plan = Plan::within(free / 8, 1, size_of::<Pair<u64>>(), corners, free / 4);
    let apart = Shuffle::new(ws, "vertices of a weld", 0..g.vertices, plan)?;
    let room = tuning.longest_read.unwrap_or(free / 16).min(LONGEST_READ);
    let gather = Gather {
        g: &g,
        path: &request.path,
        lease: ws.budget.lease("coordinates of a weld", room)?,
        rows: Vec::new(),
        near: places.writer()?,
        apart: apart.writer()?,
    };
    let mut front = Front::<u64, R, _>::new(ws, &cut, tuning.room, &backs, gather)?;
    read_corners(ws, &v, &request.path, g.vertices, &mut front)?;
    front.end()?;
    drop(v);
    let (gather, counted) = front.into_taker();
    let Gather {
        near, apart: far, ..
    } = gather;
    far.finish()?;
    fetch_apart(ws, &g, &request.path, apart.finish()?, near)?;
    let known = Known {
        placed: g.placed,
        ..Known::new(all, tuning, corners)
    };
    drop(g);
    all_read(known, counted, (backs, places.finish()?))
}

/// Feeds every corner's vertex to the first pass.
fn read_corners<R: Index, T: Takes<u64, R>>(
    ws: &Workspace,
    v: &IndexArray,
    path: &Path,
    vertices: u64,
    front: &mut Front<'_, u64, R, T>,
) -> Result<()> {
    let width = v.kind.bytes() as usize;
    let file = v.source.data();
    let mut rows = SeqReader::new(&ws.budget, file, v.at, 3 * width, v.triangles)?;
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
            let vertex = unsigned(bytes, v.endian);
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
struct Gather<'g, 'n, 'a, B, R> {
    g: &'g CoordArray,
    path: &'g Path,
    /// Covers `rows`.
    lease: Lease,
    rows: Vec<u8>,
    near: Writer<'n, Place<B, R>>,
    apart: Writer<'a, Pair<u64>>,
}

impl<B: Bits, R: Index> Takes<u64, R> for Gather<'_, '_, '_, B, R> {
    fn keys(&mut self, keys: &[Keyed<u64, R>]) -> Result<()> {
        let (lo, hi) = keys
            .iter()
            .fold((u64::MAX, 0), |(lo, hi), k| (lo.min(k.key), hi.max(k.key)));
        if keys.is_empty() {
            return Ok(());
        }
        let width = 3 * self.g.kind.bytes();
        let rows = hi - lo + 1;
        if rows > (self.lease.bytes() / width).min(SPARSEST_READ * keys.len() as u64) {
            return keys.iter().try_for_each(|k| {
                let (key, value) = (k.key, k.rank.wide());
                self.apart.push(Pair { key, value })
            });
        }
        if self.rows.is_empty() {
            self.rows = vec![0; self.lease.bytes() as usize];
        }
        let bytes = &mut self.rows[..(rows * width) as usize];
        self.g
            .source
            .data()
            .read_at(bytes, self.g.at + lo * width)?;
        for k in keys {
            let row = &bytes[((k.key - lo) * width) as usize..][..width as usize];
            let at = position_of(self.g, self.path, k.key, row)?;
            let rank = k.rank;
            self.near.push(Place { at, rank })?;
        }
        Ok(())
    }
}

/// Merges the vertices that were put off, sorted by id, with G.
fn fetch_apart<B: Bits, R: Index>(
    ws: &Workspace,
    g: &CoordArray,
    path: &Path,
    apart: Buckets<Pair<u64>>,
    mut places: Writer<'_, Place<B, R>>,
) -> Result<()> {
    if apart.records() > 0 {
        ws.progress
            .begin("weld: fetch", "vertices", apart.records());
        let most = (ws.budget.free() / 2).max(Sorter::<Pair<u64>>::least());
        let mut sorter = apart.sorter(most)?;
        let width = 3 * g.kind.bytes() as usize;
        let mut rows = SeqReader::new(&ws.budget, g.source.data(), g.at, width, g.vertices)?;
        let mut last = (u64::MAX, [B::from_f4(0); 3]);
        let mut next = 0;
        apart.sorted_all(&mut sorter, &mut |slice| {
            for pair in slice {
                let (vertex, rank) = (pair.key, pair.value);
                if vertex != last.0 {
                    rows.skip(vertex - next);
                    next = vertex + 1;
                    let row = rows.next()?.unwrap_or_default();
                    last = (vertex, position_of(g, path, vertex, row)?);
                }
                let (at, rank) = (last.1, R::of(rank));
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
    position(row, g.kind, g.endian).ok_or_else(|| {
        let wide = position::<u64>(row, g.kind, g.endian).unwrap_or_default();
        Error::input(
            path,
            format!("vertex {vertex}"),
            "coordinates that 4 bytes hold",
            format!("{:?}", wide.map(f64::from_bits)),
            "store coordinates as 8 bytes: --coords f8",
        )
    })
}
