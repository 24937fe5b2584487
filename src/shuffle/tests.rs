use super::*;
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use crate::error::{Error, Result};
use proptest::prelude::*;
use std::ops::Range;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Rec {
    a: u64,
    b: u32,
    c: u32,
}

impl Record for Rec {
    const LEVELS: usize = 3;
    fn key(&self, level: usize) -> u64 {
        match level {
            0 => self.a,
            1 => self.b.into(),
            _ => self.c.into(),
        }
    }
}

/// Twelve bytes: the footer of a block takes one record, and records do not fill pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Odd([u32; 3]);

impl Record for Odd {
    const LEVELS: usize = 3;
    fn key(&self, level: usize) -> u64 {
        self.0[level].into()
    }
}

/// Three bytes: a footer takes three records, and reads are aligned to nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Tiny([u8; 3]);

impl Record for Tiny {
    const LEVELS: usize = 3;
    fn key(&self, level: usize) -> u64 {
        self.0[level].into()
    }
}

fn workspace(dir: &tempfile::TempDir, memory: u64) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.path().to_owned()], u64::MAX, &io).unwrap(),
        io,
        workers: Workers::new(1).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

/// What a run did, besides its records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Did {
    spilled: u64,
    splits: u64,
    /// The most scratch bytes in use at once.
    scratch: u64,
}

/// Shuffles with `writers` threads and returns what came out, checked bucket by bucket.
fn run<R: Record>(
    records: &[R],
    keys: Range<u64>,
    writers: usize,
    plan: Plan,
    sort_memory: u64,
) -> Result<(Vec<R>, Did)> {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 64 << 20);
    let shuffle = Shuffle::new(&ws, "test", keys.clone(), plan)?;
    let part = records.len().div_ceil(writers).max(1);
    std::thread::scope(|scope| {
        let write = |part: &[R]| -> Result<()> {
            let mut writer = shuffle.writer()?;
            part.iter().try_for_each(|r| writer.push(*r))?;
            writer.finish()
        };
        let threads: Vec<_> = records
            .chunks(part)
            .map(|part| scope.spawn(move || write(part)))
            .collect();
        threads.into_iter().try_for_each(|t| t.join().unwrap())
    })?;
    let buckets = shuffle.finish()?;
    assert_eq!(buckets.records(), records.len() as u64);
    assert!(buckets.count() <= plan.buckets.max(2) as u64);
    let before = ws.budget.used();
    let kept = size_of_val(records) as u64 - buckets.spilled_bytes();
    assert!(before >= kept, "{kept} bytes kept, {before} leased");
    let mut sorter = buckets.sorter(sort_memory)?;
    assert_eq!(ws.budget.used(), before + sort_memory);
    let mut out = Vec::new();
    let mut end = keys.start;
    for b in 0..buckets.count() {
        let range = buckets.range(b);
        assert_eq!(range.start, end);
        end = range.end;
        buckets.sorted(b, &mut sorter, &mut |slice| {
            assert!(!slice.is_empty());
            assert!(slice.iter().all(|r| range.contains(&r.key(0))));
            out.extend_from_slice(slice);
            Ok(())
        })?;
    }
    assert_eq!(end, keys.end.max(keys.start));
    let did = Did {
        spilled: buckets.spilled_bytes(),
        splits: sorter.splits(),
        scratch: ws.scratch.peak(),
    };
    drop((buckets, sorter));
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    Ok((out, did))
}

/// A small generator with a fixed sequence.
fn numbers(seed: u64) -> impl FnMut() -> u64 {
    let mut x = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        x.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

/// How keys lie in their range.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Uniform,
    Equal,
    Hub,
    Ends,
    Ascending,
}

fn make(shape: Shape, n: usize, keys: &Range<u64>, seed: u64) -> Vec<Rec> {
    let mut next = numbers(seed);
    let width = keys.end - keys.start;
    let hub = keys.start + next() % width;
    let rec = |i: usize| {
        let (x, y) = (next(), next());
        let any = keys.start + x % width;
        let a = match shape {
            Shape::Uniform => any,
            Shape::Equal => hub,
            Shape::Hub if y % 10 > 0 => hub,
            Shape::Hub => any,
            Shape::Ends if y % 2 == 0 => keys.start + x % 3 % width,
            Shape::Ends => keys.end - 1 - x % 3 % width,
            Shape::Ascending => keys.start + (i as u64).min(width - 1),
        };
        let narrow = matches!(shape, Shape::Equal);
        let b = if narrow { 7 } else { (y >> 32) as u32 };
        let c = if narrow { 9 } else { (y >> 8) as u32 % 100 };
        Rec { a, b, c }
    };
    (0..n).map(rec).collect()
}

