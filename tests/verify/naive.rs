//! A mesh folder written as naively as possible, all in memory: what `verify` must accept,
//! in parts that a test can change before they are sealed.

use crate::shapes::{Measured, measured};
use bytemuck::Zeroable;
use cornermill::folder::{
    self, BLOCK, ComponentRow, Counts, EdgeRow, FileEntry, InputEntry, Manifest, Options, Orient,
    npy,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// All ones.
pub const NONE: u64 = u64::MAX;

/// A mesh as the input gives it.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    pub v: Vec<[u64; 3]>,
    /// Number of vertices.
    pub n: u64,
    pub g: Option<Vec<[f64; 3]>>,
}

/// The arrays of a folder, to be changed by a test and then written.
#[derive(Clone)]
pub struct Parts {
    pub v: Vec<u64>,
    pub o: Vec<u64>,
    pub g: Option<Vec<[f64; 3]>>,
    pub label: Vec<u64>,
    pub flipped: Vec<u8>,
    pub rows: Vec<ComponentRow>,
    pub edges: Vec<EdgeRow>,
    pub corners: Vec<u64>,
    pub degenerate: Vec<u64>,
    pub counts: Counts,
    /// None for a folder without measures.
    pub measured: Option<Measured>,
    pub orient: Orient,
    pub wide: bool,
    pub wide_g: bool,
}

/// Corners by the edge that they face; the flag says that the corner goes upward along it.
pub type Edges = BTreeMap<(u64, u64), Vec<(u64, bool)>>;

fn edges_of(v: &[[u64; 3]]) -> Edges {
    let mut edges = Edges::new();
    for (t, v) in v.iter().enumerate() {
        if is_degenerate(v) {
            continue;
        }
        for k in 0..3 {
            let (a, b) = (v[(k + 1) % 3], v[(k + 2) % 3]);
            let corners = edges.entry((a.min(b), a.max(b))).or_default();
            corners.push((3 * t as u64 + k as u64, a < b));
        }
    }
    edges
}

pub fn is_degenerate(v: &[u64; 3]) -> bool {
    v[0] == v[1] || v[1] == v[2] || v[2] == v[0]
}

/// A component: its triangles in order, each with its orientation relative to the first.
struct Piece {
    triangles: Vec<(usize, bool)>,
    orientable: bool,
}

fn pieces(v: &[[u64; 3]], edges: &Edges) -> Vec<Piece> {
    let mut near: Vec<Vec<(usize, bool)>> = vec![Vec::new(); v.len()];
    for corners in edges.values().filter(|c| c.len() == 2) {
        let (a, b) = (corners[0], corners[1]);
        let (ta, tb) = ((a.0 / 3) as usize, (b.0 / 3) as usize);
        near[ta].push((tb, a.1 == b.1));
        near[tb].push((ta, a.1 == b.1));
    }
    let mut seen: Vec<Option<bool>> = vec![None; v.len()];
    let mut all = Vec::new();
    for first in 0..v.len() {
        if seen[first].is_some() || is_degenerate(&v[first]) {
            continue;
        }
        seen[first] = Some(false);
        let (mut stack, mut piece) = (vec![first], Vec::new());
        let mut orientable = true;
        while let Some(t) = stack.pop() {
            piece.push((t, seen[t] == Some(true)));
            for &(other, against) in &near[t] {
                let side = Some((seen[t] == Some(true)) ^ against);
                if seen[other].is_none() {
                    seen[other] = side;
                    stack.push(other);
                } else {
                    orientable &= seen[other] == side;
                }
            }
        }
        piece.sort();
        all.push(Piece {
            triangles: piece,
            orientable,
        });
    }
    all
}

/// The volume grid: least corner of the box of the finite vertices, and the step, a power of two.
fn grid(g: &[[f64; 3]]) -> ([f64; 3], f64) {
    let finite = g.iter().filter(|p| p.iter().all(|x| x.is_finite()));
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in finite {
        for axis in 0..3 {
            min[axis] = min[axis].min(p[axis]);
            max[axis] = max[axis].max(p[axis]);
        }
    }
    let extent = (0..3).map(|a| max[a] - min[a]).fold(0.0, f64::max);
    let mut unit = 1.0;
    while unit < extent {
        unit *= 2.0;
    }
    while unit / 2.0 >= extent && extent > 0.0 {
        unit /= 2.0;
    }
    (min, unit / f64::from(1 << 30))
}

