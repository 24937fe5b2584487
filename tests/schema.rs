//! What every command prints as JSON is as its schema in `docs/schema` says, key for key, and
//! `docs/report.md` names each of them.

mod common;

use common::formats::write_npy;
use common::random::Random;
use common::run::{Run, cornermill};
use common::schema::faults;
use common::zoo;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

const COMMANDS: [&str; 7] = [
    "build", "dry-run", "info", "verify", "check", "path", "swirl",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn schema(command: &str) -> Value {
    let path = root().join(format!("docs/schema/{command}.json"));
    let text = fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_slice(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A run of the program, whose output must be JSON, and the schema that it must keep.
fn told(command: &str, args: &[OsString]) -> (Value, Run) {
    let run = cornermill(args);
    let value: Value = serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}: {run}"));
    let wrong = faults(&schema(command), &value);
    assert!(wrong.is_empty(), "{run}\n{}", wrong.join("\n"));
    (value, run)
}

fn args(words: &[&str], paths: &[&Path], more: &[&str]) -> Vec<OsString> {
    let mut all: Vec<OsString> = words.iter().map(OsString::from).collect();
    all.extend(paths.iter().map(OsString::from));
    all.extend(more.iter().map(OsString::from));
    all
}

/// Runs every command on a mesh; gives what each said, by command.
fn all_of(input: &[&Path], dir: &Path, options: &[&str]) -> Vec<(&'static str, Value)> {
    let out = dir.join("out.ct");
    let mut said = Vec::new();
    let output = [
        "-o",
        out.to_str().unwrap(),
        "--json",
        "--quiet",
        "--memory",
        "64MiB",
    ];
    let mut building = output.to_vec();
    building.extend(options);
    let mut dry = building.clone();
    dry.push("--dry-run");
    said.push(("dry-run", told("dry-run", &args(&["build"], input, &dry)).0));
    said.push((
        "build",
        told("build", &args(&["build"], input, &building)).0,
    ));
    said.push((
        "info",
        told("info", &args(&["info"], &[&out], &["--json"])).0,
    ));
    said.push((
        "verify",
        told("verify", &args(&["verify"], &[&out], &["--json"])).0,
    ));
    let plain = "closed,watertight,manifold-edges,no-borders,oriented,outward,single,\
                 no-degenerates,no-unreferenced,components=2";
    let measured = "manifold,smesh,no-duplicates,genus=0,border-loops=0";
    let has_measures = !said[1].1["measures"].is_null();
    for list in [Some(plain), has_measures.then_some(measured)]
        .into_iter()
        .flatten()
    {
        let asked = args(&["check"], &[&out], &["--json", "--require", list]);
        said.push(("check", told("check", &asked).0));
    }
    let corners = 3 * said[1].1["counts"]["triangles"].as_u64().unwrap();
    if corners > 0 {
        let mut random = Random::new(corners);
        for _ in 0..3 {
            let [from, to] = [0; 2].map(|_| random.below(corners as usize).to_string());
            let ends = ["--from", &from, "--to", &to, "--json"];
            said.push(("path", told("path", &args(&["path"], &[&out], &ends)).0));
            let from = ["--from", &from, "--json", "--limit", "40"];
            said.push(("swirl", told("swirl", &args(&["swirl"], &[&out], &from)).0));
        }
    }
    said
}

#[test]
fn every_output_keeps_its_schema_on_the_zoo() {
    let (mut paths, mut findings) = ([0, 0], 0);
    let meshes = zoo::all()
        .into_iter()
        .step_by(3)
        .chain((0..10).map(zoo::random));
    for (i, mesh) in meshes.enumerate() {
        let dir = tempfile::tempdir().unwrap();
        let (v, g) = write_npy(&mesh, dir.path());
        let g = g.to_str().unwrap();
        let more: &[&str] = match i % 4 {
            0 => &[],
            1 => &["--positions", g],
            2 => &["--positions", g, "--index", "u8"],
            _ => &["--positions", g, "--orient", "keep"],
        };
        let said = all_of(&[&v], dir.path(), more);
        for (command, value) in &said {
            if *command == "path" {
                paths[usize::from(value["found"] == true)] += 1;
            }
        }
        if i % 5 == 0 && !mesh.triangles.is_empty() {
            // A folder with something wrong.
            let o = dir.path().join("out.ct/O.npy");
            let mut bytes = fs::read(&o).unwrap();
            bytes[4096] ^= 1;
            fs::write(&o, bytes).unwrap();
            let wrong = args(&["verify"], &[&dir.path().join("out.ct")], &["--json"]);
            let (value, run) = told("verify", &wrong);
            assert_eq!((run.code, &value["right"]), (1, &json!(false)));
            findings += value["findings"].as_array().unwrap().len();
        }
    }
    assert!(
        paths[0] > 5 && paths[1] > 5,
        "{paths:?} without and with a path"
    );
    assert!(findings > 5, "{findings} findings");
}

#[test]
fn every_output_keeps_its_schema_on_meshes_from_outside() {
    let names = [
        "hostile_assimp_BSD3/Wuson.ply",
        "hostile_assimp_BSD3/Spider_ascii.stl",
        "hostile_assimp_BSD3/concave_polygon.obj",
        "hostile_assimp_BSD3/Cube.off",
        "hostile_happly_MIT/platonic_shelf.ply",
        "geometrycentral_MIT/lego.ply",
        "geometrycentral_MIT/fan3.obj",
        "geometrycentral_MIT/triple_vierbein.obj",
        "trimesh_MIT/featuretype.STL",
    ];
    for name in names {
        let dir = tempfile::tempdir().unwrap();
        let mesh = root().join("tests/meshes").join(name);
        all_of(&[&mesh], dir.path(), &[]);
        let out: PathBuf = dir.path().join("out.ct");
        let strip = dir.path().join("strip.ply");
        let to = [
            "--from",
            "0",
            "--to",
            "2",
            "--json",
            "-o",
            strip.to_str().unwrap(),
        ];
        let (value, _) = told("path", &args(&["path"], &[&out], &to));
        assert_eq!(value["exported"]["files"][0], strip.to_str().unwrap());
        told(
            "check",
            &args(&["check"], &[&out], &["--require", "finite", "--json"]),
        );
    }
}

/// Calls `f` with each object in a value.
fn each_object(value: &Value, path: &mut Vec<Value>, f: &mut dyn FnMut(&[Value])) {
    match value {
        Value::Object(keys) => {
            f(path);
            for (key, inside) in keys {
                path.push(json!(key));
                each_object(inside, path, f);
                path.pop();
            }
        }
        Value::Array(items) => {
            for (i, inside) in items.iter().enumerate() {
                path.push(json!(i));
                each_object(inside, path, f);
                path.pop();
            }
        }
        _ => {}
    }
}

fn at<'a>(value: &'a mut Value, path: &[Value]) -> &'a mut Value {
    path.iter().fold(value, |value, step| match step {
        Value::String(key) => &mut value[key],
        index => &mut value[index.as_u64().unwrap() as usize],
    })
}

