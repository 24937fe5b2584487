//! The counts that a generated mesh is known to have.

use serde_json::{Value, json};

/// Exact counts. An edge is an unordered pair of vertices of triangles that are not degenerate; it is a
/// border with one such triangle, regular with two, non-manifold with more.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Truth {
    /// Triangles, degenerate ones and duplicates included.
    pub triangles: u64,
    /// Vertices, unreferenced ones included.
    pub vertices: u64,
    /// Unordered vertex pairs that are edges.
    pub distinct_edges: u64,
    /// Edges with one triangle.
    pub border_edges: u64,
    /// Loops of triangle sides without an opposite, linked where they meet in a fan.
    pub border_loops: u64,
    /// Edges with three or more triangles.
    pub nonmanifold_edges: u64,
    /// Vertices whose triangles form more than one fan.
    pub nonmanifold_vertices: u64,
    /// Sets of triangles linked across regular edges; degenerate triangles are in none.
    pub components: u64,
    /// Components when non-manifold edges link too.
    pub components_joined: u64,
    /// Components in which every side has an opposite.
    pub closed_components: u64,
    /// Components that cannot be oriented.
    pub nonorientable_components: u64,
    /// Triangles with a repeated vertex.
    pub degenerate: u64,
    /// Triangles with the vertices of another; each set of equals counts all but one.
    pub duplicate: u64,
    /// Vertices in no triangle.
    pub unreferenced: u64,
    /// Regular edges along which both triangles run in the same direction.
    pub inconsistent_edges: u64,
    /// Triangles that were flipped.
    pub flipped: u64,
}

impl Truth {
    /// Every corner has an opposite.
    pub fn closed(&self) -> bool {
        self.border_edges == 0 && self.nonmanifold_edges == 0 && self.degenerate == 0
    }

    /// What a reader of a format without vertex ids sees: vertices in no triangle do not exist.
    pub fn welded(&self) -> Truth {
        Truth {
            vertices: self.vertices - self.unreferenced,
            unreferenced: 0,
            ..self.clone()
        }
    }

    /// The counts as a JSON object, keys as the fields.
    pub fn to_json(&self) -> Value {
        json!({
            "triangles": self.triangles,
            "vertices": self.vertices,
            "distinct_edges": self.distinct_edges,
            "border_edges": self.border_edges,
            "border_loops": self.border_loops,
            "nonmanifold_edges": self.nonmanifold_edges,
            "nonmanifold_vertices": self.nonmanifold_vertices,
            "components": self.components,
            "components_joined": self.components_joined,
            "closed_components": self.closed_components,
            "nonorientable_components": self.nonorientable_components,
            "closed": self.closed(),
            "degenerate": self.degenerate,
            "duplicate": self.duplicate,
            "unreferenced": self.unreferenced,
            "inconsistent_edges": self.inconsistent_edges,
            "flipped": self.flipped,
        })
    }
}
