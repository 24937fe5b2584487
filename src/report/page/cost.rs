//! What a build cost, from the report that `build --json=FILE` wrote.
//!
//! The folder itself holds no times, so that equal meshes give equal folders; whoever wants them
//! on the page hands the report in.
//!
//! Memory: the text of the report, at most [`MOST`]. I/O: it is read once.

use crate::disk::fs;
use crate::error::{Error, Result};
use crate::folder::Counts;
use serde::Deserialize;
use std::path::Path;

/// The longest report that is read.
const MOST: u64 = 1 << 20;

/// What a build cost.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Cost {
    pub(super) passes: Vec<Pass>,
    pub(super) seconds: f64,
    pub(super) peak_resident: Option<u64>,
    pub(super) peak_budget: u64,
    pub(super) peak_scratch: u64,
}

/// One pass.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Pass {
    pub(super) name: String,
    pub(super) seconds: f64,
    pub(super) read: u64,
    pub(super) written: u64,
}

/// The parts of a report that matter here.
#[derive(Deserialize)]
struct BuildReport {
    counts: Counts,
    build: Option<Cost>,
}

impl Cost {
    /// Reads the report of the build that made a mesh of these counts.
    ///
    /// # Errors
    /// [`Error::Input`] when it is no such report, or of another mesh; [`Error::Io`].
    pub(super) fn read(path: &Path, counts: &Counts) -> Result<Cost> {
        let bad = |expected: &str, found: String, help: &str| {
            Err(Error::input(path, "", expected, found, help))
        };
        let io = |e| Error::io(path, "read it", e);
        let help = "give the file that `cornermill build --json=FILE` wrote";
        // As much as may be, whatever the file says of its length.
        let text = fs::read_up_to(path, MOST + 1).map_err(io)?;
        if text.len() as u64 > MOST {
            return bad("the report of a build, at most 1 MiB", "more".into(), help);
        }
        let report: BuildReport = match serde_json::from_slice(&text) {
            Ok(report) => report,
            Err(e) => return bad("the report of a build", e.to_string(), help),
        };
        if report.counts != *counts {
            let found = format!(
                "the report of a mesh of {} triangles",
                report.counts.triangles
            );
            let expected = format!(
                "counts equal to the folder's ({} triangles)",
                counts.triangles
            );
            return bad(
                &expected,
                found,
                "give the report of the build that made this folder",
            );
        }
        match report.build {
            Some(cost) => Ok(cost),
            None => bad("a report with what the build cost", "none".into(), help),
        }
    }
}
