//! Walks over damaged folders end with the name of what is wrong, never with a panic.

use super::Home;
use super::common::run::cornermill;
use super::common::surfaces;
use std::ffi::OsStr;
use std::fs;

/// A torus with entry `corner` of the array `name` replaced.
fn broken(name: &str, corner: usize, value: u32) -> Home {
    let home = Home::of(&surfaces::torus(5, 6), false);
    let path = home.path.join(name);
    let mut bytes = fs::read(&path).unwrap();
    bytes[4096 + 4 * corner..][..4].copy_from_slice(&value.to_le_bytes());
    fs::write(&path, bytes).unwrap();
    home
}

#[track_caller]
fn refused(home: &Home, args: &[&str], words: &[&str]) {
    let folder = home.path.as_os_str();
    let args = [
        &[OsStr::new(args[0]), folder],
        &args[1..].iter().map(OsStr::new).collect::<Vec<_>>()[..],
    ]
    .concat();
    let run = cornermill(args).expect(3);
    for word in words {
        assert!(run.stderr.contains(word), "{word}: {run}");
    }
}

#[test]
fn opposites_out_of_range_or_one_sided_are_named() {
    for (corner, value) in [(0, 5_000_000), (0, 180), (7, 3), (100, 9)] {
        let home = broken("O.npy", corner, value);
        // The search begins where the damage is.
        let to = corner.to_string();
        refused(
            &home,
            &["path", "--from", "60", "--to", &to],
            &["O.npy", "corner"],
        );
        refused(
            &home,
            &["swirl", "--from", "60"],
            &["O.npy", "corner", "verify"],
        );
    }
}

#[test]
fn a_label_that_joins_what_no_edge_joins_is_named() {
    // Two octahedra, the second with the label of the first.
    let both = surfaces::octahedron().plus(&surfaces::octahedron().moved([5.0; 3]));
    let home = Home::of(&both, false);
    let path = home.path.join("component.npy");
    let mut bytes = fs::read(&path).unwrap();
    bytes[4096..].fill(0);
    fs::write(&path, bytes).unwrap();
    refused(
        &home,
        &["path", "--from", "0", "--to", "40"],
        &["component.npy", "triangle"],
    );
}

#[test]
fn a_vertex_out_of_range_is_named() {
    let home = broken("V.npy", 40, 1_000_000);
    refused(&home, &["swirl", "--from", "0"], &["V.npy", "corner 40"]);
    let out = home.dir.path().join("strip.obj");
    let out = out.to_str().unwrap();
    refused(
        &home,
        &["path", "--from", "39", "--to", "41", "-o", out],
        &["V.npy", "corner 40"],
    );
    assert!(!std::path::Path::new(out).exists());
}
