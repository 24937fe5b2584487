//! Runs: the parts of a scratch file that hold the records of one bucket.
//!
//! Why buckets are read in few pieces although they are written in many: a bucket's first
//! buffer reserves a run of the file, the next ones fill it, and each run holds twice as much as
//! the one before. What a run does not fill is never written, so it is a hole in the file and
//! takes no space. And the runs are few: the nth begins when 2^(n-1) - 1 first ones are full, so
//! a bucket of v bytes has at most 1 + log2(1 + v / first). That function bends downwards, so
//! however a volume is spread over buckets, they have together no more runs than when all have
//! the same share of it: memory for them can be set aside before the first record comes.
//!
//! Memory: 16 bytes a run and 8 a bucket, for as many runs as the expected volume can make;
//! those beyond are leased in steps. I/O: none.

use crate::disk::journal::{Pen, Reader};
use crate::disk::{Budget, Lease};
use crate::error::Result;
use bytemuck::{Pod, Zeroable};

/// Bytes of the first run of a bucket, or one buffer when that is more.
const FIRST: u64 = 64 << 10;
/// Runs do not grow beyond this many bytes: a file system without holes would write them.
const LARGEST: u64 = 64 << 20;
/// Runs beyond those expected are leased so many at a time.
const STEP: usize = 64;
/// No run.
const NONE: u32 = u32::MAX;

/// Memory of a run.
pub(super) const RUN_BYTES: u64 = size_of::<Run>() as u64;
/// Memory of a bucket's chain of runs.
pub(super) const CHAIN_BYTES: u64 = size_of::<Chain>() as u64;

/// The most runs that so many buckets have together when they hold `bytes` in all.
pub(super) const fn runs_of(bytes: u64, buckets: u64) -> u64 {
    let each = bytes.div_ceil(buckets);
    let doubled = (1 + each.div_ceil(FIRST)).next_power_of_two().ilog2() as u64;
    let large = if each < LARGEST {
        0
    } else {
        each.div_ceil(LARGEST)
    };
    buckets.saturating_mul(1 + doubled + large)
}

/// Consecutive records of one bucket in its scratch file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Run {
    /// Byte in the file.
    pub at: u64,
    pub records: u32,
    /// The run of the same bucket that was filled before, or [`NONE`].
    before: u32,
}

/// The runs of one bucket, the newest first.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Chain {
    newest: u32,
    /// Records that the newest still takes.
    room: u32,
}

/// The runs of one writer.
pub(super) struct Runs {
    chains: Vec<Chain>,
    /// As many as were expected.
    list: Vec<Run>,
    expected: usize,
    /// Those beyond, in steps.
    more: Vec<(Vec<Run>, Lease)>,
}

impl Runs {
    /// No runs yet; the caller has leased [`CHAIN_BYTES`] a bucket and [`RUN_BYTES`] an expected
    /// run.
    pub(super) fn new(buckets: usize, expected: usize) -> Runs {
        let empty = Chain {
            newest: NONE,
            room: 0,
        };
        Runs {
            chains: vec![empty; buckets],
            list: Vec::with_capacity(expected),
            expected,
            more: Vec::new(),
        }
    }

    /// No more runs will come: gives memory back, and says how much of what was leased is needed.
    pub(super) fn seal(&mut self) -> u64 {
        self.list.shrink_to_fit();
        self.chains.len() as u64 * CHAIN_BYTES + self.list.len() as u64 * RUN_BYTES
    }

    /// More runs will come: makes room for as many as are expected of one writer.
    pub(super) fn reopen(&mut self, expected: usize) {
        if self.more.is_empty() {
            self.expected = expected.max(self.list.len());
            self.list.reserve_exact(self.expected - self.list.len());
        }
    }

    /// Runs that whoever made or [reopened](Runs::reopen) these leases.
    pub(super) fn expected(&self) -> u64 {
        self.expected as u64
    }

    /// True when there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes of the chains and of all runs.
    pub(super) fn bytes(&self) -> u64 {
        self.chains.len() as u64 * CHAIN_BYTES + self.len() as u64 * RUN_BYTES
    }

    /// When `next` more records of a bucket do not fit its newest run: how many its next one
    /// must hold, whole buffers of `buffer` records of `size` bytes.
    pub(super) fn wants(&self, bucket: usize, next: u32, buffer: u32, size: usize) -> Option<u32> {
        let Chain { newest, room } = self.chains[bucket];
        if newest != NONE && room >= next {
            return None;
        }
        let whole = |bytes: u64| {
            let buffer = u64::from(buffer);
            bytes.div_ceil(buffer * size as u64) * buffer
        };
        let records = match newest {
            NONE => whole(FIRST),
            newest => {
                let last = u64::from(self.get(newest).records + room);
                (2 * last).min(whole(LARGEST))
            }
        };
        Some(records as u32)
    }

