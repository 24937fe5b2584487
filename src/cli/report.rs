//! `cornermill report`: a folder as one page of HTML.

use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::parent;
use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::report::page::{self, PageRequest};
use crate::report::picture::{MOST_PIXELS, direction};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Mesh folder
    folder: PathBuf,
    /// HTML file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// What `build --json=FILE` wrote: adds what the build cost
    #[arg(long, value_name = "FILE")]
    build: Option<PathBuf>,
    /// Pixels of each picture
    #[arg(long, value_name = "N", default_value_t = 480)]
    size: u32,
    /// Leave pictures out: each takes a pass over the mesh
    #[arg(long)]
    no_pictures: bool,
    /// The direction that is up in the mesh
    #[arg(
        long,
        value_name = "X,Y,Z",
        default_value = "0,1,0",
        allow_hyphen_values = true
    )]
    up: String,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// Runs `report`.
///
/// # Errors
/// Those of [`page::write`].
pub(super) fn run(args: &ReportArgs) -> Result<Outcome> {
    if !(1..=MOST_PIXELS).contains(&args.size) {
        return Err(Error::Usage(format!(
            "pictures of {} pixels: give 1 to {MOST_PIXELS}, or --no-pictures",
            args.size
        )));
    }
    let request = PageRequest {
        pixels: if args.no_pictures { 0 } else { args.size },
        up: direction(&args.up)?,
        build: args.build.clone(),
    };
    let ws = args.work.workspace(parent(&args.output))?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let bytes = page::write(&ws, &folder, &request, &args.output, args.force)?;
    if !args.work.quiet {
        tell(&format!("{}: {bytes} bytes\n", args.output.display()))?;
    }
    Ok(Outcome::Done)
}
