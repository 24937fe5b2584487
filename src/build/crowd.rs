//! The load of a crowd: of the triangles at hubs, which no cell and no chunk settles.
//!
//! Why it is counted apart: their numbers follow from the share of the triangles that are at hubs,
//! whatever the order and the plan.
//!
//! Memory: none. I/O: none.

use super::piece::Piece;
use super::plan::Shape;
use super::sample::Nature;
use super::stars::records::Part;

/// What hangs together at a hub, which no cell and no chunk settles: triangles that are local
/// components of their own, from the seams to the table of components.
pub struct Crowd {
    /// Bytes of a word.
    width: u64,
    /// Triangles of their own.
    alone: u64,
    /// Corners on non-manifold edges.
    pub cuts: u64,
    /// Corners at hubs.
    hubs: u64,
    /// Triangles that are components.
    pub single: u64,
    measures: bool,
}

impl Crowd {
    /// That of a mesh of this nature.
    pub fn new(shape: &Shape, nature: &Nature) -> Crowd {
        let of = |share: f64| (share * shape.triangles as f64) as u64;
        let hubs = nature.hubs;
        // Of those at one hub some lie in smaller cells; how many is not known before the cells are.
        let here = if nature.looked > 0 { 0.85 } else { 1.0 };
        Crowd {
            width: shape.record(),
            alone: of(hubs.knotted + here * (hubs.met - hubs.knotted)),
            cuts: of(nature.hubs.knots),
            hubs: of(nature.hubs.corners),
            single: of(nature.hubs.knotted),
            measures: shape.measures,
        }
    }

    /// Bytes of its parts of fans, with what tells twins.
    fn parts(&self) -> u64 {
        let parts = self.alone * 4 * self.width
            + 3 * self.alone * size_of::<Part<u32>>() as u64 / 4 * self.width;
        // Ends by edge with the heads of their parts; later open fans by chain.
        let hubs = 10 * self.hubs * self.width;
        if self.measures { parts.max(hubs) } else { 0 }
    }

    /// Bytes of what is known of its components before their rows are written.
    pub fn sums(&self) -> u64 {
        // Loops, and corners on non-manifold edges, with their labels and their shared vertices.
        let words = 2 * 2 * self.single + 3 * self.cuts + 4 * self.hubs.min(self.cuts);
        size_of::<Piece>() as u64 * self.single + words * self.width
    }

    /// The most scratch space at once, beside so many bytes.
    pub fn beside(&self, held: u64) -> u64 {
        if self.alone == 0 {
            return 0;
        }
        let own = held + 5 * self.width * self.alone;
        let corners = 3 * self.alone;
        // Two opposites and a link for each regular edge, two words for each corner on another.
        let settled =
            3 * self.width * corners.saturating_sub(self.cuts) + 2 * self.width * self.cuts;
        let edges = 4 * self.width * corners;
        own + edges.max(settled + self.parts().max(self.sums()))
    }
}
