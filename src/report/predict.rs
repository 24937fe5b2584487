//! What a build would take, for people and for programs: the answer of `build --dry-run`.
//!
//! Memory: the text. I/O: none.

use super::text::{grouped, line, megabytes, table_of_arrays};
use super::{Array, array_rows};
use crate::build::Prediction;
use serde::Serialize;
use std::fmt::Write;

/// A [`Prediction`] as `--dry-run --json` prints it. Bytes, unless said otherwise.
#[derive(Clone, Debug, Serialize)]
pub struct Predicted {
    /// Version of these keys.
    pub version: u32,
    /// Format of the input.
    pub format: &'static str,
    /// Bytes of the input.
    pub input_bytes: u64,
    /// Triangles.
    pub triangles: u64,
    /// Vertices, before a weld; null when only the indices themselves tell.
    pub vertices: Option<u64>,
    /// True when these counts are certain, false when they are estimates.
    pub exact: bool,
    /// Index type: "u4" or "u8".
    pub index: String,
    /// Coordinate type, or null.
    pub coords: Option<String>,
    /// True when vertices of equal position become one.
    pub welded: bool,
    /// Memory.
    pub memory: Memory,
    /// Triangles of a chunk.
    pub chunk_triangles: u64,
    /// Threads.
    pub threads: u64,
    /// Scratch space.
    pub scratch: Scratch,
    /// The folder.
    pub output: Output,
    /// The plan: scan and chunks of a mesh in file order; where one in random order would go
    /// through cells, those passes.
    pub plan: Vec<PlanStep>,
    /// The passes in order, for a coherent mesh.
    pub passes: Vec<Pass>,
}

/// Memory in bytes.
#[derive(Clone, Debug, Serialize)]
pub struct Memory {
    /// The budget of `--memory`.
    pub budget: u64,
    /// The least that a build accepts, whatever the order.
    pub least: u64,
    /// What keeps labels in memory in the worst order.
    pub labels: u64,
    /// True when the budget is not below the least.
    pub accepted: bool,
}

/// Scratch space in bytes, at most at once.
#[derive(Clone, Debug, Serialize)]
pub struct Scratch {
    /// For this mesh, as far as it was looked at.
    pub expected: u64,
    /// Triangles that were looked at.
    pub looked_at: u64,
    /// For a coherent mesh.
    pub coherent: u64,
    /// For triangles and vertices in random order.
    pub worst_order: u64,
    /// For any mesh of these counts.
    pub most: u64,
}

/// The finished folder.
#[derive(Clone, Debug, Serialize)]
pub struct Output {
    /// Bytes of all files.
    pub bytes: u64,
    /// True when something of that name is there already.
    pub exists: bool,
    /// The arrays, with components and culprits as counts and hubs tell.
    pub arrays: Vec<Array>,
}

/// One pass.
#[derive(Clone, Debug, Serialize)]
pub struct Pass {
    /// Its name, as in the report of a build.
    pub name: &'static str,
    /// What it counts; empty when nothing.
    pub unit: &'static str,
    /// How many.
    pub units: u64,
    /// Bytes read, scratch included.
    pub read: u64,
    /// Bytes written, scratch included.
    pub written: u64,
}

/// A phase of the plan.
#[derive(Clone, Debug, Serialize)]
pub struct PlanStep {
    /// The pass.
    pub name: &'static str,
    /// What its work is cut into.
    pub part: &'static str,
    /// How many of them.
    pub parts: u64,
    /// Bytes of the budget, at most.
    pub bytes: u64,
}