/// Six times the volume in grid steps, and the area, of triangles in an orientation.
fn measures(v: &[[u64; 3]], turned: &[(usize, bool)], g: &[[f64; 3]]) -> Option<(i128, f64)> {
    let (min, step) = grid(g);
    let (mut six, mut area) = (0i128, 0.0);
    for &(t, flip) in turned {
        let p = v[t].map(|v| g[v as usize]);
        if p.iter().flatten().any(|x| !x.is_finite()) {
            return None;
        }
        let q = p.map(|p| {
            [0, 1, 2].map(|a| {
                let steps = (p[a] - min[a]) / step;
                steps.round_ties_even() as i128
            })
        });
        let det = q[0][0] * (q[1][1] * q[2][2] - q[1][2] * q[2][1])
            - q[0][1] * (q[1][0] * q[2][2] - q[1][2] * q[2][0])
            + q[0][2] * (q[1][0] * q[2][1] - q[1][1] * q[2][0]);
        six += if flip { -det } else { det };
        let (a, b) = (
            [0, 1, 2].map(|i| p[1][i] - p[0][i]),
            [0, 1, 2].map(|i| p[2][i] - p[0][i]),
        );
        let cross = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        area += cross.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0;
    }
    Some((six, area))
}

/// Which orientation a component gets: (turn the relative one round, by its volume).
fn choose(
    piece: &Piece,
    orient: Orient,
    six: Option<i128>,
    tight: bool,
) -> (Vec<(usize, bool)>, bool) {
    let turned = |round: bool| -> Vec<(usize, bool)> {
        let all = piece.triangles.iter();
        all.map(|&(t, side)| (t, side ^ round)).collect()
    };
    let keep = piece.triangles.iter().map(|&(t, _)| (t, false)).collect();
    if !piece.orientable || orient == Orient::Keep {
        return (keep, false);
    }
    if orient == Orient::First {
        return (turned(false), false);
    }
    if let Some(six) = six.filter(|&s| s != 0 && tight && orient == Orient::Outward) {
        return (turned(six < 0), true);
    }
    let against = piece.triangles.iter().filter(|(_, side)| *side).count();
    (turned(2 * against > piece.triangles.len()), false)
}

/// Corners of the final table: flipping exchanges corners 1 and 2.
fn moved(c: u64, flip: bool) -> u64 {
    match (flip, c % 3) {
        (true, 1) => c + 1,
        (true, 2) => c - 1,
        _ => c,
    }
}

/// The folder of a mesh.
pub fn parts(soup: &Soup, orient: Orient) -> Parts {
    // Coordinates that both widths hold exactly.
    let mut soup = soup.clone();
    for p in soup.g.iter_mut().flatten() {
        *p = p.map(|x| f64::from(x as f32));
    }
    let soup = &soup;
    let edges = edges_of(&soup.v);
    let all = pieces(&soup.v, &edges);
    let mut label = vec![NONE; soup.v.len()];
    let mut side = vec![false; soup.v.len()];
    for (l, piece) in all.iter().enumerate() {
        for &(t, s) in &piece.triangles {
            label[t] = l as u64;
            side[t] = s;
        }
    }
    let mut flips = vec![false; soup.v.len()];
    let mut rows = Vec::new();
    for (l, piece) in all.iter().enumerate() {
        let (row, turned) = component(soup, l as u64, piece, orient, &edges, &label, &side);
        rows.push(row);
        for (t, flip) in turned {
            flips[t] = flip;
        }
    }
    let mut v: Vec<u64> = Vec::new();
    for (t, three) in soup.v.iter().enumerate() {
        let [a, b, c] = *three;
        v.extend(if flips[t] { [a, c, b] } else { [a, b, c] });
    }
    let mut flipped = vec![0u8; soup.v.len().div_ceil(8)];
    for (t, flip) in flips.iter().enumerate() {
        flipped[t / 8] |= u8::from(*flip) << (t % 8);
    }
    let place = |c: u64| moved(c, flips[(c / 3) as usize]);
    let mut o = vec![NONE; v.len()];
    let (mut edge_rows, mut corners) = (Vec::new(), Vec::new());
    for (&(lo, hi), facing) in &edges {
        let mut own: Vec<u64> = facing.iter().map(|(c, _)| place(*c)).collect();
        own.sort();
        match own[..] {
            [a, b] => {
                o[a as usize] = b;
                o[b as usize] = a;
            }
            [_] => {}
            _ => {
                edge_rows.push(EdgeRow {
                    lo,
                    hi,
                    corners: own.len() as u64,
                    first_corner: own[0],
                });
                corners.extend(own);
            }
        }
    }
    let degenerate: Vec<u64> = (0..soup.v.len())
        .filter(|&t| is_degenerate(&soup.v[t]))
        .map(|t| t as u64)
        .collect();
    let mut parts = Parts {
        v,
        o,
        g: soup.g.clone(),
        label,
        flipped,
        rows,
        edges: edge_rows,
        corners,
        degenerate,
        counts: Counts::default(),
        measured: None,
        orient,
        wide: false,
        wide_g: false,
    };
    parts.counts = counts(soup, &parts, &edges);
    parts.measured = Some(measured(soup, &parts, &edges));
    parts
}

