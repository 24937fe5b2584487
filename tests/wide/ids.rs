//! Operators, packed records and shuffles at wide ids.

use crate::CORNERS;
use crate::by_hand::workspace;
use bytemuck::Zeroable;
use cornermill::build::records::{EdgeCorner, Link, Patch, narrow};
use cornermill::corner::{Corner, Index, Triangle};
use cornermill::folder::fits_u4;
use cornermill::shuffle::{Plan, Record, Shuffle};

/// Ids on both sides of every power of two from 2^28 to 2^55.
fn around() -> impl Iterator<Item = u64> {
    (28..56).flat_map(|bits| (1u64 << bits) - 4..(1 << bits) + 4)
}

#[test]
fn operators_go_round_a_triangle_at_every_size() {
    for c in around().chain([0, u64::MAX / 3 * 3 - 4]) {
        let (t, k) = (c / 3, c % 3);
        let corner = Corner::new(c);
        assert_eq!((corner.t(), corner.k()), (Triangle::new(t), k as usize));
        let wide = |k: u64| (3 * u128::from(t) + u128::from(k % 3)) as u64;
        assert_eq!(corner.n().id(), wide(k + 1), "{c}.n");
        assert_eq!(corner.p().id(), wide(k + 2), "{c}.p");
        let all = Triangle::new(t).corners().map(Corner::id);
        assert_eq!(all, [wide(0), wide(1), wide(2)]);
    }
}

/// Packs and unpacks records of two triangles.
fn records_hold<W: Index>(t: u64, u: u64, vertices: (u64, u64)) {
    for bits in 0..4 {
        let (flipped, down) = (bits & 1 == 1, bits & 2 == 2);
        for k in 0..3 {
            let one = EdgeCorner::<W>::new(vertices, t, k, flipped, t, down);
            assert_eq!(one.edge(), vertices);
            assert_eq!((one.triangle(), one.place(), one.local()), (t, k, t));
            assert_eq!((one.flipped(), one.down()), (flipped, down));
            assert_eq!((one.key(0), one.key(1)), vertices);
            let other = EdgeCorner::<W>::new(vertices, u, 2 - k, down, u, flipped);
            let patch = Patch::<W>::new(one.corner(), other.corner(), down);
            assert_eq!(patch.at(), (t, k as usize));
            assert_eq!((patch.to(), patch.parity()), ((u, 2 - k as usize), down));
            assert_eq!(patch.key(0), t);
            assert_eq!(Link::<W>::new(t, u, down).get(), (t, u, down));
        }
    }
}

#[test]
fn records_hold_what_their_width_is_chosen_for() {
    for t in around() {
        for vertices in [(0, 1), (t, t + 1), ((1 << 56) - 2, (1 << 56) - 1)] {
            records_hold::<u64>(t, t + 1, vertices);
            records_hold::<u64>(t + 1, t, vertices);
        }
    }
    // The largest mesh whose records have 4 bytes a field: its last triangle and vertices.
    let (triangles, vertices) = ((1 << 29) - 1, u64::from(u32::MAX) - 1);
    assert!(narrow(triangles, vertices));
    assert!(!narrow(triangles + 1, vertices) && !narrow(triangles, vertices + 1));
    records_hold::<u32>(triangles - 1, triangles - 2, (vertices - 2, vertices - 1));
}

#[test]
fn ids_of_4_bytes_end_below_none() {
    let none = u64::from(u32::MAX);
    let most = (none - 1) / 3;
    // The number of corners stays below NONE too, as that of the vertices does.
    assert!(3 * most < none && 3 * (most + 1) >= none);
    assert!(fits_u4(most, none - 1));
    assert!(!fits_u4(most + 1, 3) && !fits_u4(1, none));
    for corners in CORNERS {
        assert_eq!(fits_u4(corners / 3, corners / 6), corners < 1 << 32);
    }
}

#[test]
fn a_shuffle_sorts_keys_around_every_boundary() {
    let dir = tempfile::tempdir().expect("a temporary directory");
    for top in [1u64 << 31, 1 << 32, (1 << 33) + 5, 1 << 56] {
        for buckets in [1, 7, 1024] {
            let ws = workspace(dir.path(), 16 << 20);
            let plan = Plan {
                buckets,
                buffer_bytes: 512,
                ..Plan::within(1 << 20, 1, 32, 20_000, 1 << 20)
            };
            let shuffle = Shuffle::<EdgeCorner<u64>>::new(&ws, "test", 0..top, plan).unwrap();
            let mut keys: Vec<u64> = around().filter(|&key| key < top).collect();
            keys.extend([0, top - 1]);
            // Scattered, and often enough that buffers fill.
            let all = (0..20_000).map(|i| keys[i * 7919 % keys.len()]);
            let mut expected: Vec<u64> = all.clone().collect();
            let mut writer = shuffle.writer().unwrap();
            for key in all {
                let record = EdgeCorner::new((key, key), key >> 3, key % 3, false, 0, false);
                writer.push(record).unwrap();
            }
            writer.finish().unwrap();
            let sorted = shuffle.finish().unwrap();
            let mut sorter = sorted.sorter(1 << 20).unwrap();
            let mut found = Vec::new();
            let take = &mut |records: &[EdgeCorner<u64>]| {
                found.extend(records.iter().map(|r| r.edge().0));
                Ok(())
            };
            sorted.sorted_all(&mut sorter, take).unwrap();
            expected.sort();
            assert!(found == expected, "keys below {top}, {buckets} buckets");
        }
    }
    assert_eq!(EdgeCorner::<u64>::zeroed().edge(), (0, 0));
}
