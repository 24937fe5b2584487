//! README.md does what it says: its shell and Python blocks run, in its order, in one place; what
//! it shows as output is said; and it names the options that the program has.

mod common;

use common::run::{Run, cornermill, run};
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const COMMANDS: [&str; 13] = [
    "build", "check", "info", "verify", "encode", "decode", "export", "filter", "normals", "path",
    "swirl", "picture", "report",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).expect("README.md")
}

/// A fenced block: its language, its text, and the comment `<!-- command: NAME -->` before it.
struct Block {
    language: String,
    text: String,
    command: Option<String>,
}

fn blocks(text: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let mut before = "";
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let inside: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
            let marker = before.strip_prefix("<!-- command: ");
            found.push(Block {
                language: language.to_owned(),
                text: inside.join("\n"),
                command: marker.map(|m| m.trim_end_matches(" -->").to_owned()),
            });
        }
        before = line;
    }
    found
}

/// A place that looks like a clone of the project: its meshes, and `target` for results.
fn clone() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    std::os::unix::fs::symlink(root().join("tests"), dir.path().join("tests")).expect("a link");
    fs::create_dir(dir.path().join("target")).expect("a folder");
    dir
}

/// Runs a text by `program` as a user in the clone does, with `cornermill` in the path.
fn run_in(dir: &Path, program: &[&str], text: &str) -> Run {
    let built = Path::new(env!("CARGO_BIN_EXE_cornermill")).parent();
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let paths = built
        .map(PathBuf::from)
        .into_iter()
        .chain(std::env::split_paths(&paths));
    let path: OsString = std::env::join_paths(paths).expect("plain paths");
    let mut command = Command::new(program[0]);
    command.args(&program[1..]).arg(text);
    command.current_dir(dir).env("PATH", path);
    run(command, Stdio::null())
}

/// Words of a line, so that columns may be of any width.
fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn its_blocks_run_and_say_what_it_shows() {
    let dir = clone();
    let (mut said, mut shells, mut pythons) = (String::new(), 0, 0);
    for block in blocks(&readme()) {
        match (block.language.as_str(), block.command.as_deref()) {
            // The tests cannot run themselves.
            (_, Some("test")) => {}
            ("sh", _) => {
                let text = block.text.replace("cargo run --release --", "cornermill");
                said = run_in(dir.path(), &["bash", "-euc"], &text)
                    .expect(0)
                    .stdout;
                shells += 1;
            }
            ("python", _) => {
                said = run_in(dir.path(), &["python3", "-c"], &block.text)
                    .expect(0)
                    .stdout;
                pythons += 1;
            }
            ("text", _) => {
                let said: BTreeSet<String> = said.lines().map(words).collect();
                for line in block.text.lines().map(words) {
                    assert!(said.contains(&line), "'{line}' is shown, said is {said:#?}");
                }
            }
            (other, _) => panic!("a block of '{other}', which is neither sh, python nor text"),
        }
    }
    assert!(
        shells >= 5 && pythons >= 1,
        "{shells} shell, {pythons} Python blocks"
    );
}

#[test]
fn its_two_commands_are_those_that_the_check_runs() {
    let of = |name: &str| -> String {
        let found: Vec<Block> = blocks(&readme())
            .into_iter()
            .filter(|b| b.command.as_deref() == Some(name))
            .collect();
        assert_eq!(found.len(), 1, "one block marked '{name}'");
        assert_eq!(found[0].text.lines().count(), 1, "one command in it");
        found[0].text.clone()
    };
    assert!(of("main").starts_with("cargo run --release -- build tests/meshes/"));
    assert!(of("test").starts_with("cargo test "));
    let check = fs::read_to_string(root().join(".ci/run")).expect(".ci/run");
    for name in ["main", "test"] {
        let read = format!("{name}_command=$(readme_command {name})");
        let runs = format!("bash -euc \"${name}_command\"");
        assert!(check.contains(&read) && check.contains(&runs), "{name}");
        assert!(!check.contains(&of(name)), "{name} stands there twice");
    }
}

/// The options in a text: words that begin with two dashes and a letter.
fn options(text: &str) -> BTreeSet<String> {
    let part_of_word = |c: char| c.is_ascii_alphanumeric() || c == '-';
    text.split(|c| !part_of_word(c))
        .filter(|w| w.starts_with("--") && w[2..].starts_with(|c: char| c.is_ascii_lowercase()))
        .map(str::to_owned)
        .collect()
}

#[test]
fn it_names_the_options_that_there_are() {
    let named = options(&readme());
    let mut known = BTreeSet::new();
    for command in COMMANDS {
        let help = cornermill([command, "--help"]).expect(0).stdout;
        known.extend(options(&help));
    }
    let missing: Vec<_> = known.difference(&named).collect();
    assert!(missing.is_empty(), "not in README.md: {missing:?}");
    // Those of cargo, and of benches/run.
    known.insert("--quick".into());
    known.extend(["--bench", "--release", "--workspace", "--path", "--open"].map(String::from));
    let invented: Vec<_> = named.difference(&known).collect();
    assert!(invented.is_empty(), "in README.md alone: {invented:?}");
}
