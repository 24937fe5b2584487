//! Welding against a weld in memory that is too simple to be wrong.

use super::*;
use crate::disk::DataFile;
use crate::error::Error;
use crate::folder::InputEntry;
use crate::input::testing::{bits as bits_of, request, triangles, workspace};
use crate::input::{Endian, IndexKind, Mesh, Reading, Source};
use proptest::prelude::*;
use std::collections::HashMap;

/// V and the bits of G.
type Plain = (Vec<[u64; 3]>, Vec<u64>);

/// Bits that are equal for equal coordinates: those of -0 become those of +0.
fn value(bits: u64, kind: CoordKind) -> u64 {
    let zero = match kind {
        CoordKind::F4 => f32::from_bits(bits as u32) == 0.0,
        CoordKind::F8 => f64::from_bits(bits) == 0.0,
    };
    if zero { 0 } else { bits }
}

/// Ids in order of first use, and the first-used bits.
fn naive(corners: &[[u64; 3]], kind: CoordKind) -> Plain {
    let mut known = HashMap::new();
    let (mut ids, mut g) = (Vec::new(), Vec::new());
    for at in corners {
        let fresh = known.len() as u64;
        let id = *known.entry(at.map(|c| value(c, kind))).or_insert(fresh);
        ids.push(id);
        if id == fresh {
            g.extend(at);
        }
    }
    (ids.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(), g)
}

/// A workspace whose budget is checked at the end.
struct Bench {
    dir: tempfile::TempDir,
    ws: Workspace,
}

impl Bench {
    fn new(memory: u64) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(dir.path(), memory);
        Bench { dir, ws }
    }

    fn soup(&self, corners: &[[u64; 3]], kind: CoordKind, wide: bool, tuning: Tuning) -> Plain {
        match kind {
            CoordKind::F4 => self.soup_of(corners, |c| c as u32, wide, tuning),
            CoordKind::F8 => self.soup_of(corners, |c| c, wide, tuning),
        }
    }

    /// The soup in order, and in units of a few triangles each: both must say the same.
    fn soup_of<B: Bits>(
        &self,
        corners: &[[u64; 3]],
        bits: impl Fn(u64) -> B + Sync,
        wide: bool,
        tuning: Tuning,
    ) -> Plain {
        let mut request = request(self.dir.path(), self.dir.path());
        request.wide = wide;
        let all: Vec<[B; 3]> = corners.iter().map(|at| at.map(&bits)).collect();
        let count = corners.len() as u64 / 3;
        let expected = Expected {
            triangles: count,
            most: Some(count),
        };
        let feed = |soup: &mut dyn Soup<B>| soup.corners(&all);
        let ((), weld) = soup_tuned(&self.ws, expected, feed, tuning).unwrap();
        let welded = weld.finish(&self.ws, &request).unwrap();
        let found = self.welded(welded, wide);
        std::fs::remove_file(&request.g_path).unwrap();

        let unit = 1 + count / 7;
        let units = (count, count.div_ceil(unit));
        let feed = |(): &mut (), soup: &mut dyn Soup<B>, u: u64| {
            soup.begin(u * unit);
            soup.corners(&all[(3 * u * unit) as usize..(3 * count.min((u + 1) * unit)) as usize])
        };
        let weld = if narrow(Some(count), tuning) {
            by_units::<B, u32>(&self.ws, units, tuning, &feed)
        } else {
            by_units::<B, u64>(&self.ws, units, tuning, &feed)
        };
        let welded = weld.finish(&self.ws, &request).unwrap();
        assert!(self.welded(welded, wide) == found, "units differ");
        std::fs::remove_file(&request.g_path).unwrap();
        found
    }

    fn welded(&self, (v, g): Welded, wide: bool) -> Plain {
        assert_eq!(v.kind == IndexKind::U8, wide);
        let vertices = Some(g.vertices);
        self.read_back(Mesh {
            vertices,
            ..mesh(v, Some(g))
        })
    }

    fn read_back(&self, mesh: Mesh) -> Plain {
        let g = mesh.g.as_ref().unwrap();
        assert!(g.placed && g.endian == Endian::Little && g.at == 4096);
        assert_eq!(mesh.vertices, Some(g.vertices));
        assert_eq!(self.ws.budget.used(), 0);
        let plain = (triangles(&mesh), bits_of(&mesh));
        drop(mesh);
        assert_eq!(self.ws.scratch.used(), 0);
        plain
    }

    fn file(&self, name: &str, bytes: &[u8]) -> Source {
        let path = self.dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Source::Named(DataFile::open(&path, &self.ws.io).unwrap())
    }

    /// A mesh whose arrays begin at bytes 7 and 4096 of files.
    fn indexed(
        &self,
        v: &[[u64; 3]],
        g: &[[u64; 3]],
        kinds: (IndexKind, CoordKind),
        endian: Endian,
    ) -> Mesh {
        let bytes = |rows: &[[u64; 3]], width: u64, at: usize| {
            let mut out = vec![0xee; at];
            for value in rows.iter().flatten() {
                let le = value.to_le_bytes();
                let mut le = le[..width as usize].to_vec();
                if endian == Endian::Big {
                    le.reverse();
                }
                out.extend(le);
            }
            out
        };
        let indices = IndexArray {
            source: self.file("v", &bytes(v, kinds.0.bytes(), 7)),
            at: 7,
            kind: kinds.0,
            endian,
            triangles: v.len() as u64,
        };
        let coords = CoordArray {
            source: self.file("placed", &bytes(g, kinds.1.bytes(), 4096)),
            at: 4096,
            kind: kinds.1,
            endian,
            vertices: g.len() as u64,
            placed: false,
        };
        mesh(indices, Some(coords))
    }
}

