//! Vertex stars of the whole mesh: fans, valences, border loops, non-manifold vertices, duplicates.
//!
//! ```text
//!   chunk or cell ──> counts by local component (rings, loops)        decided there
//!        │
//!        ├─ parts of fans at vertices that others may name ──gather──> rings, open fans ──┐
//!        │                          (hubs: by contraction)                                │
//!        ├─ fans at vertices with several ─────────────────────> shared ──┐      corners without
//!        │                                                                │      opposite ──loops
//!        └─ triangles that may have twins ──duplicates──> duplicate.npy   │               │
//!                                                                         ▼               ▼
//!                                          non-manifold vertices, vertices by component, table
//! ```
//!
//! 1. [`spill`]: what chunks and cells hand out ([`star`](crate::chunk::star) finds it).
//! 2. [`gather`](mod@gather): joins the parts of each vertex ([`group`]); a vertex with more parts than memory
//!    holds goes to [`hubs`](mod@hubs).
//! 3. [`loops`](mod@loops): joins open fans end to end.
//! 4. [`duplicates`]: compares triangles whose edges do not tell.
//! 5. [`shared`]: once components are known, which of them meet at a vertex.
//!
//! Why counting suffices: an open fan has two ends on corners without opposite, and each such
//! corner lies at the ends of two fans. So a component has as many open fans as such corners, and
//! only rings need a walk. An edge is decided among the parts of one vertex without looking at O:
//! every triangle on an undecided edge hands out one end that names it, so two ends are opposite,
//! and one, or three and more, have no opposite.
//!
//! Memory and I/O: with each pass.

pub mod duplicates;
pub mod gather;
pub mod group;
pub mod hubs;
pub mod loops;
pub mod paths;
pub mod records;
pub mod shared;
pub mod spill;

use self::duplicates::{candidates, list};
use self::gather::{Gathered, gather};
use self::hubs::hubs;
use self::loops::loops;
use self::records::Twin;
use self::spill::Left;
use super::Job;
use super::arrays::OutArray;
use super::nodes::Nodes;
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::{Error, Result};
use crate::folder::ValenceClass;
use crate::shuffle::Buckets;

/// Vertices by valence: valences below 64, then powers of two.
#[derive(Clone, Debug)]
pub struct Valences {
    classes: [u64; Self::EXACT as usize + 64],
    /// The largest.
    pub largest: u64,
    /// Corners of the vertices that were counted.
    pub corners: u64,
}

impl Default for Valences {
    fn default() -> Self {
        Valences {
            classes: [0; Self::EXACT as usize + 64],
            largest: 0,
            corners: 0,
        }
    }
}

impl Valences {
    /// What was counted, class by class.
    pub fn counted(&self) -> [u64; Self::EXACT as usize + 64] {
        self.classes
    }

    /// What was counted before.
    pub fn of(classes: &[u64], largest: u64, corners: u64) -> Option<Valences> {
        Some(Valences {
            classes: classes.try_into().ok()?,
            largest,
            corners,
        })
    }

    /// Valences below are classes of their own.
    const EXACT: u64 = 64;

    /// Counts a vertex of so many corners.
    #[inline]
    pub fn add(&mut self, corners: u64) {
        let class = match corners.checked_sub(Self::EXACT) {
            None => corners,
            Some(_) => Self::EXACT - u64::from(Self::EXACT.ilog2()) + u64::from(corners.ilog2()),
        };
        self.classes[class as usize] += 1;
        self.largest = self.largest.max(corners);
        self.corners += corners;
    }

    /// Adds another's vertices.
    pub fn merge(&mut self, other: &Valences) {
        let pairs = self.classes.iter_mut().zip(&other.classes);
        pairs.for_each(|(own, more)| *own += more);
        self.largest = self.largest.max(other.largest);
        self.corners += other.corners;
    }

    /// Vertices that were counted.
    pub fn vertices(&self) -> u64 {
        self.classes.iter().sum()
    }