fn sorted<R: Record + Ord>(records: &[R]) -> Vec<R> {
    let mut all = records.to_vec();
    all.sort();
    all
}

fn plan(buckets: usize, buffer_bytes: usize) -> Plan {
    Plan {
        buckets,
        buffer_bytes,
        volume: 0,
    }
}

const LEAST: u64 = 64 << 10;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn equals_a_sort_for_any_plan(
        shape in prop::sample::select(vec![
            Shape::Uniform, Shape::Equal, Shape::Hub, Shape::Ends, Shape::Ascending,
        ]),
        n in 0usize..40_000,
        start in prop::sample::select(vec![0, 1, 12_345, u64::MAX - 1_000_000]),
        width in prop::sample::select(vec![1u64, 2, 1000, 65_536, 999_999]),
        writers in 1usize..5,
        buckets in prop::sample::select(vec![1usize, 2, 7, 64, 1000, 4096]),
        buffer in prop::sample::select(vec![1usize, 16, 100, 4096]),
        memory in prop::sample::select(vec![LEAST, LEAST + 1, 100_000, 300_000, 1 << 20, 8 << 20]),
        seed in any::<u64>(),
    ) {
        let keys = start..start + width;
        let records = make(shape, n, &keys, seed);
        // The smaller the buffers the more extents: keep their number testable.
        let buffer = if n > 5000 { buffer.max(256) } else { buffer };
        let most = (n * size_of::<Rec>()) as u64;
        let mut plan = plan(buckets, buffer);
        plan.volume = if seed % 2 == 0 { 0 } else { most };
        let (out, did) = run(&records, keys, writers, plan, memory).unwrap();
        prop_assert_eq!(out, sorted(&records));
        prop_assert!(did.spilled <= most);
        // Splitting any number of times holds the bucket once more, and part blocks.
        prop_assert!(did.scratch <= 2 * most + (8 << 20));
    }

    #[test]
    fn equals_a_sort_for_odd_records(
        records in prop::collection::vec((0u32..40, 0u32..9, any::<u32>()), 0..9000),
        buckets in 1usize..50,
        buffer in 1usize..5000,
        memory in prop::sample::select(vec![LEAST, 1 << 20]),
    ) {
        let odd: Vec<Odd> = records.iter().map(|&(a, b, c)| Odd([a, b, c])).collect();
        let (out, _) = run(&odd, 0..40, 2, plan(buckets, buffer.max(240)), memory).unwrap();
        prop_assert_eq!(out, sorted(&odd));
        let tiny = |&(a, b, c): &(u32, u32, u32)| Tiny([a as u8, b as u8, c as u8]);
        let tiny: Vec<Tiny> = records.iter().map(tiny).collect();
        let (out, _) = run(&tiny, 0..40, 3, plan(buckets, buffer.max(60)), memory).unwrap();
        prop_assert_eq!(out, sorted(&tiny));
    }
}

#[test]
fn keeps_a_little_in_memory_and_touches_no_disk() {
    let keys = 0..1000;
    let records = make(Shape::Uniform, 5000, &keys, 1);
    let (out, did) = run(&records, keys, 2, plan(64, 4096), 1 << 20).unwrap();
    assert_eq!(out, sorted(&records));
    assert_eq!((did.spilled, did.splits, did.scratch), (0, 0, 0));
}

#[test]
fn spills_everything_when_a_buffer_fills() {
    let keys = 0..1000;
    let records = make(Shape::Uniform, 200_000, &keys, 2);
    let (out, did) = run(&records, keys, 2, plan(64, 16 << 10), 4 << 20).unwrap();
    assert_eq!(out, sorted(&records));
    assert_eq!((did.spilled, did.splits), (200_000 * 16, 0));
    assert_eq!(did.scratch, did.spilled);
}