fn component(
    soup: &Soup,
    l: u64,
    piece: &Piece,
    orient: Orient,
    edges: &Edges,
    label: &[u64],
    side: &[bool],
) -> (ComponentRow, Vec<(usize, bool)>) {
    let mut row = ComponentRow::zeroed();
    let mut cancels = true;
    for corners in edges.values() {
        let own: Vec<_> = corners
            .iter()
            .filter(|(c, _)| label[(c / 3) as usize] == l)
            .collect();
        match corners.len() {
            1 => row.border_edges += own.len() as u64,
            2 => row.edges += u64::from(!own.is_empty()),
            _ => {
                row.cut_edges += own.len() as u64;
                let up = own.iter().filter(|(c, up)| {
                    let turned =
                        piece.orientable && orient != Orient::Keep && side[(c / 3) as usize];
                    up ^ turned
                });
                cancels &= 2 * up.count() == own.len();
            }
        }
    }
    row.edges += { row.border_edges } + row.cut_edges;
    let (border, cut) = (row.border_edges, row.cut_edges);
    let tight = border == 0 && (cut == 0 || cancels);
    row.orientable = u8::from(piece.orientable);
    row.closed = u8::from(border + cut == 0);
    row.watertight = u8::from(tight);
    row.first_triangle = piece.triangles[0].0 as u64;
    row.triangles = piece.triangles.len() as u64;
    let g = soup.g.as_deref();
    let six = |turned: &[(usize, bool)]| g.and_then(|g| measures(&soup.v, turned, g));
    let relative = six(&piece.triangles).map(|(six, _)| six);
    let (turned, outward) = choose(piece, orient, relative, tight);
    row.outward = u8::from(outward);
    row.flipped = turned.iter().filter(|(_, flip)| *flip).count() as u64;
    row.six_volume = f64::NAN;
    row.area = f64::NAN;
    if let Some((six, area)) = six(&turned) {
        let step = grid(g.unwrap_or(&[])).1;
        row.six_volume = six as f64 * step * step * step;
        row.area = area;
    }
    let (mut min, mut max) = ([f64::NAN; 3], [f64::NAN; 3]);
    for &(t, _) in &piece.triangles {
        for p in soup.v[t].iter().filter_map(|&v| g?.get(v as usize)) {
            for axis in 0..3 {
                if p.iter().all(|x| x.is_finite()) {
                    min[axis] = min[axis].min(p[axis]);
                    max[axis] = max[axis].max(p[axis]);
                }
            }
        }
    }
    row.bbox_min = min;
    row.bbox_max = max;
    (row, turned)
}

fn counts(soup: &Soup, parts: &Parts, edges: &Edges) -> Counts {
    let with = |n: fn(usize) -> bool| edges.values().filter(|c| n(c.len())).count() as u64;
    let rows = |which: fn(&ComponentRow) -> bool| {
        parts.rows.iter().filter(|row| which(row)).count() as u64
    };
    let used: BTreeSet<u64> = soup.v.iter().flatten().copied().collect();
    let infinite = |p: &&[f64; 3]| p.iter().any(|x| !x.is_finite());
    let mut joined: Vec<u64> = (0..parts.rows.len() as u64).collect();
    for corners in edges.values() {
        let labels = corners.iter().map(|(c, _)| parts.label[(c / 3) as usize]);
        let least = labels.clone().map(|l| joined[l as usize]).min();
        let met: Vec<u64> = labels.map(|l| joined[l as usize]).collect();
        for j in &mut joined {
            if met.contains(j) {
                *j = least.unwrap_or(*j);
            }
        }
    }
    joined.sort();
    joined.dedup();
    Counts {
        triangles: soup.v.len() as u64,
        vertices: soup.n,
        unreferenced_vertices: soup.n - used.len() as u64,
        nonfinite_vertices: soup.g.iter().flatten().filter(infinite).count() as u64,
        degenerate: parts.degenerate.len() as u64,
        distinct_edges: edges.len() as u64,
        regular_edges: with(|n| n == 2),
        border_edges: with(|n| n == 1),
        nonmanifold_edges: with(|n| n > 2),
        nonmanifold_corners: parts.corners.len() as u64,
        inconsistent_edges: edges
            .values()
            .filter(|c| c.len() == 2 && c[0].1 == c[1].1)
            .count() as u64,
        components: parts.rows.len() as u64,
        components_joined: joined.len() as u64,
        nonorientable_components: rows(|r| r.orientable == 0),
        closed_components: rows(|r| r.closed == 1),
        watertight_components: rows(|r| r.watertight == 1),
        flipped_triangles: parts
            .flipped
            .iter()
            .map(|b| u64::from(b.count_ones()))
            .sum(),
        flipped_components: rows(|r| { r.flipped } == { r.triangles }),
        polygons_fanned: 0,
    }
}

