//! Whole builds of small meshes whose vertex ids lie around the boundaries. Renaming vertices in
//! ascending order changes no answer but the names, so the same mesh with small ids tells what
//! to expect.

use crate::common::bench::mixture;
use crate::common::folder::Folder;
use crate::common::npy;
use crate::common::run::cornermill;
use crate::{CORNERS, common::mesh::Mesh};
use cornermill::build::{BuildReport, Builder};
use std::path::Path;

/// Writes V with the ids renamed, builds it in `memory` bytes, and has it verified.
fn build(
    dir: &Path,
    mesh: &Mesh,
    rename: &dyn Fn(u64) -> u64,
    memory: u64,
) -> (Folder, BuildReport) {
    let (v, out) = (dir.join("V.npy"), dir.join("out.ct"));
    let ids = mesh.triangles.as_flattened().iter();
    let bytes: Vec<u8> = ids
        .flat_map(|&id| rename(u64::from(id)).to_le_bytes())
        .collect();
    npy::write(&v, "<u8", mesh.triangles.len(), 3, &bytes);
    let builder = Builder::new(&v).force(true).memory(memory).threads(2);
    let report = builder
        .chunk_triangles(50)
        .build(&out)
        .unwrap_or_else(|e| panic!("{e}"));
    (Folder::read(&out), report)
}

/// Compares all but the names of vertices with a build of the same mesh by small ids.
fn same_but_for_names(near: &Folder, far: &Folder, rename: &dyn Fn(u64) -> u64) {
    let renamed = |ids: Vec<u64>| ids.into_iter().map(rename).collect::<Vec<_>>();
    assert_eq!(far.v.ids(), renamed(near.v.ids()));
    for (near, far) in [
        (&near.o, &far.o),
        (&near.component, &far.component),
        (&near.nonmanifold_corners, &far.nonmanifold_corners),
        (&near.degenerate, &far.degenerate),
    ] {
        assert_eq!(near.ids(), far.ids());
    }
    assert_eq!(
        (near.flips(), &near.components.data),
        (far.flips(), &far.components.data)
    );
    for end in ["lo", "hi"] {
        let (near, far) = (&near.nonmanifold_edges, &far.nonmanifold_edges);
        assert_eq!(far.counts(end), renamed(near.counts(end)));
    }
    let used =
        |f: &Folder| f.count("vertices").unwrap() - f.count("unreferenced_vertices").unwrap();
    assert_eq!(used(near), used(far));
    let mut counts = near.manifest["counts"].clone();
    for name in ["vertices", "unreferenced_vertices"] {
        counts[name] = far.manifest["counts"][name].clone();
    }
    assert_eq!(counts, far.manifest["counts"]);
}

#[test]
fn ids_far_out_change_names_alone() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let mesh = mixture(8);
    let most = *mesh
        .triangles
        .as_flattened()
        .iter()
        .max()
        .expect("a vertex");
    let (near, _) = build(dir.path(), &mesh, &|id| id, 64 << 20);
    let n = u64::from(most) + 1;
    for boundary in CORNERS {
        // In one run across the boundary, and strewn over all ids up to it.
        let run = move |id: u64| boundary - n / 2 + id;
        let strewn = move |id: u64| id * (boundary / n) + boundary % n;
        for rename in [&run as &dyn Fn(u64) -> u64, &strewn] {
            for memory in [8 << 20, 64 << 20] {
                let (far, _) = build(dir.path(), &mesh, rename, memory);
                assert_eq!(far.count("vertices"), Some(rename(n - 1) + 1));
                let width = if rename(n - 1) + 1 < u64::from(u32::MAX) {
                    "u4"
                } else {
                    "u8"
                };
                assert_eq!(
                    (far.v.dtype().as_str(), far.o.dtype().as_str()),
                    (width, width)
                );
                same_but_for_names(&near, &far, rename);
            }
        }
        let out = dir.path().join("out.ct");
        cornermill(["verify".as_ref(), out.as_os_str()]).expect(0);
    }
}

#[test]
fn the_last_id_of_4_bytes_is_two_below_none() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let mesh = crate::common::surfaces::octahedron();
    let none = u64::from(u32::MAX);
    for (last, width) in [
        (none - 2, "u4"),
        (none - 1, "u8"),
        (none, "u8"),
        (none + 1, "u8"),
    ] {
        let rename = |id: u64| last - 5 + id;
        let (far, _) = build(dir.path(), &mesh, &rename, 8 << 20);
        assert_eq!(far.v.dtype(), width, "last id {last}");
        assert_eq!(far.count("vertices"), Some(last + 1));
        assert_eq!(far.count("unreferenced_vertices"), Some(last - 5));
        assert_eq!(far.v.ids().into_iter().max(), Some(last));
        assert_eq!(far.count("closed_components"), Some(1));
    }
}
