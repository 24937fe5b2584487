//! What is not the program's own is spared: files of others in the way of a target, inputs that
//! are named as outputs, devices. And an input that is changed while it is read gives no folder.

mod common;

use clap::Parser;
use common::run::{Run, cornermill, run};
use cornermill::build::{Builder, Strategy};
use cornermill::disk::Progress;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use tempfile::TempDir;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A place with a mesh `m.obj` and its folder `m.ct`.
struct Place(TempDir);

impl Place {
    fn new() -> Place {
        let place = Place(tempfile::tempdir().expect("a temporary directory"));
        place.put("m.obj", OBJ);
        place.run("build m.obj -q").expect(0);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a file is written");
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("a text is read")
    }

    /// Runs a line of words in this place.
    fn run(&self, line: &str) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
        command.args(line.split(' ')).current_dir(self.0.path());
        run(command, Stdio::null())
    }

    /// A line that must be refused with a word that says why, and change nothing.
    fn refuse(&self, line: &str, word: &str) {
        let before = self.all();
        let run = self.run(line).expect(2);
        assert!(run.stderr.contains(word), "{word:?} is not said\n{run}");
        assert_eq!(before, self.all(), "something changed\n{run}");
    }

    /// Every file, and what is in it.
    fn all(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let (mut found, mut folders) = (Vec::new(), vec![self.0.path().to_owned()]);
        while let Some(folder) = folders.pop() {
            for item in fs::read_dir(folder).expect("a folder is listed") {
                let path = item.expect("an entry").path();
                if path.is_dir() && !path.is_symlink() {
                    folders.push(path);
                } else {
                    // Reading a pipe would wait for its writer.
                    let plain = path
                        .is_file()
                        .then(|| fs::read(&path).expect("a file is read"));
                    found.push((path, plain.unwrap_or_default()));
                }
            }
        }
        found.sort();
        found
    }
}

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
    every("m.ct/inner.ct", "lies in a mesh folder");
    every("-", "names no folder");
}

#[test]
fn inputs_are_no_outputs() {
    let place = Place::new();
    place.run("export m.ct -o v.npy -q").expect(0);
    place.refuse("build m.obj --json=m.obj --force", "is the input");
    place.refuse("build m.obj --json=m.obj --force --dry-run", "is the input");
    let arrays = "build v.npy --positions v.G.npy --force";
    place.refuse(&format!("{arrays} --json=v.npy"), "is the input");
    place.refuse(&format!("{arrays} --json=v.G.npy"), "is the input");
    place.refuse(
        "build m.obj --force --json=m.ct/G.npy",
        "lies in the mesh folder",
    );
    place.run("encode m.ct -o packed --exact -q").expect(0);
    fs::rename(place.path("packed"), place.path("packed.ply")).expect("it is renamed");
    place.refuse(
        "decode packed.ply -o packed.ply --force",
        "is the compressed file itself",
    );
    symlink("packed.ply", place.path("link.ply")).expect("a link");
    place.refuse(
        "decode link.ply -o packed.ply --force",
        "is the compressed file itself",
    );
}

#[test]
fn the_report_as_json_is_a_file_like_any_output() {
    let place = Place::new();
    place.put("r.json", "other work");
    place.refuse("build m.obj -o n.ct --json=r.json", "give --force");
    place.refuse("build m.obj -o n.ct --json=m.ct --force", "is a folder");
    place
        .run("build m.obj -o n.ct --json=nowhere/r.json -q")
        .expect(4);
    assert!(
        !place.path("n.ct").exists(),
        "it was built before it was refused"
    );
    place
        .run("build m.obj -o n.ct --json=r.json --force -q")
        .expect(0);
    assert!(place.text("r.json").starts_with('{'));
    place
        .run("build m.obj -o n.ct --json=/dev/null --force -q")
        .expect(0);
    assert!(!fs::metadata("/dev/null").expect("a device").is_file());
}

#[test]
fn devices_are_not_replaced_by_files() {
    let place = Place::new();
    let made = Command::new("mkfifo").arg(place.path("pipe.obj")).status();
    assert!(made.expect("mkfifo runs").success());
    for line in [
        "export m.ct -o pipe.obj --force",
        "encode m.ct -o pipe.obj --exact --force",
        "picture m.ct -o pipe.obj --force",
    ] {
        let run = place.run(line).expect(2);
        assert!(run.stderr.contains("is a device or pipe"), "{run}");
    }
    place.refuse("picture m.ct -o -", "no name of one");
    place.refuse("encode m.ct -o - --exact", "no name of one");
}

#[test]
fn links_are_not_replaced_by_files() {
    let place = Place::new();
    place.put("kept.obj", "work of years");
    for to in ["kept.obj", "nowhere"] {
        symlink(to, place.path("link.obj")).expect("a link");
        for line in [
            "export m.ct -o link.obj --force",
            "encode m.ct -o link.obj --exact --force",
            "picture m.ct -o link.obj --force",
            "build m.obj -o n.ct --json=link.obj --force",
        ] {
            place.refuse(line, &format!("is a link to {to}"));
        }
        fs::remove_file(place.path("link.obj")).expect("it is removed");
    }
}

#[test]
fn arrays_without_coordinates_do_not_get_those_of_another_mesh() {
    let place = Place::new();
    place.run("export m.ct -o e.npy -q").expect(0);
    place.run("build e.npy -o bare.ct -q").expect(0);
    place.refuse("export bare.ct -o e.npy --force", "e.G.npy: exists");
    place.run("export bare.ct -o f.npy -q").expect(0);
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
