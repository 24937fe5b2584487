//! Coordinates that repeat: the planes of an isosurface's grid, the heights of a terrain, the
//! faces of a machined part.
//!
//! Why it works: where many vertices share a coordinate, saying *which* of the shared values it is
//! takes far fewer bits than saying how far it is from its prediction: the values are few, and the
//! prediction is mostly nearest to the right one. Each axis has a list of them, ascending, which is
//! written once for the chunk; a coordinate is on the list or off it.
//!
//! Memory: 4 bytes a value, at most one value for each four vertices.

use super::Damaged;
use super::model::{self, Contexts, Model};
use super::range::Coder;

/// A value is listed when so many vertices share it at least.
const WORTH: usize = 4;
/// And when it is so many times as common as values around are on the average.
const PEAK: usize = 3;
/// The values of a list make up at least one in so many coordinates.
const SHARE: usize = 5;

/// The values that repeat, by axis, ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lattice {
    /// Empty for an axis without.
    pub values: [Vec<i32>; 3],
}

impl Lattice {
    /// Finds the values that repeat among the positions of the vertices in use.
    pub fn find(positions: &[[i32; 3]], used: &[bool]) -> Lattice {
        let axis = |k: usize| {
            let mut all: Vec<i32> = positions
                .iter()
                .zip(used)
                .filter_map(|(p, &used)| used.then_some(p[k]))
                .collect();
            all.sort_unstable();
            repeated(&all)
        };
        Lattice {
            values: [axis(0), axis(1), axis(2)],
        }
    }

    /// Codes the lists.
    ///
    /// # Errors
    /// [`Damaged`] when there are more values than `vertices` allow, or they do not ascend.
    pub fn code<M: Model>(
        &mut self,
        model: &mut M,
        coder: &mut impl Coder,
        vertices: usize,
    ) -> Result<(), Damaged> {
        let contexts = [0, 1].map(Contexts::of);
        for list in &mut self.values {
            let size = model.size(coder, model::LIST, &contexts[0], 0, list.len() as u64);
            if size > (vertices / WORTH) as u64 {
                return Err(Damaged("more repeated coordinates than vertices allow"));
            }
            let mut last = 0;
            let mut start = 31;
            for i in 0..size as usize {
                let truth = list.get(i).copied().unwrap_or(0);
                let step = i64::from(truth) - last;
                let step = model.number(coder, model::LIST, &contexts[1], (start, 0), step);
                start = (64 - step.unsigned_abs().leading_zeros()).min(31);
                if i > 0 && step <= 0 {
                    return Err(Damaged("repeated coordinates that do not ascend"));
                }
                last += step;
                let value = i32::try_from(last)
                    .map_err(|_| Damaged("a repeated coordinate beyond 32 bits"))?;
                match list.get_mut(i) {
                    Some(slot) => *slot = value,
                    None => list.push(value),
                }
            }
        }
        Ok(())
    }

    /// The index of the value nearest to `at`, and the half distance between those around it.
    #[inline]
    pub fn nearest(&self, axis: usize, at: i64) -> (usize, i64) {
        let list = &self.values[axis];
        let above = list
            .partition_point(|&v| i64::from(v) < at)
            .min(list.len() - 1);
        let below = above.saturating_sub(1);
        let off = |i: usize| (i64::from(list[i]) - at).abs();
        let near = if off(below) < off(above) {
            below
        } else {
            above
        };
        let (first, last) = (near.saturating_sub(1), (near + 1).min(list.len() - 1));
        let width = i64::from(list[last]) - i64::from(list[first]);
        (near, (width / (last - first).max(1) as i64).max(1))
    }
}

/// The values of a sorted list that are peaks of it.
fn repeated(sorted: &[i32]) -> Vec<i32> {
    let runs: Vec<(i32, usize)> = sorted
        .chunk_by(|a, b| a == b)
        .map(|run| (run[0], run.len()))
        .collect();
    let mut values = Vec::new();
    let mut covered = 0;
    for (i, &(value, count)) in runs.iter().enumerate() {
        // The average around: the runs to either side, by the width they span.
        let (from, to) = (i.saturating_sub(64), (i + 64).min(runs.len() - 1));
        let sum: usize = runs[from..=to].iter().map(|r| r.1).sum();
        let width = (i64::from(runs[to].0) - i64::from(runs[from].0) + 1) as usize;
        if count >= WORTH && count * width >= PEAK * sum {
            values.push(value);
            covered += count;
        }
    }
    if covered * SHARE < sorted.len() {
        values.clear();
    }
    values
}
