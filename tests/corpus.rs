//! The fuzz targets on stable Rust: every target over its kept corpus, and over small files of
//! its format, cut at every byte and with every bit flipped. A target panics when an end is
//! neither a plain refusal nor a right result (`fuzz/src/lib.rs`).

#[path = "../fuzz/src/lib.rs"]
mod fuzz;

use std::path::{Path, PathBuf};

fn corpus(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR"));
    let dir = dir.join("fuzz/corpus").join(target);
    let items = std::fs::read_dir(&dir).expect("the corpus of a target");
    let mut paths: Vec<_> = items.map(|i| i.expect("an entry").path()).collect();
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let data = std::fs::read(&path).expect("an input");
            (path, data)
        })
        .collect()
}

/// Runs a target, and says which input it was when it panics.
fn run(run: fn(&[u8]), what: &str, data: &[u8]) {
    let held = std::panic::catch_unwind(|| run(data));
    assert!(held.is_ok(), "{what}: {}", data.escape_ascii());
}

#[test]
fn every_input_of_the_corpus_ends_in_order() {
    let mut bytes = 0;
    for (name, target) in fuzz::TARGETS {
        let inputs = corpus(name);
        assert!(inputs.len() > 2, "{name} has no corpus");
        for (path, data) in inputs {
            bytes += data.len();
            run(target, &path.display().to_string(), &data);
        }
    }
    assert!(bytes < 3 << 20, "a corpus of {bytes} bytes; minimise it");
}

/// A file cut at every byte, and with each bit of each byte flipped, and each byte at its extremes.
fn damaged(name: &str, target: fn(&[u8]), data: &[u8]) {
    run(target, name, data);
    for length in 0..data.len() {
        run(target, &format!("{name} cut to {length}"), &data[..length]);
    }
    let mut changed = data.to_vec();
    for at in 0..data.len() {
        let flips = (0..8).map(|bit| data[at] ^ 1 << bit);
        for value in flips.chain([0, 0xff, b'-', b'9', b'\n']) {
            changed[at] = value;
            run(target, &format!("{name}, byte {at} is {value}"), &changed);
        }
        changed[at] = data[at];
    }
}

const PLY: &str = "element vertex 3\nproperty float x\nproperty double y\nproperty uchar z\n\
    element face 1\nproperty list uchar ushort vertex_indices\nend_header\n";

#[test]
fn damaged_ply_ends_in_order() {
    let text = format!("ply\nformat ascii 1.0\ncomment c\n{PLY}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    damaged("ascii", fuzz::ply, text.as_bytes());
    for order in ["little", "big"] {
        let header = format!("ply\nformat binary_{order}_endian 1.0\n{PLY}");
        let mut data = header.into_bytes();
        for [x, y, z] in [[0., 0., 0.], [1., 0., 0.], [0., 1., 7.0f32]] {
            let (mut x, mut y) = (x.to_le_bytes(), f64::from(y).to_le_bytes());
            if order == "big" {
                x.reverse();
                y.reverse();
            }
            data.extend(x.iter().chain(&y).chain(&[z as u8]));
        }
        data.push(3);
        for id in 0..3u16 {
            data.extend(if order == "big" {
                id.to_be_bytes()
            } else {
                id.to_le_bytes()
            });
        }
        damaged(order, fuzz::ply, &data);
    }
}

#[test]
fn damaged_stl_ends_in_order() {
    let text = "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1e0 0 0\n\
        vertex 0 1 -0\nendloop\nendfacet\nendsolid a\n";
    damaged("ascii", fuzz::stl, text.as_bytes());
    let mut data = [0; 80].to_vec();
    data.extend(2u32.to_le_bytes());
    for facet in 0..2u8 {
        let floats = (0..12).map(|i| if i == 3 + 4 * facet { 1.0f32 } else { 0.0 });
        data.extend(floats.flat_map(f32::to_le_bytes).chain([0, 0]));
    }
    damaged("binary", fuzz::stl, &data);
}

#[test]
fn damaged_text_ends_in_order() {
    let obj = "# c\no x\nv 0 0 0 1\nv 1 0 0\nv 0 1e-3 0 \\\n\nvn 0 0 1\nvt 0 0\ns off\n\
        f 1/1/1 2//1 3/1\nf -1 -2 -3 1\n";
    damaged("obj", fuzz::obj, obj.as_bytes());
    let off = "COFF\n# c\n4 2 0\n0 0 0 1 1 1 1\n1 0 0 0 0 0 1\n0 1 0 0 0 0 1\n0 0 1 1 0 0 1\n\
        3 0 1 2\n4 3 2 1 0 255 0 0\n";
    damaged("off", fuzz::off, off.as_bytes());
}

#[test]
fn damaged_arrays_end_in_order() {
    for (path, data) in corpus("npy") {
        let name = path.file_name().expect("a name").to_string_lossy();
        // NumPy pads headers with blanks; they are passed over here, and flipped in one file.
        if ["le_u4", "be_i8", "vg_le_f8", "raw_u4"]
            .iter()
            .any(|n| name.contains(n))
        {
            for length in 0..data.len() {
                run(
                    fuzz::npy,
                    &format!("{name} cut to {length}"),
                    &data[..length],
                );
            }
            let mut changed = data.clone();
            for at in (0..data.len()).filter(|&at| data[at] != b' ' || at % 16 == 0) {
                // Each is a build: one bit of a byte, in turn, and its lowest.
                for bit in [0, at % 8] {
                    changed[at] = data[at] ^ 1 << bit;
                    run(fuzz::npy, &format!("{name}, bit {bit} of {at}"), &changed);
                }
                changed[at] = data[at];
            }
        }
    }
}

/// Each both as it is and behind right checksums.
#[test]
fn damaged_compressed_files_end_in_order() {
    for (path, data) in corpus("cmz") {
        let name = path.file_name().expect("a name").to_string_lossy();
        if name.starts_with("small_t") {
            damaged(&name, fuzz::cmz, &data);
        }
    }
}
