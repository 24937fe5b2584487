//! Walks as naive as can be: recursion, whole arrays, sequences compared as sequences.

use std::collections::{BTreeSet, VecDeque};

pub const NONE: u64 = u64::MAX;

/// V and O, a value a corner.
pub struct Surface {
    pub v: Vec<u64>,
    pub o: Vec<u64>,
}

/// The corners `c.n` and `c.p`.
pub fn beside(c: u64) -> (u64, u64) {
    let first = c / 3 * 3;
    (first + (c + 1) % 3, first + (c + 2) % 3)
}

impl Surface {
    pub fn triangles(&self) -> u64 {
        self.v.len() as u64 / 3
    }

    /// Steps from triangle t to every other; NONE for those that cannot be reached.
    pub fn distances(&self, t: u64) -> Vec<u64> {
        let mut far = vec![NONE; self.triangles() as usize];
        far[t as usize] = 0;
        let mut queue = VecDeque::from([t]);
        while let Some(t) = queue.pop_front() {
            for c in 3 * t..3 * t + 3 {
                let o = self.o[c as usize];
                if o != NONE && far[o as usize / 3] == NONE {
                    far[o as usize / 3] = far[t as usize] + 1;
                    queue.push_back(o / 3);
                }
            }
        }
        far
    }

    /// The first of all sequences of `steps` edges from triangle t that end in the triangle of
    /// `to`, tried in the order of their corners.
    pub fn first_path(&self, t: u64, to: u64, steps: u64) -> Option<Vec<u64>> {
        if steps == 0 {
            return (t == to / 3).then(|| vec![to]);
        }
        (3 * t..3 * t + 3).find_map(|c| {
            let o = self.o[c as usize];
            let rest = (o != NONE).then(|| self.first_path(o / 3, to, steps - 1))??;
            Some([vec![c], rest].concat())
        })
    }

    /// The smallest path to the corner `to` from each triangle that reaches it, as whole sequences:
    /// distance by distance, the smallest of those that go through a neighbour.
    pub fn smallest_paths(&self, to: u64) -> Vec<Option<Vec<u64>>> {
        let far = self.distances(to / 3);
        let mut best: Vec<Option<Vec<u64>>> = vec![None; far.len()];
        best[to as usize / 3] = Some(vec![to]);
        let most = far.iter().filter(|&&d| d != NONE).max().copied();
        for distance in 1..=most.unwrap_or(0) {
            for t in (0..far.len()).filter(|&t| far[t] == distance) {
                let through = |c: u64| {
                    let o = self.o[c as usize];
                    let near = o != NONE && far[o as usize / 3] == distance - 1;
                    near.then(|| [vec![c], best[o as usize / 3].clone().expect("nearer")].concat())
                };
                let first = 3 * t as u64;
                best[t] = (first..first + 3).filter_map(through).min();
            }
        }
        best
    }

    /// For each corner, whether the corners around its vertex that edges join to it meet an edge
    /// without opposite.
    pub fn open_fans(&self) -> Vec<bool> {
        let corners = self.v.len();
        let mut fan: Vec<usize> = (0..corners).collect();
        // Two corners of one vertex whose triangles share an edge there are in one fan.
        loop {
            let before = fan.clone();
            for c in 0..corners as u64 {
                let (n, p) = beside(c);
                for side in [n, p] {
                    let o = self.o[side as usize];
                    if o == NONE {
                        continue;
                    }
                    let (on, op) = beside(o);
                    for d in [on, op] {
                        if self.v[d as usize] == self.v[c as usize] {
                            let low = fan[c as usize].min(fan[d as usize]);
                            (fan[c as usize], fan[d as usize]) = (low, low);
                        }
                    }
                }
            }
            if fan == before {
                break;
            }
        }
        let mut open = vec![false; corners];
        for c in 0..corners {
            let (n, p) = beside(c as u64);
            if self.o[n as usize] == NONE || self.o[p as usize] == NONE {
                open[fan[c]] = true;
            }
        }
        (0..corners).map(|c| open[fan[c]]).collect()
    }

    /// The letters from corner c by recursion, as `(letter, corner)`, and `('j', corner)` for a
    /// fork whose left was visited when the walk came back.
    pub fn clers(&self, c: u64, open_fans: &[bool]) -> Vec<(char, u64)> {
        let (n, p) = beside(c);
        let mut walk = Naive {
            surface: self,
            open_fans,
            triangles: BTreeSet::new(),
            vertices: BTreeSet::from([self.v[n as usize], self.v[p as usize]]),
            out: Vec::new(),
        };
        walk.swirl(c);
        let across = self.o[c as usize];
        if across != NONE && !walk.triangles.contains(&(across / 3)) {
            walk.swirl(across);
        }
        walk.out
    }
}

struct Naive<'a> {
    surface: &'a Surface,
    open_fans: &'a [bool],
    triangles: BTreeSet<u64>,
    vertices: BTreeSet<u64>,
    out: Vec<(char, u64)>,
}

impl Naive<'_> {
    fn swirl(&mut self, c: u64) {
        self.triangles.insert(c / 3);
        let (n, p) = beside(c);
        let [right, left] = [n, p].map(|side| self.surface.o[side as usize]);
        let open = |o: u64, seen: &BTreeSet<u64>| o != NONE && !seen.contains(&(o / 3));
        let new = self.vertices.insert(self.surface.v[c as usize]) && !self.open_fans[c as usize];
        let sides = (open(right, &self.triangles), open(left, &self.triangles));
        let letter = match sides {
            (true, true) if new => 'C',
            (true, true) => 'S',
            (true, false) => 'L',
            (false, true) => 'R',
            (false, false) => 'E',
        };
        self.out.push((letter, c));
        if sides.0 {
            self.swirl(right);
        }
        if open(left, &self.triangles) {
            // Around a new tip of a whole fan, the left was met by way of the right.
            assert_ne!(letter, 'C', "the left of a C is left over");
            self.swirl(left);
        } else if letter == 'S' {
            self.out.push(('j', c));
        }
    }
}
