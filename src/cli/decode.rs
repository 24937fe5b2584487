//! `cornermill decode`: a compressed file to a mesh folder, or to any format that export writes.
//!
//! A folder is built from the decoded arrays as from any input, triangles as they are
//! (`--orient keep`); other formats are exported from such a folder, which is scratch.

use super::progress;
use super::work::WorkArgs;
use super::{Outcome, print};
use crate::build::{Builder, parent};
use crate::codec::decode::decode;
use crate::codec::file::Packed;
use crate::disk::{TempFolder, Workspace};
use crate::error::{Error, Result};
use crate::export::{ExportRequest, Format, export};
use crate::folder::{Folder, MANIFEST, Orient};
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `decode`.
#[derive(Debug, Args)]
pub struct DecodeArgs {
    /// Compressed file
    file: PathBuf,
    /// Mesh folder to make, or file to write when the name ends in ply, stl, obj, off or npy
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Replace what exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// Runs `decode`.
///
/// # Errors
/// Those of [`decode`], of building, and of [`export`].
pub(super) fn run(args: &DecodeArgs) -> Result<Outcome> {
    if !args.force && args.output.symlink_metadata().is_ok() {
        return Err(Error::Usage(format!(
            "{}: exists; give --force to replace it, or another name",
            args.output.display()
        )));
    }
    let ws = args.work.workspace(parent(&args.output))?;
    let packed = Packed::open(&ws.budget, &ws.io, &args.file)?;
    refuse(args, packed.head.coords > 0)?;
    let dir = ws.scratch.first_dir().to_owned();
    let temp = TempFolder::new(&dir, "decode")?;
    let (v, g) = (temp.path().join("V.npy"), temp.path().join("G.npy"));
    let count = {
        let count = decode(&ws, &packed, &v, &g)?;
        let points = packed.head.coords > 0;
        drop(packed);
        match Format::of(&args.output) {
            None => build(
                args,
                true,
                &v,
                points.then_some(&*g),
                count.vertices,
                &args.output,
            )?,
            Some(format) => {
                let folder = temp.path().join("mesh.ct");
                build(
                    args,
                    false,
                    &v,
                    points.then_some(&*g),
                    count.vertices,
                    &folder,
                )?;
                write(args, &ws, &folder, format)?;
            }
        }
        count
    };
    if !args.work.quiet {
        print(&format!(
            "{} triangles and {} vertices: {}\n",
            count.triangles,
            count.vertices,
            args.output.display()
        ))?;
    }
    Ok(Outcome::Done)
}

/// What cannot end well is refused before anything is decoded.
fn refuse(args: &DecodeArgs, points: bool) -> Result<()> {
    let (output, format) = (&args.output, Format::of(&args.output));
    let why = match format {
        Some(format) if format != Format::Npy && !points => {
            "the file has no coordinates, so only a folder or npy can be written"
        }
        Some(_) if output.is_dir() => "is a folder, and a file is to be written; give another name",
        None if output.symlink_metadata().is_ok() && !output.join(MANIFEST).is_file() => {
            "is no mesh folder, so --force does not replace it; give another name"
        }
        _ => return Ok(()),
    };
    Err(Error::Usage(format!("{}: {why}", output.display())))
}

/// Builds a folder from the arrays.
fn build(
    args: &DecodeArgs,
    measures: bool,
    v: &Path,
    g: Option<&Path>,
    vertices: u64,
    folder: &Path,
) -> Result<()> {
    let work = &args.work;
    let mut builder = Builder::new(v)
        .memory(work.memory_bytes())
        .threads(work.thread_count())
        .max_disk(work.max_disk_bytes())
        .orient(Orient::Keep)
        .measures(measures)
        .force(args.force)
        .checkpoint(None)
        .progress(progress::sink(work.progress, work.quiet));
    for dir in &work.tmp {
        builder = builder.tmp(dir);
    }
    builder = match g {
        Some(g) => builder.positions(g),
        None => builder.vertices(vertices),
    };
    builder.build(folder).map(|_| ())
}

/// Exports the folder.
fn write(args: &DecodeArgs, ws: &Workspace, folder: &Path, format: Format) -> Result<()> {
    let mut request = ExportRequest::new(format, &args.output);
    request.force = args.force;
    let folder = Folder::open(folder, &ws.io)?;
    export(ws, &folder, &request).map(|_| ())
}
