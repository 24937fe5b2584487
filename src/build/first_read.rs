//! What the first reading of V owes: every index is checked, and the digest of the input takes
//! the blocks that have passed. And what each reading after it owes: an array that is used where it
//! lies may have been changed by then, so its ids are held to their bound before they lead anywhere.
//!
//! Memory: none of its own. I/O: blocks that are whole, from memory most likely.

use super::Job;
use super::arrays::bad_index;
use crate::chunk::ids::LocalIds;
use crate::corner::Index;
use crate::error::{Error, Result};
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

/// Holds the ids of rows of V, from triangle `first` on, that were checked before.
///
/// # Errors
/// [`Error::Input`] when they are others now.
pub fn read_again(job: &Job, first: u64, ids: &LocalIds) -> Result<()> {
    hold(job, first, ids.most())
}

/// As [`read_again`], of rows whose largest id is `most`.
///
/// # Errors
/// The same.
pub fn hold(job: &Job, first: u64, most: Option<u64>) -> Result<()> {
    let n = job.shape.vertices;
    match most {
        Some(most) if most >= n => Err(Error::input(
            job.mesh.v.source.data().path(),
            format!("the triangles from {first} on"),
            format!("ids below {n}, as there were at first"),
            most.to_string(),
            "it was changed while it was read, so no folder was made; build it again",
        )),
        _ => Ok(()),
    }
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
