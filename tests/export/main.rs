//! Exports of folders written by hand, read back by naive parsers and compared with a naive
//! selection: every format, both widths, every selection, budgets from the least accepted up.

#[allow(dead_code)]
#[path = "../by_hand/mod.rs"]
mod by_hand;
mod naive;
mod parse;
mod refusals;

use by_hand::{Mesh, tetrahedron, workspace};
use cornermill::Error;
use cornermill::export::{
    ExportCount, ExportRequest, Format, Numbers, Selection, export, export_to, least_memory,
};
use cornermill::folder::Folder;
use naive::{assert_same, naive_export};
use parse::{Parsed, parse};
use std::path::PathBuf;

const FORMATS: [(Format, bool); 6] = [
    (Format::Ply, false),
    (Format::Ply, true),
    (Format::Stl, false),
    (Format::Obj, false),
    (Format::Off, false),
    (Format::Npy, false),
];

/// A folder in a directory of its own.
struct Home {
    dir: tempfile::TempDir,
    path: PathBuf,
}

impl Home {
    fn of(mesh: &Mesh) -> Home {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.ct");
        mesh.write(&path);
        Home { dir, path }
    }

    fn run(&self, memory: u64, request: &ExportRequest) -> Result<ExportCount, Error> {
        let ws = workspace(self.dir.path(), memory);
        let folder = Folder::open(&self.path, &ws.io).unwrap();
        let read = ws.io.now();
        let done = export(&ws, &folder, request);
        assert_eq!(ws.budget.used(), 0);
        assert!(ws.budget.peak() <= memory);
        if let Ok(count) = &done {
            assert_eq!(ws.io.now().written, count.bytes);
            assert!(ws.io.now().read >= read.read);
        }
        done
    }

    fn least(&self, request: &ExportRequest) -> u64 {
        let ws = workspace(self.dir.path(), 0);
        least_memory(&Folder::open(&self.path, &ws.io).unwrap(), request)
    }

    /// Exports to a fresh name and reads everything back.
    fn back(&self, memory: u64, request: &ExportRequest) -> (Parsed, ExportCount, Vec<Vec<u8>>) {
        let mut request = request.clone();
        request.target = self.dir.path().join("out.npy");
        request.force = true;
        let count = self.run(memory, &request).unwrap();
        let files: Vec<Vec<u8>> = count
            .files
            .iter()
            .map(|f| std::fs::read(f).unwrap())
            .collect();
        let total: usize = files.iter().map(Vec::len).sum();
        assert_eq!(total as u64, count.bytes);
        // Of npy with coordinates, V comes last.
        let (main, g) = (files.last().unwrap(), &files[0]);
        let g = (files.len() == 2).then_some(&g[..]);
        (parse(request.format, main, g), count, files)
    }

    /// As `back`, by way of a stream where the format allows: no file, no sync.
    fn quick(&self, memory: u64, request: &ExportRequest) -> (Parsed, ExportCount) {
        if request.format == Format::Npy {
            let (parsed, count, _) = self.back(memory, request);
            return (parsed, count);
        }
        let ws = workspace(self.dir.path(), memory);
        let folder = Folder::open(&self.path, &ws.io).unwrap();
        let mut out = Vec::new();
        let count = export_to(&ws, &folder, request, &mut out).unwrap();
        assert_eq!(out.len() as u64, count.bytes);
        (parse(request.format, &out, None), count)
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.dir.path()).unwrap();
        let name = |e: std::io::Result<std::fs::DirEntry>| e.unwrap().file_name();
        let mut names: Vec<String> = entries.map(|e| name(e).into_string().unwrap()).collect();
        names.sort();
        names
    }
}

fn request((format, ascii): (Format, bool)) -> ExportRequest {
    let mut request = ExportRequest::new(format, "unused");
    request.ascii = ascii;
    request
}

fn selection_of(component: Option<u64>, largest: Option<u64>, least: Option<u64>) -> Selection {
    Selection {
        components: component.map(Numbers::one),
        largest,
        min_triangles: least,
        ..Selection::default()
    }
}

