//! The read view over folders written by hand: every operator against naive arithmetic, fans
//! around vertices of every kind, and swirls.

#[allow(dead_code)]
mod by_hand;

use by_hand::{Mesh, NONE, tetrahedron};
use cornermill::corner::{Corner, Triangle, Vertex};
use cornermill::{CornerTable, Error};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Two triangles that share an edge, two fans joined at a vertex alone, and so on: each named
/// by its hazard.
fn zoo() -> Vec<(&'static str, Mesh)> {
    let mut unreferenced = Mesh::of(&[[0, 1, 2]]);
    unreferenced.vertices = 9;
    vec![
        ("nothing", Mesh::of(&[])),
        ("one triangle", Mesh::of(&[[0, 1, 2]])),
        ("unreferenced vertices", unreferenced),
        ("tetrahedron", tetrahedron()),
        ("square", Mesh::of(&[[0, 1, 2], [2, 1, 3]])),
        ("square that disagrees", Mesh::of(&[[0, 1, 2], [1, 2, 3]])),
        ("open fan of 5", fan_of(5, false)),
        ("closed fan of 6", fan_of(6, true)),
        (
            "closed fan, every second flipped",
            flip_odd(fan_of(6, true)),
        ),
        ("open fan, every second flipped", flip_odd(fan_of(7, false))),
        (
            "hourglass",
            Mesh::of(&[[0, 1, 2], [0, 2, 5], [0, 3, 4], [0, 4, 6]]),
        ),
        (
            "three on an edge",
            Mesh::of(&[[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 2, 5]]),
        ),
        ("duplicates", Mesh::of(&[[0, 1, 2], [0, 1, 2], [3, 4, 5]])),
        (
            "degenerate",
            Mesh::of(&[[0, 0, 1], [0, 1, 2], [2, 1, 3], [4, 4, 4]]),
        ),
        (
            "moebius strip",
            Mesh::of(&[[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 0, 4], [4, 0, 1]]),
        ),
        (
            "two components, interleaved",
            Mesh::of(&[[0, 1, 2], [10, 11, 12], [2, 1, 3], [12, 11, 13]]),
        ),
        ("torus", torus(5, 4)),
    ]
}

fn fan_of(triangles: u64, closed: bool) -> Mesh {
    let rim = |i: u64| 1 + if closed { i % triangles } else { i };
    let v: Vec<_> = (0..triangles).map(|i| [0, rim(i), rim(i + 1)]).collect();
    Mesh::of(&v)
}

fn flip_odd(mut mesh: Mesh) -> Mesh {
    for t in mesh.v.iter_mut().skip(1).step_by(2) {
        t.swap(1, 2);
    }
    mesh
}

fn torus(m: u64, n: u64) -> Mesh {
    let at = |i: u64, j: u64| (i % m) * n + j % n;
    let square = |(i, j)| {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        [[a, b, c], [c, d, a]]
    };
    let cells = (0..m).flat_map(|i| (0..n).map(move |j| (i, j)));
    Mesh::of(&cells.flat_map(square).collect::<Vec<_>>())
}

/// Calls `check` with each mesh of the zoo at each width of ids and coordinates.
fn each(check: impl Fn(&str, &Mesh, &CornerTable)) {
    for (name, mesh) in zoo() {
        for (wide, f8) in [(false, false), (true, true)] {
            let mesh = Mesh {
                wide,
                f8,
                ..mesh.clone().placed()
            };
            let (_dir, folder) = write(&mesh);
            check(name, &mesh, &CornerTable::open(&folder).unwrap());
        }
    }
}

fn write(mesh: &Mesh) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("m.ct");
    mesh.write(&folder);
    (dir, folder)
}

#[test]
fn operators_agree_with_naive_arithmetic() {
    each(|name, mesh, table| {
        let (o, labels) = (mesh.opposites(), mesh.labels());
        let some = |c: u64| (c != NONE).then_some(Corner::new(c));
        assert_eq!(table.triangle_count(), mesh.v.len() as u64, "{name}");
        assert_eq!(table.vertex_count(), mesh.vertices, "{name}");
        assert_eq!(table.triangles().count(), mesh.v.len(), "{name}");
        assert_eq!(table.vertices().count() as u64, mesh.vertices, "{name}");
        for t in table.triangles() {
            let label = labels[t.id() as usize];
            assert_eq!(table.component(t).unwrap_or(NONE), label, "{name}");
            for k in 0..3 {
                let id = 3 * t.id() + k as u64;
                let c = table.corner(id).unwrap();
                assert_eq!(table.corner_of(t, k), c);
                assert_eq!((table.t(c), c.k()), (t, k));
                let (n, p) = (3 * t.id() + (id + 1) % 3, 3 * t.id() + (id + 2) % 3);
                assert_eq!((table.n(c).id(), table.p(c).id()), (n, p));
                assert_eq!(table.v(c).id(), mesh.v[t.id() as usize][k], "{name}");
                assert_eq!(table.o(c), some(o[id as usize]), "{name} {c}");
                assert_eq!(table.l(c), some(o[p as usize]), "{name} {c}");
                assert_eq!(table.r(c), some(o[n as usize]), "{name} {c}");
                let swing = some(o[n as usize]).map(|x| x.id() / 3 * 3 + (x.id() + 1) % 3);
                assert_eq!(table.s(c).map(Corner::id), swing, "{name} {c}");
            }
        }
        for v in table.vertices() {
            let spot = mesh.g.as_ref().unwrap()[v.id() as usize];
            let want = spot.map(|x| if mesh.f8 { x } else { f64::from(x as f32) });
            assert_eq!(table.position(v), Some(want), "{name} {v}");
        }
        table.check_bounds("".as_ref()).unwrap();
    });
}

