//! How many buckets, and how large a buffer for each: the only knobs of a shuffle, chosen from
//! memory and expected volume. They never change the result.

use super::runs::{CHAIN_BYTES, RUN_BYTES, runs_of};

/// Buckets of about this many bytes are sorted within a core's second-level cache.
const CACHE: u64 = 512 << 10;
/// More buckets than this at once cost more in address translation than they save.
const MOST_BUCKETS: u64 = 2048;
/// Buffers below this make many small writes, so they are taken only to avoid splits.
const GOOD_BUFFER: u64 = 16 << 10;
/// The least buffer that is taken to avoid splits.
const SMALL_BUFFER: u64 = 4 << 10;
/// Larger buffers gain nothing more.
const LARGE_BUFFER: u64 = 64 << 10;
/// What a writer holds for a bucket besides its buffer and its runs.
pub(super) const SLOT_BYTES: u64 = 8 + CHAIN_BYTES;

/// The size of a shuffle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Buckets at most; widths are powers of two, so there may be up to half fewer. (Only a key
    /// range beyond 2^63 has two where one was asked for.)
    pub buckets: usize,
    /// Bytes of the buffer of each bucket in each writer; at least one record is buffered.
    pub buffer_bytes: usize,
    /// Bytes that are expected in all. When more come, a writer may need a little more memory
    /// than it has leased, for what it notes of the parts that it wrote.
    pub volume: u64,
}

impl Plan {
    /// A plan for `expected_records` of `record_bytes` each, whose writers together hold
    /// `memory` bytes at most, and whose buckets suit sorters of `sort_memory` bytes.
    ///
    /// With too little memory for enough buckets there are fewer, which sorters then split.
    /// Only memory below one record for each writer is exceeded.
    pub fn within(
        memory: u64,
        writers: usize,
        record_bytes: usize,
        expected_records: u64,
        sort_memory: u64,
    ) -> Plan {
        let record = record_bytes.max(1) as u64;
        let share = memory / writers.max(1) as u64;
        let volume = expected_records.saturating_mul(record);
        // A sort wants as much space again, and a power-of-two width may double a bucket.
        let fitting = (sort_memory / 4).max(1);
        let needed = volume.div_ceil(fitting).clamp(1, MOST_BUCKETS);
        let wanted = volume.div_ceil(fitting.min(CACHE)).clamp(1, MOST_BUCKETS);
        // The fewer the buckets, the more runs each may have: so many when there is one.
        let most_runs = runs_of(volume, 1) * RUN_BYTES;
        let afford = |buffer: u64| share / (buffer.max(record) + SLOT_BYTES + most_runs);
        let buckets = wanted
            .min(afford(GOOD_BUFFER))
            .max(needed.min(afford(SMALL_BUFFER)))
            .max(1);
        Plan::of(buckets as usize, share, record_bytes, expected_records)
    }

    /// A plan for so many buckets, or fewer, whose writers hold at most `memory` bytes each. Only
    /// memory below one record is exceeded.
    pub fn of(buckets: usize, memory: u64, record_bytes: usize, expected_records: u64) -> Plan {
        let record = record_bytes.max(1) as u64;
        let volume = expected_records.saturating_mul(record);
        let mut buckets = (buckets as u64).max(1);
        let notes = |buckets| SLOT_BYTES + runs_of(volume, buckets) / buckets * RUN_BYTES;
        while buckets > 1 && memory / buckets < record + notes(buckets) {
            buckets = (memory / (record + notes(buckets))).clamp(1, buckets - 1);
        }
        let buffer = (memory / buckets)
            .saturating_sub(notes(buckets))
            .min(LARGE_BUFFER);
        Plan {
            buckets: buckets as usize,
            buffer_bytes: (buffer / record * record).max(record) as usize,
            volume,
        }
    }

    /// Bytes that one writer leases at most.
    pub fn writer_bytes(&self) -> u64 {
        let buckets = self.buckets as u64;
        buckets * (self.buffer_bytes as u64 + SLOT_BYTES) + self.runs(buckets) * RUN_BYTES
    }

    /// Runs that one writer expects at most in `buckets` buckets, which are no more than planned.
    pub(super) fn runs(&self, buckets: u64) -> u64 {
        let planned = runs_of(self.volume, (self.buckets as u64).max(1));
        // Fewer buckets have fewer runs, but for what is rounded up.
        planned.min(runs_of(self.volume, buckets.max(1)))
    }
}

/// Scratch, in bytes, that a shuffle of `bytes` still holds when its last bucket was handed on:
/// what was read is freed, but buckets beyond a sorter's memory are split on disk. An estimate
/// from above, for `readers` sorters and writers of `memory` each.
///
/// So while one shuffle is poured into another, the larger of the two and this are in use. (On
/// a file system that does not free parts of files, up to an eighth of `bytes` a reader more.)
pub fn tail(bytes: u64, readers: u64, memory: u64) -> u64 {
    let slot = SMALL_BUFFER + SLOT_BYTES + runs_of(bytes, 1) * RUN_BYTES;
    // A width that is a power of two may leave half of the buckets.
    let afford = (memory / slot / 2).clamp(1, MOST_BUCKETS / 2);
    bytes.div_ceil(afford).saturating_mul(readers).min(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]

        #[test]
        fn plans_stay_within_memory(
            memory in 0u64..1 << 34,
            small in any::<bool>(),
            writers in 1usize..40,
            record in 1usize..100,
            expected in any::<u64>(),
            sort_memory in 0u64..1 << 32,
        ) {
            let memory = if small { memory >> 16 } else { memory };
            let plan = Plan::within(memory, writers, record, expected, sort_memory);
            prop_assert!(plan.buckets >= 1 && plan.buffer_bytes >= record);
            let held = writers as u64 * plan.writer_bytes();
            prop_assert!(held <= memory || (plan.buckets, plan.buffer_bytes) == (1, record));
        }
    }

    #[test]
    fn plans_are_sensible() {
        // 32M triangles of 13 bytes, two writers, ample memory: buckets that suit the cache.
        let plan = Plan::within(64 << 20, 2, 13, 32 << 20, 16 << 20);
        assert!((512..=2048).contains(&plan.buckets), "{plan:?}");
        assert!(
            (16 << 10..=64 << 10).contains(&plan.buffer_bytes),
            "{plan:?}"
        );
        // Little memory: small buffers rather than splits.
        let plan = Plan::within(4 << 20, 2, 13, 32 << 20, 4 << 20);
        assert!(plan.buckets >= 400, "{plan:?}");
        // Nothing expected: one bucket.
        assert_eq!(Plan::within(4 << 20, 2, 13, 0, 4 << 20).buckets, 1);
    }
}