/// Components of 1, 3, 2, 3 and 1 triangles, interleaved, with a degenerate triangle, vertices
/// that nothing names, coordinates of every hard kind, and flips.
fn motley() -> Mesh {
    let mut mesh = Mesh::of(&[
        [0, 1, 2],
        [10, 11, 12],
        [20, 21, 22],
        [12, 11, 13],
        [5, 5, 6],
        [30, 31, 32],
        [22, 21, 23],
        [13, 11, 14],
        [32, 31, 33],
        [33, 31, 34],
        [40, 41, 2],
    ]);
    mesh.vertices = 45;
    mesh.flipped = vec![1, 5, 8, 10];
    let mut mesh = mesh.placed();
    let g = mesh.g.as_mut().unwrap();
    g[0] = [-0.0, 1e-30, -3.25e30];
    g[1] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    g[11] = [1e-5, 16777217.0, 0.1];
    mesh
}

/// Every selection that chooses something in `motley`, and none.
fn selections() -> Vec<[Option<u64>; 3]> {
    let mut all = vec![[None; 3]];
    all.extend((0..5).map(|c| [Some(c), None, None]));
    for least in [None, Some(0), Some(2), Some(3)] {
        all.extend((1..7).map(|k| [None, Some(k), least]));
        all.push([None, None, least]);
    }
    all
}

#[test]
fn every_selection_in_every_format_is_read_back() {
    for (wide, f8) in [(false, false), (true, true), (false, true)] {
        let mesh = Mesh {
            wide,
            f8,
            ..motley()
        };
        let home = Home::of(&mesh);
        for format in FORMATS {
            for [component, largest, min_triangles] in selections() {
                for input_orientation in [false, true] {
                    let request = ExportRequest {
                        selection: selection_of(component, largest, min_triangles),
                        input_orientation,
                        ..request(format)
                    };
                    let (parsed, count) = home.quick(1 << 22, &request);
                    assert_same(&parsed, &mesh, &request);
                    assert_eq!(count.triangles, parsed.triangles.len() as u64);
                    assert_eq!(count.vertices, parsed.points.len() as u64);
                }
            }
        }
    }
}

#[test]
fn counts_types_and_ties() {
    let home = Home::of(&motley());
    let mut two = request((Format::Ply, false));
    two.selection.largest = Some(2);
    let (parsed, count, _) = home.back(1 << 22, &two);
    assert_eq!(parsed.types, ["float", "int"]);
    assert_eq!(
        (count.components, count.triangles, count.vertices),
        (Some(2), 6, 10)
    );
    // Components 1 and 3 have three triangles each: of one, the lower number.
    two.selection.largest = Some(1);
    let (_, count, _) = home.back(1 << 22, &two);
    assert_eq!((count.components, count.triangles), (Some(1), 3));
    let (parsed, _, _) = home.back(1 << 22, &two);
    assert_eq!(
        parsed.points[0],
        motley().g.unwrap()[10].map(|x| f64::from(x as f32))
    );
    // Ids are as narrow as they can be, whatever the folder's width.
    let wide = Home::of(&Mesh {
        wide: true,
        f8: true,
        ..motley()
    });
    let (parsed, count, _) = wide.back(1 << 22, &request((Format::Npy, false)));
    assert_eq!(parsed.types, ["<u4", "<f8"]);
    assert_eq!(count.components, None);
    let names: Vec<_> = count.files.iter().map(|f| f.file_name().unwrap()).collect();
    assert_eq!(names, ["out.G.npy", "out.npy"]);
    let (parsed, _, _) = wide.back(1 << 22, &request((Format::Ply, false)));
    assert_eq!(parsed.types, ["double", "int"]);
}

#[test]
fn normals_follow_the_right_hand_rule() {
    let (parsed, _, _) = Home::of(&tetrahedron()).back(1 << 22, &request((Format::Stl, false)));
    let third = (1.0f32 / 3.0).sqrt();
    assert_eq!(
        parsed.normals[..3],
        [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]
    );
    assert!(parsed.normals[3].iter().all(|x| (x - third).abs() < 1e-6));
    // A triangle without area, and one with a position that is not finite.
    let (parsed, _, _) = Home::of(&motley()).back(1 << 22, &request((Format::Stl, false)));
    assert_eq!(parsed.normals[4], [0.0; 3]);
    assert_eq!(parsed.normals[0], [0.0; 3]);
}

/// Thousands of triangles over many more vertices: near ones, then far ones.
fn large() -> Mesh {
    let n = 150_000u64;
    let mut seed = 1u64;
    let mut random = || {
        seed = seed
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (seed >> 33) % n
    };
    let mut v: Vec<[u64; 3]> = (0..1300)
        .map(|i| [i / 2, i / 2 + 1, i / 2 + 700 + i % 2])
        .collect();
    v.extend((0..1500).map(|_| [random(), random(), random()]));
    let mut mesh = Mesh::of(&v);
    mesh.vertices = n;
    mesh.flipped = (0..2800).filter(|t| t % 3 == 1).collect();
    mesh.placed()
}

