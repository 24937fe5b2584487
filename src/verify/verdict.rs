//! What a check of a folder found: findings that name the culprit, and what was looked at.
//!
//! Any number of threads may report. Of each check the findings with the smallest ids are
//! kept, so the verdict does not depend on the order of work, and all of them are counted.
//!
//! Memory: [`Limits::findings`](super::Limits) findings a check, a few hundred bytes each.
//! I/O: none.

use crate::error::printable;
use std::fmt;
use std::sync::Mutex;

/// What is checked; findings are grouped and counted by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Check {
    /// The manifest agrees with itself: names, types, shapes, conventions.
    Manifest,
    /// Every file is there, of the right length, with the exact header.
    Header,
    /// Every 64 MiB of every file has the checksum of the manifest.
    Checksum,
    /// Every entry of V is a vertex.
    VertexRange,
    /// Every entry of O is NONE or a corner of another triangle.
    OppositeRange,
    /// O pairs exactly the two corners of each regular edge, and nothing else.
    Opposite,
    /// `degenerate.npy` lists exactly the triangles with a repeated vertex.
    Degenerate,
    /// `nonmanifold_edges.npy` lists exactly the edges with three or more corners.
    NonmanifoldEdges,
    /// `nonmanifold_corners.npy` lists exactly their corners.
    NonmanifoldCorners,
    /// `nonmanifold_vertices.npy` lists exactly the vertices with more than one fan.
    NonmanifoldVertices,
    /// `duplicate.npy` lists exactly the triangles that have the vertices of an earlier one.
    Duplicate,
    /// Labels are in range, alike across opposites, and numbered by first triangle.
    Label,
    /// One label is one component.
    Connected,
    /// Triangles across an edge agree, and the orientation follows the option.
    Orientation,
    /// `flipped.npy` has no bit where none belongs.
    FlippedBits,
    /// Every column of `components.npy` is what the other arrays say.
    ComponentTable,
    /// Every count of the manifest is what the arrays say.
    Counts,
    /// Every measure of the manifest is what the arrays say.
    Measures,
    /// Ids in the folder that this one was filtered from ascend, and are ids.
    Maps,
}

/// Number of kinds of [`Check`].
const CHECKS: usize = Check::Maps as usize + 1;

impl Check {
    /// All checks, in the order of a verdict.
    pub const ALL: [Check; CHECKS] = [
        Check::Manifest,
        Check::Header,
        Check::Checksum,
        Check::VertexRange,
        Check::OppositeRange,
        Check::Opposite,
        Check::Degenerate,
        Check::NonmanifoldEdges,
        Check::NonmanifoldCorners,
        Check::NonmanifoldVertices,
        Check::Duplicate,
        Check::Label,
        Check::Connected,
        Check::Orientation,
        Check::FlippedBits,
        Check::ComponentTable,
        Check::Counts,
        Check::Measures,
        Check::Maps,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Check::Manifest => "manifest",
            Check::Header => "header",
            Check::Checksum => "checksum",
            Check::VertexRange => "vertex range",
            Check::OppositeRange => "opposite range",
            Check::Opposite => "opposite",
            Check::Degenerate => "degenerate",
            Check::NonmanifoldEdges => "non-manifold edges",
            Check::NonmanifoldCorners => "non-manifold corners",
            Check::NonmanifoldVertices => "non-manifold vertices",
            Check::Duplicate => "duplicate",
            Check::Label => "label",
            Check::Connected => "connected",
            Check::Orientation => "orientation",
            Check::FlippedBits => "flipped bits",
            Check::ComponentTable => "component table",
            Check::Counts => "counts",
            Check::Measures => "measures",
            Check::Maps => "maps",
        }
    }
}

/// Where a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum At {
    /// The file as a whole.
    File,
    /// A byte of the file.
    Byte(u64),
    /// A block of 64 MiB, by number.
    Block(u64),
    /// A corner.
    Corner(u64),
    /// A triangle.
    Triangle(u64),
    /// A vertex.
    Vertex(u64),
    /// A row of a list.
    Row(u64),
    /// A component.
    Component(u64),
    /// An edge, by its vertices.
    Edge(u64, u64),
    /// A key of the manifest.
    Key(&'static str),
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            At::File => f.write_str("whole file"),
            At::Byte(n) => write!(f, "byte {n}"),
            At::Block(n) => write!(f, "block {n}"),
            At::Corner(n) => write!(f, "corner {n}"),
            At::Triangle(n) => write!(f, "triangle {n}"),
            At::Vertex(n) => write!(f, "vertex {n}"),
            At::Row(n) => write!(f, "row {n}"),
            At::Component(n) => write!(f, "component {n}"),
            At::Edge(lo, hi) => write!(f, "edge {{{lo}, {hi}}}"),
            At::Key(key) => f.write_str(key),
        }
    }
}

/// One thing that is wrong with a folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Finding {
    /// The check that failed.
    pub check: Check,
    /// The file concerned, by its name in the folder.
    pub file: String,
    /// Where in it.
    pub at: At,
    /// What is there.
    pub found: String,
    /// What should be.
    pub expected: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Finding {
            file,
            at,
            found,
            expected,
            ..
        } = self;
        write!(f, "{file}: {at}: {found}; expected {expected}")
    }
}

