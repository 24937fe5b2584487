//! Inputs that are no plain files, or no plain text: folders, devices, pipes, endless lines,
//! other encodings, links in the way of the target. Each ends in order and within its memory.

mod common;

use common::run::{Run, cornermill, cornermill_confined, run};
use std::ffi::OsStr;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// MiB of address space of a run in a budget of 16 MiB.
const CONFINED: u32 = 256;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn dir() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

fn build(input: &Path, out: &Path, options: &[&str]) -> Run {
    let args = [
        OsStr::new("build"),
        input.as_ref(),
        "-o".as_ref(),
        out.as_ref(),
    ];
    let usual = ["--quiet", "--memory", "16MiB", "--threads", "1"];
    let options = usual.iter().chain(options).map(OsStr::new);
    cornermill_confined(CONFINED, args.into_iter().chain(options))
}

/// Builds what must be refused with `code`, in a word, leaving nothing.
fn refuse(input: &Path, options: &[&str], code: &[i32], word: &str) {
    let out = dir();
    let run = build(input, &out.path().join("OUT.ct"), options);
    assert!(code.contains(&run.code), "{run}");
    assert!(run.stderr.contains(word), "{word:?} is not said\n{run}");
    let left = std::fs::read_dir(out.path()).expect("the folder").count();
    assert_eq!(left, 0, "something is left behind\n{run}");
}

const FORMATS: [&str; 5] = ["ply", "stl", "obj", "off", "npy"];

#[test]
fn folders_and_devices_are_no_meshes() {
    let folder = dir();
    refuse(folder.path(), &[], &[3, 4], "directory");
    for format in FORMATS {
        refuse(folder.path(), &["--format", format], &[3, 4], "");
        refuse(Path::new("/dev/null"), &["--format", format], &[3], "");
        refuse(
            Path::new("/nowhere/at/all"),
            &["--format", format],
            &[3, 4],
            "/nowhere/at/all",
        );
    }
    let raw = ["--raw-index", "u4"];
    refuse(folder.path(), &raw, &[3, 4], "a folder");
    refuse(Path::new("/dev/zero"), &raw, &[3], "a pipe or device");
    refuse(Path::new("/dev/zero"), &[], &[3], "/dev/zero");
    refuse(
        Path::new("/dev/zero"),
        &["--format", "ply"],
        &[3],
        "/dev/zero",
    );
}

#[test]
fn a_pipe_is_read_once_or_refused() {
    let place = dir();
    let pipe = place.path().join("pipe.obj");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo runs").success());
    refuse(&pipe, &["--format", "npy"], &[3], "a pipe or device");
    let writer = {
        let pipe = pipe.clone();
        std::thread::spawn(move || std::fs::write(pipe, OBJ))
    };
    let out = place.path().join("OUT.ct");
    build(&pipe, &out, &[]).expect(0);
    writer
        .join()
        .expect("the writer ends")
        .expect("all is read");
}

#[test]
fn other_encodings_are_named_and_marks_passed_over() {
    let place = dir();
    let wide: Vec<u8> = OBJ.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let path = place.path().join("m.obj");
    for mark in [&b"\xff\xfe"[..], b"\xfe\xff"] {
        std::fs::write(&path, [mark, &wide].concat()).expect("written");
        refuse(&path, &[], &[3], "UTF-16");
    }
    std::fs::write(&path, &wide).expect("written");
    refuse(&path, &[], &[3], "no vertices");
    for text in [
        format!("\u{feff}{OBJ}"),
        OBJ.replace('\n', "\r\n"),
        OBJ.replace('\n', "\r"),
        format!("{OBJ}\n\n   \n"),
        OBJ.trim_end().to_owned(),
    ] {
        std::fs::write(&path, &text).expect("written");
        let run = build(&path, &place.path().join("OUT.ct"), &["--force"]);
        assert_eq!(run.code, 0, "{text:?}\n{run}");
    }
    for text in [
        OBJ.replace("1 2 3", "1 2\0 3"),
        OBJ.replace("0 1 0", "0 1\0"),
    ] {
        std::fs::write(&path, &text).expect("written");
        refuse(&path, &[], &[3], "line");
    }
}

