//! Small meshes, each named by its hazard, and larger ones for the ways out of memory.

use crate::naive::Soup;
use std::f64::consts::{PI, TAU};

/// A mesh with coordinates.
pub fn soup(v: &[[u64; 3]], g: &[[f64; 3]]) -> Soup {
    Soup {
        v: v.to_vec(),
        n: g.len() as u64,
        g: Some(g.to_vec()),
    }
}

/// The unit tetrahedron, outward.
pub const TETRA: [[u64; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
const TETRA_G: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];

pub fn tetra() -> Soup {
    soup(&TETRA, &TETRA_G)
}

/// One mesh after the other, without common vertices.
pub fn beside(a: &Soup, b: &Soup, shift: [f64; 3]) -> Soup {
    let mut both = a.clone();
    both.v.extend(b.v.iter().map(|v| v.map(|v| v + a.n)));
    both.n += b.n;
    if let (Some(g), Some(other)) = (&mut both.g, &b.g) {
        g.extend(other.iter().map(|p| [0, 1, 2].map(|i| p[i] + shift[i])));
    }
    both
}

/// Turns the triangles for which `which` holds.
pub fn flip(mut mesh: Soup, which: impl Fn(usize) -> bool) -> Soup {
    for (t, v) in mesh.v.iter_mut().enumerate() {
        if which(t) {
            v.swap(1, 2);
        }
    }
    mesh
}

/// Two tetrahedra that share the edge {0, 1}: four corners face it.
pub fn two_on_an_edge() -> Soup {
    let v = [
        [0, 2, 1],
        [0, 1, 3],
        [1, 2, 3],
        [0, 3, 2],
        [0, 4, 1],
        [0, 1, 5],
        [1, 4, 5],
        [0, 5, 4],
    ];
    let mut g = TETRA_G.to_vec();
    g.extend([[0., -1., 0.], [0., 0., -1.]]);
    soup(&v, &g)
}

/// Two tetrahedra that share the vertex 0.
pub fn two_at_a_vertex() -> Soup {
    let mut soup = beside(&tetra(), &tetra(), [0.; 3]);
    for v in soup.v.iter_mut().flatten().filter(|v| **v >= 4) {
        *v = if *v == 4 { 0 } else { *v - 1 };
    }
    soup.n = 7;
    let g = TETRA_G[1..].iter().map(|p| p.map(|x| -x));
    soup.g = Some(TETRA_G.iter().copied().chain(g).collect());
    soup
}

/// A tetrahedron whose triangles are there twice.
pub fn doubled() -> Soup {
    Soup {
        v: [TETRA, TETRA].concat(),
        ..tetra()
    }
}

/// A disk of `n` triangles around the vertex 0.
pub fn wheel(n: u64) -> Soup {
    let v: Vec<[u64; 3]> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    let mut g = vec![[0.; 3]];
    g.extend((0..n).map(|i| {
        let angle = TAU * i as f64 / n as f64;
        [angle.cos(), angle.sin(), 0.].map(single)
    }));
    soup(&v, &g)
}

/// `n` triangles on one edge, then the same ones in reverse, then the tips of pairs joined.
pub fn book(n: u64) -> Soup {
    let mut v: Vec<[u64; 3]> = (0..n).map(|i| [0, 1, 2 + i]).collect();
    v.extend((0..n).rev().map(|i| [2 + i, 1, 0]));
    v.extend((0..n - 1).step_by(2).map(|i| [0, 2 + i, 3 + i]));
    let mut g = vec![[0., 0., 0.], [0., 0., 1.]];
    g.extend((0..n).map(|i| [f64::from(i as u32 % 997), f64::from(i as u32 / 997), 0.5]));
    soup(&v, &g)
}

/// A strip of `n` quads that closes with a half twist.
pub fn moebius(n: u64) -> Soup {
    let mut v = Vec::new();
    for i in 0..n {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
        v.extend([[a, c, b], [b, c, d]]);
    }
    let g: Vec<[f64; 3]> = (0..2 * n)
        .map(|i| {
            let (turn, side) = ((i / 2) as f64 / n as f64, (i % 2) as f64 - 0.5);
            let (angle, half) = (turn * TAU, turn * PI);
            let r = 2.0 + side * f64::cos(half);
            [r * angle.cos(), r * angle.sin(), side * half.sin()].map(single)
        })
        .collect();
    soup(&v, &g)
}

fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// A strip with a degenerate triangle between its triangles, and a vertex that none names.
pub fn strip_with_degenerate() -> Soup {
    let v = [
        [0, 1, 2],
        [2, 1, 3],
        [3, 3, 1],
        [2, 3, 4],
        [4, 3, 5],
        [0, 1, 1],
    ];
    let g: Vec<[f64; 3]> = (0..7)
        .map(|i| [f64::from(i / 2), f64::from(i % 2), f64::from(i * i) / 8.0])
        .collect();
    soup(&v, &g)
}

/// A fan of `n` triangles on the edge {0, 1}.
pub fn fan(n: u64) -> Soup {
    let v: Vec<[u64; 3]> = (0..n)
        .map(|i| {
            if i % 3 == 0 {
                [0, 1, i + 2]
            } else {
                [1, 0, i + 2]
            }
        })
        .collect();
    let mut g = vec![[0., 0., 0.], [0., 0., 1.]];
    g.extend((0..n).map(|i| [f64::from(i as u32), 1.0, 0.5]));
    soup(&v, &g)
}

/// A torus of `a` by `b` quads.
pub fn torus(a: u64, b: u64) -> Soup {
    let at = |i: u64, j: u64| i % a * b + j % b;
    let mut v = Vec::new();
    for i in 0..a {
        for j in 0..b {
            let (p, q, r, s) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            v.extend([[p, q, r], [p, r, s]]);
        }
    }
    let mut g = Vec::new();
    for i in 0..a {
        for j in 0..b {
            let (x, y) = (TAU * i as f64 / a as f64, TAU * j as f64 / b as f64);
            let r = 3.0 + y.cos();
            g.push([r * x.cos(), r * x.sin(), y.sin()].map(single));
        }
    }
    soup(&v, &g)
}

/// Random triangles over few vertices: every kind of edge.
pub fn random(seed: u64, triangles: usize, vertices: u64) -> Soup {
    let mut random = generator(seed);
    let v: Vec<[u64; 3]> = (0..triangles)
        .map(|_| [0; 3].map(|_| random(vertices)))
        .collect();
    let g: Vec<[f64; 3]> = (0..vertices)
        .map(|_| [0; 3].map(|_| random(1 << 20) as f64 / 1024.0 - 500.0))
        .collect();
    soup(&v, &g)
}

/// A generator of numbers below what it is asked.
pub fn generator(seed: u64) -> impl FnMut(u64) -> u64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d;
    move |n| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) % n
    }
}

