//! `cornermill decode`: a compressed file to a mesh folder, or to any format that export writes.
//!
//! A folder is built from the decoded arrays as from any input, triangles as they are
//! (`--orient keep`); other formats are exported from those arrays.

use super::progress;
use super::work::WorkArgs;
use super::{Outcome, tell};
use crate::build::{Builder, parent};
use crate::codec::decode::decode;
use crate::codec::file::{Entry, Head};
use crate::codec::packed::Packed;
use crate::codec::part::{Part, decode_part};
use crate::disk::TempFolder;
use crate::error::{Error, Result};
use crate::export::{Bbox, ExportRequest, Format, Numbers, export_arrays, files};
use crate::folder::npy::DATA_START;
use crate::folder::{Orient, Outputs, fits_u4};
use clap::Args;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Arguments of `decode`.
#[derive(Debug, Args)]
pub struct DecodeArgs {
    /// Compressed file
    file: PathBuf,
    /// Mesh folder to make, or file to write when the name ends in ply, stl, obj, off or npy
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Only these chunks, whole: numbers and ranges, such as 0,4,7-9
    #[arg(long, value_name = "LIST")]
    chunk: Option<Numbers>,
    /// Only the chunks, whole, whose bounding box has a point in common with this box: its
    /// smallest, then its largest coordinates
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    bbox: Option<Bbox>,
    /// Only these components, by their numbers in the folder that was encoded, without vertices
    /// that they do not name
    #[arg(long, value_name = "LIST")]
    component: Option<Numbers>,
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
    let ws = args.work.workspace(parent(&args.output))?;
    let packed = Packed::open(&ws.budget, &ws.io, &args.file)?;
    refuse(args, packed.head.coords > 0)?;
    // Said before anything is written.
    let chunks = chosen(args, &packed)?;
    foretold(args, &packed, chunks.as_deref())?;
    // Scratch files of the build lie in these too, so that they go with them whatever happens.
    let temps = ws.scratch.dirs().iter();
    let temps = temps.map(|dir| TempFolder::new(dir, "decode"));
    let temps = temps.collect::<Result<Vec<_>>>()?;
    let temp = &temps[0];
    let (v, g) = (temp.path().join("V.npy"), temp.path().join("G.npy"));
    let count = {
        let count = match &chunks {
            None => decode(&ws, &packed, &v, &g)?,
            Some(chunks) => {
                let component = args.component.as_ref();
                let component = component.map(|n| move |range: Range<u64>| n.meets(&range));
                let part = Part {
                    chunks: chunks.clone(),
                    component: component.as_ref().map(|c| c as _),
                };
                let count = decode_part(&ws, &packed, &part, &v, &g)?;
                if count.triangles + count.vertices == 0 {
                    return Err(nothing(args));
                }
                count
            }
        };
        let points = packed.head.coords > 0;
        let shape = [count.triangles, count.vertices];
        let arrays = held(args, &packed.head, shape, false)?;
        drop(packed);
        match Format::of(&args.output) {
            None => build(
                args,
                (arrays, &temps),
                &v,
                points.then_some(&*g),
                count.vertices,
                &args.output,
            )?,
            Some(format) => {
                let mut request = ExportRequest::new(format, &args.output);
                request.force = args.force;
                export_arrays(&ws, &v, points.then_some(&*g), count.vertices, &request)?;
            }
        }
        count
    };
    if !args.work.quiet {
        tell(&format!(
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
    let mut outputs = Outputs::new(&[&args.file], args.force);
    let Some(format) = Format::of(&args.output) else {
        return outputs.folder(&args.output);
    };
    for file in files(&args.output, points) {
        outputs.file(&file)?;
    }
    if format == Format::Npy || points {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}: the file has no coordinates, so only a folder or npy can be written",
        args.output.display()
    )))
}

/// Bytes in scratch beside what a build takes there: the decoded arrays of so many triangles and
/// vertices.
///
/// # Errors
/// [`Error::DiskLimit`] when they alone pass the limit.
fn held(args: &DecodeArgs, head: &Head, [t, n]: [u64; 2], sorted: bool) -> Result<u64> {
    let id = if fits_u4(t, n) { 4 } else { 8 };
    let rows = |count: u64, bytes: u64| count.saturating_mul(bytes).saturating_add(DATA_START);
    let v = rows(t, 3 * id);
    let g = rows(n, 3 * u64::from(head.coords));
    let decoded = v.saturating_add(g);
    // Sorted into the order of the folder, each row lies in scratch once more.
    let need = decoded.saturating_mul(1 + u64::from(sorted));
    let limit = args.work.max_disk_bytes();
    if need > limit {
        return Err(Error::DiskLimit { need, limit });
    }
    Ok(decoded)
}

