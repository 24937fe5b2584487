//! What a command may write: the one place that decides what an output must not be.
//!
//! An output is none of the command's inputs and no other of its outputs, lies in no mesh folder,
//! and replaces only what `--force` may: plain files, and mesh folders with nothing else in them.
//!
//! Why places, and not spellings: a file has many names. One that exists is known by its device
//! and number, one that is still to be made by the real name of the folder that it will lie in.
//!
//! Why before the work: hours of it would be lost on a name that cannot be given at the end.
//!
//! Memory: the names. I/O: the manifests, if any, of the folders above an output.

use super::{is_mesh_folder, not_replaceable};
use crate::disk::{Target, fs, parent};
use crate::error::{Error, Result};
use std::io::ErrorKind;
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

/// The outputs of one command.
#[derive(Clone, Debug)]
pub struct Outputs {
    /// What the command uses, and so must not replace.
    inputs: Vec<PathBuf>,
    force: bool,
    /// Where the outputs so far will be.
    places: Vec<PathBuf>,
}

impl Outputs {
    /// None yet, of a command that uses `inputs` (`-` is standard input) and may replace what
    /// exists (`force`).
    pub fn new(inputs: &[&Path], force: bool) -> Outputs {
        let named = |path: &&Path| match *path == Path::new("-") {
            true => PathBuf::from("/dev/stdin"),
            false => path.to_path_buf(),
        };
        Outputs {
            inputs: inputs.iter().map(named).collect(),
            force,
            places: Vec::new(),
        }
    }

    /// One more file, under a temporary name until it is kept.
    ///
    /// # Errors
    /// As [`file`](Outputs::file); [`Error::Io`] where none can be made.
    pub fn create(&mut self, path: &Path) -> Result<Target> {
        self.file(path)?;
        Target::create(path, self.force)
    }

    /// Checks one more file that is to be written.
    ///
    /// # Errors
    /// [`Error::Usage`] when it is an input or another output, lies in a mesh folder, is a folder,
    /// a link, a device or a pipe, or exists and may not be replaced; [`Error::Io`] where no file
    /// of that name can be.
    pub fn file(&mut self, path: &Path) -> Result<()> {
        if path == Path::new("-") {
            return refuse(
                path,
                "a file is to be written, and this is no name of one; give another",
            );
        }
        self.spare(path)?;
        in_no_mesh_folder(path)?;
        self.reserve(path)?;
        let there = match path.symlink_metadata() {
            Ok(_) => true,
            Err(e) if e.kind() == ErrorKind::NotFound => false,
            Err(e) => return Err(Error::io(path, "write a file of that name", e)),
        };
        match path.metadata() {
            Ok(meta) if meta.is_dir() => {
                return refuse(
                    path,
                    "is a folder, and a file is to be written; give another name",
                );
            }
            // As the system's administrator one would put a file in the place of a device.
            Ok(meta) if !meta.is_file() => {
                return refuse(
                    path,
                    "is a device or pipe, which is not replaced; give another name",
                );
            }
            _ => {}
        }
        // `NAME/` and `NAME/.` are names of folders, whether there are any or not.
        let name = path.file_name().unwrap_or_default().as_encoded_bytes();
        if name.is_empty() || !path.as_os_str().as_encoded_bytes().ends_with(name) {
            return refuse(
                path,
                "names a folder, and a file is to be written; give another name",
            );
        }
        // Neither the name nor what it leads to is certain to be what is meant.
        if let Ok(to) = path.read_link() {
            let to = to.display();
            let why = format!(
                "is a link to {to}, which --force does not replace; give that name, or remove the \
                 link"
            );
            return refuse(path, &why);
        }
        match there && !self.force {
            true => Err(Target::exists(path)),
            false => Ok(()),
        }
    }

    /// Checks the mesh folder that is to be made.
    ///
    /// # Errors
    /// [`Error::Usage`] when it is no name of a folder, or lies in a mesh folder; when it exists and
    /// may not be replaced, or is no mesh folder, or holds what is no part of one, or an input;
    /// [`Error::Io`].
    pub fn folder(&self, path: &Path) -> Result<()> {
        let refuse = |why: &str| refuse(path, &format!("{why}; choose another name with -o"));
        if path.file_name().is_none() || path == Path::new("-") {
            return refuse("names no folder that can be made");
        }
        in_no_mesh_folder(path)?;
        if path.symlink_metadata().is_err() {
            return Ok(());
        }
        if !self.force {
            return refuse("exists (--force replaces a mesh folder)");
        }
        if let Some(why) = not_replaceable(path)? {
            return refuse(&why);
        }
        let real = fs::canonicalize(path).map_err(|e| Error::io(path, "find it", e))?;
        let holds = |path: &&PathBuf| fs::canonicalize(path).is_ok_and(|p| p.starts_with(&real));
        match self.inputs.iter().find(holds) {
            Some(path) => refuse(&format!("holds {}, which this build uses", path.display())),
            None => Ok(()),
        }
    }

    /// Checks that a file is no input, by whatever name.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn spare(&self, path: &Path) -> Result<()> {
        match self.inputs.iter().find(|input| same_file(input, path)) {
            Some(input) => {
                let input = input.display();
                let why = format!("is the input {input}, which is not changed; give another name");
                refuse(path, &why)
            }
            None => Ok(()),
        }
    }

    /// Takes the place of an output, so that no other gets it.
    ///
    /// # Errors
    /// [`Error::Usage`] when another has it; [`Error::Io`] when there is no such folder.
    pub fn reserve(&mut self, path: &Path) -> Result<()> {
        let Some(name) = path.file_name() else {
            return Ok(());
        };
        let place = real_parent(path)?.join(name);
        if self.places.contains(&place) {
            return refuse(
                path,
                "would be written twice; give each output of the command a name of its own",
            );
        }
        self.places.push(place);
        Ok(())
    }
}

fn refuse<T>(path: &Path, why: &str) -> Result<T> {
    Err(Error::Usage(format!("{}: {why}", path.display())))
}

/// The folder that a path lies in, links followed.
fn real_parent(path: &Path) -> Result<PathBuf> {
    let dir = parent(path);
    fs::canonicalize(dir).map_err(|e| Error::io(dir, "write there", e))
}

/// A mesh folder is sealed by its manifest: what it names must stay, and all else would be lost
/// with it.
fn in_no_mesh_folder(path: &Path) -> Result<()> {
    let dir = real_parent(path)?;
    match dir.ancestors().find(|above| is_mesh_folder(above)) {
        Some(folder) => {
            let why = format!(
                "lies in the mesh folder {}, which holds its own files alone; give a name outside \
                 of it",
                folder.display()
            );
            refuse(path, &why)
        }
        None => Ok(()),
    }
}

/// True when two paths lead to one file, links followed, in which something could be lost.
fn same_file(a: &Path, b: &Path) -> bool {
    let file = |path: &Path| {
        let meta = path.metadata().ok()?;
        (!meta.file_type().is_char_device()).then(|| (meta.dev(), meta.ino()))
    };
    file(a).is_some_and(|a| file(b) == Some(a))
}
