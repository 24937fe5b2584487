//! The checks of a triangle that need only its own rows of V, O, `component.npy` and
//! `flipped.npy`.
//!
//! Memory, I/O: none.

use super::open::Arrays;
use super::verdict::{At, Check, Findings, id};
use crate::folder::{COMPONENT, DEGENERATE, FLIPPED, O, V};

/// What the checks of one triangle look at.
pub(super) struct Row {
    pub(super) t: u64,
    pub(super) v: [u64; 3],
    pub(super) o: [u64; 3],
    pub(super) label: u64,
    pub(super) flipped: bool,
}

impl Row {
    /// True when a vertex is repeated.
    pub(super) fn is_degenerate(&self) -> bool {
        let [a, b, c] = self.v;
        a == b || b == c || c == a
    }

    /// Every vertex below N, every opposite NONE or a corner of another triangle.
    pub(super) fn ranges(&self, arrays: &Arrays, findings: &Findings) {
        let (n, corners) = (arrays.vertices, arrays.triangles * 3);
        for k in 0..3 {
            let c = 3 * self.t + k as u64;
            if self.v[k] >= n {
                findings.add(Check::VertexRange, V, At::Corner(c), || {
                    let found = format!("V[{c}] is {}", id(self.v[k]));
                    (found, format!("a vertex below {n}"))
                });
            }
            let o = self.o[k];
            if o == u64::MAX {
                continue;
            }
            if o >= corners {
                findings.add(Check::OppositeRange, O, At::Corner(c), || {
                    let found = format!("O[{c}] is {o}");
                    (found, format!("NONE or a corner below {corners}"))
                });
            } else if o / 3 == self.t {
                findings.add(Check::OppositeRange, O, At::Corner(c), || {
                    let found = format!("O[{c}] is {o}, in the same triangle {}", self.t);
                    (found, "a corner of another triangle".into())
                });
            }
        }
    }

    /// A triangle with a repeated vertex faces nothing, belongs to nothing, is not turned.
    pub(super) fn degenerate(&self, findings: &Findings) {
        for k in 0..3 {
            if self.o[k] != u64::MAX {
                let c = 3 * self.t + k as u64;
                findings.add(Check::Opposite, O, At::Corner(c), || {
                    let found = format!("O[{c}] is {}", self.o[k]);
                    (found, format!("NONE (triangle {} is degenerate)", self.t))
                });
            }
        }
        if self.label != u64::MAX {
            let at = At::Triangle(self.t);
            findings.add(Check::Label, COMPONENT, at, || {
                let found = format!("label {}", self.label);
                (found, "NONE (the triangle is degenerate)".into())
            });
        }
        if self.flipped {
            let at = At::Triangle(self.t);
            findings.add(Check::FlippedBits, FLIPPED, at, || {
                ("bit 1".into(), "0 (the triangle is degenerate)".into())
            });
        }
    }

    pub(super) fn unlisted(&self, findings: &Findings) {
        let at = At::Triangle(self.t);
        findings.add(Check::Degenerate, DEGENERATE, at, || {
            let [a, b, c] = self.v.map(id);
            let found = format!("not listed, though its vertices are {a}, {b}, {c}");
            (found, "every triangle with a repeated vertex".into())
        });
    }

    pub(super) fn wrongly_listed(&self, findings: &Findings) {
        let at = At::Triangle(self.t);
        findings.add(Check::Degenerate, DEGENERATE, at, || {
            let [a, b, c] = self.v.map(id);
            let found = format!("listed, though its vertices are {a}, {b}, {c}");
            (found, "only triangles with a repeated vertex".into())
        });
    }

    pub(super) fn unlabelled(&self, most: u64, findings: &Findings) {
        let at = At::Triangle(self.t);
        findings.add(Check::Label, COMPONENT, at, || {
            let found = format!("label {}", id(self.label));
            (found, format!("a component below {most}"))
        });
    }
}
