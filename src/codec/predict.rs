//! Where the tip of a new triangle is expected: a mean of parallelograms and neighbours whose
//! weights are learned, by least squares for each class of neighbourhoods.
//!
//! Why it works: sums of products of what was known (features) and of what came (target) are
//! kept, each vertex weighed by the size of its triangle; the weights that would have served
//! best so far solve a linear system of seven unknowns. It is solved anew every few vertices, in
//! integers, so that both sides hold the same weights.
//!
//! Memory: some hundred bytes a class.

use super::vec::{Vec3, add, dot, excess, reach, shift, sub};

/// Number of features.
pub const FEATURES: usize = 7;
/// Bits of a fraction of a weight.
const WEIGHT: u32 = 16;
/// Bits of a fraction of a predicted coordinate.
pub const FINE: u32 = 8;
/// Classes: does the fan go on to the right, to the left.
pub const CLASSES: usize = 4 * BENDS * BENDS;
/// Classes of how far the border bends in at an end of the gate.
pub const BENDS: usize = 3;
/// When so many vertices were summed, the sums are halved.
const WINDOW: u32 = 1 << 13;

/// What is known around a new tip: the gate runs from a to b; c follows b on the border, z
/// comes before a; the apexes are those of the coded triangles at the three edges.
#[derive(Clone, Copy, Debug)]
pub struct Around {
    /// Ends of the gate.
    pub a: Vec3,
    /// See above.
    pub b: Vec3,
    /// The next vertex of the border.
    pub c: Vec3,
    /// The vertex of the border before.
    pub z: Vec3,
    /// The vertex of the border after c.
    pub d: Vec3,
    /// The vertex of the border before z.
    pub y: Vec3,
    /// Apex behind the gate.
    pub apex: Vec3,
    /// Apex behind the edge from b to c.
    pub right: Vec3,
    /// Apex behind the edge from z to a.
    pub left: Vec3,
    /// 0 to 3: 2 when the fan goes on to the right, 1 when to the left.
    pub class: usize,
    /// How far the border bends in at b, and at a.
    pub bends: [usize; 2],
}

impl Around {
    fn set(&self) -> usize {
        (self.class * BENDS + self.bends[0]) * BENDS + self.bends[1]
    }

    /// The tips of the parallelograms at the gate, at the edge to its right, and to its left.
    pub fn tips(&self) -> [Vec3; 3] {
        [
            sub(add(self.a, self.b), self.apex),
            sub(add(self.b, self.c), self.right),
            sub(add(self.z, self.a), self.left),
        ]
    }

    /// Twice the features, from the middle of the gate.
    fn features(&self) -> [Vec3; FEATURES] {
        let sum = add(self.a, self.b);
        let from = |p: Vec3| sub(add(p, p), sum);
        [
            sub(sum, add(self.apex, self.apex)),
            from(sub(add(self.b, self.c), self.right)),
            from(sub(add(self.z, self.a), self.left)),
            from(self.c),
            from(self.z),
            from(self.d),
            from(self.y),
        ]
    }
}

/// Sums of products of features, and of features and targets.
#[derive(Clone, Debug, Default)]
struct Sums {
    squares: [[i64; FEATURES]; FEATURES],
    products: [i64; FEATURES],
    count: u32,
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        for i in 0..FEATURES {
            for j in 0..=i {
                self.squares[i][j] = self.squares[i][j].saturating_add(other.squares[i][j]);
            }
            self.products[i] = self.products[i].saturating_add(other.products[i]);
        }
        self.count += other.count;
    }
}

/// The weights of one class, and the sums that they come from.
#[derive(Clone, Debug)]
struct Weights {
    start: [i64; FEATURES],
    weight: [i64; FEATURES],
    sums: Sums,
    wait: u32,
}

impl Weights {
    fn new(class: usize) -> Weights {
        let one = 1 << WEIGHT;
        let start = match class {
            0 => [one, 0, 0, 0, 0, 0, 0],
            1 => [one / 2, 0, one / 2, 0, 0, 0, 0],
            2 => [one / 2, one / 2, 0, 0, 0, 0, 0],
            _ => [one / 2, one / 4, one / 4, 0, 0, 0, 0],
        };
        Weights {
            start,
            weight: start,
            sums: Sums::default(),
            wait: 16,
        }
    }

    /// Learns a vertex; true when it is time to solve anew.
    fn learn(&mut self, features: &[Vec3; FEATURES], target: Vec3) -> bool {
        // Coordinates of at most 20 bits, so that sums of 2^13 products stay far below 2^63;
        // weighed so that large and small triangles count alike.
        let all = features.iter().fold(reach(target), |r, &f| r | reach(f));
        let down = excess(all, 20);
        let size = dot(shift(features[0], down), shift(features[0], down)) as u64;
        let target = shift(target, down);
        let mut small = [[0; 3]; FEATURES];
        for (s, &f) in small.iter_mut().zip(features) {
            *s = shift(f, down);
        }
        let off: Vec3 = std::array::from_fn(|axis| {
            let sum: i64 = (0..FEATURES).map(|i| small[i][axis] * self.weight[i]).sum();
            target[axis] - (sum >> WEIGHT)
        });
        let off = dot(off, off) as u64 | size >> 16 | 4;
        let weigh = (128 - size.leading_zeros() - off.leading_zeros()) / 2;
        let scaled = |x: i64| (x << 12) >> weigh;
        for i in 0..FEATURES {
            for j in 0..=i {
                self.sums.squares[i][j] += scaled(dot(small[i], small[j]));
            }
            self.sums.products[i] += scaled(dot(small[i], target));
        }
        self.sums.count += 1;
        self.wait -= 1;
        if self.sums.count >= WINDOW {
            self.sums.count /= 2;
            self.sums
                .squares
                .as_flattened_mut()
                .iter_mut()
                .for_each(|x| *x /= 2);
            self.sums.products.iter_mut().for_each(|x| *x /= 2);
        }
        let due = self.wait == 0;
        if due {
            self.wait = self.sums.count.clamp(16, 256);
        }
        due
    }

