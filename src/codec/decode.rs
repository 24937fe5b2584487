//! A compressed file to V and G.
//!
//! Why chunks go in any order: the index says how many vertices each chunk calls its own, so the
//! mesh's numbers of a chunk's vertices are known from the index and from the chunk's references,
//! and its triangles and coordinates have their places in the arrays.
//!
//! A part of the chunks is decoded one after the other, and reads nothing but their bytes: a chunk
//! has the positions of all its vertices, those of earlier chunks included. Where two of the part
//! refer to the same vertex of a chunk that is not, it becomes one vertex.
//!
//! Memory: the index; for a part 80 bytes for each reference in it; for each thread a chunk, by what its entry says, with fewer threads when there
//! is less. I/O: the file once; V and G written once.

use super::chunk::{DECODE_BYTES, MODEL_BYTES};
use super::file::{Entry, Packed};
use super::seam::Reference;
use crate::corner::Index;
use crate::disk::{DataFile, Workers, Workspace};
use crate::error::{Result, conserve};
use crate::folder::{fits_u4, npy};
use std::collections::BTreeMap;
use std::path::Path;

/// What was decoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecodeCount {
    /// Triangles.
    pub triangles: u64,
    /// Vertices.
    pub vertices: u64,
}

/// Decodes a file into two new `.npy` arrays, V and, when it has coordinates, G.
///
/// # Errors
/// [`crate::Error::Input`] for a damaged file; [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn decode(ws: &Workspace, packed: &Packed, v: &Path, g: &Path) -> Result<DecodeCount> {
    let head = &packed.head;
    let bytes = usize::from(head.coords);
    let points = match bytes {
        0 => None,
        _ => {
            let descr = if bytes == 8 { "<f8" } else { "<f4" };
            let file = create(ws, g, descr, head.vertices, 3 * bytes as u64)?;
            Some((file, 3 * bytes as u64))
        }
    };
    let narrow = fits_u4(head.triangles, head.vertices);
    let (descr, row) = if narrow {
        (u32::DESCR, 12)
    } else {
        (u64::DESCR, 24)
    };
    let out = Arrays {
        v: create(ws, v, descr, head.triangles, row)?,
        g: points,
        narrow,
    };
    let most = packed.entries.iter().map(bytes_of).max().unwrap_or(0);
    let threads = ws.budget.free() / most.max(1);
    let few = Workers::new(threads.clamp(1, ws.workers.count() as u64) as usize)?;
    let mut first = Vec::with_capacity(packed.entries.len());
    let mut sum = 0;
    for entry in &packed.entries {
        first.push(sum);
        sum += entry.all_triangles();
    }
    ws.progress.begin("decode", "triangles", head.triangles);
    few.run(
        packed.entries.len() as u64,
        || ws.budget.lease("a chunk", most),
        |_, chunk| {
            let chunk = chunk as usize;
            let places = (first[chunk], packed.first_vertex[chunk]);
            out.chunk(packed, chunk, places, |r, _| {
                packed.first_vertex[r.chunk as usize] + r.rank
            })?;
            let done = packed.entries[chunk].all_triangles();
            ws.progress.advance(done);
            Ok(())
        },
        |_| Ok(()),
    )?;
    ws.progress.end();
    Ok(DecodeCount {
        triangles: head.triangles,
        vertices: head.vertices,
    })
}