#[test]
fn ids_from_outside_are_checked() {
    let (_dir, folder) = write(&tetrahedron());
    let table = CornerTable::open(&folder).unwrap();
    assert_eq!(table.corner(11), Some(Corner::new(11)));
    assert_eq!(table.corner(12), None);
    assert_eq!(table.vertex(3), Some(Vertex::new(3)));
    assert_eq!(table.vertex(4), None);
    assert_eq!(table.triangle(4), None);
    assert_eq!(table.triangle(u64::MAX), None);
    assert!(table.has_positions());
    let lost = std::panic::catch_unwind(|| table.v(Corner::new(u64::MAX)));
    assert!(lost.is_err());
}

/// The corners of c's vertex that edges join to c: spread until nothing changes.
fn naive_fan(mesh: &Mesh, c: u64) -> BTreeSet<u64> {
    let o = mesh.opposites();
    let vertex = |c: u64| mesh.v[c as usize / 3][c as usize % 3];
    let mut fan = BTreeSet::from([c]);
    loop {
        let before = fan.len();
        for x in fan.clone() {
            let t = x / 3 * 3;
            for y in (t..t + 3).filter(|&y| y != x && o[y as usize] != NONE) {
                let u = o[y as usize] / 3 * 3;
                fan.extend((u..u + 3).filter(|&z| vertex(z) == vertex(c)));
            }
        }
        if fan.len() == before {
            return fan;
        }
    }
}

#[test]
fn a_fan_is_walked_completely_and_once() {
    each(|name, mesh, table| {
        for c in (0..3 * table.triangle_count()).map(Corner::new) {
            let walk: Vec<u64> = table.fan(c).map(Corner::id).collect();
            let set: BTreeSet<u64> = walk.iter().copied().collect();
            assert_eq!(set.len(), walk.len(), "{name} {c}: {walk:?}");
            assert_eq!(set, naive_fan(mesh, c.id()), "{name} {c}: {walk:?}");
            // Neighbours in the walk share an edge.
            for pair in walk.windows(2) {
                let joined = |y: u64| {
                    let o = table.o(Corner::new(y));
                    y != pair[0] && o.is_some_and(|o| o.id() / 3 == pair[1] / 3)
                };
                let t = pair[0] / 3 * 3;
                assert!((t..t + 3).any(joined), "{name} {c}: {walk:?}");
            }
        }
    });
}

#[test]
fn a_fan_begins_at_the_border_and_goes_on_as_the_swing() {
    let (_dir, folder) = write(&fan_of(5, false));
    let table = CornerTable::open(&folder).unwrap();
    // Corner 3t of each triangle is at the hub; the swing c.n.o.n leaves {0, rim(t + 1)}.
    for t in 0..5 {
        let walk: Vec<u64> = table.fan(Corner::new(3 * t)).map(Corner::id).collect();
        assert_eq!(walk, [0, 3, 6, 9, 12]);
    }
    assert_eq!(table.s(Corner::new(3)), Some(Corner::new(6)));
    assert_eq!(table.s(Corner::new(12)), None);
    let (_dir, folder) = write(&fan_of(6, true));
    let table = CornerTable::open(&folder).unwrap();
    let walk: Vec<u64> = table.fan(Corner::new(9)).map(Corner::id).collect();
    assert_eq!(walk, [9, 12, 15, 0, 3, 6]);
    assert_eq!(table.s(Corner::new(15)), Some(Corner::new(0)));
}

#[test]
fn a_fan_stays_at_its_vertex_where_orientations_disagree() {
    let (_dir, folder) = write(&flip_odd(fan_of(5, false)));
    let table = CornerTable::open(&folder).unwrap();
    for t in 0..5u64 {
        let c = Corner::new(3 * t);
        let walk: Vec<u64> = table.fan(c).map(Corner::id).collect();
        // "With the swing" is meant in the triangle asked for.
        let mut want = vec![0, 3, 6, 9, 12];
        if t % 2 == 1 {
            want.reverse();
        }
        assert_eq!(walk, want);
    }
    // The plain formula leaves the vertex there, as documented.
    let s = table.s(Corner::new(0)).unwrap();
    assert_ne!(table.v(s), table.v(Corner::new(0)));
}

