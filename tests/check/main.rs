//! `cornermill check`: every requirement, met and not met, on the zoo and on meshes made for it;
//! what it says, and what it refuses.

#[path = "../common/mod.rs"]
mod common;

#[allow(dead_code)]
#[path = "../by_hand/mod.rs"]
mod by_hand;

use common::compare;
use common::folder::Folder as Read;
use common::formats::write_npy;
use common::mesh::Mesh;
use common::naive::Orient;
use common::run::{Run, cornermill};
use common::schema::faults;
use common::{surfaces, zoo};
use cornermill::disk::Counters;
use cornermill::folder::Folder;
use cornermill::report;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A measured folder of a mesh.
fn built(mesh: &Mesh, dir: &Path, orient: &str) -> PathBuf {
    let out = dir.join("out.ct");
    let (v, g) = write_npy(mesh, dir);
    let [v, g, to] = [&v, &g, &out].map(|p| p.to_str().unwrap());
    let args = ["build", v, "--positions", g, "-o", to, "--orient", orient];
    cornermill(args.iter().chain(&["--quiet", "--memory", "64MiB"])).expect(0);
    out
}

fn check(folder: &Path, list: &str) -> Run {
    let run = cornermill(["check", folder.to_str().unwrap(), "--require", list]);
    assert!(run.code <= 1, "{run}");
    run
}

#[test]
fn requirements_are_met_as_the_oracle_has_it() {
    let mut seen: BTreeMap<String, [u32; 2]> = BTreeMap::new();
    for mesh in zoo::all().into_iter().chain((0..25).map(zoo::random)) {
        let dir = tempfile::tempdir().unwrap();
        let folder = built(&mesh, dir.path(), "outward");
        let read = Read::read(&folder);
        let answer = compare::answer(&read, &mesh, true, Orient::Outward);
        let stars = &answer.stars;
        let all = &answer.components;
        let every =
            |good: fn(&common::naive::Component) -> bool| !all.is_empty() && all.iter().all(good);
        let count = |name: &str| answer.counts[name];
        let expected = [
            ("closed", every(|c| c.closed)),
            ("watertight", every(|c| c.watertight)),
            ("outward", every(|c| c.outward)),
            ("oriented", all.iter().all(|c| c.orientable)),
            ("manifold-edges", answer.nonmanifold_edges.is_empty()),
            (
                "manifold",
                answer.nonmanifold_edges.is_empty() && stars.nonmanifold_vertices.is_empty(),
            ),
            ("no-borders", count("border_edges") == 0),
            ("single", all.len() == 1),
            ("components=2", all.len() == 2),
            ("no-duplicates", stars.duplicate.is_empty()),
            ("no-degenerates", answer.degenerate.is_empty()),
            ("no-unreferenced", count("unreferenced_vertices") == 0),
            ("finite", count("nonfinite_vertices") == 0),
            ("border-loops=0", stars.measures["border_loops"] == 0),
            ("border-loops=1", stars.measures["border_loops"] == 1),
        ];
        let list: Vec<&str> = expected.iter().map(|(name, _)| *name).collect();
        let run = check(&folder, &list.join(","));
        let lines: Vec<&str> = run.stdout.lines().collect();
        assert_eq!(lines.len(), expected.len(), "{}: {run}", mesh.name);
        for ((name, met), line) in expected.iter().zip(lines) {
            let word = if *met { "passed" } else { "FAILED" };
            let begins = format!("{name}: {word}, ");
            assert!(line.starts_with(&begins), "{}: {begins}\n{run}", mesh.name);
            seen.entry((*name).to_owned()).or_default()[usize::from(*met)] += 1;
        }
        let all_met = expected.iter().all(|(_, met)| *met);
        assert_eq!(run.code == 0, all_met, "{run}");
    }
    for (name, [failed, passed]) in seen {
        assert!(
            failed > 0 && passed > 0,
            "{name}: {failed} failed, {passed} passed"
        );
    }
}

/// One line of `check` on one mesh.
#[track_caller]
fn says(mesh: &Mesh, requirement: &str, line: &str) {
    says_of(mesh, "outward", requirement, line);
}

#[track_caller]
fn says_of(mesh: &Mesh, orient: &str, requirement: &str, line: &str) {
    let dir = tempfile::tempdir().unwrap();
    let folder = built(mesh, dir.path(), orient);
    let run = check(&folder, requirement);
    assert_eq!(
        run.stdout,
        format!("{requirement}: {line}\n"),
        "{}",
        mesh.name
    );
    assert_eq!(run.code, i32::from(line.starts_with("FAILED")));
}

