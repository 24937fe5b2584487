//! Soups made to hurt, under every cut of memory and corners.

use super::super::bits::Key;
use super::*;

/// Every way through the passes, for a soup of so many corners.
fn tunings(corners: usize) -> Vec<Tuning> {
    let windows = if corners > 1 << 12 {
        [None, Some(1 << 10), Some(1 << 15)]
    } else {
        [None, Some(64), Some(256)]
    };
    let mut all = Vec::new();
    for window in windows {
        for (filed, wide) in [(false, false), (true, false), (true, true)] {
            for threads in [1, 2, 3] {
                all.push(Tuning {
                    room: None,
                    longest_read: None,
                    window,
                    filed,
                    wide,
                    threads: Some(threads),
                });
            }
        }
    }
    all
}

/// Welds in every way, and holds the result to the naive one.
#[track_caller]
fn hold(corners: &[[u64; 3]], kind: CoordKind) {
    let corners = &corners[..corners.len() / 3 * 3];
    let expected = naive(corners, kind);
    for tuning in tunings(corners.len()) {
        // What a thread needs at least, and plenty.
        for memory in [3 * LEAST, 32 << 20] {
            // A window that was asked for must fit.
            if tuning.window.is_some_and(|window| window > memory >> 8) {
                continue;
            }
            let bench = Bench::new(memory);
            let wide = tuning.wide && tuning.window.is_none();
            let found = bench.soup(corners, kind, wide, tuning);
            assert!(found == expected, "{kind:?} {tuning:?} {memory}");
            assert!(bench.ws.budget.peak() <= memory);
        }
    }
}

fn mixed(i: u64) -> u64 {
    i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40
}

#[test]
fn a_hub_of_all_corners() {
    let minus = 1 << 31;
    let mut corners = vec![[0, minus, 3]; 30_000];
    corners[0] = [minus, 0, 3];
    hold(&corners, CoordKind::F4);
    hold(&corners[..300], CoordKind::F8);
}

#[test]
fn a_hub_that_no_block_sees_often() {
    // Nearly every corner is distinct, so blocks tell no repeats; every fourth is the hub.
    let at = |i: u64| match i % 4 {
        0 => [7, 7, 7],
        _ => [i, mixed(i), 1],
    };
    hold(&(0..60_000).map(at).collect::<Vec<_>>(), CoordKind::F4);
}

#[test]
fn a_soup_without_repeats() {
    let at = |i: u64| [i, mixed(i), i ^ 5];
    hold(&(1..40_000).map(at).collect::<Vec<_>>(), CoordKind::F4);
    hold(&(1..3_000).map(at).collect::<Vec<_>>(), CoordKind::F8);
}

#[test]
fn a_soup_in_random_order() {
    let at = |i: u64| {
        let i = mixed(i) % 9_000;
        [i, i / 7, 2]
    };
    hold(&(0..54_000).map(at).collect::<Vec<_>>(), CoordKind::F4);
}

#[test]
fn order_at_first_and_disorder_later() {
    let at = |i: u64| {
        let i = if i < 20_000 { i / 3 } else { mixed(i) % 9_000 };
        [i, 0, i % 3]
    };
    hold(&(0..50_000).map(at).collect::<Vec<_>>(), CoordKind::F4);
}

#[test]
fn hashes_that_lie_in_one_bucket() {
    let skewed = (0u64..).map(|i| [i as u32, (i >> 4) as u32, 9]);
    let skewed = skewed.filter(|at| at.hash() >> 58 == 0).take(8_000);
    let mut corners: Vec<_> = skewed.map(|at| at.map(u64::from)).collect();
    let again: Vec<_> = corners.iter().rev().step_by(2).copied().collect();
    corners.extend(again);
    hold(&corners, CoordKind::F4);
}

#[test]
fn zeros_and_nans_of_every_kind() {
    for kind in [CoordKind::F4, CoordKind::F8] {
        hold(&random(3_000, 60, kind, 21), kind);
        hold(&random(20_001, 3, kind, 22), kind);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_soup(
        ids in prop::collection::vec(0u64..200, 0..200),
        room in 1usize..40,
        window in 6u32..9,
        threads in 1u64..4,
        wide: bool,
        filed: bool,
    ) {
        let bench = Bench::new(3 * LEAST);
        for kind in [CoordKind::F4, CoordKind::F8] {
            let at = |&i: &u64| [tempting(i % 12, kind), tempting(i / 12, kind), i / 100];
            let corners: Vec<_> = ids.iter().map(at).collect();
            let corners = &corners[..corners.len() / 3 * 3];
            let tuning = Tuning {
                room: Some(room),
                longest_read: None,
                window: Some(1 << window),
                filed,
                wide,
                threads: Some(threads),
            };
            prop_assert_eq!(bench.soup(corners, kind, wide, tuning), naive(corners, kind));
        }
    }
}
