//! `cornermill verify`: the full independent check of a mesh folder.

use super::work::WorkArgs;
use super::{Outcome, tell, to_json};
use crate::error::Result;
use crate::verify::{Limits, Verdict, verify};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// Mesh folder
    folder: PathBuf,
    /// Findings shown of each check; all are counted
    #[arg(long, value_name = "N", default_value_t = 8)]
    findings: usize,
    /// Print as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// Runs `verify`: a wrong folder is a failed check, exit code 1.
///
/// # Errors
/// Those of [`verify`].
pub(super) fn run(args: &VerifyArgs) -> Result<Outcome> {
    // Scratch goes to the system's place for it: the folder may be read-only.
    let ws = args.work.workspace(&std::env::temp_dir())?;
    let limits = Limits {
        findings: args.findings,
        ..Limits::default()
    };
    let verdict = verify(&ws, &args.folder, limits)?;
    if args.json {
        tell(&to_json(&told(&verdict))?)?;
    } else if !args.work.quiet || !verdict.ok() {
        tell(&render(&verdict))?;
    }
    Ok(if verdict.ok() {
        Outcome::Done
    } else {
        Outcome::CheckFailed
    })
}

/// The verdict, as `--json` prints it.
fn told(verdict: &Verdict) -> Value {
    let c = &verdict.checked;
    let totals = verdict.totals.iter();
    let totals = totals.map(|(check, count)| json!({ "check": check.name(), "count": count }));
    let findings = verdict.findings.iter().map(|f| {
        json!({
            "check": f.check.name(), "file": f.file, "at": f.at.to_string(),
            "found": f.found, "expected": f.expected,
        })
    });
    json!({
        "version": 1,
        "right": verdict.ok(),
        "complete": verdict.complete,
        "checked": {
            "files": c.files, "bytes": c.bytes, "triangles": c.triangles,
            "vertices": c.vertices, "edges": c.edges, "components": c.components,
        },
        "totals": totals.collect::<Vec<_>>(),
        "findings": findings.collect::<Vec<_>>(),
        "notes": verdict.notes,
    })
}

fn render(verdict: &Verdict) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    for finding in &verdict.findings {
        let _ = writeln!(out, "{finding}");
    }
    for (check, total) in &verdict.totals {
        let _ = writeln!(out, "{}: {total} in all", check.name());
    }
    for note in &verdict.notes {
        let _ = writeln!(out, "note: {note}");
    }
    let c = &verdict.checked;
    let _ = writeln!(
        out,
        "{}: {} triangles, {} vertices, {} edges, {} components, {} files of {} bytes checked{}",
        if verdict.ok() { "right" } else { "WRONG" },
        c.triangles,
        c.vertices,
        c.edges,
        c.components,
        c.files,
        c.bytes,
        if verdict.complete {
            ""
        } else {
            "; not all could be checked"
        },
    );
    out
}
