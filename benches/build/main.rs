//! The whole of `cornermill build` as a process, beside the floor of the machine: the time to
//! read the same input bytes and write the same output bytes to the same disk.
//!
//! ```text
//! cargo bench --bench build                       8M and 32M coherent triangles, saved
//! cargo bench --bench build -- 2M 128M --dir /mnt other sizes, another disk
//! cargo bench --bench build -- --quick            1M, one round, not saved: for CI
//! ```
//!
//! Why the comparison holds: floor and build take turns, so that whatever else the machine does
//! meets both, and the ratio is the median over the pairs. Every build reads files that are in
//! the page cache and ends on a disk without pending writes; both leave the final sync out of
//! their seconds and state it apart. Every build must find what data-gen's closed forms say, and
//! write the same manifest each time. No time is asserted.
//!
//! The mesh is data-gen's displaced sphere, V and G as .npy. Results go to
//! `benches/results/DATE-MACHINE/build.{md,json}`; a second run on one day replaces the first.
//!
//! Memory: 1 MiB a thread for the floor, two buffers of at most 256 MiB a thread for the figure of
//! memory copies. Disk: the input and twice the output, about 90 bytes a triangle.

mod floor;
mod machine;
mod process;
mod report;

use clap::Parser;
use cornermill::folder::{Counts, MANIFEST, Manifest};
use data_gen::Truth;
use machine::Figures;
use process::Build;
use report::{Case, Report, Round};
use std::error::Error;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Anything that went wrong, in one line.
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Names the file in an I/O error.
fn at(path: &Path) -> impl Fn(io::Error) -> String + '_ {
    move |e| format!("{}: {e}", path.display())
}

/// Times `cornermill build` on coherent meshes, and the floor beside it.
#[derive(Debug, Parser)]
struct Args {
    /// Numbers of triangles: 500k, 8M, 1G
    #[arg(default_values = ["8M", "32M"])]
    sizes: Vec<String>,
    /// 1M triangles, one round, nothing saved
    #[arg(long, conflicts_with_all = ["sizes", "rounds"])]
    quick: bool,
    /// Pairs of floor and build
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(3..))]
    rounds: u16,
    /// What `build` is given
    #[arg(long, default_value = "512MiB")]
    memory: String,
    /// What `build` is given, and the second floor
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// A folder on the disk to work on
    #[arg(long, default_value = env!("CARGO_TARGET_TMPDIR"))]
    dir: PathBuf,
    /// Only print
    #[arg(long)]
    no_save: bool,
    /// Given by `cargo bench`; without it, as under `cargo test --benches`, this is --quick
    #[arg(long, hide = true)]
    bench: bool,
    /// As --quick, as criterion's benches have it
    #[arg(long, hide = true)]
    test: bool,
}

fn main() -> ExitCode {
    match run(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("bench build: {e}");
            ExitCode::FAILURE
        }
    }
}

fn run(mut args: Args) -> Result<()> {
    args.quick |= args.test || !args.bench;
    if args.quick {
        args.sizes = vec!["1M".into()];
        args.rounds = 1;
    }
    let dir = tempfile::Builder::new()
        .prefix("bench-build-")
        .tempdir_in(&args.dir)
        .map_err(at(&args.dir))?;
    let threads = usize::from(args.threads);
    let probe = if args.quick { 32 << 20 } else { 256 << 20 };
    eprintln!("figures of the machine");
    let figures = Figures::measure(dir.path(), threads, probe)?;
    let mut report = Report::new(figures, &args.memory, threads);
    for size in &args.sizes {
        report.cases.push(case(&args, dir.path(), size)?);
    }
    print!("{}", report.markdown());
    if !(args.quick || args.no_save) {
        report.save()?;
    }
    Ok(())
}

