//! `cornermill build`: a mesh file in, a mesh folder out.

use super::progress;
use super::work::WorkArgs;
use super::{Outcome, print, signals, tell, to_json};
use crate::build::{Builder, IndexChoice, Strategy, state_of};
use crate::disk::{Counters, Target, fs};
use crate::error::{Error, Result};
use crate::folder::{Folder, Orient, Outputs};
use crate::input::{CoordKind, Endian, Format, IndexKind};
use crate::report;
use clap::{Args, ValueEnum};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Arguments of `build`.
#[derive(Debug, Args)]
pub struct BuildArgs {
    /// Mesh file: PLY, STL, OBJ, OFF, .npy or raw array; - reads standard input
    input: PathBuf,
    /// Folder to make [default: the input's name with .ct]
    #[arg(short, long, value_name = "OUT.ct")]
    output: Option<PathBuf>,
    /// How triangles are oriented
    #[arg(long, value_enum, default_value_t)]
    orient: OrientArg,
    /// Weld vertices of equal position (always done for STL)
    #[arg(long, overrides_with = "no_weld")]
    weld: bool,
    /// Keep vertices as they are
    #[arg(long, overrides_with = "weld")]
    no_weld: bool,
    /// Type of the stored coordinates [default: as the input has them, f4 for text; raw ones need it or
    /// --vertices]
    #[arg(long, value_enum)]
    coords: Option<CoordsArg>,
    /// Width of the stored indices
    #[arg(long, value_enum, default_value_t)]
    index: IndexArg,
    /// The input's format, instead of looking at its name and first bytes
    #[arg(long, value_enum)]
    format: Option<FormatArg>,
    /// The input is a raw array of such indices
    #[arg(long, value_enum)]
    raw_index: Option<RawArg>,
    /// Byte order of raw arrays [default: little]
    #[arg(long, value_enum)]
    endian: Option<EndianArg>,
    /// Number of vertices of a raw or .npy array of indices
    #[arg(long, value_name = "N")]
    vertices: Option<u64>,
    /// File of coordinates beside a raw or .npy array of indices
    #[arg(long, value_name = "FILE")]
    positions: Option<PathBuf>,
    /// Leave out fans, border loops, genus, non-manifold vertices and duplicate triangles
    #[arg(long)]
    no_measures: bool,
    /// Print the report as JSON, on stdout or to a file
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    json: Option<PathBuf>,
    /// Replace an existing output
    #[arg(long)]
    force: bool,
    /// Go on with a build that was stopped, given the same input and options
    #[arg(long)]
    resume: bool,
    /// Print the memory, scratch space, output and passes to expect, and make nothing
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    work: WorkArgs,
    #[arg(long, hide = true)]
    checkpoint: Option<f64>,
    #[arg(long, hide = true)]
    chunk_triangles: Option<u64>,
    #[arg(long, hide = true)]
    buckets: Option<usize>,
    #[arg(long, hide = true, value_enum, default_value_t)]
    strategy: StrategyArg,
}

