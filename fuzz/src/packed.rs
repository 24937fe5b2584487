//! The compressed file, damaged behind right checksums: the decoder is told what no encoder
//! says, and must end in order.

use super::place::{Place, sane};
use cornermill::codec::decode::decode;
use cornermill::codec::file::{Entry, MAGIC};
use cornermill::codec::packed::Packed;
use cornermill::codec::part::{Part, decode_part};
use std::cell::OnceCell;
use xxhash_rust::xxh3::xxh3_64;

const HEAD: usize = 72;
const TAIL: usize = 32;
const ENTRY: usize = size_of::<Entry>();

thread_local! {
    static PLACE: OnceCell<Place> = const { OnceCell::new() };
}

/// A file, first as it is, then with the marks and checksums that its bytes ask for.
pub fn cmz(data: &[u8]) {
    PLACE.with(|place| {
        let place = place.get_or_init(|| Place::new(16 << 20));
        unpack(place, data);
        if let Some(sealed) = sealed(data) {
            unpack(place, &sealed);
        }
    });
}

fn unpack(place: &Place, data: &[u8]) {
    let path = place.put("m.cmz", data);
    let (v, g) = (place.path("V.npy"), place.path("G.npy"));
    match Packed::open(&place.ws.budget, &place.ws.io, &path) {
        Ok(packed) => {
            packed.describe().expect("an index tells what it says");
            match decode(&place.ws, &packed, &v, &g) {
                Ok(count) => {
                    assert_eq!(count.triangles, packed.head.triangles);
                    in_bounds(&v, count.triangles, count.vertices);
                }
                Err(error) => sane(&error),
            }
            place.clear("V.npy");
            place.clear("G.npy");
            // Every other component, which reads little and numbers anew.
            let odd =
                |range: std::ops::Range<u64>| !range.is_empty() && range.end.is_multiple_of(2);
            let part = Part {
                chunks: (0..packed.entries.len()).collect(),
                component: Some(&odd),
            };
            match decode_part(&place.ws, &packed, &part, &v, &g) {
                Ok(count) => in_bounds(&v, count.triangles, count.vertices),
                Err(error) => sane(&error),
            }
        }
        Err(error) => sane(&error),
    }
    place.clear("V.npy");
    place.clear("G.npy");
    place.settled();
}

/// Every index names a vertex.
fn in_bounds(v: &std::path::Path, triangles: u64, vertices: u64) {
    let bytes = std::fs::read(v).expect("V reads back");
    let ids = &bytes[4096..];
    if triangles > 0 && ids.len() as u64 == triangles * 12 {
        let ids = ids.as_chunks::<4>().0.iter();
        assert!(
            ids.map(|&b| u32::from_le_bytes(b))
                .all(|v| u64::from(v) < vertices)
        );
    }
}

/// The same bytes with marks, places and checksums put right.
fn sealed(data: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = data.to_vec();
    let tail_at = bytes.len().checked_sub(TAIL).filter(|&at| at >= HEAD)?;
    bytes[..8].copy_from_slice(&MAGIC);
    bytes[8..12].copy_from_slice(&1u32.to_le_bytes());
    let sum = xxh3_64(&bytes[..HEAD - 8]);
    bytes[HEAD - 8..HEAD].copy_from_slice(&sum.to_le_bytes());
    let word = |bytes: &[u8], at: usize| {
        let word = bytes[at..].first_chunk().expect("eight bytes");
        u64::from_le_bytes(*word)
    };
    let most = ((tail_at - HEAD) / ENTRY) as u64;
    let chunks = word(&bytes, tail_at + 8).min(most);
    let index_at = tail_at - chunks as usize * ENTRY;
    let mut at = HEAD;
    for chunk in 0..chunks as usize {
        let entry = index_at + chunk * ENTRY;
        let last = chunk + 1 == chunks as usize;
        let rest = (index_at - at) as u64;
        let body = word(&bytes, entry + 8).min(rest);
        let after = word(&bytes, entry + 16).min(rest - body);
        let numbers = word(&bytes, entry + 24).min(rest - body - after);
        let labels = word(&bytes, entry + 32).min(rest - body - after - numbers);
        // The last chunk has what is left.
        let body = if last {
            rest - after - numbers - labels
        } else {
            body
        };
        let middle = at + (body + after + numbers) as usize;
        let end = middle + labels as usize;
        let (sum, label_sum) = (xxh3_64(&bytes[at..middle]), xxh3_64(&bytes[middle..end]));
        let mut put = |place: usize, word: u64| {
            bytes[entry + place..entry + place + 8].copy_from_slice(&word.to_le_bytes());
        };
        put(0, at as u64);
        put(8, body);
        put(16, after);
        put(24, numbers);
        put(32, labels);
        put(ENTRY - 16, sum);
        put(ENTRY - 8, label_sum);
        at = end;
    }
    let sum = xxh3_64(&bytes[index_at..tail_at]);
    let tail = [
        index_at as u64,
        chunks,
        sum,
        u64::from_le_bytes(*b"CMZ end\n"),
    ];
    bytes[tail_at..].copy_from_slice(bytemuck::cast_slice(&tail));
    Some(bytes)
}
