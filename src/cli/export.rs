//! `cornermill export`: a folder, or chosen components of it, to another format.

use super::select::SelectArgs;
use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::parent;
use crate::error::{Error, Result};
use crate::export::{ExportRequest, Format, export};
use crate::folder::Folder;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

/// Arguments of `export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Mesh folder
    folder: PathBuf,
    /// File to write (NAME.npy also writes NAME.G.npy); - is standard output
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Format, instead of what the name ends in
    #[arg(long, value_enum)]
    format: Option<FormatArg>,
    /// PLY as text
    #[arg(long)]
    ascii: bool,
    #[command(flatten)]
    select: SelectArgs,
    /// Undo the flips: every triangle as the input had it
    #[arg(long)]
    input_orientation: bool,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// A format by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum FormatArg {
    /// Stanford PLY
    Ply,
    /// STL, binary
    Stl,
    /// Wavefront OBJ
    Obj,
    /// Object File Format
    Off,
    /// NumPy arrays
    Npy,
}

impl FormatArg {
    /// The format asked for, or else the one that the file name ends in.
    ///
    /// # Errors
    /// [`Error::Usage`] when neither says.
    pub(super) fn of(asked: Option<FormatArg>, output: &Path) -> Result<Format> {
        Ok(match asked {
            Some(FormatArg::Ply) => Format::Ply,
            Some(FormatArg::Stl) => Format::Stl,
            Some(FormatArg::Obj) => Format::Obj,
            Some(FormatArg::Off) => Format::Off,
            Some(FormatArg::Npy) => Format::Npy,
            None => Format::of(output).ok_or_else(|| {
                Error::Usage(format!(
                    "{} does not end in ply, stl, obj, off or npy; give --format",
                    output.display()
                ))
            })?,
        })
    }
}

/// Runs `export`.
///
/// # Errors
/// Those of [`export`].
pub(super) fn run(args: &ExportArgs) -> Result<Outcome> {
    let format = FormatArg::of(args.format, &args.output)?;
    let request = ExportRequest {
        format,
        target: args.output.clone(),
        ascii: args.ascii,
        selection: args.select.selection(),
        input_orientation: args.input_orientation,
        force: args.force,
    };
    let ws = args.work.workspace(parent(&args.output))?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let count = export(&ws, &folder, &request)?;
    // With the mesh itself on stdout there is no place for a report.
    if !args.work.quiet && args.output != Path::new("-") {
        let from = count
            .components
            .map_or(String::new(), |n| format!(" of {n} components"));
        let names: Vec<String> = count
            .files
            .iter()
            .map(|f| f.display().to_string())
            .collect();
        tell(&format!(
            "{} triangles{from} and {} vertices in {} bytes: {}\n",
            count.triangles,
            count.vertices,
            count.bytes,
            names.join(", ")
        ))?;
    }
    Ok(Outcome::Done)
}
