//! What both ways share behind their first passes: the counts of edges, and the laws that they
//! must keep.
//!
//! Memory: none. I/O: none.

use super::Job;
use super::chunks::Settled;
use crate::chunk::grid::Bounds;
use crate::error::{Error, Result};
use crate::folder::Counts;

/// What is known of the edges and vertices before the components are.
pub struct Edges<'a> {
    /// Totals of the chunks, or of the cells.
    pub first: &'a Settled,
    /// Totals of the seams.
    pub seams: &'a Settled,
    /// Corners on non-manifold edges.
    pub cut_corners: u64,
    /// Vertices that no triangle names.
    pub unreferenced: u64,
    /// Box of the finite vertices.
    pub bounds: &'a Bounds,
}

impl Edges<'_> {
    /// The counts, when every corner is accounted for once.
    ///
    /// # Errors
    /// [`Error::Internal`]: a mismatch is a fault of this program.
    pub fn counts(&self, job: &Job) -> Result<Counts> {
        let (a, b) = (self.first, self.seams);
        let regular = a.regular + b.regular;
        let border = a.borders + b.borders;
        let nonmanifold = a.nonmanifold + b.nonmanifold;
        let triangles = job.shape.triangles;
        let corners = 2 * regular + border + self.cut_corners + 3 * a.degenerate;
        if corners != 3 * triangles {
            return Err(Error::Internal(format!(
                "{corners} of {} corners were settled",
                3 * triangles
            )));
        }
        if 2 * b.regular + b.borders > a.spilled {
            return Err(Error::Internal(format!(
                "the seam pass settled more corners than the {} that were spilled",
                a.spilled
            )));
        }
        Ok(Counts {
            triangles,
            vertices: job.shape.vertices,
            unreferenced_vertices: self.unreferenced,
            nonfinite_vertices: self.bounds.nonfinite,
            degenerate: a.degenerate,
            distinct_edges: regular + border + nonmanifold,
            regular_edges: regular,
            border_edges: border,
            nonmanifold_edges: nonmanifold,
            nonmanifold_corners: self.cut_corners,
            inconsistent_edges: a.inconsistent + b.inconsistent,
            polygons_fanned: job.mesh.polygons_fanned,
            ..Counts::default()
        })
    }
}
