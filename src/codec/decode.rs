//! A compressed file to V and G.
//!
//! Why chunks go in any order: the index says how many vertices each chunk calls its own, so the
//! mesh's numbers of a chunk's vertices are known from the index and from the chunk's references,
//! and its triangles and coordinates have their places in the arrays.
//!
//! Memory: the index; for each thread a chunk, by what its entry says, with fewer threads when
//! there is less. I/O: the file once; V and G written once. For a file that keeps an order, see
//! `codec/reorder.rs`.

use super::chunk::{DECODE_BYTES, MODEL_BYTES};
use super::file::Entry;
use super::packed::{Packed, Unpacked};
use super::reorder::reorder;
use super::rows::Rows;
use crate::disk::{Workers, Workspace};
use crate::error::{Result, conserve};
use std::path::Path;

/// What was decoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecodeCount {
    /// Triangles.
    pub triangles: u64,
    /// Vertices.
    pub vertices: u64,
}

/// Decodes a file into two new `.npy` arrays, V and, when it has coordinates, G: in the order of
/// the folder when the file keeps it, else in that of the file.
///
/// # Errors
/// [`crate::Error::Input`] for a damaged file; [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn decode(ws: &Workspace, packed: &Packed, v: &Path, g: &Path) -> Result<DecodeCount> {
    let head = &packed.head;
    let shape = [head.triangles, head.vertices];
    let rows = Rows::create(ws, head, [v, g], shape)?;
    rows.shape(shape)?;
    if head.ordered == 1 {
        reorder(ws, packed, &rows)?;
    } else {
        in_place(ws, packed, &rows)?;
    }
    Ok(DecodeCount {
        triangles: head.triangles,
        vertices: head.vertices,
    })
}

/// Decodes all chunks, each to the places that the index gives it.
fn in_place(ws: &Workspace, packed: &Packed, rows: &Rows) -> Result<()> {
    let mut first = Vec::with_capacity(packed.entries.len());
    let mut sum = 0;
    for entry in &packed.entries {
        first.push(sum);
        sum += entry.all_triangles();
    }
    let most = most_bytes(packed);
    let few = workers(ws, packed, ws.budget.free())?;
    ws.progress.begin("decode", "triangles", sum);
    few.run(
        packed.entries.len() as u64,
        || ws.budget.lease("a chunk", most),
        |_, chunk| {
            let chunk = chunk as usize;
            let unpacked = whole(packed, chunk)?;
            let (ids, points) = named(packed, chunk, &unpacked)?;
            rows.points(packed.first_vertex[chunk], &points)?;
            drop(points);
            let corners = unpacked.piece.triangles.as_flattened().iter();
            rows.triangles(first[chunk], corners.map(|&v| ids[v as usize]))?;
            ws.progress.advance(packed.entries[chunk].all_triangles());
            Ok(())
        },
        |_| Ok(()),
    )?;
    ws.progress.end();
    Ok(())
}

/// A chunk, and nothing of it is damaged, the components included that nobody asked for.
pub(super) fn whole(packed: &Packed, chunk: usize) -> Result<Unpacked> {
    packed.labels(chunk, |_, _| ())?;
    packed.chunk(chunk)
}

/// The mesh's number of each vertex of a chunk, and the rows of G of those that are its own.
fn named(packed: &Packed, chunk: usize, unpacked: &Unpacked) -> Result<(Vec<u64>, Vec<u8>)> {
    let (entry, base) = (&packed.entries[chunk], packed.first_vertex[chunk]);
    let mut ids = vec![0; unpacked.piece.positions.len()];
    let mut points = Vec::new();
    let mut own = 0;
    unpacked.each_vertex(|number, at, reference| {
        ids[number] = match reference {
            Some(r) => packed.first_vertex[r.chunk as usize] + r.rank,
            None => {
                own += 1;
                packed.restore(at, &mut points);
                base + own - 1
            }
        };
    });
    hold(entry, unpacked, own)?;
    Ok((ids, points))
}

/// A chunk has the triangles and the own vertices of its entry.
pub(super) fn hold(entry: &Entry, unpacked: &Unpacked, own: u64) -> Result<()> {
    conserve("decode", "vertices of a chunk", entry.own(), own)?;
    let triangles = unpacked.piece.triangles.len() as u64;
    let all = entry.all_triangles();
    conserve("decode", "triangles of a chunk", all, triangles)
}

/// Threads for which so much memory suffices.
pub(super) fn workers(ws: &Workspace, packed: &Packed, memory: u64) -> Result<Workers> {
    let threads = memory / most_bytes(packed).max(1);
    Workers::new(threads.clamp(1, ws.workers.count() as u64) as usize)
}

/// Bytes that any chunk takes while it is decoded.
pub(super) fn most_bytes(packed: &Packed) -> u64 {
    packed.entries.iter().map(bytes_of).max().unwrap_or(0)
}

/// Bytes that a chunk takes while it is decoded.
pub(super) fn bytes_of(entry: &Entry) -> u64 {
    let sized = entry.all_triangles() * DECODE_BYTES + entry.loose * 64;
    let numbers = match entry.number_bytes {
        0 => 0,
        bytes => bytes + 8 * (entry.all_triangles() + entry.vertices),
    };
    let coded = entry.bytes + entry.reference_bytes + numbers;
    // The components are looked at first, and given back.
    entry.label_bytes.max(coded + sized + entry.references * 48) + MODEL_BYTES
}