#[test]
fn each_line_says_why_and_where() {
    let tetrahedron = surfaces::tetrahedron();
    let disk = surfaces::disk(5);
    says(&tetrahedron, "closed", "passed, 1 of 1 component closed");
    let components = "first component: 0 (all in components.npy)";
    says(
        &disk,
        "closed",
        &format!("FAILED, 0 of 1 component closed; {components}"),
    );
    says(
        &disk,
        "watertight",
        &format!("FAILED, 0 of 1 component watertight; {components}"),
    );
    says(
        &disk,
        "outward",
        &format!("FAILED, 0 of 1 component turned outward; {components}"),
    );
    says(
        &disk,
        "no-borders",
        &format!("FAILED, 5 border edges; {components}"),
    );
    says(
        &disk,
        "smesh",
        &format!("FAILED, 0 of 1 component simple meshes; {components}"),
    );
    says(&disk, "border-loops=1", "passed, 1 border loop");
    says(&disk, "border-loops=0", "FAILED, 1 border loop");
    says(
        &tetrahedron,
        "smesh",
        "passed, 1 of 1 component simple meshes",
    );
    says(
        &tetrahedron,
        "genus=0",
        "passed, 1 of 1 component of genus 0",
    );
    let torus = surfaces::torus(5, 6).plus(&tetrahedron);
    says(
        &torus,
        "genus=0",
        &format!("FAILED, 1 of 2 components of genus 0; {components}"),
    );
    says(
        &torus,
        "genus=1",
        "FAILED, 1 of 2 components of genus 1; first component: 1 (all in components.npy)",
    );
    says(&torus, "single", "FAILED, 2 components");
    says(&torus, "components=2", "passed, 2 components");
    says(
        &surfaces::projective_plane(),
        "genus=1",
        "passed, 1 of 1 component of genus 1",
    );
    says(
        &surfaces::moebius(5),
        "oriented",
        &format!("FAILED, 1 component that cannot be oriented; {components}"),
    );
    says(
        &surfaces::fan_on_edge(3),
        "manifold-edges",
        "FAILED, 1 non-manifold edge; first edge: 0-1 (all in nonmanifold_edges.npy)",
    );
    let edge = "first edge: 0-1 (all in nonmanifold_edges.npy)";
    let ends = "first vertex: 0 1 (all in nonmanifold_vertices.npy)";
    says(
        &surfaces::fan_on_edge(3),
        "manifold",
        &format!("FAILED, 1 non-manifold edge, 2 non-manifold vertices; {edge}; {ends}"),
    );
    let mut twice = tetrahedron.clone();
    twice.triangles.extend([[0, 1, 2], [3, 3, 1], [2, 1, 0]]);
    twice.positions[3][1] = f32::NAN;
    twice.positions.extend([[0.; 3], [f32::INFINITY; 3]]);
    says(
        &twice,
        "no-duplicates",
        "FAILED, 2 duplicate triangles; first triangle: 4 6 (all in duplicate.npy)",
    );
    says(
        &twice,
        "no-degenerates",
        "FAILED, 1 degenerate triangle; first triangle: 5 (all in degenerate.npy)",
    );
    says(
        &twice,
        "finite",
        "FAILED, 2 non-finite vertices; first vertex: 3 5 (all in G.npy)",
    );
    says(&twice, "no-unreferenced", "FAILED, 2 unreferenced vertices");
}

#[test]
fn kept_orientation_is_judged_by_the_input() {
    let mut mesh = surfaces::octahedron();
    mesh.triangles[2].swap(0, 1);
    says(
        &mesh,
        "oriented",
        "passed, 0 components that cannot be oriented",
    );
    let (none, how) = (
        "0 components that cannot be oriented",
        "(built with --orient keep)",
    );
    says_of(
        &mesh,
        "keep",
        "oriented",
        &format!("FAILED, {none}, 3 edges whose triangles disagree {how}"),
    );
    says_of(
        &surfaces::octahedron(),
        "keep",
        "oriented",
        &format!("passed, {none}, 0 edges whose triangles disagree {how}"),
    );
}

