//! NumPy and SciPy in memory on the mesh of a row: what a user would do who has the memory.
//!
//! `in_memory.py` says how. Its seconds are without loading; its peak is the kernel's, interpreter and
//! libraries included. It must find what the build found.

use crate::Result;
use crate::input::Input;
use crate::process::{Peak, Ran};
use cornermill::folder::Counts;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What one run took.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub struct InMemory {
    /// Seconds of the work, without loading.
    pub seconds: f64,
    /// Seconds of loading.
    pub loading: f64,
    /// Peak resident memory.
    pub peak: Peak,
}

/// A Python that has SciPy: the one in the path, or the environment that the project's check
/// makes under target/.
pub fn python() -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/python/bin/python3");
    [PathBuf::from("python3"), own].into_iter().find(|python| {
        let mut command = Command::new(python);
        command.args(["-c", "import numpy, scipy.sparse.csgraph"]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|s| s.success())
    })
}

/// Runs it once, and holds it to the counts of the build.
pub fn run(python: &Path, input: &Input, counts: &Counts, scratch: &Path) -> Result<InMemory> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/build/in_memory.py");
    let ran = Ran::new(scratch, python, |command| {
        command.arg(script).args(input.files());
    })?;
    ran.succeeded("in_memory.py")?;
    let said: Value = serde_json::from_slice(&ran.output.stdout)?;
    let found = |name: &str| said[name].as_u64();
    for (name, expected) in [
        ("regular_edges", counts.regular_edges),
        ("border_edges", counts.border_edges),
        ("nonmanifold_edges", counts.nonmanifold_edges),
        ("inconsistent_edges", counts.inconsistent_edges),
        ("components", counts.components),
        ("nonorientable_components", counts.nonorientable_components),
        ("closed_components", counts.closed_components),
        ("flipped_triangles", counts.flipped_triangles),
    ] {
        if found(name) != Some(expected) {
            return Err(format!("in_memory.py: {name} {}, expected {expected}", said[name]).into());
        }
    }
    if said["consistent"] != true {
        return Err("in_memory.py: its opposites are not mutual".into());
    }
    let seconds = |name: &str| said[name].as_f64().ok_or("in_memory.py: no seconds");
    Ok(InMemory {
        seconds: seconds("seconds")?,
        loading: seconds("loading")?,
        peak: ran.peak,
    })
}
