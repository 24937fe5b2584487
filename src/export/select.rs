//! Which components are chosen: a [`Selection`] held against the table of components.
//!
//! The table is streamed. The largest K stand in a heap whose top is the least of them: a
//! component that beats the top replaces it, so the heap never holds more than K, and of equals
//! the lower number wins whatever the order of reading.
//!
//! Memory: [`bytes`] for the result, [`bytes_while_choosing`] beside it. I/O: components.npy,
//! once; twice when inverted.

use super::selection::Selection;
use super::used::Used;
use crate::disk::{Lease, Workspace};
use crate::error::{Error, Result};
use crate::folder::{Folder, Rows};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Bytes in which rows are read.
const READ: u64 = 64 << 10;

/// The components that were chosen.
pub(super) struct Chosen {
    marks: Used,
    /// How many.
    pub(super) count: u64,
    /// Their triangles, as the table of components has it.
    pub(super) triangles: u64,
    _lease: Lease,
}

impl Chosen {
    /// True when this component (one of the folder's) is among them.
    pub(super) fn has(&self, component: u64) -> bool {
        self.marks.has(component)
    }

    /// Makes ready for [`rank`](Chosen::rank).
    pub(super) fn seal(&mut self) {
        self.marks.seal();
    }

    /// Number of the chosen components before this one.
    pub(super) fn rank(&self, component: u64) -> u64 {
        self.marks.rank(component)
    }

    fn add(&mut self, component: u64, triangles: u64) {
        self.marks.mark(component);
        self.count += 1;
        self.triangles = self.triangles.saturating_add(triangles);
    }
}

/// Memory of what [`choose`] returns.
pub(super) fn bytes(folder: &Folder, selection: &Selection) -> u64 {
    if selection.is_empty() {
        return 0;
    }
    Used::bytes(folder.manifest().counts.components)
}

/// Memory that [`choose`] needs beside it: the heap and a read buffer.
pub(super) fn bytes_while_choosing(folder: &Folder, selection: &Selection) -> u64 {
    if selection.is_empty() {
        return 0;
    }
    READ + heap_rows(folder, selection).map_or(0, |k| 16 * k)
}

/// How many components the heap must hold; `None` when all that pass are taken.
fn heap_rows(folder: &Folder, selection: &Selection) -> Option<u64> {
    selection
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
    selection: &Selection,
) -> Result<Option<Chosen>> {
    if selection.is_empty() {
        return Ok(None);
    }
    let components = folder.manifest().counts.components;
    let lease = ws
        .budget
        .lease("the choice of components", bytes(folder, selection))?;
    let beside = bytes_while_choosing(folder, selection);
    let _beside = ws.budget.lease("choosing components", beside)?;
    let mut chosen = Chosen {
        marks: Used::new(components),
        count: 0,
        triangles: 0,
        _lease: lease,
    };
    match heap_rows(folder, selection) {
        None => each_that_meets(folder, selection, |c, triangles| chosen.add(c, triangles))?,
        Some(k) => {
            for Reverse((triangles, Reverse(c))) in largest(folder, selection, k as usize)? {
                chosen.add(c, triangles);
            }
        }
    }
    if selection.invert {
        invert(folder, &mut chosen)?;
    }
    if chosen.count == 0 {
        let what = if selection.invert {
            format!(
                "none of the {components} components is left: all meet what --invert turns \
                 round; narrow it"
            )
        } else {
            format!("none of the {components} components meets the selection; widen it")
        };
        return Err(Error::Usage(what));
    }
    Ok(Some(chosen))
}

/// Takes what was left out.
fn invert(folder: &Folder, chosen: &mut Chosen) -> Result<()> {
    chosen.marks.invert(folder.manifest().counts.components);
    (chosen.count, chosen.triangles) = (0, 0);
    Rows::open(folder)?.each(|c, row| {
        if chosen.marks.has(c) {
            chosen.count += 1;
            chosen.triangles = chosen.triangles.saturating_add(row.base.triangles);
        }
        Ok(())
    })
}

type Ranked = Reverse<(u64, Reverse<u64>)>;

/// The k components with the most triangles, of those that meet the other conditions.
fn largest(folder: &Folder, selection: &Selection, k: usize) -> Result<BinaryHeap<Ranked>> {
    let mut heap: BinaryHeap<Ranked> = BinaryHeap::with_capacity(k);
    each_that_meets(folder, selection, |c, triangles| {
        let this = Reverse((triangles, Reverse(c)));
        if heap.len() < k {
            heap.push(this);
        } else if let Some(mut top) = heap.peek_mut()
            && this < *top
        {
            *top = this;
        }
    })?;
    Ok(heap)
}

/// Calls `f` with number and triangles of the components that meet the conditions.
fn each_that_meets(
    folder: &Folder,
    selection: &Selection,
    mut f: impl FnMut(u64, u64),
) -> Result<()> {
    Rows::open(folder)?.each(|c, row| {
        if selection.meets(c, row) {
            f(c, row.base.triangles);
        }
        Ok(())
    })
}
