//! How far a vertex may lie from its prediction, and along which axes: a local frame.
//!
//! Why it works: on a smooth surface a vertex misses its prediction far less along the normal
//! than within the surface. The mean squares of the misses along a frame of the gate (along it,
//! across it, along the normal) are tracked in units of the triangle's size; turned into global
//! axes they are a covariance matrix, and its elimination L D L^T says for each axis in turn
//! which part of its miss follows from those of the axes before, and how large the rest is.
//! The axis nearest to the normal comes last: what it misses then follows almost from the others.
//! Integer coordinates are thus coded along their own axes, with nothing lost to rounding.
//!
//! Memory: 32 bytes a track, 117 KB in all.

use super::around::{Agreement, Around, PAIRS, WAYS};
use super::predict::FINE;
use super::vec::{UNIT, Vec3, add, cross, dot, excess, log4, reach, shift, sub, unit};

/// How the last vertices around missed, in levels.
pub const ROUGH: usize = 12;
/// Levels of how far the parallelograms that agree best are apart.
const APART: usize = 8;
/// Bits of a fraction of a tracked mean square.
const SQUARE: u32 = 24;
/// Bits of a factor in the elimination.
const FACTOR: u32 = 20;
/// Mean squares in the frame as they are used have so many bits at most.
const ROOM: u32 = 30;

/// Mean squares along the frame, in 2^-24 of the triangle's size.
#[derive(Clone, Copy, Debug)]
struct Track {
    mean: [i64; 3],
    seen: u32,
}

/// What is expected of a vertex's misses along the axes, in the order in which they are coded.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// The axes, the one nearest to the normal last.
    pub axes: [usize; 3],
    /// Factors of the elimination, in 2^-20: second on first, third on first, third on second.
    factors: [i64; 3],
    /// Four times the binary logarithm of the variance of each, in squared 256ths of a step.
    pub logs: [i32; 3],
    /// The frame.
    frame: [Vec3; 3],
    /// The triangle's size: the sum of its squared edges.
    pub size: i128,
    /// Which track it was taken from.
    track: usize,
}

/// The tracks.
#[derive(Clone, Debug)]
pub struct Spreads {
    tracks: Vec<Track>,
}

impl Default for Spreads {
    fn default() -> Spreads {
        let fresh = Track {
            mean: [1 << (SQUARE - 7), 1 << (SQUARE - 7), 1 << (SQUARE - 9)],
            seen: 0,
        };
        Spreads {
            tracks: vec![fresh; PAIRS * WAYS * APART * ROUGH],
        }
    }
}

impl Spreads {
    /// What is expected around here.
    pub fn shape(&self, around: &Around, agreement: Agreement, rough: usize) -> Shape {
        let along = sub(around.b, around.a);
        let (to_a, to_b) = (sub(around.apex, around.a), sub(around.apex, around.b));
        let widest = reach(along) | reach(to_a) | reach(to_b);
        let down = excess(widest, 24);
        let square = |v: Vec3| dot(shift(v, down), shift(v, down)) as u64;
        let small = (square(along) + square(to_a) + square(to_b)).max(1);
        let frame = frame(around);
        // Where parallelograms disagree the surface is bent, or its triangles are irregular, and
        // the guess is worse.
        let apart = agreement.apart - log4(small) - 8 * down as i32;
        let apart = ((apart + 48) / 8).clamp(0, APART as i32 - 1) as usize;
        let track = (around.way(agreement) * APART + apart) * ROUGH + rough;
        let mean = self.tracks[track].mean;
        // Variances in squared 256ths, within ROOM bits: 2^`up` of them is one.
        let full = mean.map(|m| (m as u128 * u128::from(small)) >> (SQUARE - 2 * FINE));
        let most = full.iter().fold(0, |r, &m| r | m);
        let cut = (128 - most.leading_zeros()).saturating_sub(ROOM);
        let up = cut + 2 * down;
        // Rounding to the grid alone misses by a twelfth of a squared step.
        let rounding = ((1 << (2 * FINE)) / 12) >> up.min(40);
        let variance = full.map(|m| ((m >> cut) as i64).max(1));
        let mut c = [[0i64; 3]; 3];
        for (v, e) in variance.iter().zip(&frame) {
            for i in 0..3 {
                for j in 0..=i {
                    c[i][j] += (v * ((e[i] * e[j]) >> UNIT)) >> UNIT;
                }
            }
        }
        for (i, row) in c.iter_mut().enumerate() {
            row[i] += rounding + 1;
        }
        let axes = order(frame[2]);
        let at = |i: usize, j: usize| c[axes[i].max(axes[j])][axes[i].min(axes[j])];
        let d0 = at(0, 0).max(1);
        let factor =
            |part: i64, whole: i64| ((part << FACTOR) / whole).clamp(-64 << FACTOR, 64 << FACTOR);
        let f10 = factor(at(1, 0), d0);
        let d1 = (at(1, 1) - ((f10 * at(1, 0)) >> FACTOR)).max(rounding + 1);
        let f20 = factor(at(2, 0), d0);
        let rest = at(2, 1) - ((f20 * at(1, 0)) >> FACTOR);
        let f21 = factor(rest, d1);
        let d2 = at(2, 2) - ((f20 * at(2, 0)) >> FACTOR) - ((f21 * rest) >> FACTOR);
        let logs = [d0, d1, d2.max(rounding + 1)].map(|d| log4(d as u64) + 4 * up as i32);
        Shape {
            axes,
            factors: [f10, f20, f21],
            logs,
            frame,
            size: i128::from(small) << (2 * down),
            track,
        }
    }

