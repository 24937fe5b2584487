//! What the encoder knows of the surface and the decoder does not.
//!
//! Both sides run the same walk ([`walk`](super::walk)); it asks a [`Truth`] what lies across an
//! edge, tells the answer to the coder, and goes by what the coder hands back.
//!
//! Memory: the encoder's 25 bytes a triangle and 4 a vertex beyond the mesh itself.

use super::NONE;
use super::border::Border;
use super::turned::Turned;

/// The next corner of the same triangle. (Of NONE, which only the decoder has, anything.)
#[inline]
pub fn next(c: u32) -> u32 {
    if c % 3 == 2 { c - 2 } else { c.wrapping_add(1) }
}

/// The corner before.
#[inline]
pub fn prev(c: u32) -> u32 {
    if c.is_multiple_of(3) {
        c.wrapping_add(2)
    } else {
        c - 1
    }
}

/// The surface as far as one side knows it. Corners are those of triangles that agree in
/// orientation with their neighbours.
pub trait Truth {
    /// A corner of a triangle that no walk has reached.
    fn seed(&mut self) -> u32;
    /// The corner across the edge that a corner faces, if its triangle is still to come.
    fn across(&self, corner: u32) -> u32;
    /// The corner across, whether its triangle has come or not.
    fn opposite(&self, corner: u32) -> u32;
    /// The number of a corner's vertex, or NONE.
    fn number(&self, corner: u32) -> u32;
    /// Gives a corner's vertex a number.
    fn meet(&mut self, corner: u32, number: u32);
    /// Where a corner's vertex lies.
    fn position(&self, corner: u32) -> [i32; 3];
    /// True when the corner's triangle is turned against the mesh's.
    fn reversed(&self, corner: u32) -> bool;
    /// The triangle of this corner was coded.
    fn visit(&mut self, corner: u32);
    /// The border edge that a corner of a coded triangle faces.
    fn faces(&mut self, corner: u32, edge: u32);
    /// The first corner of the next triangle that names a vertex twice.
    fn degenerate(&mut self) -> u32;
    /// Gives the next vertex that no triangle names a number; where it lies.
    fn loose(&mut self, number: u32) -> [i32; 3];
    /// The edge of the border that starts at a corner's vertex, where its fan comes to the border.
    fn link(&self, corner: u32, border: &Border) -> u32;
}

/// The decoder's: knows nothing.
#[derive(Debug)]
pub struct Blind;

impl Truth for Blind {
    fn seed(&mut self) -> u32 {
        0
    }
    fn across(&self, _: u32) -> u32 {
        NONE
    }
    fn opposite(&self, _: u32) -> u32 {
        NONE
    }
    fn number(&self, _: u32) -> u32 {
        NONE
    }
    fn meet(&mut self, _: u32, _: u32) {}
    fn position(&self, _: u32) -> [i32; 3] {
        [0; 3]
    }
    fn reversed(&self, _: u32) -> bool {
        false
    }
    fn visit(&mut self, _: u32) {}
    fn faces(&mut self, _: u32, _: u32) {}
    fn degenerate(&mut self) -> u32 {
        0
    }
    fn loose(&mut self, _: u32) -> [i32; 3] {
        [0; 3]
    }
    fn link(&self, _: u32, _: &Border) -> u32 {
        NONE
    }
}

/// The encoder's: a chunk whose triangles were paired and turned to agree.
#[derive(Debug)]
pub struct Surface<'a> {
    mesh: &'a Turned,
    positions: &'a [[i32; 3]],
    loose: &'a [u32],
    numbers: Vec<u32>,
    edges: Vec<u32>,
    visited: Vec<bool>,
    /// The first corner of each triangle that was coded.
    coded: Vec<u32>,
    from: usize,
    degenerate: usize,
}

