//! A chunk's triangles, paired, and turned so that neighbours agree in orientation.
//!
//! Why it works: [`Pairs`] links two corners on an edge that no third shares, [`Swirl`] says which
//! triangles must be turned to agree with the first of their part; where two links contradict each
//! other (a Moebius strip) the later one is cut. A walk needs nothing more: what it cannot cross it
//! takes for a border, and vertices that are met again are named.
//!
//! Memory: 26 bytes a triangle for the result; 60 more while it is made.

use super::NONE;
use crate::chunk::pair::{Pairs, SPECIAL};
use crate::chunk::swirl::{NO_COMPONENT, Swirl};

/// Triangles that agree with their neighbours.
#[derive(Clone, Debug, Default)]
pub struct Turned {
    /// Vertex of each corner.
    pub v: Vec<u32>,
    /// Opposite of each corner, or NONE.
    pub o: Vec<u32>,
    /// Triangles that were turned.
    pub turned: Vec<bool>,
    /// Triangles that name a vertex twice.
    pub degenerate: Vec<bool>,
}

/// The number of a corner after its triangle was flipped or not.
fn flipped(c: u32, flip: bool) -> u32 {
    if flip { c / 3 * 3 + (3 - c % 3) % 3 } else { c }
}

impl Turned {
    /// Pairs and turns the triangles of corners `flat`, whose vertices lie below `span`.
    pub fn new(flat: &[u32], span: usize) -> Turned {
        let mut pairs = Pairs::default();
        pairs.pair(flat, &vec![false; span]);
        let mut swirl = Swirl::default();
        swirl.walk(&pairs.opposite);
        let flips = |l: &u32| *l != NO_COMPONENT && l & 1 == 1;
        let turned: Vec<bool> = swirl.label.iter().map(flips).collect();
        let mut v = vec![0; flat.len()];
        let mut o = vec![NONE; flat.len()];
        for c in 0..flat.len() as u32 {
            let own = turned[c as usize / 3];
            let at = flipped(c, own) as usize;
            v[at] = flat[c as usize];
            let across = pairs.opposite[c as usize];
            if across >= SPECIAL {
                continue;
            }
            let (other, parity) = (across >> 1, across & 1 == 1);
            let its = turned[other as usize / 3];
            if own ^ its == parity {
                o[at] = flipped(other, its);
            }
        }
        let degenerate = swirl.label.iter().map(|&l| l == NO_COMPONENT).collect();
        Turned {
            v,
            o,
            turned,
            degenerate,
        }
    }

    /// The corner of the mesh's own triangle that a corner is.
    pub fn own(&self, corner: u32) -> u32 {
        flipped(corner, self.turned[corner as usize / 3])
    }

    /// Number of triangles that name a vertex twice.
    pub fn degenerates(&self) -> usize {
        self.degenerate.iter().filter(|d| **d).count()
    }
}
