//! `cornermill filter`: chosen components of a folder as a folder of their own.

use super::select::SelectArgs;
use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::parent;
use crate::error::Result;
use crate::export::filter::{FilterRequest, filter};
use crate::folder::Folder;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `filter`.
#[derive(Debug, Args)]
pub struct FilterArgs {
    /// Mesh folder
    folder: PathBuf,
    /// Mesh folder to make
    #[arg(short, long, value_name = "OUT.ct")]
    output: PathBuf,
    #[command(flatten)]
    select: SelectArgs,
    /// Replace an existing mesh folder
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// Runs `filter`.
///
/// # Errors
/// Those of [`filter`].
pub(super) fn run(args: &FilterArgs) -> Result<Outcome> {
    let ws = args.work.workspace(parent(&args.output))?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let request = FilterRequest {
        target: args.output.clone(),
        selection: args.select.selection(),
        force: args.force,
    };
    let manifest = filter(&ws, &folder, &request)?;
    if !args.work.quiet {
        let counts = &manifest.counts;
        tell(&format!(
            "{} triangles of {} components and {} vertices: {}\n",
            counts.triangles,
            counts.components,
            counts.vertices,
            args.output.display()
        ))?;
    }
    Ok(Outcome::Done)
}