/// Gives the triangles of a unit.
type Feed<'a, B> = &'a (dyn Fn(&mut (), &mut dyn Soup<B>, u64) -> Result<()> + Sync);

/// Takes units with a stop behind each.
fn by_units<B: Bits, R: Index>(
    ws: &Workspace,
    of: (u64, u64),
    tuning: Tuning,
    feed: Feed<B>,
) -> Welding {
    let mut units = Units::<B, R>::tuned(ws, of, tuning).unwrap();
    let now = Some(std::time::Instant::now());
    while !units.take(ws, now, || Ok(()), feed).unwrap() {}
    units.end().unwrap()
}

/// Welds a mesh.
fn weld(ws: &Workspace, mesh: Mesh, request: &Request) -> Result<Mesh> {
    let mesh = Reading::Unwelded(mesh).finish(ws, request)?;
    assert!(mesh.welded && mesh.polygons_fanned == 3);
    Ok(mesh)
}

fn mesh(v: IndexArray, g: Option<CoordArray>) -> Mesh {
    Mesh {
        v,
        g,
        vertices: None,
        polygons_fanned: 3,
        welded: false,
        entry: InputEntry {
            format: "test".into(),
            files: Vec::new(),
        },
        sums: Vec::new(),
    }
}

/// Coordinates that tempt: both zeros, several NaNs, infinities, neighbours.
fn tempting(i: u64, kind: CoordKind) -> u64 {
    let f4: [u32; 12] = [
        0,
        1 << 31,
        0x7fc0_0000,
        0xffc0_0000,
        0x7fc0_0001,
        0x7f80_0000,
        0xff80_0000,
        0x3f80_0000,
        0x3f80_0001,
        1,
        0x8000_0001,
        0xbf80_0000,
    ];
    match kind {
        CoordKind::F4 => u64::from(f4[i as usize % 12]),
        // The same values, and some that only 8 bytes tell apart.
        CoordKind::F8 => {
            let wide = f64::from(f32::from_bits(f4[i as usize % 12])).to_bits();
            if i.is_multiple_of(5) {
                wide
            } else {
                wide ^ u64::from(i.is_multiple_of(3))
            }
        }
    }
}

fn random(n: usize, spread: u64, kind: CoordKind, seed: u64) -> Vec<[u64; 3]> {
    let mut state = seed;
    let mut next = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        state >> 33
    };
    let mut at = || [0; 3].map(|_| tempting(next() % spread, kind));
    (0..n).map(|_| at()).collect()
}

