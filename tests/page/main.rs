//! The page of a folder: well-formed, leading nowhere else, its values those of the manifest; and,
//! where the machine has a Chromium, looked at as a browser shows it.

#[path = "../common/mod.rs"]
mod common;

mod browser;
mod html;

use common::mesh::Mesh;
use common::run::cornermill;
use common::{formats, surfaces};
use html::Element;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// A folder, and its page.
struct Made {
    dir: tempfile::TempDir,
    page: PathBuf,
    text: String,
    manifest: Value,
}

/// Builds a mesh into a folder of this name, and writes its page.
fn made(mesh: &Mesh, name: &str, positions: bool, more: &[&str]) -> Made {
    built(mesh, name, positions, &[], more)
}

/// The same of a folder that is built with options.
fn built(mesh: &Mesh, name: &str, positions: bool, options: &[&str], more: &[&str]) -> Made {
    let dir = tempfile::tempdir().unwrap();
    let (v, g) = formats::write_npy(mesh, dir.path());
    let folder = dir.path().join(name);
    let json = dir.path().join("build.json");
    let mut args = vec![
        "build".into(),
        v.into_os_string(),
        "-o".into(),
        folder.clone().into(),
    ];
    args.extend(["--quiet", "--memory", "64MiB"].map(Into::into));
    args.extend(options.iter().map(Into::into));
    args.push(format!("--json={}", json.display()).into());
    if positions {
        args.extend(["--positions".into(), g.into_os_string()]);
    }
    cornermill(args).expect(0);
    let page = dir.path().join("page.html");
    let mut args = vec![
        "report".into(),
        folder.clone().into_os_string(),
        "-o".into(),
    ];
    args.extend([page.clone().into(), "--build".into(), json.into_os_string()]);
    args.extend(["--size", "240", "--memory", "64MiB"].map(Into::into));
    args.extend(more.iter().map(Into::into));
    cornermill(args).expect(0);
    let manifest = std::fs::read(folder.join("manifest.json")).unwrap();
    Made {
        text: std::fs::read_to_string(&page).unwrap(),
        page,
        manifest: serde_json::from_slice(&manifest).unwrap(),
        dir,
    }
}

/// A mesh with something of everything.
fn flawed() -> Mesh {
    let mut mesh = surfaces::moebius(20)
        .plus(&surfaces::cube().moved([4.0, 0.0, 0.0]))
        .plus(&surfaces::fan_on_edge(5).moved([0.0, 4.0, 0.0]))
        .plus(&surfaces::torus(12, 8).moved([8.0, 4.0, 0.0]));
    // A triangle of the torus twice: its edges have three corners then.
    mesh.triangles.extend(mesh.triangles.last().copied());
    mesh.triangles.push([0, 0, 1]);
    mesh
}

/// All elements of a page, which must be well-formed.
fn parsed(made: &Made) -> Element {
    html::parse(&made.text).unwrap_or_else(|e| panic!("{e}"))
}

/// The number in the cell beside a row's head.
fn cell(page: &Element, head: &str) -> Option<u64> {
    let rows = page.all(|e| e.name == "tr");
    let row = rows.iter().find(|row| {
        row.all(|e| e.name == "th")
            .first()
            .is_some_and(|th| th.text() == head)
    })?;
    let data = row.all(|e| e.name == "td" || e.name == "data");
    data.iter().find_map(|e| e.attribute("value")?.parse().ok())
}

#[test]
fn pages_are_well_formed_and_lead_nowhere() {
    let name = "a <b> & \"c\" 'd'.ct";
    for (mesh, positions) in [
        (flawed(), true),
        (flawed(), false),
        (surfaces::torus(9, 7), true),
        (Mesh::new("empty", vec![], vec![]), true),
    ] {
        let made = made(&mesh, name, positions, &[]);
        let page = parsed(&made);
        let ids: Vec<String> = page
            .all(|_| true)
            .iter()
            .filter_map(|e| e.attribute("id"))
            .collect();
        for (i, id) in ids.iter().enumerate() {
            assert!(!ids[..i].contains(id), "{id} twice");
        }
        for element in page.all(|_| true) {
            for (key, value) in &element.attributes {
                assert!(!key.starts_with("on"), "{key}");
                match key.as_str() {
                    "href" if value == "data:," => {}
                    "href" => {
                        let to = value.strip_prefix('#').expect("a place on the page");
                        assert!(ids.iter().any(|id| id == to), "{value} leads nowhere");
                    }
                    "src" => assert!(value.starts_with("data:image/png;base64,"), "{value}"),
                    "aria-labelledby" => {
                        let known = |id| ids.iter().any(|known| known == id);
                        assert!(value.split(' ').all(known), "{value}");
                    }
                    _ => {}
                }
            }
        }
        for word in ["http", "url(", "@import", "<script", "<iframe", "<object"] {
            assert!(!made.text.contains(word), "{word}");
        }
        let title = &page.all(|e| e.name == "title")[0];
        assert_eq!(title.text(), format!("{name}: mesh report"));
        let pictures = page.all(|e| e.name == "img");
        let drawn = positions && !mesh.triangles.is_empty();
        assert_eq!(pictures.len(), if drawn { 6 } else { 0 });
        assert!(
            pictures
                .iter()
                .all(|p| p.attribute("alt").is_some_and(|a| !a.is_empty()))
        );
        let mut left = std::fs::read_dir(made.dir.path()).unwrap();
        let hidden = |name: std::ffi::OsString| name.to_string_lossy().starts_with(".cornermill");
        assert!(!left.any(|entry| hidden(entry.unwrap().file_name())));
    }
}

