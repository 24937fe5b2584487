//! What is not the program's own is spared: files of others in the way of a target, inputs that
//! are named as outputs, devices. And an input that is changed while it is read gives no folder.

#[path = "../common/mod.rs"]
mod common;

mod outputs;
mod place;

use clap::Parser;
use common::run::{cornermill, run};
use cornermill::build::{Builder, Strategy};
use cornermill::disk::Progress;
use place::Place;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

#[test]
fn only_mesh_folders_with_nothing_else_in_them_are_replaced() {
    let place = Place::new();
    place.run("encode m.ct -o m.cmz --exact -q").expect(0);
    let ways = [
        "build m.obj -o X --force",
        "decode m.cmz -o X --force",
        "filter m.ct -o X --largest 1 --force",
    ];
    let every = |target: &str, word: &str| {
        for way in ways {
            place.refuse(&way.replace('X', target), word);
        }
    };
    fs::create_dir(place.path("web")).expect("a folder");
    place.put("web/code.js", "work of years");
    every("web", "is no mesh folder");
    for manifest in [
        "{\"name\": \"web\"}",
        "{\"format\": \"cornermill mesh folder\"}",
        "",
        "[[",
    ] {
        place.put("web/manifest.json", manifest);
        every("web", "is no mesh folder");
    }
    place.run("build m.obj -o kept.ct -q").expect(0);
    place.put("kept.ct/notes.txt", "mine");
    every("kept.ct", "notes.txt");
    fs::remove_file(place.path("kept.ct/notes.txt")).expect("it is removed");
    fs::create_dir(place.path("kept.ct/inner")).expect("a folder");
    every("kept.ct", "inner");
    fs::remove_dir(place.path("kept.ct/inner")).expect("it is removed");
    // A folder that is damaged, or of a version to come, is one still.
    place.put("kept.ct/V.npy", "damaged");
    let newer = place
        .text("kept.ct/manifest.json")
        .replace("\"version\": 1", "\"version\": 9");
    place.put("kept.ct/manifest.json", &newer);
    for way in ways {
        place
            .run(&format!("{} -q", way.replace('X', "kept.ct")))
            .expect(0);
    }
    place.run("verify kept.ct").expect(0);
    symlink("kept.ct", place.path("link.ct")).expect("a link");
    every("link.ct", "is a link to kept.ct");
    every("m.ct/inner.ct", "lies in the mesh folder");
    every("-", "names no folder");
}

#[test]
fn a_pipe_that_has_no_path_is_read() {
    let place = Place::new();
    let script = "cat m.obj | \"$0\" build /dev/stdin --format obj -o piped.ct -q";
    let mut command = Command::new("sh");
    command
        .args(["-c", script, env!("CARGO_BIN_EXE_cornermill")])
        .current_dir(place.0.path());
    run(command, Stdio::null()).expect(0);
    assert_eq!(
        fs::read(place.path("piped.ct/V.npy")).expect("V"),
        fs::read(place.path("m.ct/V.npy")).expect("V")
    );
    place.refuse(
        "build /dev/zero -o zero.ct --resume",
        "--resume needs a file",
    );
}

/// Changes a file when a pass begins.
struct Changes {
    when: &'static str,
    change: Mutex<Option<Box<dyn FnOnce() + Send>>>,
}

impl Progress for Changes {
    fn begin(&self, pass: &'static str, _: &'static str, _: u64) {
        if pass == self.when
            && let Some(change) = self.change.lock().expect("no panic").take()
        {
            change();
        }
    }
    fn advance(&self, _: u64) {}
    fn usage(&self, _: u64, _: u64) {}
    fn end(&self) {}
    fn note(&self, _: &str) {}
}