#[test]
fn soups_of_every_kind_at_every_block_size() {
    for kind in [CoordKind::F4, CoordKind::F8] {
        for (n, spread, seed) in [(0, 1, 1), (3, 60, 2), (300, 3, 3), (3000, 60, 4)] {
            let corners = random(n, spread, kind, seed);
            let expected = naive(&corners, kind);
            for room in [Some(1), Some(2), Some(3), Some(16), Some(100), None] {
                for memory in [LEAST, 64 << 20] {
                    let bench = Bench::new(memory);
                    let tuning = Tuning {
                        room,
                        ..Tuning::default()
                    };
                    for wide in [false, true] {
                        let found = bench.soup(&corners, kind, wide, tuning);
                        assert!(found == expected, "{kind:?} {n} {room:?} {memory} {wide}");
                    }
                    assert!(bench.ws.budget.peak() <= memory);
                }
            }
        }
    }
}

#[test]
fn stored_bits_are_those_of_the_first_use() {
    let bench = Bench::new(LEAST);
    let minus = 1 << 31;
    let corners = [
        [5, minus, 7],
        [5, 0, 7],
        [0, 0, minus],
        [minus, 0, 0],
        [5, minus, 7],
        [9, 9, 9],
    ];
    for room in [1, 2, 6] {
        let tuning = Tuning {
            room: Some(room),
            ..Tuning::default()
        };
        let (v, g) = bench.soup(&corners, CoordKind::F4, false, tuning);
        assert_eq!(v, [[0, 0, 1], [1, 0, 2]]);
        assert_eq!(g, [5, minus, 7, 0, 0, minus, 9, 9, 9]);
    }
}

#[test]
fn indexed_meshes_of_every_kind() {
    let tunings = |rooms: &'static [usize]| {
        let reads = [Some(0), Some(60), None];
        let tuning = move |room| {
            reads.map(|longest_read| Tuning {
                room,
                longest_read,
                ..Tuning::default()
            })
        };
        rooms
            .iter()
            .map(|&r| Some(r))
            .chain([None])
            .flat_map(tuning)
    };
    for (n, kind, index, endian) in [
        (40, CoordKind::F4, IndexKind::U4, Endian::Little),
        (40, CoordKind::F8, IndexKind::I8, Endian::Big),
        (900, CoordKind::F4, IndexKind::I4, Endian::Big),
        (900, CoordKind::F8, IndexKind::U8, Endian::Little),
    ] {
        let g = random(n, 8, kind, 11);
        // Near ids first, then ids from all over.
        let near = (0..n as u64 / 2).map(|t| [t, t + 1, t / 2]);
        let far =
            (0..n as u64).map(|t| [0u64, 1, 2].map(|k| (t * 7919 + k * 104_729) % (n as u64 - 5)));
        // No triangle names a vertex 7k + 6.
        let named = |i: u64| i - u64::from(i % 7 == 6);
        let v: Vec<[u64; 3]> = near.chain(far).map(|t| t.map(named)).collect();
        let corners: Vec<[u64; 3]> = v.iter().flatten().map(|&i| g[i as usize]).collect();
        let expected = naive(&corners, kind);
        for tuning in tunings(&[1, 5, 64]) {
            for memory in [LEAST, 8 << 20] {
                let bench = Bench::new(memory);
                let request = request(bench.dir.path(), bench.dir.path());
                let mesh = bench.indexed(&v, &g, (index, kind), endian);
                let arrays = (mesh.v, mesh.g.unwrap());
                let weld = begin_tuned(&bench.ws, &request, arrays, tuning).unwrap();
                let (v, g) = weld.finish(&bench.ws, &request).unwrap();
                assert_eq!(g.source.data().path(), request.g_path);
                let found = bench.welded((v, g), false);
                assert!(found == expected, "{n} {kind:?} {tuning:?} {memory}");
                assert!(bench.ws.budget.peak() <= memory);
            }
        }
    }
}

#[test]
fn a_placed_g_is_replaced() {
    let bench = Bench::new(LEAST);
    let mut request = request(bench.dir.path(), bench.dir.path());
    request.g_path = bench.dir.path().join("placed");
    let g = [[1, 1, 1], [2, 2, 2], [1, 1, 1], [8, 8, 8]];
    let mut mesh = bench.indexed(
        &[[1, 0, 2]],
        &g,
        (IndexKind::U4, CoordKind::F4),
        Endian::Little,
    );
    mesh.g.as_mut().unwrap().placed = true;
    let mesh = weld(&bench.ws, mesh, &request).unwrap();
    assert_eq!(
        bench.read_back(mesh),
        (vec![[0, 1, 1]], vec![2, 2, 2, 1, 1, 1])
    );
    let mut names: Vec<_> = std::fs::read_dir(bench.dir.path())
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["placed", "v"]);
}

