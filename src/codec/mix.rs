//! The strong level: several contexts a bit, mixed by weights that learn.
//!
//! Why it works: each context's cell guesses the bit; the guesses are stretched (their logistic
//! inverse), summed with weights, and squashed back. After each bit the weights move along the
//! gradient of its cost, so that the contexts that serve in a kind of decision come to decide
//! it. Two sets of weights, chosen in two ways, are averaged.
//!
//! Memory: 2.6 MiB for cells, 240 KiB for weights. Integers only: stretch and squash are tables
//! made of integers.

use super::model::{Cell, Contexts, FAMILIES, Family, KINS, MORE, Model};
use super::range::Coder;

/// Inputs of the mixer: the contexts, the main one among them, and a constant.
const INPUTS: usize = MORE + 2;
/// Cells of each further context.
const CELLS: usize = 1 << 16;
/// Bits of a fraction of a weight.
const WEIGHT: u32 = 16;
/// Bins of a family that have weights of their own.
const BINS: usize = 160;

/// A set of weights.
#[derive(Clone, Copy, Debug)]
struct Weights {
    weight: [i32; INPUTS],
    seen: u32,
}

/// The mixing level.
pub struct Mixed {
    main: Vec<Cell>,
    kin: Vec<Cell>,
    more: Vec<Cell>,
    weights: Vec<Weights>,
    others: Vec<Weights>,
    stretch: Vec<i16>,
}

/// 4096 / (1 + e^-x) for x = -2047..=2047 in 256ths, between 33 known values.
fn squash(x: i32) -> i32 {
    const KNOWN: [i32; 33] = [
        1, 2, 3, 6, 10, 16, 27, 45, 73, 120, 194, 310, 488, 747, 1101, 1546, 2047, 2549, 2994,
        3348, 3607, 3785, 3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094,
    ];
    let x = x.clamp(-2047, 2047);
    let part = x & 127;
    let at = ((x >> 7) + 16) as usize;
    (KNOWN[at] * (128 - part) + KNOWN[at + 1] * part + 64) >> 7
}

/// The same in 65536ths.
fn squash16(x: i32) -> i32 {
    const KNOWN: [i32; 33] = [
        22, 36, 60, 98, 162, 267, 439, 720, 1179, 1921, 3108, 4971, 7812, 11955, 17625, 24743,
        32768, 40793, 47911, 53581, 57724, 60565, 62428, 63615, 64357, 64816, 65097, 65269, 65374,
        65438, 65476, 65500, 65514,
    ];
    let x = x.clamp(-2047, 2047);
    let part = x & 127;
    let at = ((x >> 7) + 16) as usize;
    (KNOWN[at] * (128 - part) + KNOWN[at + 1] * part + 64) >> 7
}

/// The inverse of [`squash`], by 4096ths.
fn stretches() -> Vec<i16> {
    let mut table = vec![2047; 4096];
    let mut from = 0;
    for x in -2047..=2047 {
        let to = squash(x);
        for slot in table.iter_mut().take(to as usize + 1).skip(from) {
            *slot = x as i16;
        }
        from = from.max(to as usize + 1);
    }
    table
}

impl Model for Mixed {
    const MIXES: bool = true;

    fn new() -> Mixed {
        let start = [(1 << WEIGHT) * 4 / 25; INPUTS];
        Mixed {
            main: vec![Cell::NEW; super::model::FAST_SIZE],
            kin: vec![Cell::NEW; FAMILIES * KINS],
            more: vec![Cell::NEW; MORE * CELLS],
            weights: vec![
                Weights {
                    weight: start,
                    seen: 0
                };
                FAMILIES * BINS
            ],
            others: vec![
                Weights {
                    weight: start,
                    seen: 0
                };
                FAMILIES * BINS
            ],
            stretch: stretches(),
        }
    }

    fn judge(
        &mut self,
        coder: &mut impl Coder,
        family: Family,
        (bin, kin): (u32, u32),
        contexts: &Contexts,
        bit: bool,
    ) -> bool {
        let mut places = [0; MORE + 1];
        places[MORE] = family.place(contexts.main, bin);
        // A sign is judged by how large the number is as well.
        let far = if (72..80).contains(&kin) { kin } else { 0 };
        let key = far << 13 | family.number() << 8 | bin;
        for (i, place) in places[..MORE].iter_mut().enumerate() {
            let mut hash = (u64::from(contexts.more[i]) << 20 | u64::from(key))
                .wrapping_mul(0x9e37_79b9_7f4a_7c15);
            hash ^= hash >> 29;
            *place = i * CELLS + (hash.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 48) as usize;
        }
        let kin = &mut self.kin[family.kin(kin)];
        let main = &mut self.main[places[MORE]];
        if main.seen() == 0 {
            main.inherit(kin);
        }
        let mut inputs = [256; INPUTS];
        for i in 0..=MORE {
            let cell = if i < MORE {
                self.more[places[i]]
            } else {
                self.main[places[i]]
            };
            // A cell that has seen little says little.
            let trust = i32::from(cell.seen().min(12)) + 4;
            let said = i32::from(self.stretch[(cell.one() >> 4) as usize]);
            inputs[i] = said * trust / 16;
        }
        let first = &mut self.weights[family.number() as usize * BINS + bin as usize];
        let rank = contexts.main as usize % BINS;
        let second = &mut self.others[family.number() as usize * BINS + rank];
        let sum = |w: &[i32; INPUTS]| {
            let sum: i64 = (0..INPUTS)
                .map(|i| i64::from(w[i]) * i64::from(inputs[i]))
                .sum();
            (sum >> WEIGHT).clamp(-2047, 2047) as i32
        };
        let (x, y) = (sum(&first.weight), sum(&second.weight));
        let one = squash16((x + y) >> 1).clamp(24, 65_512);
        let bit = coder.code(one as u32, bit);
        let target = if bit { 65_535 } else { 0 };
        for (weights, said) in [(first, x), (second, y)] {
            let error = target - squash16(said);
            let shift =
                13 + u32::from(weights.seen >= 1 << 10) + u32::from(weights.seen >= 1 << 13);
            weights.seen = weights.seen.saturating_add(1);
            for (weight, said) in weights.weight.iter_mut().zip(inputs) {
                *weight += (said * error + (1 << (shift - 1))) >> shift;
            }
        }
        kin.learn(bit, 120);
        for (i, place) in places.iter().enumerate() {
            if i < MORE {
                self.more[*place].learn(bit, 120);
            } else {
                self.main[*place].learn(bit, 120);
            }
        }
        bit
    }
}
