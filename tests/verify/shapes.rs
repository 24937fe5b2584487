//! What the vertices of a mesh tell, as naively as possible: a union-find over all corners, and
//! the definitions word by word.

use crate::naive::{Edges, Parts, Soup, is_degenerate};
use cornermill::folder::{ComponentMeasures, Measures, ValenceClass};
use std::collections::{BTreeMap, BTreeSet};

/// What a measured folder has beyond others, to be changed by a test and then written.
#[derive(Clone)]
pub struct Measured {
    pub rows: Vec<ComponentMeasures>,
    pub vertices: Vec<u64>,
    pub duplicate: Vec<u64>,
    pub whole: Measures,
}

/// Sets of numbers that are joined two by two.
struct Sets(Vec<usize>);

impl Sets {
    fn new(n: usize) -> Sets {
        Sets((0..n).collect())
    }

    fn of(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[b] = a;
    }
}

/// The corner of a triangle at a vertex.
fn corner_at(soup: &Soup, t: u64, vertex: u64) -> usize {
    let three = soup.v[t as usize];
    let k = three.iter().position(|&v| v == vertex).unwrap();
    3 * t as usize + k
}

/// The measures of a mesh, whose components `parts` knows.
pub fn measured(soup: &Soup, parts: &Parts, edges: &Edges) -> Measured {
    let corners = 3 * soup.v.len();
    let vertex = |c: usize| soup.v[c / 3][c % 3];
    let label = |c: usize| parts.label[c / 3] as usize;
    let real: Vec<usize> = (0..corners)
        .filter(|&c| !is_degenerate(&soup.v[c / 3]))
        .collect();
    // Fans: corners joined at both ends of every regular edge.
    let mut fans = Sets::new(corners);
    for (&(lo, hi), facing) in edges {
        if let [(a, _), (b, _)] = facing[..] {
            for end in [lo, hi] {
                fans.join(corner_at(soup, a / 3, end), corner_at(soup, b / 3, end));
            }
        }
    }
    let mut fans_of: BTreeMap<u64, BTreeSet<usize>> = BTreeMap::new();
    for &c in &real {
        fans_of.entry(vertex(c)).or_default().insert(fans.of(c));
    }
    // Loops: corners without an opposite, joined where the ends of a fan face them.
    let mut ends: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (&(lo, hi), facing) in edges.iter().filter(|(_, facing)| facing.len() != 2) {
        for &(c, _) in facing {
            for end in [lo, hi] {
                let fan = fans.of(corner_at(soup, c / 3, end));
                ends.entry(fan).or_default().push(c as usize);
            }
        }
    }
    let mut loops = Sets::new(corners);
    for two in ends.values() {
        assert_eq!(two.len(), 2, "every open fan has two ends");
        loops.join(two[0], two[1]);
    }
    let loose: BTreeSet<usize> = ends.values().flatten().map(|&c| loops.of(c)).collect();
    let mut rows = vec![ComponentMeasures::default(); parts.rows.len()];
    let named: BTreeSet<(u64, usize)> = real.iter().map(|&c| (vertex(c), label(c))).collect();
    named.iter().for_each(|&(_, l)| rows[l].vertices += 1);
    for &fan in fans_of.values().flatten() {
        rows[label(fan)].fans += 1;
    }
    loose.iter().for_each(|&c| rows[label(c)].border_loops += 1);
    for (row, base) in rows.iter_mut().zip(&parts.rows) {
        let (edges, triangles) = (base.edges as i64, base.triangles as i64);
        row.euler = row.fans as i64 - edges + triangles;
        let rest = 2 - row.border_loops as i64 - row.euler;
        assert!(rest >= 0 && (base.orientable == 0 || rest % 2 == 0));
        row.genus = rest as u64 >> base.orientable;
        let sound = base.closed == 1 && base.orientable == 1 && row.vertices == row.fans;
        row.is_smesh = u8::from(sound && triangles == 2 * row.vertices as i64 - 4);
    }
    let mut at_vertices = Sets::new(rows.len());
    for here in fans_of.values() {
        let labels: Vec<usize> = here.iter().map(|&fan| label(fan)).collect();
        labels.iter().for_each(|&l| at_vertices.join(labels[0], l));
    }
    let vertices: Vec<u64> = fans_of
        .iter()
        .filter(|(_, fans)| fans.len() > 1)
        .map(|(&v, _)| v)
        .collect();
    let duplicate = duplicates(soup);
    let valence = valences(soup, &real);
    let sum = |of: fn(&ComponentMeasures) -> u64| rows.iter().map(of).sum::<u64>();
    let whole = Measures {
        fans: sum(|r| r.fans),
        border_loops: sum(|r| r.border_loops),
        euler: rows.iter().map(|r| r.euler).sum(),
        nonmanifold_vertices: vertices.len() as u64,
        duplicate: duplicate.len() as u64,
        components_joined_at_vertices: (0..rows.len()).filter(|&l| at_vertices.of(l) == l).count()
            as u64,
        smesh_components: sum(|r| r.is_smesh.into()),
        largest_valence: valence.keys().last().copied().unwrap_or(0),
        valences: classes(&valence),
    };
    Measured {
        rows,
        vertices,
        duplicate,
        whole,
    }
}

fn duplicates(soup: &Soup) -> Vec<u64> {
    let mut met = BTreeSet::new();
    let all = soup.v.iter().enumerate();
    all.filter(|(_, v)| {
        let mut sorted = **v;
        sorted.sort();
        !is_degenerate(v) && !met.insert(sorted)
    })
    .map(|(t, _)| t as u64)
    .collect()
}

/// Vertices by valence.
fn valences(soup: &Soup, real: &[usize]) -> BTreeMap<u64, u64> {
    let mut at: BTreeMap<u64, u64> = BTreeMap::new();
    real.iter()
        .for_each(|&c| *at.entry(soup.v[c / 3][c % 3]).or_default() += 1);
    let mut valence: BTreeMap<u64, u64> = BTreeMap::new();
    at.values()
        .for_each(|&n| *valence.entry(n).or_default() += 1);
    let rest = soup.n - at.len() as u64;
    if rest > 0 {
        valence.insert(0, rest);
    }
    valence
}

fn classes(valence: &BTreeMap<u64, u64>) -> Vec<ValenceClass> {
    let exact = (0..64).map(|n| (n, n));
    let wider = (6..40).map(|bit| (1 << bit, (2 << bit) - 1));
    exact
        .chain(wider)
        .map(|(from, to)| ValenceClass {
            from,
            to,
            vertices: valence.range(from..=to).map(|(_, n)| n).sum(),
        })
        .filter(|class| class.vertices > 0)
        .collect()
}

impl Parts {
    /// The rows of the table, measured or not.
    pub fn table(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (place, row) in self.rows.iter().enumerate() {
            bytes.extend(bytemuck::bytes_of(row));
            if let Some(measured) = &self.measured {
                // A test may have more rows than components.
                let last = measured.rows.len() - 1;
                bytes.extend(bytemuck::bytes_of(&measured.rows[place.min(last)]));
            }
        }
        bytes
    }

    /// The measures, which are there.
    pub fn measures(&mut self) -> &mut Measured {
        self.measured.as_mut().unwrap()
    }
}
