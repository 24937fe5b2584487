//! The scratch space that a dry run expects of a mesh is what its build takes, within a fifth.

use clap::Parser;
use cornermill::build::Builder;
use std::path::Path;

/// What is not worth foretelling: shuffles keep so much in memory, or not.
const LITTLE: u64 = 1 << 20;

/// Foretells and builds a mesh, as a command line of data-gen says it, in budgets in MiB.
fn holds(line: &str, name: &str, budgets: &[u64]) {
    let dir = tempfile::Builder::new().tempdir_in(env!("CARGO_TARGET_TMPDIR"));
    let dir = dir.expect("a temporary directory");
    let file = dir.path().join(name);
    let words = ["data-gen", "-o", file.to_str().expect("a plain path")];
    let words = words.into_iter().chain(line.split(' '));
    data_gen::args::run(&data_gen::Args::parse_from(words)).expect("a mesh");
    for &mib in budgets {
        // A state for --resume would hold more, in a build that is slow enough.
        let builder = Builder::new(&file).checkpoint(None).force(true);
        let mut builder = builder.memory(mib << 20).threads(2);
        let g = file.with_extension("G.npy");
        if g.exists() {
            builder = builder.positions(g);
        }
        let what = format!("{line} as {name} in {mib} MiB");
        near(&what, &builder, &dir.path().join("out.ct"));
    }
}

fn near(what: &str, builder: &Builder, output: &Path) {
    let told = builder.predict(output).expect("a prediction");
    let took = builder.build(output).expect("a build").peak_scratch;
    let (said, most) = (told.expected_scratch, told.most_scratch);
    println!("{what}: {said} said, {took} taken, {most} at most");
    assert!(told.looked_at > 0, "{what}: nothing was looked at");
    assert!(took <= most, "{what}: {took} taken, {most} at most");
    let off = said.abs_diff(took);
    assert!(
        off <= (took / 5).max(LITTLE),
        "{what}: {said} said, {took} taken"
    );
}

#[test]
fn of_meshes_in_file_order() {
    holds("sphere -t 100k", "a.npy", &[4, 16]);
    holds("sphere -t 100k", "a.ply", &[4]);
    holds("sphere -t 100k --order shuffle-vertices", "a.npy", &[4]);
    holds("sphere -t 200k --order sorted-x", "a.npy", &[16]);
}

#[test]
fn of_meshes_in_no_order() {
    holds("sphere -t 100k --order shuffle", "a.npy", &[4, 16]);
    holds("sphere -t 100k --order shuffle", "a.ply", &[4]);
}

#[test]
fn of_meshes_to_be_welded() {
    holds("sphere -t 100k", "a.stl", &[16]);
    holds("sphere -t 100k --order shuffle", "a.stl", &[16]);
}

#[test]
fn of_hubs_and_crowds() {
    for line in ["cone", "fan", "book", "stack"] {
        holds(
            &format!("{line} -t 100k --order shuffle"),
            "a.npy",
            &[4, 16],
        );
    }
    holds("cone -t 200k", "a.npy", &[32]);
    holds("fan -t 100k", "a.npy", &[4]);
    holds("soup -t 100k", "a.npy", &[4]);
}