#[test]
fn an_input_that_changes_while_it_is_read_gives_no_folder() {
    let place = Place::new();
    place.run("export m.ct -o v.npy -q").expect(0);
    let (v, g) = (place.path("v.npy"), place.path("v.G.npy"));
    for (when, path) in [
        ("weld: read", &v),
        ("scan", &v),
        ("checksums", &v),
        ("checksums", &g),
    ] {
        let whole = fs::read(path).expect("the array");
        let other = {
            let mut other = whole.clone();
            let end = other.len() - 12;
            other[end..].rotate_left(4);
            other
        };
        let victim = path.clone();
        let change = Box::new(move || fs::write(victim, other).expect("it is changed"));
        let progress = Changes {
            when,
            change: Mutex::new(Some(change)),
        };
        let out = place.path("changed.ct");
        let built = Builder::new(&v)
            .positions(&g)
            .weld(when == "weld: read")
            .progress(Arc::new(progress))
            .build(&out);
        let said = built.expect_err("a changed input").to_string();
        assert!(said.contains("changed while it was read"), "{said}");
        assert!(said.contains(&path.display().to_string()), "{said}");
        assert!(!out.exists() && !work_of(&out).exists());
        fs::write(path, whole).expect("it is as before");
    }
    cornermill([
        Path::new("build"),
        &v,
        Path::new("--positions"),
        &g,
        Path::new("-q"),
    ])
    .expect(0);
}

/// Passes that read V again must not take its ids for what they were when they were checked.
#[test]
fn ids_that_change_between_passes_are_told_and_not_followed() {
    let place = Place::new();
    let v = place.path("s.npy");
    let line = [
        "data-gen", "sphere", "-t", "4000", "--order", "shuffle", "-o",
    ];
    let words = line
        .map(Into::into)
        .into_iter()
        .chain([v.clone().into_os_string()]);
    data_gen::args::run(&data_gen::Args::parse_from(words)).expect("a mesh");
    let g = place.path("s.G.npy");
    let whole = fs::read(&v).expect("the array");
    let mut other = whole.clone();
    other[128..]
        .as_chunks_mut::<4>()
        .0
        .fill(0x7fff_fff0u32.to_le_bytes());
    for (strategy, passes) in [
        (
            Strategy::Memory,
            &["chunks", "seams", "stars", "components"][..],
        ),
        (Strategy::ByPlace, &["settle", "assemble"]),
        (Strategy::ById, &["cells", "components", "assemble"]),
    ] {
        for (&when, memory) in passes.iter().flat_map(|when| [(when, 64), (when, 4)]) {
            let (victim, other) = (v.clone(), other.clone());
            let change = Box::new(move || fs::write(victim, other).expect("it is changed"));
            let progress = Changes {
                when,
                change: Mutex::new(Some(change)),
            };
            let out = place.path("changed.ct");
            let builder = Builder::new(&v).positions(&g).progress(Arc::new(progress));
            let builder = builder.memory(memory << 20).threads(2).strategy(strategy);
            let built = builder.chunk_triangles(256).build(&out);
            let said = built.expect_err(when).to_string();
            assert!(
                said.contains("changed while it was read") && said.contains("s.npy"),
                "{strategy:?}, {when}, {memory} MiB: {said}"
            );
            assert!(!out.exists() && !work_of(&out).exists());
            fs::write(&v, &whole).expect("it is as before");
        }
    }
}

#[test]
fn an_input_that_was_decoded_may_go() {
    let place = Place::new();
    let mesh = place.path("m.obj");
    let whole = fs::read(&mesh).expect("the mesh");
    for (when, weld) in [("checksums", false), ("weld: read", true)] {
        let victim = mesh.clone();
        let change = Box::new(move || fs::remove_file(victim).expect("it is removed"));
        let progress = Changes {
            when,
            change: Mutex::new(Some(change)),
        };
        let out = place.path(&format!("late {when}.ct"));
        let builder = Builder::new(&mesh).weld(weld);
        let built = builder.progress(Arc::new(progress)).build(&out);
        built.expect("a build of what was read");
        assert!(!mesh.exists() && out.join("manifest.json").exists());
        fs::write(&mesh, &whole).expect("it is as before");
    }
}

fn work_of(out: &Path) -> PathBuf {
    let name = out.file_name().expect("a name").to_string_lossy();
    out.with_file_name(format!(".{name}.partial"))
}
