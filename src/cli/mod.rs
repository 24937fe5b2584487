//! The command line: one file a subcommand. Terminal, progress and exit codes live only here.
//!
//! Reports go to stdout, everything else to stderr. Exit codes: 0 done, 1 a check failed,
//! 2 usage, 3 bad input, 4 I/O or disk full, 5 budget too small, 70 internal error, 130 and 143
//! stopped by SIGINT and SIGTERM, 141 when whoever read the standard output went away.

mod build;
mod check;
mod decode;
mod encode;
mod export;
mod filter;
mod info;
mod normals;
mod path;
mod picture;
mod pieces;
mod progress;
mod report;
mod select;
mod signals;
mod size;
mod swirl;
mod verify;
mod work;

use crate::disk::left_behind;
use crate::error::{Error, Result};
use clap::{Parser, Subcommand};
use signal_hook::consts::SIGPIPE;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

/// Turns a triangle mesh larger than memory into a verified corner table on disk.
#[derive(Debug, Parser)]
#[command(name = "cornermill", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Build a mesh folder from a mesh file
    Build(Box<build::BuildArgs>),
    /// Hold a mesh folder to requirements: closed, manifold, oriented and more
    Check(check::CheckArgs),
    /// Say what a mesh folder holds, from its manifest
    Info(info::InfoArgs),
    /// Write a mesh folder as a compressed file
    Encode(encode::EncodeArgs),
    /// Bring a compressed file back: as a mesh folder, or in any format that export writes
    Decode(decode::DecodeArgs),
    /// Write a mesh folder, or chosen components of it, as PLY, STL, OBJ, OFF or .npy
    Export(Box<export::ExportArgs>),
    /// Find the shortest path of triangles between two corners
    Path(path::PathArgs),
    /// List the triangles of a component in swirl order, with the letters of Edgebreaker
    Swirl(swirl::SwirlArgs),
    /// Make a mesh folder of chosen components of another
    Filter(Box<filter::FilterArgs>),
    /// Write the normals of vertices, and of triangles, beside a mesh folder
    Normals(normals::NormalsArgs),
    /// Draw a mesh folder as a PNG
    Picture(picture::PictureArgs),
    /// Write a page on a mesh folder: verdicts, pictures, histograms, culprits
    Report(report::ReportArgs),
    /// Check a mesh folder fully and independently
    Verify(verify::VerifyArgs),
}

/// How a command ended when nothing went wrong with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Done, or the check passed.
    Done,
    /// A check failed; what failed is on stdout.
    CheckFailed,
}

/// Reads the arguments, runs the subcommand, says what went wrong, and returns the exit code.
pub fn run() -> ExitCode {
    crate::disk::report_long_files();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            // Help and version are no errors; clap prints each where it belongs.
            let code = if e.use_stderr() { 2 } else { 0 };
            let _ = e.print();
            return ExitCode::from(code);
        }
    };
    signals::listen();
    let (code, said) = execute(&cli);
    for left in left_behind() {
        let _ = writeln!(std::io::stderr(), "cornermill: warning: {left}");
    }
    if let Some(said) = said {
        say(&said);
    }
    ExitCode::from(code)
}

/// For tests: runs a command given by its arguments, the program's name first, in this process;
/// its exit code, and what it would say on stderr.
#[doc(hidden)]
pub fn run_here(args: &[std::ffi::OsString]) -> (u8, String) {
    match Cli::try_parse_from(args) {
        Ok(cli) => {
            let (code, error) = execute(&cli);
            let said = left_behind()
                .into_iter()
                .chain(error.map(|e| e.to_string()));
            (code, said.collect::<Vec<_>>().join("\n"))
        }
        Err(e) => (2, e.to_string()),
    }
}

/// Runs the subcommand; the exit code, and what went wrong.
fn execute(cli: &Cli) -> (u8, Option<Error>) {
    let command = || match &cli.command {
        Command::Build(args) => build::run(args),
        Command::Check(args) => check::run(args),
        Command::Encode(args) => encode::run(args),
        Command::Decode(args) => decode::run(args),
        Command::Export(args) => export::run(args),
        Command::Filter(args) => filter::run(args),
        Command::Info(args) => info::run(args),
        Command::Path(args) => path::run(args),
        Command::Swirl(args) => swirl::run(args),
        Command::Normals(args) => normals::run(args),
        Command::Picture(args) => picture::run(args),
        Command::Report(args) => report::run(args),
        Command::Verify(args) => verify::run(args),
    };
    // A panic is a fault of this program; its message was printed where it happened.
    let fault = |_| Err(Error::Internal("the program panicked, see above".into()));
    let done =
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(command)).unwrap_or_else(fault);
    match done {
        Ok(Outcome::Done) => (0, None),
        Ok(Outcome::CheckFailed) => (1, None),
        // As a signal would have ended the process, without a word.
        Err(e) if no_reader(&e) => (signals::code(SIGPIPE), None),
        Err(e) => (code_of(&e), Some(e)),
    }
}

/// Says what went wrong.
fn say(error: &Error) {
    // Where even stderr cannot be written, the exit code still tells.
    let _ = writeln!(std::io::stderr(), "cornermill: {error}");
    let stopped = matches!(
        error,
        Error::Interrupted { .. } | Error::Io { .. } | Error::DiskLimit { .. }
    );
    if let (true, Some(advice)) = (stopped, signals::advice()) {
        let _ = writeln!(std::io::stderr(), "cornermill: {advice}");
    }
}

/// The exit code of an error: decided here and nowhere else.
fn code_of(error: &Error) -> u8 {
    match error {
        Error::Usage(_) => 2,
        Error::Input(_) => 3,
        Error::Io { .. } | Error::DiskLimit { .. } => 4,
        Error::Budget { .. } => 5,
        Error::Interrupted { signal } => signals::code(*signal),
        Error::Internal(_) => 70,
    }
}

/// True when whoever read what was written went away.
fn no_reader(error: &Error) -> bool {
    matches!(error, Error::Io { source, .. } if source.kind() == ErrorKind::BrokenPipe)
}

/// Writes to stdout what the command is for.
fn print(text: &str) -> Result<()> {
    let written = std::io::stdout().lock().write_all(text.as_bytes());
    written.map_err(|e| Error::io(Path::new("standard output"), "write the report", e))
}

/// Writes to stdout what there is to say of what was made or judged: that stands, whether or not
/// anybody reads of it.
fn tell(text: &str) -> Result<()> {
    print(text).or_else(|e| if no_reader(&e) { Ok(()) } else { Err(e) })
}

/// A value as indented JSON with a line end.
fn to_json(value: &impl serde::Serialize) -> Result<String> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::Internal(format!("a report that is no JSON: {e}")))?;
    text.push('\n');
    Ok(text)
}
