//! The letters of swirls: against a naive recursion, closed forms, any memory.

use super::Home;
use super::common::random::Random;
use super::common::{mesh::Mesh, surfaces, zoo};
use super::naive::NONE;
use cornermill::Error;
use cornermill::corner::Corner;
use cornermill::walk::{Clers, Entered, Letter, Side, Step, Tip, Walked, least_swirl_memory};
use std::collections::BTreeSet;

fn walked(home: &Home, memory: u64, c: u64) -> (Vec<Walked>, u64) {
    let ws = home.workspace(memory);
    let walk = Clers::new(&ws, &home.folder, &home.table, Corner::new(c)).expect("a walk");
    let walked: Vec<Walked> = walk.map(|w| w.expect("a step")).collect();
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    assert!(ws.budget.peak() <= memory);
    (walked, ws.scratch.peak())
}

fn steps(walked: &[Walked]) -> Vec<Step> {
    let step = |w: &Walked| match w {
        Walked::Triangle(step) => Some(*step),
        Walked::Joined(_) => None,
    };
    walked.iter().filter_map(step).collect()
}

fn letter(letter: Letter) -> char {
    format!("{letter:?}").chars().next().expect("a letter")
}

fn letters(walked: &[Walked]) -> String {
    steps(walked).iter().map(|s| letter(s.letter)).collect()
}

/// As the naive walk has it.
fn plain(walked: &[Walked]) -> Vec<(char, u64)> {
    let plain = |w: &Walked| match w {
        Walked::Triangle(step) => (letter(step.letter), step.corner.id()),
        Walked::Joined(fork) => ('j', fork.id()),
    };
    walked.iter().map(plain).collect()
}

/// What a step says of itself is so, given the triangles before it.
fn assert_reasons(home: &Home, steps: &[Step]) {
    let (mut seen, mut known) = (BTreeSet::new(), BTreeSet::new());
    for step in steps {
        let c = step.corner.id();
        seen.insert(c / 3);
        let sides = [(c + 1) % 3, (c + 2) % 3].map(|k| home.naive.o[(c / 3 * 3 + k) as usize]);
        for (o, side) in sides.into_iter().zip([step.right, step.left]) {
            let said = match side {
                Side::Open(x) => x.id() == o && !seen.contains(&(o / 3)),
                Side::Visited(x) => x.id() == o && seen.contains(&(o / 3)),
                Side::Border | Side::Cut | Side::Degenerate => o == NONE,
            };
            assert!(said, "{}: {step:?}", home.name);
        }
        let tip = home.naive.v[c as usize];
        if step.tip == Tip::New {
            assert!(!known.contains(&tip), "{}: {step:?}", home.name);
        }
        known.extend((3 * (c / 3)..3 * (c / 3) + 3).map(|c| home.naive.v[c as usize]));
        let from = match step.entered {
            Entered::Start => c / 3,
            Entered::Right(t) | Entered::Left(t) | Entered::Across(t) => {
                assert_eq!(home.naive.o[c as usize] / 3, t.id(), "{}", home.name);
                t.id()
            }
        };
        assert!(seen.contains(&from), "{}: {step:?}", home.name);
    }
}

#[test]
fn letters_are_those_of_the_recursion_and_the_order_is_that_of_the_swirl() {
    let random = (0..60).map(zoo::random);
    let mut met = BTreeSet::new();
    for (i, mesh) in zoo::all().into_iter().chain(random).enumerate() {
        let home = Home::of(&mesh, i % 4 == 1);
        let fans = home.naive.open_fans();
        let mut random = Random::new(i as u64);
        for _ in 0..6.min(fans.len()) {
            let c = random.below(fans.len()) as u64;
            let (found, _) = walked(&home, 1 << 20, c);
            let least = least_swirl_memory(&home.table);
            assert_eq!(walked(&home, least, c).0, found, "{} {c}", mesh.name);
            assert_eq!(
                plain(&found),
                home.naive.clers(c, &fans),
                "{} {c}",
                mesh.name
            );
            met.extend(plain(&found).iter().map(|&(letter, _)| letter));
            let steps = steps(&found);
            assert_reasons(&home, &steps);
            let order: Vec<u64> = steps.iter().map(|s| s.corner.t().id()).collect();
            let swirl = home.table.swirl(Corner::new(c));
            let swirl: Vec<u64> = swirl.map(|t| t.id()).collect();
            assert_eq!(order, swirl, "{} {c}", mesh.name);
        }
    }
    assert_eq!(met, BTreeSet::from(['C', 'L', 'E', 'R', 'S', 'j']));
}

fn count(text: &str, letter: char) -> i64 {
    text.chars().filter(|&c| c == letter).count() as i64
}

#[test]
fn known_surfaces_have_known_letters() {
    let of = |mesh: &Mesh| letters(&walked(&Home::of(mesh, false), 1 << 20, 0).0);
    assert_eq!(of(&surfaces::tetrahedron()), "CCRE");
    assert_eq!(of(&surfaces::octahedron()), "CCCRCRRE");
    // A disk from its middle: around it, the rim always on the right.
    assert_eq!(of(&surfaces::disk(5)), "CRRRE");
    // Entered by a spoke: the other way round, the rim on the left.
    let rim = Home::of(&surfaces::disk(5), false);
    assert_eq!(letters(&walked(&rim, 1 << 20, 1).0), "LLLLE");
    let one = Mesh::new("one", vec![[0, 1, 2]], vec![[0.; 3]; 3]);
    assert_eq!(of(&one), "E");
}

