//! Rows of the usual layouts, many at a time.
//!
//! Why these are fast: where every row of an element has the same layout (a vertex of scalars;
//! a face of scalars and one list, as long as its length is 3) the rows in the buffer are
//! copied in one loop without a decision for each value. A face of another length ends that
//! loop, as does an index that 4 bytes cannot name beside NONE.
//!
//! Memory and I/O: the caller's buffers.

use super::{Plan, Scalar, Step};
use crate::input::CoordKind;
use crate::input::reader::PEEK;

/// A layout of vertices that is gathered in one loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct VertexLayout {
    pub(super) stride: usize,
    /// Where x, y and z lie in a row.
    at: [usize; 3],
}

/// A layout of triangles that is gathered in one loop: a row is `before` bytes, a count of one
/// byte (3), three ids of 4 bytes, and `after` bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FaceLayout {
    before: usize,
    after: usize,
    signed: bool,
}

impl VertexLayout {
    /// The layout when all is scalar and x, y, z are of the type that is stored.
    pub(super) fn of(plan: &Plan, kind: CoordKind) -> Option<VertexLayout> {
        let stored = match kind {
            CoordKind::F4 => Scalar::F32,
            CoordKind::F8 => Scalar::F64,
        };
        let mut layout = VertexLayout {
            stride: 0,
            at: [0; 3],
        };
        for step in &plan.steps {
            match *step {
                Step::Skip(scalar) => layout.stride += scalar.bytes(),
                Step::Coord(axis, scalar) if scalar == stored => {
                    layout.at[axis] = layout.stride;
                    layout.stride += scalar.bytes();
                }
                _ => return None,
            }
        }
        (layout.stride <= PEEK).then_some(layout)
    }
}

impl FaceLayout {
    pub(super) fn of(plan: &Plan) -> Option<FaceLayout> {
        let mut layout = None;
        let mut bytes = 0;
        for step in &plan.steps {
            match *step {
                Step::Skip(scalar) => bytes += scalar.bytes(),
                Step::Face { count, item } if count.bytes() == 1 && item.bytes() == 4 => {
                    layout = Some((bytes, item == Scalar::I32));
                    bytes = 0;
                }
                _ => return None,
            }
        }
        let (before, signed) = layout?;
        (before + 13 + bytes <= PEEK).then_some(FaceLayout {
            before,
            after: bytes,
            signed,
        })
    }

    pub(super) fn stride(self) -> usize {
        self.before + 13 + self.after
    }
}

/// Copies x, y, z of each row, N bytes each; returns how many rows `out` had room for.
pub(super) fn gather<const N: usize, const SWAP: bool>(
    input: &[u8],
    layout: VertexLayout,
    out: &mut [u8],
) -> usize {
    let rows = (input.len() / layout.stride).min(out.len() / (3 * N));
    if !SWAP && layout.stride == 3 * N && layout.at == [0, N, 2 * N] {
        out[..rows * 3 * N].copy_from_slice(&input[..rows * 3 * N]);
        return rows;
    }
    let vertices = out.chunks_exact_mut(3 * N);
    for (row, vertex) in input.chunks_exact(layout.stride).zip(vertices) {
        for (at, out) in layout.at.into_iter().zip(vertex.chunks_exact_mut(N)) {
            out.copy_from_slice(&row[at..at + N]);
            if SWAP {
                out.reverse();
            }
        }
    }
    rows
}

/// Copies the ids of each row up to the first row that is no triangle of usual ids; returns
/// how many, and the largest id.
pub(super) fn gather_triangles<const SWAP: bool>(
    input: &[u8],
    layout: FaceLayout,
    out: &mut [u8],
) -> (usize, u32) {
    // Below all ones, which is NONE; a signed id must not be negative either.
    let ids = if layout.signed {
        i32::MAX as u32
    } else {
        u32::MAX - 1
    };
    let rows = input.chunks_exact(layout.stride());
    let (mut done, mut largest_of_all) = (0, 0);
    for (row, out) in rows.zip(out.chunks_exact_mut(12)) {
        let row = &row[layout.before..layout.before + 13];
        let mut largest = 0;
        for (id, out) in row[1..].chunks_exact(4).zip(out.chunks_exact_mut(4)) {
            let mut id = u32::from_le_bytes([id[0], id[1], id[2], id[3]]);
            if SWAP {
                id = id.swap_bytes();
            }
            largest = largest.max(id);
            out.copy_from_slice(&id.to_le_bytes());
        }
        if row[0] != 3 || largest > ids {
            break;
        }
        largest_of_all = largest_of_all.max(largest);
        done += 1;
    }
    (done, largest_of_all)
}
