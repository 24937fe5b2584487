//! What no file that a command writes may be.

use crate::common::run::run;
use crate::place::Place;
use std::fs;
use std::os::unix::fs::symlink;
use std::process::{Command, Stdio};

/// Every command that writes a file, X. `m.cmz` is `m.ct` encoded.
const WRITERS: [&str; 10] = [
    "export m.ct -o X --format obj",
    "export m.ct -o X --format npy",
    "decode m.cmz -o X",
    "encode m.ct -o X --exact",
    "normals m.ct -o X",
    "normals m.ct -o other.npy --triangles=X",
    "path m.ct --from 0 --to 0 -o X --format ply",
    "picture m.ct -o X",
    "report m.ct -o X --no-pictures",
    "build m.obj -o n.ct --json=X",
];

#[test]
fn inputs_are_no_outputs() {
    let place = Place::new();
    place.run("export m.ct -o v.npy -q").expect(0);
    place.run("encode m.ct -o m.ply --exact -q").expect(0);
    place
        .run("build m.obj -o m.ct --json=k.json --force -q")
        .expect(0);
    fs::create_dir(place.path("sub")).expect("a folder");
    symlink(".", place.path("here")).expect("a link");
    for (input, line) in [
        ("m.obj", "build IN -o n.ct --json=OUT"),
        ("m.obj", "build IN -o n.ct --json=OUT --dry-run"),
        ("v.npy", "build IN --positions v.G.npy -o n.ct --json=OUT"),
        ("v.G.npy", "build v.npy --positions IN -o n.ct --json=OUT"),
        ("m.ply", "decode IN -o OUT"),
        ("k.json", "report m.ct -o OUT --build IN"),
    ] {
        // Names that end as the input's, which say the format.
        let [soft, hard] = ["soft.", "hard."].map(|kind| format!("{kind}{input}"));
        symlink(input, place.path(&soft)).expect("a link");
        fs::hard_link(place.path(input), place.path(&hard)).expect("a hard link");
        let there = ["", "./", "sub/../", "here/"].map(|way| format!("{way}{input}"));
        for other in there.iter().chain([&soft, &hard]) {
            for (from, to) in [(input, other.as_str()), (other, input)] {
                let line = line.replace("IN", from).replace("OUT", to);
                place.refuse(&line, "is the input");
                place.refuse(&format!("{line} --force"), "is the input");
            }
        }
        for name in [soft, hard] {
            fs::remove_file(place.path(&name)).expect("it is removed");
        }
    }
    // What is read from standard input has a name, too.
    let script = "\"$0\" build - -o n.ct --json=m.obj --force < m.obj";
    let mut command = Command::new("sh");
    command.args(["-c", script, env!("CARGO_BIN_EXE_cornermill")]);
    command.current_dir(place.0.path());
    let before = place.all();
    let run = run(command, Stdio::null()).expect(2);
    assert!(run.stderr.contains("is the input"), "{run}");
    assert_eq!(before, place.all());
}

#[test]
fn nothing_is_written_into_a_mesh_folder() {
    let place = Place::new();
    place.run("encode m.ct -o m.cmz --exact -q").expect(0);
    place.run("build m.obj -o kept.ct -q").expect(0);
    symlink("kept.ct", place.path("link")).expect("a link");
    fs::create_dir(place.path("kept.ct/inner")).expect("a folder");
    for name in ["V.npy", "G.npy", "manifest.json", "new.npy", "inner/new"] {
        for folder in ["kept.ct", "./kept.ct", "link", "m.ct/../kept.ct"] {
            for writer in WRITERS {
                let line = writer.replace('X', &format!("{folder}/{name}"));
                let word = "kept.ct, which holds its own files alone";
                place.refuse(&line, word);
                place.refuse(&format!("{line} --force"), word);
            }
        }
    }
    // A manifest of something else makes no mesh folder.
    fs::create_dir(place.path("web")).expect("a folder");
    place.put("web/manifest.json", "{\"name\": \"web\"}");
    place.run("export m.ct -o web/m.obj -q").expect(0);
}

#[test]
fn two_outputs_are_two_files() {
    let place = Place::new();
    symlink(".", place.path("here")).expect("a link");
    fs::create_dir(place.path("sub")).expect("a folder");
    for (one, line) in [
        ("n.npy", "normals m.ct -o ONE --triangles=TWO"),
        ("m.N.npy", "normals m.ct --triangles=TWO"),
        ("n.ct", "build m.obj -o ONE --json=TWO"),
        ("n.ct", "build m.obj -o ONE --json=TWO --dry-run"),
        ("m.ct", "build m.obj --json=TWO"),
    ] {
        for way in ["", "./", "here/", "sub/../"] {
            let line = line.replace("ONE", one);
            let line = line.replace("TWO", &format!("{way}{one}"));
            place.refuse(&line, "would be written twice");
            place.refuse(&format!("{line} --force"), "would be written twice");
        }
    }
    // Two names of one file are two files afterwards.
    place.put("a.npy", "old");
    fs::hard_link(place.path("a.npy"), place.path("b.npy")).expect("a hard link");
    place
        .run("normals m.ct -o a.npy --triangles=b.npy --force -q")
        .expect(0);
    let [a, b] = ["a.npy", "b.npy"].map(|name| fs::metadata(place.path(name)).expect("a file"));
    assert!(a.len() > b.len() && b.len() > 3, "{a:?} {b:?}");
}

#[test]
fn names_that_no_file_can_get_are_refused_before_the_work() {
    let place = Place::new();
    place.run("encode m.ct -o m.cmz --exact -q").expect(0);
    let long = format!("{}.obj", "long".repeat(80));
    for writer in WRITERS {
        let line = |name: &str| writer.replace('X', name);
        place.ends(&line("nowhere/r.obj"), 4, "nowhere");
        place.ends(&line("m.obj/r.obj"), 4, "m.obj");
        place.ends(&line("/proc/r.obj"), 4, "/proc");
        place.ends(&line(&long), 4, &long);
        place.refuse(&line("r.obj/"), "names a folder");
        place.refuse(&line("r.obj/."), "names a folder");
    }
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
