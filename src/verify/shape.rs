//! What a component is as a surface: vertices, fans, border loops, Euler characteristic, genus.
//!
//! Why these numbers are those of a surface: O cuts the component at its non-manifold edges, and
//! counting fans for vertices cuts it at its non-manifold vertices, so that every point has a
//! disk or half a disk around it. Of such a surface with `l` border loops the Euler
//! characteristic is 2 - 2g - l when it is orientable, 2 - g - l when it is not.
//!
//! Memory, I/O: none.

use super::tally::Tally;
use super::verdict::{At, Check, Findings};
use crate::folder::{COMPONENTS, ComponentMeasures};

/// The recounted columns. The genus is signed, as arrays that are wrong may make it anything.
pub(super) struct Shape {
    vertices: u64,
    fans: u64,
    loops: u64,
    euler: i64,
    genus: i64,
    pub(super) is_smesh: bool,
}

/// The columns that a component should have.
pub(super) fn of(tally: &Tally, closed: bool, orientable: bool) -> Shape {
    let edges = tally.regular + tally.border + tally.cut;
    let euler = tally.fans as i64 - edges as i64 + tally.triangles as i64;
    let lack = 2 - tally.loops as i64 - euler;
    let manifold = tally.vertices == tally.fans;
    Shape {
        vertices: tally.vertices,
        fans: tally.fans,
        loops: tally.loops,
        euler,
        genus: if orientable { lack / 2 } else { lack },
        is_smesh: closed && orientable && manifold && tally.triangles + 4 == 2 * tally.vertices,
    }
}

/// Compares the columns of a component's row with what they should be.
pub(super) fn check(findings: &Findings, label: u64, said: &ComponentMeasures, own: &Shape) {
    let equal = |what: &str, found: i128, expected: i128| {
        let at = At::Component(label);
        findings.equal(Check::ComponentTable, COMPONENTS, at, what, found, expected);
    };
    equal("vertices", said.vertices.into(), own.vertices.into());
    equal("fans", said.fans.into(), own.fans.into());
    equal("border_loops", said.border_loops.into(), own.loops.into());
    equal("euler", said.euler.into(), own.euler.into());
    equal("genus", said.genus.into(), own.genus.into());
    equal("is_smesh", said.is_smesh.into(), own.is_smesh.into());
}
