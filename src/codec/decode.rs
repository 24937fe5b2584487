//! A compressed file to V and G.
//!
//! Why chunks go in any order: the index says how many vertices each chunk calls its own, so the
//! mesh's numbers of a chunk's vertices are known from the index and from the chunk's references,
//! and its triangles and coordinates have their places in the arrays.
//!
//! Memory: the index; for each thread a chunk, by what its entry says, with fewer threads when there
//! is less. I/O: the file once; V and G written once.

use super::chunk::{DECODE_BYTES, MODEL_BYTES};
use super::file::{Entry, Packed};
use crate::corner::Index;
use crate::disk::{DataFile, Workers, Workspace};
use crate::error::Result;
use crate::folder::{fits_u4, npy};
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
            out.chunk(packed, chunk as usize, first[chunk as usize])?;
            let done = packed.entries[chunk as usize].all_triangles();
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
    /// Decodes one chunk and writes what is its.
    fn chunk(&self, packed: &Packed, chunk: usize, first_triangle: u64) -> Result<()> {
        let (piece, references) = packed.chunk(chunk)?;
        let mut ids = Vec::with_capacity(piece.positions.len());
        let mut rest = &references[..];
        let base = packed.first_vertex[chunk];
        let mut own = 0;
        let mut points = Vec::new();
        for (number, &at) in piece.positions.iter().enumerate() {
            match rest.split_first() {
                Some((r, others)) if r.number == number as u64 => {
                    ids.push(packed.first_vertex[r.chunk as usize] + r.rank);
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
