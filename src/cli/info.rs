//! `cornermill info`: what the manifest says, in O(1).

use super::{Outcome, print, to_json};
use crate::disk::Counters;
use crate::error::Result;
use crate::folder::Folder;
use crate::report;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Arguments of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Mesh folder
    folder: PathBuf,
    /// Print the manifest as JSON
    #[arg(long)]
    json: bool,
}

/// Runs `info`.
///
/// # Errors
/// Those of [`Folder::open`].
pub(super) fn run(args: &InfoArgs) -> Result<Outcome> {
    let folder = Folder::open(&args.folder, &Arc::new(Counters::default()))?;
    if args.json {
        print(&to_json(folder.manifest())?)?;
    } else {
        print(&report::info(folder.manifest()))?;
    }
    Ok(Outcome::Done)
}
