//! Which components are chosen.
//!
//! The table of components is streamed. The largest K stand in a heap whose top is the least
//! of them: a component that beats the top replaces it, so the heap never holds more than K,
//! and of equals the lower number wins whatever the order of reading.
//!
//! Memory: [`bytes`] for the result, [`bytes_while_choosing`] beside it. I/O: components.npy,
//! once.

use super::ExportRequest;
use crate::disk::{Lease, Workspace};
use crate::error::{Error, Result};
use crate::folder::{Folder, Rows};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Bytes of the rows that are read at a time.
const READ: u64 = 128 << 10;

/// The components that were chosen.
pub(super) struct Chosen {
    which: Which,
    /// How many.
    pub(super) count: u64,
    /// Their triangles, as the table of components has it.
    pub(super) triangles: u64,
    _lease: Lease,
}

enum Which {
    One(u64),
    Bits(Vec<u64>),
}

impl Chosen {
    /// True when this component (one of the folder's) is among them.
    pub(super) fn has(&self, component: u64) -> bool {
        match &self.which {
            Which::One(one) => component == *one,
            Which::Bits(bits) => bits[(component / 64) as usize] >> (component % 64) & 1 == 1,
        }
    }

    fn add(&mut self, component: u64, triangles: u64) {
        if let Which::Bits(bits) = &mut self.which {
            bits[(component / 64) as usize] |= 1 << (component % 64);
        }
        self.count += 1;
        self.triangles = self.triangles.saturating_add(triangles);
    }
}

/// Memory of what [`choose`] returns.
pub(super) fn bytes(folder: &Folder, request: &ExportRequest) -> u64 {
    if request.largest.is_none() && request.min_triangles.is_none() {
        return 0;
    }
    8 * folder.manifest().counts.components.div_ceil(64)
}

/// Memory that [`choose`] needs beside it: the heap and a read buffer.
pub(super) fn bytes_while_choosing(folder: &Folder, request: &ExportRequest) -> u64 {
    if !request.selects() {
        return 0;
    }
    READ + heap_rows(folder, request).map_or(0, |k| 16 * k)
}

/// How many components the heap must hold; `None` when all that pass are taken.
fn heap_rows(folder: &Folder, request: &ExportRequest) -> Option<u64> {
    request
        .largest
        .filter(|&k| k < folder.manifest().counts.components)
}

/// Chooses; `None` without a selection.
///
/// # Errors
/// [`Error::Usage`] when nothing is chosen, [`Error::Budget`], [`Error::Input`], [`Error::Io`].
pub(super) fn choose(
    ws: &Workspace,
    folder: &Folder,
    request: &ExportRequest,
) -> Result<Option<Chosen>> {
    if !request.selects() {
        return Ok(None);
    }
    let components = folder.manifest().counts.components;
    let lease = ws
        .budget
        .lease("the choice of components", bytes(folder, request))?;
    let beside = bytes_while_choosing(folder, request);
    let _beside = ws.budget.lease("choosing components", beside)?;
    let mut chosen = Chosen {
        which: match request.component {
            Some(one) => Which::One(one),
            None => Which::Bits(vec![0; components.div_ceil(64) as usize]),
        },
        count: 0,
        triangles: 0,
        _lease: lease,
    };
    if let Some(one) = request.component {
        if one < components {
            each_row(folder, one, one + 1, |c, triangles| {
                chosen.add(c, triangles)
            })?;
        }
    } else {
        let least = request.min_triangles.unwrap_or(0);
        match heap_rows(folder, request) {
            None => each_row(folder, 0, components, |c, triangles| {
                if triangles >= least {
                    chosen.add(c, triangles);
                }
            })?,
            Some(k) => {
                for Reverse((triangles, Reverse(c))) in largest(folder, k as usize, least)? {
                    chosen.add(c, triangles);
                }
            }
        }
    }
    if chosen.count == 0 {
        return Err(nothing(components, request));
    }
    Ok(Some(chosen))
}

type Ranked = Reverse<(u64, Reverse<u64>)>;

/// The k components with the most triangles, of those with at least `least`.
fn largest(folder: &Folder, k: usize, least: u64) -> Result<BinaryHeap<Ranked>> {
    let mut heap: BinaryHeap<Ranked> = BinaryHeap::with_capacity(k);
    each_row(
        folder,
        0,
        folder.manifest().counts.components,
        |c, triangles| {
            let this = Reverse((triangles, Reverse(c)));
            if triangles < least {
                return;
            }
            if heap.len() < k {
                heap.push(this);
            } else if let Some(mut top) = heap.peek_mut()
                && this < *top
            {
                *top = this;
            }
        },
    )?;
    Ok(heap)
}

/// Calls `f` with number and triangles of the components `from..to`.
fn each_row(folder: &Folder, from: u64, to: u64, mut f: impl FnMut(u64, u64)) -> Result<()> {
    let mut table = Rows::open(folder)?;
    let mut rows = Vec::new();
    for first in (from..to).step_by(Rows::STEP as usize) {
        table.read(first..to, &mut rows)?;
        for (component, row) in (first..).zip(&rows) {
            f(component, row.base.triangles);
        }
    }
    Ok(())
}

/// A selection that chooses nothing is a mistake, not an empty mesh.
fn nothing(components: u64, request: &ExportRequest) -> Error {
    Error::Usage(if components == 0 {
        "the mesh has no component to choose; leave the selection out".into()
    } else if let Some(one) = request.component {
        format!(
            "there is no component {one}: the mesh has {components}, numbered 0 to {}",
            components - 1
        )
    } else {
        let least = request.min_triangles.unwrap_or(0);
        format!(
            "none of the {components} components has {least} triangles; \
             give a smaller --min-triangles"
        )
    })
}
