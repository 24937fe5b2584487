//! What the first reading of V owes: every index is checked, and the digest of the input takes
//! the blocks that have passed.
//!
//! Memory: none of its own. I/O: blocks that are whole, from memory most likely.

use super::Job;
use super::arrays::bad_index;
use crate::corner::Index;
use crate::error::Result;
use crate::input::Mesh;

/// Checks the rows of V from triangle `first` on, and counts them as read.
///
/// # Errors
/// [`crate::Error::Input`] for an index that names no vertex; [`crate::Error::Io`].
pub fn first_read<I: Index>(job: &Job, first: u64, v: &[I]) -> Result<()> {
    let n = job.shape.vertices;
    // The maximum first: it runs at memory speed, and hardly ever needs the search.
    if v.iter().max().is_some_and(|top| top.wide() >= n)
        && let Some(at) = v.iter().position(|x| x.wide() >= n)
    {
        let found = format!("{} where the mesh has {n} vertices", v[at].wide());
        return Err(bad_index(&job.mesh.v, 3 * first + at as u64, found));
    }
    seen(job.mesh, first, v.len() as u64 / 3)
}

/// These rows of V were read: lets the digest of the input take the blocks that are whole now.
/// (When the ids were counted before, that was the first reading, and all were taken then.)
///
/// # Errors
/// [`crate::Error::Io`].
pub fn seen(mesh: &Mesh, first: u64, count: u64) -> Result<()> {
    let Some(sums) = mesh.sums.first() else {
        return Ok(());
    };
    let row = 3 * mesh.v.kind.bytes();
    sums.seen(mesh.v.source.data(), mesh.v.at + first * row, count * row)
}
