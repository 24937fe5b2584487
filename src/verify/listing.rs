//! A list of ids in the folder, held to the ids that should be in it.
//!
//! Why no difference is missed: what should be there comes in ascending order, and each id of
//! it either is the next entry of the list, or is told missing; every entry that is stepped
//! over, or left at the end, is told too. So nothing is told only of a list that is the same.
//!
//! Memory: the buffer of the reader. I/O: the list once.

use super::read::{IdReader, Ids};
use super::verdict::{At, Check, Findings, id};
use crate::disk::Workspace;
use crate::error::Result;
use crate::folder::{DUPLICATE, NONMANIFOLD_VERTICES};

/// What a list is, in words.
pub(super) struct List {
    file: &'static str,
    check: Check,
    /// What an entry is.
    one: &'static str,
    /// What must be listed.
    all: &'static str,
    at: fn(u64) -> At,
}

/// `nonmanifold_vertices.npy`.
pub(super) const VERTICES: List = List {
    file: NONMANIFOLD_VERTICES,
    check: Check::NonmanifoldVertices,
    one: "vertex",
    all: "vertices with more than one fan, ascending",
    at: At::Vertex,
};

/// `duplicate.npy`.
pub(super) const DUPLICATES: List = List {
    file: DUPLICATE,
    check: Check::Duplicate,
    one: "triangle",
    all: "triangles with the three vertices of an earlier one, ascending",
    at: At::Triangle,
};

/// A list of the folder while what should be in it goes by.
pub(super) struct Listing<'a> {
    list: List,
    findings: &'a Findings,
    entries: IdReader<'a>,
    place: u64,
}

impl<'a> Listing<'a> {
    /// Opens `ids`, which is `list`.
    pub(super) fn new(
        ws: &Workspace,
        list: List,
        ids: &'a Ids,
        findings: &'a Findings,
    ) -> Result<Listing<'a>> {
        Ok(Listing {
            list,
            findings,
            entries: IdReader::new(ws, ids, 32 << 10)?,
            place: 0,
        })
    }

    /// The next id that should be listed; `why` is called when it is not.
    pub(super) fn expect(&mut self, own: u64, why: impl FnOnce() -> String) -> Result<()> {
        loop {
            match self.entries.get(self.place)? {
                Some(found) if found < own => self.stray(found),
                Some(found) if found == own => {
                    self.place += 1;
                    return Ok(());
                }
                _ => break,
            }
        }
        let List {
            file,
            check,
            all,
            at,
            ..
        } = self.list;
        self.findings.add(check, file, at(own), || {
            (format!("not listed ({})", why()), format!("all {all}"))
        });
        Ok(())
    }

    /// What is left in the list does not belong there.
    pub(super) fn finish(mut self) -> Result<()> {
        while let Some(found) = self.entries.get(self.place)? {
            self.stray(found);
        }
        Ok(())
    }

    fn stray(&mut self, found: u64) {
        let List {
            file,
            check,
            one,
            all,
            ..
        } = self.list;
        let at = At::Row(self.place);
        self.findings.add(check, file, at, || {
            (format!("{one} {}", id(found)), format!("only {all}"))
        });
        self.place += 1;
    }
}
