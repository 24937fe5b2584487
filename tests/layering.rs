//! Data flows one way: every module of `src` imports only from those below it, and words that
//! belong to one module stand in no other. The table is that of ARCHITECTURE.md.
//!
//! `paths` reads the sources, `rules` judges; both are tried on made-up sources here, so that a
//! house in order is not just a checker that sees nothing.

#[path = "layering/paths.rs"]
mod paths;
#[path = "layering/rules.rs"]
mod rules;

use paths::read;
use rules::{ORDER, violations};
use std::fs;
use std::path::Path;

/// All Rust files under `folder`, by their paths below it, in order of name.
fn sources(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(dir) = folders.pop() {
        for entry in fs::read_dir(&dir).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let name = path.strip_prefix(folder).expect("a path below");
                let text = fs::read_to_string(&path).expect("a source");
                found.push((name.to_str().expect("a plain name").to_owned(), text));
            }
        }
    }
    found.sort();
    found
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_house_is_in_order() {
    let files = read(&sources(&root().join("src")));
    assert!(files.len() > 50, "only {} sources found", files.len());
    let found = violations(&files);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn every_module_of_the_table_is_there() {
    for name in ORDER.iter().flat_map(|row| row.iter()) {
        let src = root().join("src");
        let there = src.join(format!("{name}.rs")).exists() || src.join(name).is_dir();
        assert!(there, "{name}");
    }
}

#[test]
fn oracles_import_nothing_that_they_judge() {
    let judges = [
        "common/",
        "oracle.rs",
        "oracle_itself.rs",
        "sameness.rs",
        "truth",
    ];
    let tests = sources(&root().join("tests"));
    let (mut seen, mut wrong) = (0, Vec::new());
    for file in read(&tests) {
        if !judges.iter().any(|j| file.name.starts_with(j)) {
            continue;
        }
        seen += 1;
        let mut uses = file.paths.iter();
        wrong.extend(
            uses.find(|p| p.segments[0] == "cornermill")
                .map(|_| file.name.clone()),
        );
    }
    assert!(seen > 15, "only {seen} files of oracles found");
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// What is found in one made-up file.
fn found(name: &str, text: &str) -> Vec<String> {
    let lib =
        "mod error; pub mod table; pub use error::{Error, Result}; pub use table::CornerTable;";
    let mut files = vec![("lib.rs".to_owned(), lib.to_owned())];
    for known in [
        "error.rs",
        "table/mod.rs",
        "build/chunks.rs",
        "build/scan.rs",
        "build/seams.rs",
        "build/records.rs",
    ] {
        files.push((known.to_owned(), String::new()));
    }
    files.retain(|(n, _)| n != name);
    files.push((name.to_owned(), text.to_owned()));
    violations(&read(&files))
}

#[track_caller]
fn fails(name: &str, text: &str, word: &str) {
    let found = found(name, text);
    assert!(
        found.iter().any(|f| f.contains(word)),
        "{name}: {text}\n{found:?}"
    );
}

#[track_caller]
fn holds(name: &str, text: &str) {
    let found = found(name, text);
    assert!(found.is_empty(), "{name}: {text}\n{found:?}");
}

#[test]
fn an_import_from_above_is_seen_however_it_is_spelled() {
    fails("chunk/pair.rs", "use crate::disk::Window;", "disk");
    fails(
        "disk/file.rs",
        "use crate::{error::Error, folder::{self, npy}};",
        "folder",
    );
    fails(
        "disk/file.rs",
        "fn f() { super::super::folder::npy::read() }",
        "folder",
    );
    fails(
        "corner/mod.rs",
        "fn f() -> crate::error::Result<u8> { todo() }",
        "error",
    );
    fails("error.rs", "use crate::disk::File;", "disk");
    fails("folder/mod.rs", "use crate::CornerTable;", "table");
    fails("shuffle/mod.rs", "use crate::*;", "*");
    fails(
        "input/mod.rs",
        "#[cfg(test)] mod tests { use super::super::build::Builder; }",
        "build",
    );
    fails("main.rs", "fn main() { cornermill::build::run() }", "build");
    fails("report/mod.rs", "use crate::export::export;", "export");
    fails("cellar/mod.rs", "", "cellar");
}

#[test]
fn an_import_from_below_is_none_nor_is_what_no_compiler_reads() {
    holds(
        "build/mod.rs",
        "use crate::{chunk::pair::Pairs, disk::*, error::Result};",
    );
    holds(
        "input/ply/mod.rs",
        "mod header; use header::Header; use super::reader::Reader;",
    );
    holds(
        "folder/mod.rs",
        "use crate::{Error, Result}; // crate::build::Builder",
    );
    holds(
        "chunk/pair.rs",
        "/* use crate::disk::Window; /* nested */ crate::table */",
    );
    holds(
        "chunk/pair.rs",
        r##"const S: &str = r#"crate::build " crate::disk"#; const C: char = '"';"##,
    );
    holds(
        "chunk/pair.rs",
        "impl<'a> F<'a> { fn f(&'a self) -> u8 { b'\\'' } }",
    );
    holds(
        "corner/ids.rs",
        "use super::{next, prev}; mod tests { use super::*; }",
    );
    holds(
        "table/mod.rs",
        "pub(crate) mod array; pub(super) fn f() { self::array::g() }",
    );
}

#[test]
fn verify_shares_nothing_with_what_it_checks() {
    for name in ["build", "table", "chunk", "shuffle", "corner", "input"] {
        fails(
            "verify/edges.rs",
            &format!("use crate::{name}::thing;"),
            name,
        );
    }
    fails("build/finish.rs", "use crate::verify::verify;", "verify");
    holds("cli/verify.rs", "use crate::verify::verify;");
    holds(
        "verify/edges.rs",
        "use crate::{disk::Window, error::Result, folder::O}; use super::sort;",
    );
}

#[test]
fn stages_meet_only_in_what_is_handed_on() {
    fails("build/chunks.rs", "use super::seams::Seamed;", "seams");
    fails(
        "build/seams.rs",
        "use super::chunks::{Sinks, chunks};",
        "chunks::chunks",
    );
    fails("build/seams.rs", "use super::chunks;", "chunks");
    fails(
        "build/seams.rs",
        "use crate::build::scan::{self, Seams};",
        "scan",
    );
    holds(
        "build/seams.rs",
        "use super::{Job, scan::Seams, records::{EdgeCorner, Link}};",
    );
    holds("build/chunks.rs", "use super::scan::Seams;");
    holds(
        "build/pipeline.rs",
        "use super::{chunks::chunks, seams::seams};",
    );
}

#[test]
fn words_stay_where_they_belong() {
    fails(
        "disk/scratch.rs",
        "fn f() { std::env::temp_dir(); }",
        "std::env",
    );
    fails("disk/scratch.rs", "use std::{env, fs};", "std::env");
    fails("chunk/mod.rs", "fn f() { eprintln!(\"x\"); }", "eprintln!");
    fails("shuffle/mod.rs", "use std::io::IsTerminal;", "terminal");
    fails("build/mod.rs", "use indicatif::ProgressBar;", "indicatif");
    fails(
        "input/mod.rs",
        "use std::io::{self, Stdout, stdout};",
        "stdout",
    );
    fails("corner/mod.rs", "const V: &str = \"V.npy\";", "V.npy");
    fails(
        "shuffle/mod.rs",
        "fn f(path: &Path) { path.join(\"manifest.json\") }",
        "manifest.json",
    );
    fails(
        "shuffle/mod.rs",
        "struct Plan { triangle_bytes: u64 }",
        "triangle_bytes",
    );
    fails("disk/mod.rs", "struct MeshFile;", "MeshFile");
    fails("disk/file.rs", "use memmap2::Mmap;", "memmap2");
    fails("table/mod.rs", "#![allow(unsafe_code)]", "unsafe_code");
    fails(
        "build/stitch.rs",
        "use std::collections::HashMap;",
        "HashMap",
    );
    holds(
        "cli/mod.rs",
        "fn f() { eprintln!(\"{}\", std::env::temp_dir().display()); }",
    );
    holds(
        "disk/window.rs",
        "#![allow(unsafe_code)] use memmap2::Mmap;",
    );
    holds(
        "disk/ledger.rs",
        "fn acknowledged_edges_of_windows_of(x: &Ledger) {}"
            .replace("edges", "ends")
            .as_str(),
    );
}
