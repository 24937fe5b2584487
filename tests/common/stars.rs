//! The naive oracle of vertex stars: fans are classes of corners, searched by joining every two
//! corners that a regular edge links; loops are classes of corners without opposite.

use super::naive::{Component, is_degenerate, next, previous};
use std::collections::{BTreeMap, BTreeSet};

/// What the vertices of a component tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Star {
    pub vertices: u64,
    pub fans: u64,
    pub border_loops: u64,
    pub euler: i64,
    pub genus: i64,
    pub is_smesh: bool,
}

/// What the folder must say of vertices.
pub struct Stars {
    pub components: Vec<Star>,
    pub nonmanifold_vertices: Vec<u64>,
    pub duplicate: Vec<u64>,
    /// The numbers of `measures` in the manifest, without classes.
    pub measures: BTreeMap<&'static str, i64>,
    /// Vertices by valence.
    pub valences: BTreeMap<u64, u64>,
}

/// Classes under repeated joining, by relabelling: quadratic.
struct Classes(Vec<usize>);

impl Classes {
    fn new(count: usize) -> Classes {
        Classes((0..count).collect())
    }

    fn join(&mut self, a: usize, b: usize) {
        let (keep, drop) = (self.0[a], self.0[b]);
        if keep != drop {
            let same = self.0.iter_mut().filter(|l| **l == drop);
            same.for_each(|l| *l = keep);
        }
    }

    fn count(&self, of: impl Iterator<Item = usize>) -> u64 {
        of.map(|i| self.0[i]).collect::<BTreeSet<_>>().len() as u64
    }
}

/// The corner of triangle `t` at vertex `id`.
fn at(v: &[[u64; 3]], t: usize, id: u64) -> usize {
    let k = v[t].iter().position(|&x| x == id);
    3 * t + k.expect("the triangle has the vertex")
}

/// The stars of an oriented table of so many vertices, with its opposites and components.
pub fn stars(
    v: &[[u64; 3]],
    opposite: &[Option<usize>],
    components: &[Component],
    vertices: u64,
) -> Stars {
    let flat = v.as_flattened();
    let real: Vec<usize> = (0..flat.len())
        .filter(|c| !is_degenerate(&v[c / 3]))
        .collect();
    let mut fans = Classes::new(flat.len());
    let mut loops = Classes::new(flat.len());
    for &c in &real {
        for id in [flat[next(c)], flat[previous(c)]] {
            if let Some(d) = opposite[c] {
                fans.join(at(v, c / 3, id), at(v, d / 3, id));
            }
        }
    }
    // The fans at the two ends of each edge without opposite.
    let open: Vec<usize> = real
        .iter()
        .copied()
        .filter(|&c| opposite[c].is_none())
        .collect();
    let ends = |c: usize| [next(c), previous(c)].map(|e| fans.0[e]);
    for (i, &c) in open.iter().enumerate() {
        for &d in &open[i + 1..] {
            if ends(c).iter().any(|fan| ends(d).contains(fan)) {
                loops.join(c, d);
            }
        }
    }
    let star = |component: &Component| {
        let own = || component.members.iter().flat_map(|t| 3 * t..3 * t + 3);
        let ids: BTreeSet<u64> = own().map(|c| flat[c]).collect();
        let triangles = component.members.len() as i64;
        let fans = fans.count(own());
        let border_loops = loops.count(own().filter(|&c| opposite[c].is_none()));
        let euler = fans as i64 - component.edges as i64 + triangles;
        let handles = 2 - border_loops as i64 - euler;
        Star {
            vertices: ids.len() as u64,
            fans,
            border_loops,
            euler,
            genus: if component.orientable {
                handles / 2
            } else {
                handles
            },
            is_smesh: component.closed
                && component.orientable
                && ids.len() as u64 == fans
                && triangles == 2 * ids.len() as i64 - 4,
        }
    };
    let rows: Vec<Star> = components.iter().map(star).collect();
    let (nonmanifold_vertices, valences) = by_vertex(flat, &real, &fans, vertices);
    let duplicate = duplicates(v);
    let sum = |f: fn(&Star) -> i64| rows.iter().map(f).sum::<i64>();
    let measures = BTreeMap::from([
        ("fans", sum(|s| s.fans as i64)),
        ("border_loops", sum(|s| s.border_loops as i64)),
        ("euler", sum(|s| s.euler)),
        ("smesh_components", sum(|s| s.is_smesh.into())),
        ("nonmanifold_vertices", nonmanifold_vertices.len() as i64),
        ("duplicate", duplicate.len() as i64),
        ("components_joined_at_vertices", joined(flat, &real)),
        (
            "largest_valence",
            valences.keys().last().map_or(0, |&n| n as i64),
        ),
    ]);
    Stars {
        components: rows,
        nonmanifold_vertices,
        duplicate,
        measures,
        valences,
    }
}

fn by_vertex(
    flat: &[u64],
    real: &[usize],
    fans: &Classes,
    vertices: u64,
) -> (Vec<u64>, BTreeMap<u64, u64>) {
    let mut found: BTreeMap<u64, Vec<usize>> = (0..vertices).map(|id| (id, vec![])).collect();
    for &c in real {
        found.entry(flat[c]).or_default().push(c);
    }
    let several = |(_, corners): &(&u64, &Vec<usize>)| fans.count(corners.iter().copied()) > 1;
    let nonmanifold = found.iter().filter(several).map(|(&id, _)| id).collect();
    let mut valences = BTreeMap::new();
    for corners in found.values() {
        *valences.entry(corners.len() as u64).or_insert(0) += 1;
    }
    (nonmanifold, valences)
}

fn duplicates(v: &[[u64; 3]]) -> Vec<u64> {
    let mut seen = BTreeSet::new();
    let sorted = |t: &[u64; 3]| {
        let mut ids = *t;
        ids.sort();
        ids
    };
    let real = v.iter().enumerate().filter(|(_, t)| !is_degenerate(t));
    let again = real.filter(|(_, t)| !seen.insert(sorted(t)));
    again.map(|(t, _)| t as u64).collect()
}

/// How many sets of triangles any shared vertex joins.
fn joined(flat: &[u64], real: &[usize]) -> i64 {
    let mut triangles = Classes::new(flat.len() / 3);
    let mut first = BTreeMap::new();
    for &c in real {
        triangles.join(*first.entry(flat[c]).or_insert(c / 3), c / 3);
    }
    triangles.count(real.iter().map(|c| c / 3)) as i64
}
