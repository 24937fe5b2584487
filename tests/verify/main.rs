//! `verify` accepts what a naive writer makes of every mesh, and notices, by the right check
//! and at the right id, each way in which such a folder can be wrong.

mod bits;
mod breaks;
mod built;
mod files;
mod lists;
mod measures;
mod memory;
mod meshes;
mod naive;
mod orientation;
mod relations;
mod shapes;
mod table;

use cornermill::Result;
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::Orient;
use cornermill::verify::{Limits, Verdict, least_memory, verify};
use naive::{Parts, parts};
use std::path::Path;
use std::sync::Arc;

const ORIENTS: [Orient; 4] = [
    Orient::Outward,
    Orient::Majority,
    Orient::First,
    Orient::Keep,
];

fn check(folder: &Path, memory: u64, threads: usize, limits: Limits) -> Result<Verdict> {
    let dir = tempfile::tempdir().unwrap();
    let io = Arc::new(Counters::default());
    let ws = Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.path().to_owned()], u64::MAX, &io)?,
        io,
        workers: Workers::new(threads)?,
        progress: Arc::new(NoProgress),
    };
    let verdict = verify(&ws, folder, limits);
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    verdict
}

fn verdict_of(parts: &Parts) -> Verdict {
    let dir = tempfile::tempdir().unwrap();
    parts.write(dir.path());
    check(dir.path(), 16 << 20, 2, Limits::default()).unwrap()
}

fn said(verdict: &Verdict) -> String {
    let lines = verdict
        .findings
        .iter()
        .map(|f| format!("[{}] {f}\n", f.check.name()));
    lines.collect()
}

#[test]
fn accepts_every_small_mesh() {
    for (name, soup) in meshes::all() {
        for (turn, orient) in ORIENTS.into_iter().enumerate() {
            let mut parts = parts(&soup, orient);
            parts.wide = turn % 2 == 1;
            parts.wide_g = turn >= 2;
            for (chunk, measured) in [(8, true), (1 << 19, true), (8, false)] {
                if !measured {
                    parts.measured = None;
                }
                let dir = tempfile::tempdir().unwrap();
                parts.write(dir.path());
                let limits = Limits {
                    chunk,
                    ..Limits::default()
                };
                let memory = least_memory(3);
                let verdict = check(dir.path(), memory, 3, limits).unwrap();
                assert!(verdict.ok(), "{name}, {orient:?}:\n{}", said(&verdict));
                assert!(verdict.findings.is_empty() && verdict.notes.is_empty());
                assert_eq!(verdict.checked.triangles, parts.counts.triangles);
                assert_eq!(verdict.checked.edges, parts.counts.distinct_edges);
            }
        }
    }
}