#[test]
fn every_value_is_the_manifests() {
    let made = made(&flawed(), "m.ct", true, &["--no-pictures"]);
    let page = parsed(&made);
    let counts = made.manifest["counts"].as_object().unwrap();
    assert!(counts.len() > 15);
    for (key, value) in counts {
        assert_eq!(cell(&page, &key.replace('_', " ")), value.as_u64(), "{key}");
    }
    for file in made.manifest["files"].as_array().unwrap() {
        let name = file["name"].as_str().unwrap();
        assert_eq!(cell(&page, name), file["bytes"].as_u64(), "{name}");
    }
    let build: Value =
        serde_json::from_slice(&std::fs::read(made.dir.path().join("build.json")).unwrap())
            .unwrap();
    for pass in build["build"]["passes"].as_array().unwrap() {
        let name = pass["name"].as_str().unwrap();
        assert!(cell(&page, name).is_some(), "{name}");
    }
    assert!(page.all(|e| e.name == "img").is_empty());
}

#[test]
fn verdicts_come_first_and_say_where() {
    let word = |page: &Element, key: &str| {
        let id = format!("verdict-{key}");
        let cards = page.all(|e| e.attribute("id").as_deref() == Some(&id));
        let card = cards.first().unwrap_or_else(|| panic!("no {id}"));
        let linked = !card.all(|e| e.name == "a").is_empty();
        let class = card.attribute("class").unwrap();
        let word = card.all(|e| e.attribute("class").as_deref() == Some("word"))[0].text();
        (class, word, linked)
    };
    let bad = parsed(&made(&flawed(), "m.ct", true, &["--no-pictures"]));
    for key in ["closed", "oriented", "manifold", "watertight", "clean"] {
        let (class, said, linked) = word(&bad, key);
        assert_eq!(
            (class.as_str(), said.as_str(), linked),
            ("bad", "✗ no", true),
            "{key}"
        );
    }
    let good = parsed(&made(&surfaces::cube(), "m.ct", true, &["--no-pictures"]));
    for key in ["closed", "oriented", "manifold", "watertight", "clean"] {
        let (class, said, linked) = word(&good, key);
        assert_eq!(
            (class.as_str(), said.as_str(), linked),
            ("good", "✓ yes", false),
            "{key}"
        );
    }
    // What was not measured is neither good nor bad; what is bad without it stays so.
    let bare = |mesh: &Mesh| {
        let options = ["--no-measures"];
        parsed(&built(mesh, "m.ct", true, &options, &["--no-pictures"]))
    };
    for key in ["manifold", "clean"] {
        let (class, said, _) = word(&bare(&surfaces::cube()), key);
        assert_eq!((class.as_str(), said.as_str()), ("note", "not measured"));
        assert_eq!(word(&bare(&flawed()), key).0, "bad");
    }
    // Kept as they were, two triangles of the cube disagree with their neighbours.
    let mut turned = surfaces::cube();
    turned.triangles[3].swap(0, 1);
    let options = ["--orient", "keep"];
    let kept = parsed(&built(&turned, "m.ct", true, &options, &["--no-pictures"]));
    assert_eq!(word(&kept, "oriented").1, "✗ no");
    assert_eq!(word(&good, "pieces").1, "1");
    let sections = good.all(|e| e.name == "section");
    assert_eq!(
        sections[0].attribute("aria-labelledby").as_deref(),
        Some("verdicts")
    );
    assert!(good.text().contains("There are none."));
}

#[test]
fn culprits_are_named_with_their_place() {
    let mesh = flawed();
    let page = parsed(&made(&mesh, "m.ct", true, &["--no-pictures"]));
    let tables = page.all(|e| e.name == "table");
    let find = |start: &str| {
        let of = |t: &&Element| t.all(|e| e.name == "caption")[0].text().starts_with(start);
        tables.iter().copied().find(of)
    };
    // The degenerate triangle, and where its first vertex lies.
    let table = find("Degenerate triangles: all 1")
        .expect("a table of them")
        .text();
    let p = mesh.positions[0].map(|x| x.to_string());
    assert!(table.contains(&p.join(", ")), "{table} {p:?}");
    let table = find("Non-manifold edges").expect("a table of them");
    let rows = table.all(|e| e.name == "tr");
    let first = rows[1].all(|e| e.name == "td");
    assert!(first[0].attribute("value").is_none() && first.len() == 4);
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let one = made(&surfaces::cube(), "m.ct", true, &["--no-pictures"]);
    let other = made(&surfaces::octahedron(), "m.ct", true, &["--no-pictures"]);
    let run = |more: &[&Path]| {
        let folder = one.dir.path().join("m.ct");
        let start = [Path::new("report"), &folder, Path::new("-o"), &one.page];
        let all: Vec<&Path> = start.into_iter().chain(more.iter().copied()).collect();
        cornermill(all)
    };
    let refused = run(&[]).expect(2);
    assert!(refused.stderr.contains("--force"), "{refused}");
    let json = other.dir.path().join("build.json");
    let (force, build) = (Path::new("--force"), Path::new("--build"));
    let refused = run(&[force, build, &json]).expect(3);
    assert!(refused.stderr.contains("of 8 triangles"), "{refused}");
    let manifest = one.dir.path().join("m.ct/manifest.json");
    run(&[force, build, &manifest]).expect(3);
    run(&[force, build, Path::new("/nowhere.json")]).expect(4);
    assert_eq!(std::fs::read_to_string(&one.page).unwrap(), one.text);
    run(&[force, Path::new("--size"), Path::new("0")]).expect(2);
    let small = run(&[force, Path::new("--memory"), Path::new("1MiB")]).expect(5);
    assert!(small.stderr.contains("--memory"), "{small}");
}
