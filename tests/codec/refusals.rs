//! Files that are cut short, changed, or none of ours: an error that names the file, no panic, no
//! memory beyond the budget, nothing that looks like a mesh.

use super::common::bench;
use super::{Case, told_apart, workspace};
use cornermill::Error;
use cornermill::build::IndexChoice;
use cornermill::codec::Level;
use cornermill::codec::decode::decode;
use cornermill::codec::file::Packed;
use cornermill::codec::grid::Precision;

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
