//! One chunk: triangles with local vertices, to bytes and back.

use super::lattice::Lattice;
use super::model::Model;
use super::range::{Coder, Decoder, Encoder};
use super::truth::{Blind, Surface};
use super::walk::{Extent, Walk};
use super::{Damaged, NONE};
use crate::chunk::pair::{Pairs, SPECIAL};
use crate::chunk::swirl::{NO_COMPONENT, Swirl};

/// A part of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Piece {
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Positions.
    pub positions: Vec<[i32; 3]>,
}

/// The surface of a piece: turned so that neighbours agree.
pub struct Turned {
    v: Vec<u32>,
    o: Vec<u32>,
    turned: Vec<bool>,
    degenerate: Vec<bool>,
}

/// The other number of a corner whose triangle was flipped.
fn flipped(c: u32, flip: bool) -> u32 {
    if flip { c / 3 * 3 + (3 - c % 3) % 3 } else { c }
}

impl Turned {
    /// Pairs and turns the triangles.
    pub fn new(piece: &Piece) -> Turned {
        let flat = piece.triangles.as_flattened();
        let mut pairs = Pairs::default();
        pairs.pair(flat, &vec![false; piece.positions.len()]);
        let mut swirl = Swirl::default();
        swirl.walk(&pairs.opposite);
        let flips: Vec<bool> = swirl
            .label
            .iter()
            .map(|&l| l != NO_COMPONENT && l & 1 == 1)
            .collect();
        let mut v = vec![0; flat.len()];
        let mut o = vec![NONE; flat.len()];
        for c in 0..flat.len() as u32 {
            let own = flips[c as usize / 3];
            let at = flipped(c, own) as usize;
            v[at] = flat[c as usize];
            let across = pairs.opposite[c as usize];
            if across >= SPECIAL {
                continue;
            }
            let (other, parity) = (across >> 1, across & 1 == 1);
            let its = flips[other as usize / 3];
            if own ^ its == parity {
                o[at] = flipped(other, its);
            }
        }
        Turned {
            v,
            o,
            degenerate: swirl.label.iter().map(|&l| l == NO_COMPONENT).collect(),
            turned: flips,
        }
    }
}

/// Codes a piece.
pub fn encode<M: Model>(piece: &Piece) -> (Vec<u8>, Vec<u32>, [u64; 2]) {
    let turned = Turned::new(piece);
    let mut coder = Encoder::new(Vec::new());
    let whole = turned.degenerate.iter().filter(|d| !**d).count();
    let extent = Extent {
        triangles: whole,
        vertices: piece.positions.len(),
        turns: turned.turned.iter().any(|t| *t),
    };
    coder.plain(32, extent.triangles as u64);
    coder.plain(32, extent.vertices as u64);
    coder.plain(1, u64::from(extent.turns));
    let mut surface = Surface::new(
        &turned.v,
        &turned.o,
        &turned.turned,
        &piece.positions,
        |t| turned.degenerate[t],
    );
    let mut walk = Walk::<M>::new();
    walk.places.lattice = Lattice::find(&piece.positions);
    let done = walk.run(extent, &mut surface, &mut coder);
    assert_eq!(done, Ok(()));
    let split = [coder.spent() - walk.places.spent, walk.places.spent];
    (coder.finish(), surface.into_numbers(), split)
}

/// Decodes a piece.
pub fn decode<M: Model>(bytes: &[u8]) -> Result<Piece, Damaged> {
    let mut coder = Decoder::new(bytes);
    let extent = Extent {
        triangles: coder.plain(32, 0) as usize,
        vertices: coder.plain(32, 0) as usize,
        turns: coder.plain(1, 0) == 1,
    };
    let mut walk = Walk::<M>::new();
    walk.run(extent, &mut Blind, &mut coder)?;
    Ok(Piece {
        positions: (0..walk.places.len())
            .map(|v| walk.places.position(v))
            .collect(),
        triangles: walk.triangles,
    })
}
