//! An export of listed triangles: in an order of their own, instead of whole components in theirs.
//!
//! The list is walked anew for each pass, so it may be longer than memory. Vertices are numbered
//! as with a selection: those that no listed triangle names are left out, the others keep their
//! order.
//!
//! Memory: 24 bytes for each triangle of a block; the caller leases it. I/O: that of the list.

use crate::error::Result;

/// Triangles that can be walked over as often as asked, always in the same order.
pub trait Strip {
    /// How many there are.
    fn count(&self) -> u64;

    /// Calls `f` with the vertices of each, below the folder's number of vertices.
    ///
    /// # Errors
    /// Those of `f`, and of the list itself.
    fn each(&mut self, f: &mut dyn FnMut([u64; 3]) -> Result<()>) -> Result<()>;
}

/// Calls `f` with the triangles of a strip in blocks of `step`; returns how many there were.
pub(super) fn each_block(
    strip: &mut dyn Strip,
    step: u64,
    f: &mut dyn FnMut(&[[u64; 3]]) -> Result<()>,
) -> Result<u64> {
    let mut block = Vec::with_capacity(step as usize);
    let mut all = 0;
    strip.each(&mut |triangle| {
        all += 1;
        block.push(triangle);
        if block.len() as u64 == step {
            f(&block)?;
            block.clear();
        }
        Ok(())
    })?;
    f(&block)?;
    Ok(all)
}
