//! A refusal of memory names a budget that suffices: each command is run in 1 KiB, in half of what
//! that names, and in what is named.

mod common;

use clap::Parser;
use common::run::{Run, cornermill};
use std::path::{Path, PathBuf};

/// The folder of a mesh, as a command line of data-gen says it.
fn folder(dir: &Path, line: &str) -> PathBuf {
    let [mesh, made] = ["mesh.ply", "mesh.ct"].map(|name| dir.join(name));
    let words = ["data-gen", "-o", mesh.to_str().expect("a plain path")];
    let words = words.into_iter().chain(line.split(' '));
    data_gen::args::run(&data_gen::Args::parse_from(words)).expect("a mesh");
    let paths = [mesh.as_os_str(), "-o".as_ref(), made.as_os_str()];
    let build = ["build".as_ref()].into_iter().chain(paths);
    cornermill(build.chain(["--quiet".as_ref()])).expect(0);
    made
}

/// What a refusal names, in KiB; `None` when the run went well.
fn named(run: Run) -> Option<u64> {
    if run.code == 0 {
        return None;
    }
    let run = run.expect(5);
    let (_, figure) = run.stderr.rsplit_once("--memory ").expect("a figure");
    let (figure, _) = figure.split_once("KiB").expect("a figure");
    Some(figure.parse().expect("a figure"))
}

/// Runs a command on a folder in these budgets, and in what they name.
fn suffices(folder: &Path, line: &str) {
    let text = |path: &Path| path.to_str().expect("a plain path").to_owned();
    let (command, options) = line.split_once(' ').unwrap_or((line, ""));
    let options = options.replace("OUT", &text(&folder.with_file_name("out")));
    let options = options.split_whitespace();
    let run = |kib: u64| {
        let memory = format!("--memory={kib}KiB");
        let args = [command.to_owned(), text(folder), memory, "--quiet".into()];
        let args = args.into_iter().chain(["--threads=2".into()]);
        named(cornermill(args.chain(options.clone().map(String::from))))
    };
    let what = format!("{line} on {}", folder.display());
    let first = run(1).unwrap_or_else(|| panic!("{what}: not refused in 1 KiB"));
    let mut low = 1;
    // In what is named, and from there on in what half of it names, where that is refused.
    for (figure, of) in [(first, 1), (first / 2, 2), (first / 4 * 3, 4)] {
        let enough = if of == 1 { Some(figure) } else { run(figure) };
        if let Some(enough) = enough {
            let again = run(enough);
            assert!(
                again.is_none(),
                "{what}: {low} KiB named {enough}, which named {again:?}"
            );
        }
        low = figure;
    }
}

fn all(line: &str) {
    let dir = tempfile::Builder::new().tempdir_in(env!("CARGO_TARGET_TMPDIR"));
    let dir = dir.expect("a temporary directory");
    let folder = folder(dir.path(), line);
    for line in [
        "filter --largest 1 -o OUT.ct --force",
        "filter --min-triangles 1 -o OUT.ct --force",
        "filter --largest 1 --invert -o OUT.ct --force",
        "path --from 0 --to 0",
        "path --from 0 --to 0 -o OUT.ply --force",
        "path --from 0 --to 0 -o OUT.stl --force",
        "path --from 0 --to 0 -o OUT.npy --force",
        "swirl --from 0",
        "export -o OUT.ply --force",
        "export --largest 1 -o OUT.stl --force",
        "report -o OUT.html --size 16 --force",
        "picture -o OUT.png --size 16 --force",
        "normals -o OUT.npy --force",
        "encode -o OUT.cmz --exact --force",
        "verify",
    ] {
        suffices(&folder, line);
    }
}

#[test]
fn of_what_a_refusal_names_on_one_surface_with_faults() {
    all("sphere -t 16k --order shuffle --defects=40");
}

#[test]
fn of_what_a_refusal_names_on_many_components() {
    all("soup -t 5k");
    all("blobs -t 8k --order shuffle --flip 0.3 --defects=20");
}

#[test]
fn of_what_a_refusal_names_on_edges_of_many_triangles() {
    all("book -t 5k --order shuffle");
    all("stack -t 5k");
}
