//! Files that are cut short, changed, or none of ours: an error that names the file, no panic, no
//! memory beyond the budget, nothing that looks like a mesh.

use super::common::bench;
use super::{Case, told_apart, workspace};
use cornermill::Error;
use cornermill::build::IndexChoice;
use cornermill::codec::Level;
use cornermill::codec::decode::decode;
use cornermill::codec::encode::{EncodeRequest, encode};
use cornermill::codec::file::Entry;
use cornermill::codec::grid::Precision;
use cornermill::codec::packed::Packed;
use cornermill::disk::Counters;
use cornermill::folder::Folder;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_64;

/// Opens and decodes bytes; what went wrong, if anything did.
fn opened(case: &Case, bytes: &[u8]) -> Result<(), Error> {
    let path = case.path("bad.cmz");
    std::fs::write(&path, bytes).unwrap();
    let ws = workspace(case.dir.path(), 32 << 20, 1);
    let packed = Packed::open(&ws.budget, &ws.io, &path)?;
    let (v, g) = (case.path("bad.V.npy"), case.path("bad.G.npy"));
    [&v, &g].iter().for_each(|f| _ = std::fs::remove_file(f));
    decode(&ws, &packed, &v, &g).map(|_| ())
}

/// A small file of several chunks.
fn small() -> (Case, Vec<u8>) {
    let case = Case::new(&told_apart(bench::mixture(3)), IndexChoice::Auto);
    case.encode(
        "m.cmz",
        (Precision::Bits(9), Level::Fast, 40),
        (64 << 20, 1),
    );
    let bytes = std::fs::read(case.path("m.cmz")).unwrap();
    opened(&case, &bytes).unwrap();
    (case, bytes)
}

/// The entries of a file.
fn entries(file: &[u8]) -> Vec<Entry> {
    let tail = file.len() - 32;
    let index_at = u64::from_le_bytes(*file[tail..].first_chunk().expect("eight bytes"));
    file[index_at as usize..tail]
        .chunks_exact(size_of::<Entry>())
        .map(bytemuck::pod_read_unaligned)
        .collect()
}

/// The numbers and the components of a chunk.
fn kept(file: &[u8], entry: &Entry) -> [Vec<u8>; 2] {
    let numbers = (entry.at + entry.bytes + entry.reference_bytes) as usize;
    let labels = numbers + entry.number_bytes as usize;
    let end = labels + entry.label_bytes as usize;
    [numbers..labels, labels..end].map(|part| file[part].to_vec())
}

/// The file with other numbers or components of its chunks; its sums are right.
fn rebuilt(file: &[u8], change: impl Fn(usize, [Vec<u8>; 2]) -> [Vec<u8>; 2]) -> Vec<u8> {
    let mut out = file[..72].to_vec();
    let mut index = Vec::new();
    for (chunk, mut entry) in entries(file).into_iter().enumerate() {
        let coded = &file[entry.at as usize..][..(entry.bytes + entry.reference_bytes) as usize];
        let [numbers, labels] = change(chunk, kept(file, &entry));
        let body = [coded, &numbers].concat();
        entry.at = out.len() as u64;
        (entry.number_bytes, entry.label_bytes) = (numbers.len() as u64, labels.len() as u64);
        (entry.sum, entry.label_sum) = (xxh3_64(&body), xxh3_64(&labels));
        out.extend(body);
        out.extend(labels);
        index.extend(bytemuck::bytes_of(&entry));
    }
    let chunks = (index.len() / size_of::<Entry>()) as u64;
    let tail = [out.len() as u64, chunks, xxh3_64(&index)];
    out.extend(index);
    out.extend(tail.iter().flat_map(|w| w.to_le_bytes()));
    out.extend(b"CMZ end\n");
    out
}