#[test]
fn splits_by_bits_by_levels_and_streams_what_is_equal() {
    let keys = 0..1 << 40;
    for (shape, least) in [
        (Shape::Uniform, 1),
        (Shape::Hub, 2),
        (Shape::Ends, 2),
        (Shape::Equal, 0),
    ] {
        let records = make(shape, 100_000, &keys, 3);
        let (out, did) = run(&records, keys.clone(), 1, plan(1, 4096), LEAST).unwrap();
        assert!(out == sorted(&records), "{shape:?}");
        assert!(did.splits >= least, "{shape:?}: {did:?}");
        if least == 0 {
            assert_eq!((did.splits, did.scratch), (0, did.spilled), "{shape:?}");
        }
        let most = 2 * did.spilled + did.spilled / 2;
        assert!(did.scratch <= most, "{shape:?}: {did:?}");
    }
}

#[test]
fn splits_keys_that_halve_each_time() {
    // Keys at powers of two: each cut parts only the greatest ones from the rest.
    let mut next = numbers(4);
    let records: Vec<Rec> = (0..60_000)
        .map(|i| Rec {
            a: (1 << (i % 60)) - 1,
            b: 1 << (next() % 32),
            c: next() as u32,
        })
        .collect();
    let (out, did) = run(&records, 0..1 << 60, 2, plan(1, 4096), LEAST).unwrap();
    assert_eq!(out, sorted(&records));
    assert!(did.splits > 10, "{did:?}");
}

#[test]
fn stops_at_errors_and_gives_all_back() {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 1 << 20);
    let new = || Shuffle::<Rec>::new(&ws, "test", 10..20, plan(4, 1024)).unwrap();
    let rec = |a| Rec { a, b: 0, c: 0 };

    let shuffle = new();
    let mut writer = shuffle.writer().unwrap();
    for a in [0, 9, 20, u64::MAX] {
        assert!(matches!(writer.push(rec(a)), Err(Error::Internal(_))));
    }
    writer.push(rec(10)).unwrap();
    writer.push(rec(19)).unwrap();
    drop(writer);
    let unfinished = shuffle.finish().err().unwrap().to_string();
    assert!(unfinished.contains("dropped unfinished"), "{unfinished}");

    let shuffle = new();
    let mut writer = shuffle.writer().unwrap();
    writer.push(rec(10)).unwrap();
    writer.finish().unwrap();
    let buckets = shuffle.finish().unwrap();
    match buckets.sorter(LEAST - 1).err() {
        Some(Error::Budget { need, have, .. }) => assert_eq!(need, have + 1),
        other => panic!("{other:?}"),
    }
    assert!(matches!(buckets.sorter(2 << 20), Err(Error::Budget { .. })));
    let mut sorter = buckets.sorter(LEAST).unwrap();
    let stop = buckets.sorted(0, &mut sorter, &mut |_| Err(Error::Usage("stop".into())));
    assert_eq!(stop.unwrap_err().to_string(), "stop");
    for b in [0, 4, u64::MAX] {
        let again = buckets.sorted(b, &mut sorter, &mut |_| Ok(()));
        assert!(matches!(again, Err(Error::Internal(_))));
    }
    drop((buckets, sorter));

    let small = Shuffle::<Rec>::new(&ws, "test", 0..1 << 20, plan(4096, 1024)).unwrap();
    assert!(matches!(small.writer(), Err(Error::Budget { .. })));
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
}