    /// Solves for the weights by elimination, drawn a little towards those of the start, and
    /// towards what vertices of other sets would have: a `kin` counts as so many vertices.
    fn solve(&mut self, kin: &[(Sums, i64); 2]) {
        const Q: u32 = 32;
        let shares = kin.each_ref().map(|(sums, vertices)| {
            let share = (vertices << 16) / i64::from(sums.count.max(1));
            (sums, i128::from(share))
        });
        let whole = |of: &dyn Fn(&Sums) -> i64| {
            let own = i128::from(of(&self.sums)) << 16;
            shares
                .iter()
                .fold(own, |sum, (sums, share)| sum + i128::from(of(sums)) * share)
        };
        let mut m = [[0i128; FEATURES + 1]; FEATURES];
        let ridge: i128 = 16 << 12;
        for (i, row) in m.iter_mut().enumerate() {
            for (j, x) in row[..FEATURES].iter_mut().enumerate() {
                *x = whole(&|s| s.squares[i.max(j)][i.min(j)]);
            }
            row[i] += ridge << 16;
            row[FEATURES] = whole(&|s| s.products[i]) + ridge * i128::from(self.start[i]);
        }
        for k in 0..FEATURES {
            let (above, below) = m.split_at_mut(k + 1);
            let pivot = &above[k];
            if pivot[k] <= 0 {
                return;
            }
            for row in below {
                let factor = (row[k] << Q) / pivot[k];
                for (x, p) in row.iter_mut().zip(pivot).skip(k) {
                    *x -= (factor * p) >> Q;
                }
            }
        }
        let mut weight = [0; FEATURES];
        for k in (0..FEATURES).rev() {
            let known: i128 = (k + 1..FEATURES)
                .map(|j| m[k][j] * i128::from(weight[j]))
                .sum();
            let value = ((m[k][FEATURES] << WEIGHT) - known) / m[k][k];
            weight[k] = value.clamp(-8 << WEIGHT, 8 << WEIGHT) as i64;
        }
        self.weight = weight;
    }
}

/// The predictor.
#[derive(Clone, Debug)]
pub struct Predictor {
    classes: Vec<Weights>,
    /// Which sets of weights there are.
    pub sets: Sets,
}

/// Which sets of weights there are: the encoder's choice, by trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sets {
    /// One for each class; those of few vertices lean on the others.
    #[default]
    Many,
    /// One for each class, on its own.
    Apart,
    /// One for all, which learns from fewer vertices.
    One,
    /// Those of the start, which never learn: for surfaces where parallelograms are exact.
    Fixed,
}

impl Sets {
    /// All of them, by number.
    pub const ALL: [Sets; 4] = [Sets::Many, Sets::Apart, Sets::One, Sets::Fixed];
}

impl Default for Predictor {
    /// Knows nothing but parallelograms.
    fn default() -> Predictor {
        Predictor {
            classes: (0..CLASSES)
                .map(|c| Weights::new(c / (BENDS * BENDS)))
                .collect(),
            sets: Sets::Many,
        }
    }
}

impl Predictor {
    /// The expected place, in 256ths of a step.
    pub fn guess(&self, around: &Around) -> Vec3 {
        let features = around.features();
        let weights = &self.classes[self.set(around)].weight;
        let middle = add(around.a, around.b);
        std::array::from_fn(|axis| {
            // Features have at most 35 bits and weights 20, so that seven products fit.
            let sum: i64 = (0..FEATURES).map(|i| features[i][axis] * weights[i]).sum();
            let place = (middle[axis] << (FINE - 1)) + (sum >> (WEIGHT + 1 - FINE));
            place.clamp(-1 << (33 + FINE), 1 << (33 + FINE))
        })
    }

    /// Learns where the tip came to lie.
    pub fn learn(&mut self, around: &Around, tip: Vec3) {
        let target = sub(add(tip, tip), add(around.a, around.b));
        let set = self.set(around);
        let due = self.classes[set].learn(&around.features(), target);
        if due && self.sets != Sets::Fixed {
            self.solve(set);
        }
    }

    /// Solves for the weights of a set. Those of few vertices lean on what all others have seen.
    fn solve(&mut self, set: usize) {
        let mut kin = [(Sums::default(), 8), (Sums::default(), 16)];
        if self.sets == Sets::Apart {
            return self.classes[set].solve(&kin);
        }
        let near = set / (BENDS * BENDS);
        for (other, weights) in self.classes.iter().enumerate() {
            let same = other / (BENDS * BENDS) == near;
            kin[usize::from(same)].0.add(&weights.sums);
        }
        self.classes[set].solve(&kin);
    }

    fn set(&self, around: &Around) -> usize {
        match self.sets {
            Sets::One => 0,
            _ => around.set(),
        }
    }
}
