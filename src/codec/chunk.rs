//! One chunk: triangles with local vertices to bytes, and back.
//!
//! Why a chunk stands alone: its coder starts with fresh models, and every vertex that it names has
//! its position here. So chunks are coded and decoded in any order, by any thread.
//!
//! Memory: to encode [`TRIANGLE_BYTES`] and [`VERTEX_BYTES`], to decode [`DECODE_BYTES`] a triangle;
//! [`MODEL_BYTES`] for the models.

use super::lattice::Lattice;
use super::mix::Mixed;
use super::model::{Fast, Model};
use super::range::{Coder, Decoder, Encoder};
use super::truth::{Blind, Surface};
use super::turned::Turned;
use super::walk::{Extent, Walk};
use super::{Damaged, Level, NONE};

/// Bytes a triangle that [`encode`] takes besides its arguments: the turned triangles (26), the
/// edges that corners face, the marks and the order of what was coded (17), the triangles as coded
/// (12), the border and the list of its gates (44), the bytes (4).
pub const TRIANGLE_BYTES: u64 = 103;
/// Bytes a vertex: its number, position, valence, marks, and its coordinates while they are sorted,
/// its place.
pub const VERTEX_BYTES: u64 = 4 + 16 + 1 + 1 + 4 + 8 + 5;
/// Bytes a triangle that [`decode`] takes, its result included.
pub const DECODE_BYTES: u64 = 148;
/// Bytes of the models of either level.
pub const MODEL_BYTES: u64 = 4 << 20;

/// A part of a mesh, with local vertices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Piece {
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Positions of all vertices; those that neither a triangle nor `loose` names are left out.
    pub positions: Vec<[i32; 3]>,
    /// Vertices that no triangle names.
    pub loose: Vec<u32>,
}

/// A coded piece.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coded {
    /// What a decoder must be told.
    pub extent: Extent,
    /// The bytes.
    pub bytes: Vec<u8>,
    /// The number that each vertex of the piece has in the chunk, or NONE.
    pub numbers: Vec<u32>,
    /// The number of the vertex at each place.
    pub places: Vec<u32>,
    /// The corner of the piece that each coded triangle's first vertex is at.
    pub corners: Vec<u32>,
    /// Bytes of the connectivity and of the positions, about.
    pub split: [u64; 2],
}

/// Codes a piece.
///
/// # Errors
/// [`Damaged`] when the walk contradicts itself, which is a fault of this program.
pub fn encode(piece: &Piece, level: Level) -> Result<Coded, Damaged> {
    match level {
        Level::Fast => encode_with::<Fast>(piece),
        Level::Strong => encode_with::<Mixed>(piece),
    }
}

fn encode_with<M: Model>(piece: &Piece) -> Result<Coded, Damaged> {
    let turned = Turned::new(piece.triangles.as_flattened(), piece.positions.len());
    let mut used = vec![false; piece.positions.len()];
    for &v in piece.triangles.as_flattened().iter().chain(&piece.loose) {
        used[v as usize] = true;
    }
    let degenerate = turned.degenerates();
    let extent = Extent {
        triangles: piece.triangles.len() - degenerate,
        degenerate,
        vertices: used.iter().filter(|u| **u).count(),
        loose: piece.loose.len(),
        turns: turned.turned.contains(&true),
    };
    let lattice = Lattice::find(&piece.positions, &used);
    drop(used);
    let lattice = choose(piece, &turned, extent, lattice)?;
    let mut surface = Surface::new(&turned, &piece.positions, &piece.loose);
    let mut coder = Encoder::new(Vec::new());
    let mut walk = Walk::<M>::default();
    walk.places.lattice = lattice;
    walk.reserve(extent);
    walk.run(extent, &mut surface, &mut coder)?;
    let (all, positions) = (coder.spent(), walk.places.spent);
    let (numbers, mut corners) = surface.into_maps();
    corners.iter_mut().for_each(|c| *c = turned.own(*c));
    Ok(Coded {
        extent,
        numbers,
        places: places(&walk.rim, extent.vertices),
        corners,
        bytes: coder.finish(),
        split: [all - positions, positions].map(|bits| bits >> 19),
    })
}

/// Triangles that a choice is tried on, at each of [`SAMPLES`] places.
const SAMPLE: usize = 1 << 13;
/// Places at which a choice is tried.
const SAMPLES: usize = 2;

