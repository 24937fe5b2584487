//! Builds of one mesh over and over into one directory, and the comparison of whole folders.

use super::folder::files;
use super::formats;
use super::mesh::Mesh;
use super::random::Random;
use super::run::cornermill;
use super::{surfaces, zoo};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A mesh of every hazard, with about `2 * side * side` triangles on its largest component.
pub fn mixture(side: u32) -> Mesh {
    let mut mesh = surfaces::torus(side, side);
    let mut random = Random::new(u64::from(side));
    mesh.flip_some(&mut random, 30);
    for animal in zoo::all() {
        // Text cannot say which NaN.
        if animal
            .positions
            .as_flattened()
            .iter()
            .all(|x| x.is_finite())
        {
            mesh = mesh.plus(&animal);
        }
    }
    mesh = mesh
        .plus(&surfaces::moebius(side))
        .plus(&surfaces::soup(side));
    mesh.merge_vertices(&mut random, side as usize);
    mesh.duplicate_some(&mut random, side as usize);
    mesh.positions
        .extend([[-0.0, 0.0, 1e-42], [f32::MAX, 0.1, -0.3]]);
    mesh.renamed("mixture")
}

pub fn shuffled(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone().renamed("shuffled mixture");
    mesh.shuffle(&mut Random::new(7));
    mesh
}

/// A directory with a mesh as V.npy and G.npy, in which folders are built by number.
pub struct Bench {
    pub dir: TempDir,
    pub input: Vec<OsString>,
}

impl Bench {
    pub fn new(mesh: &Mesh) -> Bench {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let (v, g) = formats::write_npy(mesh, dir.path());
        Bench {
            dir,
            input: vec![v.into(), "--positions".into(), g.into()],
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// The arguments of a build into `name`.
    pub fn args(&self, name: &str, options: &[&str]) -> Vec<OsString> {
        let out = self.path(name).into_os_string();
        let mut args = vec![
            "build".into(),
            "-o".into(),
            out,
            "--quiet".into(),
            "--force".into(),
        ];
        args.extend(self.input.iter().cloned());
        args.extend(options.iter().map(Into::into));
        args
    }

    pub fn build(&self, name: &str, options: &[&str]) -> PathBuf {
        cornermill(self.args(name, options)).expect(0);
        self.path(name)
    }

    /// The least budget that the program says it would accept, when offered `memory`.
    pub fn named_least(&self, options: &[&str], memory: &str) -> String {
        let options = [options, &["--memory", memory]].concat();
        let refusal = cornermill(self.args("refused.ct", &options)).expect(5);
        assert!(
            !self.path("refused.ct").exists(),
            "a refusal leaves a folder"
        );
        let sizes = sizes_in(&refusal.stderr).into_iter();
        let least = sizes.filter(|s| s.0 > bytes_of(memory)).max();
        least
            .unwrap_or_else(|| panic!("no larger size in the refusal: {refusal}"))
            .1
    }

    /// A budget that is accepted, and hardly less would do: what a refusal names, or a tenth more
    /// as long as that is refused too.
    pub fn small_budget(&self, options: &[&str]) -> String {
        let mut memory = self.named_least(options, "1KiB");
        for _ in 0..200 {
            let tried = [options, &["--memory", &memory]].concat();
            if cornermill(self.args("refused.ct", &tried)).code == 0 {
                std::fs::remove_dir_all(self.path("refused.ct")).expect("the folder goes");
                return memory;
            }
            let named = bytes_of(&self.named_least(options, &memory));
            memory = format!(
                "{}KiB",
                named.max(bytes_of(&memory) * 11 / 10).div_ceil(1024)
            );
        }
        panic!("no budget is accepted, not even {memory}");
    }
}

/// Every amount such as `8.5 MiB` in a message, in bytes and as an option would take it.
pub fn sizes_in(message: &str) -> Vec<(u64, String)> {
    let units = [("KiB", 1u64 << 10), ("MiB", 1 << 20), ("GiB", 1 << 30)];
    let decimal = [("kB", 1000), ("MB", 1_000_000), ("GB", 1_000_000_000)];
    let mut found = vec![];
    for (unit, bytes) in units.into_iter().chain(decimal) {
        for (at, _) in message.match_indices(unit) {
            let before = message[..at].trim_end();
            let start = before
                .trim_end_matches(|c: char| c.is_ascii_digit() || c == '.')
                .len();
            if let Ok(number) = before[start..].parse::<f64>() {
                found.push(((number * bytes as f64) as u64, format!("{number}{unit}")));
            }
        }
    }
    found
}

/// The bytes of the first amount in `size`.
pub fn bytes_of(size: &str) -> u64 {
    sizes_in(size)[0].0
}

pub type Files = BTreeMap<String, Vec<u8>>;

/// Panics with the file and byte where two folders differ.
#[track_caller]
pub fn assert_same_files(found: &Files, expected: &Files, how: &str) {
    let names = |files: &Files| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected), "{how}: files");
    for (name, bytes) in found {
        let other = &expected[name];
        if bytes != other {
            let at = bytes.iter().zip(other).position(|(a, b)| a != b);
            let (lengths, text) = ((bytes.len(), other.len()), String::from_utf8_lossy(bytes));
            let shown = if name.ends_with(".json") { &*text } else { "" };
            panic!("{how}: {name} differs at byte {at:?}, lengths {lengths:?} {shown}");
        }
    }
}

/// The arrays alone, without the manifest, whose digest of the input may differ.
pub fn arrays(path: &Path) -> Files {
    files(path)
        .into_iter()
        .filter(|(name, _)| name.ends_with(".npy"))
        .collect()
}
