//! Files that another process cuts short while they are mapped: an error, never the end of the
//! process by a signal, and never a folder that looks right.

mod common;

use common::folder::files;
use common::formats;
use common::mesh::Mesh;
use common::random::Random;
use common::run::cornermill;
use common::surfaces;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

/// 80 000 triangles: megabytes of V and G.
fn mesh(shuffled: bool) -> Mesh {
    let mut mesh = surfaces::torus(200, 200);
    if shuffled {
        mesh.shuffle(&mut Random::new(1));
    }
    mesh
}

fn start(args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_cornermill"))
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

/// Runs a command, and cuts `victim` to a part of its length after a while, at `moments` moments
/// spread over the time that the command takes by itself. `check` sees what was left and the code.
fn cut_at_many_moments(
    args: &[&str],
    victim: &Path,
    moments: u32,
    mut check: impl FnMut(Option<i32>, &str),
) {
    let whole = std::fs::read(victim).expect("the file is read");
    let before = Instant::now();
    let child = start(args);
    let done = child.wait_with_output().expect("the command ends");
    let took = before.elapsed();
    check(done.status.code(), &String::from_utf8_lossy(&done.stderr));
    let mut random = Random::new(5);
    for moment in 0..moments {
        std::fs::write(victim, &whole).expect("the file is whole again");
        let child = start(args);
        std::thread::sleep(took * moment / moments);
        let part = whole.len() as u64 * (random.below(1000) as u64) / 1000;
        let file = File::options().write(true).open(victim).expect("it opens");
        file.set_len(part).expect("it is cut short");
        let done = child.wait_with_output().expect("the command ends");
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(
            matches!(done.status.code(), Some(0 | 3 | 4)),
            "moment {moment}, {part} bytes left: {:?}\n{said}",
            done.status
        );
        check(done.status.code(), &said);
    }
    std::fs::write(victim, &whole).expect("the file is whole again");
}

#[test]
fn inputs_that_shrink_under_a_build_are_an_error() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for shuffled in [false, true] {
        let (v, g) = formats::write_npy(&mesh(shuffled), dir.path());
        let output = dir.path().join("out.ct");
        let args = [
            "build",
            text(&v),
            "--positions",
            text(&g),
            "-o",
            text(&output),
            "--progress=none",
            "--quiet",
        ];
        for victim in [&v, &g] {
            let mut right = None;
            cut_at_many_moments(&args, victim, 12, |code, said| {
                if code != Some(0) {
                    assert!(!output.exists(), "{said}");
                    assert!(
                        said.contains(text(victim)) || said.contains("byte"),
                        "{said}"
                    );
                    return;
                }
                let made = files(&output);
                assert!(right.get_or_insert(made.clone()) == &made, "another folder");
                std::fs::remove_dir_all(&output).expect("the output is removed");
            });
        }
        let left: Vec<PathBuf> = std::fs::read_dir(dir.path())
            .expect("the folder is read")
            .map(|entry| entry.expect("an entry").path())
            .filter(|path| path != &v && path != &g)
            .collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn folders_that_shrink_under_walks_and_pictures_are_an_error() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (v, g) = formats::write_npy(&mesh(false), dir.path());
    let folder = dir.path().join("m.ct");
    let build = [
        "build",
        text(&v),
        "--positions",
        text(&g),
        "-o",
        text(&folder),
        "--quiet",
    ];
    cornermill(build).expect(0);
    let out = dir.path().join("out");
    let commands: [(&str, &[&str]); 4] = [
        ("O.npy", &["swirl", text(&folder), "--from=0", "--quiet"]),
        (
            "O.npy",
            &["path", text(&folder), "--from=0", "--to=120000", "--quiet"],
        ),
        (
            "G.npy",
            &[
                "picture",
                text(&folder),
                "-o",
                text(&out),
                "--force",
                "--quiet",
            ],
        ),
        (
            "V.npy",
            &[
                "normals",
                text(&folder),
                "-o",
                text(&out),
                "--force",
                "--quiet",
            ],
        ),
    ];
    for (name, args) in commands {
        let mut right = None;
        cut_at_many_moments(args, &folder.join(name), 12, |code, _| {
            let made = std::fs::read(&out).ok();
            if code == Some(0) {
                assert!(right.get_or_insert(made.clone()) == &made, "another output");
            } else {
                assert!(made.is_none(), "{args:?}: an output of half a folder");
            }
            if made.is_some() {
                std::fs::remove_file(&out).expect("the output is removed");
            }
        });
    }
}