/// Puts a prediction into the form that is printed.
pub fn predicted(p: &Prediction) -> Predicted {
    let pass = |pass: &crate::build::PassPrediction| Pass {
        name: pass.name,
        unit: pass.unit,
        units: pass.units,
        read: pass.io.read,
        written: pass.io.written,
    };
    let step = |phase: &crate::build::Phase| PlanStep {
        name: phase.name,
        part: phase.part,
        parts: phase.parts,
        bytes: phase.bytes,
    };
    Predicted {
        version: 1,
        format: p.survey.format.name(),
        input_bytes: p.survey.input_bytes,
        triangles: p.survey.triangles,
        vertices: p.survey.vertices,
        exact: p.survey.exact,
        index: format!("u{}", p.shape.index),
        coords: (p.shape.coord > 0).then(|| format!("f{}", p.shape.coord)),
        welded: p.survey.welded,
        memory: Memory {
            budget: p.memory,
            least: p.least_memory,
            labels: p.label_memory,
            accepted: p.check().is_ok(),
        },
        chunk_triangles: p.plan.chunk,
        threads: p.shape.threads,
        scratch: Scratch {
            expected: p.expected_scratch,
            looked_at: p.looked_at,
            coherent: p.scratch,
            worst_order: p.worst_scratch,
            most: p.most_scratch,
        },
        output: Output {
            bytes: p.output,
            exists: p.exists,
            arrays: array_rows(&p.arrays, p.shape.triangles),
        },
        plan: p.phases.iter().map(step).collect(),
        passes: p.passes.iter().map(pass).collect(),
    }
}

/// The prediction as text.
pub fn render_predicted(p: &Predicted) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "a build of this {} of {} would take:\n",
        p.format,
        megabytes(p.input_bytes)
    );
    let counted = if p.exact { "" } else { "about" };
    line(&mut out, "triangles", p.triangles, counted);
    match p.vertices {
        Some(n) if p.format == "stl" => line(&mut out, "vertices", n, "about, when closed"),
        Some(n) if p.welded => line(&mut out, "vertices", n, "before the weld"),
        Some(n) => line(&mut out, "vertices", n, counted),
        None => {
            let _ = writeln!(out, "  {:<26}{:>15}  until counted", "vertices", "unknown");
        }
    }
    sizes(&mut out, p);
    out.push('\n');
    table_of_arrays(&mut out, &p.output.arrays);
    plan(&mut out, &p.plan);
    let _ = writeln!(
        out,
        "\n  pass, for a coherent mesh                      read       written"
    );
    for pass in &p.passes {
        let units = match pass.unit {
            "" => String::new(),
            unit => format!("{} {unit}", grouped(pass.units)),
        };
        let (read, written) = (megabytes(pass.read), megabytes(pass.written));
        let _ = writeln!(out, "  {:<14}{units:>24}{read:>14}{written:>14}", pass.name);
    }
    out
}

/// The phases, with what they cut their work into and draw from the budget.
fn plan(out: &mut String, steps: &[PlanStep]) {
    let heading = "plan (cells: for triangles in no order)";
    let _ = writeln!(out, "\n  {heading:<42}{:>12}", "memory");
    for step in steps {
        let parts = format!("{} {}", grouped(step.parts), step.part);
        let bytes = megabytes(step.bytes);
        let _ = writeln!(out, "  {:<14}{parts:>28}{bytes:>12}", step.name);
    }
}

/// Memory, scratch space and output.
fn sizes(out: &mut String, p: &Predicted) {
    let mut row = |name: &str, bytes: u64, remark: &str| {
        let _ = writeln!(out, "  {name:<26}{:>15}  {remark}", megabytes(bytes));
    };
    let verdict = if p.memory.accepted {
        "the budget; at most 64 MiB more are resident"
    } else {
        "the budget, which is too small: the build would be refused"
    };
    row("memory", p.memory.budget, verdict);
    row("  least", p.memory.least, "whatever the order");
    let labels = "keeps labels in memory, in random order too";
    row("  labels", p.memory.labels, labels);
    let looked = match p.scratch.looked_at {
        0 => "without a look at the triangles: none were found".to_owned(),
        n => format!("expected, after a look at {} triangles", grouped(n)),
    };
    row("scratch", p.scratch.expected, &looked);
    let coherent = "when triangles near in the file are near on the surface";
    row("  coherent", p.scratch.coherent, coherent);
    row(
        "  worst order",
        p.scratch.worst_order,
        "when they are in random order",
    );
    let most = "for any mesh, such as one whose triangles are all on one edge";
    row("  most", p.scratch.most, most);
    let exists = if p.output.exists {
        "the name is taken: --force would replace it"
    } else {
        "components and culprits as counts and hubs tell"
    };
    row("output", p.output.bytes, exists);
}
