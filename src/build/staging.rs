//! The folder under construction: a temporary name beside the target, renamed when complete.
//!
//! Why beside: a rename within one file system is atomic, so the target either does not exist
//! or is whole. A build that fails removes what it made.

use crate::disk::fs;
use crate::error::{Error, Result};
use crate::folder;
use std::path::{Path, PathBuf};

/// A folder that is removed on drop unless it was put in its place.
#[derive(Debug)]
pub struct Staging {
    path: PathBuf,
    target: PathBuf,
    force: bool,
    done: bool,
}

impl Staging {
    /// Makes the temporary folder for `target`. `spare` names what must not be replaced with
    /// it: the files that the build reads, and the folders of its scratch files.
    ///
    /// # Errors
    /// [`Error::Usage`] when the target exists and `force` is not given, or is no mesh folder,
    /// or holds one of `spare`; [`Error::Io`].
    pub fn new(target: &Path, force: bool, spare: &[&Path]) -> Result<Staging> {
        if target.symlink_metadata().is_ok() {
            check_replaceable(target, force, spare)?;
        }
        let name = target.file_name().map(|n| n.to_string_lossy().into_owned());
        let Some(name) = name else {
            let what = format!("{} names no folder that can be made", target.display());
            return Err(Error::Usage(what));
        };
        let path = parent(target).join(format!(".{name}.partial-{}", std::process::id()));
        fs::create_dir(&path).map_err(|e| Error::io(&path, "create the folder", e))?;
        Ok(Staging {
            path,
            target: target.to_owned(),
            force,
            done: false,
        })
    }

    /// The temporary folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Syncs the folder and renames it to its target.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<()> {
        sync_dir(&self.path)?;
        let mut old = None;
        if self.force && self.target.symlink_metadata().is_ok() {
            let aside = self
                .path
                .with_extension(format!("replaced-{}", std::process::id()));
            fs::rename(&self.target, &aside)
                .map_err(|e| Error::io(&self.target, "put the old one aside", e))?;
            old = Some(aside);
        }
        if let Err(e) = fs::rename(&self.path, &self.target) {
            if let Some(old) = &old {
                // Best effort: what was there is better than nothing under that name.
                let _ = fs::rename(old, &self.target);
            }
            return Err(Error::io(
                &self.target,
                "rename the finished folder to it",
                e,
            ));
        }
        self.done = true;
        sync_dir(parent(&self.target))?;
        match old {
            Some(old) if old.is_dir() => fs::remove_dir_all(&old),
            Some(old) => fs::remove_file(&old),
            None => Ok(()),
        }
        .map_err(|e| Error::io(&self.target, "remove the folder that it replaces", e))
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if !self.done {
            // Nothing is lost when this fails: the name says that it is partial.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}

/// Only a mesh folder is ever replaced, and never with something of this build in it.
fn check_replaceable(target: &Path, force: bool, spare: &[&Path]) -> Result<()> {
    let refuse = |why: &str| {
        let what = format!("{} {why}; choose another name with -o", target.display());
        Err(Error::Usage(what))
    };
    if !force {
        return refuse("exists (--force replaces a mesh folder)");
    }
    if !target.join(folder::MANIFEST).is_file() {
        return refuse("is no mesh folder, so --force does not replace it");
    }
    let real = fs::canonicalize(target).map_err(|e| Error::io(target, "find it", e))?;
    let holds = |path: &&&Path| fs::canonicalize(path).is_ok_and(|p| p.starts_with(&real));
    if let Some(path) = spare.iter().find(holds) {
        return refuse(&format!("holds {}, which this build uses", path.display()));
    }
    Ok(())
}

/// The folder that a path lies in.
pub fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn sync_dir(path: &Path) -> Result<()> {
    fs::sync_dir(path).map_err(|e| Error::io(path, "sync the folder", e))
}
