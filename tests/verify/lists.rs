//! Lists of degenerate triangles and non-manifold edges that list too much or too little.

use crate::breaks::{broken, hinge, notice, strip};
use crate::meshes;
use cornermill::folder::Orient;
use cornermill::verify::{At, Check};

#[test]
fn notices_wrong_lists() {
    let two = || (meshes::random(1, 40, 12), Orient::Outward);
    notice(&broken(
        "a degenerate triangle not listed",
        strip(),
        |p| {
            p.degenerate.remove(0);
        },
        (Check::Degenerate, At::Triangle(2)),
        "degenerate.npy: triangle 2: not listed, though its vertices are 3, 3, 1; \
         expected every triangle with a repeated vertex",
    ));
    notice(&broken(
        "a sound triangle listed",
        strip(),
        |p| p.degenerate.insert(0, 1),
        (Check::Degenerate, At::Triangle(1)),
        "degenerate.npy: triangle 1: listed, though its vertices are 2, 1, 3; \
         expected only triangles with a repeated vertex",
    ));
    notice(&broken(
        "listed twice",
        strip(),
        |p| p.degenerate.insert(0, 2),
        (Check::Degenerate, At::Row(1)),
        "degenerate.npy: row 1: triangle 2; expected one above 2, below 6",
    ));
    notice(&broken(
        "a triangle beyond the last",
        strip(),
        |p| p.degenerate.push(6),
        (Check::Degenerate, At::Row(2)),
        "degenerate.npy: row 2: triangle 6; expected one above 5, below 6",
    ));
    notice(&broken(
        "a non-manifold edge not listed",
        two(),
        |p| {
            let gone = p.edges.remove(1);
            let at = p.edges[0].corners as usize;
            p.corners.drain(at..at + gone.corners as usize);
        },
        (Check::NonmanifoldEdges, At::Edge(0, 4)),
        "nonmanifold_edges.npy: edge {0, 4}: not listed (it faces corner 59); \
         expected every edge that three or more corners face",
    ));
    notice(&broken(
        "a regular edge listed",
        hinge(),
        |p| {
            let mut row = p.edges[0];
            (row.lo, row.hi, row.corners) = (1, 3, 2);
            p.edges.push(row);
            p.corners.extend([0, 1]);
        },
        (Check::NonmanifoldEdges, At::Row(1)),
        "nonmanifold_edges.npy: row 1: edge {1, 3}; \
         expected edges of three or more corners, ascending",
    ));
    notice(&broken(
        "edges in disorder",
        two(),
        |p| p.edges.swap(0, 1),
        (Check::NonmanifoldEdges, At::Row(1)),
        "nonmanifold_edges.npy: row 1: edge {0, 2}; \
         expected edges of three or more corners, ascending",
    ));
    notice(&broken(
        "a wrong number of corners",
        hinge(),
        |p| p.edges[0].corners = 3,
        (Check::NonmanifoldEdges, At::Row(0)),
        "nonmanifold_edges.npy: row 0: corners is 3; expected 4",
    ));
    notice(&broken(
        "an absurd number of corners",
        two(),
        |p| p.edges[0].corners = u64::MAX,
        (Check::NonmanifoldEdges, At::Row(0)),
        "nonmanifold_edges.npy: row 0: corners is 18446744073709551615; expected 4",
    ));
    notice(&broken(
        "another first corner",
        hinge(),
        |p| p.edges[0].first_corner += 1,
        (Check::NonmanifoldEdges, At::Row(0)),
        "nonmanifold_edges.npy: row 0: first_corner is 2; expected 1",
    ));
    notice(&broken(
        "corners in disorder",
        two(),
        |p| p.corners.swap(1, 2),
        (Check::NonmanifoldCorners, At::Row(1)),
        "nonmanifold_corners.npy: row 1: corner 90; expected 83 (edge {0, 2})",
    ));
    notice(&broken(
        "a corner too few",
        hinge(),
        |p| {
            p.corners.pop();
        },
        (Check::NonmanifoldCorners, At::Row(3)),
        "nonmanifold_corners.npy: row 3: the end of the list; \
         expected 17 (edge {0, 1})",
    ));
    notice(&broken(
        "a corner too many",
        hinge(),
        |p| p.corners.push(0),
        (Check::NonmanifoldCorners, At::File),
        "nonmanifold_corners.npy: whole file: 5 corners; expected 4",
    ));
}
