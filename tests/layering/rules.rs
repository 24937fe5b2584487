//! The rules of the house, and what breaks them.

use super::paths::{File, Kind, Named};
use std::collections::BTreeMap;

/// The modules from top to bottom. One may import from the rows below its own, and from itself.
pub const ORDER: [&[&str]; 17] = [
    &["main"],
    &["lib"],
    &["cli"],
    &["export", "report"],
    &["codec"],
    &["measure"],
    &["build"],
    &["input"],
    &["walk"],
    &["table"],
    &["verify"],
    &["folder"],
    &["chunk"],
    &["shuffle"],
    &["disk"],
    &["corner"],
    &["error"],
];

/// Modules that may import from these alone, though more lies below them.
const NARROW: [(&str, &[&str]); 7] = [
    ("main", &["cli"]),
    ("verify", &["folder", "disk", "error"]),
    ("chunk", &["corner"]),
    ("shuffle", &["disk", "error"]),
    ("disk", &["error"]),
    ("corner", &[]),
    ("error", &[]),
];
/// Who may import `verify`: what it checks must not lean on it.
const VERIFIERS: [&str; 2] = ["main", "cli"];

/// The passes of `build`, in their order.
const STAGES: [&str; 8] = [
    "coords",
    "scan",
    "chunks",
    "seams",
    "stitch",
    "deferred",
    "components",
    "finish",
];

/// What a pass hands on, and so a later one may name: types, never the passes themselves.
const HANDED_ON: [(&str, &[&str]); 3] = [
    ("scan", &["Seams"]),
    ("stitch", &["Labels"]),
    ("components", &["Chosen"]),
];

/// What passes take from each other besides, against the table: tools that belong below both, and
/// a step of `components` in a file of its own. No more may come.
const BORROWED: [(&str, &str, &str); 3] = [
    ("components", "deferred", "Deferred"),
    ("components", "deferred", "measure_deferred"),
    ("finish", "deferred", "ChunkLabels"),
];

/// Paths that name a terminal, the environment or the process, and who may name them.
const OUTSIDE: [(&[&str], &[&str]); 11] = [
    (&["std", "env"], &["cli"]),
    (&["std", "io", "IsTerminal"], &["cli"]),
    (&["std", "io", "stderr"], &["cli"]),
    (&["std", "io", "stdout"], &["cli", "export"]),
    (&["std", "io", "stdin"], &["cli", "input"]),
    (&["std", "process", "ExitCode"], &["cli", "main"]),
    (&["std", "process", "exit"], &["cli"]),
    (&["indicatif"], &["cli"]),
    (&["clap"], &["cli"]),
    (&["memmap2"], &["disk"]),
    (&["libc"], &["disk"]),
];

/// Modules that know nothing of the mesh folder and its files.
const FOLDERLESS: [&str; 4] = ["corner", "chunk", "disk", "shuffle"];
/// Modules that know no mesh word.
const MESHLESS: [&str; 2] = ["disk", "shuffle"];
const MESH_WORDS: [&str; 14] = [
    "mesh",
    "meshes",
    "triangle",
    "triangles",
    "vertex",
    "vertices",
    "corner",
    "corners",
    "edge",
    "edges",
    "component",
    "components",
    "opposite",
    "opposites",
];
/// Parts of the names of the folder's files.
const FOLDER_NAMES: [&str; 3] = [".npy", ".ct", "manifest"];
/// The files with unsafe code: mappings, and what happens when a mapped file shrinks.
const UNSAFE: [&str; 2] = ["disk/window.rs", "disk/lost.rs"];
/// The one file that maps.
const MAPS: &str = UNSAFE[0];
/// Files that may hold a hash map: its order cannot reach a file from there.
const HASHED: [&str; 2] = ["table/swirl.rs", "input/weld/tests.rs"];

/// Everything that breaks a rule: file, line, and what it is.
pub fn violations(files: &[File]) -> Vec<String> {
    let roots = root_items(files);
    let mut found = Vec::new();
    for file in files {
        let own = top(file);
        if row(&own).is_none() {
            let what = format!("{}: '{own}' is not in the table of modules", file.name);
            found.push(what);
            continue;
        }
        for path in &file.paths {
            if let Some(what) = import(file, &own, path, &roots) {
                found.push(format!("{}:{}: {what}", file.name, path.line));
            }
        }
        words(file, &own, &mut found);
    }
    found
}

fn row(module: &str) -> Option<usize> {
    ORDER.iter().position(|names| names.contains(&module))
}

/// The module of the table that a file belongs to.
fn top(file: &File) -> String {
    match file.module.first() {
        Some(first) => first.clone(),
        None => file.name.trim_end_matches(".rs").to_owned(),
    }
}

