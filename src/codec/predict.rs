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

/// The weights of one class, and the sums that they come from.
#[derive(Clone, Debug)]
struct Weights {
    start: [i64; FEATURES],
    weight: [i64; FEATURES],
    squares: [[i64; FEATURES]; FEATURES],
    products: [i64; FEATURES],
    count: u32,
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
            squares: [[0; FEATURES]; FEATURES],
            products: [0; FEATURES],
            count: 0,
            wait: 16,
        }
    }

    fn learn(&mut self, features: &[Vec3; FEATURES], target: Vec3) {
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
                self.squares[i][j] += scaled(dot(small[i], small[j]));
            }
            self.products[i] += scaled(dot(small[i], target));
        }
        self.count += 1;
        self.wait -= 1;
        if self.wait == 0 {
            self.solve();
            self.wait = self.count.clamp(16, 256);
        }
        if self.count >= WINDOW {
            self.count /= 2;
            self.squares
                .as_flattened_mut()
                .iter_mut()
                .for_each(|x| *x /= 2);
            self.products.iter_mut().for_each(|x| *x /= 2);
        }
    }

    /// Solves for the weights by elimination, drawn a little towards those of the start.
    fn solve(&mut self) {
        const Q: u32 = 32;
        let mut m = [[0i128; FEATURES + 1]; FEATURES];
        let ridge: i128 = 16 << 12;
        for (i, row) in m.iter_mut().enumerate() {
            for (j, x) in row[..FEATURES].iter_mut().enumerate() {
                *x = i128::from(self.squares[i.max(j)][i.min(j)]) << 16;
            }
            row[i] += ridge << 16;
            row[FEATURES] =
                (i128::from(self.products[i]) << 16) + ridge * i128::from(self.start[i]);
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
}

impl Default for Predictor {
    /// Knows nothing but parallelograms.
    fn default() -> Predictor {
        Predictor {
            classes: (0..CLASSES)
                .map(|c| Weights::new(c / (BENDS * BENDS)))
                .collect(),
        }
    }
}

impl Predictor {
    /// The expected place, in 256ths of a step.
    pub fn guess(&self, around: &Around) -> Vec3 {
        let features = around.features();
        let weights = &self.classes[around.set()].weight;
        let middle = add(around.a, around.b);
        std::array::from_fn(|axis| {
            let sum: i128 = (0..FEATURES)
                .map(|i| i128::from(features[i][axis]) * i128::from(weights[i]))
                .sum();
            let place = (middle[axis] << (FINE - 1)) + (sum >> (WEIGHT + 1 - FINE)) as i64;
            place.clamp(-1 << (33 + FINE), 1 << (33 + FINE))
        })
    }

    /// Learns where the tip came to lie.
    pub fn learn(&mut self, around: &Around, tip: Vec3) {
        let target = sub(add(tip, tip), add(around.a, around.b));
        self.classes[around.set()].learn(&around.features(), target);
    }
}
