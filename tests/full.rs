//! Disks that are too small: a file system made for it where that is allowed, a limit on the
//! length of files everywhere.
//!
//! A run on a disk that is too small ends with exit code 4, names a path, says what to do, and
//! leaves nothing behind; on one that is large enough it ends well.

mod common;

use common::folder::files;
use common::formats::{self, Order};
use common::random::Random;
use common::run::{Run, cornermill, run};
use common::surfaces;
use cornermill::Error;
use cornermill::build::Builder;
use cornermill::disk::Progress;
use cornermill::input::IndexKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

/// A file system in memory of so many KiB; unmounted on drop.
struct Small(tempfile::TempDir);

impl Small {
    /// `None` where mounting is not allowed.
    fn new(kib: u64) -> Option<Small> {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let size = format!("size={kib}k");
        let done = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "tmpfs"])
            .arg(dir.path())
            .stderr(Stdio::null())
            .status();
        done.is_ok_and(|s| s.success()).then(|| Small(dir))
    }

    fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}

fn text(path: &Path) -> String {
    path.to_str().expect("a plain name").to_owned()
}

/// A folder of inputs: a mesh of 20 000 triangles at random, built and encoded.
struct Inputs {
    dir: tempfile::TempDir,
}

impl Inputs {
    fn new() -> Inputs {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let mut mesh = surfaces::torus(100, 100);
        mesh.shuffle(&mut Random::new(2));
        let ply = formats::ply_binary(&mesh, Order::Little);
        std::fs::write(dir.path().join("m.ply"), ply).expect("a mesh");
        let inputs = Inputs { dir };
        let (ply, folder) = (inputs.name("m.ply"), inputs.name("m.ct"));
        cornermill(["build", &ply, "-o", &folder, "--quiet"]).expect(0);
        let packed = inputs.name("m.cmz");
        cornermill(["encode", &folder, "-o", &packed, "--bits=12", "--quiet"]).expect(0);
        inputs
    }

    fn name(&self, name: &str) -> String {
        text(&self.dir.path().join(name))
    }

    /// Commands by what they read, with the name of what they make.
    fn commands(&self) -> Vec<(Vec<String>, &'static str)> {
        let root = format!("{}/", text(self.dir.path()));
        let words = |line: &str| -> Vec<String> {
            let words = line.split_whitespace();
            words.map(|w| w.replace('@', &root)).collect()
        };
        vec![
            (
                words("build @m.ply --memory=3MiB --strategy=memory"),
                "o.ct",
            ),
            (
                words("build @m.ply --memory=4MiB --strategy=by-place"),
                "o.ct",
            ),
            (words("export @m.ct"), "o.ply"),
            (words("export @m.ct"), "o.stl"),
            (words("encode @m.ct --bits=12"), "o.cmz"),
            (words("decode @m.cmz"), "o.ct"),
            (words("decode @m.cmz"), "o.obj"),
            (words("normals @m.ct"), "o.npy"),
        ]
    }
}

/// True when the run failed, as a run on a full disk must.
fn failed(run: &Run, dir: &Path) -> bool {
    if run.code == 0 {
        return false;
    }
    assert_eq!(run.code, 4, "{run}");
    assert!(run.stderr.contains("cannot "), "{run}");
    assert!(run.stderr.contains(&text(dir)), "{run}");
    true
}

fn listing(dir: &Path) -> Vec<PathBuf> {
    let list = std::fs::read_dir(dir).expect("a folder is read");
    list.map(|e| e.expect("an entry").path()).collect()
}

#[test]
fn a_disk_that_is_too_small_is_an_error_and_stays_as_it_was() {
    let inputs = Inputs::new();
    for (args, out) in inputs.commands() {
        let (mut refused, mut done) = (0, 0);
        for kib in [64, 200, 512, 700, 1000, 1400, 2500, 16 << 10] {
            let Some(small) = Small::new(kib) else {
                return;
            };
            let output = text(&small.path().join(out));
            let mut all = args.clone();
            all.extend([
                "-o".into(),
                output.clone(),
                "--quiet".into(),
                "--threads=1".into(),
            ]);
            let run = cornermill(&all);
            if failed(&run, small.path()) {
                refused += 1;
                assert!(run.stderr.contains("--tmp"), "{run}");
                assert_eq!(listing(small.path()), Vec::<PathBuf>::new(), "{run}");
                continue;
            }
            done += 1;
            let made = listing(small.path());
            assert_eq!(made.len(), 1, "{made:?}");
            if out == "o.ct" && args[0] == "build" {
                let right = files(Path::new(&inputs.name("m.ct")));
                assert!(files(&made[0]) == right, "{run}");
            }
        }
        assert!(refused > 0 && done > 0, "{args:?}: {refused} and {done}");
    }
}

#[test]
fn scratch_on_a_disk_that_is_too_small_is_an_error() {
    let inputs = Inputs::new();
    for (args, out) in inputs
        .commands()
        .into_iter()
        .filter(|(a, _)| a[0] == "build")
    {
        let mut refused = 0;
        for kib in [16, 64, 200, 8 << 10] {
            let Some(small) = Small::new(kib) else {
                return;
            };
            let mut all = args.clone();
            let tmp = format!("--tmp={}", text(small.path()));
            let output = inputs.name(out);
            all.extend(["-o".into(), output.clone(), "--quiet".into(), tmp]);
            let run = cornermill(&all);
            refused += u32::from(failed(&run, small.path()));
            assert_eq!(Path::new(&output).exists(), run.code == 0, "{run}");
            let _ = std::fs::remove_dir_all(&output);
            assert_eq!(listing(small.path()), Vec::<PathBuf>::new(), "{run}");
        }
        assert!(refused > 0, "{args:?}");
    }
}