/// The same mesh with triangles and vertices in random order.
pub fn shuffled(mesh: &Soup, seed: u64) -> Soup {
    let mut random = generator(seed);
    let mut place: Vec<u64> = (0..mesh.n).collect();
    for i in (1..place.len()).rev() {
        place.swap(i, random(i as u64 + 1) as usize);
    }
    let mut out = mesh.clone();
    for v in &mut out.v {
        *v = v.map(|v| place[v as usize]);
    }
    for i in (1..out.v.len()).rev() {
        out.v.swap(i, random(i as u64 + 1) as usize);
    }
    if let (Some(to), Some(from)) = (&mut out.g, &mesh.g) {
        for (v, p) in from.iter().enumerate() {
            to[place[v] as usize] = *p;
        }
    }
    out
}

/// Every small mesh with its name.
pub fn all() -> Vec<(&'static str, Soup)> {
    let inner = |scale: f64| {
        let mut small = tetra();
        for p in small.g.iter_mut().flatten() {
            *p = p.map(|x| x * scale);
        }
        small
    };
    let holed = Soup {
        v: TETRA[..3].to_vec(),
        ..tetra()
    };
    let mut nonfinite = beside(&tetra(), &tetra(), [3., 0., 0.]);
    nonfinite.g.as_mut().unwrap()[5][1] = f64::NAN;
    nonfinite.g.as_mut().unwrap()[6][0] = f64::INFINITY;
    let mut bare = two_on_an_edge();
    bare.g = None;
    bare.n = 9;
    let mut flat = tetra();
    flat.g = Some(vec![[1., 2., 3.]; 4]);
    vec![
        ("nothing", soup(&[], &[])),
        ("points only", soup(&[], &TETRA_G)),
        ("one triangle", soup(&[[2, 0, 1]], &TETRA_G[..3])),
        ("only degenerate", soup(&[[1, 1, 1], [0, 0, 1]], &TETRA_G)),
        ("tetrahedron", tetra()),
        ("tetrahedron inside out", flip(tetra(), |_| true)),
        ("tetrahedron, one turned", flip(tetra(), |t| t == 1)),
        ("half turned", flip(tetra(), |t| t % 2 == 0)),
        ("tetrahedron with a hole", holed.clone()),
        ("hole, first turned", flip(holed, |t| t == 0)),
        ("two on an edge", two_on_an_edge()),
        (
            "two on an edge, turned",
            flip(two_on_an_edge(), |t| t % 3 == 0),
        ),
        ("without coordinates", bare),
        ("moebius", moebius(7)),
        ("moebius, turned", flip(moebius(8), |t| t % 5 < 2)),
        ("strip with degenerate", strip_with_degenerate()),
        (
            "strip turned",
            flip(strip_with_degenerate(), |t| t == 1 || t == 3),
        ),
        ("fan of three", fan(3)),
        ("fan of nine", fan(9)),
        ("not finite", nonfinite),
        ("flat", flip(flat, |t| t == 2)),
        ("doubled", doubled()),
        ("two at a vertex", two_at_a_vertex()),
        ("wheel", wheel(70)),
        ("book", book(6)),
        ("torus", torus(5, 4)),
        ("torus, turned", flip(torus(6, 9), |t| t % 7 < 3)),
        ("nested", beside(&tetra(), &inner(0.25), [0.1, 0.1, 0.1])),
        ("far out", beside(&tetra(), &inner(1e-3), [1e6, 0., 0.])),
        ("soup", random(1, 40, 12)),
        ("thin soup", random(2, 60, 40)),
    ]
}
