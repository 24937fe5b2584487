//! `filter`: every selection against a naive one; the result verifies, and has the very arrays of
//! a fresh build of the exported selection; its maps lead back; nothing but the mesh shows.

mod common;

use common::bench::Bench;
use common::folder::{Folder, NONE, files};
use common::mesh::Mesh;
use common::random::Random;
use common::run::{Run, cornermill};
use common::{npy::Npy, zoo};
use cornermill::folder::Manifest;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// A condition as options, and the components that meet it.
struct Choice {
    options: Vec<String>,
    chosen: Vec<u64>,
}

/// One condition, drawn at random; what it means is read off the table of components.
fn condition(folder: &Folder, random: &mut Random) -> (Vec<String>, Box<dyn Fn(usize) -> bool>) {
    let table = &folder.components;
    let n = table.shape[0];
    let counts = |name: &str| table.counts(name);
    let first = |name: &str| -> Vec<f64> { table.floats(name).iter().map(|x| x[0]).collect() };
    let option = |name: &str, value: String| vec![format!("--{name}={value}")];
    let triangles = counts("triangles");
    let verdict = |column: Vec<u64>, yes: &str, no: &str, want: bool| {
        let option = vec![format!("--{}", if want { yes } else { no })];
        let meets: Box<dyn Fn(usize) -> bool> = Box::new(move |c| (column[c] == 1) == want);
        (option, meets)
    };
    let want = random.chance(50);
    match random.below(10) {
        0 => {
            let (a, b) = (random.below(n), random.below(n));
            let (low, high) = (a.min(b), a.max(b));
            let one = random.below(n);
            let list = format!("{low}-{high},{one}");
            let meets = move |c| (low..=high).contains(&c) || c == one;
            (option("component", list), Box::new(meets))
        }
        1 => {
            let least = triangles[random.below(n)];
            let meets = move |c: usize| triangles[c] >= least;
            (option("min-triangles", least.to_string()), Box::new(meets))
        }
        2 => {
            let most = triangles[random.below(n)];
            let meets = move |c: usize| triangles[c] <= most;
            (option("max-triangles", most.to_string()), Box::new(meets))
        }
        3 => {
            let (area, bound) = (first("area"), random.below(30) as f64 / 10.0);
            let meets = move |c: usize| {
                if want {
                    area[c] >= bound
                } else {
                    area[c] <= bound
                }
            };
            let name = if want { "min-area" } else { "max-area" };
            (option(name, bound.to_string()), Box::new(meets))
        }
        4 => {
            let (six, bound) = (first("six_volume"), random.below(12) as f64 / 10.0);
            let volume = move |c: usize| six[c].abs() / 6.0;
            let meets = move |c| {
                if want {
                    volume(c) >= bound
                } else {
                    volume(c) <= bound
                }
            };
            let name = if want { "min-volume" } else { "max-volume" };
            (option(name, bound.to_string()), Box::new(meets))
        }
        5 => verdict(counts("closed"), "closed", "open", want),
        6 => verdict(counts("watertight"), "watertight", "not-watertight", want),
        7 => verdict(counts("orientable"), "orientable", "not-orientable", want),
        8 => {
            let genus = counts("genus");
            let one = genus[random.below(n)];
            let meets = move |c: usize| genus[c] == one;
            (option("genus", one.to_string()), Box::new(meets))
        }
        _ => {
            let (min, max) = (table.floats("bbox_min"), table.floats("bbox_max"));
            let corner = [0; 3].map(|_| (6.0 * random.coordinate()) as f64);
            let side = 4.0 + f64::from(random.coordinate());
            let far = corner.map(|x| x + side);
            let meets = move |c: usize| {
                (0..3).all(|a| {
                    let (min, max) = (min[c][a], max[c][a]);
                    if want {
                        min >= corner[a] && max <= far[a]
                    } else {
                        max >= corner[a] && min <= far[a]
                    }
                })
            };
            let numbers: Vec<String> = corner.iter().chain(&far).map(f64::to_string).collect();
            let name = if want { "inside" } else { "touching" };
            (option(name, numbers.join(",")), Box::new(meets))
        }
    }
}

