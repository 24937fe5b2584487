//! `cornermill check`: a folder held to requirements, for scripts.

use super::{Outcome, tell, to_json};
use crate::disk::Counters;
use crate::error::Result;
use crate::folder::Folder;
use crate::report::{Requirement, check, render_checked};
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Mesh folder
    folder: PathBuf,
    /// What it shall be: closed, watertight, manifold, manifold-edges, no-borders, oriented, outward,
    /// single, smesh, no-duplicates, no-degenerates, no-unreferenced, finite, components=N,
    /// genus=N, border-loops=N; several with commas between
    #[arg(long, value_name = "LIST", value_delimiter = ',', required = true)]
    require: Vec<String>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

/// Runs `check`: a requirement that is not met is a failed check, exit code 1.
///
/// # Errors
/// Those of [`Requirement::parse`], [`Folder::open`] and [`check`].
pub(super) fn run(args: &CheckArgs) -> Result<Outcome> {
    let wanted = args
        .require
        .iter()
        .map(|text| Requirement::parse(text.trim()));
    let wanted: Vec<Requirement> = wanted.collect::<Result<_>>()?;
    let folder = Folder::open(&args.folder, &Arc::new(Counters::default()))?;
    let checked = check(&folder, &wanted)?;
    if args.json {
        tell(&to_json(&checked)?)?;
    } else {
        tell(&render_checked(&checked))?;
    }
    Ok(if checked.passed {
        Outcome::Done
    } else {
        Outcome::CheckFailed
    })
}
