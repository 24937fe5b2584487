//! Whether a folder is a mesh folder and nothing else, so that `--force` may replace it.
//!
//! Why every name is looked at: what is replaced is gone, and a folder of the right name, or with
//! somebody else's `manifest.json`, may hold work that no build can make again.
//!
//! Memory: the manifest. I/O: the manifest, and the names in the folder.

use super::MANIFEST;
use super::manifest::{FORMAT, MAX_BYTES};
use crate::disk::fs;
use crate::error::{Error, Result};
use serde::Deserialize;
use std::path::Path;

/// What tells a mesh folder of any version from others.
#[derive(Deserialize)]
struct Stamp {
    format: String,
    files: Vec<Named>,
}

#[derive(Deserialize)]
struct Named {
    name: String,
}

impl Stamp {
    fn read(folder: &Path) -> Option<Stamp> {
        let path = folder.join(MANIFEST);
        let plain = fs::metadata(&path).is_ok_and(|meta| meta.is_file());
        let text = plain.then(|| fs::read_up_to(&path, MAX_BYTES).ok())??;
        let stamp: Stamp = serde_json::from_slice(&text).ok()?;
        (stamp.format == FORMAT).then_some(stamp)
    }
}

/// True for a folder that has the manifest of a mesh folder, whatever its version.
pub fn is_mesh_folder(path: &Path) -> bool {
    Stamp::read(path).is_some()
}

/// Why a folder may not be replaced with another mesh folder; `None` when it may.
///
/// # Errors
/// [`Error::Io`].
pub fn not_replaceable(path: &Path) -> Result<Option<String>> {
    // Neither the name nor what it leads to is certain to be what is meant.
    if let Ok(to) = path.read_link() {
        return Ok(Some(format!(
            "is a link to {}, which --force does not replace: give that name, or remove the link",
            to.display()
        )));
    }
    let Some(stamp) = Stamp::read(path) else {
        return Ok(Some(
            "is no mesh folder, so --force does not replace it".into(),
        ));
    };
    let list = fs::read_dir(path).map_err(|e| Error::io(path, "list it", e))?;
    let mut others = Vec::new();
    for item in list {
        let name = item.map_err(|e| Error::io(path, "list it", e))?.file_name();
        let ours = |file: &Named| name == *file.name;
        if name != MANIFEST && !stamp.files.iter().any(ours) {
            others.push(name.to_string_lossy().into_owned());
        }
    }
    // The same one whatever the order of the list.
    Ok(others.into_iter().min().map(|name| {
        format!("holds {name}, which is no part of the mesh folder and would be lost with it")
    }))
}
