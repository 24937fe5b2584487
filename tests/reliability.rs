//! `docs/reliability.md` names only tests that there are.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Names of all functions under `#[test]` in the sources below a folder.
fn tests(folder: &Path, names: &mut BTreeSet<String>) {
    for item in fs::read_dir(folder).expect("a folder") {
        let path = item.expect("an entry").path();
        if path.is_dir() {
            tests(&path, names);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = fs::read_to_string(&path).expect("a source");
            for part in text.split("#[test]").skip(1) {
                let name = part.split_once("fn ").and_then(|(_, n)| n.split_once('('));
                names.extend(name.map(|(name, _)| name.to_owned()));
            }
        }
    }
}

#[test]
fn every_test_that_the_page_names_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut there = BTreeSet::new();
    for folder in ["src", "tests"] {
        tests(&root.join(folder), &mut there);
    }
    let text = fs::read_to_string(root.join("docs/reliability.md")).expect("the page");
    let quoted = text.split('`').skip(1).step_by(2);
    // A name of a test is a sentence: other words in quotes have fewer parts.
    let is_name = |q: &&str| {
        q.matches('_').count() >= 2 && q.chars().all(|c| matches!(c, 'a'..='z' | '0'..='9' | '_'))
    };
    let named: BTreeSet<String> = quoted.filter(is_name).map(str::to_owned).collect();
    assert!(named.len() > 20, "{named:?}");
    let missing: Vec<_> = named.difference(&there).collect();
    assert!(missing.is_empty(), "no such tests: {missing:?}");
}