#[test]
fn a_key_more_or_less_anywhere_is_noticed() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = root().join("tests/meshes/geometrycentral_MIT/fan3.obj");
    let said = all_of(&[&mesh], dir.path(), &[]);
    let mut tried = 0;
    for (command, value) in &said {
        let schema = schema(command);
        let mut places = Vec::new();
        each_object(value, &mut Vec::new(), &mut |path| {
            places.push(path.to_vec())
        });
        for place in &places {
            let mut more = value.clone();
            at(&mut more, place)["surprise"] = json!(1);
            let found = faults(&schema, &more);
            assert_eq!(found.len(), 1, "{command} {place:?}: {found:?}");
            let keys: Vec<String> = at(&mut more, place)
                .as_object()
                .unwrap()
                .keys()
                .cloned()
                .collect();
            // Of a swirl, what a triangle and a joined fork have differs.
            let optional = *command == "swirl" && place.len() == 2 && place[0] == json!("walk");
            for key in keys.iter().filter(|key| *key != "surprise" && !optional) {
                let mut less = value.clone();
                at(&mut less, place).as_object_mut().unwrap().remove(key);
                assert!(
                    !faults(&schema, &less).is_empty(),
                    "{command} {place:?} {key}"
                );
                tried += 1;
            }
        }
    }
    assert!(tried > 200, "{tried} keys");
}

