//! How many buckets, and how large a buffer for each: the only knobs of a shuffle, chosen from
//! memory and expected volume. They never change the result.

use super::layout::{EXTENT_BYTES, FILES};

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
/// What a writer holds for a bucket besides its buffer: its state, and an extent at the end.
pub(super) const SLOT_BYTES: u64 = 24;

/// The size of a shuffle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Buckets at most; widths are powers of two, so there may be up to half fewer. (Only a key
    /// range beyond 2^63 has two where one was asked for.)
    pub buckets: usize,
    /// Bytes of the buffer of each bucket in each writer; at least one record is buffered.
    pub buffer_bytes: usize,
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
        let afford = |buffer: u64| share / (buffer.max(record) + SLOT_BYTES);
        let buckets = wanted
            .min(afford(GOOD_BUFFER))
            .max(needed.min(afford(SMALL_BUFFER)))
            .max(1);
        let buffer = (share / buckets)
            .saturating_sub(SLOT_BYTES)
            .min(LARGE_BUFFER);
        Plan {
            buckets: buckets as usize,
            buffer_bytes: (buffer / record * record).max(record) as usize,
        }
    }
}

/// Memory, in bytes, of what a shuffle of `bytes` notes of the parts that it wrote, at most: each
/// part is a buffer, noted by its writer and once more for all.
pub fn noted(bytes: u64) -> u64 {
    bytes
        .div_ceil(SMALL_BUFFER)
        .saturating_mul(2 * EXTENT_BYTES)
}

/// Scratch, in bytes, that a shuffle of `bytes` still holds when its last bucket was handed on:
/// files are freed when all their buckets were read, and buckets beyond a sorter's memory are
/// split on disk. An estimate from above, for `readers` sorters and writers of `memory` each.
///
/// So while one shuffle is poured into another, the larger of the two and this are in use.
pub fn tail(bytes: u64, readers: u64, memory: u64) -> u64 {
    // A width that is a power of two may leave half of the buckets, and of the files.
    let buckets = (bytes / CACHE).clamp(1, MOST_BUCKETS / 2);
    let files = buckets.min(FILES / 2);
    let afford = (memory / (SMALL_BUFFER + SLOT_BYTES) / 2).clamp(1, MOST_BUCKETS / 2);
    let share = |parts: u64| bytes.div_ceil(parts).saturating_mul(readers);
    share(files).saturating_add(share(afford)).min(bytes)
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
            let held = (writers * plan.buckets * (plan.buffer_bytes + 24)) as u64;
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
