//! Counts what a small mesh holds, as naively as possible, from its triangles alone.

use std::collections::{BTreeMap, BTreeSet};

use data_gen::{Mesh, Truth};

/// Triangles of a mesh, gathered.
pub fn gather(mesh: &dyn Mesh) -> Vec<[u64; 3]> {
    (0..mesh.truth().triangles)
        .map(|t| mesh.triangle(t))
        .collect()
}

/// The two vertices of the edge that corner `k` faces, in the triangle's direction.
fn side(t: &[u64; 3], k: usize) -> (u64, u64) {
    (t[(k + 1) % 3], t[(k + 2) % 3])
}

fn key((a, b): (u64, u64)) -> (u64, u64) {
    (a.min(b), a.max(b))
}

fn is_degenerate(t: &[u64; 3]) -> bool {
    t[0] == t[1] || t[1] == t[2] || t[2] == t[0]
}

/// For each edge the corners (triangle, k) that face it.
type Edges = BTreeMap<(u64, u64), Vec<(usize, usize)>>;

fn edges(triangles: &[[u64; 3]]) -> Edges {
    let mut edges = Edges::new();
    for (t, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            if !is_degenerate(corners) {
                edges.entry(key(side(corners, k))).or_default().push((t, k));
            }
        }
    }
    edges
}

/// A partition of `0..n`.
struct Sets(Vec<usize>);

impl Sets {
    fn new(n: usize) -> Sets {
        Sets((0..n).collect())
    }

    fn find(&self, mut x: usize) -> usize {
        while self.0[x] != x {
            x = self.0[x];
        }
        x
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }

    /// How many sets hold at least one of `members`.
    fn count(&self, members: impl Iterator<Item = usize>) -> u64 {
        members.map(|x| self.find(x)).collect::<BTreeSet<_>>().len() as u64
    }
}

/// All the counts, `flipped` aside, which a file does not tell.
pub fn count(triangles: &[[u64; 3]], vertices: u64) -> Truth {
    let edges = edges(triangles);
    let proper = || (0..triangles.len()).filter(|&t| !is_degenerate(&triangles[t]));
    let mut truth = Truth {
        triangles: triangles.len() as u64,
        vertices,
        distinct_edges: edges.len() as u64,
        ..Truth::default()
    };
    let mut linked = Sets::new(triangles.len());
    let mut joined = Sets::new(triangles.len());
    // Each triangle twice, as it is and turned over: a component that links a triangle with itself
    // turned over cannot be oriented.
    let mut sheets = Sets::new(2 * triangles.len());
    let mut open = BTreeSet::new();
    for corners in edges.values() {
        for pair in corners.windows(2) {
            joined.join(pair[0].0, pair[1].0);
        }
        if let [(t, j), (u, k)] = corners[..] {
            let against = side(&triangles[t], j) == side(&triangles[u], k);
            truth.inconsistent_edges += u64::from(against);
            linked.join(t, u);
            let turn = usize::from(against);
            sheets.join(2 * t, 2 * u + turn);
            sheets.join(2 * t + 1, 2 * u + 1 - turn);
        } else {
            open.extend(corners.iter().copied());
            truth.border_edges += u64::from(corners.len() == 1);
            truth.nonmanifold_edges += u64::from(corners.len() > 2);
        }
    }
    truth.components = linked.count(proper());
    truth.components_joined = joined.count(proper());
    let open_components: BTreeSet<usize> = open.iter().map(|c| linked.find(c.0)).collect();
    truth.closed_components = truth.components - open_components.len() as u64;
    let two_faced = proper().filter(|&t| sheets.find(2 * t) == sheets.find(2 * t + 1));
    truth.nonorientable_components = linked.count(two_faced);
    truth.degenerate = triangles.iter().filter(|t| is_degenerate(t)).count() as u64;
    let sorted = |t: usize| {
        let mut corners = triangles[t];
        corners.sort();
        corners
    };
    let different: BTreeSet<_> = proper().map(sorted).collect();
    truth.duplicate = proper().count() as u64 - different.len() as u64;
    let used: BTreeSet<u64> = triangles.iter().flatten().copied().collect();
    truth.unreferenced = vertices - used.len() as u64;
    around_vertices(triangles, &edges, &open, &mut truth);
    truth
}

/// Fans and border loops: corners at a vertex are in one fan when linked across regular edges there;
/// two open sides follow each other when they end the same fan.
fn around_vertices(
    triangles: &[[u64; 3]],
    edges: &Edges,
    open: &BTreeSet<(usize, usize)>,
    truth: &mut Truth,
) {
    let mut fans = Sets::new(3 * triangles.len());
    for corners in edges.values() {
        if let [(t, j), (u, k)] = corners[..] {
            for a in [(j + 1) % 3, (j + 2) % 3] {
                for b in [(k + 1) % 3, (k + 2) % 3] {
                    if triangles[t][a] == triangles[u][b] {
                        fans.join(3 * t + a, 3 * u + b);
                    }
                }
            }
        }
    }
    let mut at_vertex: BTreeMap<u64, BTreeSet<usize>> = BTreeMap::new();
    for (t, corners) in triangles.iter().enumerate() {
        if !is_degenerate(corners) {
            for (k, &v) in corners.iter().enumerate() {
                at_vertex.entry(v).or_default().insert(fans.find(3 * t + k));
            }
        }
    }
    truth.nonmanifold_vertices = at_vertex.values().filter(|fans| fans.len() > 1).count() as u64;
    let mut loops = Sets::new(3 * triangles.len());
    let mut end_of_fan = BTreeMap::new();
    for &(t, k) in open {
        for a in [(k + 1) % 3, (k + 2) % 3] {
            let first = *end_of_fan.entry(fans.find(3 * t + a)).or_insert(3 * t + k);
            loops.join(first, 3 * t + k);
        }
    }
    truth.border_loops = loops.count(open.iter().map(|&(t, k)| 3 * t + k));
}

/// Six times the volume under each component, by the lowest triangle of it.
pub fn volumes(mesh: &dyn Mesh) -> Vec<f64> {
    let triangles = gather(mesh);
    let mut sets = Sets::new(triangles.len());
    for corners in edges(&triangles).values() {
        if let [(t, _), (u, _)] = corners[..] {
            sets.join(t, u);
        }
    }
    let mut volumes: BTreeMap<usize, f64> = BTreeMap::new();
    for (t, corners) in triangles.iter().enumerate() {
        // From a point of the component itself, so that little cancels.
        let origin = mesh.position(triangles[sets.find(t)][0]);
        let [a, b, c] = corners.map(|v| {
            let p = mesh.position(v);
            [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
        });
        let cross = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        let six = cross[0] * c[0] + cross[1] * c[1] + cross[2] * c[2];
        *volumes.entry(sets.find(t)).or_default() += six;
    }
    volumes.into_values().collect()
}
