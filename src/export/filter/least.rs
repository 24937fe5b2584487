//! What filtering takes at least: so that a refusal names a budget that suffices.
//!
//! Why two figures: before the choice, the counts of the folder bound what may be chosen; behind it,
//! what was chosen is known. How many edges become regular is known only when they have been looked
//! at: a figure supposes that all do, and nothing is refused for that alone.
//!
//! Memory, I/O: none.

use super::edges::Change;
use super::sets::Sets;
use super::{BYTES_PER_TRIANGLE, MIN_STEP};
use crate::chunk::measure::Measure;
use crate::disk::Workspace;
use crate::export::select;
use crate::export::selection::Selection;
use crate::export::used::Used;
use crate::folder::{self, ComponentRow, Folder, Orient};

/// Edges that become regular have room for so many at first, and twice as many each time.
pub(super) const FIRST_LINKS: u64 = 256;
/// Bytes for each of them.
pub(super) const LINK_BYTES: u64 = 32;
/// Bytes of the row of a component, and of how it turns.
pub(super) const ROW_BYTES: u64 = size_of::<ComponentRow>() as u64 + 1;

/// Bytes of the bits of the triangles that were turned.
pub(super) fn flip_bytes(triangles: u64) -> u64 {
    8 * triangles.div_ceil(64)
}

/// Bytes of the marks of what is taken.
pub(super) fn mark_bytes(folder: &Folder) -> u64 {
    let counts = &folder.manifest().counts;
    let (t, n) = (counts.triangles, counts.vertices);
    Used::bytes(t) + Used::bytes(n) + flip_bytes(t)
}

/// Bytes of the directions of the edges of so many triangles.
pub(super) fn direction_bytes(triangles: u64) -> u64 {
    8 * (3 * triangles).div_ceil(64)
}

/// Bytes that components have while they are joined.
pub(super) fn joined_bytes(components: u64) -> u64 {
    components * (2 * Sets::BYTES + size_of::<Change>() as u64)
}

/// Bytes with which a selection is chosen and taken, whatever it chooses.
pub(super) fn any(ws: &Workspace, folder: &Folder, selection: &Selection) -> u64 {
    let counts = &folder.manifest().counts;
    let most = selection.largest.filter(|_| !selection.invert);
    let components = counts.components.min(most.unwrap_or(u64::MAX));
    let taking = mark_bytes(folder)
        + MIN_STEP * BYTES_PER_TRIANGLE
        + passes(ws, folder, components, counts.triangles);
    let choosing = select::bytes_while_choosing(folder, selection);
    select::bytes(folder, selection) + choosing.max(taking)
}

/// Bytes that the passes take besides marks and blocks, when so many components of so many triangles
/// are chosen.
pub(super) fn passes(ws: &Workspace, folder: &Folder, components: u64, triangles: u64) -> u64 {
    let manifest = folder.manifest();
    let counts = &manifest.counts;
    let (edges, corners) = (counts.nonmanifold_edges, counts.nonmanifold_corners);
    // All others have three.
    let most = corners.saturating_sub(edges.saturating_sub(1).saturating_mul(3));
    let links = match manifest.options.orient {
        _ if edges == 0 => 0,
        Orient::Keep => 0,
        _ => edges.max(FIRST_LINKS).saturating_mul(2) * LINK_BYTES,
    };
    let list = 8 * most;
    let settling = list + 16 * most;
    let sums = components * size_of::<Measure>() as u64;
    let table = components * ROW_BYTES + sums.max(direction_bytes(triangles)).max(list);
    let working = joined_bytes(components) + links + settling.max(table);
    // Each file of the source again, and the maps; one more of each for what is begun.
    let files = manifest.files.len() as u64 + 2;
    let bytes: u64 = manifest.files.iter().map(|file| file.bytes).sum();
    let bytes = bytes + 8 * (counts.triangles + counts.vertices);
    let notes = folder::sum_bytes(bytes, 2 * files);
    notes + working.max(folder::checksum_bytes(ws))
}
