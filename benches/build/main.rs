//! The whole of `cornermill build` as a process, row by row, beside the floor of the machine: the
//! time to read the same input bytes and write the same output bytes to the same disk.
//!
//! ```text
//! cargo bench --bench build                          every row that fits a short run, saved
//! cargo bench --bench build -- --only s32,rv32       some rows
//! cargo bench --bench build -- --large               the rows of 256M and 1000M triangles too
//! cargo bench --bench build -- --only s32 --triangles 2M   another size, not saved
//! cargo bench --bench build -- --only kept-sphere-shuffle-g   resident memory in 1 GiB
//! cargo bench --bench build -- --list                the rows and their bars
//! cargo bench --bench build -- --quick               every mesh once, of 1M, not saved: for CI
//! ```
//!
//! Why the comparison holds: floor and build take turns, so that whatever else the machine does
//! meets both, and the ratio is the median over the pairs. Every build reads files that are in
//! the page cache and ends on a disk without pending writes; both leave the final sync out of
//! their seconds and state it apart. Every build must find what data-gen's closed forms say, and
//! write the same manifest each time, for every budget. No time is asserted: a bar is met or
//! missed on the page, and only a wrong answer or a crash fails the run.
//!
//! Results go to `benches/results/DATE-MACHINE/build.{md,json}` (`memory.{md,json}` of the rows named
//! `kept-` alone) after every row, so a run that is
//! cut short keeps the rows that it has; a later run at the same commit adds to them. Another commit
//! of the same day has a folder of its own, `DATE-MACHINE-2` and so on: none overwrites another's.
//!
//! Memory: 1 MiB a thread for the floor, two buffers of at most 256 MiB a thread for the figure of
//! memory copies. Disk: input, output and scratch, about 60 to 200 bytes a triangle.

mod cases;
mod floor;
mod input;
mod machine;
mod process;
mod report;
mod row;
mod scipy;

use cases::{Case, Memory};
use clap::Parser;
use cornermill::folder::{MANIFEST, Manifest};
use input::Input;
use machine::Figures;
use process::{Build, Built, Ended};
use report::Report;
use row::{Round, Row};
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

/// Times `cornermill build` row by row, and the floor beside it.
#[derive(Debug, Parser)]
struct Args {
    /// Rows to run, by name
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// The rows that take minutes and tens of GB, too
    #[arg(long)]
    large: bool,
    /// Name the rows, and run none
    #[arg(long)]
    list: bool,
    /// Every mesh once with 1M triangles, one round, nothing saved
    #[arg(long, conflicts_with_all = ["only", "large", "rounds"])]
    quick: bool,
    /// Another number of triangles for all rows, without bars and not saved: 500k, 2M
    #[arg(long)]
    triangles: Option<String>,
    /// Pairs of floor and build
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    rounds: u16,
    /// What `build` is given, and the second floor
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..))]
    threads: u16,
    /// A folder on the disk to work on
    #[arg(long, default_value = env!("CARGO_TARGET_TMPDIR"))]
    dir: PathBuf,
    /// The folder of results, of this commit or new; also saves rows of another size
    #[arg(long, conflicts_with_all = ["quick", "no_save"])]
    out: Option<PathBuf>,
    /// Only rows that the results of this commit do not have: goes on after an interruption
    #[arg(long)]
    missing: bool,
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
    args.no_save |= args.quick || (args.triangles.is_some() && args.out.is_none());
    let cases = chosen(&args)?;
    if args.list {
        for case in &cases {
            println!("{:14} {} {:?}", case.name, case.shape, case.bars);
        }
        return Ok(());
    }
    let dir = tempfile::Builder::new()
        .prefix("bench-build-")
        .tempdir_in(&args.dir)
        .map_err(at(&args.dir))?;
    let probe = if args.no_save { 32 << 20 } else { 256 << 20 };
    eprintln!("figures of the machine");
    let figures = Figures::measure(dir.path(), usize::from(args.threads), probe)?;
    let judged = !args.quick && args.triangles.is_none();
    // Rows that hold memory alone are no news of speed: they leave the page of the others as it is.
    let kept = cases.iter().all(|case| case.name.starts_with("kept-"));
    let stem = if kept { "memory" } else { "build" };
    let mut report = Report::new(figures, judged, stem)?;
    if !args.no_save {
        report.resume(args.out.as_deref())?;
    }
    let python = scipy::python();
    if python.is_none() {
        eprintln!("no python3 with NumPy and SciPy: those comparisons are left out");
    }
    let mut turns = Turns {
        args: &args,
        python,
        dir: dir.path(),
        input: None,
    };
    let mut failed = Vec::new();
    for case in &cases {
        if args.missing && report.has(case) {
            continue;
        }
        match turns.row(case) {
            Ok(row) => {
                report.add(row);
                if !args.no_save {
                    report.save()?;
                }
            }
            Err(e) => {
                eprintln!("{}: {e}", case.name);
                failed.push(case.name.as_str());
            }
        }
    }
    print!("{}", report.markdown());
    if failed.is_empty() {
        return Ok(());
    }
    Err(format!("failed: {}", failed.join(", ")).into())
}

