//! Where the tip of a new triangle is expected: a mean of parallelograms and neighbours whose
//! weights are learned, by least squares for each set of neighbourhoods.
//!
//! Why it works: sums of products of what was known (features) and of what came (target) are
//! kept, each vertex weighed by the size of its triangle; the weights that would have served
//! best so far solve a linear system of eleven unknowns. It is solved anew every few vertices, in
//! integers, so that both sides hold the same weights. On flat or ruled faces the parallelograms of
//! the start are exact, and what is learned only blurs them: so a set uses whichever has missed
//! less of late.
//!
//! Memory: 1.3 KB a set, 440 KB in all.

use super::around::{Agreement, Around, FEATURES, SETS, start};
use super::vec::{Vec3, add, dot, excess, log4, reach, shift, sub};

/// Bits of a fraction of a weight.
const WEIGHT: u32 = 16;
/// Bits of a fraction of a predicted coordinate.
pub const FINE: u32 = 8;
/// When so many vertices were summed, the sums are halved.
const WINDOW: u32 = 1 << 13;
/// The last misses count 2^-4 each, in logarithms of 16 bits of fraction.
const LATELY: u32 = 4;
/// The start is used when it has missed less by more than a quarter of an octave of the square.
const CLEARLY: i64 = 1 << 16;
/// How much the start counts beside what was learned: a square of this, a vertex having 2^12 or so.
const RIDGE: i128 = 1 << 12;

/// Sums of products of features, and of features and targets.
#[derive(Clone, Debug, Default)]
struct Sums {
    squares: [[i64; FEATURES]; FEATURES],
    products: [i64; FEATURES],
    count: u32,
}

/// The weights of one set, and the sums that they come from.
#[derive(Clone, Debug)]
struct Weights {
    /// Those of the start, and those that were learned.
    ways: [[i64; FEATURES]; 2],
    /// How far either missed of late: four times the logarithm of the square.
    missed: [i64; 2],
    sums: Sums,
    wait: u32,
}

impl Weights {
    fn new(set: usize) -> Weights {
        let start = start(set).map(|half| half << (WEIGHT - 1));
        Weights {
            ways: [start; 2],
            missed: [0; 2],
            sums: Sums::default(),
            wait: 16,
        }
    }

    /// Which weights are in use.
    fn way(&self) -> usize {
        usize::from(self.missed[1] < self.missed[0] + CLEARLY)
    }

    /// Learns a vertex.
    fn learn(&mut self, features: &[Vec3; FEATURES], target: Vec3) {
        // Coordinates of at most 18 bits, so that sums of 2^13 products stay below 2^62;
        // weighed so that large and small triangles count alike.
        let all = features.iter().fold(reach(target), |r, &f| r | reach(f));
        let down = excess(all, 18);
        let small = features.map(|f| shift(f, down));
        let target = shift(target, down);
        let size = dot(small[0], small[0]) as u64;
        let off = self.ways.map(|weights| {
            let off = std::array::from_fn(|axis| {
                let sum: i64 = (0..FEATURES).map(|i| small[i][axis] * weights[i]).sum();
                target[axis] - (sum >> WEIGHT)
            });
            dot(off, off) as u64
        });
        let used = off[self.way()] | size >> 16 | 4;
        for (missed, off) in self.missed.iter_mut().zip(off) {
            *missed += ((i64::from(log4(off | 1)) << 16) - *missed) >> LATELY;
        }
        let weigh = (128 - size.leading_zeros() - used.leading_zeros()) / 2;
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
            let squares = self.sums.squares.as_flattened_mut().iter_mut();
            squares.chain(&mut self.sums.products).for_each(|x| *x /= 2);
        }
        if self.wait == 0 {
            self.wait = self.sums.count.clamp(16, 256);
            self.solve();
        }
    }

    /// Solves for the weights by elimination, drawn a little towards those of the start.
    fn solve(&mut self) {
        const Q: u32 = 32;
        let start = &self.ways[0];
        let mut m = [[0i128; FEATURES + 1]; FEATURES];
        for (i, row) in m.iter_mut().enumerate() {
            for (j, x) in row[..FEATURES].iter_mut().enumerate() {
                *x = i128::from(self.sums.squares[i.max(j)][i.min(j)]) << WEIGHT;
            }
            row[i] += RIDGE << WEIGHT;
            let product = i128::from(self.sums.products[i]) << WEIGHT;
            row[FEATURES] = product + RIDGE * i128::from(start[i]);
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
        self.ways[1] = weight;
    }
}

/// The predictor.
#[derive(Clone, Debug)]
pub struct Predictor {
    sets: Vec<Weights>,
}

/// What is expected of a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Guess {
    /// The expected place, in 256ths of a step.
    pub place: Vec3,
    /// Which parallelograms agree.
    pub agreement: Agreement,
    /// Twice the middle of the gate.
    middle: Vec3,
    features: [Vec3; FEATURES],
    set: usize,
}

impl Default for Predictor {
    /// Knows nothing but parallelograms.
    fn default() -> Predictor {
        Predictor {
            sets: (0..SETS).map(Weights::new).collect(),
        }
    }
}

impl Predictor {
    /// Where the tip is expected.
    pub fn guess(&self, around: &Around) -> Guess {
        let agreement = around.agreement();
        let (set, features) = (around.set(agreement), around.features());
        let of = &self.sets[set];
        let weights = &of.ways[of.way()];
        let middle = add(around.a, around.b);
        let place = std::array::from_fn(|axis| {
            // Features have at most 35 bits and weights 20, so that eleven products fit.
            let sum: i64 = (0..FEATURES).map(|i| features[i][axis] * weights[i]).sum();
            let place = (middle[axis] << (FINE - 1)) + (sum >> (WEIGHT + 1 - FINE));
            place.clamp(-1 << (33 + FINE), 1 << (33 + FINE))
        });
        Guess {
            place,
            agreement,
            middle,
            features,
            set,
        }
    }

    /// Learns where the tip came to lie.
    pub fn learn(&mut self, guess: &Guess, tip: Vec3) {
        let target = sub(add(tip, tip), guess.middle);
        self.sets[guess.set].learn(&guess.features, target);
    }
}
