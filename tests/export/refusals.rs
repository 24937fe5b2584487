//! What is refused, or fails: said in words that name it, and nothing is left behind.

use crate::by_hand::{Mesh, tetrahedron, workspace};
use crate::{FORMATS, Home, motley, named, request, selection_of};
use cornermill::Error;
use cornermill::disk::Progress;
use cornermill::export::{ExportRequest, Format, Strip, export, export_strip, export_to};
use cornermill::folder::Folder;
use std::path::{Path, PathBuf};
use std::sync::Arc;

struct Full;

impl std::io::Write for Full {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(std::io::ErrorKind::StorageFull.into())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_stream_that_fails_is_named() {
    let home = Home::of(&motley());
    let ws = workspace(home.dir.path(), 1 << 22);
    let folder = Folder::open(&home.path, &ws.io).unwrap();
    let request = ExportRequest::new(Format::Ply, "-");
    let error = export_to(&ws, &folder, &request, &mut Full).unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
    assert!(error.to_string().starts_with("-: cannot write"), "{error}");
}

#[test]
fn what_makes_no_sense_is_refused_and_leaves_nothing() {
    let home = Home::of(&motley());
    let base = ExportRequest::new(Format::Ply, home.dir.path().join("out.ply"));
    let cases: Vec<(ExportRequest, &str)> = vec![
        (
            ExportRequest {
                selection: selection_of(Some(5), None, None),
                ..base.clone()
            },
            "no component 5: the mesh has 5, numbered 0 to 4",
        ),
        (
            ExportRequest {
                selection: selection_of(None, None, Some(4)),
                ..base.clone()
            },
            "none of the 5 components meets the selection",
        ),
        (
            ExportRequest {
                selection: selection_of(None, Some(0), None),
                ..base.clone()
            },
            "--largest 0",
        ),
        (
            ExportRequest {
                format: Format::Stl,
                ascii: true,
                ..base.clone()
            },
            "--ascii is for ply",
        ),
        (
            ExportRequest {
                target: home.path.join("V.npy"),
                force: true,
                ..base.clone()
            },
            "lies in the mesh folder",
        ),
        (
            ExportRequest {
                target: home.dir.path().join("no/out.ply"),
                ..base.clone()
            },
            "cannot write there",
        ),
    ];
    for (request, words) in cases {
        let said = home.run(1 << 22, &request).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
        assert_eq!(home.names(), ["m.ct"], "{said}");
    }
}

#[test]
fn an_existing_file_stays_unless_forced() {
    let home = Home::of(&tetrahedron());
    let target = home.dir.path().join("out.npy");
    let g = home.dir.path().join("out.G.npy");
    for taken in [&target, &g] {
        std::fs::write(taken, "mine").unwrap();
        let mut request = ExportRequest::new(Format::Npy, &target);
        let said = home.run(1 << 22, &request).unwrap_err();
        assert!(matches!(said, Error::Usage(_)));
        assert!(said.to_string().contains("exists; give --force"), "{said}");
        assert_eq!(std::fs::read(taken).unwrap(), b"mine");
        assert_eq!(home.names().len(), 2);
        request.force = true;
        home.run(1 << 22, &request).unwrap();
        assert_ne!(std::fs::read(taken).unwrap(), b"mine");
        std::fs::remove_file(&target).unwrap();
        std::fs::remove_file(&g).unwrap();
    }
}

/// Puts a file under a name when the first pass begins.
struct Rival(PathBuf);

impl Progress for Rival {
    fn begin(&self, _: &'static str, _: &'static str, _: u64) {
        std::fs::write(&self.0, "rival").unwrap();
    }
    fn advance(&self, _: u64) {}
    fn usage(&self, _: u64, _: u64) {}
    fn end(&self) {}
    fn note(&self, _: &str) {}
}

#[test]
fn a_file_that_appears_meanwhile_stays() {
    let home = Home::of(&tetrahedron());
    let target = home.dir.path().join("out.ply");
    let mut ws = workspace(home.dir.path(), 1 << 22);
    ws.progress = Arc::new(Rival(target.clone()));
    let folder = Folder::open(&home.path, &ws.io).unwrap();
    let mut request = ExportRequest::new(Format::Ply, &target);
    let said = export(&ws, &folder, &request).unwrap_err().to_string();
    assert!(said.contains("exists; give --force"), "{said}");
    assert_eq!(std::fs::read(&target).unwrap(), b"rival");
    assert_eq!(home.names(), ["m.ct", "out.ply"]);
    request.force = true;
    export(&ws, &folder, &request).unwrap();
    assert!(std::fs::read(&target).unwrap().starts_with(b"ply"));
}

#[test]
fn the_file_has_the_permissions_of_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let home = Home::of(&tetrahedron());
    let mode = |p: &Path| std::fs::metadata(p).unwrap().permissions().mode();
    let (plain, out) = (
        home.dir.path().join("plain"),
        home.dir.path().join("out.off"),
    );
    std::fs::write(&plain, "").unwrap();
    home.run(1 << 22, &ExportRequest::new(Format::Off, &out))
        .unwrap();
    assert_eq!(mode(&out), mode(&plain));
}

