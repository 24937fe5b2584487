// Small mesh folders written by hand: O by comparing every corner with every other, labels by
// spreading until nothing changes. As naive as can be, so that tests of the readers do not
// lean on the builder. The examples in the documentation use it too, by `include!`, so it
// must not open with an inner attribute or doc comment.

use cornermill::disk::{Budget, Counters, DataFile, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::{
    self, ComponentRow, Counts, FileEntry, InputEntry, Manifest, Options, Orient, npy,
};
use std::path::Path;
use std::sync::Arc;

/// All ones: no opposite, no component.
pub const NONE: u64 = u64::MAX;

/// What a folder shall hold. V is taken as final: nothing is oriented here.
#[derive(Clone, Default)]
pub struct Mesh {
    pub v: Vec<[u64; 3]>,
    pub vertices: u64,
    pub g: Option<Vec<[f64; 3]>>,
    pub flipped: Vec<u64>,
    pub wide: bool,
    pub f8: bool,
}

/// A tetrahedron of side sqrt(2) and one corner at the origin, outward.
pub fn tetrahedron() -> Mesh {
    Mesh {
        v: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        vertices: 4,
        g: Some(vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ]),
        ..Mesh::default()
    }
}

/// A workspace of this many bytes, one thread, and scratch space in this folder.
pub fn workspace(dir: &Path, memory: u64) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io).expect("a scratch space"),
        io,
        workers: Workers::new(1).expect("a thread"),
        progress: Arc::new(NoProgress),
    }
}

impl Mesh {
    /// A mesh of these triangles over the vertices that they name.
    pub fn of(v: &[[u64; 3]]) -> Mesh {
        Mesh {
            v: v.to_vec(),
            vertices: v.iter().flatten().map(|&x| x + 1).max().unwrap_or(0),
            ..Mesh::default()
        }
    }

    /// The same with a coordinate triple for every vertex, all different.
    pub fn placed(mut self) -> Mesh {
        let spot = |i: u64| {
            let x = i as f64;
            [0.1 + x, 0.3 * x - 1.0, (x * 1.7).sin()]
        };
        self.g = Some((0..self.vertices).map(spot).collect());
        self
    }

    /// The edge that corner c faces, smaller vertex first; `None` in a degenerate triangle.
    pub fn edge(&self, c: usize) -> Option<(u64, u64)> {
        let [a, b, d] = self.v[c / 3];
        if a == b || b == d || d == a {
            return None;
        }
        let (x, y) = [(b, d), (d, a), (a, b)][c % 3];
        Some((x.min(y), x.max(y)))
    }

    /// O: the one other corner that faces the same edge, if there is exactly one.
    pub fn opposites(&self) -> Vec<u64> {
        let edges: Vec<_> = (0..3 * self.v.len()).map(|c| self.edge(c)).collect();
        (0..edges.len())
            .map(|c| {
                let same = |&d: &usize| d != c && edges[d].is_some() && edges[d] == edges[c];
                let others: Vec<usize> = (0..edges.len()).filter(same).collect();
                if others.len() == 1 {
                    others[0] as u64
                } else {
                    NONE
                }
            })
            .collect()
    }

    /// Component of each triangle, numbered by first triangle.
    pub fn labels(&self) -> Vec<u64> {
        let o = self.opposites();
        let mut first: Vec<u64> = (0..self.v.len() as u64).collect();
        loop {
            let before = first.clone();
            for (c, &d) in o.iter().enumerate().filter(|&(_, &d)| d != NONE) {
                let (t, u) = (c / 3, d as usize / 3);
                first[t] = first[t].min(first[u]);
            }
            if first == before {
                break;
            }
        }
        let degenerate = |t: usize| self.edge(3 * t).is_none();
        let heads: Vec<u64> = (0..self.v.len())
            .filter(|&t| first[t] == t as u64 && !degenerate(t))
            .map(|t| t as u64)
            .collect();
        let number = |f: u64| heads.iter().position(|&h| h == f).expect("a head") as u64;
        (0..self.v.len())
            .map(|t| {
                if degenerate(t) {
                    NONE
                } else {
                    number(first[t])
                }
            })
            .collect()
    }

