//! The command line: what to make, how large, where to.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use serde_json::json;

use crate::defects::Defects;
use crate::kinds::{Kind, Size};
use crate::mesh::Mesh;
use crate::view::{Options, Order, View};
use crate::write::{Coords, Format, Index, Target, fits_u4, write};
use crate::{Error, Truth};

/// Writes a test mesh, and its exact counts as OUT.json beside it.
#[derive(Clone, Debug, Parser)]
#[command(version)]
pub struct Args {
    /// What to make.
    #[arg(value_enum)]
    pub kind: Kind,
    /// The file to write.
    #[arg(short, long)]
    pub output: PathBuf,
    /// About how many triangles (k, M and G stand for thousands, millions, billions); the nearest
    /// size that the kind has is made.
    #[arg(short, long, value_parser = count, conflicts_with = "size")]
    pub triangles: Option<u64>,
    /// The size in the kind's own terms: N (sphere: triangles / 8 = N^2; fan and the like: triangles)
    /// or AxB (grids: quads in a row x rows).
    #[arg(long, value_parser = Size::parse)]
    pub size: Option<Size>,
    /// How many blobs; without it, one for each 1000 triangles.
    #[arg(long)]
    pub blobs: Option<u64>,
    /// Sphere: turn the diagonal of each quad of two triangles with this probability, for irregular
    /// valences.
    #[arg(long, default_value_t = 0.0)]
    pub diagonals: f64,
    /// The format; without it, what the name ends in.
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Triangles, vertex ids and corners in random order: --order shuffle.
    #[arg(long, conflicts_with = "order")]
    pub shuffle: bool,
    /// The order of triangles and vertices.
    #[arg(long, value_enum, default_value = "coherent")]
    pub order: Order,
    /// Flip each triangle with this probability.
    #[arg(long, default_value_t = 0.0)]
    pub flip: f64,
    /// Put in this many faults of every sort: holes, duplicates, third triangles on an edge,
    /// degenerate triangles, unreferenced vertices.
    #[arg(long, num_args = 0..=1, require_equals = true, default_value_t = 0, default_missing_value = "4")]
    pub defects: u64,
    /// Key of every random choice.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Width of vertex ids in npy and raw; without it, u4 while the ids fit.
    #[arg(long, value_enum)]
    pub index: Option<Index>,
    /// Width of coordinates.
    #[arg(long, value_enum, default_value = "f4")]
    pub coords: Coords,
    /// Write V alone (npy and raw).
    #[arg(long)]
    pub no_positions: bool,
    /// Threads; without it, as many as there are processors.
    #[arg(long)]
    pub threads: Option<usize>,
}

/// `12`, `3k`, `2.5M`, `1G`.
fn count(text: &str) -> Result<u64, String> {
    let (digits, unit) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 1e3),
        Some((at, 'M')) => (&text[..at], 1e6),
        Some((at, 'G')) => (&text[..at], 1e9),
        _ => (text, 1.0),
    };
    let number: f64 = digits
        .parse()
        .map_err(|_| "expected a number such as 500k, 8M, 1.5G")?;
    let value = (number * unit).round();
    if (1.0..=1e15).contains(&value) {
        Ok(value as u64)
    } else {
        Err("expected 1 to 1e15".into())
    }
}

/// Makes the mesh that is asked for.
fn build(args: &Args) -> Result<Box<dyn Mesh>, Error> {
    if !(0.0..=1.0).contains(&args.flip) {
        let text = format!("--flip {}: a probability is expected, 0 to 1", args.flip);
        return Err(Error::Usage(text));
    }
    let triangles = args.triangles.unwrap_or(1_000_000);
    let mesh = args
        .kind
        .mesh(args.size, triangles, args.blobs, args.diagonals, args.seed)?;
    Ok(Box::new(Defects::new(mesh, args.defects, args.seed)?))
}

/// Does what the command line says; returns one line for the user.
pub fn run(args: &Args) -> Result<String, Error> {
    let mesh = build(args)?;
    let order = if args.shuffle {
        Order::Shuffle
    } else {
        args.order
    };
    let options = Options {
        order,
        flip: args.flip,
        seed: args.seed,
    };
    let view = View::new(mesh.as_ref(), options);
    let target = target(args, view.truth())?;
    if target.format == Format::Stl && !mesh.survives_welding() {
        return Err(Error::Usage(
            "positions of this mesh coincide in f4: STL, which has nothing else, cannot hold it"
                .into(),
        ));
    }
    let mut truth = write(&view, &target)?;
    if target.format == Format::Stl {
        truth = truth.welded();
    }
    let mut facts = truth.to_json();
    let welded = mesh.survives_welding().then(|| truth.welded().vertices);
    facts["welded_vertices"] = json!(welded);
    facts["kind"] = json!(name(args.kind));
    facts["order"] = json!(name(order));
    facts["flip"] = json!(args.flip);
    facts["diagonals"] = json!(args.diagonals);
    facts["defects"] = json!(args.defects);
    facts["seed"] = json!(args.seed);
    facts["format"] = json!(name(target.format));
    let path = target.truth_path();
    std::fs::write(&path, format!("{facts:#}\n")).map_err(Error::io(&path))?;
    Ok(format!(
        "{}: {} triangles, {} vertices",
        target.path.display(),
        truth.triangles,
        truth.vertices
    ))
}

/// A choice as the command line spells it.
fn name(choice: impl ValueEnum) -> String {
    choice
        .to_possible_value()
        .map(|v| v.get_name().to_owned())
        .unwrap_or_default()
}

fn target(args: &Args, truth: &Truth) -> Result<Target, Error> {
    let ending = args
        .output
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default();
    let format = match args.format {
        Some(format) => format,
        None => Format::from_str(ending, true).map_err(|_| {
            let name = args.output.display();
            Error::Usage(format!(
                "{name}: what format? Use --format, or end it in .npy .ply .stl .raw"
            ))
        })?,
    };
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let narrowest = if fits_u4(truth) { Index::U4 } else { Index::U8 };
    Ok(Target {
        path: args.output.clone(),
        format,
        index: args.index.unwrap_or(narrowest),
        coords: args.coords,
        positions: !args.no_positions,
        threads: args.threads.unwrap_or(threads).max(1),
    })
}