/// Every object in a schema, and every property.
fn each_property(schema: &Value, f: &mut dyn FnMut(&str, &Value)) {
    if let Value::Object(rules) = schema {
        if let Some(Value::Object(properties)) = rules.get("properties") {
            assert_eq!(
                rules.get("additionalProperties"),
                Some(&json!(false)),
                "{schema}"
            );
            properties.iter().for_each(|(name, rule)| f(name, rule));
        }
        rules.values().for_each(|inside| each_property(inside, f));
    }
}

#[test]
fn the_documentation_names_every_key() {
    let text = fs::read_to_string(root().join("docs/report.md")).expect("docs/report.md");
    let mut missing = Vec::new();
    for command in COMMANDS {
        assert!(
            text.contains(&format!("schema/{command}.json")),
            "{command}"
        );
        each_property(&schema(command), &mut |name, rule| {
            let said = rule.get("description").is_some() || rule.get("$ref").is_some();
            assert!(said, "{command}: {name} has no description");
            if !text.contains(&format!("`{name}`")) {
                missing.push(format!("{command}: {name}"));
            }
        });
    }
    assert!(missing.is_empty(), "not in docs/report.md: {missing:#?}");
}

#[test]
fn the_validator_refuses_what_it_should() {
    let schema = json!({
        "type": "object",
        "properties": {
            "n": { "type": "integer", "minimum": 3 },
            "word": { "type": ["string", "null"], "enum": ["a", "b", null] },
            "list": { "type": "array", "items": { "$ref": "#/$defs/x" } },
            "x": { "type": "number" },
            "yes": { "type": "boolean" },
        },
        "required": ["n"],
        "additionalProperties": false,
        "$defs": { "x": { "type": "object", "additionalProperties": { "type": "integer" } } },
    });
    let good = [
        json!({ "n": 3 }),
        json!({ "n": u64::MAX, "word": null, "list": [{}, { "k": -1 }], "x": 1, "yes": true }),
        json!({ "n": 4, "word": "b", "list": [], "x": -1.5 }),
    ];
    for value in good {
        assert_eq!(faults(&schema, &value), Vec::<String>::new(), "{value}");
    }
    let bad = [
        json!(null),
        json!([]),
        json!({}),
        json!({ "n": 2 }),
        json!({ "n": 3.5 }),
        json!({ "n": "3" }),
        json!({ "n": null }),
        json!({ "n": 3, "word": "c" }),
        json!({ "n": 3, "word": 1 }),
        json!({ "n": 3, "list": {} }),
        json!({ "n": 3, "list": [1] }),
        json!({ "n": 3, "list": [{}, { "k": 1.5 }] }),
        json!({ "n": 3, "x": true }),
        json!({ "n": 3, "yes": 0 }),
        json!({ "n": 3, "other": 1 }),
    ];
    for value in bad {
        assert_eq!(faults(&schema, &value).len(), 1, "{value}");
    }
    // A schema that says what is not understood holds nothing.
    for schema in [
        json!({ "maximum": 3 }),
        json!({ "$ref": "#/$defs/nowhere" }),
        json!({ "type": "text" }),
        json!(true),
    ] {
        assert!(!faults(&schema, &json!(1)).is_empty(), "{schema}");
    }
}
