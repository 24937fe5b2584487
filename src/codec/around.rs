//! What is known around a new vertex, and which parallelograms would have it where.
//!
//! ```text
//!       right     left           The gate runs from a to b. Parallelograms lie across the gate
//!      c ─── b ═══ a ─── z       (from apex), across its neighbours (from right, left), and, where
//!       \   / \   / \   /        the fan goes on, across the new edges from b and a to the tip.
//!         \/   tip   \/
//! ```
//!
//! Why the two that agree are looked for: where triangles are regular all of them meet; where
//! a diagonal is turned, or a strip of a machined part ends, some are far off, and no mean of all
//! serves. Two that meet by chance are rare.
//!
//! Memory: none.

use super::vec::{Vec3, add, log_square, sub};

/// Number of features.
pub const FEATURES: usize = 11;
/// Classes of how far the border bends in at an end of the gate.
pub const BENDS: usize = 3;
/// Tips that can be told in the fullest class.
const TIPS: usize = 5;
/// Pairs of tips, in the three classes of three tips and the one of five.
pub const PAIRS: usize = 3 * 3 + 10;
/// Ways in which a sweep goes: back or onward.
pub const WAYS: usize = 2;
/// Sets of weights: by the pair of tips that agree best, by the way, and by how the border bends.
pub const SETS: usize = PAIRS * WAYS * BENDS * BENDS;

/// Which two parallelograms agree best.
#[derive(Clone, Copy, Debug)]
pub struct Agreement {
    /// The number of the pair, of all classes.
    pub pair: usize,
    /// Four times the logarithm of the squared distance of their tips.
    pub apart: i32,
}

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
    /// The vertices behind the triangles of these apexes: at the gate, right, left.
    pub far: [Vec3; 3],
    /// 0 to 3: 2 when the fan goes on to the right, 1 when to the left.
    pub class: usize,
    /// True when a was met after c: see [`onward`].
    pub onward: bool,
    /// How far the border bends in at b, and at a.
    pub bends: [usize; 2],
}

impl Around {
    /// The tips of the parallelograms at the gate, at the edge to its right, and to its left.
    pub fn tips(&self) -> [Vec3; 3] {
        [
            sub(add(self.a, self.b), self.apex),
            sub(add(self.b, self.c), self.right),
            sub(add(self.z, self.a), self.left),
        ]
    }

    /// The tip of the parallelogram at the gate, within what coordinates can be.
    pub fn guess_of_parallelogram(&self) -> [i32; 3] {
        self.tips()[0].map(|x| x.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32)
    }

    /// The tips of the parallelograms that count in this class, and how many there are.
    fn candidates(&self) -> ([Vec3; TIPS], usize) {
        let [tip, right, left] = self.tips();
        let fan_right = sub(add(self.a, self.c), self.b);
        let fan_left = sub(add(self.b, self.z), self.a);
        match self.class {
            0 => ([tip, right, left, tip, tip], 3),
            1 => ([tip, left, fan_left, tip, tip], 3),
            2 => ([tip, right, fan_right, tip, tip], 3),
            _ => ([tip, right, left, fan_right, fan_left], 5),
        }
    }

    /// The first of the pairs of candidates, counted (0, 1), (0, 2), (1, 2), (0, 3) and so on, whose
    /// tips are nearest to each other.
    pub fn agreement(&self) -> Agreement {
        let (tips, count) = self.candidates();
        let mut pair = 3 * self.class;
        let mut best = Agreement {
            pair,
            apart: i32::MAX,
        };
        for j in 1..count {
            for i in 0..j {
                let apart = log_square(sub(tips[i], tips[j]));
                if apart < best.apart {
                    best = Agreement { pair, apart };
                }
                pair += 1;
            }
        }
        best
    }

    /// The number of a pair and the way of the sweep, below [`PAIRS`] × [`WAYS`].
    pub fn way(&self, agreement: Agreement) -> usize {
        agreement.pair * WAYS + usize::from(self.onward)
    }

    /// The number of the set of weights.
    pub fn set(&self, agreement: Agreement) -> usize {
        let way = self.way(agreement);
        (way * BENDS + self.bends[0]) * BENDS + self.bends[1]
    }