/// The same, of the chunks that are asked for; before they are decoded.
fn foretold(args: &DecodeArgs, packed: &Packed, chunks: Option<&[usize]>) -> Result<()> {
    let head = &packed.head;
    let shape = match chunks {
        None => [head.triangles, head.vertices],
        // How much of a chunk is of a component is known when it was decoded.
        Some(_) if args.component.is_some() => [0, 0],
        Some(chunks) => {
            let entries = || chunks.iter().map(|&chunk| &packed.entries[chunk]);
            let vertices = entries().map(|e| e.vertices).sum();
            [entries().map(Entry::all_triangles).sum(), vertices]
        }
    };
    let sorted = head.ordered == 1 && chunks.is_none();
    held(args, head, shape, sorted).map(|_| ())
}

/// The chunks that are asked for; `None` for all.
fn chosen(args: &DecodeArgs, packed: &Packed) -> Result<Option<Vec<usize>>> {
    let count = packed.entries.len() as u64;
    if let Some(numbers) = args.chunk.as_ref().filter(|n| n.greatest() >= count) {
        let (path, greatest) = (args.file.display(), numbers.greatest());
        return Err(Error::Usage(format!(
            "{path}: there is no chunk {greatest}; the file has {count}, from 0 on: \
             `cornermill info` says how many"
        )));
    }
    let count = packed.components();
    if let Some(numbers) = args.component.as_ref().filter(|n| n.greatest() >= count) {
        let (path, greatest) = (args.file.display(), numbers.greatest());
        return Err(Error::Usage(format!(
            "{path}: there is no component {greatest}; the file has {count}, from 0 on, numbered as \
             in the folder that was encoded"
        )));
    }
    if args.chunk.is_none() && args.bbox.is_none() && args.component.is_none() {
        return Ok(None);
    }
    // Apart only when surely so: a coordinate that is no number is apart from nothing.
    let meets = |bbox: &Bbox, [low, high]: [[f64; 3]; 2]| {
        (0..3).all(|k| !(high[k] < bbox.min[k] || bbox.max[k] < low[k]))
    };
    let wanted = |chunk: &usize| {
        let listed = args.chunk.as_ref().is_none_or(|n| n.has(*chunk as u64));
        let bounds = packed.bounds(*chunk);
        listed
            && args
                .bbox
                .is_none_or(|b| bounds.is_some_and(|of| meets(&b, of)))
            && args
                .component
                .as_ref()
                .is_none_or(|n| n.meets(&packed.entries[*chunk].components()))
    };
    let chosen: Vec<usize> = (0..packed.entries.len()).filter(wanted).collect();
    if chosen.is_empty() {
        return Err(nothing(args));
    }
    Ok(Some(chosen))
}

/// A part that is empty.
fn nothing(args: &DecodeArgs) -> Error {
    Error::Usage(format!(
        "{}: nothing meets all that is asked for with --chunk, --bbox and --component, so there \
         is nothing to decode; widen it",
        args.file.display()
    ))
}

/// Builds a folder from the arrays.
fn build(
    args: &DecodeArgs,
    (arrays, temps): (u64, &[TempFolder]),
    v: &Path,
    g: Option<&Path>,
    vertices: u64,
    folder: &Path,
) -> Result<()> {
    let work = &args.work;
    let mut builder = Builder::new(v)
        .memory(work.memory_bytes())
        .threads(work.thread_count())
        .max_disk(work.max_disk_bytes().saturating_sub(arrays))
        .orient(Orient::Keep)
        .force(args.force)
        .checkpoint(None)
        .progress(progress::sink(work.progress, work.quiet));
    if !work.tmp.is_empty() {
        builder = temps.iter().fold(builder, |b, temp| b.tmp(temp.path()));
    }
    builder = match g {
        Some(g) => builder.positions(g),
        None => builder.vertices(vertices),
    };
    builder.build(folder).map(|_| ())
}
