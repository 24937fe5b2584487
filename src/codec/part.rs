//! Some chunks of a compressed file, or some components, to V and G.
//!
//! Why nothing else is read: a chunk has the positions of all its vertices, those of earlier chunks
//! included. Where two chunks of the part refer to the same vertex of one that is not, it becomes
//! one vertex. Which component a triangle is of stands behind a chunk, and is read alone first.
//!
//! Memory: a chunk; 16 bytes for each chunk of the part; 80 for each reference in it; of components
//! a byte for each triangle of a chunk and 4 bytes for each vertex that is written. I/O: the chunks
//! that are needed, one after the other; of others their components, or nothing when the index says
//! that they have none of those.

use super::decode::{DecodeCount, bytes_of, hold};
use super::file::Entry;
use super::packed::{Packed, Unpacked};
use super::rows::Rows;
use super::seam::Reference;
use crate::disk::{Lease, Workspace};
use crate::error::Result;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// What is wanted of a file.
pub struct Part<'a> {
    /// These chunks, ascending.
    pub chunks: Vec<usize>,
    /// Of them the triangles of certain components alone: says whether any of a range is wanted.
    /// Without it all, and the loose vertices.
    pub component: Option<&'a dyn Fn(Range<u64>) -> bool>,
}

/// Decodes a part into two new `.npy` arrays as [`decode`](super::decode::decode) does. Triangles
/// are in the order of the file. Vertices are numbered anew, chunk by chunk: its own in their order,
/// then those of chunks that are not of the part.
///
/// # Errors
/// [`crate::Error::Input`] for a damaged file; [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn decode_part(
    ws: &Workspace,
    packed: &Packed,
    part: &Part<'_>,
    v: &Path,
    g: &Path,
) -> Result<DecodeCount> {
    let entries = || part.chunks.iter().map(|&c| &packed.entries[c]);
    let sum = |of: fn(&Entry) -> u64| entries().map(of).sum::<u64>();
    let references = sum(|e| e.references);
    let most = entries().map(bytes_of).max().unwrap_or(0);
    let marks = match part.component {
        Some(_) => entries().map(|e| e.triangles).max(),
        None => None,
    };
    let table = 80 * references + 16 * part.chunks.len() as u64;
    let held = most + marks.unwrap_or(0) + table;
    if held > ws.budget.free() {
        // Behind that, what is kept of chunks that are written in part: all of them, at most.
        let partly = entries().filter(|e| e.label_bytes > 0).map(Entry::own);
        let kept = marks.map_or(0, |_| 4 * partly.sum::<u64>());
        ws.budget.check("a part of the chunks", held + kept)?;
    }
    let lease = ws.budget.lease("a part of the chunks", held)?;
    // More than that can only be as many as there are.
    let limit = [sum(Entry::all_triangles), sum(|e| e.vertices)];
    let mut writing = Writing {
        ws,
        packed,
        rows: Rows::create(ws, &packed.head, [v, g], limit)?,
        done: DecodeCount::default(),
        chunks: BTreeMap::new(),
        foreign: BTreeMap::new(),
        leases: vec![lease],
    };
    ws.progress.begin("decode", "triangles", limit[0]);
    for &chunk in &part.chunks {
        let wanted = match part.component {
            Some(component) => wanted(packed, chunk, component)?,
            None => Wanted::All,
        };
        writing.chunk(chunk, &wanted)?;
        ws.progress.advance(packed.entries[chunk].all_triangles());
    }
    ws.progress.end();
    let done = writing.done;
    writing.rows.shape([done.triangles, done.vertices])?;
    Ok(done)
}

/// Which triangles of a chunk are written.
enum Wanted {
    All,
    Some(Vec<bool>),
    None,
}

/// The triangles of a chunk that are of such a component.
fn wanted(packed: &Packed, chunk: usize, component: &dyn Fn(Range<u64>) -> bool) -> Result<Wanted> {
    let entry = &packed.entries[chunk];
    let mut wanted = Vec::with_capacity(entry.triangles as usize);
    if component(entry.components()) {
        packed.labels(chunk, |triangles, label| {
            let this = component(label..label + 1);
            wanted.extend((0..triangles).map(|_| this));
        })?;
    }
    Ok(match wanted.contains(&true) {
        true => Wanted::Some(wanted),
        false => Wanted::None,
    })
}

