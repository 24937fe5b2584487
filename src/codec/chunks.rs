//! How intervals are cut into chunks: in equal parts, in file order.
//!
//! Memory: 16 bytes an interval. I/O: none.

use super::least;

/// How intervals are cut into chunks.
pub(super) struct Chunks {
    /// Records of each interval.
    counts: Vec<u64>,
    /// Chunks before each interval, and in all.
    pub first: Vec<u64>,
}

impl Chunks {
    /// Cuts intervals of so many records into chunks of `most`, or fewer.
    pub fn new(counts: &[u64], most: u64) -> Chunks {
        let mut first = vec![0];
        for count in counts {
            first.push(first[first.len() - 1] + count.div_ceil(most));
        }
        Chunks {
            counts: counts.to_vec(),
            first,
        }
    }

    /// All chunks.
    pub fn total(&self) -> u64 {
        self.first[self.first.len() - 1]
    }

    /// Chunks of an interval.
    pub fn of(&self, interval: u64) -> u64 {
        self.first[interval as usize + 1] - self.first[interval as usize]
    }

    /// Records of the chunks of an interval up to chunk `part`, that one left out.
    pub fn before(&self, interval: u64, part: u64) -> u64 {
        let count = u128::from(self.counts[interval as usize]);
        (count * u128::from(part) / u128::from(self.of(interval).max(1))) as u64
    }

    /// The most records of a chunk of an interval.
    pub fn largest(&self, interval: u64) -> u64 {
        self.counts[interval as usize].div_ceil(self.of(interval).max(1))
    }

    /// The most that a chunk takes, whose intervals name no more than so many vertices, when each
    /// record takes `record` bytes.
    pub fn bytes(&self, vertices: &[u64], record: u64) -> u64 {
        let of = |(i, &named): (u64, &u64)| least::chunk_bytes(self.largest(i), named, record);
        (0..).zip(vertices).map(of).max().unwrap_or(0)
    }
}
