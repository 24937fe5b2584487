//! Orders and flips: the same mesh in another order, and the counts that flips decide.

use std::collections::BTreeMap;

use crate::naive;
use clap::ValueEnum;
use data_gen::blobs::Blobs;
use data_gen::defects::Defects;
use data_gen::grid::{Grid, Shape};
use data_gen::loose::{Form, Loose};
use data_gen::sphere::Sphere;
use data_gen::view::{Options, Order};
use data_gen::{Mesh, Truth, View};

fn meshes() -> Vec<(&'static str, Box<dyn Mesh>)> {
    let defects = |mesh: Box<dyn Mesh>| Box::new(Defects::new(mesh, 2, 8).unwrap());
    vec![
        ("sphere", Box::new(Sphere::new(7, 1))),
        ("sphere with faults", defects(Box::new(Sphere::new(12, 1)))),
        (
            "torus with faults",
            defects(Box::new(Grid::new(Shape::Torus, 13, 22, 1))),
        ),
        ("terrain", Box::new(Grid::new(Shape::Terrain, 9, 14, 1))),
        (
            "moebius with faults",
            defects(Box::new(Grid::new(Shape::Moebius, 12, 40, 1))),
        ),
        ("klein", Box::new(Grid::new(Shape::Klein, 5, 9, 1))),
        (
            "blobs with faults",
            defects(Box::new(Blobs::new(9, 1500, 1).unwrap())),
        ),
        ("soup", Box::new(Loose::new(Form::Soup, 101, 1))),
        ("cone", Box::new(Loose::new(Form::Cone, 100, 1))),
        ("book", Box::new(Loose::new(Form::Book, 77, 1))),
    ]
}

fn view<'a>(mesh: &'a dyn Mesh, order: Order, flip: f64) -> View<'a> {
    let seed = 11;
    View::new(mesh, Options { order, flip, seed })
}

/// The triangles by the places of their corners, with how often each occurs. Where `turned` is false
/// the corners keep their direction around the triangle, though not which of them is first.
fn by_place(
    triangles: impl Iterator<Item = [u64; 3]>,
    position: impl Fn(u64) -> [f64; 3],
    turned: bool,
) -> BTreeMap<[[u64; 3]; 3], u64> {
    let mut found = BTreeMap::new();
    for corners in triangles {
        let mut places = corners.map(|v| position(v).map(f64::to_bits));
        if turned {
            places.sort();
        }
        let turns = (0..3).map(|k| {
            let mut turn = places;
            turn.rotate_left(k);
            turn
        });
        let places = turns.min().unwrap_or(places);
        *found.entry(places).or_default() += 1;
    }
    found
}

#[test]
fn every_order_shows_the_same_mesh() {
    for (name, mesh) in meshes() {
        let triangles = naive::gather(mesh.as_ref());
        for &order in Order::value_variants() {
            for flip in [0.0, 0.3] {
                let view = view(mesh.as_ref(), order, flip);
                let shown = (0..mesh.truth().triangles).map(|i| view.triangle(i).corners);
                let turned = flip > 0.0;
                let shown = by_place(shown, |v| view.position(v), turned);
                let mesh = by_place(triangles.iter().copied(), |v| mesh.position(v), turned);
                assert!(shown == mesh, "{name}, {order:?}, flip {flip}");
            }
        }
    }
}

#[test]
fn every_order_has_the_same_counts_and_flips_are_counted() {
    for (name, mesh) in meshes() {
        for &order in Order::value_variants() {
            for flip in [0.0, 0.3, 1.0] {
                let view = view(mesh.as_ref(), order, flip);
                let all: Vec<_> = (0..mesh.truth().triangles)
                    .map(|i| view.triangle(i))
                    .collect();
                let corners: Vec<[u64; 3]> = all.iter().map(|s| s.corners).collect();
                let claimed = Truth {
                    inconsistent_edges: all.iter().map(|s| view.inconsistent_edges(s)).sum(),
                    ..mesh.truth()
                };
                let found = naive::count(&corners, mesh.truth().vertices);
                assert_eq!(claimed, found, "{name}, {order:?}, flip {flip}");
                let flipped = all.iter().filter(|s| s.flipped).count() as f64;
                let share = flipped / all.len() as f64;
                assert!(
                    (share - flip).abs() < 0.12,
                    "{name}: {share} of {flip} flipped"
                );
            }
        }
    }
}

#[test]
fn a_triangle_is_flipped_or_not_whatever_the_order() {
    let mesh = Sphere::new(6, 1);
    let flips = |order| {
        let view = view(&mesh, order, 0.5);
        let shown = (0..mesh.truth().triangles).map(|i| view.triangle(i));
        shown
            .map(|s| (s.source, s.flipped))
            .collect::<BTreeMap<u64, bool>>()
    };
    let coherent = flips(Order::Coherent);
    for &order in Order::value_variants() {
        assert_eq!(flips(order), coherent, "{order:?}");
    }
}