/// Where the own vertices of a chunk of the part went.
struct Own {
    first: u64,
    /// Their ranks among the chunk's own, ascending; `None` when all are written.
    ranks: Option<Vec<u32>>,
}

/// A part that is being written.
struct Writing<'a> {
    ws: &'a Workspace,
    packed: &'a Packed,
    rows: Rows,
    done: DecodeCount,
    chunks: BTreeMap<u64, Own>,
    /// Numbers of vertices whose owners are not written, by chunk and rank.
    foreign: BTreeMap<(u64, u64), u64>,
    leases: Vec<Lease>,
}

impl Writing<'_> {
    /// Decodes a chunk, and writes what is wanted of it.
    fn chunk(&mut self, chunk: usize, wanted: &Wanted) -> Result<()> {
        let marks = match wanted {
            Wanted::None => return Ok(()),
            Wanted::All => None,
            Wanted::Some(marks) => Some(marks),
        };
        let unpacked = self.packed.chunk(chunk)?;
        let vertices = unpacked.piece.positions.len();
        let all = unpacked.piece.triangles.iter().zip(0..);
        let kept = all.filter(|&(_, t): &(_, usize)| match marks {
            Some(marks) => marks.get(t) == Some(&true),
            None => true,
        });
        let kept: Vec<[u32; 3]> = kept.map(|(t, _)| *t).collect();
        let mut used = vec![marks.is_none(); vertices];
        if marks.is_some() {
            kept.as_flattened()
                .iter()
                .for_each(|&v| used[v as usize] = true);
        }
        let ids = self.number(chunk, &unpacked, &used)?;
        let corners = kept.as_flattened().iter();
        let corners = corners.map(|&v| ids[v as usize]);
        self.rows.triangles(self.done.triangles, corners)?;
        self.done.triangles += kept.len() as u64;
        Ok(())
    }

    /// Numbers the vertices of a chunk that are in use, and writes those that are new.
    fn number(&mut self, chunk: usize, unpacked: &Unpacked, used: &[bool]) -> Result<Vec<u64>> {
        let first = self.done.vertices;
        let mut ids = vec![u64::MAX; used.len()];
        let mut points = Vec::new();
        let mut ranks = Vec::new();
        let mut own = 0;
        unpacked.each_vertex(|number, at, reference| {
            if reference.is_none() {
                if used[number] {
                    ids[number] = first + ranks.len() as u64;
                    ranks.push(own as u32);
                    self.packed.restore(at, &mut points);
                }
                own += 1;
            }
        });
        hold(&self.packed.entries[chunk], unpacked, own)?;
        let mut next = first + ranks.len() as u64;
        let ranks = if ranks.len() as u64 == own {
            None
        } else {
            let what = "vertices that were written";
            let lease = self.ws.budget.lease(what, 4 * ranks.len() as u64)?;
            self.leases.push(lease);
            Some(ranks)
        };
        self.chunks.insert(chunk as u64, Own { first, ranks });
        for r in &unpacked.references {
            let number = unpacked.places[r.place as usize] as usize;
            if !used[number] {
                continue;
            }
            let known = self.written(r);
            ids[number] = known.unwrap_or_else(|| {
                let at = unpacked.piece.positions[number];
                self.packed.restore(at, &mut points);
                self.foreign.insert((r.chunk, r.rank), next);
                next += 1;
                next - 1
            });
        }
        self.rows.points(first, &points)?;
        self.done.vertices = next;
        Ok(ids)
    }

    /// The number of a vertex of an earlier chunk, when it has one.
    fn written(&self, r: &Reference) -> Option<u64> {
        let own = self.chunks.get(&r.chunk).and_then(|own| {
            let place = match &own.ranks {
                None => r.rank,
                Some(ranks) => ranks.binary_search(&(r.rank as u32)).ok()? as u64,
            };
            Some(own.first + place)
        });
        own.or_else(|| self.foreign.get(&(r.chunk, r.rank)).copied())
    }
}