/// The rows that are asked for.
fn chosen(args: &Args) -> Result<Vec<Case>> {
    if args.quick {
        return Ok(cases::quick(args.triangles.as_deref().unwrap_or("1M")));
    }
    let all = cases::all();
    if let Some(name) = args.only.iter().find(|n| all.iter().all(|c| c.name != **n)) {
        return Err(format!("no row {name}: --list names them").into());
    }
    let wanted = |case: &Case| match args.only.is_empty() {
        true => args.large || args.list || !case.large,
        false => args.only.contains(&case.name),
    };
    let mut cases: Vec<Case> = all.into_iter().filter(wanted).collect();
    for (case, triangles) in cases.iter_mut().zip(args.triangles.iter().cycle()) {
        case.shape.triangles.clone_from(triangles);
        case.large = false;
    }
    Ok(cases)
}

/// What the rows of a run share: the folder to work in, and the mesh that lies there.
struct Turns<'a> {
    args: &'a Args,
    python: Option<PathBuf>,
    dir: &'a Path,
    input: Option<Input>,
}

impl Turns<'_> {
    /// Runs one row: floor and build by turns.
    fn row(&mut self, case: &Case) -> Result<Row> {
        let mut input = self.mesh(case)?;
        let row = self.rounds(case, &mut input);
        self.input = Some(input);
        row
    }

    /// The mesh of a row: the one that lies there, or a new one in its place.
    fn mesh(&mut self, case: &Case) -> Result<Input> {
        match self.input.take() {
            Some(input) if input.shape == case.shape => Ok(input),
            old => {
                drop(old);
                eprintln!("{}: data-gen {}", case.name, case.shape);
                Input::make(&self.dir.join("mesh"), &case.shape)
            }
        }
    }

    fn rounds(&self, case: &Case, input: &mut Input) -> Result<Row> {
        let memory = match case.memory {
            Memory::Stated(memory) => memory.to_owned(),
            Memory::Quarter => format!("{}KiB", input.bytes / 4 / 1024),
        };
        let mut row = Row {
            name: case.name.clone(),
            mesh: case.words(),
            triangles: input.truth.triangles,
            memory,
            threads: usize::from(self.args.threads),
            bare: case.bare,
            input: input.bytes,
            output: 0,
            refused: None,
            rounds: Vec::new(),
        };
        let out = self.dir.join("out.ct");
        // The first build tells the sizes for the floor, and loads the binary: it is timed only
        // where it is the only one.
        eprintln!("{}: a first build", case.name);
        let mut first = match self.build(&row, input, &out)? {
            Ended::Built(built) => Some(built),
            Ended::Refused(said) => {
                row.refused = Some(said);
                return Ok(row);
            }
        };
        let counts = Manifest::read(&out)?.counts;
        input.check(&counts)?;
        let files = sizes(&out)?;
        row.output = files.iter().map(|file| file.1).sum();
        let once = case.large || self.args.quick;
        let rounds = if once { 1 } else { self.args.rounds };
        for round in 1..=rounds {
            eprintln!("{}: round {round} of {rounds}", case.name);
            if out.exists() {
                fs::remove_dir_all(&out).map_err(at(&out))?;
            }
            let place = self.dir.join("floor");
            let floor_one_thread = floor::run(&input.files(), &files, &place, 1)?;
            let floor_all_threads = floor::run(&input.files(), &files, &place, row.threads)?;
            let build = match first.take().filter(|_| once) {
                Some(built) => built,
                None => self.again(&row, input, &out)?,
            };
            let python = self.python.as_ref().filter(|_| case.scipy);
            let in_memory = python.map(|python| scipy::run(python, input, &counts, self.dir));
            row.rounds.push(Round {
                floor_one_thread,
                floor_all_threads,
                build,
                in_memory: in_memory.transpose()?,
            });
        }
        if out.exists() {
            fs::remove_dir_all(&out).map_err(at(&out))?;
        }
        Ok(row)
    }

    /// A build of which the first one is known to succeed.
    fn again(&self, row: &Row, input: &mut Input, out: &Path) -> Result<Built> {
        match self.build(row, input, out)? {
            Ended::Built(built) => Ok(built),
            Ended::Refused(said) => Err(format!("built once, then refused: {said}").into()),
        }
    }

    /// Builds, and holds the manifest to that of every other build of the mesh.
    fn build(&self, row: &Row, input: &mut Input, out: &Path) -> Result<Ended> {
        let build = Build {
            binary: Path::new(env!("CARGO_BIN_EXE_cornermill")),
            input,
            out,
            memory: &row.memory,
            threads: row.threads,
            bare: row.bare,
            scratch: self.dir,
        };
        let ended = build.run()?;
        if matches!(ended, Ended::Built(_)) {
            let manifest = fs::read(out.join(MANIFEST)).map_err(at(out))?;
            let before = &mut input.manifests[usize::from(row.bare)];
            if before.as_ref().is_some_and(|m| *m != manifest) {
                return Err("two builds of one mesh wrote different manifests".into());
            }
            *before = Some(manifest);
        }
        Ok(ended)
    }
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
