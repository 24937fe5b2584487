//! The maps of a filtered folder: the ids that its triangles and vertices had in its source.
//!
//! Why no more can be held: the source is not here. But a filter keeps the order, so ids ascend,
//! and no mesh has ids beyond a bound.
//!
//! Memory: a buffer of 32 KiB. I/O: both maps once.

use super::open::Arrays;
use super::read::{IdReader, Ids};
use super::verdict::{At, Check, Findings, id};
use crate::disk::Workspace;
use crate::error::Result;
use crate::folder::{MAP_TRIANGLE, MAP_VERTEX};

/// More than any mesh has of anything: ids are packed beside a few bits.
const MOST: u64 = 1 << 56;

/// Holds both maps, where the folder has them.
pub(super) fn check(ws: &Workspace, arrays: &Arrays, findings: &Findings) -> Result<()> {
    let Some([triangles, vertices]) = &arrays.maps else {
        return Ok(());
    };
    ascending(ws, (MAP_TRIANGLE, triangles), findings)?;
    ascending(ws, (MAP_VERTEX, vertices), findings)
}

fn ascending(ws: &Workspace, (name, ids): (&str, &Ids), findings: &Findings) -> Result<()> {
    let mut entries = IdReader::new(ws, ids, 32 << 10)?;
    let (mut place, mut least) = (0, 0);
    while let Some(found) = entries.get(place)? {
        if found < least || found >= MOST {
            findings.add(Check::Maps, name, At::Row(place), || {
                let expected = format!("an id of the source from {least} on, ascending");
                (id(found), expected)
            });
        }
        // A wrong one does not make those behind it wrong.
        if (least..MOST).contains(&found) {
            least = found + 1;
        }
        place += 1;
    }
    Ok(())
}
