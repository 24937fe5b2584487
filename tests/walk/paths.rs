//! Shortest paths: lengths, the smallest of equals, any budget, refusals.

use super::Home;
use super::common::random::Random;
use super::common::{surfaces, zoo};
use super::naive::NONE;
use cornermill::Error;
use cornermill::corner::Corner;
use cornermill::disk::Workspace;
use cornermill::walk::{Search, least_path_memory, path};

/// The corners of a path; `None` when there is none. Twice, as they may be asked for twice.
fn corners(home: &Home, ws: &Workspace, from: u64, to: u64) -> Option<Vec<u64>> {
    let [from, to] = [from, to].map(Corner::new);
    match path(ws, &home.folder, &home.table, from, to).expect("a search") {
        Search::Apart { .. } => None,
        Search::Found(mut path) => {
            let mut list = || -> Vec<u64> {
                let corners = path.corners().map(|c| c.expect("a corner").id());
                corners.collect()
            };
            let (first, second) = (list(), list());
            assert_eq!(first, second, "{}", home.name);
            assert_eq!(path.triangles(), first.len() as u64);
            Some(first)
        }
    }
}

/// Each step crosses an edge, from the triangle of the first corner to the last corner.
fn assert_is_path(home: &Home, path: &[u64], from: u64, to: u64) {
    assert_eq!(path[0] / 3, from / 3, "{}: {path:?}", home.name);
    assert_eq!(path[path.len() - 1], to, "{}: {path:?}", home.name);
    for step in path.windows(2) {
        let o = home.naive.o[step[0] as usize];
        assert!(o != NONE && o / 3 == step[1] / 3, "{}: {path:?}", home.name);
    }
}

fn check(home: &Home, from: u64, to: u64) {
    let name = format!("{} from {from} to {to}", home.name);
    let mut found = Vec::new();
    for memory in [least_path_memory(&home.table), 1 << 20] {
        let ws = home.workspace(memory);
        found.push(corners(home, &ws, from, to));
        assert_eq!(ws.budget.used(), 0, "{name}");
        assert!(ws.budget.peak() <= memory, "{name}");
        assert_eq!(ws.scratch.used(), 0, "{name}");
    }
    assert_eq!(found[0], found[1], "{name}");
    let far = home.naive.distances(from / 3)[to as usize / 3];
    let Some(path) = &found[0] else {
        assert_eq!(far, NONE, "{name}");
        return;
    };
    assert_is_path(home, path, from, to);
    assert_eq!(path.len() as u64, far + 1, "{name}");
    if far <= 12 {
        let first = home.naive.first_path(from / 3, to, far);
        assert_eq!(Some(path), first.as_ref(), "{name}");
    }
}

#[test]
fn paths_are_the_shortest_and_of_these_the_smallest() {
    let random = (0..60).map(zoo::random);
    let mut checked = 0;
    for (i, mesh) in zoo::all().into_iter().chain(random).enumerate() {
        let home = Home::of(&mesh, i % 3 == 0);
        let corners = home.naive.v.len();
        let mut random = Random::new(i as u64);
        for _ in 0..12.min(corners * corners) {
            let ends = [0; 2].map(|_| random.below(corners) as u64);
            check(&home, ends[0], ends[1]);
            checked += 1;
        }
    }
    assert!(checked > 1000, "{checked} paths");
}

#[test]
fn long_paths_are_the_smallest_of_all_sequences() {
    let mut tori = [surfaces::torus(12, 15), surfaces::klein_bottle(9, 14)];
    for (seed, mesh) in tori.iter_mut().enumerate() {
        let mut random = Random::new(seed as u64);
        mesh.rotate_corners(&mut random);
        mesh.shuffle(&mut random);
        let home = Home::of(mesh, false);
        for to in [0, 7, 300] {
            let best = home.naive.smallest_paths(to);
            let ws = home.workspace(1 << 20);
            for (t, best) in best.iter().enumerate() {
                let from = 3 * t as u64 + t as u64 % 3;
                assert_eq!(
                    corners(&home, &ws, from, to),
                    *best,
                    "{} {from} {to}",
                    mesh.name
                );
            }
        }
    }
}

