//! A part of the chunks: the same triangles over the same coordinates as the whole file has there.

use super::common::npy::Npy;
use super::common::run::cornermill;
use super::common::{bench, surfaces};
use super::{Case, canonical, rows, told_apart, triangles, workspace};
use cornermill::Error;
use cornermill::build::IndexChoice;
use cornermill::codec::Level;
use cornermill::codec::decode::decode;
use cornermill::codec::encode::{EncodeRequest, encode};
use cornermill::codec::grid::Precision;
use cornermill::codec::packed::Packed;
use cornermill::codec::part::{Part, decode_part};
use cornermill::export::Numbers;
use cornermill::folder::Folder;
use std::collections::{BTreeMap, BTreeSet};

/// Each vertex by its bytes, each triangle by those of its vertices, which are told apart.
fn named(v: &[[u64; 3]], g: &[Vec<u8>], ids: &BTreeMap<Vec<u8>, u64>) -> Vec<[u64; 3]> {
    canonical(v.iter().map(|t| t.map(|v| ids[&g[v as usize]])).collect())
}

#[test]
fn chunks_come_alone_with_shared_vertices_once() {
    let case = Case::new(
        &bench::shuffled(&told_apart(bench::mixture(12))),
        IndexChoice::Auto,
    );
    let count = case.encode("m.cmz", (Precision::Exact, Level::Fast, 150), (64 << 20, 2));
    let (whole, points) = case.decode("m.cmz", 2);
    let ids: BTreeMap<Vec<u8>, u64> = points.iter().cloned().zip(0..).collect();
    let chunks = count.chunks as usize;
    assert!(chunks > 6);
    for wish in [
        vec![],
        vec![chunks - 1],
        vec![1, 2, 5],
        (0..chunks).step_by(2).collect(),
        (0..chunks).collect(),
    ] {
        let ws = workspace(case.dir.path(), 64 << 20, 1);
        let (v, g) = (case.path("part.V.npy"), case.path("part.G.npy"));
        [&v, &g].iter().for_each(|f| _ = std::fs::remove_file(f));
        let packed = Packed::open(&ws.budget, &ws.io, &case.path("m.cmz")).unwrap();
        let part = Part {
            chunks: wish.clone(),
            component: None,
        };
        let part = decode_part(&ws, &packed, &part, &v, &g).unwrap();
        let (found, at) = (triangles(&v), rows(&g));
        assert_eq!(
            (part.triangles, part.vertices),
            (found.len() as u64, at.len() as u64)
        );
        let mut once = at.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), at.len(), "a shared vertex came twice: {wish:?}");
        // The whole file has the chunks one behind the other.
        let mut expected = Vec::new();
        let mut from = 0;
        for (chunk, entry) in packed.entries.iter().enumerate() {
            let to = from + entry.all_triangles() as usize;
            if wish.contains(&chunk) {
                expected.extend_from_slice(&whole[from..to]);
            }
            from = to;
        }
        assert_eq!(
            named(&found, &at, &ids),
            named(&expected, &points, &ids),
            "{wish:?}"
        );
        drop(packed);
        assert_eq!(ws.budget.used(), 0, "the budget is not given back");
    }
}

/// Of a few components their triangles alone, over their own vertices, each once; of chunks that
/// have none of them nothing is read.
#[test]
fn components_come_alone() {
    let mesh = bench::shuffled(&told_apart(bench::mixture(12)));
    let case = Case::new(&mesh, IndexChoice::Auto);
    case.encode("m.cmz", (Precision::Exact, Level::Fast, 150), (64 << 20, 2));
    let folder_points = rows(&case.folder.join("G.npy"));
    let ids: BTreeMap<Vec<u8>, u64> = folder_points.iter().cloned().zip(0..).collect();
    let v = triangles(&case.folder.join("V.npy"));
    let labels = Npy::read(&case.folder.join("component.npy")).ids();
    let ws = workspace(case.dir.path(), 64 << 20, 1);
    let folder = Folder::open(&case.folder, &ws.io).unwrap();
    let components = folder.manifest().counts.components;
    assert!(components > 8);
    for wish in ["0", "1,3-4", "7", &format!("0-{}", components - 1)] {
        let numbers: Numbers = wish.parse().unwrap();
        let (to_v, to_g) = (case.path("part.V.npy"), case.path("part.G.npy"));
        [&to_v, &to_g]
            .iter()
            .for_each(|f| _ = std::fs::remove_file(f));
        let packed = Packed::open(&ws.budget, &ws.io, &case.path("m.cmz")).unwrap();
        assert_eq!(packed.components(), components);
        let part = Part {
            chunks: (0..packed.entries.len()).collect(),
            component: Some(&|range| numbers.meets(&range)),
        };
        let count = decode_part(&ws, &packed, &part, &to_v, &to_g).unwrap();
        let (found, at) = (triangles(&to_v), rows(&to_g));
        assert_eq!(
            (count.triangles, count.vertices),
            (found.len() as u64, at.len() as u64)
        );
        let of = |t: &[[u64; 3]]| t.as_flattened().iter().copied().collect::<BTreeSet<u64>>();
        let all: BTreeSet<u64> = (0..count.vertices).collect();
        assert_eq!(of(&found), all, "{wish}: vertices that no triangle names");
        assert_eq!(at.iter().collect::<BTreeSet<_>>().len(), at.len(), "{wish}");
        let expected = v
            .iter()
            .zip(&labels)
            .filter(|(_, label)| numbers.has(**label));
        let expected: Vec<[u64; 3]> = expected.map(|(t, _)| *t).collect();
        assert_eq!(named(&found, &at, &ids), canonical(expected), "{wish}");
        drop(packed);
        assert_eq!(ws.budget.used(), 0, "the budget is not given back");
    }
}