/// One to three conditions, perhaps the largest of those, perhaps the others.
fn choice(folder: &Folder, random: &mut Random) -> Choice {
    let triangles = folder.components.counts("triangles");
    let mut chosen: Vec<usize> = (0..triangles.len()).collect();
    let mut all: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for _ in 0..1 + random.below(2) {
        let (options, meets) = condition(folder, random);
        let name = options[0].split('=').next().unwrap().to_owned();
        // An option is given once, and a verdict not with its opposite.
        let opposite = ["closed", "watertight", "orientable", "open"];
        let clashes = all.keys().any(|k| opposite.iter().any(|o| k.contains(o)))
            && opposite.iter().any(|o| name.contains(o));
        if all.contains_key(&name) || clashes {
            continue;
        }
        chosen.retain(|&c| meets(c));
        all.insert(name, options);
    }
    let mut options: Vec<String> = all.into_values().flatten().collect();
    if random.chance(30) {
        let k = 1 + random.below(3);
        chosen.sort_by_key(|&c| (std::cmp::Reverse(triangles[c]), c));
        chosen.truncate(k);
        options.push(format!("--largest={k}"));
    }
    let mut chosen: Vec<u64> = chosen.iter().map(|&c| c as u64).collect();
    chosen.sort();
    if random.chance(25) {
        chosen = (0..triangles.len() as u64)
            .filter(|c| !chosen.contains(c))
            .collect();
        options.push("--invert".into());
    }
    Choice { options, chosen }
}

fn run(command: &str, folder: &Path, out: &Path, options: &[&str], choice: &Choice) -> Run {
    let mut args: Vec<OsString> = vec![command.into(), folder.into(), "-o".into(), out.into()];
    args.extend(["--quiet", "--force"].map(Into::into));
    args.extend(options.iter().map(Into::into));
    args.extend(choice.options.iter().map(Into::into));
    cornermill(args)
}

/// True when a non-manifold edge keeps two corners.
fn joins(folder: &Folder, chosen: &[u64]) -> bool {
    let (labels, corners) = (folder.component.ids(), folder.nonmanifold_corners.ids());
    let mut corners = corners.iter();
    folder.nonmanifold_edges.counts("corners").iter().any(|&n| {
        let edge = corners.by_ref().take(n as usize);
        edge.filter(|&&c| chosen.contains(&labels[c as usize / 3]))
            .count()
            == 2
    })
}

/// What the filtered folder must be, given the folder it is taken from.
fn check_maps(source: &Folder, found: &Folder, choice: &Choice) {
    let map = |name: &str| Npy::read(&found.path.join(name)).ids();
    let (triangles, vertices) = (map("map_triangle.npy"), map("map_vertex.npy"));
    let labels = source.component.ids();
    let taken: Vec<u64> = (0..labels.len() as u64)
        .filter(|&t| labels[t as usize] != NONE && choice.chosen.contains(&labels[t as usize]))
        .collect();
    assert_eq!(triangles, taken, "{:?}", choice.options);
    let (before, after) = (source.v.ids(), found.v.ids());
    let (flips, old_flips) = (found.flips(), source.flips());
    for (t, &old) in triangles.iter().enumerate() {
        let mut row: Vec<u64> = (0..3)
            .map(|k| vertices[after[3 * t + k] as usize])
            .collect();
        if flips[t] != old_flips[old as usize] {
            row.swap(1, 2);
        }
        assert_eq!(row, before[3 * old as usize..][..3], "triangle {t}");
    }
    let mut named: Vec<u64> = taken
        .iter()
        .flat_map(|&t| &before[3 * t as usize..][..3])
        .copied()
        .collect();
    named.sort();
    named.dedup();
    assert_eq!(vertices, named);
    if let (Some(g), Some(old)) = (&found.g, &source.g) {
        let row = 3 * g.row_bytes();
        for (v, &was) in vertices.iter().enumerate() {
            assert_eq!(
                g.data[v * row..][..row],
                old.data[was as usize * row..][..row]
            );
        }
    }
}

/// Filters, and holds the result to a fresh build of what `export` makes of the same selection.
/// Gives false when the selection was rightly refused.
fn check(bench: &Bench, build: &[&str], choice: &Choice) -> bool {
    let source = bench.path("source.ct");
    let folder = Folder::read(&source);
    let out = bench.path("filtered.ct");
    let filtered = run("filter", &source, &out, &["--memory", "64MiB"], choice);
    if choice.chosen.is_empty() {
        assert!(filtered.expect(2).stderr.contains("none of the"));
        return false;
    }
    if build.contains(&"keep") && joins(&folder, &choice.chosen) {
        assert!(filtered.expect(2).stderr.contains("would keep two of its"));
        return false;
    }
    filtered.expect(0);
    cornermill(["verify".as_ref(), out.as_os_str()]).expect(0);
    check_maps(&folder, &Folder::read(&out), choice);
    let exported = bench.path("exported.npy");
    run(
        "export",
        &source,
        &exported,
        &["--input-orientation"],
        choice,
    )
    .expect(0);
    let fresh = bench.path("fresh.ct");
    let g = bench.path("exported.G.npy");
    let mut args: Vec<OsString> = vec!["build".into(), exported.into(), "-o".into()];
    args.extend([fresh.clone().into(), "--positions".into(), g.into()]);
    // A filtered folder has no measures.
    args.extend(["--quiet", "--force", "--no-measures"].map(Into::into));
    args.extend(build.iter().map(Into::into));
    cornermill(args).expect(0);
    let (mut found, mut expected) = (files(&out), files(&fresh));
    let manifest = |files: &mut BTreeMap<String, Vec<u8>>| -> serde_json::Value {
        let text = files.remove("manifest.json").expect("a manifest");
        serde_json::from_slice(&text).expect("JSON")
    };
    let (own, other) = (manifest(&mut found), manifest(&mut expected));
    assert_eq!(own["counts"], other["counts"], "{:?}", choice.options);
    assert_eq!(own["input"]["format"], "filter");
    found.retain(|name, _| !name.starts_with("map_"));
    common::bench::assert_same_files(&found, &expected, &format!("{:?}", choice.options));
    true
}

