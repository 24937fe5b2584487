//! The read view over a sparse folder: a tetrahedron in the midst of 2^31 to 2^33 corners.

use crate::by_hand::{NONE, tetrahedron};
use crate::{CORNERS, place, sparse};
use cornermill::CornerTable;
use cornermill::corner::{Corner, Vertex};
use cornermill::folder::npy::{DATA_START, header_bytes};
use cornermill::folder::{
    self, Counts, FileEntry, InputEntry, MANIFEST, Manifest, Options, Orient, fits_u4,
};
use std::path::Path;

/// A folder of `triangles` and `vertices`, all of it holes but for a tetrahedron at triangle
/// `first` on the last four vertices.
fn write(folder: &Path, triangles: u64, vertices: u64, first: u64) {
    std::fs::create_dir(folder).expect("a new folder");
    let solid = tetrahedron();
    let item = if fits_u4(triangles, vertices) { 4 } else { 8 };
    let encode = |ids: &[u64]| -> Vec<u8> {
        let bytes = |id: &u64| id.to_le_bytes()[..item as usize].to_vec();
        ids.iter().flat_map(bytes).collect()
    };
    let shift = |id: u64, by: u64| if id == NONE { NONE } else { id + by };
    let v: Vec<u64> = solid.v.concat().iter().map(|v| v + vertices - 4).collect();
    let o: Vec<u64> = solid
        .opposites()
        .iter()
        .map(|&c| shift(c, 3 * first))
        .collect();
    let g: Vec<u8> = solid
        .g
        .expect("coordinates")
        .as_flattened()
        .iter()
        .flat_map(|&x| (x as f32).to_le_bytes())
        .collect();
    let id = if item == 4 { "<u4" } else { "<u8" };
    let row = |width| place(DATA_START, first, width);
    let files = [
        (
            folder::V,
            id,
            vec![triangles, 3],
            3 * item,
            row(3 * item),
            encode(&v),
        ),
        (
            folder::O,
            id,
            vec![triangles, 3],
            3 * item,
            row(3 * item),
            encode(&o),
        ),
        (
            folder::G,
            "<f4",
            vec![vertices, 3],
            12,
            place(DATA_START, vertices - 4, 12),
            g,
        ),
        (
            folder::COMPONENT,
            id,
            vec![triangles],
            item,
            row(item),
            encode(&[7; 4]),
        ),
    ];
    let entries = files
        .into_iter()
        .map(|(name, descr, shape, width, at, data)| {
            let bytes = place(DATA_START, shape[0], width);
            let head = (0, header_bytes(descr, &shape));
            sparse(&folder.join(name), bytes, &[head, (at, data)]);
            FileEntry {
                name: name.into(),
                dtype: descr.into(),
                shape,
                bytes,
                blocks: vec![],
            }
        });
    let manifest = Manifest {
        format: folder::FORMAT.into(),
        version: folder::VERSION,
        conventions: Manifest::conventions(),
        index: id[1..].into(),
        coords: Some("f4".into()),
        options: Options {
            orient: Orient::Keep,
            weld: false,
        },
        counts: Counts {
            triangles,
            vertices,
            components: 8,
            ..Counts::default()
        },
        measures: None,
        input: InputEntry {
            format: "raw".into(),
            files: vec![],
        },
        files: entries.collect(),
        checksum: String::new(),
    };
    std::fs::write(folder.join(MANIFEST), manifest.to_text()).expect("a manifest");
}

#[test]
fn operators_reach_the_far_end() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    // The last is the largest mesh with ids of 4 bytes: its last corner is two below NONE.
    let narrow = 3 * ((u64::from(u32::MAX) - 1) / 3);
    for corners in CORNERS.into_iter().chain([narrow]) {
        let triangles = if corners == narrow {
            corners / 3
        } else {
            corners / 3 + 2
        };
        let vertices = if corners == narrow {
            narrow / 2
        } else {
            corners + 2
        };
        let folder = dir.path().join(format!("{corners}.ct"));
        write(&folder, triangles, vertices, triangles - 4);
        let table = CornerTable::open(&folder).expect("a table");
        assert_eq!(
            (table.triangle_count(), table.vertex_count()),
            (triangles, vertices)
        );
        let solid = tetrahedron();
        for c in 0..12 {
            let corner = table.corner(3 * (triangles - 4) + c).expect("a corner");
            let v = solid.v[c as usize / 3][c as usize % 3];
            assert_eq!(table.v(corner), Vertex::new(vertices - 4 + v));
            let o = table.o(corner).expect("a closed surface");
            let near = solid.opposites()[c as usize];
            assert_eq!(o.id(), 3 * (triangles - 4) + near);
            assert_eq!(table.o(o), Some(corner));
            assert_eq!(table.v(table.n(corner)), table.v(table.p(o)));
            assert_eq!(table.s(corner), table.r(corner).map(Corner::n));
            assert_eq!(
                (table.fan(corner).count(), table.swirl(corner).count()),
                (3, 4)
            );
            assert_eq!(table.component(table.t(corner)), Some(7));
            let place = solid.g.as_ref().expect("coordinates")[v as usize];
            assert_eq!(table.position(table.v(corner)), Some(place));
        }
        assert_eq!(table.corner(3 * triangles), None);
        assert_eq!(table.vertex(vertices), None);
        assert_eq!(
            table.triangles().next_back().map(|t| t.id()),
            Some(triangles - 1)
        );
    }
}