/// The recursive swirl, as the text has it.
fn recursive(table: &CornerTable, c: Option<Corner>, seen: &mut Vec<Triangle>) {
    let Some(c) = c else { return };
    if seen.contains(&table.t(c)) {
        return;
    }
    seen.push(table.t(c));
    recursive(table, table.r(c), seen);
    recursive(table, table.l(c), seen);
}

#[test]
fn a_swirl_has_the_order_of_the_recursion_and_covers_the_component() {
    each(|name, mesh, table| {
        let labels = mesh.labels();
        for c in (0..3 * table.triangle_count()).map(Corner::new) {
            let order: Vec<Triangle> = table.swirl(c).collect();
            let mut want = Vec::new();
            recursive(table, Some(c), &mut want);
            recursive(table, table.o(c), &mut want);
            assert_eq!(order, want, "{name} {c}");
            let mut ids: Vec<u64> = order.iter().map(|t| t.id()).collect();
            ids.sort_unstable();
            let label = labels[c.t().id() as usize];
            let all = (0..labels.len() as u64)
                .filter(|&t| t == c.t().id() || (label != NONE && labels[t as usize] == label));
            assert_eq!(ids, all.collect::<Vec<_>>(), "{name} {c}");
        }
    });
}

#[test]
fn a_deep_component_needs_no_deep_stack() {
    // A strip long enough that a recursion would overflow.
    let v: Vec<[u64; 3]> = (0..1500).map(|i| [i, i + 1, i + 2]).collect();
    let (_dir, folder) = write(&Mesh::of(&v));
    let table = CornerTable::open(&folder).unwrap();
    let swirl = std::thread::Builder::new()
        .stack_size(32 << 10)
        .spawn(move || table.swirl(Corner::new(0)).count());
    assert_eq!(swirl.unwrap().join().unwrap(), 1500);
}

#[test]
fn a_mesh_without_coordinates_has_no_positions() {
    let (_dir, folder) = write(&Mesh::of(&[[0, 1, 2]]));
    let table = CornerTable::open(&folder).unwrap();
    assert!(!table.has_positions());
    assert_eq!(table.position(Vertex::new(0)), None);
}

#[test]
fn a_damaged_folder_is_named_and_walks_end() {
    let (_dir, folder) = write(&tetrahedron());
    // Corner 0 gets the opposite 77, beyond the table; corner 1 one that does not lead back.
    patch(&folder, "O.npy", 0, 77);
    patch(&folder, "O.npy", 1, 2);
    let table = CornerTable::open(&folder).unwrap();
    let said = table.check_bounds(&folder).unwrap_err().to_string();
    assert!(said.contains("O.npy: entry 0 (triangle 0)"), "{said}");
    assert!(said.contains("a corner below 12, found 77"), "{said}");
    for c in (0..12).map(Corner::new) {
        assert!(table.fan(c).count() <= 12);
    }
    patch(&folder, "component.npy", 2, 5);
    patch(&folder, "O.npy", 0, 11);
    let said = table.check_bounds(&folder).unwrap_err().to_string();
    assert!(
        said.contains("component.npy: entry 2 (triangle 2)"),
        "{said}"
    );
}

#[test]
fn a_walk_that_damage_leads_back_into_itself_ends() {
    let (_dir, folder) = write(&fan_of(6, true));
    // The last triangle of the turn leads into the middle of it instead of to the first.
    patch(&folder, "O.npy", 16, 11);
    let table = CornerTable::open(&folder).unwrap();
    table.check_bounds(&folder).unwrap();
    let walk: Vec<u64> = table.fan(Corner::new(6)).map(Corner::id).collect();
    assert_eq!(walk, [0, 3, 6, 9, 12, 15]);
}

/// Overwrites the u4 number `i` of an array.
fn patch(folder: &std::path::Path, name: &str, i: usize, value: u32) {
    let path = folder.join(name);
    let mut bytes = std::fs::read(&path).unwrap();
    let at = 4096 + 4 * i;
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    // In place: the table may have the file mapped.
    use std::os::unix::fs::FileExt;
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.write_all_at(&bytes[at..at + 4], at as u64).unwrap();
}

#[test]
fn an_array_of_another_shape_is_refused() {
    let (_dir, folder) = write(&tetrahedron());
    let path = folder.join("V.npy");
    let mut bytes = std::fs::read(&path).unwrap();
    let text = String::from_utf8_lossy(&bytes[10..4096]).into_owned();
    // The same size, column by column: only the table can notice.
    let header = text.replacen("False", "True ", 1);
    bytes[10..4096].copy_from_slice(header.as_bytes());
    std::fs::write(&path, &bytes).unwrap();
    let error = CornerTable::open(&folder).unwrap_err();
    assert!(matches!(error, Error::Input(_)));
    assert!(error.to_string().contains("column by column"), "{error}");
    std::fs::remove_file(folder.join("manifest.json")).unwrap();
    let error = CornerTable::open(&folder).unwrap_err().to_string();
    assert!(error.contains("unfinished"), "{error}");
}