/// Names at the root of the crate (`crate::Error`), with the modules that they come from.
fn root_items(files: &[File]) -> BTreeMap<String, String> {
    let lib = files.iter().filter(|f| f.name == "lib.rs");
    lib.flat_map(|f| &f.paths)
        .filter(|p| p.segments.len() == 3 && p.segments[0] == "crate")
        .map(|p| (p.segments[2].clone(), p.segments[1].clone()))
        .collect()
}

/// What is wrong with a path, if anything.
fn import(
    file: &File,
    own: &str,
    path: &Named,
    roots: &BTreeMap<String, String>,
) -> Option<String> {
    let segments: Vec<&str> = path.segments.iter().map(String::as_str).collect();
    let shown = segments.join("::");
    if !matches!(segments[0], "crate" | "cornermill") {
        let named = |(outside, _): &&(&[&str], &[&str])| segments.starts_with(outside);
        let (what, allowed) = OUTSIDE.iter().find(named)?;
        let what = what.join("::");
        return (!allowed.contains(&own)).then(|| {
            format!("{shown}: {what} (terminal, environment, process) is for {allowed:?}")
        });
    }
    if own == "lib" {
        return None;
    }
    // `crate` alone is the word in `pub(in crate)` and the like.
    let target = *segments.get(1)?;
    let target = roots.get(target).map_or(target, String::as_str);
    if target == own {
        return stage(file, &segments);
    }
    let Some(below) = row(target) else {
        return Some(format!(
            "{shown}: '{target}' is not in the table of modules"
        ));
    };
    let narrow = NARROW.iter().find(|(module, _)| *module == own);
    if row(own).is_none_or(|above| above >= below) {
        return Some(format!(
            "{shown}: {own} imports {target}, which does not lie below it"
        ));
    }
    if target == "verify" && !VERIFIERS.contains(&own) {
        return Some(format!("{shown}: {own} must not import what checks it"));
    }
    if narrow.is_some_and(|(_, allowed)| !allowed.contains(&target)) {
        return Some(format!("{shown}: {own} must not import {target}"));
    }
    None
}

/// What is wrong with a path from one pass of `build` to another.
fn stage(file: &File, segments: &[&str]) -> Option<String> {
    let [_, "build", to, rest @ ..] = segments else {
        return None;
    };
    let from = match &file.module[..] {
        [_, from, ..] => from.as_str(),
        _ => return None,
    };
    let place = |name: &str| STAGES.iter().position(|s| *s == name);
    let (here, there) = (place(from)?, place(to)?);
    let item = rest.first().copied().unwrap_or("the module itself");
    if here == there || BORROWED.contains(&(from, to, item)) {
        return None;
    }
    let handed = HANDED_ON.iter().find(|(pass, _)| pass == to);
    let handed = handed.is_some_and(|(_, items)| items.contains(&item));
    (there > here || !handed)
        .then(|| format!("the pass {from} names {to}::{item}, which is not handed on to it"))
}

/// Words and texts that do not belong in the file.
fn words(file: &File, own: &str, found: &mut Vec<String>) {
    let mut bad = |line: usize, what: String| found.push(format!("{}:{line}: {what}", file.name));
    for (i, token) in file.tokens.iter().enumerate() {
        let text = token.text.as_str();
        let next = |sign: &str| file.tokens.get(i + 1).is_some_and(|t| t.is(sign));
        if token.kind == Kind::Text {
            let named = FOLDER_NAMES.iter().find(|name| text.contains(*name));
            if let (true, Some(_)) = (FOLDERLESS.contains(&own), named) {
                bad(
                    token.line,
                    format!("\"{text}\" names a file of the mesh folder"),
                );
            }
            continue;
        }
        let prints = ["print", "println", "eprint", "eprintln", "dbg"].contains(&text);
        if prints && next("!") && own != "cli" {
            bad(token.line, format!("{text}! is for cli"));
        }
        if text == "unsafe_code" && !UNSAFE.contains(&file.name.as_str()) {
            bad(
                token.line,
                format!("unsafe_code is allowed in {UNSAFE:?} alone"),
            );
        }
        if text == "memmap2" && file.name != MAPS {
            bad(token.line, format!("memmap2 is for {MAPS}"));
        }
        if matches!(text, "HashMap" | "HashSet") && !HASHED.contains(&file.name.as_str()) {
            bad(token.line, format!("{text}: its order must reach no file"));
        }
        if MESHLESS.contains(&own)
            && token.kind == Kind::Word
            && let Some(word) = parts(text).find(|p| MESH_WORDS.contains(&p.as_str()))
        {
            bad(token.line, format!("{text}: {own} knows no '{word}'"));
        }
    }
}

/// The words that an identifier is made of, in lower case.
fn parts(name: &str) -> impl Iterator<Item = String> {
    let mut spaced = String::new();
    for c in name.chars() {
        if c.is_uppercase() {
            spaced.push('_');
        }
        spaced.extend(c.to_lowercase());
    }
    let words: Vec<String> = spaced.split('_').map(str::to_owned).collect();
    words.into_iter()
}
