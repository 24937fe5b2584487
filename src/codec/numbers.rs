//! The numbers that triangles and vertices had in the folder, for a file that keeps their order.
//!
//! Why by chunk, shared vertices included: a chunk stands alone, so it can be put back in its place
//! without a look at any other.
//!
//! Memory: the bytes; a model; 8 bytes a triangle and a vertex of the chunk for what is decoded.

use super::Damaged;
use super::model::{Contexts, Fast, Model, NUMBER, TURN};
use super::range::{Coder, Decoder, Encoder};

/// Classes of numbers: the contexts of each sort.
const CLASSES: u32 = 36;
/// The context of steps that are far, behind those of both sorts.
const FAR: u32 = 2 * CLASSES;

/// The numbers of a chunk, as the folder has them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Numbers {
    /// The corner that each triangle's first vertex is at, in the order in which they are coded.
    pub corners: Vec<u64>,
    /// The number of each vertex, in the order of their numbers in the chunk.
    pub vertices: Vec<u64>,
}

/// Numbers of one sort: the last, and the class of the step to it.
#[derive(Default)]
struct Sort {
    base: u32,
    last: u64,
    class: u32,
}

impl Sort {
    /// Codes a number by what it is more than the last.
    fn code(&mut self, model: &mut Fast, coder: &mut impl Coder, number: u64) -> u64 {
        let step = number.wrapping_sub(self.last) as i64;
        let mains = (self.base + self.class, FAR);
        let step = model.step(coder, NUMBER, mains, self.class, step);
        self.class = (64 - step.unsigned_abs().leading_zeros()).min(CLASSES - 1);
        self.last = self.last.wrapping_add(step as u64);
        self.last
    }
}

/// The models of both sorts.
struct State {
    model: Fast,
    triangles: Sort,
    vertices: Sort,
    turn: u32,
}

impl State {
    fn new() -> State {
        State {
            model: Fast::new(),
            triangles: Sort::default(),
            vertices: Sort {
                base: CLASSES,
                ..Sort::default()
            },
            turn: 0,
        }
    }

    /// Codes a corner: its triangle, and which of that it is.
    fn corner(&mut self, coder: &mut impl Coder, corner: u64) -> u64 {
        let triangle = self.triangles.code(&mut self.model, coder, corner / 3);
        let turn = (corner % 3) as u32;
        let mut bit = |main: u32, bit: bool| {
            let contexts = Contexts::of(main);
            self.model.bit(coder, TURN, &contexts, bit)
        };
        self.turn = match bit(2 * self.turn, turn > 0) {
            false => 0,
            true => 1 + u32::from(bit(2 * self.turn + 1, turn > 1)),
        };
        triangle.wrapping_mul(3).wrapping_add(self.turn.into())
    }

    fn vertex(&mut self, coder: &mut impl Coder, vertex: u64) -> u64 {
        self.vertices.code(&mut self.model, coder, vertex)
    }
}

/// Codes the corners, then the vertices.
pub(super) fn encode(
    corners: impl Iterator<Item = u64>,
    vertices: impl Iterator<Item = u64>,
) -> Vec<u8> {
    let mut coder = Encoder::new(Vec::new());
    let mut state = State::new();
    corners.for_each(|corner| _ = state.corner(&mut coder, corner));
    vertices.for_each(|vertex| _ = state.vertex(&mut coder, vertex));
    coder.finish()
}

/// Decodes the numbers of so many triangles and vertices, in a mesh of `all` of each.
///
/// # Errors
/// [`Damaged`] when the bytes are none that such numbers have.
pub(super) fn decode(
    bytes: &[u8],
    [triangles, vertices]: [u64; 2],
    all: [u64; 2],
) -> Result<Numbers, Damaged> {
    let mut coder = Decoder::new(bytes);
    let mut state = State::new();
    let mut numbers = Numbers::default();
    for _ in 0..triangles {
        let corner = state.corner(&mut coder, 0);
        if state.triangles.last >= all[0] {
            return Err(Damaged("the number of no triangle of the mesh"));
        }
        numbers.corners.push(corner);
    }
    for _ in 0..vertices {
        let vertex = state.vertex(&mut coder, 0);
        if vertex >= all[1] {
            return Err(Damaged("the number of no vertex of the mesh"));
        }
        numbers.vertices.push(vertex);
    }
    if !coder.ended() {
        return Err(Damaged("another number of bytes than its numbers take"));
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let far = (1 << 60) + 12345;
        for (corners, vertices) in [
            (vec![], vec![]),
            (
                (0..3000).map(|i| i * 7 % 3000).collect(),
                (0..999).rev().collect(),
            ),
            (
                vec![2, 1, 0, far, far + 4, 5, 3 << 35],
                vec![far, 0, far, 1 << 34, 1 << 35],
            ),
        ] {
            let bytes = encode(corners.iter().copied(), vertices.iter().copied());
            let counts = [corners.len() as u64, vertices.len() as u64];
            let largest = |all: &[u64]| all.iter().max().map_or(0, |m| m + 1);
            let all = [largest(&corners).div_ceil(3), largest(&vertices)];
            let expected = Numbers { corners, vertices };
            assert_eq!(decode(&bytes, counts, all).unwrap(), expected);
            if counts[0] > 0 {
                decode(&bytes, counts, [all[0] - 1, all[1]]).unwrap_err();
                decode(&bytes, counts, [all[0], all[1] - 1]).unwrap_err();
                decode(&bytes, [counts[0] - 1, counts[1]], all).unwrap_err();
            }
        }
    }

    #[test]
    fn numbers_in_a_row_cost_little() {
        let bytes = encode((0..10000).map(|t| 3 * t), 0..5000);
        assert!(bytes.len() < 100, "{}", bytes.len());
    }
}
