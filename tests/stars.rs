//! Vertex stars of surfaces whose numbers are known in closed form, in order and at random, in one
//! chunk and in many, through cells and by contraction.

mod common;

use common::bench::Bench;
use common::folder::Folder;
use common::mesh::Mesh;
use common::random::Random;
use common::surfaces::{cube, klein_bottle, moebius, octahedron, projective_plane, torus};

/// What the whole folder must say: components, fans, loops, Euler characteristic, non-manifold
/// vertices, duplicates, simple meshes, components joined at vertices.
#[derive(Debug, PartialEq)]
struct Known {
    components: u64,
    genus: Vec<u64>,
    border_loops: i64,
    euler: i64,
    nonmanifold_vertices: i64,
    duplicate: i64,
    smesh_components: i64,
    components_joined_at_vertices: i64,
}

/// A closed connected surface of a genus, which is simple when it is a sphere.
fn closed(genus: u64, euler: i64) -> Known {
    Known {
        components: 1,
        genus: vec![genus],
        border_loops: 0,
        euler,
        nonmanifold_vertices: 0,
        duplicate: 0,
        smesh_components: i64::from(euler == 2),
        components_joined_at_vertices: 1,
    }
}

fn found(folder: &Folder) -> Known {
    let measure = |key: &str| {
        folder.manifest["measures"][key]
            .as_i64()
            .expect("a measure")
    };
    Known {
        components: folder.count("components").expect("a count"),
        genus: folder.components.counts("genus"),
        border_loops: measure("border_loops"),
        euler: measure("euler"),
        nonmanifold_vertices: measure("nonmanifold_vertices"),
        duplicate: measure("duplicate"),
        smesh_components: measure("smesh_components"),
        components_joined_at_vertices: measure("components_joined_at_vertices"),
    }
}

/// Builds the mesh in every way and compares.
fn check(mesh: &Mesh, known: &Known) {
    let mut shuffled = mesh.clone().renamed(&format!("{}, shuffled", mesh.name));
    let mut random = Random::new(3);
    shuffled.flip_some(&mut random, 30);
    shuffled.shuffle(&mut random);
    for mesh in [mesh, &shuffled] {
        let bench = Bench::new(mesh);
        let ways = [
            &[][..],
            &["--chunk-triangles=3"],
            &["--chunk-triangles=16", "--strategy=contract", "--buckets=3"],
            &["--strategy=by-place", "--buckets=5"],
            &["--strategy=by-id", "--buckets=4", "--index=u8"],
        ];
        for (way, options) in ways.into_iter().enumerate() {
            let options = [options, &["--memory=64MiB"]].concat();
            let folder = Folder::read(&bench.build(&format!("{way}.ct"), &options));
            assert_eq!(&found(&folder), known, "{}, {options:?}", mesh.name);
        }
    }
}

/// Removes the last triangle of `a` and the first of `b`, and joins the surfaces where they were.
fn connected_sum(a: Mesh, b: &Mesh) -> Mesh {
    let mut a = a;
    let mouth = a.triangles.pop().expect("a triangle");
    let first = a.positions.len() as u32;
    let mut sum = a.plus(&b.clone().moved([9.0, 0.0, 0.0]));
    let at = sum.triangles.len() - b.triangles.len();
    let other = sum.triangles.remove(at);
    for id in sum.triangles.iter_mut().flatten() {
        if let Some(k) = other.iter().position(|v| v == id) {
            *id = mouth[k];
        }
    }
    assert!(first > 0 && other.iter().all(|&v| v >= first));
    sum
}

#[test]
fn closed_surfaces_of_every_genus() {
    check(&octahedron(), &closed(0, 2));
    let mut surface = torus(5, 6);
    for genus in 1..5 {
        check(&surface, &closed(genus, 2 - 2 * genus as i64));
        surface = connected_sum(surface, &torus(4, 5));
    }
}

#[test]
fn surfaces_that_cannot_be_oriented() {
    check(&klein_bottle(5, 6), &closed(2, 0));
    check(&projective_plane(), &closed(1, 1));
    let strip = Known {
        border_loops: 1,
        ..closed(1, 0)
    };
    check(&moebius(9), &strip);
}

#[test]
fn disks_with_holes() {
    let side = 9u32;
    for holes in 0..4u32 {
        let mut triangles = vec![];
        for (x, y) in (0..side * side).map(|i| (i % side, i / side)) {
            // Holes two squares apart, so that they have no vertex in common.
            if y == 4 && x % 2 == 1 && x / 2 < holes {
                continue;
            }
            let id = |dx, dy| (y + dy) * (side + 1) + x + dx;
            triangles.push([id(0, 0), id(1, 0), id(1, 1)]);
            triangles.push([id(0, 0), id(1, 1), id(0, 1)]);
        }
        let place = |i| [(i % (side + 1)) as f32, (i / (side + 1)) as f32, 0.0];
        let positions = (0..(side + 1) * (side + 1)).map(place).collect();
        let known = Known {
            border_loops: 1 + i64::from(holes),
            ..closed(0, 1 - i64::from(holes))
        };
        let known = Known {
            smesh_components: 0,
            ..known
        };
        check(&Mesh::new("disk with holes", triangles, positions), &known);
    }
}

/// Two cubes of which `shared` vertices of the second are those of the first.
fn cubes(shared: &[u32]) -> Mesh {
    let eight = cube().positions.len() as u32;
    let mut mesh = cube().plus(&cube().moved([5.0, 0.0, 0.0]));
    for id in mesh.triangles.iter_mut().flatten() {
        if shared.contains(&id.wrapping_sub(eight)) {
            *id -= eight;
        }
    }
    mesh
}

#[test]
fn cubes_that_share_a_vertex_or_an_edge() {
    let two = |loops, euler, vertices, simple| Known {
        components: 2,
        genus: vec![0, 0],
        border_loops: loops,
        euler,
        nonmanifold_vertices: vertices,
        smesh_components: simple,
        components_joined_at_vertices: 1,
        ..closed(0, 2)
    };
    check(&cubes(&[3]), &two(0, 4, 1, 2));
    // The shared edge cuts both cubes open: two disks, each with one loop, whose ends meet.
    let edge = &cube().triangles[0][..2];
    check(&cubes(edge), &two(2, 2, 2, 0));
}

#[test]
fn duplicates_close_or_cut() {
    // Back to back a triangle and its duplicate are a sphere of two triangles and three vertices.
    let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let pair = Mesh::new("pair", vec![[0, 1, 2], [2, 1, 0]], corners.clone());
    let known = Known {
        duplicate: 1,
        ..closed(0, 2)
    };
    check(&pair, &known);
    // Three cut each other: as many disks.
    let three = Mesh::new("three", vec![[0, 1, 2], [2, 1, 0], [1, 2, 0]], corners);
    let known = Known {
        components: 3,
        genus: vec![0; 3],
        border_loops: 3,
        euler: 3,
        nonmanifold_vertices: 3,
        duplicate: 2,
        smesh_components: 0,
        ..closed(0, 2)
    };
    check(&three, &known);
}
