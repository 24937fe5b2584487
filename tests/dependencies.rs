//! The review of dependencies in `docs/decisions.md` is complete: each that the program names is
//! listed with its version and licence, none is listed that is gone, and every package that it
//! brings has a licence that lets the program be given away.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Licences of which one is enough.
const PERMISSIVE: [&str; 11] = [
    "MIT",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "Unlicense",
    "Unicode-3.0",
    "Zlib",
    "0BSD",
    "ISC",
];

fn output(program: &str, args: &[&str]) -> String {
    let mut command = Command::new(program);
    let run = command
        .args(args)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    let run = run.expect("the program runs");
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    String::from_utf8(run.stdout).expect("text")
}

fn packages() -> Vec<Value> {
    let host = output("rustc", &["-vV"]);
    let host = host.lines().find_map(|l| l.strip_prefix("host: "));
    // What other systems need is not fetched, and not asked for.
    let platform = ["--filter-platform", host.expect("a host")];
    let args = ["metadata", "--format-version", "1", "--locked", "--offline"];
    let text = output(env!("CARGO"), &[&args[..], &platform].concat());
    let all: Value = serde_json::from_str(&text).expect("JSON");
    all["packages"].as_array().expect("packages").clone()
}

/// True when the licence leaves a choice that is permissive.
fn permissive(licence: &str) -> bool {
    let plain = licence.replace(['(', ')'], "").replace('/', " OR ");
    plain.split(" AND ").all(|part| {
        let mut choices = part.split(" OR ").map(str::trim);
        choices.any(|choice| PERMISSIVE.contains(&choice))
    })
}

/// Rows of the review: name to version and licence.
fn review() -> BTreeMap<String, (String, String)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/decisions.md");
    let text = std::fs::read_to_string(path).expect("the decisions");
    let (_, part) = text.split_once("\n## Dependencies\n").expect("the review");
    let part = part.split("\n## ").next().expect("a part");
    let rows = part.lines().filter_map(|line| line.strip_prefix("| `"));
    rows.map(|row| {
        let (name, rest) = row.split_once("` | ").expect("a name");
        let mut cells = rest.split(" | ").map(str::to_owned);
        let mut cell = || cells.next().expect("a cell");
        (name.to_owned(), (cell(), cell()))
    })
    .collect()
}

#[test]
fn every_direct_dependency_is_reviewed_and_no_other() {
    let packages = packages();
    let own = |p: &&Value| p["source"].is_null();
    let mut direct = BTreeMap::new();
    for package in packages.iter().filter(own) {
        for dependency in package["dependencies"].as_array().expect("dependencies") {
            let name = dependency["name"].as_str().expect("a name");
            if dependency["source"].is_null() {
                continue;
            }
            let req = dependency["req"].as_str().expect("a version");
            let found = packages.iter().find(|p| p["name"] == name && !own(p));
            let licence = &found.expect("the package")["license"];
            let licence = licence.as_str().unwrap_or_default().to_owned();
            direct.insert(
                name.to_owned(),
                (req.trim_start_matches('^').to_owned(), licence),
            );
        }
    }
    assert_eq!(review(), direct);
}

#[test]
fn every_package_is_permissive() {
    let packages = packages();
    assert!(packages.len() > 50);
    for package in &packages {
        let licence = package["license"].as_str().unwrap_or_default();
        assert!(permissive(licence), "{}: {licence:?}", package["name"]);
    }
    assert!(!permissive("GPL-3.0") && !permissive("MIT AND LGPL-2.1") && !permissive(""));
    assert!(permissive("(MIT OR GPL-3.0) AND Unicode-3.0"));
}
