//! One run of `cornermill build` as a process: wall time, what its JSON report says of the passes,
//! and peak resident memory.
//!
//! The peak is that of the kernel (`ru_maxrss`, file-backed pages included) as GNU time prints it,
//! since the process is a child of that small program and inherits nothing from the bench; where
//! there is no GNU time, the program's own word is taken, and said to be that.

use crate::{Result, at};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// Where GNU time is.
const TIME: &str = "/usr/bin/time";
/// Passes that only bring finished files to the disk and to their place.
const APART: [&str; 2] = ["sync", "rename"];

/// What to run.
pub struct Build<'a> {
    /// The program.
    pub binary: &'a Path,
    /// V.
    pub v: &'a Path,
    /// G.
    pub g: &'a Path,
    /// The folder to make.
    pub out: &'a Path,
    /// `--memory`.
    pub memory: &'a str,
    /// `--threads`.
    pub threads: usize,
    /// Where the report and GNU time's figures go.
    pub scratch: &'a Path,
}

/// One pass, as the report has it.
#[derive(Clone, Debug)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Peak {
    /// The kernel's.
    Kernel(u64),
    /// The program's own.
    Own(u64),
    /// Nobody's.
    Unknown,
}

/// What one run took.
#[derive(Clone, Debug)]
pub struct Built {
    /// Wall time of the process without `sync`.
    pub seconds: f64,
    /// Seconds of the passes that are told apart; none when the report does not name them.
    pub sync: Option<f64>,
    /// Peak resident memory.
    pub peak: Peak,
    /// The passes, in order; none when there is no report.
    pub passes: Vec<Pass>,
}

impl Build<'_> {
    /// Runs it once.
    pub fn run(&self) -> Result<Built> {
        let json = self.scratch.join("report.json");
        let time = self.scratch.join("time.txt");
        let timed = has_gnu_time(&time);
        for path in [&json, &time] {
            if path.exists() {
                fs::remove_file(path).map_err(at(path))?;
            }
        }
        let mut command = if timed {
            let mut command = Command::new(TIME);
            command.arg("-v").arg("-o").arg(&time).arg(self.binary);
            command
        } else {
            Command::new(self.binary)
        };
        command
            .arg("build")
            .arg(self.v)
            .arg("--positions")
            .arg(self.g)
            .arg("-o")
            .arg(self.out);
        command
            .args(["--memory", self.memory, "--progress", "none", "--threads"])
            .arg(self.threads.to_string())
            .arg(format!("--json={}", json.display()))
            .env("LC_ALL", "C")
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        let start = Instant::now();
        let done = command.output()?;
        let wall = start.elapsed().as_secs_f64();
        if !done.status.success() {
            let said = String::from_utf8_lossy(&done.stderr);
            return Err(format!("build ended with {}: {said}", done.status).into());
        }
        let report = read_report(&json);
        let passes = passes(&report);
        let apart = passes.iter().filter(|p| APART.contains(&p.name.as_str()));
        let sync = (!passes.is_empty()).then(|| apart.map(|p| p.seconds).sum());
        Ok(Built {
            seconds: wall - sync.unwrap_or(0.0),
            sync,
            peak: peak(timed.then_some(&time), &report),
            passes,
        })
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

fn passes(report: &Value) -> Vec<Pass> {
    let pass = |p: &Value| {
        Some(Pass {
            name: p["name"].as_str()?.to_owned(),
            seconds: p["seconds"].as_f64()?,
            read: p["read"].as_u64().unwrap_or(0),
            written: p["written"].as_u64().unwrap_or(0),
        })
    };
    let passes = report["passes"].as_array();
    passes.into_iter().flatten().filter_map(pass).collect()
}

fn peak(time: Option<&std::path::PathBuf>, report: &Value) -> Peak {
    match (
        time.and_then(|t| max_resident(t)),
        report["peak_resident"].as_u64(),
    ) {
        (Some(bytes), _) => Peak::Kernel(bytes),
        (None, Some(bytes)) => Peak::Own(bytes),
        (None, None) => Peak::Unknown,
    }
}