#[test]
fn the_least_memory_gives_the_same_bytes_as_ample() {
    let mesh = large();
    let home = Home::of(&mesh);
    for format in FORMATS {
        for selection in [[None; 3], [None, Some(40), None], [None, None, Some(2)]] {
            let [component, largest, min_triangles] = selection;
            let request = ExportRequest {
                selection: selection_of(component, largest, min_triangles),
                input_orientation: true,
                ..request(format)
            };
            let least = home.least(&request);
            let (parsed, _, files) = home.back(least, &request);
            assert_same(&parsed, &mesh, &request);
            assert_eq!(home.back(1 << 30, &request).2, files, "{request:?}");
            // Refused at once, with the whole of it, however much is missing.
            for little in [0, 1 << 10, least / 2, least - 1] {
                match home.run(little, &named(&home, &request)) {
                    Err(Error::Budget { need, have, .. }) => {
                        assert_eq!((need, have), (least, little));
                    }
                    other => panic!("{other:?}"),
                }
            }
            // Nothing of the size of the mesh but the marks: 9/64 byte a vertex.
            assert!(least < 700 << 10, "{least}");
        }
    }
}

#[test]
fn ids_just_within_and_beyond_a_read_of_coordinates() {
    // With blocks of 1024 triangles, 4096 rows of G are read at once.
    for far in [4095, 4096, 4097] {
        let mut mesh = Mesh::of(&[[0, 1, far], [far, 1, 2]]);
        mesh.vertices = 5000;
        let mesh = mesh.placed();
        let home = Home::of(&mesh);
        let request = request((Format::Stl, false));
        let (parsed, _) = home.quick(home.least(&request), &request);
        assert_same(&parsed, &mesh, &request);
    }
}

fn named(home: &Home, request: &ExportRequest) -> ExportRequest {
    ExportRequest {
        target: home.dir.path().join("named"),
        ..request.clone()
    }
}

#[test]
fn an_empty_mesh_and_one_without_coordinates() {
    for mesh in [Mesh::of(&[]).placed(), Mesh::of(&[[1, 1, 1]]).placed()] {
        let home = Home::of(&mesh);
        for format in FORMATS {
            let (parsed, _, _) = home.back(1 << 22, &request(format));
            assert_same(&parsed, &mesh, &request(format));
            let mut one = named(&home, &request(format));
            one.selection.largest = Some(1);
            let said = home.run(1 << 22, &one).unwrap_err().to_string();
            assert!(said.contains("no component to choose"), "{said}");
        }
    }
    let mesh = Mesh {
        g: None,
        ..motley()
    };
    let home = Home::of(&mesh);
    for format in FORMATS {
        let mut request = request(format);
        if format.0 == Format::Npy {
            let (_, count, _) = home.back(1 << 22, &request);
            assert_eq!((count.files.len(), count.vertices), (1, 0));
            request.selection.largest = Some(2);
            let (parsed, _, _) = home.back(1 << 22, &request);
            assert_eq!(parsed.triangles, naive_export(&motley(), &request).1);
        } else {
            let said = home
                .run(1 << 22, &named(&home, &request))
                .unwrap_err()
                .to_string();
            assert!(said.contains("only npy can be written"), "{said}");
        }
    }
}

#[test]
fn a_stream_has_the_bytes_of_the_file() {
    let home = Home::of(&motley());
    for format in FORMATS {
        let request = ExportRequest {
            selection: selection_of(None, Some(3), None),
            ..request(format)
        };
        let ws = workspace(home.dir.path(), 1 << 22);
        let folder = Folder::open(&home.path, &ws.io).unwrap();
        let mut out = Vec::new();
        let done = export_to(&ws, &folder, &request, &mut out);
        if format.0 == Format::Npy {
            assert!(done.unwrap_err().to_string().contains("instead of -"));
            continue;
        }
        let (_, count, files) = home.back(1 << 22, &request);
        assert_eq!(out, files[0]);
        assert_eq!(
            done.unwrap(),
            ExportCount {
                files: vec![],
                ..count
            }
        );
    }
    let said = home
        .run(1 << 22, &ExportRequest::new(Format::Npy, "-"))
        .unwrap_err();
    assert!(said.to_string().contains("instead of -"));
}