/// Makes one mesh and times floor and build on it by turns.
fn case(args: &Args, dir: &Path, size: &str) -> Result<Case> {
    eprintln!("{size}: data-gen");
    let input = Input::make(dir, size)?;
    let out = dir.join("out.ct");
    let build = Build {
        binary: Path::new(env!("CARGO_BIN_EXE_cornermill")),
        v: &input.v,
        g: &input.g,
        out: &out,
        memory: &args.memory,
        threads: usize::from(args.threads),
        scratch: dir,
    };
    // The first build is not timed: it tells the sizes for the floor, and loads the binary.
    eprintln!("{size}: a first build");
    build.run()?;
    let first = fs::read(out.join(MANIFEST)).map_err(at(&out))?;
    check(&Manifest::read(&out)?.counts, &input.truth)?;
    let files = sizes(&out)?;
    let floor = |threads| {
        let inputs = [input.v.as_path(), &input.g];
        floor::run(&inputs, &files, &dir.join("floor"), threads)
    };
    let mut rounds = Vec::new();
    for round in 1..=args.rounds {
        eprintln!("{size}: round {round} of {}", args.rounds);
        let one = floor(1)?;
        let all = floor(usize::from(args.threads))?;
        fs::remove_dir_all(&out).map_err(at(&out))?;
        let built = build.run()?;
        let again = fs::read(out.join(MANIFEST)).map_err(at(&out))?;
        if again != first {
            return Err("two builds of one mesh wrote different manifests".into());
        }
        rounds.push(Round { one, all, built });
    }
    let mut output = 0;
    for (_, bytes) in &files {
        output += bytes;
    }
    let input_bytes = length(&input.v)? + length(&input.g)?;
    fs::remove_dir_all(&out).map_err(at(&out))?;
    Ok(Case {
        size: size.to_owned(),
        triangles: input.truth.triangles,
        input: input_bytes,
        output,
        rounds,
    })
}

/// A mesh on disk and in the page cache, and what it is known to hold.
struct Input {
    v: PathBuf,
    g: PathBuf,
    truth: Truth,
}

impl Input {
    fn make(dir: &Path, size: &str) -> Result<Input> {
        let v = dir.join("mesh.npy");
        let g = dir.join("mesh.G.npy");
        let args = ["data-gen", "sphere", "--triangles", size, "--output"].map(AsRef::as_ref);
        let args = args.into_iter().chain([v.as_os_str()]);
        let args = data_gen::Args::try_parse_from(args)?;
        data_gen::args::run(&args)?;
        for path in [&v, &g] {
            let mut file = fs::File::open(path).map_err(at(path))?;
            file.sync_all().map_err(at(path))?;
            io::copy(&mut file, &mut io::sink()).map_err(at(path))?;
        }
        let truth = closed_forms(&dir.join("mesh.npy.json"))?;
        Ok(Input { v, g, truth })
    }
}

/// The counts that data-gen wrote beside its mesh.
fn closed_forms(path: &Path) -> Result<Truth> {
    let text = fs::read(path).map_err(at(path))?;
    let facts: serde_json::Value = serde_json::from_slice(&text)?;
    let count = |key: &str| {
        let count = facts[key].as_u64();
        count.ok_or_else(|| format!("{}: no count `{key}`", path.display()))
    };
    Ok(Truth {
        triangles: count("triangles")?,
        vertices: count("vertices")?,
        distinct_edges: count("distinct_edges")?,
        border_edges: count("border_edges")?,
        nonmanifold_edges: count("nonmanifold_edges")?,
        components: count("components")?,
        components_joined: count("components_joined")?,
        closed_components: count("closed_components")?,
        nonorientable_components: count("nonorientable_components")?,
        degenerate: count("degenerate")?,
        unreferenced: count("unreferenced")?,
        inconsistent_edges: count("inconsistent_edges")?,
        flipped: count("flipped")?,
        ..Truth::default()
    })
}

/// Compares what the build found with what the mesh is known to hold.
fn check(found: &Counts, truth: &Truth) -> Result<()> {
    // An outward sphere is left as it is, so flips of the build are flips of data-gen.
    let expected = Counts {
        triangles: truth.triangles,
        vertices: truth.vertices,
        unreferenced_vertices: truth.unreferenced,
        degenerate: truth.degenerate,
        distinct_edges: truth.distinct_edges,
        regular_edges: truth.distinct_edges - truth.border_edges - truth.nonmanifold_edges,
        border_edges: truth.border_edges,
        nonmanifold_edges: truth.nonmanifold_edges,
        inconsistent_edges: truth.inconsistent_edges,
        components: truth.components,
        components_joined: truth.components_joined,
        nonorientable_components: truth.nonorientable_components,
        closed_components: truth.closed_components,
        watertight_components: truth.closed_components,
        flipped_triangles: truth.flipped,
        ..Counts::default()
    };
    if *found == expected {
        return Ok(());
    }
    Err(format!("expected {expected:#?}, found {found:#?}").into())
}

/// Names and lengths of the files of a folder, by name.
fn sizes(folder: &Path) -> Result<Vec<(String, u64)>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(at(folder))? {
        let entry = entry.map_err(at(folder))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        files.push((name, length(&entry.path())?));
    }
    files.sort();
    Ok(files)
}

fn length(path: &Path) -> Result<u64> {
    Ok(fs::metadata(path).map_err(at(path))?.len())
}