#[test]
fn a_coordinate_too_large_for_stl_is_refused() {
    let mut mesh = Mesh {
        f8: true,
        ..tetrahedron()
    };
    mesh.g.as_mut().unwrap()[2][1] = -1e39;
    let home = Home::of(&mesh);
    let request = ExportRequest::new(Format::Stl, home.dir.path().join("out.stl"));
    let said = home.run(1 << 22, &request).unwrap_err().to_string();
    assert!(said.contains("vertex 2 has -1e39; export to ply"), "{said}");
    assert_eq!(home.names(), ["m.ct"]);
}

/// Overwrites bytes of one of the arrays, from the start of its data.
fn patch(home: &Home, name: &str, at: usize, bytes: &[u8]) {
    let path = home.path.join(name);
    let mut file = std::fs::read(&path).unwrap();
    file[4096 + at..][..bytes.len()].copy_from_slice(bytes);
    std::fs::write(&path, file).unwrap();
}

#[test]
fn a_damaged_folder_is_named() {
    let none = [255; 4];
    for (name, at, bytes, largest, words) in [
        (
            "V.npy",
            4 * 16,
            [45, 0, 0, 0],
            2,
            "V.npy: triangle 5: expected a vertex below 45, found 45",
        ),
        (
            "V.npy",
            4 * 2,
            none,
            5,
            "V.npy: triangle 0: expected a vertex below 45",
        ),
        (
            "component.npy",
            4 * 3,
            [5, 0, 0, 0],
            2,
            "component.npy: triangle 3: expected a component below 5",
        ),
        (
            "component.npy",
            4 * 3,
            [2, 0, 0, 0],
            2,
            "expected 6 triangles with the chosen labels",
        ),
        (
            "component.npy",
            4 * 3,
            none,
            5,
            "expected 10 triangles with the chosen labels",
        ),
        (
            "components.npy",
            116 + 8,
            [9, 0, 0, 0],
            2,
            "expected 12 triangles with the chosen labels",
        ),
    ] {
        let home = Home::of(&motley());
        patch(&home, name, at, &bytes);
        for format in FORMATS {
            let mut request = named(&home, &request(format));
            request.selection.largest = Some(largest);
            let error = home.run(1 << 22, &request).unwrap_err();
            assert!(matches!(error, Error::Input(_)), "{error}");
            assert!(error.to_string().contains(words), "{error}");
            assert_eq!(home.names(), ["m.ct"]);
        }
    }
}

/// Says that it has three triangles, and has two.
struct Short;

impl Strip for Short {
    fn count(&self) -> u64 {
        3
    }
    fn each(
        &mut self,
        f: &mut dyn FnMut([u64; 3]) -> cornermill::Result<()>,
    ) -> cornermill::Result<()> {
        (0..2).try_for_each(|_| f([0, 1, 2]))
    }
}

#[test]
fn triangles_that_a_list_keeps_back_are_missed() {
    let home = Home::of(&motley());
    for format in [Format::Ply, Format::Stl] {
        let ws = workspace(home.dir.path(), 1 << 22);
        let folder = Folder::open(&home.path, &ws.io).unwrap();
        let request = ExportRequest::new(format, home.dir.path().join("short"));
        let error = export_strip(&ws, &folder, &request, &mut Short).unwrap_err();
        let said = error.to_string();
        assert!(
            said.contains("was given 3 triangles, and accounts for 2"),
            "{said}"
        );
        assert!(!home.dir.path().join("short").exists());
    }
}
