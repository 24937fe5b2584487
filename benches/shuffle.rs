//! The external shuffle on 4M records of 16 bytes: writing, then sorting, each with the
//! answer that must come out. `cargo bench --bench shuffle`; with `--test` each runs once.

use cornermill::Result;
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::shuffle::{Buckets, Plan, Record, Shuffle, Writer};
use criterion::{BatchSize, Criterion, Throughput};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const RECORDS: u64 = 4 << 20;
/// Records of a unit of work.
const UNIT: u64 = 1 << 16;
const KEYS: u64 = 1 << 21;

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Rec {
    lo: u32,
    hi: u32,
    id: u64,
}

impl Record for Rec {
    const LEVELS: usize = 3;
    fn key(&self, level: usize) -> u64 {
        match level {
            0 => self.lo.into(),
            1 => self.hi.into(),
            _ => self.id,
        }
    }
}

/// How the keys of the records lie.
#[derive(Clone, Copy)]
enum Keys {
    /// Anywhere: the worst order.
    Random,
    /// Half of the records have one key.
    Hub,
}

impl Keys {
    fn record(self, i: u64) -> Rec {
        let x = (i ^ (i >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 29)).wrapping_mul(0x94D0_49BB_1331_11EB);
        let lo = match self {
            Keys::Hub if x & 1 == 1 => 77_777,
            _ => (x >> 40) as u32 & (KEYS as u32 - 1),
        };
        let hi = (x >> 8) as u32 & (KEYS as u32 - 1);
        Rec { lo, hi, id: i }
    }
}

fn workspace(dir: &Path, threads: usize) -> Result<Workspace> {
    let io = Arc::new(Counters::default());
    Ok(Workspace {
        budget: Budget::new(256 << 20),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io)?,
        io,
        workers: Workers::new(threads)?,
        progress: Arc::new(NoProgress),
    })
}

fn write(ws: &Workspace, keys: Keys, sort_memory: u64) -> Result<Buckets<Rec>> {
    let writers = ws.workers.count();
    let plan = Plan::within(64 << 20, writers, size_of::<Rec>(), RECORDS, sort_memory);
    let shuffle = Shuffle::new(ws, "bench", 0..KEYS, plan)?;
    let unit = |writer: &mut Writer<'_, Rec>, unit: u64| {
        (unit * UNIT..(unit + 1) * UNIT).try_for_each(|i| writer.push(keys.record(i)))
    };
    ws.workers
        .run(RECORDS / UNIT, || shuffle.writer(), unit, Writer::finish)?;
    let buckets = shuffle.finish()?;
    assert_eq!(buckets.records(), RECORDS);
    assert_eq!(buckets.spilled_bytes(), RECORDS * size_of::<Rec>() as u64);
    Ok(buckets)
}

/// Sorts all buckets; asserts the order, that all is there, and returns the splits.
fn sort(ws: &Workspace, buckets: &Buckets<Rec>, sort_memory: u64) -> Result<u64> {
    let sum = AtomicU64::new(0);
    let splits = AtomicU64::new(0);
    ws.workers.run(
        buckets.count(),
        || buckets.sorter(sort_memory),
        |sorter, b| {
            let mut last = (0, 0, 0);
            let mut part = 0u64;
            buckets.sorted(b, sorter, &mut |records| {
                for r in records {
                    let key = (r.lo, r.hi, r.id);
                    assert!(last <= key);
                    last = key;
                    part = part.wrapping_add(r.id * r.id);
                }
                Ok(())
            })?;
            sum.fetch_add(part, Ordering::Relaxed);
            Ok(())
        },
        |sorter| {
            splits.fetch_add(sorter.splits(), Ordering::Relaxed);
            Ok(())
        },
    )?;
    let n = u128::from(RECORDS);
    let expected = (n - 1) * n * (2 * n - 1) / 6;
    assert_eq!(sum.into_inner(), expected as u64);
    Ok(splits.into_inner())
}

fn shuffle(c: &mut Criterion) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut group = c.benchmark_group("shuffle 4M records of 16 bytes");
    group
        .throughput(Throughput::Elements(RECORDS))
        .sample_size(10);
    for threads in [1, 2] {
        let ws = workspace(dir.path(), threads).expect("a workspace");
        group.bench_function(format!("write, {threads} threads"), |b| {
            b.iter(|| black_box(write(&ws, Keys::Random, 16 << 20).expect("written")));
        });
        for (name, keys, memory) in [
            ("sort", Keys::Random, 16 << 20),
            ("sort in place", Keys::Random, 768 << 10),
            ("sort with splits", Keys::Random, 64 << 10),
            ("sort a hub", Keys::Hub, 4 << 20),
        ] {
            group.bench_function(format!("{name}, {threads} threads"), |b| {
                b.iter_batched(
                    || write(&ws, keys, 16 << 20).expect("written"),
                    |buckets| {
                        let splits = sort(&ws, &buckets, memory).expect("sorted");
                        assert_eq!(splits > 0, memory < 128 << 10 || matches!(keys, Keys::Hub));
                    },
                    BatchSize::PerIteration,
                );
            });
        }
    }
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    shuffle(&mut criterion);
    criterion.final_summary();
}