/// Mean distance in the file between a triangle and its neighbours on the surface, and between the
/// ids of a triangle, both as parts of the whole.
fn spread(order: Order) -> (f64, f64) {
    let mesh = Sphere::new(40, 1);
    let count = mesh.truth().triangles;
    let view = view(&mesh, order, 0.0);
    let mut place = vec![0u64; count as usize];
    let mut ids = 0;
    for i in 0..count {
        let shown = view.triangle(i);
        place[shown.source as usize] = i;
        ids += shown.corners[0].abs_diff(shown.corners[1]);
    }
    let apart: u64 = (0..count)
        .flat_map(|t| {
            mesh.neighbours(t)
                .into_iter()
                .flatten()
                .map(move |l| (t, l.triangle))
        })
        .map(|(t, u)| place[t as usize].abs_diff(place[u as usize]))
        .sum();
    let (sides, vertices) = (3 * count * count, count * mesh.truth().vertices);
    (apart as f64 / sides as f64, ids as f64 / vertices as f64)
}

#[test]
fn orders_are_as_near_or_far_as_they_say() {
    // Two random places are a third of the whole apart; neighbouring rings of this sphere 1/80.
    let (near, random) = (0.0..0.02, 0.3..0.36);
    let expected = [
        (Order::Coherent, near.clone(), near.clone()),
        (Order::Reversed, near.clone(), near.clone()),
        (Order::ShuffleTriangles, random.clone(), near.clone()),
        (Order::ShuffleVertices, near.clone(), random.clone()),
        (Order::Shuffle, random.clone(), random),
        (Order::Interleaved, near.clone(), near.clone()),
        (Order::Strips, 0.05..0.2, near.clone()),
        (Order::SortedX, near.clone(), near),
    ];
    for (order, triangles, vertices) in expected {
        let found = spread(order);
        assert!(
            triangles.contains(&found.0),
            "{order:?}: triangles {}",
            found.0
        );
        assert!(
            vertices.contains(&found.1),
            "{order:?}: vertices {}",
            found.1
        );
    }
}

#[test]
fn interleaved_halves_each_run_in_order() {
    for mesh in [
        Loose::new(Form::Soup, 100, 1),
        Loose::new(Form::Soup, 101, 1),
        Loose::new(Form::Soup, 1, 1),
    ] {
        let count = mesh.truth().triangles;
        let view = view(&mesh, Order::Interleaved, 0.0);
        let scan = |from| (from..count).step_by(2).map(|i| view.triangle(i).source);
        let both: Vec<u64> = scan(0).chain(scan(1)).collect();
        assert_eq!(both, (0..count).collect::<Vec<_>>());
    }
}

#[test]
fn strips_run_across_and_take_turns() {
    // Of a soup, whose order across is its own: each turn is a run of consecutive triangles.
    for count in [1, 3, 63, 64, 65, 127, 128, 1000, 64_037] {
        let mesh = Loose::new(Form::Soup, count, 1);
        let view = view(&mesh, Order::Strips, 0.0);
        let strip = |turn| {
            let places = (turn..count).step_by(64);
            places.map(|i| view.triangle(i).source).collect::<Vec<_>>()
        };
        let mut strips: Vec<_> = (0..64.min(count)).map(strip).collect();
        for strip in &strips {
            assert!(strip.windows(2).all(|w| w[1] == w[0] + 1), "{count}");
        }
        strips.sort();
        assert_eq!(strips.concat(), (0..count).collect::<Vec<_>>());
    }
    // Of a sphere, 64 triangles in a row meet its whole range of vertices.
    let mesh = Sphere::new(40, 1);
    let view = view(&mesh, Order::Strips, 0.0);
    for start in (0..mesh.truth().triangles - 64).step_by(500) {
        let ids = (start..start + 64).map(|i| view.triangle(i).corners[0]);
        let (low, high) = (ids.clone().min().unwrap(), ids.max().unwrap());
        assert!(high - low > mesh.truth().vertices / 2, "from {start}");
    }
}

#[test]
fn sorted_by_x_is_sorted_by_x() {
    let mesh = Grid::new(Shape::Terrain, 30, 20, 1);
    let view = view(&mesh, Order::SortedX, 0.0);
    let xs: Vec<f64> = (0..mesh.truth().triangles)
        .map(|i| view.triangle(i).corners.map(|v| view.position(v)[0]))
        .map(|x| x[0].min(x[1]).min(x[2]))
        .collect();
    assert!(xs.is_sorted());
    // On the sphere rings go from x = 1 to -1, up to the displacement.
    let mesh = Sphere::new(30, 1);
    let view = self::view(&mesh, Order::SortedX, 0.0);
    let x = |i| view.position(view.triangle(i).corners[0])[0];
    assert!(x(0) > 0.7 && x(mesh.truth().triangles / 2).abs() < 0.1);
    assert!(x(mesh.truth().triangles - 1) < -0.7);
}

#[test]
fn seeds_give_different_orders_and_shapes() {
    let (a, b) = (Sphere::new(9, 1), Sphere::new(9, 2));
    assert_ne!(a.position(5), b.position(5));
    let order = |seed| {
        let options = Options {
            order: Order::Shuffle,
            flip: 0.0,
            seed,
        };
        let view = View::new(&a, options);
        (0..100)
            .map(|i| view.triangle(i).corners)
            .collect::<Vec<_>>()
    };
    assert_eq!(order(1), order(1));
    assert_ne!(order(1), order(2));
}
