//! A mesh as the tests hold it: triangles, positions, and the ways in which a case is disturbed.

use super::random::Random;

/// Triangles over positions. `name` says in a failure which case it was.
#[derive(Debug, Clone)]
pub struct Mesh {
    pub name: String,
    pub triangles: Vec<[u32; 3]>,
    pub positions: Vec<[f32; 3]>,
}

impl Mesh {
    pub fn new(name: &str, triangles: Vec<[u32; 3]>, positions: Vec<[f32; 3]>) -> Mesh {
        let mesh = Mesh {
            name: name.into(),
            triangles,
            positions,
        };
        let fits = |&v: &u32| (v as usize) < mesh.positions.len();
        assert!(
            mesh.triangles.as_flattened().iter().all(fits),
            "{}: an index beyond",
            mesh.name
        );
        mesh
    }

    pub fn renamed(mut self, name: &str) -> Mesh {
        self.name = name.into();
        self
    }

    /// Both meshes side by side, the ids of `other` after those of `self`.
    pub fn plus(mut self, other: &Mesh) -> Mesh {
        let base = self.positions.len() as u32;
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
        self.positions.extend(&other.positions);
        self.name = format!("{} + {}", self.name, other.name);
        self
    }

    pub fn moved(mut self, by: [f32; 3]) -> Mesh {
        for p in &mut self.positions {
            *p = std::array::from_fn(|i| p[i] + by[i]);
        }
        self
    }

    pub fn scaled(mut self, by: f32) -> Mesh {
        for p in &mut self.positions {
            *p = p.map(|x| x * by);
        }
        self
    }

    /// Every triangle turned over.
    pub fn inverted(mut self) -> Mesh {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// Turns over each triangle with the given chance.
    pub fn flip_some(&mut self, random: &mut Random, percent: usize) {
        for t in &mut self.triangles {
            if random.chance(percent) {
                t.swap(1, 2);
            }
        }
    }

    /// Starts each triangle at a random corner: the same surface by other corner ids.
    pub fn rotate_corners(&mut self, random: &mut Random) {
        for t in &mut self.triangles {
            t.rotate_left(random.below(3));
        }
    }

    /// Puts triangles and vertices in random order.
    pub fn shuffle(&mut self, random: &mut Random) {
        random.shuffle(&mut self.triangles);
        let mut new_ids: Vec<u32> = (0..self.positions.len() as u32).collect();
        random.shuffle(&mut new_ids);
        let old = self.positions.clone();
        for (p, &id) in old.iter().zip(&new_ids) {
            self.positions[id as usize] = *p;
        }
        for v in self.triangles.as_flattened_mut() {
            *v = new_ids[*v as usize];
        }
    }

    /// Sends every use of some vertices to others: pinches, cuts and degenerate triangles at once.
    pub fn merge_vertices(&mut self, random: &mut Random, times: usize) {
        for _ in 0..times {
            let n = self.positions.len();
            let (from, to) = (random.below(n) as u32, random.below(n) as u32);
            for v in self.triangles.as_flattened_mut() {
                if *v == from {
                    *v = to;
                }
            }
        }
    }

    /// Removes each triangle with the given chance: holes and borders.
    pub fn drop_some(&mut self, random: &mut Random, percent: usize) {
        self.triangles.retain(|_| !random.chance(percent));
    }

    /// Repeats some triangles somewhere in the list, sometimes turned over.
    pub fn duplicate_some(&mut self, random: &mut Random, times: usize) {
        for _ in 0..times.min(self.triangles.len()) {
            let mut t = *random.pick(&self.triangles);
            if random.chance(50) {
                t.swap(0, 2);
            }
            self.triangles
                .insert(random.below(self.triangles.len() + 1), t);
        }
    }
}
