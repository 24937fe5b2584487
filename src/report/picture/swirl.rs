//! Tones by swirl order: where in the swirl of its component a triangle comes.
//!
//! The walk is [`Swirl`](crate::table::Swirl) from the first triangle of each component, in the
//! order of components. It jumps about in O, so it is bounded by refusing what would not fit:
//! a picture must not depend on the budget, so there is no cheaper walk for a smaller one.
//!
//! Memory: [`bytes`]: all of O mapped, a tone for each triangle, visited bits and the stack of
//! the worst case. I/O: O once, when it stays in memory.

use super::colour::swirl_tone;
use crate::disk::{Lease, Workspace};
use crate::error::Result;
use crate::folder::Folder;
use crate::table::CornerTable;

/// Memory to walk over a folder, of which [`kept`] stays.
pub(super) fn bytes(folder: &Folder) -> u64 {
    let t = folder.manifest().counts.triangles;
    let id = if folder.manifest().index == "u8" {
        8
    } else {
        4
    };
    // O, visited bits, and a stack that doubles when it is full.
    kept(folder) + t * 3 * id + t / 7 + 4096 + 16 * (t + 2)
}

/// Memory of the tones.
pub(super) fn kept(folder: &Folder) -> u64 {
    2 * folder.manifest().counts.triangles
}

/// The tones of all triangles; degenerate ones have 0. `components` gives each component's
/// first triangle and size.
///
/// # Errors
/// [`crate::Error::Budget`] naming the least that would do; those of opening a table.
pub(super) fn tones(
    ws: &Workspace,
    folder: &Folder,
    mut components: impl FnMut(&mut dyn FnMut(u64, u64) -> Result<()>) -> Result<()>,
) -> Result<(Vec<u16>, Lease)> {
    let mut lease = ws.budget.lease("walking in swirl order", bytes(folder))?;
    let table = CornerTable::from_folder(folder)?;
    // The walk goes where O says.
    table.check_bounds(folder.path())?;
    let triangles = table.triangle_count();
    ws.progress.begin("swirl", "triangles", triangles);
    let mut tones = vec![0; triangles as usize];
    components(&mut |first, size| {
        let Some(start) = table.corner(3 * first) else {
            return Ok(());
        };
        for (place, t) in (0..).zip(table.swirl(start)) {
            tones[t.id() as usize] = swirl_tone(place, size);
        }
        ws.progress.advance(size);
        Ok(())
    })?;
    table.intact()?;
    ws.progress.end();
    lease.shrink(kept(folder));
    Ok((tones, lease))
}
