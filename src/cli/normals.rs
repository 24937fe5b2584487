//! `cornermill normals`: normals of vertices, and of triangles, beside a folder.

use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::parent;
use crate::error::Result;
use crate::folder::Folder;
use crate::measure::normals::{NormalsRequest, Way, default_target, normals};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `normals`.
#[derive(Debug, Args)]
pub struct NormalsArgs {
    /// Mesh folder
    folder: PathBuf,
    /// File for the normals of the vertices, (N,3) f4 [default: NAME.N.npy beside NAME.ct]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also write the normals of the triangles, (T,3) f4 [default: NAME.NT.npy beside NAME.ct]
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    triangles: Option<Option<PathBuf>>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    /// Which way to go (the normals do not depend on it)
    #[arg(long, value_enum, hide = true)]
    way: Option<WayArg>,
    /// Triangles of a chunk (the normals do not depend on it)
    #[arg(long, value_name = "N", hide = true)]
    chunk_triangles: Option<u64>,
    #[command(flatten)]
    work: WorkArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WayArg {
    /// Chunks of triangles
    Chunks,
}

/// Runs `normals`.
///
/// # Errors
/// Those of [`normals`].
pub(super) fn run(args: &NormalsArgs) -> Result<Outcome> {
    let own = |of_triangles| default_target(&args.folder, of_triangles);
    let target = args.output.clone().unwrap_or_else(|| own(false));
    let ws = args.work.workspace(parent(&target))?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let request = NormalsRequest {
        triangles: args
            .triangles
            .clone()
            .map(|file| file.unwrap_or_else(|| own(true))),
        target,
        force: args.force,
        way: match args.way {
            None => Way::Auto,
            Some(WayArg::Chunks) => Way::Chunks,
        },
        chunk: args.chunk_triangles,
    };
    let count = normals(&ws, &folder, &request)?;
    if !args.work.quiet {
        let files: Vec<String> = count
            .files
            .iter()
            .map(|f| f.display().to_string())
            .collect();
        tell(&format!(
            "{} normals, {} of them zero, {} triangles left out for a vertex that is not finite: \
             {}\n",
            count.vertices,
            count.zero,
            count.nonfinite_triangles,
            files.join(", ")
        ))?;
    }
    Ok(Outcome::Done)
}