/// Some hundred MB without an end of line, through a pipe, in 16 MiB.
#[test]
fn a_gigantic_line_takes_no_memory() {
    let starts = [
        ("obj", "v 0 0 "),
        ("obj", "f 1 2 "),
        ("obj", "# "),
        ("off", "OFF\\n3 1 0\\n"),
        ("ply", "ply\\nformat ascii 1.0\\ncomment "),
        ("ply", "ply\\nformat ascii 1.0\\nelement vertex "),
        ("stl", "solid "),
    ];
    for (format, start) in starts {
        for byte in ["7", " "] {
            let out = dir();
            let program = env!("CARGO_BIN_EXE_cornermill");
            let script = format!(
                "(printf '{start}'; head -c 300000000 /dev/zero | tr '\\0' '{byte}') | (ulimit -v {}; exec \
                 \"$0\" build - --format {format} -o \"$1\" --memory 16MiB --threads 1 --quiet)",
                CONFINED * 1024
            );
            let mut command = Command::new("sh");
            let target = out.path().join("OUT.ct");
            command.args(["-c", &script, program]).arg(&target);
            let run = run(command, Stdio::null());
            assert!(
                matches!(run.code, 0 | 3),
                "{format} {start:?} {byte:?}\n{run}"
            );
            assert!(run.stderr.len() < 2000, "a long message\n{run}");
            assert_eq!(target.exists(), run.code == 0);
        }
    }
}

#[test]
fn links_in_the_target_lead_nowhere_else() {
    let place = dir();
    let (mesh, mine) = (place.path().join("m.obj"), place.path().join("mine"));
    std::fs::write(&mesh, OBJ).expect("written");
    std::fs::create_dir(&mine).expect("a folder");
    std::fs::write(mine.join("V.npy"), "precious").expect("written");
    let out = place.path().join("OUT.ct");
    symlink(&mine, &out).expect("a link");
    let run = build(&mesh, &out, &[]);
    assert_eq!(run.code, 2, "a target that exists, as a link\n{run}");
    // With --force neither: the link may stand for what it leads to, or be kept for itself.
    let run = build(&mesh, &out, &["--force"]).expect(2);
    let said = format!("is a link to {}", mine.display());
    assert!(run.stderr.contains(&said), "{run}");
    assert!(out.is_symlink(), "the link went\n{run}");
    let kept = std::fs::read_to_string(mine.join("V.npy")).expect("my file is there");
    assert_eq!(kept, "precious");
    let input = std::fs::read_to_string(&mesh).expect("the input is there");
    assert_eq!(input, OBJ);
}

#[test]
fn a_folder_that_is_built_already_is_no_input() {
    let place = dir();
    let (mesh, built) = (place.path().join("m.obj"), place.path().join("m.ct"));
    std::fs::write(&mesh, OBJ).expect("written");
    build(&mesh, &built, &[]).expect(0);
    for options in [&[][..], &["--format", "obj"], &["--dry-run"]] {
        let run = build(&built, &place.path().join("OUT.ct"), options).expect(3);
        for word in [
            "found a mesh folder",
            "`cornermill info`",
            "`verify`",
            "`export`",
        ] {
            assert!(run.stderr.contains(word), "{word}\n{run}");
        }
    }
}

#[test]
fn coordinates_far_out_are_told_of_where_they_are_rounded() {
    let place = dir();
    let at = |name: &str| place.path().join(name);
    let far = "v 4000000.125 0 0\nv 4000100 0 0\nv 4000000 100 0\nf 1 2 3\n";
    std::fs::write(at("far.obj"), far).expect("written");
    std::fs::write(at("near.obj"), far.replace("4000", "")).expect("written");
    // Loudly: a quiet build has no notes.
    let told_by = |name: &str, out: &str, options: &[&str]| {
        let (input, out) = (at(name), at(out));
        let paths = [&input, &out].map(|p| p.to_str().expect("a path"));
        let args = [&["build", paths[0], "-o", paths[1]], options].concat();
        cornermill(args)
            .expect(0)
            .stderr
            .contains("--coords f8 keeps")
    };
    for (name, out, options, told) in [
        ("far.obj", "far.ct", &[][..], true),
        ("far.obj", "wide.ct", &["--coords", "f8"], false),
        ("near.obj", "near.ct", &[], false),
    ] {
        assert_eq!(told_by(name, out, options), told, "{name} to {out}");
    }
    // Of doubles nothing is lost, unless that is asked for.
    let paths = [at("wide.ct"), at("m.ply")];
    let [wide, ply] = paths.each_ref().map(|p| p.to_str().expect("a path"));
    cornermill(["export", wide, "-o", ply]).expect(0);
    for (out, options, told) in [
        ("a.ct", &[][..], false),
        ("b.ct", &["--coords", "f4"], true),
    ] {
        assert_eq!(told_by("m.ply", out, options), told, "{out}");
    }
}