/// A file that keeps an order, in which a chunk has the numbers of another.
pub fn with_numbers_twice(file: &[u8]) -> Vec<u8> {
    let entries = entries(file);
    let size = |e: &Entry| (e.all_triangles(), e.vertices);
    let pairs = (0..entries.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let mut same = pairs.filter(|&(i, j)| size(&entries[i]) == size(&entries[j]));
    let (i, j) = same.next().expect("two chunks of one size");
    rebuilt(file, |chunk, [numbers, labels]| match chunk == i {
        true => [kept(file, &entries[j])[0].clone(), labels],
        false => [numbers, labels],
    })
}

/// What is read of a chunk is drawn from the budget, though nobody asked for it.
#[test]
fn components_of_a_chunk_are_within_the_budget() {
    let (case, bytes) = small();
    let many = entries(&bytes).iter().position(|e| e.label_bytes > 0);
    let many = many.expect("a chunk of several components");
    let long = rebuilt(&bytes, |chunk, [numbers, mut labels]| {
        let more = usize::from(chunk == many) * (40 << 20);
        labels.resize(labels.len() + more, 0);
        [numbers, labels]
    });
    assert!(long.len() > 40 << 20);
    // In 32 MiB.
    match opened(&case, &long) {
        Err(Error::Budget { need, .. }) => assert!(need > 40 << 20, "{need}"),
        other => panic!("{other:?}"),
    }
}

fn is_refused(case: &Case, bytes: &[u8], how: &str) {
    match opened(case, bytes) {
        Err(Error::Input(bad)) => assert!(bad.path.ends_with("bad.cmz"), "{how}: {bad}"),
        other => panic!("{how}: {other:?}"),
    }
}

#[test]
fn cut_at_every_byte() {
    let (case, bytes) = small();
    for len in 0..bytes.len() {
        is_refused(&case, &bytes[..len], &format!("cut at {len}"));
    }
    is_refused(&case, &[&bytes[..], &[0]].concat(), "a byte more");
}

#[test]
fn a_bit_flipped_in_every_byte() {
    let (case, mut bytes) = small();
    for at in 0..bytes.len() {
        bytes[at] ^= 1 << (at % 8);
        is_refused(&case, &bytes, &format!("byte {at} changed"));
        bytes[at] ^= 1 << (at % 8);
    }
}

#[test]
fn other_files_are_none_of_ours() {
    let (case, bytes) = small();
    is_refused(&case, b"ply\nformat ascii 1.0\n", "a PLY file");
    is_refused(&case, &[0; 500], "zeros");
    let twice = [&bytes[..], &bytes].concat();
    is_refused(&case, &twice, "two files in one");
}

/// Refused in 1 MiB; in what that names it is encoded, and the bytes are those of ample memory.
#[test]
fn the_least_budget_that_is_named_suffices() {
    for (size, most) in [(3, 40), (3, 1 << 20), (40, 900), (40, 20_000)] {
        let case = Case::new(&told_apart(bench::mixture(size)), IndexChoice::Auto);
        let folder = Folder::open(&case.folder, &Arc::new(Counters::default())).unwrap();
        let mut request = EncodeRequest::new(case.path("m.cmz"), Precision::Bits(12));
        (request.most, request.force) = (most, true);
        for threads in [1, 2] {
            let encoded = |memory| {
                let ws = workspace(case.dir.path(), memory, threads);
                let count = encode(&ws, &folder, &request)?;
                assert!(ws.budget.peak() <= memory);
                Ok((count, std::fs::read(case.path("m.cmz")).unwrap()))
            };
            let how = format!("size {size}, chunks of {most}, {threads} threads");
            let need = match encoded(1 << 20) {
                Err(Error::Budget { need, .. }) => need,
                other => panic!("{how}: {other:?}"),
            };
            let least = encoded(need).unwrap_or_else(|e| panic!("{how}: {e}"));
            assert!(least == encoded(256 << 20).unwrap(), "{how}: other bytes");
            let counts = &folder.manifest().counts;
            let tight = (12 << 20) + 500 * (counts.triangles + counts.vertices);
            assert!(
                need < tight,
                "{how}: {need} bytes is far more than that takes"
            );
        }
    }
}

/// The dealing fits, the chunk does not: the second figure suffices.
#[test]
fn a_chunk_that_does_not_fit_is_refused_with_what_suffices() {
    let case = Case::new(&told_apart(bench::mixture(60)), IndexChoice::Auto);
    let folder = Folder::open(&case.folder, &Arc::new(Counters::default())).unwrap();
    let request = EncodeRequest::new(case.path("m.cmz"), Precision::Bits(12));
    let refused = |memory| {
        let ws = workspace(case.dir.path(), memory, 1);
        match encode(&ws, &folder, &request) {
            Err(Error::Budget { need, what, .. }) => Some((need, what)),
            done => {
                done.unwrap();
                None
            }
        }
    };
    let (need, what) = refused(4 << 20).expect("too little");
    assert_eq!(what, "coding a chunk");
    assert_eq!(refused(need), None);
}
