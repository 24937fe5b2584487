//! The plan of a build, phase by phase: into how many parts each cuts its work, and the memory
//! that it draws at most. Of a mesh in file order the scan and the chunks, and, where a mesh in
//! random order would go through cells, those passes.
//!
//! Memory: none. I/O: none.

use super::cells::CellPlan;
use super::cells::map::CellMap;
use super::plan::{Plan, Shape};
use super::way::{Kind, fitting, helpful};

/// One phase of a build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// The pass.
    pub name: &'static str,
    /// What its work is cut into.
    pub part: &'static str,
    /// How many of them.
    pub parts: u64,
    /// Bytes drawn from the budget, at most.
    pub bytes: u64,
}

/// The phases of a build in so much memory.
pub fn phases(shape: &Shape, plan: &Plan, memory: u64) -> Vec<Phase> {
    let phase = |name, part, parts, bytes| Phase {
        name,
        part,
        parts,
        bytes,
    };
    let chunks = plan.chunks(shape.triangles);
    let writers = shape.threads * shape.writer_bytes(plan);
    let bytes = shape.pass_bytes(plan);
    let mut phases = vec![
        phase("scan", "chunks", chunks, bytes - writers),
        phase("chunks", "chunks", chunks, bytes),
    ];
    let Some(kind) = fitting(shape, plan, memory).filter(|_| helpful(shape, plan)) else {
        return phases;
    };
    let cells = CellPlan::new(shape, memory, kind == Kind::Place, plan.buckets);
    let (t, held) = (shape.threads, CellPlan::held(shape));
    let map = match kind {
        Kind::Place => CellMap::bytes_by_place(shape.vertices),
        Kind::Id => 0,
    };
    let whole = if CellPlan::maps_all(shape, memory) {
        3 * shape.coord * shape.vertices
    } else {
        0
    };
    let dealt = t * (cells.dealt.writer_bytes() + cells.lone.writer_bytes());
    let deal = held + map + whole + shape.vertices / 8 + dealt;
    phases.extend([
        phase("cells", "cells", cells.cells, held + map),
        phase("deal", "cells", cells.cells, deal),
        // Cells get what is left.
        phase("settle", "cells", cells.cells, memory),
        phase(
            "assemble",
            "windows",
            cells.windows.count,
            held + t * cells.window_bytes(shape),
        ),
    ]);
    phases
}