    /// Begins a run of a bucket at byte `at`, with room for so many records.
    ///
    /// # Errors
    /// [`crate::Error::Budget`] when it is one more than expected, and no memory is free.
    pub(super) fn begin(
        &mut self,
        bucket: usize,
        (at, room): (u64, u32),
        budget: &Budget,
    ) -> Result<()> {
        let run = Run {
            at,
            records: 0,
            before: self.chains[bucket].newest,
        };
        let index = self.len();
        if index < self.expected {
            self.list.push(run);
        } else {
            if self.more.last().is_none_or(|(step, _)| step.len() == STEP) {
                let bytes = (STEP * size_of::<Run>()) as u64;
                let lease = budget.lease("the runs of a shuffle", bytes)?;
                self.more.push((Vec::with_capacity(STEP), lease));
            }
            if let Some((step, _)) = self.more.last_mut() {
                step.push(run);
            }
        }
        self.chains[bucket] = Chain {
            newest: index as u32,
            room,
        };
        Ok(())
    }

    fn len(&self) -> usize {
        let beyond = |more: &[(Vec<Run>, Lease)]| match more {
            [] => 0,
            [full @ .., (last, _)] => full.len() * STEP + last.len(),
        };
        self.list.len() + beyond(&self.more)
    }

    /// Adds records to the newest run of a bucket, which has room for them; returns where it
    /// begins, and how many it held before.
    pub(super) fn add(&mut self, bucket: usize, records: u32) -> (u64, u32) {
        let chain = &mut self.chains[bucket];
        debug_assert!(chain.newest != NONE && chain.room >= records);
        chain.room -= records;
        let i = chain.newest as usize;
        let run = match i.checked_sub(self.list.len()) {
            None => &mut self.list[i],
            Some(i) => &mut self.more[i / STEP].0[i % STEP],
        };
        let before = run.records;
        run.records += records;
        (run.at, before)
    }

    /// The runs of a bucket.
    pub(super) fn of(&self, bucket: u64) -> impl Iterator<Item = Run> {
        let mut next = self.chains[bucket as usize].newest;
        std::iter::from_fn(move || {
            (next != NONE).then(|| {
                let run = self.get(next);
                next = run.before;
                run
            })
        })
    }

    fn get(&self, i: u32) -> Run {
        match (i as usize).checked_sub(self.list.len()) {
            None => self.list[i as usize],
            Some(i) => self.more[i / STEP].0[i % STEP],
        }
    }
}

impl Runs {
    /// Writes them down.
    pub(super) fn keep(&self, to: &mut Pen) -> Result<()> {
        to.list(&self.chains)?;
        to.number(1 + self.more.len() as u64)?;
        to.list(&self.list)?;
        self.more.iter().try_for_each(|(step, _)| to.list(step))
    }

    /// Reads them back, sealed, for whoever leases their memory.
    pub(super) fn restore(from: &mut Reader) -> Result<Runs> {
        let chains = from.list()?;
        let mut list: Vec<Run> = Vec::new();
        for _ in 0..from.number()? {
            list.extend(from.list::<Run>()?);
        }
        Ok(Runs {
            expected: list.len(),
            chains,
            list,
            more: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Every record has a place of its own, and an expected volume draws nothing more.
        #[test]
        fn runs_hold_what_is_added(
            flushes in prop::collection::vec(0usize..5, 0..2000),
            buffer in 1u32..5000,
            size in 1usize..100,
            tails in prop::collection::vec(0u32..5000, 5),
            expects in any::<bool>(),
        ) {
            let tails = tails.into_iter().map(|tail| tail % (buffer + 1)).enumerate();
            let all = flushes.into_iter().map(|bucket| (bucket, buffer)).chain(tails);
            let all: Vec<(usize, u32)> = all.filter(|(_, n)| *n > 0).collect();
            let volume = all.iter().map(|(_, n)| u64::from(*n) * size as u64).sum();
            let expected = if expects { runs_of(volume, 5) } else { 3 };
            let budget = Budget::new(if expects { 0 } else { 1 << 20 });
            let mut runs = Runs::new(5, expected as usize);
            let (mut end, mut held) = (0, [0u64; 5]);
            for (bucket, n) in all {
                if let Some(room) = runs.wants(bucket, n, buffer, size) {
                    prop_assert!(room >= buffer && room.is_multiple_of(buffer));
                    runs.begin(bucket, (end, room), &budget).unwrap();
                    end += u64::from(room) * size as u64;
                }
                let (at, before) = runs.add(bucket, n);
                prop_assert!(at + u64::from(before + n) * size as u64 <= end);
                held[bucket] += u64::from(n);
            }
            prop_assert!(!expects || runs.seal() <= 5 * CHAIN_BYTES + expected * RUN_BYTES);
            for (bucket, held) in held.into_iter().enumerate() {
                let of: Vec<Run> = runs.of(bucket as u64).collect();
                prop_assert_eq!(of.iter().map(|r| u64::from(r.records)).sum::<u64>(), held);
                // Each is twice the one after it in the list, which was filled before it.
                for pair in of.windows(2).skip(1) {
                    let twice = 2 * u64::from(pair[1].records);
                    prop_assert!(u64::from(pair[0].records) >= twice.min(LARGEST / size as u64));
                }
            }
            drop(runs);
            prop_assert_eq!(budget.used(), 0);
        }
    }

    #[test]
    fn large_buckets_have_few_runs() {
        for (volume, most) in [(0, 1), (FIRST, 2), (100 * FIRST, 8), (1 << 30, 32)] {
            assert!(runs_of(volume, 1) <= most, "{volume}");
            assert_eq!(runs_of(1000 * volume, 1000), 1000 * runs_of(volume, 1));
        }
    }
}
