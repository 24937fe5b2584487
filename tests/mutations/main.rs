//! Small sound files of every format, changed as somebody's program or hand would change them:
//! counts, lines, words and rows that are wrong, missing, repeated or exchanged, numbers that are
//! none or too large, the end of another file. What each ends in is a refusal or a right result:
//! the targets of `fuzz/` hold the program to that (two ways of building agree, and `verify`
//! passes). They are drawn anew in every run; `PROPTEST_CASES` draws more.

#[path = "../common/mod.rs"]
mod common;
#[path = "../../fuzz/src/lib.rs"]
#[allow(dead_code, reason = "the table of targets is for the corpus")]
mod fuzz;
mod rows;
mod text;

use common::formats::{self, Order};
use common::mesh::Mesh;
use common::surfaces;
use proptest::prelude::*;
use proptest::sample::Index;
use rows::Rows;

/// A closed surface beside one with a border, both small.
fn meshes() -> [Mesh; 2] {
    [
        surfaces::octahedron().plus(&surfaces::disk(4).moved([5.0, 0.0, 0.0])),
        surfaces::torus(3, 3),
    ]
}

/// Cases of a format: each is two builds, or a reading.
fn cases(cases: u32) -> ProptestConfig {
    let asked = std::env::var_os("PROPTEST_CASES").is_some();
    ProptestConfig {
        max_shrink_iters: 200,
        ..if asked {
            ProptestConfig::default()
        } else {
            ProptestConfig::with_cases(cases)
        }
    }
}

/// Hands a changed file to a target, which panics where a promise is broken.
fn held(target: fn(&[u8]), data: &[u8]) -> Result<(), TestCaseError> {
    let held = std::panic::catch_unwind(|| target(data));
    held.map_err(|_| TestCaseError::fail(data.escape_ascii().to_string()))
}

/// The target of a format, and the whole build.
fn read_and_built(target: fn(&[u8]), data: &[u8]) -> Result<(), TestCaseError> {
    held(target, data)?;
    held(fuzz::whole, data)
}

fn changed(bytes: &[Vec<u8>; 2], edits: &[text::Edit]) -> Vec<u8> {
    let [own, other] = bytes.each_ref().map(|b| String::from_utf8_lossy(b));
    text::changed(&own, &other, edits).into_bytes()
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn changed_lines_of_ply(edits in text::edits()) {
        read_and_built(fuzz::ply, &changed(&meshes().map(|m| formats::ply_ascii(&m)), &edits))?;
    }

    #[test]
    fn changed_lines_of_stl(edits in text::edits()) {
        let files = meshes().map(|m| formats::stl_ascii(&m, "\n", 2));
        read_and_built(fuzz::stl, &changed(&files, &edits))?;
    }

    #[test]
    fn changed_lines_of_obj(edits in text::edits()) {
        read_and_built(fuzz::obj, &changed(&meshes().map(|m| formats::obj(&m)), &edits))?;
    }

    #[test]
    fn changed_lines_of_off(edits in text::edits()) {
        read_and_built(fuzz::off, &changed(&meshes().map(|m| formats::off(&m)), &edits))?;
    }

    #[test]
    fn changed_rows_of_ply(
        big in any::<bool>(),
        head in text::few_edits(),
        edits in rows::edits(),
    ) {
        let order = if big { Order::Big } else { Order::Little };
        let [own, other] = meshes().map(|m| formats::ply_binary(&m, order));
        let end = b"end_header\n";
        let mut file = Rows::behind(&own, end, 13, big);
        let other = Rows::behind(&other, end, 13, big);
        file.change(&other, &edits);
        file.head = text::changed(&file.head, &other.head, &head);
        read_and_built(fuzz::ply, &file.bytes())?;
    }

    #[test]
    fn changed_rows_of_stl(count in any::<bool>(), edits in rows::edits()) {
        let [own, other] = meshes().map(|m| formats::stl_binary(&m, "a"));
        // The count of facets, which stands before them, may be changed as well.
        let mut file = Rows::at(&own, if count { 80 } else { 84 }, 50);
        file.change(&Rows::at(&other, 84, 50), &edits);
        held(fuzz::stl, &file.bytes())?;
    }

    #[test]
    fn changed_rows_of_arrays(
        coordinates in any::<bool>(),
        v_head in text::few_edits(),
        g_head in text::few_edits(),
        edits in rows::edits(),
    ) {
        let [own, other] = meshes();
        let array = |descr: &str, rows: usize, data: Vec<u8>| {
            let shape = format!("({rows}, 3)");
            let dict = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
            Rows { head: dict, body: data, row: 12, big: false }
        };
        let v = |m: &Mesh| {
            array("<u4", m.triangles.len(), formats::indices(m, "u4", Order::Little))
        };
        let g = |m: &Mesh| {
            array("<f4", m.positions.len(), formats::coordinates(m, Order::Little))
        };
        let (mut a, mut b) = (v(&own), g(&own));
        let (changed, rest) = if coordinates { (&mut b, g(&other)) } else { (&mut a, v(&other)) };
        changed.change(&rest, &edits);
        a.head = text::changed(&a.head, "{'descr': '>f8'}", &v_head);
        b.head = text::changed(&b.head, "{'descr': '<i8'}", &g_head);
        held(fuzz::npy, &[a.array(), b.array()].concat())?;
    }

    #[test]
    fn changed_manifests(
        edits in prop::collection::vec((any::<Index>(), any::<Index>(), any::<Index>()), 1..4),
        bytes in prop::collection::vec(any::<[u8; 4]>(), 0..3),
    ) {
        let mut text = include_str!("../../fuzz/corpus/manifest/manifest.json").to_owned();
        for (token, other, how) in &edits {
            text = text::changed_token(&text, token, other, how);
        }
        let mut data = text.into_bytes();
        data.push(0);
        data.extend(bytes.as_flattened());
        held(fuzz::manifest, &data)?;
    }

    #[test]
    fn changed_numbers_of_compressed_files(edits in rows::edits()) {
        let own = include_bytes!("../../fuzz/corpus/cmz/small_t_fast");
        let other = include_bytes!("../../fuzz/corpus/cmz/chunks");
        let mut file = Rows::at(own, 0, 8);
        file.change(&Rows::at(other, 0, 8), &edits);
        held(fuzz::cmz, &file.bytes())?;
    }
}

/// The sound files are accepted, so what is refused above is refused for what was changed.
#[test]
fn unchanged_they_are_meshes() {
    for mesh in meshes() {
        let files = [
            ("ply", formats::ply_ascii(&mesh)),
            ("ply", formats::ply_binary(&mesh, Order::Big)),
            ("stl", formats::stl_ascii(&mesh, "\n", 2)),
            ("stl", formats::stl_binary(&mesh, "a")),
            ("obj", formats::obj(&mesh)),
            ("off", formats::off(&mesh)),
        ];
        for (format, bytes) in files {
            let dir = tempfile::tempdir().expect("a folder");
            let (path, out) = (
                dir.path().join(format!("m.{format}")),
                dir.path().join("m.ct"),
            );
            std::fs::write(&path, bytes).expect("a file");
            let built = cornermill::build::Builder::new(&path)
                .memory(16 << 20)
                .build(&out);
            built.unwrap_or_else(|e| panic!("{format}: {e}"));
        }
    }
}