    /// Writes the folder, manifest and all.
    pub fn write(&self, folder: &Path) {
        std::fs::create_dir(folder).expect("a new folder");
        let (t, labels) = (self.v.len() as u64, self.labels());
        let components = labels.iter().filter(|&&l| l != NONE).map(|l| l + 1).max();
        let rows: Vec<ComponentRow> = (0..components.unwrap_or(0))
            .map(|c| ComponentRow {
                first_triangle: labels.iter().position(|&l| l == c).expect("one") as u64,
                triangles: labels.iter().filter(|&&l| l == c).count() as u64,
                ..bytemuck::Zeroable::zeroed()
            })
            .collect();
        let mut bits = vec![0u8; self.v.len().div_ceil(8)];
        for &t in &self.flipped {
            bits[t as usize / 8] |= 1 << (t % 8);
        }
        let id = if self.wide { "<u8" } else { "<u4" };
        let mut files = vec![
            array(
                folder,
                folder::V,
                id,
                &[t, 3],
                &self.ids(self.v.as_flattened()),
            ),
            array(folder, folder::O, id, &[t, 3], &self.ids(&self.opposites())),
        ];
        if let Some(g) = &self.g {
            let real = if self.f8 { "<f8" } else { "<f4" };
            let shape = [self.vertices, 3];
            files.push(array(
                folder,
                folder::G,
                real,
                &shape,
                &self.reals(g.as_flattened()),
            ));
        }
        files.extend([
            array(folder, folder::COMPONENT, id, &[t], &self.ids(&labels)),
            array(folder, folder::FLIPPED, "|u1", &[bits.len() as u64], &bits),
            array(
                folder,
                folder::COMPONENTS,
                folder::COMPONENT_DESCR,
                &[rows.len() as u64],
                bytemuck::cast_slice(&rows),
            ),
        ]);
        let text = self.manifest(rows.len() as u64, files).to_text();
        std::fs::write(folder.join(folder::MANIFEST), text).expect("a written manifest");
    }

    fn manifest(&self, components: u64, files: Vec<FileEntry>) -> Manifest {
        let coords = if self.f8 { "f8" } else { "f4" };
        Manifest {
            format: folder::FORMAT.into(),
            version: folder::VERSION,
            conventions: Manifest::conventions(),
            index: if self.wide { "u8" } else { "u4" }.into(),
            coords: self.g.as_ref().map(|_| coords.into()),
            options: Options {
                orient: Orient::Keep,
                weld: false,
            },
            counts: Counts {
                triangles: self.v.len() as u64,
                vertices: self.vertices,
                components,
                ..Counts::default()
            },
            measures: None,
            input: InputEntry {
                format: "raw".into(),
                files: vec![],
            },
            files,
            checksum: String::new(),
        }
    }

    fn ids(&self, ids: &[u64]) -> Vec<u8> {
        if self.wide {
            ids.iter().flat_map(|i| i.to_le_bytes()).collect()
        } else {
            // NONE is all ones at both widths.
            ids.iter().flat_map(|&i| (i as u32).to_le_bytes()).collect()
        }
    }

    fn reals(&self, reals: &[f64]) -> Vec<u8> {
        if self.f8 {
            reals.iter().flat_map(|x| x.to_le_bytes()).collect()
        } else {
            reals
                .iter()
                .flat_map(|&x| (x as f32).to_le_bytes())
                .collect()
        }
    }
}

/// Writes one array and says what the manifest shall say of it (checksums left out).
fn array(folder: &Path, name: &str, descr: &str, shape: &[u64], data: &[u8]) -> FileEntry {
    let io = Arc::new(Counters::default());
    let file = DataFile::create_new(&folder.join(name), &io).expect("a new file");
    let write = |bytes: &[u8], at| file.write_at(bytes, at).expect("a written file");
    write(&npy::header_bytes(descr, shape), 0);
    write(data, npy::DATA_START);
    FileEntry {
        name: name.into(),
        dtype: descr.into(),
        shape: shape.to_vec(),
        bytes: npy::DATA_START + data.len() as u64,
        blocks: vec![],
    }
}