#[test]
fn closed_surfaces_obey_euler() {
    let mut sphere = surfaces::octahedron();
    for _ in 0..3 {
        sphere = divided(&sphere);
    }
    let mut meshes = vec![
        (surfaces::tetrahedron(), 2),
        (surfaces::octahedron(), 2),
        (sphere, 2),
        (surfaces::torus(7, 9), 0),
        (surfaces::klein_bottle(7, 9), 0),
        (surfaces::projective_plane(), 1),
    ];
    let mut random = Random::new(1);
    for (mesh, _) in &mut meshes {
        mesh.rotate_corners(&mut random);
        mesh.shuffle(&mut random);
    }
    for (mesh, euler) in &meshes {
        let home = Home::of(mesh, false);
        for c in (0..home.naive.v.len() as u64).step_by(7) {
            let found = walked(&home, 1 << 20, c).0;
            let text = letters(&found);
            let joined = (found.len() - text.len()) as i64;
            let name = format!("{} from {c}: {text}", mesh.name);
            assert_eq!(text.len(), mesh.triangles.len(), "{name}");
            assert_eq!(count(&text, 'C'), mesh.positions.len() as i64 - 2, "{name}");
            assert_eq!(count(&text, 'S'), count(&text, 'E') - 1 + joined, "{name}");
            assert_eq!(joined, 2 - euler, "{name}");
        }
    }
}

/// Each triangle cut into four.
fn divided(mesh: &Mesh) -> Mesh {
    let mut middles = std::collections::BTreeMap::new();
    let (mut triangles, mut positions) = (Vec::new(), mesh.positions.clone());
    for &[a, b, c] in &mesh.triangles {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(x, y)| {
            *middles.entry((x.min(y), x.max(y))).or_insert_with(|| {
                let [p, q] = [x, y].map(|v| mesh.positions[v as usize]);
                positions.push([0, 1, 2].map(|k| (p[k] + q[k]) / 2.0));
                positions.len() as u32 - 1
            })
        });
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Mesh::new("sphere", triangles, positions)
}

#[test]
fn sides_without_opposite_say_why() {
    // Three triangles on the edge 0-1; all other edges are borders. Corner 2 faces the cut.
    let home = Home::of(&surfaces::fan_on_edge(3), false);
    let only = steps(&walked(&home, 1 << 20, 2).0);
    assert_eq!((only[0].right, only[0].left), (Side::Border, Side::Border));
    let only = steps(&walked(&home, 1 << 20, 1).0);
    assert_eq!((only[0].right, only[0].left), (Side::Cut, Side::Border));
    let mut degenerate = surfaces::tetrahedron();
    degenerate.triangles.push([1, 1, 2]);
    let home = Home::of(&degenerate, false);
    let only = steps(&walked(&home, 1 << 20, 12).0);
    let nothing = Side::Degenerate;
    assert_eq!(
        (only[0].right, only[0].left, only.len()),
        (nothing, nothing, 1)
    );
    assert_eq!(only[0].letter, Letter::E);
}

/// A strip along a line, each of whose triangles has another at its free edge, but the last: every
/// triangle of the strip is a fork while none of the triangles to its left was met.
fn comb(teeth: u32) -> Mesh {
    let mut mesh = Mesh::new("comb", vec![], vec![]);
    let mut vertex = |x: f32, y: f32| {
        mesh.positions.push([x, y, 0.0]);
        mesh.positions.len() as u32 - 1
    };
    // A fan around vertex 0, walked on its right; each triangle has a tooth on its rim.
    let middle = vertex(0.0, 0.0);
    let mut last = vertex(1.0, 0.0);
    let mut triangles = Vec::new();
    for i in 0..teeth {
        let next = vertex(i as f32, 1.0);
        let tip = vertex(i as f32, 2.0);
        triangles.extend([[middle, last, next], [next, last, tip]]);
        last = next;
    }
    mesh.triangles = triangles;
    mesh
}

#[test]
fn a_deep_stack_goes_to_scratch_when_memory_is_short() {
    let home = Home::of(&comb(3000), false);
    // From either end of the fan the teeth are left or right; one way they are left over.
    let ends = [0, 1, 2, 17994, 17995, 17996];
    let least = least_swirl_memory(&home.table);
    let mut spilled = 0;
    for c in ends {
        let (short, scratch) = walked(&home, least, c);
        let (ample, none) = walked(&home, 16 << 20, c);
        assert_eq!(short, ample, "from {c}");
        assert_eq!(none, 0, "from {c}");
        assert_eq!(steps(&short).len(), 6000, "from {c}");
        spilled += u32::from(scratch > 16 << 10);
    }
    assert!(spilled > 0, "no walk spilled");
}

#[test]
fn a_budget_below_the_least_is_refused_with_it() {
    let home = Home::of(&surfaces::torus(40, 40), false);
    let least = least_swirl_memory(&home.table);
    assert_eq!(least, 3200 / 8 + 1600 / 8 + (4 << 10));
    let ws = home.workspace(least - 1);
    match Clers::new(&ws, &home.folder, &home.table, Corner::new(0)) {
        Err(Error::Budget { need, have, .. }) => assert_eq!((need, have), (least, least - 1)),
        _ => panic!("a budget too small is taken"),
    }
    let ws = home.workspace(least);
    let lost = Clers::new(&ws, &home.folder, &home.table, Corner::new(9600));
    assert!(matches!(lost, Err(Error::Usage(text)) if text.contains("0 to 9599")));
}
