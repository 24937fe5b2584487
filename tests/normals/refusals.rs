//! What is refused, with its exit code and its words, and nothing left behind.

use crate::Home;
use crate::common::run::{Run, cornermill};
use crate::common::surfaces;
use cornermill::measure::normals::least_memory;

impl Home {
    fn command(&self, options: &[&str]) -> Run {
        let mut args = vec!["normals".into(), self.folder.clone().into_os_string()];
        args.extend(["--threads", "1"].map(Into::into));
        args.extend(options.iter().map(Into::into));
        cornermill(args)
    }

    /// Names beside the folder, and in it.
    fn names(&self) -> Vec<String> {
        let list = |dir| std::fs::read_dir(dir).unwrap();
        let both = list(self.dir.path()).chain(list(&self.folder));
        let mut names: Vec<String> = both
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn refuses(&self, options: &[&str], code: i32, words: &str) {
        let before = self.names();
        let run = self.command(options).expect(code);
        assert!(run.stderr.contains(words), "no {words:?} in {run}");
        assert_eq!(self.names(), before, "{run}");
    }
}

#[test]
fn names_that_must_not_be_written() {
    let home = Home::of(&surfaces::octahedron(), &[]);
    let (mesh, inside) = (home.folder.clone(), home.folder.join("V.npy"));
    let v = std::fs::read(&inside).unwrap();
    let inside = inside.to_str().unwrap();
    home.refuses(&["-o", inside], 2, "lies in the mesh folder");
    home.refuses(&["-o", inside, "--force"], 2, "lies in the mesh folder");
    let new = home.folder.join("N.npy");
    home.refuses(&["-o", new.to_str().unwrap()], 2, "lies in the mesh folder");
    home.refuses(&["-o", "/no/such/place"], 4, "/no/such");
    let same = format!("--triangles={}", home.file("N.npy").display());
    let one = home.file("N.npy");
    home.refuses(
        &["-o", one.to_str().unwrap(), &same],
        2,
        "would be written twice",
    );
    let taken = format!("--triangles={inside}");
    home.refuses(&[&taken, "--force"], 2, "lies in the mesh folder");
    assert_eq!(std::fs::read(inside).unwrap(), v);
    home.command(&["--triangles"]).expect(0);
    let beside = [mesh.with_extension("N.npy"), mesh.with_extension("NT.npy")];
    assert!(beside.iter().all(|file| file.exists()));
    home.refuses(&[], 2, "exists");
    home.command(&["--force"]).expect(0);
    cornermill(["verify".as_ref(), mesh.as_os_str()]).expect(0);
}

#[test]
fn too_little_memory_and_no_coordinates() {
    let home = Home::of(&surfaces::torus(20, 20), &[]);
    let least = least_memory(1).div_ceil(1024);
    let memory = |kib: u64| format!("--memory={kib}KiB");
    home.refuses(&[&memory(least - 1)], 5, &format!("--memory {least}KiB"));
    home.command(&[&memory(least)]).expect(0);
    let alone = tempfile::tempdir().unwrap();
    let v = alone.path().join("v.npy");
    crate::common::formats::write_npy_v(&surfaces::octahedron(), &v, "u4");
    let out = alone.path().join("v.ct");
    cornermill([
        "build".as_ref(),
        v.as_os_str(),
        "-o".as_ref(),
        out.as_os_str(),
    ])
    .expect(0);
    let run = cornermill(["normals".as_ref(), out.as_os_str()]).expect(2);
    assert!(run.stderr.contains("no coordinates"), "{run}");
}

#[test]
fn a_vertex_that_does_not_exist() {
    let home = Home::of(&surfaces::torus(20, 20), &[]);
    let path = home.folder.join("V.npy");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[4096 + 12 * 77 + 4..][..4].copy_from_slice(&400u32.to_le_bytes());
    std::fs::write(&path, bytes).unwrap();
    for way in [&["--way", "chunks"][..], &[]] {
        home.refuses(way, 3, "triangle 77");
    }
}