    /// The classes that are not empty, of a mesh of so many vertices: those that were not counted
    /// have valence 0.
    ///
    /// # Errors
    /// [`Error::Internal`] when more were counted than there are.
    pub fn classes(&self, vertices: u64) -> Result<Vec<ValenceClass>> {
        let mut all = self.classes;
        let counted = self.vertices();
        all[0] += vertices.checked_sub(counted).ok_or_else(|| {
            Error::Internal(format!(
                "the pass 'stars' counted {counted} of {vertices} vertices"
            ))
        })?;
        let class = |(i, &vertices): (u64, &u64)| {
            let (from, to) = match i.checked_sub(Self::EXACT) {
                None => (i, i),
                Some(more) => (Self::EXACT << more, (Self::EXACT << more) * 2 - 1),
            };
            ValenceClass { from, to, vertices }
        };
        let some = (0..).zip(&all).filter(|(_, vertices)| **vertices > 0);
        Ok(some.map(class).collect())
    }
}

/// The stars, before components are known. Numbers are those of local components.
pub struct Starred<W: Index> {
    /// For each ring that was joined of parts, its number.
    pub rings: ScratchFile,
    /// For each loop that was joined of chains, its number.
    pub loops: ScratchFile,
    /// (vertex, number) of each fan of the vertices that have several.
    pub shared: ScratchFile,
    /// Vertices by valence.
    pub valences: Valences,
    duplicates: Buckets<Twin<W>>,
}

impl<W: Index> Starred<W> {
    /// Finds the stars from what chunks or cells spilled.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`];
    /// [`crate::Error::Internal`] when ends of fans do not come in pairs.
    pub fn new(job: &Job, nodes: &Nodes, left: Left<W>) -> Result<Starred<W>> {
        let Left {
            parts,
            candidates: trios,
            twins,
            shared: early,
            valences,
        } = left;
        candidates(job, trios, &twins)?;
        let mut gathered = Gathered::new(job.ws, valences)?;
        gather(job, nodes, &parts, &mut gathered)?;
        drop(parts);
        gathered.take_early::<W>(job, nodes, &early)?;
        drop(early);
        hubs::<W>(job, nodes, &gathered)?;
        loops::<W>(job, &gathered)?;
        let Gathered {
            rings,
            loops,
            shared,
            valences,
            ..
        } = gathered;
        Ok(Starred {
            rings,
            loops,
            shared,
            valences,
            duplicates: twins.finish()?,
        })
    }

    /// Number of triangles with the same vertices as an earlier one.
    pub fn duplicates(&self) -> u64 {
        self.duplicates.records()
    }

    /// Writes the list of them.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`].
    pub fn list_duplicates<I: Index>(&self, job: &Job) -> Result<OutArray> {
        list::<I, W>(job, &self.duplicates)
    }
}

impl<W: Index> Keep for Starred<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        let files = [&self.rings, &self.loops, &self.shared];
        files.into_iter().try_for_each(|file| to.file(file))?;
        self.valences.keep(to)?;
        self.duplicates.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Starred<W>> {
        Ok(Starred {
            rings: from.file()?,
            loops: from.file()?,
            shared: from.file()?,
            valences: Valences::restore(from)?,
            duplicates: Buckets::restore(from)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_exact_and_then_double() {
        let mut valences = Valences::default();
        for n in [1, 63, 63, 64, 127, 128, 255, 256, 1 << 40] {
            valences.add(n);
        }
        let classes = valences.classes(11).unwrap();
        let found: Vec<_> = classes.iter().map(|c| (c.from, c.to, c.vertices)).collect();
        let expected = [
            (0, 0, 2),
            (1, 1, 1),
            (63, 63, 2),
            (64, 127, 2),
            (128, 255, 2),
            (256, 511, 1),
            (1 << 40, (1 << 41) - 1, 1),
        ];
        assert_eq!(found, expected);
        assert_eq!(valences.largest, 1 << 40);
    }
}
