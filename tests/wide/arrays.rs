//! Headers, windows, and arrays of the input and of the folder, at far rows.

use crate::by_hand::workspace;
use crate::{CORNERS, bytes_at, place, sparse};
use cornermill::build::arrays::{CoordReader, OutArray, TriangleReader};
use cornermill::build::{Builder, IndexChoice};
use cornermill::disk::{Counters, DataFile, Window};
use cornermill::folder::npy::{DATA_START, Header, header_bytes};
use cornermill::input::{CoordKind, Endian, IndexKind, Request, arrays};
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn open(path: &Path) -> DataFile {
    DataFile::open(path, &Arc::new(Counters::default())).expect("an opened file")
}

fn request(path: PathBuf) -> Request {
    Request {
        path,
        positions: None,
        weld: None,
        coords: None,
        raw_index: None,
        endian: None,
        vertices: None,
        format: None,
        wide: false,
        g_path: PathBuf::from("unused"),
    }
}

#[test]
fn headers_come_back_and_hold_the_file_to_its_length() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    for corners in CORNERS {
        for (descr, item) in [("<u4", 4), ("<u8", 8), ("<f8", 8), (">i8", 8)] {
            let path = dir.path().join("array.npy");
            let rows = corners / 3 + 1;
            let end = place(DATA_START, 3 * rows, item);
            sparse(&path, end, &[(0, header_bytes(descr, &[rows, 3]))]);
            let header = Header::read(&open(&path)).expect("a header");
            assert_eq!((header.descr.as_str(), header.fortran), (descr, false));
            assert_eq!(
                (&header.shape[..], header.data_start),
                (&[rows, 3][..], DATA_START)
            );
            assert_eq!(header.items(), Some(3 * rows));
            let file = std::fs::File::options().write(true).open(&path).unwrap();
            file.set_len(end - 1).unwrap();
            let cut = Header::read(&open(&path))
                .expect_err("one byte less")
                .to_string();
            assert!(cut.contains("only"), "{cut}");
            std::fs::remove_file(&path).unwrap();
        }
    }
    // Products that leave 64 bits, some of which would wrap to lengths that the file has.
    for shape in [
        &[1 << 62, 3][..],
        &[(1 << 62) + 1, 4],
        &[u64::MAX],
        &[1 << 32, 1 << 32],
    ] {
        let path = dir.path().join("array.npy");
        sparse(&path, 1 << 20, &[(0, header_bytes("<u8", shape))]);
        assert!(Header::read(&open(&path)).is_err(), "{shape:?}");
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn windows_show_the_bytes_that_lie_there() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("bytes");
    for corners in CORNERS {
        for item in [4, 8] {
            let at = place(DATA_START, corners, item);
            let marks: Vec<u8> = (1..=100).collect();
            let end = at + 500;
            sparse(&path, end, &[(at - 50, marks.clone())]);
            let file = open(&path);
            for window in [Window::new, Window::populated] {
                let around = window(&file, at - 150, 300).unwrap();
                assert_eq!(around.bytes()[..100], [0; 100]);
                assert_eq!(around.bytes()[100..200], marks);
                assert_eq!(around.bytes()[200..], [0; 100]);
                assert_eq!(window(&file, at, 1).unwrap().bytes(), [51]);
                assert!(window(&file, end, 0).unwrap().bytes().is_empty());
                assert!(window(&file, end - 1, 2).is_err());
                assert!(window(&file, u64::MAX - 1, 2).is_err());
            }
            std::fs::remove_file(&path).unwrap();
        }
    }
}

/// `ids` as an array of this type has them.
fn encode(ids: &[u64], item: u64, big: bool) -> Vec<u8> {
    let one = |id: &u64| {
        let bytes = if big {
            id.to_be_bytes()
        } else {
            id.to_le_bytes()
        };
        let from = if big { 8 - item as usize } else { 0 };
        bytes[from..from + item as usize].to_vec()
    };
    ids.iter().flat_map(one).collect()
}

