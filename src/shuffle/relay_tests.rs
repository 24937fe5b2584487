//! The relay against a map from keys to records.

use super::*;
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers};
use proptest::prelude::*;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Rec([u32; 3]);

impl Record for Rec {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0[0].into()
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

/// Every record carries a number of hops and jumps `step` keys ahead until none are left;
/// compared with the same in a map from key to records.
fn run(keys: u32, shift: u32, memory: u64, first: &[(u32, u32)], step: u32) -> u64 {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 16 << 20);
    let mut relay = Relay::<Rec>::new(&ws, "test", 0..keys.into(), shift, memory).unwrap();
    let mut waiting = vec![Vec::new(); keys as usize];
    for (i, &(key, hops)) in first.iter().enumerate() {
        let record = Rec([key % keys, hops, i as u32]);
        relay.push(record).unwrap();
        waiting[(key % keys) as usize].push(record.0);
    }
    let mut block = relay.block();
    while let Some(range) = relay.advance().unwrap() {
        let mut looked = Vec::new();
        let mut cursor = relay.cursor();
        loop {
            let n = relay.read(&mut cursor, &mut block).unwrap();
            if n == 0 {
                break;
            }
            looked.extend(block[..n].iter().map(|r| r.0));
        }
        let mut taken = Vec::new();
        loop {
            let n = relay.take(&mut block).unwrap();
            if n == 0 {
                break;
            }
            for Rec([key, hops, id]) in block[..n].iter().copied() {
                taken.push([key, hops, id]);
                let to = u64::from(key) + (1 << shift) + u64::from(step * (id % 7));
                if hops > 0 && to < keys.into() {
                    relay.push(Rec([to as u32, hops - 1, id])).unwrap();
                    waiting[to as usize].push([to as u32, hops - 1, id]);
                }
            }
        }
        let mut expected: Vec<_> = range
            .flat_map(|key| waiting[key as usize].clone())
            .collect();
        expected.sort_unstable();
        looked.sort_unstable();
        taken.sort_unstable();
        assert_eq!(taken, expected);
        assert_eq!(looked, expected);
    }
    let poured = relay.poured();
    drop((relay, block));
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    poured
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn records_come_to_their_stops(
        keys in 1u32..3000,
        shift in 0u32..6,
        memory in 0u64..200_000,
        first in prop::collection::vec((any::<u32>(), 0u32..20), 0..400),
        step in 1u32..300,
    ) {
        run(keys, shift, memory, &first, step);
    }

    #[test]
    fn memory_is_kept_and_stops_have_slots(
        stops in 0u64..1 << 50,
        small in 0u32..50,
        memory in 100_000u64..1 << 34,
        record in 1u64..64,
    ) {
        let stops = stops >> small;
        let shape = Shape::within(stops, memory, record);
        prop_assert!(shape.bytes() <= memory, "{shape:?}");
        prop_assert!(u128::from(stops) <= 1u128 << (shape.levels * shape.bits));
        prop_assert!(shape.block_bytes >= footer_bytes(record) + record);
    }
}

#[test]
fn levels_pour_and_chains_grow() {
    let first: Vec<(u32, u32)> = (0..20_000u32).map(|i| (i * 7919, 9)).collect();
    assert_eq!(run(1000, 0, 8 << 20, &first, 5), 0);
    assert!(run(1000, 0, 1000, &first, 5) > 20_000);
    assert!(run(100_000, 0, 64 << 10, &first, 500) > 20_000);
}

#[test]
fn no_record_goes_back() {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 1 << 20);
    let mut relay = Relay::<Rec>::new(&ws, "test", 10..30, 2, 64 << 10).unwrap();
    assert!(relay.push(Rec([9, 0, 0])).is_err());
    assert!(relay.push(Rec([30, 0, 0])).is_err());
    relay.push(Rec([11, 0, 0])).unwrap();
    assert!(relay.take(&mut relay.block()).is_err());
    assert_eq!(relay.advance().unwrap(), Some(10..14));
    assert!(relay.push(Rec([13, 0, 0])).is_err());
    relay.push(Rec([14, 0, 0])).unwrap();
    let left = relay.advance().unwrap_err().to_string();
    assert!(left.contains("left with records"), "{left}");
}