#[test]
fn levels_go_to_scratch_when_memory_is_short_and_the_path_stays() {
    // A long strip has as many levels as triangles; a torus has wide ones.
    for (mesh, steps) in [
        (surfaces::moebius(4000), 4000),
        (surfaces::torus(60, 90), 60),
    ] {
        let home = Home::of(&mesh, false);
        let to = 3 * (home.naive.triangles() / 2);
        let least = least_path_memory(&home.table);
        let (short, ample) = (home.workspace(least), home.workspace(16 << 20));
        let found = [&short, &ample].map(|ws| corners(&home, ws, 0, to).expect("a path"));
        assert_eq!(found[0], found[1], "{}", mesh.name);
        assert_is_path(&home, &found[0], 0, to);
        let far = home.naive.distances(0)[to as usize / 3];
        assert!(far >= steps / 2, "{}: {far} steps", mesh.name);
        assert_eq!(found[0].len() as u64, far + 1, "{}", mesh.name);
        assert!(short.scratch.peak() > 8 << 10, "{}", mesh.name);
        assert_eq!(ample.scratch.peak(), 0, "{}", mesh.name);
        assert!(short.budget.peak() <= least);
    }
}

#[test]
fn a_budget_below_the_least_is_refused_with_it() {
    let home = Home::of(&surfaces::torus(40, 40), false);
    let least = least_path_memory(&home.table);
    assert_eq!(least, 3200 / 8 + (8 << 10));
    let ws = home.workspace(least - 1);
    let ends = [0, 9000].map(Corner::new);
    match path(&ws, &home.folder, &home.table, ends[0], ends[1]) {
        Err(Error::Budget { need, have, .. }) => assert_eq!((need, have), (least, least - 1)),
        _ => panic!("a budget too small is taken"),
    }
    assert_eq!(ws.budget.used(), 0);
}

#[test]
fn corners_that_nothing_joins_have_no_path() {
    let mesh = surfaces::tetrahedron().plus(&surfaces::octahedron());
    let mut broken = mesh.clone();
    broken.triangles.extend([[0, 0, 1], [2, 2, 2]]);
    let home = Home::of(&broken, false);
    let ws = home.workspace(1 << 20);
    let apart = |from: u64, to: u64| {
        let [from, to] = [from, to].map(Corner::new);
        match path(&ws, &home.folder, &home.table, from, to).expect("a search") {
            Search::Apart { from, to } => Some((from, to)),
            Search::Found(_) => None,
        }
    };
    assert_eq!(apart(0, 35), Some((Some(0), Some(1))));
    assert_eq!(apart(36, 0), Some((None, Some(0))));
    // Two degenerate triangles have no label in common, though both have none.
    assert_eq!(apart(36, 40), Some((None, None)));
    // One triangle is one triangle, whatever it is.
    assert_eq!(apart(36, 38), None);
    assert_eq!(corners(&home, &ws, 36, 38), Some(vec![38]));
    assert_eq!(corners(&home, &ws, 4, 5), Some(vec![5]));
    let lost = path(
        &ws,
        &home.folder,
        &home.table,
        Corner::new(42),
        Corner::new(0),
    );
    assert!(matches!(lost, Err(Error::Usage(text)) if text.contains("0 to 41")));
}

#[test]
fn real_meshes_have_the_distances_of_a_search_in_memory() {
    let names = [
        "vtkdata_Apache2/turbineblade.ply",
        "geometrycentral_MIT/moebius.obj",
        "geometrycentral_MIT/lego.ply",
        "trimesh_MIT/featuretype.STL",
    ];
    for name in names {
        let home = Home::real(name);
        let mut random = Random::new(5);
        for _ in 0..4 {
            let [from, to] = [0; 2].map(|_| random.below(home.naive.v.len()) as u64);
            check(&home, from, to);
        }
    }
}
