//! The zoo: small meshes, each named by what is hard about it, and random meshes made of them.

use super::mesh::Mesh;
use super::random::Random;
use super::surfaces::*;

const FAR: f32 = 1e30;

fn with_triangles(base: Mesh, name: &str, more: &[[u32; 3]]) -> Mesh {
    let triangles = [base.triangles, more.to_vec()].concat();
    Mesh::new(name, triangles, base.positions)
}

fn hourglass() -> Mesh {
    let mut both = tetrahedron().plus(&tetrahedron().scaled(-1.0));
    for v in both.triangles.as_flattened_mut() {
        *v = if *v == 4 { 0 } else { *v };
    }
    both.renamed("hourglass: two tetrahedra on a vertex, one of them inside out")
}

fn tetrahedron_with_fin() -> Mesh {
    let mut mesh = tetrahedron();
    mesh.positions.push([0.5, -1.0, 0.0]);
    with_triangles(mesh, "tetrahedron with a fin", &[[0, 1, 4]])
}

/// A tube of three sides, both ends on the same three vertices: no border, and along those three
/// edges a fin makes the surface cut. `mirrored` glues the ends the other way round.
fn tube_on_itself(mirrored: bool) -> Mesh {
    let ring = torus(3, 3);
    let mut tube: Vec<[u32; 3]> = ring.triangles;
    if mirrored {
        // The ring that the last quads end on, with its direction turned round.
        for t in &mut tube[12..] {
            *t = t.map(|v| if v < 3 { (3 - v) % 3 } else { v });
        }
    }
    let fins = [[0, 1, 9], [1, 2, 9], [2, 0, 9]];
    let positions = [ring.positions, vec![[0., 0., 5.]]].concat();
    let name = if mirrored {
        "tube, ends glued mirrored, with fins"
    } else {
        "torus with fins"
    };
    Mesh::new(name, [tube, fins.to_vec()].concat(), positions)
}

fn surfaces() -> Vec<Mesh> {
    let mut cube_with_hole = cube().renamed("cube with a hole");
    cube_with_hole.triangles.truncate(10);
    let mut one_missing = octahedron().renamed("octahedron without one triangle");
    one_missing.triangles.remove(3);
    vec![
        Mesh::new(
            "one triangle",
            vec![[0, 1, 2]],
            tetrahedron().positions[..3].to_vec(),
        ),
        Mesh::new("no triangle", vec![], vec![]),
        Mesh::new("no triangle, three vertices", vec![], vec![[1., 2., 3.]; 3]),
        tetrahedron(),
        tetrahedron().inverted().renamed("tetrahedron inside out"),
        octahedron(),
        cube(),
        cube_with_hole,
        one_missing,
        torus(3, 3),
        torus(5, 4).inverted().renamed("torus inside out"),
        moebius(3),
        moebius(4),
        moebius(7),
        klein_bottle(4, 3),
        klein_bottle(5, 5),
        projective_plane(),
        disk(3),
        disk(50),
        soup(20),
    ]
}

fn cuts() -> Vec<Mesh> {
    let tetra = tetrahedron;
    let mut ends_on_edge = torus(6, 5).renamed("torus with two of its edges made one");
    for v in ends_on_edge.triangles.as_flattened_mut() {
        *v = match *v {
            15 => 2,
            16 => 3,
            other => other,
        };
    }
    vec![
        hourglass(),
        fan_on_edge(3),
        fan_on_edge(4),
        fan_on_edge(9),
        with_triangles(
            fan_on_edge(3),
            "3 triangles on an edge, one turned over",
            &[[1, 0, 2]],
        ),
        tetrahedra_on_edge(2),
        tetrahedra_on_edge(3).inverted(),
        tetrahedron_with_fin(),
        with_triangles(tetra(), "tetrahedron with a face twice", &[[0, 2, 1]]),
        with_triangles(
            tetra(),
            "tetrahedron with a face three times",
            &[[0, 2, 1], [1, 2, 0]],
        ),
        with_triangles(
            tetra(),
            "every face of a tetrahedron twice",
            &tetra().triangles,
        ),
        with_triangles(
            tetra(),
            "a tetrahedron and its inside",
            &tetra().inverted().triangles,
        ),
        ends_on_edge,
        tube_on_itself(false),
        tube_on_itself(true),
        Mesh::new("pillow", vec![[0, 1, 2], [0, 2, 1]], tetra().positions),
        Mesh::new(
            "a triangle twice",
            vec![[0, 1, 2], [1, 2, 0]],
            tetra().positions,
        ),
        Mesh::new(
            "a triangle three times",
            vec![[0, 1, 2]; 3],
            tetra().positions,
        ),
    ]
}

