//! What is against a requirement, looked up in the file that lists all of it.
//!
//! Memory: 64 KiB. I/O: the table of components once; the first rows of a list; G, up to the first
//! few vertices that are not finite. Nothing where there is nothing to look up.

use super::Culprit;
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::folder::{self, ComponentMeasures, ComponentRow, Folder, Rows};
use crate::report::{NAMED, first_edges, first_ids};
use crate::table::array::Coords;

/// The components that are not good, when there are some.
pub(super) fn components(
    folder: &Folder,
    some: bool,
    is_good: impl Fn(&ComponentRow, Option<&ComponentMeasures>) -> bool,
) -> Result<Vec<Culprit>> {
    let (mut first, mut total) = (Vec::new(), 0);
    if some {
        Rows::open(folder)?.each(|number, row| {
            if !is_good(&row.base, row.measures.as_ref()) {
                total += 1;
                if first.len() < NAMED {
                    first.push(vec![number]);
                }
            }
            Ok(())
        })?;
    }
    Ok(culprit("component", total, first, folder::COMPONENTS))
}

/// A list of culprits, unless it is empty.
fn culprit(
    kind: &'static str,
    total: u64,
    first: Vec<Vec<u64>>,
    file: &'static str,
) -> Vec<Culprit> {
    let some = (total > 0).then_some(Culprit {
        kind,
        total,
        first,
        file,
    });
    some.into_iter().collect()
}

pub(super) fn edges(folder: &Folder, total: u64) -> Result<Vec<Culprit>> {
    if total == 0 {
        return Ok(vec![]);
    }
    let first = first_edges(folder)?
        .iter()
        .map(|e| vec![e.lo, e.hi])
        .collect();
    Ok(culprit("edge", total, first, folder::NONMANIFOLD_EDGES))
}

pub(super) fn ids(
    folder: &Folder,
    file: &'static str,
    kind: &'static str,
    total: u64,
) -> Result<Vec<Culprit>> {
    if total == 0 {
        return Ok(vec![]);
    }
    let first = first_ids(folder, file)?
        .into_iter()
        .map(|id| vec![id])
        .collect();
    Ok(culprit(kind, total, first, file))
}

/// The first vertices with a coordinate that is not finite: no list has them, so G is read.
pub(super) fn nonfinite(folder: &Folder, total: u64) -> Result<Vec<Culprit>> {
    const STEP: u64 = 2048;
    let mut first = Vec::new();
    if let (true, Some(kind)) = (total > 0, Coords::of(folder)?) {
        let (file, row) = (folder.file(folder::G)?, kind.row_bytes());
        let vertices = folder.manifest().counts.vertices;
        let mut bytes = vec![0; STEP as usize * row];
        for from in (0..vertices).step_by(STEP as usize) {
            let count = STEP.min(vertices - from) as usize;
            file.read_at(&mut bytes[..count * row], DATA_START + from * row as u64)?;
            for i in 0..count {
                if first.len() < NAMED && kind.row(&bytes, i).iter().any(|x| !x.is_finite()) {
                    first.push(vec![from + i as u64]);
                }
            }
            if first.len() as u64 == total.min(NAMED as u64) {
                break;
            }
        }
    }
    Ok(culprit("vertex", total, first, folder::G))
}