    /// Learns what was missed, in 256ths of a step.
    pub fn learn(&mut self, shape: &Shape, missed: Vec3) {
        let track = &mut self.tracks[shape.track];
        let missed = missed.map(|x| x.clamp(-1 << 40, 1 << 40));
        let rate = (track.seen / 2 + 2).min(40);
        track.seen = track.seen.saturating_add(1);
        for (mean, e) in track.mean.iter_mut().zip(&shape.frame) {
            let part = (0..3).map(|i| (missed[i] * e[i]) >> UNIT).sum::<i64>();
            let square = (i128::from(part) * i128::from(part)) << (SQUARE - 2 * FINE);
            // Mostly both have 64 bits at most, and a narrow division is several times as fast.
            let square = match (u64::try_from(square), u64::try_from(shape.size)) {
                (Ok(square), Ok(size)) => i128::from(square / size),
                _ => square / shape.size,
            };
            // One wild vertex must not spoil the mean.
            let most = i128::from(*mean) * 16 + (1 << 8);
            let gap = square.min(most) as i64 - *mean;
            *mean = (*mean + gap / i64::from(rate)).clamp(1 << 4, 1 << 40);
        }
    }
}

impl Shape {
    /// What the axis coded as number `k` is expected to miss, given those coded before, in
    /// 256ths of a step.
    #[inline]
    pub fn expected(&self, k: usize, innovation: &[i64; 3]) -> i64 {
        let [f10, f20, f21] = self.factors;
        let part = |f: i64, x: i64| ((i128::from(f) * i128::from(x)) >> FACTOR) as i64;
        match k {
            0 => 0,
            1 => part(f10, innovation[0]),
            _ => part(f20, innovation[0]) + part(f21, innovation[1]),
        }
    }
}

/// Along the gate, across it, and along the normal of the triangles around.
fn frame(around: &Around) -> [Vec3; 3] {
    let (a, b) = (around.a, around.b);
    let parts = [
        (sub(a, around.apex), sub(b, around.apex)),
        (sub(b, around.right), sub(around.c, around.right)),
        (sub(around.z, around.left), sub(a, around.left)),
    ];
    let all = parts.iter().fold(0, |r, (u, v)| r | reach(*u) | reach(*v));
    let down = excess(all, 28);
    let normal = parts.iter().fold([0; 3], |n, (u, v)| {
        add(n, cross(shift(*u, down), shift(*v, down)))
    });
    let mut normal = unit(normal);
    if normal == [0; 3] {
        normal = [0, 0, 1 << UNIT];
    }
    let mut along = unit(sub(b, a));
    // The part along the normal is taken off.
    let off = dot(along, normal) >> UNIT;
    along = unit(std::array::from_fn(|i| {
        along[i] - ((normal[i] * off) >> UNIT)
    }));
    if along == [0; 3] {
        let axis = order(normal)[0];
        let mut pick = [0; 3];
        pick[axis] = 1 << UNIT;
        along = unit(cross(normal, pick));
    }
    let across = shift(cross(normal, along), UNIT);
    [along, across, normal]
}

/// The axes, the one along which `normal` is longest last.
fn order(normal: Vec3) -> [usize; 3] {
    let n = normal.map(i64::unsigned_abs);
    if n[2] >= n[0] && n[2] >= n[1] {
        [0, 1, 2]
    } else if n[1] >= n[0] {
        [0, 2, 1]
    } else {
        [1, 2, 0]
    }
}
