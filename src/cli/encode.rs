//! `cornermill encode`: a mesh folder to a compressed file.

use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::parent;
use crate::codec::Level;
use crate::codec::encode::{EncodeRequest, encode};
use crate::codec::grid::Precision;
use crate::error::Result;
use crate::folder::Folder;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `encode`.
#[derive(Debug, Args)]
pub struct EncodeArgs {
    /// Mesh folder
    folder: PathBuf,
    /// File to write
    #[arg(short, long, value_name = "MESH.cmz")]
    output: PathBuf,
    #[command(flatten)]
    precision: PrecisionArgs,
    /// What is spent on smallness
    #[arg(long, value_enum, default_value = "fast")]
    level: LevelArg,
    /// Keep the order of triangles, vertices and corners, for a decoded mesh that has the same V
    /// and G row by row: how much larger the file gets is said at the end
    #[arg(long)]
    keep_order: bool,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    work: WorkArgs,
}

/// How exact coordinates are kept: there is no default, since all but one lose something.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct PrecisionArgs {
    /// Round coordinates to a grid of 2^B - 1 steps along the largest extent
    #[arg(long, value_name = "B", value_parser = clap::value_parser!(u32).range(8..=24))]
    bits: Option<u32>,
    /// Round coordinates to a grid with this step, in the units of the mesh
    #[arg(long, value_name = "X")]
    step: Option<f64>,
    /// Keep all bits of f4 coordinates
    #[arg(long)]
    exact: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum LevelArg {
    /// One context a bit
    Fast,
    /// Several contexts a bit, mixed: some percent smaller, and about half as fast
    Strong,
}

/// Runs `encode`.
///
/// # Errors
/// Those of [`encode`].
pub(super) fn run(args: &EncodeArgs) -> Result<Outcome> {
    let precision = match (args.precision.bits, args.precision.step) {
        (Some(bits), _) => Precision::Bits(bits),
        (_, Some(step)) => Precision::Step(step),
        _ => Precision::Exact,
    };
    let mut request = EncodeRequest::new(&args.output, precision);
    request.level = match args.level {
        LevelArg::Fast => Level::Fast,
        LevelArg::Strong => Level::Strong,
    };
    request.force = args.force;
    request.keep_order = args.keep_order;
    let ws = args.work.workspace(parent(&args.output))?;
    let folder = Folder::open(&args.folder, &ws.io)?;
    let count = encode(&ws, &folder, &request)?;
    if !args.work.quiet {
        let per = |bytes: u64| 8.0 * bytes as f64 / count.triangles.max(1) as f64;
        let bits = per(count.bytes);
        let mut parts = String::new();
        if count.components > 0 {
            parts += &format!(", components {} bytes", count.components);
        }
        if args.keep_order {
            let (bytes, bits) = (count.order, per(count.order));
            parts += &format!(", order {bytes} bytes ({bits:.3} bits a triangle)");
        }
        tell(&format!(
            "{} triangles and {} vertices in {} bytes, {bits:.3} bits a triangle: connectivity \
             {} bytes, positions {} bytes{parts}; {} chunks with {} shared vertices: {}\n",
            count.triangles,
            count.vertices,
            count.bytes,
            count.connectivity,
            count.positions,
            count.chunks,
            count.references,
            args.output.display()
        ))?;
    }
    Ok(Outcome::Done)
}
