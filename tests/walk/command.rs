//! `cornermill path` and `cornermill swirl` as a user runs them.

use super::Home;
use super::common::run::{Run, cornermill};
use super::common::{readers, surfaces};
use serde_json::Value;
use std::ffi::OsString;

fn run(home: &Home, args: &[&str]) -> Run {
    let mut all: Vec<OsString> = vec![args[0].into(), home.path.clone().into()];
    all.extend(args[1..].iter().map(OsString::from));
    cornermill(all)
}

fn json(run: &Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}: {run}"))
}

#[test]
fn a_path_is_listed_as_text_and_as_json() {
    let home = Home::of(&surfaces::torus(6, 7), false);
    let said = run(&home, &["path", "--from", "3", "--to", "200"]).expect(0);
    let told = json(&run(&home, &["path", "--from", "3", "--to", "200", "--json"]).expect(0));
    let corners = told["corners"].as_array().unwrap();
    assert_eq!(told["triangles"], corners.len());
    assert_eq!(told["found"], true);
    assert_eq!(told["to_component"], 0);
    let lines: Vec<&str> = said.stdout.lines().skip(2).collect();
    assert_eq!(lines.len(), corners.len());
    for (line, corner) in lines.iter().zip(corners) {
        let words: Vec<u64> = line
            .split_whitespace()
            .map(|w| w.parse().unwrap())
            .collect();
        let t = words[1] as usize;
        assert_eq!((words[0] / 3, t as u64), (words[1], words[1]));
        assert_eq!(words[2..], home.naive.v[3 * t..3 * t + 3]);
        assert_eq!(
            (corner["corner"].as_u64(), corner["triangle"].as_u64()),
            (Some(words[0]), Some(words[1]))
        );
        assert_eq!(corner["vertices"].as_array().unwrap().len(), 3);
    }
    assert_eq!(corners[corners.len() - 1]["corner"], 200);
    // Budgets and threads change nothing.
    let args = [
        "path",
        "--from",
        "3",
        "--to",
        "200",
        "--memory",
        "16KiB",
        "--threads",
        "1",
    ];
    assert_eq!(run(&home, &args).expect(0).stdout, said.stdout);
}

#[test]
fn no_path_is_exit_code_1_and_says_why() {
    let home = Home::of(
        &surfaces::tetrahedron().plus(&surfaces::octahedron()),
        false,
    );
    let said = run(&home, &["path", "--from", "3", "--to", "20"]).expect(1);
    assert_eq!(
        said.stdout,
        "no path: corner 3 is in component 0, corner 20 is in component 1\n"
    );
    let told = json(&run(&home, &["path", "--from", "3", "--to", "20", "--json"]).expect(1));
    assert_eq!(
        (
            &told["found"],
            &told["from_component"],
            &told["to_component"]
        ),
        (&false.into(), &0.into(), &1.into())
    );
    assert!(told["corners"].as_array().unwrap().is_empty());
    let lost = run(&home, &["path", "--from", "3", "--to", "36"]).expect(2);
    assert!(lost.stderr.contains("0 to 35"), "{lost}");
    run(&home, &["path", "--from", "3"]).expect(2);
    let small = run(
        &home,
        &["path", "--from", "3", "--to", "9", "--memory", "5KiB"],
    )
    .expect(5);
    assert!(small.stderr.contains("--memory 9KiB"), "{small}");
}

#[test]
fn a_path_is_written_as_a_strip_in_every_format() {
    let home = Home::of(&surfaces::torus(6, 7), false);
    let ends = ["path", "--from", "3", "--to", "200"];
    let told = json(&run(&home, &[&ends[..], &["--json"]].concat()).expect(0));
    let corners = told["corners"].as_array().unwrap();
    let listed: Vec<usize> = corners
        .iter()
        .map(|c| c["triangle"].as_u64().unwrap() as usize)
        .collect();
    let g = surfaces::torus(6, 7).positions;
    let spots = |t: usize| [0, 1, 2].map(|k| g[home.naive.v[3 * t + k] as usize]);
    let expected: Vec<[[f32; 3]; 3]> = listed.iter().map(|&t| spots(t)).collect();
    for name in ["strip.ply", "strip.obj", "strip.off", "strip.stl"] {
        let out = home.dir.path().join(name);
        let to = out.to_str().unwrap();
        let said = run(
            &home,
            &[&ends[..], &["-o", to, "--memory", "1MiB"]].concat(),
        )
        .expect(0);
        assert!(said.stdout.contains(to), "{said}");
        let mesh = readers::read(&out);
        let spot = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize]);
        let found: Vec<_> = mesh.triangles.iter().map(spot).collect();
        assert_eq!(found, expected, "{name}");
        if name != "strip.stl" {
            let used: std::collections::BTreeSet<_> =
                mesh.triangles.as_flattened().iter().collect();
            assert_eq!(
                used.len(),
                mesh.positions.len(),
                "{name}: vertices that nothing names"
            );
        }
        run(&home, &[&ends[..], &["-o", to]].concat()).expect(2);
        let again = run(
            &home,
            &[&ends[..], &["-o", to, "--force", "--json"]].concat(),
        )
        .expect(0);
        assert_eq!(json(&again)["exported"]["files"][0], to);
    }
    run(
        &home,
        &[&ends[..], &["-o", "-", "--format", "ply"]].concat(),
    )
    .expect(2);
    run(&home, &[&ends[..], &["-o", "strip.what"]].concat()).expect(2);
    run(&home, &[&ends[..], &["--ascii"]].concat()).expect(2);
}

#[test]
fn a_swirl_is_listed_as_text_and_as_json() {
    let home = Home::of(&surfaces::octahedron(), false);
    let said = run(&home, &["swirl", "--from", "0"]).expect(0);
    let letters: String = said
        .stdout
        .lines()
        .skip(1)
        .take(8)
        .map(|l| &l[..1])
        .collect();
    assert_eq!(letters, "CCCRCRRE", "{said}");
    assert!(
        said.stdout
            .contains("all of them: C 4, L 0, E 1, R 3, S 0; 0 forks joined"),
        "{said}"
    );
    let told = json(&run(&home, &["swirl", "--from", "0", "--json"]).expect(0));
    assert_eq!(
        (&told["triangles"], &told["complete"]),
        (&8.into(), &true.into())
    );
    assert_eq!(told["walk"].as_array().unwrap().len(), 8);
    assert_eq!(told["letters"]["C"], 4);
}

#[test]
fn the_limit_is_kept_and_told() {
    let home = Home::of(&surfaces::torus(5, 5), false);
    let whole = run(&home, &["swirl", "--from", "11"]).expect(0).stdout;
    let triangles = |text: &str| {
        text.lines()
            .filter(|l| l.starts_with(['C', 'L', 'E', 'R', 'S']))
            .count()
    };
    assert_eq!(triangles(&whole), 50);
    for limit in [0, 1, 7, 49, 50, 51, 1000] {
        let part = run(
            &home,
            &["swirl", "--from", "11", "--limit", &limit.to_string()],
        )
        .expect(0);
        let shown = limit.min(50);
        assert_eq!(triangles(&part.stdout), shown, "{part}");
        let rows = |text: &str, n: usize| {
            text.lines()
                .take(n + 1)
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        assert_eq!(
            rows(&part.stdout, shown.min(10)),
            rows(&whole, shown.min(10))
        );
        let all = part.stdout.contains("all of them");
        assert_eq!(all, limit >= 50, "{part}");
    }
}
