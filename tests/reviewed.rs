//! One test for each fault that a review found: inputs replaced, ids without bound.

mod common;

use common::run::cornermill;
use std::fs;
use std::path::Path;

/// A `.npy` file of one triangle with these 8-byte ids.
fn triangle(path: &Path, ids: [u64; 3]) {
    let mut head = b"{'descr': '<u8', 'fortran_order': False, 'shape': (1, 3), }".to_vec();
    head.resize(118 - 1, b' ');
    head.push(b'\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((head.len() as u16).to_le_bytes());
    file.extend(head);
    ids.iter().for_each(|id| file.extend(id.to_le_bytes()));
    fs::write(path, file).unwrap();
}

fn build(input: &Path, output: &Path, options: &[&str]) -> common::run::Run {
    let mut args = vec!["build".into(), input.into(), "-o".into(), output.into()];
    args.extend(options.iter().map(std::ffi::OsString::from));
    cornermill(args)
}

#[test]
fn force_replaces_neither_the_input_nor_other_folders() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = dir.path().join("a.npy");
    triangle(&mesh, [0, 1, 2]);
    let before = fs::read(&mesh).unwrap();
    build(&mesh, &mesh, &["--force", "--quiet"]).expect(2);
    assert_eq!(fs::read(&mesh).unwrap(), before);
    let precious = dir.path().join("precious");
    fs::create_dir(&precious).unwrap();
    fs::write(precious.join("data"), "x").unwrap();
    build(&mesh, &precious, &["--force", "--quiet"]).expect(2);
    assert!(precious.join("data").exists());
    // A mesh folder is replaced, but not with the input in it.
    let folder = dir.path().join("a.ct");
    build(&mesh, &folder, &["--quiet"]).expect(0);
    build(&mesh, &folder, &["--quiet"]).expect(2);
    build(&mesh, &folder, &["--quiet", "--force"]).expect(0);
    build(&folder.join("V.npy"), &folder, &["--quiet", "--force"]).expect(2);
    cornermill(["verify".as_ref(), folder.as_os_str()]).expect(0);
}

#[test]
fn ids_beyond_every_mesh_are_refused_and_far_ones_are_not_counted_one_by_one() {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, out) = (dir.path().join("a.npy"), dir.path().join("a.ct"));
    for far in [1 << 62, u64::MAX - 1] {
        triangle(&mesh, [0, 1, far]);
        build(&mesh, &out, &["--quiet"]).expect(3);
    }
    triangle(&mesh, [0, 1, 2]);
    build(
        &mesh,
        &out,
        &["--quiet", "--vertices", "18446744073709551615"],
    )
    .expect(3);
    triangle(&mesh, [0, 1, 1 << 55]);
    build(&mesh, &out, &["--quiet", "--memory", "64MiB"]).expect(0);
    let info = cornermill(["info".as_ref(), out.as_os_str(), "--json".as_ref()]).expect(0);
    let unreferenced = (1u64 << 55) + 1 - 3;
    assert!(
        info.stdout
            .contains(&format!("\"unreferenced_vertices\": {unreferenced},"))
    );
}

#[test]
fn narrow_indices_are_refused_where_they_cannot_number_the_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, out) = (dir.path().join("a.npy"), dir.path().join("a.ct"));
    triangle(&mesh, [0, 1, (1 << 32) + 5]);
    build(&mesh, &out, &["--quiet", "--index", "u4"]).expect(2);
    assert!(!out.exists());
}