#[test]
fn frees_each_bucket_as_it_is_read() {
    for memory in [1 << 20, LEAST] {
        let dir = tempfile::tempdir().unwrap();
        let ws = workspace(&dir, 8 << 20);
        let shuffle = Shuffle::<Rec>::new(&ws, "test", 0..16, plan(16, 256)).unwrap();
        let mut writer = shuffle.writer().unwrap();
        for i in 0..160_000 {
            let (a, b) = (i % 16, i as u32);
            writer.push(Rec { a, b, c: 0 }).unwrap();
        }
        writer.finish().unwrap();
        let buckets = shuffle.finish().unwrap();
        let mut sorter = buckets.sorter(memory).unwrap();
        let mut used = ws.scratch.used();
        assert_eq!(used, 160_000 * 16);
        let frees = ws.scratch.file("probe").unwrap();
        let at = frees.reserve(1);
        frees.fill(&[1], at).unwrap();
        let frees = frees.free(at, 1);
        for b in 0..16 {
            let before = ws.scratch.used();
            let sink = &mut |_: &[Rec]| {
                // While a bucket that fits is handed on, its space is free already.
                let fits = memory > LEAST;
                assert!(!frees || !fits || ws.scratch.used() + 10_000 * 16 == before);
                Ok(())
            };
            buckets.sorted(b, &mut sorter, sink).unwrap();
            used -= 10_000 * 16;
            assert!(ws.scratch.used() == used || !frees);
        }
        assert_eq!(sorter.splits() > 0, memory == LEAST);
        assert_eq!(ws.scratch.used(), 0);
    }
}

#[test]
fn an_expected_volume_draws_nothing_while_it_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 8 << 20);
    let records = make(Shape::Hub, 300_000, &(0..1000), 9);
    let plan = Plan::of(64, 1 << 20, size_of::<Rec>(), records.len() as u64);
    let shuffle = Shuffle::<Rec>::new(&ws, "test", 0..1000, plan).unwrap();
    let mut writer = shuffle.writer().unwrap();
    let drawn = ws.budget.used();
    assert!(drawn <= plan.writer_bytes() && plan.writer_bytes() <= 1 << 20);
    for r in &records {
        writer.push(*r).unwrap();
        assert_eq!(ws.budget.used(), drawn);
    }
    writer.finish().unwrap();
    assert!(ws.budget.used() < 64 << 10, "{}", ws.budget.used());
    let buckets = shuffle.finish().unwrap();
    let mut sorter = buckets.sorter(1 << 20).unwrap();
    let mut out = Vec::new();
    let sink = &mut |slice: &[Rec]| {
        out.extend_from_slice(slice);
        Ok(())
    };
    buckets.sorted_all(&mut sorter, sink).unwrap();
    assert_eq!(out, sorted(&records));
    drop((buckets, sorter));
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
}

#[test]
fn covers_nearly_all_keys_there_are() {
    let keys = 0..u64::MAX;
    let records = make(Shape::Uniform, 20_000, &keys, 6);
    for buckets in [1, 2, 3, 100] {
        let (out, did) = run(&records, keys.clone(), 2, plan(buckets, 4096), LEAST).unwrap();
        assert_eq!(out, sorted(&records));
        assert_eq!(did.splits > 0, buckets < 4);
    }
}

#[test]
fn an_empty_range_has_no_bucket() {
    let (out, _) = run::<Rec>(&[], 5..5, 1, plan(8, 1024), LEAST).unwrap();
    assert!(out.is_empty());
}

#[test]
fn workers_share_buckets() {
    let dir = tempfile::tempdir().unwrap();
    let mut ws = workspace(&dir, 16 << 20);
    ws.workers = Workers::new(3).unwrap();
    let keys = 0..10_000;
    let records = make(Shape::Hub, 150_000, &keys, 5);
    let shuffle = Shuffle::new(&ws, "test", keys, plan(32, 4096)).unwrap();
    let piece = |w: &mut Writer<'_, Rec>, i: u64| {
        let part = &records[i as usize * 1000..][..1000];
        part.iter().try_for_each(|r| w.push(*r))
    };
    ws.workers
        .run(150, || shuffle.writer(), piece, Writer::finish)
        .unwrap();
    let buckets = shuffle.finish().unwrap();
    let out: Vec<std::sync::Mutex<Vec<Rec>>> = (0..32).map(|_| Default::default()).collect();
    let read = |s: &mut Sorter<Rec>, b: u64| {
        buckets.sorted(b, s, &mut |slice| {
            out[b as usize].lock().unwrap().extend_from_slice(slice);
            Ok(())
        })
    };
    ws.workers
        .run(buckets.count(), || buckets.sorter(LEAST), read, |_| Ok(()))
        .unwrap();
    let out: Vec<Rec> = out
        .into_iter()
        .flat_map(|m| m.into_inner().unwrap())
        .collect();
    assert_eq!(out, sorted(&records));
    drop(buckets);
    assert_eq!(ws.budget.used(), 0);
}