#[test]
fn of_no_component_nothing_good_is_said() {
    let empty = Mesh::new("empty", vec![], vec![[1., 2., 3.]; 3]);
    for name in ["closed", "watertight", "outward", "smesh", "genus=0"] {
        let dir = tempfile::tempdir().unwrap();
        let run = check(&built(&empty, dir.path(), "outward"), name).expect(1);
        assert!(run.stdout.contains("0 of 0 components"), "{run}");
    }
    says(&empty, "components=0", "passed, 0 components");
    says(
        &empty,
        "manifold",
        "passed, 0 non-manifold edges, 0 non-manifold vertices",
    );
}

#[test]
fn only_the_first_culprits_are_named_and_all_are_counted() {
    let dir = tempfile::tempdir().unwrap();
    let folder = built(&surfaces::soup(20), dir.path(), "outward");
    let path = folder.to_str().unwrap();
    let run = cornermill(["check", path, "--require", "closed,single", "--json"]).expect(1);
    let said: Value = serde_json::from_str(&run.stdout).unwrap();
    let closed = &said["requirements"][0]["culprits"][0];
    assert_eq!(closed["total"], 20);
    assert_eq!(
        closed["first"],
        serde_json::json!([[0], [1], [2], [3], [4], [5], [6], [7]])
    );
    assert_eq!(said["passed"], false);
}

#[test]
fn what_cannot_be_told_is_refused_with_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("plain.ct");
    let mut mesh = by_hand::tetrahedron();
    mesh.g = None;
    mesh.write(&folder);
    let path = folder.to_str().unwrap();
    for list in [
        "manifold",
        "smesh",
        "no-duplicates",
        "genus=0",
        "border-loops=0",
        "single,manifold",
    ] {
        let run = cornermill(["check", path, "--require", list]).expect(3);
        assert!(run.stderr.contains("--no-measures"), "{run}");
        assert_eq!(run.stdout, "", "{run}");
    }
    let run = cornermill(["check", path, "--require", "finite"]).expect(3);
    assert!(run.stderr.contains("--positions"), "{run}");
    cornermill(["check", path, "--require", "single,manifold-edges"]).expect(0);
}

#[test]
fn unknown_requirements_are_usage_and_say_what_there_is() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("plain.ct");
    by_hand::tetrahedron().write(&folder);
    let path = folder.to_str().unwrap();
    for list in [
        "shut",
        "",
        "closed,,single",
        "genus",
        "genus=",
        "genus=x",
        "components=-1",
        "closed=1",
    ] {
        let run = cornermill(["check", path, "--require", list]).expect(2);
        for known in ["closed", "no-duplicates", "genus=N", "finite"] {
            assert!(run.stderr.contains(known), "{list}: {run}");
        }
    }
    cornermill(["check", path]).expect(2);
    cornermill(["check", path, "--require", " single , components=1"]).expect(0);
    let gone = dir.path().join("none.ct");
    cornermill(["check", gone.to_str().unwrap(), "--require", "single"]).expect(3);
}

#[test]
fn reports_of_measured_folders_keep_their_schemas() {
    let schema = |name: &str| -> Value {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("docs/schema")
            .join(name);
        serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
    };
    let every = "closed,watertight,manifold,manifold-edges,no-borders,oriented,outward,single,smesh,\
                 no-duplicates,no-degenerates,no-unreferenced,finite,components=1,genus=0,border-loops=0";
    for mesh in zoo::all().into_iter().step_by(4) {
        let dir = tempfile::tempdir().unwrap();
        let path = built(&mesh, dir.path(), "outward");
        let opened = Folder::open(&path, &Arc::new(Counters::default())).unwrap();
        let report = report::gather(&opened, None).unwrap();
        let told = serde_json::to_value(&report).unwrap();
        assert_eq!(faults(&schema("build.json"), &told), Vec::<String>::new());
        let measures = &told["measures"];
        assert!(measures.is_object());
        let first = &told["culprits"]["nonmanifold_vertices"];
        let count = measures["nonmanifold_vertices"].as_u64().unwrap();
        assert_eq!(first.as_array().unwrap().len() as u64, count.min(8));
        let text = report::render(&report);
        assert_eq!(
            text.contains("first non-manifold vertices: "),
            count > 0,
            "{text}"
        );
        assert!(text.contains("border loops  "), "{text}");
        let name = path.to_str().unwrap();
        let runs = [
            ("info.json", cornermill(["info", name, "--json"])),
            (
                "check.json",
                cornermill(["check", name, "--json", "--require", every]),
            ),
        ];
        for (file, run) in runs {
            let said: Value = serde_json::from_str(&run.stdout).unwrap();
            assert_eq!(faults(&schema(file), &said), Vec::<String>::new(), "{run}");
        }
    }
}