fn degenerates() -> Vec<Mesh> {
    let positions = tetrahedron().positions;
    vec![
        Mesh::new(
            "only degenerate",
            vec![[0, 0, 0], [1, 1, 2], [3, 1, 3]],
            positions.clone(),
        ),
        Mesh::new(
            "degenerate first",
            vec![[1, 1, 0], [0, 1, 2]],
            positions.clone(),
        ),
        with_triangles(
            tetrahedron(),
            "degenerate on an edge",
            &[[0, 1, 1], [0, 0, 1], [2, 2, 2]],
        ),
        {
            let mut between = octahedron().renamed("degenerate among others");
            for at in [0, 3, 6, 11] {
                between.triangles.insert(at, [4, 4, 1]);
            }
            between
        },
    ]
}

fn positions() -> Vec<Mesh> {
    let far_away = tetrahedron().scaled(FAR);
    let mut with_nan = tetrahedron();
    with_nan.positions[2][1] = f32::NAN;
    let mut infinite = octahedron()
        .inverted()
        .renamed("octahedron with an infinity");
    infinite.positions[3] = [f32::INFINITY, 0.0, f32::NEG_INFINITY];
    let mut unused_nan = tetrahedron().inverted().renamed("an unreferenced NaN");
    unused_nan.positions.push([f32::NAN; 3]);
    let mut all_nan = tetrahedron().renamed("all coordinates NaN");
    all_nan.positions.fill([f32::NAN; 3]);
    let mut flat = octahedron().renamed("closed and flat");
    flat.positions.iter_mut().for_each(|p| p[2] = 0.0);
    let mut at_one_point = octahedron().inverted().renamed("closed, all at one point");
    at_one_point.positions.fill([0.1, 0.2, 0.3]);
    let mut sparse = octahedron().inverted();
    sparse
        .triangles
        .as_flattened_mut()
        .iter_mut()
        .for_each(|v| *v = 3 * *v + 2);
    let spread = (0..30).map(|v| match v % 3 {
        2 if v < 18 => octahedron().positions[v / 3],
        _ => [v as f32, -(v as f32), 0.5],
    });
    let sparse = Mesh::new("unreferenced vertices", sparse.triangles, spread.collect());
    vec![
        with_nan
            .plus(&tetrahedron().inverted())
            .renamed("tetrahedron with a NaN, and another"),
        infinite,
        unused_nan,
        all_nan,
        flat,
        at_one_point,
        sparse,
        far_away
            .clone()
            .inverted()
            .renamed("far out and inside out"),
        tetrahedron()
            .inverted()
            .plus(&far_away)
            .renamed("small beside far out"),
        octahedron()
            .inverted()
            .scaled(f32::MAX)
            .renamed("the largest coordinates"),
        octahedron()
            .inverted()
            .scaled(1e-40)
            .renamed("subnormal coordinates"),
        octahedron()
            .inverted()
            .moved([1e6, -1e6, 1e6])
            .renamed("far from the origin"),
        tetrahedron()
            .scaled(8.0)
            .plus(&tetrahedron().moved([1.0; 3]).inverted())
            .renamed("a cavity"),
        tetrahedron()
            .scaled(8.0)
            .plus(&tetrahedron().moved([1.0; 3]))
            .renamed("nested shells"),
    ]
}

/// Every animal, in the order of its file numbers in a failure.
pub fn all() -> Vec<Mesh> {
    [surfaces(), cuts(), degenerates(), positions()].concat()
}

/// A random mesh of at most a few hundred triangles: animals side by side, disturbed in every way,
/// or triangles on vertices drawn at random.
pub fn random(seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    if seed.is_multiple_of(5) {
        return random_triangles(&mut random).renamed(&format!("random triangles {seed}"));
    }
    let animals = all();
    let mut mesh = Mesh::new("", vec![], vec![]);
    for _ in 0..1 + random.below(5) {
        let offset = [0; 3].map(|_| 4.0 * random.coordinate());
        mesh = mesh.plus(&random.pick(&animals).clone().moved(offset));
    }
    let percent = *random.pick(&[0, 10, 30, 50, 100]);
    mesh.flip_some(&mut random, percent);
    if random.chance(40) && !mesh.positions.is_empty() {
        let times = 1 + random.below(6);
        mesh.merge_vertices(&mut random, times);
    }
    if random.chance(30) {
        mesh.drop_some(&mut random, 10);
    }
    if random.chance(30) {
        mesh.duplicate_some(&mut random, 4);
    }
    if random.chance(60) {
        mesh.rotate_corners(&mut random);
    }
    if random.chance(70) {
        mesh.shuffle(&mut random);
    }
    let name = format!("random {seed}: {}", mesh.name);
    mesh.renamed(&name)
}

/// Few vertices and many triangles: edges of every multiplicity, duplicates, degenerates.
fn random_triangles(random: &mut Random) -> Mesh {
    let vertices = 3 + random.below(14);
    let count = 1 + random.below(80);
    let positions = (0..vertices)
        .map(|_| [0; 3].map(|_| random.coordinate()))
        .collect();
    let triangle = |_| [0; 3].map(|_| random.below(vertices) as u32);
    let triangles = (0..count).map(triangle).collect();
    Mesh::new("", triangles, positions)
}