#[test]
fn coordinates_are_converted_first() {
    let bench = Bench::new(LEAST);
    let mut request = request(bench.dir.path(), bench.dir.path());
    let kinds = (IndexKind::U4, CoordKind::F8);
    let near = [[1.0f64, 1.0, 1.0], [1.0, 1.0, 1.0 + 1e-12], [2.0, 0.1, 0.0]];
    let g = near.map(|at| at.map(f64::to_bits));
    request.coords = Some(CoordKind::F4);
    let mesh = weld(
        &bench.ws,
        bench.indexed(&[[0, 1, 2]], &g, kinds, Endian::Little),
        &request,
    )
    .unwrap();
    let f4 = |c: f32| u64::from(c.to_bits());
    let (v, bits) = bench.read_back(mesh);
    assert_eq!(v, [[0, 0, 1]]);
    assert_eq!(bits, [f4(1.0), f4(1.0), f4(1.0), f4(2.0), f4(0.1), f4(0.0)]);
    let large = [g[0], g[1], [1e40f64.to_bits(), 0, 0]];
    let mesh = bench.indexed(&[[0, 1, 2]], &large, kinds, Endian::Little);
    let message = weld(&bench.ws, mesh, &request).unwrap_err().to_string();
    assert!(
        message.contains("vertex 2") && message.contains("1e40") && message.contains("--coords f8"),
        "{message}"
    );
    assert_eq!((bench.ws.budget.used(), bench.ws.scratch.used()), (0, 0));
}