impl<'a> Surface<'a> {
    /// Nothing is coded yet. `loose` are the vertices that no triangle names.
    pub fn new(mesh: &'a Turned, positions: &'a [[i32; 3]], loose: &'a [u32]) -> Surface<'a> {
        Surface {
            mesh,
            positions,
            loose,
            numbers: vec![NONE; positions.len()],
            edges: vec![NONE; mesh.v.len()],
            visited: mesh.degenerate.clone(),
            coded: Vec::with_capacity(mesh.degenerate.len()),
            from: 0,
            degenerate: 0,
        }
    }

    /// Walks begin at this triangle, or the first behind it that names three vertices.
    pub fn starting_at(mut self, triangle: usize) -> Surface<'a> {
        self.from = triangle;
        self
    }

    /// The number that each vertex was given, or NONE; and the corner at which each triangle
    /// begins, in the order in which they were coded.
    pub fn into_maps(self) -> (Vec<u32>, Vec<u32>) {
        (self.numbers, self.coded)
    }

    fn came(&self, corner: u32) -> bool {
        self.visited[corner as usize / 3]
    }
}

impl Truth for Surface<'_> {
    fn seed(&mut self) -> u32 {
        while self.visited[self.from] {
            self.from = (self.from + 1) % self.visited.len();
        }
        3 * self.from as u32
    }

    #[inline]
    fn across(&self, corner: u32) -> u32 {
        let o = self.mesh.o[corner as usize];
        if o == NONE || self.came(o) { NONE } else { o }
    }

    #[inline]
    fn opposite(&self, corner: u32) -> u32 {
        self.mesh.o[corner as usize]
    }

    #[inline]
    fn number(&self, corner: u32) -> u32 {
        self.numbers[self.mesh.v[corner as usize] as usize]
    }

    fn meet(&mut self, corner: u32, number: u32) {
        self.numbers[self.mesh.v[corner as usize] as usize] = number;
    }

    #[inline]
    fn position(&self, corner: u32) -> [i32; 3] {
        self.positions[self.mesh.v[corner as usize] as usize]
    }

    fn reversed(&self, corner: u32) -> bool {
        self.mesh.turned[corner as usize / 3]
    }

    #[inline]
    fn visit(&mut self, corner: u32) {
        self.visited[corner as usize / 3] = true;
        self.coded.push(corner);
    }

    #[inline]
    fn faces(&mut self, corner: u32, edge: u32) {
        self.edges[corner as usize] = edge;
    }

    fn degenerate(&mut self) -> u32 {
        while !self.mesh.degenerate[self.degenerate] {
            self.degenerate += 1;
        }
        let corner = 3 * self.degenerate as u32;
        self.degenerate += 1;
        self.coded.push(corner);
        corner
    }

    fn loose(&mut self, number: u32) -> [i32; 3] {
        let Some((&v, rest)) = self.loose.split_first() else {
            return [0; 3];
        };
        self.loose = rest;
        self.numbers[v as usize] = number;
        self.positions[v as usize]
    }

    /// Turns about the vertex both ways at once, through triangles that are still to come, until
    /// one that has come is met: its edge is on the border, and starts or ends at the vertex.
    fn link(&self, corner: u32, border: &Border) -> u32 {
        let number = self.number(corner);
        let fits = |edge: u32| border.alive(edge) && border[edge].org == number;
        let (mut ahead, mut back) = (corner, corner);
        let (mut ahead_ends, mut back_ends) = (false, false);
        while !(ahead_ends && back_ends) {
            if !ahead_ends {
                let y = self.mesh.o[next(ahead) as usize];
                if y == NONE {
                    ahead_ends = true;
                } else if self.came(y) {
                    let edge = self.edges[y as usize];
                    if fits(edge) {
                        return edge;
                    }
                    ahead_ends = true;
                } else {
                    ahead = next(y);
                    if ahead == corner {
                        return NONE;
                    }
                }
            }
            if !back_ends {
                let y = self.mesh.o[prev(back) as usize];
                if y == NONE {
                    back_ends = true;
                } else if self.came(y) {
                    let edge = self.edges[y as usize];
                    if border.alive(edge) && fits(border[edge].next) {
                        return border[edge].next;
                    }
                    back_ends = true;
                } else {
                    back = prev(y);
                }
            }
        }
        NONE
    }
}
