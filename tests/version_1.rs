//! Folders and compressed files that format version 1 wrote. They must open, pass `verify` and say
//! what they said, for ever; and as long as version 1 is what is written, the same input must
//! give the same bytes.

use cornermill::CornerTable;
use cornermill::build::{Builder, IndexChoice};
use cornermill::codec::decode::decode;
use cornermill::codec::packed::Packed;
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::{self, Folder, Manifest, Orient, VERSION};
use cornermill::input::CoordKind;
use cornermill::verify::{Limits, verify};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn stored(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join("tests/fixtures/v1").join(name)
}

fn workspace(dir: &Path) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(16 << 20),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io).unwrap(),
        io,
        workers: Workers::new(2).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

/// Changes the options of a build.
type Change = fn(Builder) -> Builder;

/// Each folder, the input that it was built from, and how.
const FOLDERS: [(&str, &str, Change); 4] = [
    ("u4", "mesh.obj", |b| b),
    ("u8", "mesh.obj", |b| {
        let b = b.index(IndexChoice::U8).coords(CoordKind::F8);
        b.orient(Orient::Majority)
    }),
    ("bare", "mesh.obj", |b| {
        b.measures(false).orient(Orient::Keep)
    }),
    ("alone", "V.npy", |b| b.orient(Orient::First)),
];

#[test]
fn folders_of_version_1_open_and_pass() {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(dir.path());
    for (name, _, _) in FOLDERS {
        let path = stored(name);
        let manifest = Folder::open(&path, &ws.io).unwrap().manifest().clone();
        assert_eq!(manifest.version, 1);
        let counts = &manifest.counts;
        // The last vertex is in no triangle, so only G tells of it.
        let vertices = if name == "alone" { 52 } else { 53 };
        assert_eq!(
            (counts.triangles, counts.vertices),
            (79, vertices),
            "{name}"
        );
        assert_eq!(
            (counts.components, counts.components_joined),
            (8, 6),
            "{name}"
        );
        let edges = [
            counts.regular_edges,
            counts.border_edges,
            counts.nonmanifold_edges,
        ];
        assert_eq!(edges, [106, 19, 1], "{name}");
        let verdict = verify(&ws, &path, Limits::default()).unwrap();
        assert!(verdict.ok(), "{name}: {:?}", verdict.findings);
        let table = CornerTable::open(&path).unwrap();
        table.check_bounds(&path).unwrap();
        let c = table.corner(0).unwrap();
        assert_eq!(table.o(table.o(c).unwrap()), Some(c), "{name}");
    }
}

#[test]
fn the_same_input_gives_the_same_folder_as_ever() {
    assert_eq!(
        VERSION, 1,
        "keep these folders readable, and store new ones beside them"
    );
    for (name, input, change) in FOLDERS {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("now.ct");
        let builder = Builder::new(stored(input)).memory(16 << 20).threads(2);
        change(builder).build(&out).unwrap();
        let mut names: Vec<_> = std::fs::read_dir(stored(name))
            .unwrap()
            .map(|item| item.unwrap().file_name())
            .collect();
        names.sort();
        for file in &names {
            let (now, then) = (out.join(file), stored(name).join(file));
            let same = std::fs::read(now).unwrap() == std::fs::read(then).unwrap();
            assert!(same, "{name}: {file:?} is not what version 1 wrote");
        }
        assert_eq!(std::fs::read_dir(&out).unwrap().count(), names.len());
    }
}

#[test]
fn compressed_files_of_version_1_decode() {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(dir.path());
    for name in ["fast.cmz", "strong.cmz"] {
        let packed = Packed::open(&ws.budget, &ws.io, &stored(name)).unwrap();
        let at = |part: &str| dir.path().join(format!("{name}.{part}.npy"));
        let count = decode(&ws, &packed, &at("V"), &at("G")).unwrap();
        assert_eq!((count.triangles, count.vertices), (79, 53));
        // The same surface: its counts do not depend on the order of triangles and vertices.
        let out = dir.path().join(format!("{name}.ct"));
        let builder = Builder::new(at("V")).positions(at("G")).memory(16 << 20);
        let now = builder.threads(1).build(&out).unwrap().manifest;
        let then = Manifest::read(&stored("u4")).unwrap();
        let told = |m: &Manifest| {
            let c = &m.counts;
            [
                c.regular_edges,
                c.border_edges,
                c.nonmanifold_edges,
                c.components,
                c.degenerate,
            ]
        };
        assert_eq!(told(&now), told(&then), "{name}");
        assert_eq!(
            now.measures.unwrap().fans,
            then.measures.unwrap().fans,
            "{name}"
        );
    }
}

/// Copies a stored folder, with its manifest changed as text.
fn with_manifest(change: impl Fn(String) -> String) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for item in std::fs::read_dir(stored("u4")).unwrap() {
        let item = item.unwrap();
        std::fs::copy(item.path(), dir.path().join(item.file_name())).unwrap();
    }
    let path = dir.path().join(folder::MANIFEST);
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, change(text)).unwrap();
    dir
}

#[test]
fn newer_versions_are_refused_with_advice() {
    let newer = |text: String| text.replace("\"version\": 1,", "\"version\": 2,\n  \"new\": {},");
    let unknown = |text: String| newer(text).replace("\"counts\"", "\"numbers\"");
    for dir in [with_manifest(newer), with_manifest(unknown)] {
        let error = CornerTable::open(dir.path()).unwrap_err().to_string();
        assert!(
            error.contains("version 2") && error.contains("newer"),
            "{error}"
        );
        assert!(error.contains("use the program that wrote it"), "{error}");
    }
}

/// What the manifest names may lie elsewhere, or be a pipe, which would wait for its writer.
#[test]
fn opening_looks_at_plain_files_alone() {
    for name in ["../V.npy", "/dev/zero", "", "..", "a/b"] {
        let dir = with_manifest(|text| {
            let mut manifest: Manifest = serde_json::from_str(&text).unwrap();
            manifest.files[0].name = name.into();
            manifest.to_text()
        });
        let error = CornerTable::open(dir.path()).unwrap_err().to_string();
        assert!(error.contains("plain names of files"), "{name}: {error}");
    }
    let io = tempfile::tempdir().unwrap();
    let ws = workspace(io.path());
    for name in ["O.npy", folder::MANIFEST] {
        let dir = with_manifest(|text| text);
        let path = dir.path().join(name);
        std::fs::remove_file(&path).unwrap();
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        let error = CornerTable::open(dir.path()).unwrap_err().to_string();
        assert!(error.contains("a pipe or device"), "{error}");
        match verify(&ws, dir.path(), Limits::default()) {
            Ok(verdict) => assert!(!verdict.ok()),
            Err(error) => assert!(error.to_string().contains("a pipe or device"), "{error}"),
        }
    }
}