#[test]
fn a_file_is_no_mesh_folder() {
    let place = dir();
    let file = place.path().join("m.cmz");
    std::fs::write(&file, OBJ).expect("written");
    let file = file.to_str().expect("a path");
    for command in ["verify", "check", "export", "encode", "filter"] {
        let more: &[&str] = match command {
            "export" => &["-o", "out.obj"],
            "encode" => &["-o", "out.cmz", "--exact"],
            "filter" => &["-o", "out.ct", "--largest", "1"],
            "check" => &["--require", "closed"],
            _ => &[],
        };
        let run = cornermill([&[command, file], more].concat()).expect(3);
        let word = "expected a mesh folder, found a file";
        assert!(run.stderr.contains(word), "{command}\n{run}");
    }
}

#[test]
fn options_that_a_mesh_has_no_use_for_are_refused() {
    let place = dir();
    let path = |name: &str| place.path().join(name);
    std::fs::write(path("m.obj"), OBJ).expect("written");
    std::fs::write(path("v.raw"), [0; 12]).expect("written");
    let built = path("m.ct");
    build(&path("m.obj"), &built, &[]).expect(0);
    let (built, npy) = (built.to_str().expect("a path"), path("m.npy"));
    let exported = npy.to_str().expect("a path");
    cornermill(["export", built, "-o", exported]).expect(0);
    let raw = ["--raw-index", "u4"];
    for (name, options, word) in [
        ("m.obj", &["--endian", "big"][..], "--endian is for raw"),
        ("m.obj", &["--endian", "little"], "--endian is for raw"),
        ("m.npy", &["--endian", "little"], "--endian is for raw"),
        ("m.npy", &["--coords", "f8"], "--positions"),
        (
            "v.raw",
            &[&raw[..], &["--coords", "f4"]].concat(),
            "--positions",
        ),
    ] {
        for more in [&[][..], &["--dry-run"]] {
            let options = [options, more].concat();
            let run = build(&path(name), &path("OUT.ct"), &options).expect(2);
            assert!(run.stderr.contains(word), "{word}\n{run}");
        }
    }
    let positions = path("m.G.npy").display().to_string();
    let options = ["--positions", &positions, "--coords", "f8"];
    build(&path("m.npy"), &path("OUT.ct"), &options).expect(0);
}

#[test]
fn scratch_that_has_no_folder_is_refused_at_once() {
    let place = dir();
    std::fs::write(place.path().join("m.obj"), OBJ).expect("written");
    let run = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
        command.args(line.split(' ')).current_dir(place.path());
        run(command, Stdio::null())
    };
    run("build m.obj -o m.ct").expect(0);
    run("encode m.ct -o m.cmz --exact").expect(0);
    for line in [
        "build m.obj -o OUT",
        "build m.obj -o OUT --dry-run",
        "decode m.cmz -o OUT",
        "encode m.ct -o OUT --exact",
        "export m.ct -o OUT --format ply",
        "filter m.ct -o OUT --largest 1",
        "normals m.ct -o OUT",
        "path m.ct --from 0 --to 1",
        "picture m.ct -o OUT",
        "report m.ct -o OUT",
        "verify m.ct",
    ] {
        for tmp in ["nowhere", "m.obj"] {
            let run = run(&format!("{line} --tmp . --tmp {tmp}")).expect(4);
            let said = format!("{tmp}: cannot put scratch files there (--tmp)");
            assert!(run.stderr.contains(&said), "{run}");
            assert!(!place.path().join("OUT").exists(), "{run}");
        }
    }
}

/// Whoever reads what is listed may have seen enough; what was made or judged stands.
#[test]
fn a_reader_that_goes_away_ends_a_listing_without_a_word() {
    let place = dir();
    std::fs::write(place.path().join("m.obj"), OBJ).expect("written");
    let run = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
        command.args(line.split(' ')).current_dir(place.path());
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        command.stdout(writer).stdin(Stdio::null());
        let done = command.output().expect("it runs");
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        (done.status.code(), said)
    };
    run("build m.obj -o m.ct --progress none");
    for (line, code) in [
        ("build m.obj -o n.ct --progress none", 0),
        ("build m.obj -o o.ct --json --progress none", 0),
        ("build m.obj -o o.ct --dry-run", 141),
        ("build m.obj -o o.ct --dry-run --json", 141),
        ("info m.ct", 141),
        ("info m.ct --json", 141),
        ("export m.ct -o - --format obj", 141),
        ("export m.ct -o - --format ply", 141),
        ("export m.ct -o m.ply --progress none", 0),
        ("path m.ct --from 0 --to 1", 141),
        ("swirl m.ct --from 0 --json", 141),
        ("verify m.ct --progress none", 0),
        ("check m.ct --require closed", 1),
        ("check m.ct --require single --json", 0),
    ] {
        assert_eq!(run(line), (Some(code), String::new()), "{line}");
    }
    assert!(place.path().join("n.ct/manifest.json").exists());
}
