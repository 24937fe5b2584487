//! `cornermill info`: what the manifest of a folder, or the index of a compressed file, says.

use super::{Outcome, print, to_json};
use crate::codec::packed::Packed;
use crate::disk::{Budget, Counters};
use crate::error::{Error, Result};
use crate::folder::Folder;
use crate::report;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;

/// Arguments of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Mesh folder, or compressed file
    folder: PathBuf,
    /// Print the manifest as JSON (of a folder)
    #[arg(long)]
    json: bool,
}

/// Runs `info`.
///
/// # Errors
/// Those of [`Folder::open`] and [`Packed::open`].
pub(super) fn run(args: &InfoArgs) -> Result<Outcome> {
    if args.folder.is_file() {
        return packed(args);
    }
    let folder = Folder::open(&args.folder, &Arc::new(Counters::default()))?;
    if args.json {
        print(&to_json(folder.manifest())?)?;
    } else {
        print(&report::info(folder.manifest()))?;
    }
    Ok(Outcome::Done)
}

/// Says what a compressed file holds.
fn packed(args: &InfoArgs) -> Result<Outcome> {
    if args.json {
        let what = "--json is for mesh folders; a compressed file has no manifest";
        return Err(Error::Usage(what.into()));
    }
    let io = Arc::new(Counters::default());
    // The index of 2^40 triangles takes this.
    let packed = Packed::open(&Budget::new(256 << 20), &io, &args.folder)?;
    print(&packed.describe()?)?;
    Ok(Outcome::Done)
}