/// A component whose number lies in the range of a chunk that has none of it.
#[test]
fn a_part_that_is_empty_is_refused() {
    let mesh = told_apart(bench::mixture(6));
    let case = Case::new(&mesh, IndexChoice::Auto);
    case.encode(
        "m.cmz",
        (Precision::Bits(12), Level::Fast, 60),
        (64 << 20, 2),
    );
    let ws = workspace(case.dir.path(), 64 << 20, 1);
    let packed = Packed::open(&ws.budget, &ws.io, &case.path("m.cmz")).unwrap();
    let path = |name: &str| case.path(name).display().to_string();
    let mut empty = 0;
    for (chunk, entry) in packed.entries.iter().enumerate() {
        for component in entry.components().take(6) {
            let [chunk, component] = [chunk.to_string(), component.to_string()];
            let args = [
                "decode",
                &path("m.cmz"),
                "-o",
                &path("p.npy"),
                "--force",
                "-q",
            ];
            let more = ["--chunk", &chunk, "--component", &component];
            let ran = cornermill(args.iter().chain(&more));
            if ran.code == 2 {
                assert!(ran.stderr.contains("nothing meets"), "{}", ran.stderr);
                empty += 1;
            } else {
                ran.expect(0);
                assert!(!triangles(&case.path("p.npy")).is_empty());
            }
        }
    }
    assert!(empty > 0, "every component was there");
}

/// Refused in little; in what that names it is decoded.
#[test]
fn the_least_budget_that_a_decoder_names_suffices() {
    let mesh = bench::shuffled(&told_apart(bench::mixture(30)));
    let case = Case::new(&mesh, IndexChoice::Auto);
    for (keep_order, most) in [(true, 500), (true, 1 << 20), (false, 500), (false, 1 << 20)] {
        let ws = workspace(case.dir.path(), 64 << 20, 2);
        let mut request = EncodeRequest::new(case.path("m.cmz"), Precision::Exact);
        (request.most, request.force, request.keep_order) = (most, true, keep_order);
        let folder = Folder::open(&case.folder, &ws.io).unwrap();
        encode(&ws, &folder, &request).unwrap();
        let decoded = |memory, threads, component: bool| {
            let ws = workspace(case.dir.path(), memory, threads);
            let (v, g) = (case.path("back.V.npy"), case.path("back.G.npy"));
            [&v, &g].iter().for_each(|f| _ = std::fs::remove_file(f));
            let packed = Packed::open(&ws.budget, &ws.io, &case.path("m.cmz"))?;
            if !component {
                return decode(&ws, &packed, &v, &g);
            }
            let odd = |range: std::ops::Range<u64>| range.end.is_multiple_of(2);
            let part = Part {
                chunks: (0..packed.entries.len()).collect(),
                component: Some(&odd),
            };
            decode_part(&ws, &packed, &part, &v, &g)
        };
        for (threads, component) in [(1, false), (2, false), (1, true)] {
            let how = format!("order {keep_order}, {most} a chunk, {threads} threads, {component}");
            let need = match decoded(1 << 20, threads, component) {
                Err(Error::Budget { need, .. }) => need,
                other => panic!("{how}: {other:?}"),
            };
            decoded(need, threads, component).unwrap_or_else(|e| panic!("{how}: {e}"));
        }
    }
}

#[test]
fn the_command_takes_chunks_boxes_and_components() {
    let case = Case::new(&told_apart(surfaces::torus(20, 30)), IndexChoice::Auto);
    let wish = (Precision::Bits(12), Level::Fast, 150);
    let count = case.encode("m.cmz", wish, (64 << 20, 2));
    let path = |name: &str| case.path(name).display().to_string();
    let (file, out) = (path("m.cmz"), path("part.ct"));
    let decode = |more: &[&str], code| {
        let args = ["decode", &file, "-o", &out, "--force"];
        cornermill(args.iter().chain(more)).expect(code)
    };
    decode(&["--chunk", "0,2-3", "-q"], 0);
    cornermill(["verify", &out]).expect(0);
    let said = decode(&["--bbox=-1e9,-1e9,-1e9,1e9,1e9,1e9"], 0).stdout;
    assert!(
        said.starts_with(&format!("{} triangles", count.triangles)),
        "{said}"
    );
    for more in [&[][..], &["--chunk=0"]] {
        let nowhere = [&["--bbox=1e8,1e8,1e8,1e9,1e9,1e9"], more].concat();
        let refused = decode(&nowhere, 2);
        assert!(refused.stderr.contains("nothing to decode"), "{refused}");
    }
    let said = decode(&["--component", "0"], 0).stdout;
    assert!(
        said.starts_with(&format!("{} triangles", count.triangles)),
        "{said}"
    );
    let refused = decode(&["--component", "0-1"], 2);
    assert!(
        refused.stderr.contains("no component 1"),
        "{}",
        refused.stderr
    );
    let refused = decode(&["--component", "0", "--max-disk", "8KiB"], 4);
    assert!(refused.stderr.contains("disk"), "{}", refused.stderr);
    let refused = decode(&["--chunk", "9999"], 2);
    assert!(refused.stderr.contains("9999"), "{}", refused.stderr);
}
