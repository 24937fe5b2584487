//! Files that version 1 wrote: they must be read for ever, and are what is written still.

use super::common::mesh::Mesh;
use super::common::surfaces;
use super::{Case, canonical, workspace};
use cornermill::build::IndexChoice;
use cornermill::codec::Level;
use cornermill::codec::encode::{EncodeRequest, encode};
use cornermill::codec::grid::Precision;
use cornermill::folder::Folder;

/// A torus, a Moebius strip, triangles that name a vertex twice, vertices that none names; all
/// coordinates whole numbers.
fn mesh() -> Mesh {
    let torus = surfaces::torus(12, 16);
    let mut mesh = torus.plus(&surfaces::moebius(11)).plus(&surfaces::disk(7));
    mesh.triangles.push([3, 3, 5]);
    mesh.triangles.push([200, 60, 200]);
    for v in 0..mesh.positions.len() as i64 {
        let noise = v * 7919 % 13 - 6;
        let (x, y) = (v % 16 * 50 + noise, v / 16 * 40 - noise);
        mesh.positions[v as usize] = [x as f32, y as f32, (x * y % 97 + v) as f32];
    }
    mesh.positions.push([-400.0, 900.0, 30.0]);
    mesh.positions.push([11.0, 12.0, 13.0]);
    mesh.renamed("golden")
}

/// Name, level, the most triangles of a chunk, whether the order is kept, bytes.
const FILES: [(&str, Level, u64, bool, &[u8]); 4] = [
    (
        "fast",
        Level::Fast,
        1 << 20,
        false,
        include_bytes!("golden/fast.cmz"),
    ),
    (
        "strong",
        Level::Strong,
        1 << 20,
        false,
        include_bytes!("golden/strong.cmz"),
    ),
    (
        "chunks",
        Level::Fast,
        100,
        false,
        include_bytes!("golden/chunks.cmz"),
    ),
    (
        "ordered",
        Level::Fast,
        100,
        true,
        include_bytes!("golden/ordered.cmz"),
    ),
];

#[test]
fn files_of_version_1_are_read_and_written_as_ever() {
    for index in [IndexChoice::Auto, IndexChoice::U8] {
        let case = Case::new(&mesh(), index);
        for (name, level, most, keep_order, golden) in FILES {
            let ws = workspace(case.dir.path(), 64 << 20, 2);
            let mut request = EncodeRequest::new(case.path("now.cmz"), Precision::Step(1.0));
            (request.level, request.most) = (level, most);
            (request.keep_order, request.force) = (keep_order, true);
            let folder = Folder::open(&case.folder, &ws.io).unwrap();
            encode(&ws, &folder, &request).unwrap();
            let now = std::fs::read(case.path("now.cmz")).unwrap();
            assert!(
                now == golden,
                "{name} is written otherwise than by version 1"
            );
            std::fs::write(case.path("golden.cmz"), golden).unwrap();
            let (found, points) = case.decode("golden.cmz", 1);
            let mesh = mesh();
            let at = |p: &[u8]| {
                let p = p.as_chunks::<4>().0;
                [0, 1, 2].map(|k| f32::from_le_bytes(p[k]))
            };
            let id = |v: u64| {
                let p = at(&points[v as usize]);
                let same = |q: &[f32; 3]| *q == p;
                mesh.positions
                    .iter()
                    .position(same)
                    .expect("a vertex of ours") as u64
            };
            let found: Vec<[u64; 3]> = found.into_iter().map(|t| t.map(id)).collect();
            let folder = super::triangles(&case.folder.join("V.npy"));
            if keep_order {
                assert_eq!(found, folder);
            }
            assert_eq!(canonical(found), canonical(folder), "{name}");
            assert_eq!(points.len(), mesh.positions.len(), "{name}");
        }
    }
}