#[test]
fn what_cannot_fit_is_refused_before_anything_is_read() {
    let inputs = Inputs::new();
    let Some(small) = Small::new(300) else {
        return;
    };
    let output = text(&small.path().join("o.ct"));
    let run = cornermill(["build", &inputs.name("m.ply"), "-o", &output]).expect(4);
    assert!(run.stderr.contains("of the mesh folder there"), "{run}");
    assert!(run.stderr.contains("bytes more are needed"), "{run}");
    let tmp = format!("--tmp={}", text(inputs.dir.path()));
    let limit = ["--max-disk=100kB", &tmp];
    let (there, input) = (inputs.name("o.ct"), inputs.name("m.ply"));
    let args = [&["build", &input[..], "-o", &there], &limit[..]].concat();
    let run = cornermill(args).expect(4);
    assert!(run.stderr.contains("--max-disk"), "{run}");
    assert!(!Path::new(&there).exists());
}

/// Lets no pass begin.
struct NoPass;

impl Progress for NoPass {
    fn begin(&self, pass: &'static str, _: &'static str, _: u64) {
        panic!("the pass {pass} begins");
    }
    fn advance(&self, _: u64) {}
    fn usage(&self, _: u64, _: u64) {}
    fn end(&self) {}
    fn note(&self, _: &str) {}
}

/// What a build of the input is refused with before any pass begins.
#[track_caller]
fn refused_at_once(builder: Builder, output: &Path) -> Error {
    let refused = builder.progress(Arc::new(NoPass)).build(output);
    assert!(!output.exists());
    refused.expect_err("what cannot fit")
}

/// Certain counts are in the headers of all formats but OBJ and STL as text.
#[test]
fn counts_of_headers_are_held_to_the_room_at_once() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mesh = surfaces::torus(100, 100);
    let files = [
        ("m.stl", formats::stl_binary(&mesh, "")),
        ("m.ply", formats::ply_binary(&mesh, Order::Big)),
        ("text.ply", formats::ply_ascii(&mesh)),
        ("m.off", formats::off(&mesh)),
    ];
    let output = dir.path().join("o.ct");
    for (name, bytes) in files {
        let input = dir.path().join(name);
        std::fs::write(&input, bytes).expect("a mesh");
        // 20 000 triangles take 240 kB when they are decoded, and 560 kB in the folder.
        let error = refused_at_once(Builder::new(&input).max_disk(239_000), &output);
        let needs = matches!(error, Error::DiskLimit { need: 240_000, .. });
        assert!(needs, "{name}: {error}");
        let words = ["build", &text(&input), "--max-disk=239kB", "--dry-run"];
        let run = cornermill(words).expect(4);
        assert!(run.stderr.contains("--max-disk 239000"), "{run}");
        assert!(run.stdout.contains("  scratch "), "{run}");
        let Some(small) = Small::new(500) else {
            continue;
        };
        let there = small.path().join("o.ct");
        let error = refused_at_once(Builder::new(&input), &there).to_string();
        let said = error.contains("of the mesh folder there") && error.contains("bytes more are");
        assert!(
            said && error.contains(&text(small.path())),
            "{name}: {error}"
        );
        let words = ["build", &text(&input), "-o", &text(&there), "--dry-run"];
        let run = cornermill(words).expect(4);
        assert!(run.stderr.contains("bytes more are needed"), "{run}");
    }
}

/// The table of the chunks of so many triangles alone takes more.
#[test]
fn a_budget_that_is_certain_not_to_do_is_refused_at_once() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let input = dir.path().join("v.raw");
    let file = std::fs::File::create(&input).expect("a file");
    file.set_len(12 << 30).expect("a sparse file");
    let builder = Builder::new(&input).raw_index(IndexKind::U4).vertices(7);
    let builder = builder.threads(1).memory(4 << 20);
    let output = dir.path().join("o.ct");
    let told = builder.predict(&output).expect("a prediction");
    let error = refused_at_once(builder, &output);
    let Error::Budget { need, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(need, told.least_memory);
}

#[test]
fn a_limit_on_the_length_of_files_is_an_error_not_a_signal() {
    let inputs = Inputs::new();
    for (args, out) in inputs.commands() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let output = text(&dir.path().join(out));
        let mut command = Command::new("sh");
        let script = "ulimit -f 40 && exec \"$0\" \"$@\"";
        command.args(["-c", script, env!("CARGO_BIN_EXE_cornermill")]);
        command.args(&args);
        command.args(["-o", &output, "--quiet"]);
        let done = run(command, Stdio::null());
        if failed(&done, dir.path()) {
            assert_eq!(listing(dir.path()), Vec::<PathBuf>::new(), "{done}");
        } else {
            assert_eq!(out, "o.cmz", "{done}");
        }
    }
}