/// How much was looked at, and by which way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Checked {
    /// Files whose bytes were summed.
    pub files: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Triangles of V, each with three corners.
    pub triangles: u64,
    /// Vertices.
    pub vertices: u64,
    /// Distinct edges.
    pub edges: u64,
    /// Components.
    pub components: u64,
    /// Sorted runs of edges that went through scratch space.
    pub edge_runs: u64,
    /// Ranges of triangles that connectivity was settled in; 1 when it fitted in memory.
    pub link_ranges: u64,
    /// Ranges of corners that fans and border loops were settled in; 0 in folders without
    /// measures.
    pub corner_ranges: u64,
    /// Corners whose coordinates were joined by sorting, not read where they lie.
    pub far_corners: u64,
}

/// The outcome of [`verify`](super::verify).
#[derive(Clone, Debug, Default)]
pub struct Verdict {
    /// The first findings of each check, in the order of [`Check::ALL`].
    pub findings: Vec<Finding>,
    /// How many there are of each check that failed, kept or not.
    pub totals: Vec<(Check, u64)>,
    /// Remarks that are no faults: files that are not part of the format, what was not checked.
    pub notes: Vec<String>,
    /// How much was looked at.
    pub checked: Checked,
    /// False when some arrays could not be read as what they should be, so that the
    /// relations between them were not checked.
    pub complete: bool,
}

impl Verdict {
    /// True when nothing is wrong.
    pub fn ok(&self) -> bool {
        self.totals.is_empty() && self.complete
    }

    /// Number of findings of a check.
    pub fn count(&self, check: Check) -> u64 {
        let of = self.totals.iter().find(|(which, _)| *which == check);
        of.map_or(0, |(_, n)| *n)
    }
}

/// Collects findings from any thread.
pub(super) struct Findings {
    few: usize,
    kept: Mutex<Vec<Kept>>,
}

#[derive(Clone, Default)]
struct Kept {
    total: u64,
    least: Vec<Finding>,
}

impl Findings {
    pub(super) fn new(few: usize) -> Findings {
        Findings {
            few,
            kept: Mutex::new(vec![Kept::default(); CHECKS]),
        }
    }

    /// Counts a finding, and keeps it when it is among the first of its check; `words` gives
    /// (found, expected) and is called only then.
    pub(super) fn add(
        &self,
        check: Check,
        file: &str,
        at: At,
        words: impl FnOnce() -> (String, String),
    ) {
        let mut all = self.kept.lock().unwrap_or_else(|e| e.into_inner());
        let kept = &mut all[check as usize];
        kept.total += 1;
        let full = kept.least.len() >= self.few;
        if full && kept.least.last().is_none_or(|last| last.at <= at) {
            return;
        }
        let (found, expected) = words();
        kept.least.push(Finding {
            check,
            file: printable(file.to_owned()),
            at,
            found: printable(found),
            expected: printable(expected),
        });
        kept.least.sort_by(|a, b| (a.at, a).cmp(&(b.at, b)));
        kept.least.truncate(self.few);
    }

    /// A finding whose two values differ, unless they are equal.
    pub(super) fn equal<T: PartialEq + fmt::Display>(
        &self,
        check: Check,
        file: &str,
        at: At,
        what: &str,
        found: T,
        expected: T,
    ) {
        if found != expected {
            self.add(check, file, at, || {
                (format!("{what} is {found}"), expected.to_string())
            });
        }
    }

    pub(super) fn into_verdict(self) -> Verdict {
        let kept = self.kept.into_inner().unwrap_or_else(|e| e.into_inner());
        let mut verdict = Verdict::default();
        for (check, kept) in Check::ALL.into_iter().zip(kept) {
            if kept.total > 0 {
                verdict.totals.push((check, kept.total));
            }
            verdict.findings.extend(kept.least);
        }
        verdict
    }
}

/// An id in words: NONE for the all-ones value.
pub(super) fn id(value: u64) -> String {
    if value == u64::MAX {
        "NONE".to_owned()
    } else {
        value.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_smallest_and_counts_all() {
        let findings = Findings::new(2);
        for c in [9, 3, 7, 1, 8] {
            findings.add(Check::Opposite, "O.npy", At::Corner(c), || {
                (format!("O[{c}] is 0"), id(u64::MAX))
            });
        }
        let verdict = findings.into_verdict();
        let said: Vec<String> = verdict.findings.iter().map(|f| f.to_string()).collect();
        assert_eq!(
            said,
            [
                "O.npy: corner 1: O[1] is 0; expected NONE",
                "O.npy: corner 3: O[3] is 0; expected NONE"
            ]
        );
        assert_eq!(verdict.count(Check::Opposite), 5);
        assert!(!verdict.ok());
    }

    #[test]
    fn every_check_has_its_place() {
        for (place, check) in Check::ALL.into_iter().enumerate() {
            assert_eq!(check as usize, place);
        }
    }
}