#[test]
fn refusals() {
    let bench = Bench::new(LEAST);
    let request = request(bench.dir.path(), bench.dir.path());
    let weld_of = |v: [u64; 3], kind| {
        let mesh = bench.indexed(
            &[[0, 1, 2], v],
            &[[0; 3]; 3],
            (kind, CoordKind::F4),
            Endian::Big,
        );
        weld(&bench.ws, mesh, &request).unwrap_err().to_string()
    };
    let message = weld_of([0, 3, 1], IndexKind::U4);
    assert!(
        message.contains("triangle 1, corner 1") && message.contains("below 3, found vertex 3"),
        "{message}"
    );
    assert!(weld_of([u64::MAX, 0, 1], IndexKind::I4).contains("found vertex -1"));
    assert!(
        weld_of([0, 1, u64::MAX - 6], IndexKind::I8)
            .contains("corner 2: expected a vertex from 0 to below 3, found vertex -7")
    );
    let mut bare = bench.indexed(&[], &[], (IndexKind::U4, CoordKind::F4), Endian::Little);
    bare.g = None;
    assert!(matches!(
        weld(&bench.ws, bare, &request),
        Err(Error::Usage(_))
    ));
    let tight = Bench::new(LEAST - 1);
    let mesh = tight.indexed(&[], &[], (IndexKind::U4, CoordKind::F4), Endian::Little);
    match weld(&tight.ws, mesh, &request) {
        Err(Error::Budget { need, .. }) => assert_eq!(need, LEAST),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_large_soup_in_the_least_memory_spills() {
    // A grid of 300 x 300 squares, then the same triangles in another order.
    let at = |i: u64, j: u64| [i, j, i * j % 7].map(|c| u64::from((c as f32).to_bits()));
    let mut corners = Vec::new();
    for n in 0..90_000u64 {
        for n in [n, n * 7919 % 90_000] {
            let (i, j) = (n / 300, n % 300);
            corners.extend([at(i, j), at(i + 1, j), at(i, j + 1)]);
            corners.extend([at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]);
        }
    }
    let expected = naive(&corners, CoordKind::F4);
    assert_eq!(expected.1.len(), 3 * 301 * 301);
    let bench = Bench::new(LEAST);
    assert!(bench.soup(&corners, CoordKind::F4, false, Tuning::default()) == expected);
    assert!(bench.ws.budget.peak() <= LEAST);
    // More than V: places, first uses and joined positions were spilled.
    assert!(bench.ws.scratch.peak() > 8 * corners.len() as u64);
    let ample = Bench::new(256 << 20);
    assert!(ample.soup(&corners, CoordKind::F4, false, Tuning::default()) == expected);
}

#[test]
fn a_small_soup_in_ample_memory_spills_nothing() {
    let corners = random(3000, 60, CoordKind::F4, 5);
    let bench = Bench::new(64 << 20);
    let found = bench.soup(&corners, CoordKind::F4, false, Tuning::default());
    assert!(found == naive(&corners, CoordKind::F4));
    // V alone: the ways back lie where it comes to lie.
    assert_eq!(bench.ws.scratch.peak(), 4 * corners.len() as u64);
}

#[test]
fn what_a_weld_takes_is_foretold() {
    let side = 200;
    let at = |i: u64, j: u64| [i, j, i * j % 7].map(|c| u64::from((c as f32).to_bits()));
    let square = |n: u64| {
        let (i, j) = (n / side, n % side);
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
        [a, b, c, c, b, d]
    };
    let squares = side * side;
    let vertices = (side + 1) * (side + 1);
    let coherent: Vec<_> = (0..squares).flat_map(square).collect();
    // Each third of a square elsewhere: hardly a corner meets its like in a block.
    let far = (0..3).flat_map(|part| {
        (0..squares).flat_map(move |n| {
            let square = square(n * 7919 % squares);
            [square[part], square[part + 3]]
        })
    });
    let shuffled: Vec<_> = far.collect();
    for (corners, worst) in [(coherent, false), (shuffled, true)] {
        for (kind, memory) in [(CoordKind::F4, 2 << 20), (CoordKind::F8, 32 << 20)] {
            let bench = Bench::new(memory);
            let request = request(bench.dir.path(), bench.dir.path());
            let size = WeldSize {
                triangles: corners.len() as u64 / 3,
                vertices,
                coords: kind,
                memory,
                wide: false,
                indexed: None,
                decoded: false,
                worst,
            };
            let expected = Expected {
                triangles: size.triangles,
                most: Some(size.triangles),
            };
            match kind {
                CoordKind::F4 => {
                    let all: Vec<_> = corners.iter().map(|at| at.map(|c| c as u32)).collect();
                    let feed = |soup: &mut dyn Soup<u32>| soup.corners(&all);
                    soup(&bench.ws, expected, feed)
                }
                CoordKind::F8 => {
                    let feed = |soup: &mut dyn Soup<u64>| soup.corners(&corners);
                    soup(&bench.ws, expected, feed)
                }
            }
            .and_then(|((), weld)| weld.finish(&bench.ws, &request))
            .unwrap();
            let (cost, io) = (size.cost(), bench.ws.io.now());
            let what = format!("{kind:?}, worst: {worst}, {memory}: {cost:?}, {io:?}");
            let scratch = bench.ws.scratch.peak();
            assert!(scratch <= cost.scratch, "{scratch}: {what}");
            assert!(cost.scratch <= 2 * scratch, "{scratch}: {what}");
            for (guess, real) in [(cost.read, io.read), (cost.written, io.written)] {
                assert!(
                    5 * guess.abs_diff(real) <= real,
                    "{guess} for {real}: {what}"
                );
            }
        }
    }
}

#[path = "tests_any.rs"]
mod any;
#[path = "tests_kept.rs"]
mod kept;

#[test]
fn corners_that_a_unit_keeps_back_are_missed() {
    let bench = Bench::new(1 << 20);
    let corner = [[1u32, 2, 3]];
    let feed = |(): &mut (), soup: &mut dyn Soup<u32>, u: u64| {
        soup.begin(u);
        (0..if u == 2 { 2 } else { 3 }).try_for_each(|_| soup.corners(&corner))
    };
    let mut units = Units::<u32, u32>::new(&bench.ws, (4, 4)).unwrap();
    assert!(units.take(&bench.ws, None, || Ok(()), feed).unwrap());
    let said = units
        .end()
        .map(|_| ())
        .map_err(|e| e.to_string())
        .unwrap_err();
    assert!(
        said.contains("'weld: read' was given 12 corners, and accounts for 11"),
        "{said}"
    );
}