    /// Twice the features, from the middle of the gate.
    pub fn features(&self) -> [Vec3; FEATURES] {
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
            add(sub(self.a, self.b), sub(self.a, self.b)),
            from(self.far[0]),
            from(self.far[1]),
            from(self.far[2]),
        ]
    }
}

/// True when a sweep goes onward: the gate a → b rises from older triangles, which lie on along b → c.
///
/// Why it is told apart: rows of triangles grow at a step of the border, and the gate is the riser of the
/// step where they grow to the right, the tread before it where they grow back to the left. What lies
/// around the gate is then another thing, though its neighbours are the same.
#[inline]
pub fn onward(a: u32, c: u32) -> bool {
    a > c
}

/// The weights that a set starts from, in halves: the mean of the pair of parallelograms that
/// agree; where no fan goes on the one at the gate, which is nearest.
pub fn start(set: usize) -> [i64; FEATURES] {
    // Features, and how often each is taken.
    type Tip = &'static [(usize, i64)];
    const TIP: Tip = &[(0, 1)];
    const RIGHT: Tip = &[(1, 1)];
    const LEFT: Tip = &[(2, 1)];
    const FAN_RIGHT: Tip = &[(3, 1), (7, 1)];
    const FAN_LEFT: Tip = &[(4, 1), (7, -1)];
    const PAIR: [[Tip; 2]; PAIRS] = [
        [TIP, TIP],
        [TIP, TIP],
        [TIP, TIP],
        [TIP, LEFT],
        [TIP, FAN_LEFT],
        [LEFT, FAN_LEFT],
        [TIP, RIGHT],
        [TIP, FAN_RIGHT],
        [RIGHT, FAN_RIGHT],
        [TIP, RIGHT],
        [TIP, LEFT],
        [RIGHT, LEFT],
        [TIP, FAN_RIGHT],
        [RIGHT, FAN_RIGHT],
        [LEFT, FAN_RIGHT],
        [TIP, FAN_LEFT],
        [RIGHT, FAN_LEFT],
        [LEFT, FAN_LEFT],
        [FAN_RIGHT, FAN_LEFT],
    ];
    let mut weights = [0; FEATURES];
    for &(feature, times) in PAIR[set / (WAYS * BENDS * BENDS)].into_iter().flatten() {
        weights[feature] += times;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of which no three are in line; no two tips agree.
    fn scattered(class: usize) -> Around {
        Around {
            a: [0, 0, 0],
            b: [100, 7, 3],
            c: [190, -40, 11],
            z: [-95, -61, 2],
            d: [260, -130, 5],
            y: [-180, -155, 9],
            apex: [47, 88, -4],
            right: [140, 71, 8],
            left: [-41, 60, -7],
            far: [[10, 170, 1], [260, 64, 3], [-130, 21, 6]],
            class,
            onward: true,
            bends: [1, 2],
        }
    }

    #[test]
    fn a_set_starts_from_the_mean_of_its_pair() {
        for class in 0..4 {
            let around = scattered(class);
            let (tips, count) = around.candidates();
            let features = around.features();
            let mut pair = 3 * class;
            for j in 1..count {
                for i in 0..j {
                    let set = around.set(Agreement { pair, apart: 0 });
                    let weights = start(set);
                    let two = if class == 0 { [0, 0] } else { [i, j] };
                    for axis in 0..3 {
                        let sum: i64 = (0..FEATURES).map(|f| features[f][axis] * weights[f]).sum();
                        let gate = 2 * (around.a[axis] + around.b[axis]);
                        let tips = 2 * (tips[two[0]][axis] + tips[two[1]][axis]);
                        assert_eq!(sum + gate, tips, "class {class}, tips {i} and {j}");
                    }
                    pair += 1;
                }
            }
            assert_eq!(pair, [3, 6, 9, PAIRS][class]);
        }
    }

    #[test]
    fn the_pair_whose_tips_meet_is_found() {
        // Behind a turned diagonal the parallelogram at the gate is off by an edge, and the two
        // at the right meet.
        let mut around = scattered(2);
        around.right = sub(add(around.b, around.b), around.a);
        let found = around.agreement();
        assert_eq!((found.pair, found.apart), (8, 0));
        around.class = 3;
        assert_eq!(around.agreement().pair, 13);
    }
}