#[test]
fn triangles_are_read_from_far_rows_of_every_type() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let ws = workspace(dir.path(), 1 << 20);
    for corners in CORNERS {
        for (descr, item, big) in [
            ("<u4", 4, false),
            (">u4", 4, true),
            ("<i4", 4, false),
            ("<u8", 8, false),
            (">u8", 8, true),
            ("<i8", 8, false),
        ] {
            // Six triangles with the corner in their midst, and three at the end of the file.
            let (middle, rows) = (corners / 3 - 2, corners / 3 + 1000);
            let top = if item == 8 { corners } else { (1 << 31) - 20 };
            let ids: Vec<u64> = (top..top + 18).collect();
            let data = encode(&ids, item, big);
            for raw in [false, true] {
                let start = if raw { 0 } else { DATA_START };
                let path = dir.path().join(if raw { "V.raw" } else { "V.npy" });
                let row = |t| place(start, t, 3 * item);
                let mut written = vec![(row(middle), data.clone())];
                written.push((row(rows - 3), data[..9 * item as usize].to_vec()));
                if !raw {
                    written.push((0, header_bytes(descr, &[rows, 3])));
                }
                sparse(&path, row(rows), &written);
                let mut asked = request(path.clone());
                let found = if raw {
                    asked.raw_index = Some(match &descr[1..] {
                        "u4" => IndexKind::U4,
                        "i4" => IndexKind::I4,
                        "u8" => IndexKind::U8,
                        _ => IndexKind::I8,
                    });
                    asked.endian = Some(if big { Endian::Big } else { Endian::Little });
                    arrays::raw(&ws, &asked).expect("raw arrays")
                } else {
                    arrays::npy(&ws, &asked).expect("arrays")
                };
                assert_eq!((found.v.triangles, found.v.at), (rows, start), "{descr}");
                let mut wide = TriangleReader::<u64>::new(&found.v);
                assert_eq!(wide.read(middle, 6).unwrap(), ids, "{descr} at {corners}");
                assert_eq!(wide.read(rows - 3, 3).unwrap(), &ids[..9], "{descr}");
                assert!(wide.read(rows - 3, 4).is_err(), "{descr}: beyond the end");
                if item == 4 {
                    let mut narrow = TriangleReader::<u32>::new(&found.v);
                    let read = narrow.read(middle, 6).unwrap();
                    assert!(read.iter().map(|&id| u64::from(id)).eq(ids.iter().copied()));
                } else if corners > 1 << 32 {
                    // An id that 4 bytes cannot hold is refused by its place, not cut.
                    let mut narrow = TriangleReader::<u32>::new(&found.v);
                    let said = narrow.read(middle, 6).unwrap_err().to_string();
                    assert!(said.contains(&format!("triangle {middle}")), "{said}");
                }
                std::fs::remove_file(&path).unwrap();
            }
        }
    }
}

#[test]
fn coordinates_are_read_from_far_rows() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let ws = workspace(dir.path(), 1 << 20);
    for vertices in CORNERS {
        for (descr, kind, item) in [("<f4", CoordKind::F4, 4), (">f8", CoordKind::F8, 8)] {
            let (v, g) = (dir.path().join("V.npy"), dir.path().join("G.npy"));
            sparse(&v, DATA_START + 12, &[(0, header_bytes("<u4", &[1, 3]))]);
            let row: Vec<u8> = match kind {
                CoordKind::F4 => [1f32, -2.0, 0.5]
                    .iter()
                    .flat_map(|x| x.to_le_bytes())
                    .collect(),
                CoordKind::F8 => [1f64, -2.0, 0.5]
                    .iter()
                    .flat_map(|x| x.to_be_bytes())
                    .collect(),
            };
            let end = place(DATA_START, vertices, 3 * item);
            let last = end - 3 * item;
            sparse(
                &g,
                end,
                &[(0, header_bytes(descr, &[vertices, 3])), (last, row)],
            );
            let mut asked = request(v.clone());
            asked.positions = Some(g.clone());
            let array = arrays::npy(&ws, &asked)
                .expect("arrays")
                .g
                .expect("coordinates");
            assert_eq!((array.vertices, array.kind), (vertices, kind));
            let expected = [[0.0; 3], [1.0, -2.0, 0.5]];
            let mut f4 = CoordReader::<f32>::new(&array);
            let read = f4.read(vertices - 2, 2).unwrap();
            assert_eq!(read, expected.map(|p| p.map(|x| x as f32)));
            let mut f8 = CoordReader::<f64>::new(&array);
            assert_eq!(f8.read(vertices - 2, 2).unwrap(), expected);
            assert!(f8.read(vertices - 1, 2).is_err());
            std::fs::remove_file(&v).unwrap();
            std::fs::remove_file(&g).unwrap();
        }
    }
}

