//! The mesh folder as a test reads it: every array whole in memory, by the documented names.

use super::npy::Npy;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The all-ones value, at whatever width the file has it.
pub const NONE: u64 = u64::MAX;

/// The arrays of one folder.
pub struct Folder {
    pub path: PathBuf,
    pub v: Npy,
    pub o: Npy,
    pub g: Option<Npy>,
    pub component: Npy,
    pub flipped: Npy,
    pub components: Npy,
    pub nonmanifold_edges: Npy,
    pub nonmanifold_corners: Npy,
    pub degenerate: Npy,
    pub manifest: serde_json::Value,
}

impl Folder {
    /// Reads the folder at `path`; panics when a file is missing, or its data does not start where
    /// the format says.
    pub fn read(path: &Path) -> Folder {
        let array = |name: &str| {
            let npy = Npy::read(&path.join(name));
            assert_eq!(npy.start, 4096, "{name}: data starts at byte {}", npy.start);
            npy
        };
        let manifest = std::fs::read(path.join("manifest.json")).expect("manifest.json");
        Folder {
            path: path.into(),
            v: array("V.npy"),
            o: array("O.npy"),
            g: path.join("G.npy").exists().then(|| array("G.npy")),
            component: array("component.npy"),
            flipped: array("flipped.npy"),
            components: array("components.npy"),
            nonmanifold_edges: array("nonmanifold_edges.npy"),
            nonmanifold_corners: array("nonmanifold_corners.npy"),
            degenerate: array("degenerate.npy"),
            manifest: serde_json::from_slice(&manifest).expect("manifest.json is JSON"),
        }
    }

    /// A count of the manifest; `None` when it is null.
    pub fn count(&self, name: &str) -> Option<u64> {
        let value = self.manifest["counts"].get(name);
        let value = value.unwrap_or_else(|| panic!("no count {name} in {}", self.manifest));
        assert!(value.is_null() || value.is_u64(), "count {name} is {value}");
        value.as_u64()
    }

    /// The flip bit of every triangle; panics when a bit beyond the last is set.
    pub fn flips(&self) -> Vec<bool> {
        let triangles = self.v.shape[0];
        let bit = |t: usize| self.flipped.data[t / 8] >> (t % 8) & 1 == 1;
        let stored = 8 * self.flipped.data.len();
        assert_eq!(
            stored,
            triangles.div_ceil(8) * 8,
            "bits for {triangles} triangles"
        );
        assert!(
            (triangles..stored).all(|t| !bit(t)),
            "a flip bit beyond the last triangle"
        );
        (0..triangles).map(bit).collect()
    }
}

/// Every file of a folder by name, as bytes: for comparing whole folders.
pub fn files(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let file = |entry: std::io::Result<std::fs::DirEntry>| {
        let entry = entry.expect("a directory entry");
        let name = entry.file_name().into_string().expect("a plain name");
        let bytes = std::fs::read(entry.path()).unwrap_or_else(|e| panic!("{name}: {e}"));
        (name, bytes)
    };
    entries.map(file).collect()
}
