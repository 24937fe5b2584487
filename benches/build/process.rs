//! One run of a program as a process: wall time, peak resident memory, and for `cornermill build`
//! what its JSON report says of the passes.
//!
//! The peak is that of the kernel (`ru_maxrss`, file-backed pages included) as GNU time prints it,
//! since the process is a child of that small program and inherits nothing from the bench; where
//! there is no GNU time, the program's own word is taken, and said to be that.

use crate::input::Input;
use crate::{Result, at};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Instant;

/// Where GNU time is.
const TIME: &str = "/usr/bin/time";
/// Passes that only bring finished files to the disk and to their place.
const APART: [&str; 2] = ["sync", "rename"];
/// The exit code of a budget that is too small.
const REFUSED: i32 = 5;

/// What to run.
pub struct Build<'a> {
    /// The program.
    pub binary: &'a Path,
    /// The mesh.
    pub input: &'a Input,
    /// The folder to make.
    pub out: &'a Path,
    /// `--memory`.
    pub memory: &'a str,
    /// `--threads`.
    pub threads: usize,
    /// `--no-measures`.
    pub bare: bool,
    /// Where the report and GNU time's figures go.
    pub scratch: &'a Path,
}

/// One pass, as the report has it.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Pass {
    /// Its name.
    pub name: String,
    /// Wall time.
    pub seconds: f64,
    /// Bytes read.
    pub read: u64,
    /// Bytes written.
    pub written: u64,
}

/// Peak resident memory in bytes, and whose word it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Peak {
    /// Nobody's.
    Unknown,
    /// The program's own.
    Own(u64),
    /// The kernel's.
    Kernel(u64),
}

/// What one run took.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct Built {
    /// Wall time of the process without `sync`.
    pub seconds: f64,
    /// Seconds of the passes that are told apart; none when the report does not name them.
    pub sync: Option<f64>,
    /// Peak resident memory.
    pub peak: Peak,
    /// The most scratch space at once, in bytes.
    pub scratch: u64,
    /// The passes, in order; none when there is no report.
    pub passes: Vec<Pass>,
}

/// How a run ended, other than by a fault.
pub enum Ended {
    /// With a folder.
    Built(Built),
    /// Without one: the budget is too small, in the program's words.
    Refused(String),
}

impl Build<'_> {
    /// Runs it once.
    pub fn run(&self) -> Result<Ended> {
        let json = self.scratch.join("report.json");
        if json.exists() {
            fs::remove_file(&json).map_err(at(&json))?;
        }
        let ran = Ran::new(self.scratch, self.binary, |command| {
            command.arg("build").arg(&self.input.v);
            if let Some(g) = &self.input.g {
                command.arg("--positions").arg(g);
            }
            command
                .arg("-o")
                .arg(self.out)
                .args(["--memory", self.memory, "--progress", "none", "--threads"])
                .arg(self.threads.to_string())
                .arg(format!("--json={}", json.display()));
            if self.bare {
                command.arg("--no-measures");
            }
        })?;
        if ran.output.status.code() == Some(REFUSED) {
            let said = String::from_utf8_lossy(&ran.output.stderr);
            return Ok(Ended::Refused(said.trim().to_owned()));
        }
        ran.succeeded("build")?;
        let report = read_report(&json);
        let passes: Vec<Pass> =
            serde_json::from_value(report["passes"].clone()).unwrap_or_default();
        let apart = passes.iter().filter(|p| APART.contains(&p.name.as_str()));
        let sync = (!passes.is_empty()).then(|| apart.map(|p| p.seconds).sum());
        let own = report["peak_resident"].as_u64();
        Ok(Ended::Built(Built {
            seconds: ran.seconds - sync.unwrap_or(0.0),
            sync,
            peak: ran.peak.or_own(own),
            scratch: report["peak_scratch"].as_u64().unwrap_or(0),
            passes,
        }))
    }
}

impl Peak {
    /// This, or the program's own word where the kernel's is not known.
    fn or_own(self, own: Option<u64>) -> Peak {
        match (self, own) {
            (Peak::Unknown, Some(bytes)) => Peak::Own(bytes),
            (known, _) => known,
        }
    }

    /// In bytes.
    pub fn bytes(self) -> Option<u64> {
        match self {
            Peak::Kernel(bytes) | Peak::Own(bytes) => Some(bytes),
            Peak::Unknown => None,
        }
    }
}

/// A process that ran to its end.
pub struct Ran {
    /// Wall time.
    pub seconds: f64,
    /// Peak resident memory.
    pub peak: Peak,
    /// Its exit code and what it said.
    pub output: Output,
}

impl Ran {
    /// Runs `program` with what `arguments` adds; GNU time's figures go to `scratch`.
    pub fn new(
        scratch: &Path,
        program: &Path,
        arguments: impl FnOnce(&mut Command),
    ) -> Result<Ran> {
        let time = scratch.join("time.txt");
        let timed = has_gnu_time(&time);
        if time.exists() {
            fs::remove_file(&time).map_err(at(&time))?;
        }
        let mut command = if timed {
            let mut command = Command::new(TIME);
            command.arg("-v").arg("-o").arg(&time).arg(program);
            command
        } else {
            Command::new(program)
        };
        arguments(&mut command);
        command.env("LC_ALL", "C").stdin(Stdio::null());
        let start = Instant::now();
        let output = command.output().map_err(at(program))?;
        let seconds = start.elapsed().as_secs_f64();
        let peak = max_resident(&time).filter(|_| timed);
        Ok(Ran {
            seconds,
            peak: peak.map_or(Peak::Unknown, Peak::Kernel),
            output,
        })
    }

    /// Refuses any exit code but 0.
    pub fn succeeded(&self, what: &str) -> Result<()> {
        let status = self.output.status;
        if status.success() {
            return Ok(());
        }
        let said = String::from_utf8_lossy(&self.output.stderr);
        Err(format!("{what} ended with {status}: {}", said.trim()).into())
    }
}

/// Whether GNU time is there: some systems have another program of that name, or none.
fn has_gnu_time(to: &Path) -> bool {
    let mut command = Command::new(TIME);
    command.arg("-v").arg("-o").arg(to).arg("true");
    let quiet = command.stdout(Stdio::null()).stderr(Stdio::null());
    quiet.env("LC_ALL", "C").status().is_ok_and(|s| s.success()) && max_resident(to).is_some()
}

/// Bytes from GNU time's line on the maximum resident set size.
fn max_resident(path: &Path) -> Option<u64> {
    let text = fs::read_to_string(path).ok()?;
    let line = text
        .lines()
        .find(|l| l.contains("Maximum resident set size (kbytes)"))?;
    let kib: u64 = line.rsplit(':').next()?.trim().parse().ok()?;
    Some(kib << 10)
}

/// The part of the report on the build, or null.
fn read_report(path: &Path) -> Value {
    let text = fs::read(path).unwrap_or_default();
    let mut report: Value = serde_json::from_slice(&text).unwrap_or_default();
    match report.get_mut("build") {
        Some(build) => build.take(),
        None => report,
    }
}
