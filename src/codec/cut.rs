//! Space cut into boxes with about equal shares of the vertices.
//!
//! Why boxes: a chunk pays at its rim, where fewer neighbours are known and vertices are coded once
//! more; straight cuts across the longest side make rims short, about half as long as those of
//! intervals of a Morton curve.
//!
//! Memory: 10 bytes a cube, 2.5 MiB in all. I/O: none.

/// Bits of an axis in the numbers of cubes.
const BITS: usize = 6;
/// Cubes along an axis.
const SIDE: usize = 1 << BITS;

/// Cubes of a box of vertices, and what is in them.
pub(super) struct Cubes {
    low: [i32; 3],
    shift: u32,
    counts: Vec<u64>,
}

/// A box of cubes, `to` left out, and the parts that it is cut into.
struct Block {
    from: [usize; 3],
    to: [usize; 3],
    first: u64,
    parts: u64,
}

impl Cubes {
    /// Bytes of the counts, and of the parts that become of them.
    pub(super) const BYTES: u64 = 10 << (3 * BITS);

    /// Cubes over the box from `low` to `high`, empty.
    pub(super) fn new(low: [i32; 3], high: [i32; 3]) -> Cubes {
        let extent = |k: usize| i64::from(high[k]) - i64::from(low[k]);
        let extent = (0..3).map(extent).fold(0, i64::max);
        Cubes {
            low,
            shift: (64 - extent.leading_zeros()).saturating_sub(BITS as u32),
            counts: vec![0; 1 << (3 * BITS)],
        }
    }

    /// Counts a vertex.
    pub(super) fn add(&mut self, at: [i32; 3]) {
        let cube = self.of(at);
        self.counts[cube] += 1;
    }

    /// The cube of a place in the box.
    fn of(&self, at: [i32; 3]) -> usize {
        let at = [0, 1, 2].map(|k| (i64::from(at[k]) - i64::from(self.low[k])) >> self.shift);
        index(at.map(|x| x as usize))
    }

    /// Cuts into so many parts, or fewer where cubes cannot be cut; numbers the parts.
    pub(super) fn cut(self, parts: u64) -> Parts {
        let mut of = vec![0; self.counts.len()];
        let mut blocks = vec![Block {
            from: [0; 3],
            to: [SIDE; 3],
            first: 0,
            parts,
        }];
        while let Some(block) = blocks.pop() {
            match block.halves(&self.counts) {
                Some(halves) => blocks.extend(halves),
                None => block.each(|cube| of[cube] = block.first as u16),
            }
        }
        Parts { cubes: self, of }
    }
}

/// Space, cut.
pub(super) struct Parts {
    cubes: Cubes,
    of: Vec<u16>,
}

impl Parts {
    /// The part of a place in the box.
    pub(super) fn of(&self, at: [i32; 3]) -> u16 {
        self.of[self.cubes.of(at)]
    }
}

fn index([x, y, z]: [usize; 3]) -> usize {
    (z << BITS | y) << BITS | x
}

impl Block {
    fn each(&self, mut each: impl FnMut(usize)) {
        for z in self.from[2]..self.to[2] {
            for y in self.from[1]..self.to[1] {
                (self.from[0]..self.to[0]).for_each(|x| each(index([x, y, z])));
            }
        }
    }

    /// Vertices in each layer of cubes across each axis.
    fn layers(&self, counts: &[u64]) -> [[u64; SIDE]; 3] {
        let mut layers = [[0; SIDE]; 3];
        self.each(|cube| {
            let count = counts[cube];
            for (k, layer) in layers.iter_mut().enumerate() {
                layer[cube >> (k * BITS) & (SIDE - 1)] += count;
            }
        });
        layers
    }

    /// Cuts across the longest side of what it holds, where shares are nearest to equal; none when
    /// it is one part, or all that it holds is in one cube.
    fn halves(&self, counts: &[u64]) -> Option<[Block; 2]> {
        if self.parts < 2 {
            return None;
        }
        let layers = self.layers(counts);
        let held = layers.each_ref().map(|layer| {
            let first = layer.iter().position(|n| *n > 0).unwrap_or(0);
            let last = layer.iter().rposition(|n| *n > 0).unwrap_or(0);
            (first, last)
        });
        let side = |k: usize| held[k].1 - held[k].0;
        let axis = (0..3)
            .rev()
            .max_by_key(|&k| side(k))
            .filter(|&k| side(k) > 0)?;
        let all: u64 = layers[axis].iter().sum();
        let share = |parts: u64| u128::from(all) * u128::from(parts) / u128::from(self.parts);
        let wanted = share(self.parts / 2);
        let mut before = 0;
        let planes = (held[axis].0 + 1..=held[axis].1).map(|plane| {
            before += layers[axis][plane - 1];
            (u128::from(before).abs_diff(wanted), plane, before)
        });
        let (_, plane, before) = planes.min()?;
        // As many parts as its share has room for, rounded.
        let fair = u128::from(before) * u128::from(self.parts) * 2 + u128::from(all);
        let parts = (fair / (2 * u128::from(all))) as u64;
        let parts = parts.clamp(1, self.parts - 1);
        let (mut low_to, mut high_from) = (self.to, self.from);
        (low_to[axis], high_from[axis]) = (plane, plane);
        Some([
            Block {
                from: self.from,
                to: low_to,
                first: self.first,
                parts,
            },
            Block {
                from: high_from,
                to: self.to,
                first: self.first + parts,
                parts: self.parts - parts,
            },
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(points: &[[i32; 3]], count: u64) -> Vec<u16> {
        let low = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).min().unwrap());
        let high = [0, 1, 2].map(|k| points.iter().map(|p| p[k]).max().unwrap());
        let mut cubes = Cubes::new(low, high);
        points.iter().for_each(|&p| cubes.add(p));
        let parts = cubes.cut(count);
        points.iter().map(|&p| parts.of(p)).collect()
    }

    #[test]
    fn parts_are_boxes_with_about_equal_shares() {
        let points: Vec<[i32; 3]> = (0..100_000)
            .map(|i: i32| [i % 500 * 7, i / 500 * 3, i % 11])
            .collect();
        for count in [1, 2, 3, 5, 8, 13, 40] {
            let of = parts(&points, count);
            let mut sizes = vec![0u64; count as usize];
            of.iter().for_each(|&p| sizes[usize::from(p)] += 1);
            let fair = points.len() as u64 / count;
            let most = sizes.iter().max().unwrap();
            assert!(
                *most <= fair * 13 / 10 && sizes.iter().all(|n| *n > fair / 2),
                "{sizes:?}"
            );
            // No two boxes meet.
            let bounds: Vec<_> = (0..count as u16)
                .map(|part| {
                    let mine = || points.iter().zip(&of).filter(|(_, p)| **p == part);
                    let of = |k: usize| mine().map(move |(at, _)| at[k]);
                    [0, 1].map(|k| (of(k).min().unwrap(), of(k).max().unwrap()))
                })
                .collect();
            for (i, a) in bounds.iter().enumerate() {
                for b in &bounds[..i] {
                    let apart = (0..2).any(|k| a[k].1 < b[k].0 || b[k].1 < a[k].0);
                    assert!(apart, "{a:?} {b:?}");
                }
            }
        }
    }

    #[test]
    fn extremes_are_cut_or_left_whole() {
        assert_eq!(parts(&[[5; 3]; 9], 4), [0; 9]);
        let far = [[i32::MIN; 3], [i32::MAX; 3], [0; 3]];
        assert_eq!(parts(&far, 2)[..2], [0, 1]);
    }
}