#[test]
fn rows_of_the_folder_are_written_where_they_belong() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let ws = workspace(dir.path(), 1 << 20);
    for corners in CORNERS {
        let rows = corners / 3 + 2;
        let path = dir.path().join("O.npy");
        for item in [4, 8] {
            let descr = if item == 8 { "<u8" } else { "<u4" };
            let array =
                OutArray::create(dir.path(), "O.npy", descr, &[rows, 3], 3 * item, &ws).unwrap();
            let end = place(DATA_START, 3 * rows, item);
            assert_eq!(array.file.len().unwrap(), end);
            // Three corners before the boundary and three after it, by item number.
            let (first, ids) = (corners - 3, [corners - 1, 1, u64::MAX, corners + 7, 2, 3]);
            let bytes = encode(&ids, item, false);
            if item == 8 {
                array.write(first, &ids).unwrap();
                let mut back = [0u64; 6];
                array.read(first, &mut back).unwrap();
                assert_eq!(back, ids);
            } else {
                let ids = ids.map(|id| id as u32);
                array.write(first, &ids).unwrap();
                let mut back = [0u32; 6];
                array.read(first, &mut back).unwrap();
                assert_eq!(back, ids);
            }
            let at = place(DATA_START, first, item);
            assert_eq!(bytes_at(&path, at, bytes.len()), bytes);
            let header = Header::read(&array.file).expect("a header");
            assert_eq!(header.shape, [rows, 3]);
            std::fs::remove_file(&path).unwrap();
        }
    }
}

#[test]
fn a_prediction_counts_in_64_bits() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    for corners in CORNERS {
        for (descr, item) in [("<u4", 4), ("<u8", 8)] {
            let path = dir.path().join("V.npy");
            let t = corners / 3;
            let end = place(DATA_START, 3 * t, item);
            sparse(&path, end, &[(0, header_bytes(descr, &[t, 3]))]);
            for (index, width) in [(IndexChoice::Auto, 4), (IndexChoice::U8, 8)] {
                let width = if 3 * t < u64::from(u32::MAX) {
                    width
                } else {
                    8
                };
                let builder = Builder::new(&path).memory(1 << 30).threads(2).index(index);
                let predicted = builder.predict(&dir.path().join("out.ct")).unwrap();
                assert_eq!(predicted.survey.triangles, t);
                let bytes = |name: &str| {
                    let mut named = predicted.arrays.iter().filter(|f| f.name == name);
                    named.next().expect("an array").bytes
                };
                assert_eq!(bytes("V.npy"), place(DATA_START, 3 * t, width));
                assert_eq!(bytes("O.npy"), bytes("V.npy"));
                assert_eq!(bytes("component.npy"), place(DATA_START, t, width));
                let all: u128 = predicted.arrays.iter().map(|f| u128::from(f.bytes)).sum();
                let slack = u128::from(predicted.output) - all;
                assert!(slack < 64 << 20, "{slack} bytes of manifest");
                let scan = predicted.passes.iter().find(|p| p.name == "scan").unwrap();
                assert!(scan.io.read >= end - DATA_START && scan.io.read < 100 * end);
                // The worst order sorts every corner.
                assert!(predicted.worst_scratch > 3 * t * 16);
                assert!(predicted.worst_scratch < 3 * t * 200);
            }
            std::fs::remove_file(&path).unwrap();
        }
    }
}
