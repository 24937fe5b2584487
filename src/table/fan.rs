//! The corners around a vertex.
//!
//! Why it ends, and each corner comes once: at every corner of v two edges of its triangle meet
//! v, and each of them has at most one other side. So corners of v hang together in paths and
//! rings; a walk that leaves a corner by the edge it did not come through goes along its path
//! to the end, or round its ring back to the start, and meets nothing twice.
//!
//! Memory: O(1). I/O: the pages of V and O around the vertex.

use super::CornerTable;
use crate::corner::{Corner, Vertex};

/// Iterator over the corners around a vertex: one *fan*, walked completely.
///
/// From [`CornerTable::fan`]. A closed fan begins at the corner asked for and makes one full
/// turn. An open one begins at its border: the end that lies against the swing, so the walk
/// goes on as `c.s = c.n.o.n` does and meets the corner asked for on its way. (The other way
/// round is `c.p.o.p`.) A non-manifold vertex has several fans; those that no edge with an
/// opposite joins to the corner are not part of the walk. A corner of a degenerate triangle is
/// a fan of its own.
///
/// Where two triangles disagree in orientation (non-orientable components, and folders built
/// with `--orient keep`) the formula of the swing would leave the vertex; the walk compares
/// vertices instead, stays, and mirrors the formula in the triangles beyond. "With the swing"
/// is then meant in the triangle of the corner asked for.
///
/// Cost: twice the valence, in constant memory. On a damaged folder the walk ends where O
/// leads elsewhere or not back.
///
/// ```
/// # mod by_hand { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/by_hand/mod.rs")); }
/// # let dir = tempfile::tempdir().unwrap();
/// # let folder = dir.path().join("tetrahedron.ct");
/// # by_hand::tetrahedron().write(&folder);
/// let table = cornermill::CornerTable::open(&folder)?; // a tetrahedron
/// let c = table.corner(5).expect("the table has a corner 5");
/// let fan: Vec<_> = table.fan(c).collect();
/// assert_eq!(fan[0], c);
/// assert_eq!(fan[1], table.s(c).unwrap());
/// assert!(fan.iter().all(|&x| table.v(x) == table.v(c)));
/// # Ok::<(), cornermill::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Fan<'a> {
    table: &'a CornerTable,
    v: Vertex,
    start: Corner,
    next: Option<Step>,
    left: u64,
}

/// A corner of the vertex, and the corner that faces the edge to leave by.
#[derive(Clone, Copy, Debug)]
struct Step {
    at: Corner,
    leave: Corner,
}

impl Step {
    /// The same corner, to be left by its other edge.
    fn turned(self) -> Step {
        let n = self.at.n();
        let leave = if self.leave == n { self.at.p() } else { n };
        Step { at: self.at, leave }
    }
}

impl<'a> Fan<'a> {
    pub(super) fn new(table: &'a CornerTable, c: Corner) -> Fan<'a> {
        let mut fan = Fan {
            table,
            v: table.v(c),
            start: c,
            next: None,
            left: 3 * table.triangle_count(),
        };
        // Against the swing, to the border or once around.
        let mut step = Step {
            at: c,
            leave: c.p(),
        };
        for _ in 0..fan.left {
            match fan.cross(step) {
                Some(beyond) if beyond.at == c => {
                    step = beyond;
                    break;
                }
                Some(beyond) => step = beyond,
                None => break,
            }
        }
        fan.start = step.at;
        fan.next = Some(if step.at == c {
            Step {
                at: c,
                leave: c.n(),
            }
        } else {
            step.turned()
        });
        fan
    }

    /// Crosses the edge to leave by; `None` at a border.
    fn cross(&self, step: Step) -> Option<Step> {
        let o = self.table.corner(self.table.o(step.leave)?.id())?;
        if self.table.o(o) != Some(step.leave) {
            return None;
        }
        // Beyond, v is at one of the corners beside o (which one depends on the direction and
        // on whether the triangles agree), and the way on is through the other.
        let (n, p) = (o.n(), o.p());
        if self.table.v(n) == self.v {
            Some(Step { at: n, leave: p })
        } else if self.table.v(p) == self.v {
            Some(Step { at: p, leave: n })
        } else {
            None
        }
    }
}

impl Iterator for Fan<'_> {
    type Item = Corner;

    fn next(&mut self) -> Option<Corner> {
        let step = self.next.take()?;
        self.left = self.left.saturating_sub(1);
        if self.left > 0 {
            self.next = self.cross(step).filter(|beyond| beyond.at != self.start);
        }
        Some(step.at)
    }
}

impl std::iter::FusedIterator for Fan<'_> {}
