//! Files that keep the order of their folder: V and G come back byte for byte.

use super::common::formats::write_npy;
use super::common::mesh::Mesh;
use super::common::run::cornermill;
use super::common::{bench, surfaces, zoo};
use super::{Case, told_apart, workspace};
use cornermill::Error;
use cornermill::build::{Builder, IndexChoice};
use cornermill::codec::decode::decode;
use cornermill::codec::encode::{EncodeRequest, encode};
use cornermill::codec::grid::Precision;
use cornermill::codec::packed::Packed;
use cornermill::folder::{Folder, Orient};
use std::fs::read;

/// Encodes with the order; the file's bytes and what it costs.
fn encoded(case: &Case, most: u64, (memory, threads): (u64, usize)) -> (Vec<u8>, u64) {
    let ws = workspace(case.dir.path(), memory, threads);
    let mut request = EncodeRequest::new(case.path("m.cmz"), Precision::Exact);
    (request.most, request.force, request.keep_order) = (most, true, true);
    let folder = Folder::open(&case.folder, &ws.io).unwrap();
    let count = encode(&ws, &folder, &request).unwrap();
    assert_eq!(ws.budget.used(), 0, "the budget is not given back");
    (read(case.path("m.cmz")).unwrap(), count.order)
}

/// Decodes to V and G, as bytes.
fn decoded(case: &Case, (memory, threads): (u64, usize)) -> Result<[Vec<u8>; 2], Error> {
    let ws = workspace(case.dir.path(), memory, threads);
    let (v, g) = (case.path("back.V.npy"), case.path("back.G.npy"));
    [&v, &g].iter().for_each(|f| _ = std::fs::remove_file(f));
    let packed = Packed::open(&ws.budget, &ws.io, &case.path("m.cmz"))?;
    decode(&ws, &packed, &v, &g)?;
    drop(packed);
    assert_eq!(ws.budget.used(), 0, "the budget is not given back");
    Ok([read(v).unwrap(), read(g).unwrap()])
}

fn comes_back(mesh: &Mesh, index: IndexChoice, most: u64) {
    let case = Case::new(mesh, index);
    let (file, _) = encoded(&case, most, (64 << 20, 2));
    assert!(
        file == encoded(&case, most, (40 << 20, 3)).0,
        "{}",
        mesh.name
    );
    // A folder of wide ids comes back with narrow ones: the file does not know of it.
    let narrow = Case::new(mesh, IndexChoice::Auto);
    let array = |name| read(narrow.folder.join(name)).unwrap();
    let expected = [array("V.npy"), array("G.npy")];
    for room in [(64 << 20, 2), (24 << 20, 1)] {
        assert!(decoded(&case, room).unwrap() == expected, "{}", mesh.name);
    }
}

#[test]
fn the_zoo_comes_back_row_by_row() {
    for mesh in zoo::all() {
        comes_back(&told_apart(mesh.clone()), IndexChoice::Auto, 1 << 20);
        // Without the bits that tell vertices apart, too: rows are named by their numbers alone.
        comes_back(&mesh, IndexChoice::U8, 3);
    }
}

#[test]
fn orders_that_do_not_help_come_back() {
    let mesh = bench::mixture(20);
    comes_back(&mesh, IndexChoice::Auto, 300);
    comes_back(&bench::shuffled(&mesh), IndexChoice::U8, 200);
}

/// An order is dear when it is none, and cheap when it is the surface's.
#[test]
fn what_an_order_costs_is_told() {
    let mesh = surfaces::torus(60, 80);
    let [plain, shuffled] = [mesh.clone(), bench::shuffled(&mesh)].map(|mesh| {
        let case = Case::new(&mesh, IndexChoice::Auto);
        encoded(&case, 1 << 20, (64 << 20, 1)).1
    });
    let triangles = mesh.triangles.len() as u64;
    assert!(plain < triangles, "{plain} bytes");
    assert!(shuffled > 3 * plain, "{shuffled} and {plain} bytes");
}

/// A triangle that comes twice, so that another never does, is no order.
#[test]
fn an_order_with_a_number_twice_is_refused() {
    let case = Case::new(&told_apart(surfaces::torus(6, 8)), IndexChoice::Auto);
    let other = Case::new(&told_apart(surfaces::torus(6, 8)), IndexChoice::Auto);
    encoded(&case, 20, (64 << 20, 1));
    let good = read(case.path("m.cmz")).unwrap();
    // The numbers of one chunk in the place of another's, which has as many.
    let changed = super::refusals::with_numbers_twice(&good);
    std::fs::write(other.path("m.cmz"), changed).unwrap();
    let refused = decoded(&other, (64 << 20, 1)).unwrap_err().to_string();
    assert!(refused.contains("twice or never"), "{refused}");
}

#[test]
fn the_command_keeps_an_order() {
    let mesh = bench::shuffled(&told_apart(bench::mixture(8)));
    let dir = tempfile::tempdir().unwrap();
    let (v, g) = write_npy(&mesh, dir.path());
    let folder = dir.path().join("mesh.ct");
    let builder = Builder::new(&v).positions(&g).orient(Orient::Keep);
    builder.build(&folder).unwrap();
    let path = |name: &str| dir.path().join(name).display().to_string();
    let said = cornermill([
        "encode",
        &path("mesh.ct"),
        "-o",
        &path("m.cmz"),
        "--exact",
        "--keep-order",
    ]);
    let said = said.expect(0).stdout;
    assert!(
        said.contains("order ") && said.contains("bits a triangle"),
        "{said}"
    );
    let info = cornermill(["info", &path("m.cmz")]).expect(0).stdout;
    assert!(info.contains("\norder "), "{info}");
    cornermill(["decode", &path("m.cmz"), "-o", &path("back.ct"), "-q"]).expect(0);
    for name in ["V.npy", "G.npy", "O.npy", "component.npy", "components.npy"] {
        let [a, b] = ["mesh.ct", "back.ct"].map(|f| read(dir.path().join(f).join(name)).unwrap());
        assert!(a == b, "{name}");
    }
    // A part has numbers of its own.
    cornermill([
        "decode",
        &path("m.cmz"),
        "-o",
        &path("part.ct"),
        "--component",
        "0",
        "-q",
    ])
    .expect(0);
    cornermill(["verify", &path("part.ct")]).expect(0);
}
