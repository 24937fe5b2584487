//! A folder of its own for each case: inputs, outputs, scratch, and what is in them.

use crate::runs::Case;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Every file with its bytes, and every folder without any, by path below the root.
pub type Tree = BTreeMap<PathBuf, Vec<u8>>;

pub struct Place {
    dir: tempfile::TempDir,
}

fn walk(root: &Path, dir: &Path, tree: &mut Tree) {
    for entry in std::fs::read_dir(dir).expect("a folder is read") {
        let path = entry.expect("an entry").path();
        let name = path.strip_prefix(root).expect("below").to_owned();
        if path.is_dir() {
            tree.insert(name, Vec::new());
            walk(root, &path, tree);
        } else {
            tree.insert(name, std::fs::read(&path).expect("a file is read"));
        }
    }
}

/// The folders that runs write in.
const MADE: [&str; 2] = ["out", "tmp"];

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder is read") {
        let path = entry.expect("an entry").path();
        let to = to.join(path.file_name().expect("a name"));
        match path.is_dir() {
            true => copy(&path, &to),
            false => drop(std::fs::copy(&path, &to).expect("a file is copied")),
        }
    }
}

/// True for what a case makes under a final name.
fn is_output(name: &Path) -> bool {
    name.starts_with("out")
        && name
            .components()
            .nth(1)
            .is_some_and(|c| !c.as_os_str().to_string_lossy().starts_with('.'))
}

impl Place {
    /// A place with the inputs of a case.
    pub fn new(case: &Case) -> Place {
        // In memory where there is such a place: thousands of runs sync their files.
        let shm = Path::new("/dev/shm");
        let dir = if shm.is_dir() {
            tempfile::tempdir_in(shm)
        } else {
            tempfile::tempdir()
        };
        let place = Place {
            dir: dir.expect("a temporary folder"),
        };
        for sub in ["in", "out", "tmp"] {
            std::fs::create_dir(place.dir.path().join(sub)).expect("a folder");
        }
        (case.prepare)(&place.dir.path().join("in"));
        place
    }

    pub fn root(&self) -> &str {
        self.dir.path().to_str().expect("a plain name")
    }

    /// Runs the command of the case on one thread.
    pub fn run(&self, case: &Case) -> (u8, String) {
        self.run_so(case, "--threads=1")
    }

    /// Runs it with further options.
    pub fn run_so(&self, case: &Case, more: &str) -> (u8, String) {
        let root = self.root();
        let args = case.args.split_whitespace();
        let args = ["cornermill"].into_iter().chain(args);
        // Two commands have no use for memory, threads and scratch.
        let plain = ["check", "info"].iter().any(|c| case.args.starts_with(c));
        let common = if plain {
            String::new()
        } else {
            format!("--quiet --tmp={root}/tmp {more}")
        };
        let args: Vec<_> = args
            .map(|a| a.replace('@', root))
            .chain(common.split_whitespace().map(str::to_owned))
            .map(Into::into)
            .collect();
        cornermill::cli::run_here(&args)
    }

    pub fn tree(&self) -> Tree {
        let mut tree = Tree::new();
        walk(self.dir.path(), self.dir.path(), &mut tree);
        tree
    }

    pub fn outputs(&self) -> Tree {
        self.tree()
            .into_iter()
            .filter(|(n, _)| is_output(n))
            .collect()
    }

    pub fn tree_without_outputs(&self) -> Tree {
        self.tree()
            .into_iter()
            .filter(|(n, _)| !is_output(n))
            .collect()
    }

    /// Removes the outputs, and what was left beside them.
    pub fn clear(&self) {
        for name in MADE {
            let dir = self.dir.path().join(name);
            std::fs::remove_dir_all(&dir).expect("outputs are removed");
            std::fs::create_dir(&dir).expect("a folder");
        }
    }

    /// Removes the outputs alone.
    pub fn clear_outputs(&self) {
        for name in self
            .outputs()
            .keys()
            .filter(|n| n.components().count() == 2)
        {
            let path = self.dir.path().join(name);
            let done = match path.is_dir() {
                true => std::fs::remove_dir_all(&path),
                false => std::fs::remove_file(&path),
            };
            done.expect("an output is removed");
        }
    }

    /// Keeps a copy of all that was made.
    pub fn copy_to(&self, to: &Path) {
        MADE.iter()
            .for_each(|name| copy(&self.dir.path().join(name), &to.join(name)));
    }

    /// Puts back what a copy holds.
    pub fn restore_from(&self, from: &Path) {
        for name in MADE {
            let dir = self.dir.path().join(name);
            std::fs::remove_dir_all(&dir).expect("outputs are removed");
            copy(&from.join(name), &dir);
        }
    }
}
