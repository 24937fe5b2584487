//! The positions of vertices, coded by what is expected of them.
//!
//! Memory: 16 bytes a vertex.

use super::Damaged;
use super::around::{Around, onward};
use super::lattice::Lattice;
use super::model::{self, Contexts, Model};
use super::predict::{FINE, Predictor};
use super::range::Coder;
use super::spread::{ROUGH, Shape, Spreads};
use super::vec::{Vec3, dot, excess, log4, reach, shift, sub};

/// A vertex that is coded: where it lies, and how far it missed its prediction.
#[derive(Clone, Copy, Debug)]
struct Place {
    at: [i32; 3],
    rough: u8,
    /// Axes on which its coordinate is a listed one.
    listed: u8,
}

/// All vertices coded so far.
#[derive(Debug, Default)]
pub struct Places {
    places: Vec<Place>,
    predictor: Predictor,
    spreads: Spreads,
    /// Coordinates that repeat.
    pub lattice: Lattice,
    /// What positions cost, in 65536ths of a bit: the encoder's.
    pub spent: u64,
}

/// The middle level of roughness, for vertices that nothing predicted.
const UNKNOWN: u8 = ROUGH as u8 / 2;

impl Places {
    /// Makes room for so many vertices.
    pub fn make_room(&mut self, vertices: usize) {
        self.places.reserve_exact(vertices);
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// True when there is none.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Where a vertex lies.
    #[inline]
    pub fn at(&self, v: u32) -> Vec3 {
        self.places[v as usize].at.map(i64::from)
    }

    /// Where a vertex lies.
    #[inline]
    pub fn position(&self, v: usize) -> [i32; 3] {
        self.places[v].at
    }

    /// The neighbourhood of a new vertex: the border about the gate, the apexes at the gate, right,
    /// left, and the vertices behind those triangles.
    pub fn around(
        &self,
        [a, b, c, z, d, y]: [u32; 6],
        [apex, right, left]: [u32; 3],
        far: [u32; 3],
    ) -> Surround {
        let listed = [apex, a, b]
            .into_iter()
            .fold(0, |m, v| m << 3 | u32::from(self.places[v as usize].listed));
        let rough = |v: u32| usize::from(self.places[v as usize].rough);
        Surround {
            around: Around {
                a: self.at(a),
                b: self.at(b),
                c: self.at(c),
                z: self.at(z),
                d: self.at(d),
                y: self.at(y),
                apex: self.at(apex),
                right: self.at(right),
                left: self.at(left),
                far: far.map(|v| self.at(v)),
                class: 0,
                onward: onward(a, c),
                bends: [0; 2],
            },
            rough: (2 * (rough(a) + rough(b)) + rough(apex) + rough(c) + 3) / 6,
            listed,
        }
    }

    /// A vertex nobody knows the position of yet but that it is about here.
    pub fn reserve(&mut self, about: [i32; 3]) {
        self.places.push(Place {
            at: about,
            rough: UNKNOWN,
            listed: 0,
        });
    }

    /// Codes a vertex that nothing predicts but the vertex before.
    ///
    /// # Errors
    /// [`Damaged`] when it lies beyond all coordinates.
    pub fn lone<M: Model>(
        &mut self,
        model: &mut M,
        coder: &mut impl Coder,
        follows: bool,
        truth: [i32; 3],
    ) -> Result<(), Damaged> {
        let before = coder.spent();
        let last = self.places.last().map_or([0; 3], |p| p.at.map(i64::from));
        let mut at = [0; 3];
        for axis in 0..3 {
            let contexts = Contexts::of(axis as u32 + 3 * u32::from(follows));
            let off = i64::from(truth[axis]) - last[axis];
            let off = model.number(coder, model::LONE, &contexts, (8, 0), off);
            at[axis] = coordinate(last[axis] + off)?;
        }
        self.reserve(at);
        self.spent += coder.spent() - before;
        Ok(())
    }

    /// Codes the position of the last vertex, which was reserved.
    ///
    /// # Errors
    /// [`Damaged`] when it lies beyond all coordinates.
    pub fn fresh<M: Model>(
        &mut self,
        model: &mut M,
        coder: &mut impl Coder,
        surround: &Surround,
        truth: [i32; 3],
    ) -> Result<(), Damaged> {
        let before = coder.spent();
        let around = &surround.around;
        let expected = self.predictor.guess(around);
        let guess = expected.place;
        let tips = around.tips().map(|tip| sub(tip.map(|x| x << FINE), guess));
        let shape = self
            .spreads
            .shape(around, expected.agreement, surround.rough);
        let mut innovation = [0; 3];
        let mut at = [0; 3];
        let mut missed = [0; 3];
        let mut past = 0;
        let mut listed = 0;
        for k in 0..3 {
            let axis = shape.axes[k];
            // What no coordinate can be helps nobody, and is more than a number holds.
            let mean = guess[axis] + shape.expected(k, &innovation);
            let mean = mean.clamp(-FAR << FINE, FAR << FINE);
            let near = (mean + (1 << (FINE - 1))) >> FINE;
            let part = mean - (near << FINE) + (1 << (FINE - 1));
            let log = shape.logs[k];
            let hint = if log > WIDE {
                let other = match around.class {
                    1 => tips[2][axis],
                    2 => tips[1][axis],
                    _ => tips[0][axis],
                };
                signed(other, log, (16, 8, 3))
            } else {
                (part >> (FINE - 3)).clamp(0, 7) as u32
            };
            let views = if M::MIXES {
                views(around.class, tips.map(|tip| tip[axis]), log)
            } else {
                [0; 2]
            };
            let contexts = contexts::<M>(k, log, surround, past, hint, axis, views);
            let on = if self.lattice.values[axis].is_empty() {
                None
            } else {
                let spot = Spot { k, axis, mean, log };
                self.listed(model, coder, &spot, &mut listed, truth[axis], surround)?
            };
            at[axis] = match on {
                Some(value) => value,
                None => {
                    let start = ((log - 60) / 8).clamp(0, 30) as u32;
                    let value = i64::from(truth[axis]) - near;
                    let sign = (start, hint);
                    coordinate(near + model.number(coder, model::RESIDUAL, &contexts, sign, value))?
                }
            };
            innovation[k] = (i64::from(at[axis]) << FINE) - mean;
            missed[axis] = (i64::from(at[axis]) << FINE) - guess[axis];
            let off = log4(innovation[k].unsigned_abs()) * 2 - log;
            past = past << 3 | ((off + 16) / 6).clamp(0, 7) as u32;
        }
        self.predictor.learn(&expected, at.map(i64::from));
        self.spreads.learn(&shape, missed);
        if let Some(last) = self.places.last_mut() {
            *last = Place {
                at,
                rough: roughness(&shape, missed),
                listed,
            };
        }
        self.spent += coder.spent() - before;
        Ok(())
    }
}

/// No coordinate is expected farther out: the miss of one then has at most 35 bits.
const FAR: i64 = (1 << 35) - (1 << 31) - 1;

/// Where more is missed than two steps or so, where in a step the expected place lies says
/// nothing of the sign, but another guess does.
const WIDE: i32 = 72;

/// How far off another guess is: its sign, and its size by what is expected to be missed, in
/// `levels` steps of `width` from `-least` on.
fn signed(off: i64, log: i32, (least, width, levels): (i32, i32, i32)) -> u32 {
    let level = (2 * log4(off.unsigned_abs()) - log + least) / width;
    (level.clamp(0, levels) as u32) << 1 | u32::from(off < 0)
}

/// How far off the parallelograms at the gate and beside it are.
fn views(class: usize, [tip, right, left]: [i64; 3], log: i32) -> [u32; 2] {
    let level = |off| signed(off, log, (20, 4, 11));
    let beside = match class {
        0 => level((right + left) >> 1),
        1 => level(left),
        2 => level(right),
        _ => level(right) | level(left) << 6,
    };
    [level(tip), beside]
}

/// A coordinate that is to be coded.
struct Spot {
    k: usize,
    axis: usize,
    mean: i64,
    log: i32,
}

impl Places {
    /// Codes whether a coordinate is a listed one, and which.
    fn listed<M: Model>(
        &self,
        model: &mut M,
        coder: &mut impl Coder,
        spot: &Spot,
        listed: &mut u8,
        truth: i32,
        surround: &Surround,
    ) -> Result<Option<i32>, Damaged> {
        let list = &self.lattice.values[spot.axis];
        let (near, width) = self.lattice.nearest(spot.axis, spot.mean >> FINE);
        let off = spot.mean - (i64::from(list[near]) << FINE);
        let far = (2 * log4(off.unsigned_abs()) - spot.log + 12).clamp(0, 27) as u32 / 4;
        let found = list.binary_search(&truth);
        let offs = spot.k as u32 - listed.count_ones();
        let around = surround.listed;
        // Which of the vertices around have a listed coordinate on this axis.
        let own = around >> spot.axis;
        let same = own & 1 | (own >> 2) & 2 | (own >> 4) & 4;
        let mask = u32::from(*listed) << 4 | spot.axis as u32;
        let spread = (spot.log - 2 * log4(width as u64) + 64).clamp(0, 127) as u32;
        let contexts = Contexts {
            main: ((spot.k as u32 * 3 + offs) * 8 + same) * 8 + far,
            kin: same << 3 | far,
            more: [
                mask << 16 | around,
                mask << 8 | far,
                mask << 16 | (around & 63) << 8 | far,
                mask << 8 | (spread / 2),
                around << 2 | spot.k as u32,
                mask,
                mask | 1 << 20,
                mask | 2 << 20,
            ],
        };
        if !model.bit(coder, model::LISTED, &contexts, found.is_ok()) {
            return Ok(None);
        }
        *listed |= 1 << spot.axis;
        let fine = off * 4 / (width << FINE);
        let hint = (fine + 4).clamp(0, 7) as u32;
        let contexts = Contexts {
            main: spot.k as u32 * 64 + (spread / 4).min(7) * 8 + hint,
            kin: 0,
            more: [
                mask << 16 | around,
                mask << 12 | spread << 4 | hint,
                mask << 16 | (around & 63) << 8 | hint,
                spread << 2 | spot.k as u32,
                (near as u32) << 2 | spot.axis as u32,
                mask << 4 | hint,
                mask | 1 << 20,
                mask | 2 << 20,
            ],
        };
        let truth = found.map_or(0, |i| i as i64 - near as i64);
        let step = model.number(coder, model::STEP, &contexts, (0, hint), truth);
        let value = usize::try_from(near as i64 + step)
            .ok()
            .and_then(|i| list.get(i));
        match value {
            Some(value) => Ok(Some(*value)),
            None => Err(Damaged("a coordinate beyond the list")),
        }
    }
}

/// The neighbourhood of a new vertex.
#[derive(Clone, Copy, Debug)]
pub struct Surround {
    /// Positions.
    pub around: Around,
    /// How the vertices around missed, on the average.
    rough: usize,
    /// On which axes the vertices around have listed coordinates, 3 bits each.
    listed: u32,
}

impl std::ops::Deref for Surround {
    type Target = Around;
    fn deref(&self) -> &Around {
        &self.around
    }
}

impl std::ops::DerefMut for Surround {
    fn deref_mut(&mut self) -> &mut Around {
        &mut self.around
    }
}

/// What a coordinate's residual is judged by.
#[inline]
fn contexts<M: Model>(
    k: usize,
    log: i32,
    surround: &Surround,
    past: u32,
    hint: u32,
    axis: usize,
    views: [u32; 2],
) -> Contexts {
    let bucket = ((log - 48) / 4).clamp(0, 63) as u32;
    // How far the axis before missed, by what was expected of it: less, as far, more.
    let before = if k == 0 { 0 } else { (past & 7).div_ceil(3) };
    let (main, kin) = ((before * 3 + k as u32) * 64 + bucket, 0);
    if !M::MIXES {
        return Contexts {
            main,
            kin,
            more: [0; model::MORE],
        };
    }
    let fine = (log - 48).clamp(0, 255) as u32;
    let (rough, class) = (surround.rough as u32, surround.class as u32);
    Contexts {
        main,
        kin,
        more: [
            fine << 2 | k as u32,
            (bucket / 2) << 8 | past << 2 | k as u32,
            bucket << 8 | rough << 4 | class << 2,
            bucket << 5 | hint << 2 | k as u32,
            bucket << 2 | axis as u32,
            (bucket / 2) << 8 | rough << 4 | k as u32,
            views[0] << 16 | bucket << 4 | k as u32,
            views[1] << 12 | views[0] << 6 | (bucket / 4) << 2 | k as u32,
        ],
    }
}

/// How far a vertex missed, in levels.
fn roughness(shape: &Shape, missed: Vec3) -> u8 {
    let down = excess(reach(missed), 29);
    let small = shift(missed, down);
    let log = log4(dot(small, small) as u64) + 8 * down as i32 - 8 * FINE as i32;
    let size = 4 * (127 - (shape.size | 1).leading_zeros() as i32);
    ((log - size + 88) / 8).clamp(0, ROUGH as i32 - 1) as u8
}

fn coordinate(x: i64) -> Result<i32, Damaged> {
    i32::try_from(x).map_err(|_| Damaged("a coordinate beyond 32 bits"))
}
