//! A place with a mesh, to run commands in.

use crate::common::run::{Run, run};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use tempfile::TempDir;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A place with a mesh `m.obj` and its folder `m.ct`.
pub struct Place(pub TempDir);

impl Place {
    pub fn new() -> Place {
        let place = Place(tempfile::tempdir().expect("a temporary directory"));
        place.put("m.obj", OBJ);
        place.run("build m.obj -q").expect(0);
        place
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn put(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a file is written");
    }

    pub fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("a text is read")
    }

    /// Runs a line of words in this place.
    pub fn run(&self, line: &str) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
        command.args(line.split(' ')).current_dir(self.0.path());
        run(command, Stdio::null())
    }

    /// A line that must be refused with a word that says why, and change nothing.
    pub fn refuse(&self, line: &str, word: &str) {
        self.ends(line, 2, word);
    }

    /// A line that must end with a code and a word that says why, and change nothing.
    pub fn ends(&self, line: &str, code: i32, word: &str) {
        let before = self.all();
        let run = self.run(line).expect(code);
        assert!(run.stderr.contains(word), "{word:?} is not said\n{run}");
        assert_eq!(before, self.all(), "something changed\n{run}");
    }

    /// Every file, and what is in it.
    pub fn all(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let (mut found, mut folders) = (Vec::new(), vec![self.0.path().to_owned()]);
        while let Some(folder) = folders.pop() {
            for item in fs::read_dir(folder).expect("a folder is listed") {
                let path = item.expect("an entry").path();
                if path.is_dir() && !path.is_symlink() {
                    folders.push(path);
                } else {
                    // Reading a pipe would wait for its writer.
                    let plain = path
                        .is_file()
                        .then(|| fs::read(&path).expect("a file is read"));
                    found.push((path, plain.unwrap_or_default()));
                }
            }
        }
        found.sort();
        found
    }
}