fn check_mesh(mesh: &Mesh, build: &[&str], times: usize, random: &mut Random) -> usize {
    let bench = Bench::new(mesh);
    bench.build("source.ct", build);
    if Folder::read(&bench.path("source.ct")).components.shape[0] == 0 {
        return 0;
    }
    let mut made = 0;
    for _ in 0..times {
        let choice = choice(&Folder::read(&bench.path("source.ct")), random);
        made += usize::from(check(&bench, build, &choice));
    }
    made
}

#[test]
fn random_meshes_and_selections() {
    let mut random = Random::new(1);
    let orients = ["outward", "majority", "first", "keep"];
    let made: usize = (0..60)
        .map(|seed| {
            let build = ["--orient", orients[seed as usize % 4]];
            check_mesh(&zoo::random(seed), &build, 4, &mut random)
        })
        .sum();
    assert!(made > 60, "only {made} selections were made");
}

#[test]
fn budgets_and_threads_do_not_show() {
    let bench = Bench::new(&common::bench::mixture(60));
    let source = bench.build("source.ct", &[]);
    let out = bench.path("out.ct");
    for selection in ["--closed", "--open", "--largest=2", "--max-triangles=40"] {
        let choice = Choice {
            options: vec![selection.into()],
            chosen: vec![],
        };
        let filter = |options: &[&str]| run("filter", &source, &out, options, &choice);
        filter(&["--memory", "1GiB"]).expect(0);
        let expected = files(&out);
        for options in [
            ["--memory=2MiB", "--threads=1"],
            ["--memory=3MiB", "--threads=5"],
        ] {
            filter(&options).expect(0);
            let what = format!("{selection} {options:?}");
            common::bench::assert_same_files(&files(&out), &expected, &what);
        }
        // Refused by a budget too small for it, and what was there stays.
        filter(&["--memory=64KiB"]).expect(5);
        assert!(files(&out) == expected);
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let bench = Bench::new(&common::surfaces::octahedron());
    let source = bench.build("source.ct", &[]);
    let out = bench.path("out.ct");
    for (option, code, words) in [
        ("--component=1", 2, "no component 1"),
        ("--component=2-1", 2, "lists no numbers"),
        ("--largest=0", 2, "--largest 0"),
        ("--open", 2, "none of the 1 components"),
        ("--inside=0,0,0,1,1", 2, "is no box"),
        ("--min-area=NaN", 2, "not a number"),
        ("--threads=2", 2, "give a selection"),
    ] {
        let choice = Choice {
            options: vec![option.into()],
            chosen: vec![],
        };
        let said = run("filter", &source, &out, &[], &choice).expect(code);
        assert!(said.stderr.contains(words), "no {words:?} in {said}");
        assert!(!out.exists());
    }
    let v = bench.path("V.npy");
    let alone = bench.path("alone.ct");
    cornermill([
        "build".as_ref(),
        v.as_os_str(),
        "-o".as_ref(),
        alone.as_os_str(),
    ])
    .expect(0);
    let choice = Choice {
        options: vec!["--min-volume=1".into()],
        chosen: vec![],
    };
    let said = run("filter", &alone, &out, &[], &choice).expect(2);
    assert!(said.stderr.contains("no coordinates"), "{said}");
    let closed = Choice {
        options: vec!["--closed".into()],
        chosen: vec![],
    };
    run("filter", &alone, &out, &[], &closed).expect(0);
    cornermill(["verify".as_ref(), out.as_os_str()]).expect(0);
}

/// The whole zoo in one folder: many components, some far out, some not finite.
#[test]
fn the_zoo_in_one_folder() {
    let mut random = Random::new(2);
    let mut all = Mesh::new("zoo", vec![], vec![]);
    for animal in zoo::all() {
        all = all.plus(&animal);
    }
    all.flip_some(&mut random, 30);
    let mut shuffled = all.clone();
    shuffled.shuffle(&mut random);
    for mesh in [all, shuffled] {
        assert!(check_mesh(&mesh, &[], 60, &mut random) > 50);
    }
}

/// Overwrites bytes of one of the arrays, from the start of its data.
fn patch(folder: &Path, name: &str, at: usize, bytes: &[u8]) {
    let path = folder.join(name);
    let mut file = std::fs::read(&path).unwrap();
    file[4096 + at..][..bytes.len()].copy_from_slice(bytes);
    std::fs::write(&path, file).unwrap();
}

#[test]
fn a_damaged_source_is_named_and_makes_no_folder() {
    // Two octahedra, and a book of five pages.
    let octahedron = common::surfaces::octahedron;
    let mesh = octahedron()
        .plus(&octahedron().moved([5.0, 0.0, 0.0]))
        .plus(&common::surfaces::fan_on_edge(5).moved([0.0, 5.0, 0.0]));
    let far = 40u32.to_le_bytes();
    for (name, at, bytes, words) in [
        (
            "O.npy",
            4,
            &far[..],
            "O.npy: triangle 0: expected a corner of component 0",
        ),
        (
            "O.npy",
            4,
            &[255, 255, 255, 0],
            "O.npy: row 0: expected an id below",
        ),
        (
            "O.npy",
            84,
            &[255; 4],
            "O.npy: expected opposites that pair",
        ),
        (
            "V.npy",
            4,
            &[99, 0, 0, 0],
            "V.npy: row 0: expected an id below",
        ),
        (
            "component.npy",
            0,
            &[99, 0, 0, 0],
            "component.npy: row 0: expected an id below",
        ),
        ("component.npy", 0, &[1, 0, 0, 0], "as components.npy says"),
        (
            "nonmanifold_edges.npy",
            16,
            &[2, 0],
            "nonmanifold_edges.npy: expected edges of 5 corners",
        ),
        (
            "nonmanifold_edges.npy",
            16,
            &[6, 0],
            "nonmanifold_edges.npy: expected edges of 5 corners",
        ),
        (
            "nonmanifold_edges.npy",
            16,
            &[4, 0],
            "nonmanifold_edges.npy: expected edges of 5 corners",
        ),
        (
            "nonmanifold_corners.npy",
            0,
            &[255, 255, 0, 0],
            "a corner below",
        ),
        (
            "components.npy",
            16,
            &[9, 0],
            "components.npy: row 0: expected its first triangle",
        ),
    ] {
        let bench = Bench::new(&mesh);
        let source = bench.build("source.ct", &[]);
        patch(&source, name, at, bytes);
        let choice = Choice {
            options: vec!["--component=0,2-6".into()],
            chosen: vec![],
        };
        let out = bench.path("out.ct");
        let said = run("filter", &source, &out, &[], &choice).expect(3);
        assert!(
            said.stderr.contains(words),
            "{name} {bytes:?}: no {words:?} in {said}"
        );
        assert!(!out.exists());
    }
}

/// Gives the manifest the checksums of what is there.
fn seal(folder: &Path) {
    let mut manifest = Manifest::read(folder).expect("a manifest");
    for entry in &mut manifest.files {
        let bytes = std::fs::read(folder.join(&entry.name)).expect("an array");
        entry.blocks = vec![format!("{:016x}", xxh3_64(&bytes))];
    }
    std::fs::write(folder.join("manifest.json"), manifest.to_text()).expect("it is written");
}

#[test]
fn verify_holds_the_maps_to_what_a_filter_makes() {
    let bench = Bench::new(&common::bench::mixture(3));
    let (source, folder) = (bench.build("source.ct", &[]), bench.path("part.ct"));
    let [source, part] = [&source, &folder].map(|path| path.as_os_str());
    cornermill([
        "filter".as_ref(),
        source,
        "-o".as_ref(),
        part,
        "--largest=2".as_ref(),
    ])
    .expect(0);
    let verify = || cornermill(["verify".as_ref(), folder.as_os_str()]);
    let sound = verify().expect(0);
    assert!(!sound.stdout.contains("map_"), "{sound}");
    for name in ["map_triangle.npy", "map_vertex.npy"] {
        let path = folder.join(name);
        let bytes = std::fs::read(&path).expect("a map");
        for (row, id) in [(1, 0), (2, u64::MAX), (0, 1 << 56), (3, u64::MAX >> 1)] {
            let mut wrong = bytes.clone();
            wrong[4096 + 8 * row..][..8].copy_from_slice(&id.to_le_bytes());
            std::fs::write(&path, &wrong).expect("it is written");
            seal(&folder);
            let run = verify().expect(1);
            let at = format!("{name}: row {row}: ");
            assert!(
                run.stdout.contains(&at) && run.stdout.contains("maps: 1 in all"),
                "{run}"
            );
        }
        std::fs::write(&path, &bytes).expect("it is written");
        seal(&folder);
        verify().expect(0);
    }
}
