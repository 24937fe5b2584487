//! What `build` makes is what `verify` proves: two ways to the same numbers that share nothing.

use crate::measures::medley;
use crate::naive::Soup;
use crate::{check, meshes, said};
use cornermill::folder::npy;
use cornermill::verify::{Limits, least_memory};
use std::path::Path;
use std::process::Command;

/// Builds a mesh with the program; `options` may be anything that leaves the folder right.
fn build(soup: &Soup, out: &Path, options: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let (v, g) = (dir.path().join("V.npy"), dir.path().join("G.npy"));
    let put = |path: &Path, dtype: &str, rows: u64, data: Vec<u8>| {
        let header = npy::header_bytes(dtype, &[rows, 3]);
        std::fs::write(path, [header, data].concat()).unwrap();
    };
    let ids = soup.v.iter().flatten();
    let ids = ids.flat_map(|&v| (v as u32).to_le_bytes()).collect();
    put(&v, "<u4", soup.v.len() as u64, ids);
    let mut command = Command::new(env!("CARGO_BIN_EXE_cornermill"));
    command.arg("build").arg(&v).arg("-o").arg(out);
    command.arg("--quiet").args(options);
    if let Some(points) = &soup.g {
        let points = points.iter().flatten();
        let points = points.flat_map(|&x| (x as f32).to_le_bytes()).collect();
        put(&g, "<f4", soup.n, points);
        command.arg("--positions").arg(&g);
    }
    let run = command.output().unwrap();
    let stderr = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{command:?}:\n{stderr}");
}

#[test]
fn accepts_what_build_makes() {
    let mut all: Vec<(String, Soup)> = meshes::all()
        .into_iter()
        .map(|(name, soup)| (name.into(), soup))
        .collect();
    all.push(("medley".into(), medley()));
    all.push(("shuffled medley".into(), meshes::shuffled(&medley(), 7)));
    for seed in 0..60 {
        let (triangles, vertices) = (1 + seed as usize * 3, 4 + seed * seed % 90);
        let soup = meshes::random(seed, triangles, vertices);
        all.push((format!("random {seed}"), soup));
    }
    let ways: [&[&str]; 5] = [
        &["--no-measures"],
        &["--memory", "64MiB"],
        &["--chunk-triangles", "7", "--index", "u8"],
        &["--chunk-triangles", "1", "--threads", "3"],
        &["--orient", "keep"],
    ];
    for (turn, (name, soup)) in all.iter().enumerate() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("OUT.ct");
        build(soup, &out, ways[turn % ways.len()]);
        let limits = Limits {
            chunk: 8,
            ..Limits::default()
        };
        let verdict = check(&out, least_memory(1), 1, limits).unwrap();
        assert!(verdict.ok(), "{name}:\n{}", said(&verdict));
    }
}
