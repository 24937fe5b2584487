//! The rules of sameness: the folder is byte-identical, manifest included, for every memory budget,
//! thread count, chunk size, bucket count and strategy; equal in value for both index types; and equal in
//! its arrays for every format that decodes alike.

mod common;
#[path = "sameness/formats.rs"]
mod formats_alike;

use common::bench::{Bench, arrays, assert_same_files, bytes_of, mixture, shuffled, sizes_in};
use common::folder::{Folder, files};
use common::mesh::Mesh;
use common::run::cornermill;
use common::surfaces;

#[test]
fn sizes_are_found_in_messages() {
    let found = sizes_in("--memory 1 KiB is too small: at least 12.5 MiB, or 3GB");
    let expected = [
        (1024, "1KiB"),
        (13_107_200, "12.5MiB"),
        (3_000_000_000, "3GB"),
    ];
    assert_eq!(found, expected.map(|(n, s)| (n, s.to_string())));
}

/// Builds with every set of options and compares whole folders, manifest included.
fn same_for(mesh: &Mesh, variations: &[&[&str]]) {
    let bench = Bench::new(mesh);
    let expected = files(&bench.build("expected.ct", &[]));
    assert!(
        expected.contains_key("manifest.json"),
        "the folder has no manifest"
    );
    for options in variations {
        let found = files(&bench.build("found.ct", options));
        assert_same_files(
            &found,
            &expected,
            &format!("{} with {options:?}", mesh.name),
        );
    }
}

#[test]
fn chunk_sizes_threads_and_buckets_do_not_show() {
    let variations: &[&[&str]] = &[
        &[],
        &["--chunk-triangles", "1"],
        &["--chunk-triangles", "1", "--threads", "5", "--buckets", "1"],
        &["--chunk-triangles", "7"],
        &["--chunk-triangles", "7", "--threads", "1", "--buckets", "3"],
        &["--chunk-triangles", "64", "--threads", "2"],
        &[
            "--chunk-triangles",
            "64",
            "--threads",
            "5",
            "--buckets",
            "1000",
        ],
        &[
            "--chunk-triangles",
            "1000",
            "--threads",
            "2",
            "--buckets",
            "2",
        ],
        &["--chunk-triangles", "1000000", "--threads", "1"],
        &["--buckets", "1", "--threads", "2"],
        &["--buckets", "257", "--threads", "1"],
        &["--strategy", "memory"],
        &["--strategy", "contract"],
        &["--strategy", "contract", "--chunk-triangles", "1"],
        &[
            "--strategy",
            "contract",
            "--chunk-triangles",
            "7",
            "--buckets",
            "1000",
            "--threads",
            "5",
        ],
    ];
    let mesh = mixture(25);
    same_for(&mesh, variations);
    same_for(&shuffled(&mesh), variations);
}

#[test]
fn modes_of_orientation_are_the_same_for_all_too() {
    let bench = Bench::new(&shuffled(&mixture(20)));
    for orient in ["majority", "first", "keep"] {
        let expected = files(&bench.build("expected.ct", &["--orient", orient]));
        for (chunk, strategy) in [("1", "auto"), ("64", "auto"), ("1", "contract")] {
            let options = [
                "--orient",
                orient,
                "--chunk-triangles",
                chunk,
                "--threads",
                "5",
                "--strategy",
                strategy,
            ];
            let found = files(&bench.build("found.ct", &options));
            assert_same_files(&found, &expected, orient);
        }
    }
}

#[test]
fn budgets_do_not_show() {
    let mesh = mixture(250);
    for mesh in [shuffled(&mesh), mesh] {
        let bench = Bench::new(&mesh);
        let expected = files(&bench.build("expected.ct", &["--memory", "512MiB"]));
        for threads in ["1", "2", "5"] {
            let least = bench.small_budget(&["--threads", threads]);
            for memory in [&least, "16MiB", "64MiB", "1GiB"] {
                let (least, budget) = (bytes_of(&least), bytes_of(memory));
                if budget >= least {
                    let options = ["--threads", threads, "--memory", memory];
                    let found = files(&bench.build("found.ct", &options));
                    assert_same_files(&found, &expected, &format!("{} {options:?}", mesh.name));
                }
            }
        }
    }
}

#[test]
fn the_least_budget_is_accepted_and_less_is_refused() {
    let bench = Bench::new(&shuffled(&mixture(120)));
    let small_chunks = [
        "--threads",
        "2",
        "--chunk-triangles",
        "64",
        "--buckets",
        "7",
    ];
    for options in [&["--threads", "1"][..], &["--threads", "5"], &small_chunks] {
        // The least for any mesh is named at once; the least for this one's table of chunks once
        // it is there, and no third time.
        let mut least = bench.named_least(options, "1KiB");
        let first = [options, &["--memory", &least]].concat();
        if cornermill(bench.args("least.ct", &first)).code != 0 {
            least = bench.named_least(options, &least);
        }
        bench.build("least.ct", &[options, &["--memory", &least]].concat());
        let less = format!("{}KiB", bytes_of(&least) * 3 / 4 / 1024);
        let options = [options, &["--memory", &less]].concat();
        cornermill(bench.args("refused.ct", &options)).expect(5);
    }
}

#[test]
fn the_place_of_scratch_files_does_not_show() {
    let bench = Bench::new(&mixture(20));
    let expected = files(&bench.build("expected.ct", &[]));
    let (one, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let [one, other] = [&one, &other].map(|d| d.path().to_str().expect("a plain path"));
    let options = ["--tmp", one, "--tmp", other, "--chunk-triangles", "7"];
    assert_same_files(
        &files(&bench.build("found.ct", &options)),
        &expected,
        "two --tmp",
    );
    for dir in [one, other] {
        assert_eq!(
            std::fs::read_dir(dir).unwrap().count(),
            0,
            "scratch left in {dir}"
        );
    }
}

#[test]
fn both_index_types_hold_the_same_values() {
    for mesh in [mixture(25), shuffled(&mixture(25)), surfaces::soup(3)] {
        let bench = Bench::new(&mesh);
        let narrow = Folder::read(&bench.build("narrow.ct", &["--index", "u4"]));
        let wide = Folder::read(&bench.build("wide.ct", &["--index", "u8"]));
        let auto = files(&bench.build("auto.ct", &["--index", "auto"]));
        for (name, bytes) in arrays(&narrow.path) {
            assert_eq!(bytes, auto[&name], "{name}: auto is u4 for a small mesh");
        }
        let pairs = [
            (&narrow.v, &wide.v),
            (&narrow.o, &wide.o),
            (&narrow.component, &wide.component),
            (&narrow.nonmanifold_corners, &wide.nonmanifold_corners),
            (&narrow.degenerate, &wide.degenerate),
        ];
        for (narrow, wide) in pairs {
            assert_eq!(
                (narrow.dtype().as_str(), wide.dtype().as_str()),
                ("u4", "u8")
            );
            assert_eq!((&narrow.shape, narrow.ids()), (&wide.shape, wide.ids()));
        }
        for name in [
            "G.npy",
            "flipped.npy",
            "components.npy",
            "nonmanifold_edges.npy",
        ] {
            assert!(
                arrays(&narrow.path)[name] == arrays(&wide.path)[name],
                "{name}"
            );
        }
        assert_eq!(narrow.manifest["counts"], wide.manifest["counts"]);
    }
}