/// Of the lists of repeated coordinates those that serve on samples of the triangles: each axis is
/// tried without.
///
/// Why so few triangles: what a surface is like shows soon, and each trial costs time. Lists count by
/// the share of the triangles that the samples are. Trials are compared by bytes, which are the same
/// on every machine.
fn choose(
    piece: &Piece,
    turned: &Turned,
    extent: Extent,
    lattice: Lattice,
) -> Result<Lattice, Damaged> {
    let trial = |lattice: &Lattice| -> Result<u64, Damaged> {
        let lists = {
            let mut coder = Encoder::new(Vec::new());
            lattice
                .clone()
                .code(&mut Fast::new(), &mut coder, extent.vertices)?;
            coder.finish().len() as u64
        };
        let (mut done, mut bytes) = (0, 0);
        for place in 0..SAMPLES {
            let first = piece.triangles.len() / SAMPLES * place;
            let mut surface = Surface::new(turned, &piece.positions, &[]).starting_at(first);
            let mut walk = Walk::<Fast>::default();
            let mut coder = Encoder::new(Vec::new());
            walk.places.lattice = lattice.clone();
            let most = SAMPLE.min(extent.triangles / SAMPLES);
            walk.part(extent, most, &mut surface, &mut coder)?;
            done += walk.triangles.len() as u64;
            bytes += (coder.finish().len() as u64).saturating_sub(lists);
        }
        let all = (extent.triangles as u64).max(done);
        Ok(bytes + lists * done / all.max(1))
    };
    if lattice == Lattice::default() {
        return Ok(lattice);
    }
    let mut least = trial(&lattice)?;
    let mut best = lattice;
    for axis in 0..3 {
        if best.values[axis].is_empty() {
            continue;
        }
        let mut without = best.clone();
        without.values[axis].clear();
        let bytes = trial(&without)?;
        if bytes < least {
            (best, least) = (without, bytes);
        }
    }
    Ok(best)
}

/// Decodes a chunk: its vertices in the order of their numbers, and the number of that at each place.
///
/// # Errors
/// [`Damaged`] when the bytes are not those of a chunk of this extent.
pub fn decode(bytes: &[u8], extent: Extent, level: Level) -> Result<(Piece, Vec<u32>), Damaged> {
    match level {
        Level::Fast => decode_with::<Fast>(bytes, extent),
        Level::Strong => decode_with::<Mixed>(bytes, extent),
    }
}

fn decode_with<M: Model>(bytes: &[u8], extent: Extent) -> Result<(Piece, Vec<u32>), Damaged> {
    let mut coder = Decoder::new(bytes);
    let mut walk = Walk::<M>::default();
    walk.run(extent, &mut Blind, &mut coder)?;
    if !coder.ended() {
        return Err(Damaged("another number of bytes than its triangles take"));
    }
    let vertices = walk.places.len();
    let first_loose = (vertices - extent.loose) as u32;
    let places = places(&walk.rim, vertices);
    let piece = Piece {
        positions: (0..vertices).map(|v| walk.places.position(v)).collect(),
        triangles: walk.triangles,
        loose: (first_loose..vertices as u32).collect(),
    };
    Ok((piece, places))
}

/// The numbers of a chunk's vertices in the order of their places: first along the rim, each part of
/// it from its least number on.
///
/// Why: nearly all vertices that chunks share lie there, and those that follow each other along a
/// seam have places that follow each other in both chunks.
fn places(rim: &[u32], vertices: usize) -> Vec<u32> {
    let mut places = Vec::with_capacity(vertices);
    let mut placed = vec![false; vertices];
    for first in 0..vertices as u32 {
        let mut v = first;
        while let Some(&behind) = rim.get(v as usize)
            && behind != NONE
            && !std::mem::replace(&mut placed[v as usize], true)
        {
            places.push(v);
            v = behind;
        }
    }
    let others = (0..vertices as u32).filter(|v| !placed[*v as usize]);
    places.extend(others);
    places
}

/// The vertices of a piece in the order of their numbers: the inverse of [`Coded::numbers`].
pub fn order(numbers: &[u32]) -> Vec<u32> {
    let count = numbers.iter().filter(|n| **n != NONE).count();
    let mut order = vec![NONE; count];
    for (v, &n) in numbers.iter().enumerate() {
        if n != NONE {
            order[n as usize] = v as u32;
        }
    }
    order
}