impl Parts {
    /// Writes the folder, with true checksums whatever the parts say.
    pub fn write(&self, folder: &Path) {
        self.write_with(folder, |_| {});
    }

    /// As [`write`](Parts::write), after a last change of the manifest.
    pub fn write_with(&self, folder: &Path, change: impl FnOnce(&mut Manifest)) {
        std::fs::create_dir_all(folder).unwrap();
        let t = self.label.len() as u64;
        let index = if self.wide { "<u8" } else { "<u4" };
        let mut files = Vec::new();
        let mut put = |name: &str, dtype: &str, shape: Vec<u64>, data: Vec<u8>| {
            let mut bytes = npy::header_bytes(dtype, &shape);
            bytes.extend(data);
            std::fs::write(folder.join(name), &bytes).unwrap();
            files.push(FileEntry {
                name: name.into(),
                dtype: dtype.into(),
                shape,
                bytes: bytes.len() as u64,
                blocks: bytes
                    .chunks(BLOCK as usize)
                    .map(|block| format!("{:016x}", xxh3_64(block)))
                    .collect(),
            });
        };
        put(folder::V, index, vec![t, 3], self.ids(&self.v));
        put(folder::O, index, vec![t, 3], self.ids(&self.o));
        if let Some(g) = &self.g {
            let flat = g.iter().flatten();
            let (dtype, data) = if self.wide_g {
                ("<f8", flat.flat_map(|x| x.to_le_bytes()).collect())
            } else {
                let narrow = flat.flat_map(|x| (*x as f32).to_le_bytes());
                ("<f4", narrow.collect())
            };
            put(folder::G, dtype, vec![g.len() as u64, 3], data);
        }
        put(folder::COMPONENT, index, vec![t], self.ids(&self.label));
        let bits = self.flipped.len() as u64;
        put(folder::FLIPPED, "|u1", vec![bits], self.flipped.clone());
        let descr = folder::row_type(self.measured.is_some()).0;
        let n = self.rows.len() as u64;
        put(folder::COMPONENTS, descr, vec![n], self.table());
        let rows = bytemuck::cast_slice(&self.edges).to_vec();
        let n = self.edges.len() as u64;
        put(folder::NONMANIFOLD_EDGES, folder::EDGE_DESCR, vec![n], rows);
        let n = self.corners.len() as u64;
        let corners = self.ids(&self.corners);
        put(folder::NONMANIFOLD_CORNERS, index, vec![n], corners);
        let n = self.degenerate.len() as u64;
        put(
            folder::DEGENERATE,
            index,
            vec![n],
            self.ids(&self.degenerate),
        );
        if let Some(measured) = &self.measured {
            for (name, list) in [
                (folder::NONMANIFOLD_VERTICES, &measured.vertices),
                (folder::DUPLICATE, &measured.duplicate),
            ] {
                put(name, index, vec![list.len() as u64], self.ids(list));
            }
        }
        let mut manifest = Manifest {
            format: folder::FORMAT.into(),
            version: folder::VERSION,
            conventions: Manifest::conventions(),
            index: index[1..].into(),
            coords: self.g.as_ref().map(|_| {
                let name = if self.wide_g { "f8" } else { "f4" };
                name.into()
            }),
            options: Options {
                orient: self.orient,
                weld: false,
            },
            counts: self.counts.clone(),
            measures: self.measured.as_ref().map(|m| m.whole.clone()),
            input: InputEntry {
                format: "raw".into(),
                files: Vec::new(),
            },
            files,
            checksum: String::new(),
        };
        change(&mut manifest);
        std::fs::write(folder.join(folder::MANIFEST), manifest.to_text()).unwrap();
    }

    fn ids(&self, ids: &[u64]) -> Vec<u8> {
        if self.wide {
            return ids.iter().flat_map(|id| id.to_le_bytes()).collect();
        }
        let narrow = ids.iter().map(|&id| id as u32);
        narrow.flat_map(|id| id.to_le_bytes()).collect()
    }
}