/// Decodes these chunks alone, ascending, into two new `.npy` arrays as [`decode`] does. Vertices
/// are numbered anew: those that the chunks own first, in their order.
///
/// # Errors
/// [`crate::Error::Input`] for a damaged file; [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn decode_some(
    ws: &Workspace,
    packed: &Packed,
    chunks: &[usize],
    v: &Path,
    g: &Path,
) -> Result<DecodeCount> {
    let entries = || chunks.iter().map(|&c| &packed.entries[c]);
    let triangles = entries().map(Entry::all_triangles).sum();
    let references: u64 = entries().map(|e| e.references).sum();
    let mut owned = 0;
    let mut first = Vec::with_capacity(chunks.len());
    for entry in entries() {
        first.push(owned);
        owned += entry.own();
    }
    let most = entries().map(bytes_of).max().unwrap_or(0);
    let _lease = ws.budget.lease("a chunk", most)?;
    let table = 80 * references + 8 * chunks.len() as u64;
    let _foreign = ws
        .budget
        .lease("vertices of chunks that are not decoded", table)?;
    let bytes = u64::from(packed.head.coords);
    let narrow = fits_u4(triangles, owned + references);
    let descr = if narrow { u32::DESCR } else { u64::DESCR };
    let row = if narrow { 12 } else { 24 };
    let out = Arrays {
        v: create(ws, v, descr, triangles, row)?,
        g: match bytes {
            0 => None,
            _ => Some((DataFile::create_new(g, &ws.io)?, 3 * bytes)),
        },
        narrow,
    };
    let mut foreign = BTreeMap::new();
    let mut late = Vec::new();
    let mut done = 0;
    ws.progress.begin("decode", "triangles", triangles);
    for (&chunk, &base) in chunks.iter().zip(&first) {
        out.chunk(packed, chunk, (done, base), |r, at| {
            match chunks.binary_search(&(r.chunk as usize)) {
                Ok(i) => first[i] + r.rank,
                Err(_) => {
                    let next = owned + foreign.len() as u64;
                    *foreign.entry((r.chunk, r.rank)).or_insert_with(|| {
                        let wide = packed.head.coords == 8;
                        packed.grid.restore(wide, at, &mut late);
                        next
                    })
                }
            }
        })?;
        done += packed.entries[chunk].all_triangles();
        ws.progress.advance(packed.entries[chunk].all_triangles());
    }
    ws.progress.end();
    let vertices = owned + foreign.len() as u64;
    if let Some((g, row)) = &out.g {
        let descr = if bytes == 8 { "<f8" } else { "<f4" };
        g.write_at(&npy::header_bytes(descr, &[vertices, 3]), 0)?;
        g.write_at(&late, npy::DATA_START + owned * row)?;
        g.set_len(npy::DATA_START + vertices * row)?;
    }
    Ok(DecodeCount {
        triangles,
        vertices,
    })
}

/// Bytes that a chunk takes while it is decoded.
fn bytes_of(entry: &Entry) -> u64 {
    let sized = entry.all_triangles() * DECODE_BYTES + entry.loose * 64;
    entry.bytes + entry.reference_bytes + sized + entry.references * 48 + MODEL_BYTES
}

/// The arrays that are written.
struct Arrays {
    v: DataFile,
    g: Option<(DataFile, u64)>,
    narrow: bool,
}

impl Arrays {
    /// Decodes one chunk and writes what is its, from its first triangle and its first own vertex
    /// on; `refer` says which vertex a reference means, told where it lies.
    fn chunk(
        &self,
        packed: &Packed,
        chunk: usize,
        (first_triangle, base): (u64, u64),
        mut refer: impl FnMut(&Reference, [i32; 3]) -> u64,
    ) -> Result<()> {
        let (piece, references) = packed.chunk(chunk)?;
        let mut ids = Vec::with_capacity(piece.positions.len());
        let mut rest = &references[..];
        let mut own = 0;
        let mut points = Vec::new();
        for (number, &at) in piece.positions.iter().enumerate() {
            match rest.split_first() {
                Some((r, others)) if r.number == number as u64 => {
                    ids.push(refer(r, at));
                    rest = others;
                }
                _ => {
                    ids.push(base + own);
                    own += 1;
                    packed
                        .grid
                        .restore(packed.head.coords == 8, at, &mut points);
                }
            }
        }
        let entry = &packed.entries[chunk];
        conserve("decode", "vertices of a chunk", entry.own(), own)?;
        let triangles = piece.triangles.len() as u64;
        conserve(
            "decode",
            "triangles of a chunk",
            entry.all_triangles(),
            triangles,
        )?;
        if let Some((g, row)) = &self.g {
            g.write_at(&points, npy::DATA_START + base * row)?;
        }
        drop(points);
        let corners = piece.triangles.as_flattened().iter();
        let corners = corners.map(|&v| ids[v as usize]);
        let at = npy::DATA_START + first_triangle * if self.narrow { 12 } else { 24 };
        if self.narrow {
            let v: Vec<u32> = corners.map(|v| (v as u32).to_le()).collect();
            self.v.write_at(bytemuck::cast_slice(&v), at)
        } else {
            let v: Vec<u64> = corners.map(u64::to_le).collect();
            self.v.write_at(bytemuck::cast_slice(&v), at)
        }
    }
}

/// A new array of `rows` rows of three.
fn create(ws: &Workspace, path: &Path, descr: &str, rows: u64, row: u64) -> Result<DataFile> {
    let file = DataFile::create_new(path, &ws.io)?;
    file.write_at(&npy::header_bytes(descr, &[rows, 3]), 0)?;
    file.set_len(npy::DATA_START + rows * row)?;
    Ok(file)
}