/// See [`Strategy`].
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum StrategyArg {
    #[default]
    Auto,
    ByPlace,
    ById,
    Memory,
    Contract,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum OrientArg {
    /// Orientable watertight components outward by signed volume, the rest by majority
    #[default]
    Outward,
    /// Each orientable component as most of its triangles were
    Majority,
    /// Each orientable component as its first triangle was
    First,
    /// As the input has them; nothing is flipped
    Keep,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum CoordsArg {
    /// 4 bytes
    F4,
    /// 8 bytes
    F8,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum IndexArg {
    /// u4 while it suffices, else u8
    #[default]
    Auto,
    /// 4 bytes
    U4,
    /// 8 bytes
    U8,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    /// Stanford PLY
    Ply,
    /// STL, binary or ascii
    Stl,
    /// Wavefront OBJ
    Obj,
    /// Object File Format
    Off,
    /// NumPy arrays
    Npy,
}
#[derive(Clone, Copy, Debug, ValueEnum)]
enum RawArg {
    /// Unsigned, 4 bytes
    U4,
    /// Unsigned, 8 bytes
    U8,
    /// Signed, 4 bytes
    I4,
    /// Signed, 8 bytes
    I8,
}

#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum EndianArg {
    /// Least significant byte first
    #[default]
    Little,
    /// Most significant byte first
    Big,
}

/// Runs `build`.
///
/// # Errors
/// Those of [`Builder::build`].
pub(super) fn run(args: &BuildArgs) -> Result<Outcome> {
    let output = match &args.output {
        Some(output) => output.clone(),
        None if args.input == Path::new("-") => {
            return Err(Error::Usage(
                "standard input has no name; give the output with -o".into(),
            ));
        }
        None => args.input.with_extension("ct"),
    };
    args.work.check_tmp()?;
    let json = Json::of(args, &output)?;
    if args.dry_run {
        return dry_run(args, &output, json);
    }
    signals::can_resume(state_of(&output));
    let done = builder(args).build(&output)?;
    if args.work.quiet && args.json.is_none() {
        return Ok(Outcome::Done);
    }
    let folder = Folder::open(&output, &Arc::new(Counters::default()))?;
    let report = report::gather(&folder, Some(&done))?;
    show(args, json, &report, || report::render(&report), tell)?;
    Ok(Outcome::Done)
}

/// Predicts; what cannot fit is told when the prediction was printed.
fn dry_run(args: &BuildArgs, output: &Path, json: Option<Json>) -> Result<Outcome> {
    let builder = builder(args);
    let prediction = builder.predict(output)?;
    let predicted = report::predicted(&prediction);
    let text = || report::render_predicted(&predicted);
    show(args, json, &predicted, text, print)?;
    prediction.check()?;
    builder.check_room(&prediction, output)?;
    Ok(Outcome::Done)
}

/// Where the report goes as JSON. Found out before the work, since hours of it would be lost on a
/// name that cannot be written.
enum Json {
    /// Standard output, in the place of the text.
    Stdout,
    /// A device or a pipe.
    Through(PathBuf),
    /// A file of its own.
    File(Box<Target>),
}

impl Json {
    /// What `--json` asks for.
    ///
    /// # Errors
    /// As [`Outputs::create`].
    fn of(args: &BuildArgs, output: &Path) -> Result<Option<Json>> {
        let Some(to) = &args.json else {
            return Ok(None);
        };
        if to == Path::new("-") {
            return Ok(Some(Json::Stdout));
        }
        let inputs = [Some(&*args.input), args.positions.as_deref()];
        let inputs: Vec<&Path> = inputs.into_iter().flatten().collect();
        let mut outputs = Outputs::new(&inputs, args.force);
        outputs.spare(to)?;
        if to.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            return Ok(Some(Json::Through(to.clone())));
        }
        outputs.reserve(output)?;
        let file = outputs.create(to)?;
        Ok(Some(Json::File(Box::new(file))))
    }

    fn write(self, text: &str, say: Say) -> Result<()> {
        let failed = |path: &Path, e| Error::io(path, "write the report", e);
        match self {
            Json::Stdout => say(text),
            Json::Through(path) => fs::write(&path, text.as_bytes()).map_err(|e| failed(&path, e)),
            Json::File(mut file) => {
                let done = file.file().write_all(text.as_bytes());
                done.map_err(|e| failed(file.path(), e))?;
                file.keep().map(|_| ())
            }
        }
    }
}

/// How a report is written to stdout: as what the command is for, or beside it.
type Say = fn(&str) -> Result<()>;

/// Gives a report in the forms that were asked for.
fn show(
    args: &BuildArgs,
    json: Option<Json>,
    report: &impl serde::Serialize,
    text: impl FnOnce() -> String,
    say: Say,
) -> Result<()> {
    let on_stdout = matches!(json, Some(Json::Stdout));
    if let Some(json) = json {
        json.write(&to_json(report)?, say)?;
    }
    if args.work.quiet || on_stdout {
        return Ok(());
    }
    say(&text())
}

fn builder(args: &BuildArgs) -> Builder {
    let work = &args.work;
    let mut builder = Builder::new(&args.input)
        .memory(work.memory_bytes())
        .threads(work.thread_count())
        .max_disk(work.max_disk_bytes())
        .orient(match args.orient {
            OrientArg::Outward => Orient::Outward,
            OrientArg::Majority => Orient::Majority,
            OrientArg::First => Orient::First,
            OrientArg::Keep => Orient::Keep,
        })
        .index(match args.index {
            IndexArg::Auto => IndexChoice::Auto,
            IndexArg::U4 => IndexChoice::U4,
            IndexArg::U8 => IndexChoice::U8,
        })
        .measures(!args.no_measures)
        .force(args.force)
        .resume(args.resume)
        .progress(progress::sink(work.progress, work.quiet));
    for dir in &work.tmp {
        builder = builder.tmp(dir);
    }
    if args.weld || args.no_weld {
        builder = builder.weld(args.weld);
    }
    if let Some(coords) = args.coords {
        builder = builder.coords(match coords {
            CoordsArg::F4 => CoordKind::F4,
            CoordsArg::F8 => CoordKind::F8,
        });
    }
    if let Some(format) = args.format {
        builder = builder.format(match format {
            FormatArg::Ply => Format::Ply,
            FormatArg::Stl => Format::Stl,
            FormatArg::Obj => Format::Obj,
            FormatArg::Off => Format::Off,
            FormatArg::Npy => Format::Npy,
        });
    }
    if let Some(raw) = args.raw_index {
        builder = builder.raw_index(match raw {
            RawArg::U4 => IndexKind::U4,
            RawArg::U8 => IndexKind::U8,
            RawArg::I4 => IndexKind::I4,
            RawArg::I8 => IndexKind::I8,
        });
    }
    if let Some(endian) = args.endian {
        builder = builder.endian(match endian {
            EndianArg::Little => Endian::Little,
            EndianArg::Big => Endian::Big,
        });
    }
    if let Some(vertices) = args.vertices {
        builder = builder.vertices(vertices);
    }
    if let Some(positions) = &args.positions {
        builder = builder.positions(positions);
    }
    if let Some(seconds) = args.checkpoint {
        builder = builder.checkpoint(Duration::try_from_secs_f64(seconds).ok());
    }
    if let Some(chunk) = args.chunk_triangles {
        builder = builder.chunk_triangles(chunk);
    }
    builder = builder.strategy(match args.strategy {
        StrategyArg::Auto => Strategy::Auto,
        StrategyArg::ByPlace => Strategy::ByPlace,
        StrategyArg::ById => Strategy::ById,
        StrategyArg::Memory => Strategy::Memory,
        StrategyArg::Contract => Strategy::Contract,
    });
    if let Some(buckets) = args.buckets {
        builder = builder.buckets(buckets);
    }
    builder
}
