//! Every bit of a folder that `build` made: flipped behind old checksums, and behind right ones.

use crate::{check, said};
use cornermill::build::{Builder, IndexChoice};
use cornermill::folder::{self, ComponentMeasures, ComponentRow, Manifest};
use cornermill::verify::{Limits, least_memory};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use xxhash_rust::xxh3::xxh3_64;

/// A tetrahedron turned over in part, a square, a third triangle on an edge of it and a twin, two
/// triangles that touch at a vertex, one that names a vertex twice.
const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 6 1 0\n\
    v 5 0 2\nv 8 8 8\nv 9 8 8\nf 1 3 2\nf 1 4 2\nf 2 3 4\nf 3 1 4\nf 5 6 7\nf 6 7 8\nf 5 6 9\n\
    f 8 10 11\nf 8 11 10\nf 2 2 3\n";

/// Where the area of a component lies in its row.
const AREA: std::ops::Range<usize> = 60..68;

struct Built {
    dir: TempDir,
    folder: PathBuf,
}

fn built(index: IndexChoice) -> Built {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, folder) = (dir.path().join("m.obj"), dir.path().join("m.ct"));
    fs::write(&mesh, MESH).unwrap();
    let builder = Builder::new(mesh).memory(16 << 20).threads(1);
    builder.index(index).build(&folder).unwrap();
    Built { dir, folder }
}

/// True when `verify` finds nothing; a folder whose manifest cannot be read does not pass.
fn passes(folder: &Path) -> bool {
    let checked = check(folder, least_memory(1), 1, Limits::default());
    checked.is_ok_and(|verdict| verdict.ok())
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let items = fs::read_dir(folder).unwrap();
    items.map(|item| item.unwrap().path()).collect()
}

#[test]
fn notices_every_flipped_bit_of_a_folder() {
    let Built { dir: _dir, folder } = built(IndexChoice::Auto);
    assert!(passes(&folder));
    for path in files(&folder) {
        let sound = fs::read(&path).unwrap();
        let mut bytes = sound.clone();
        for at in 0..sound.len() {
            // Headers are compared byte by byte: one bit of each, of every seventh blank.
            let header = path.extension().unwrap() == "npy" && at < 4096;
            let blank = header && sound[at] == b' ' && at % 7 != 0;
            let bits = match (header, blank) {
                (_, true) => 0..0,
                (true, false) => at % 8..at % 8 + 1,
                (false, _) => 0..8,
            };
            for bit in bits {
                bytes[at] = sound[at] ^ 1 << bit;
                fs::write(&path, &bytes).unwrap();
                assert!(!passes(&folder), "bit {bit} of byte {at} of {path:?}");
            }
            bytes[at] = sound[at];
        }
        fs::write(&path, &sound).unwrap();
    }
    assert!(passes(&folder));
}

/// Gives the manifest the checksums of what is there.
fn seal(folder: &Path, manifest: &Manifest) {
    let mut manifest = manifest.clone();
    for entry in &mut manifest.files {
        let bytes = fs::read(folder.join(&entry.name)).unwrap();
        entry.blocks = vec![format!("{:016x}", xxh3_64(&bytes))];
    }
    fs::write(folder.join(folder::MANIFEST), manifest.to_text()).unwrap();
}

/// All that follows from V, G and the bits: whatever bit of it is flipped, no checksum is needed.
/// The area is aside: `verify` sums it anew in its own way, and holds it to a bound on rounding.
#[test]
fn notices_every_flipped_bit_behind_right_checksums() {
    for index in [IndexChoice::Auto, IndexChoice::U8] {
        let Built { dir: _dir, folder } = built(index);
        let manifest = Manifest::read(&folder).unwrap();
        for path in files(&folder) {
            let name = path.file_name().unwrap().to_str().unwrap();
            if [folder::MANIFEST, folder::V, folder::G, folder::FLIPPED].contains(&name) {
                continue;
            }
            let sound = fs::read(&path).unwrap();
            let mut bytes = sound.clone();
            let row = size_of::<ComponentRow>() + size_of::<ComponentMeasures>();
            let exact =
                |&at: &usize| name != folder::COMPONENTS || !AREA.contains(&((at - 4096) % row));
            for at in (4096..sound.len()).filter(exact) {
                // Of the wide folder's bytes one bit each, in turn.
                let wide = index == IndexChoice::U8;
                for bit in if wide { at % 8..at % 8 + 1 } else { 0..8 } {
                    bytes[at] = sound[at] ^ 1 << bit;
                    fs::write(&path, &bytes).unwrap();
                    seal(&folder, &manifest);
                    assert!(!passes(&folder), "bit {bit} of byte {at} of {name}");
                }
                bytes[at] = sound[at];
            }
            fs::write(&path, &sound).unwrap();
        }
        seal(&folder, &manifest);
        assert!(passes(&folder));
    }
}

/// Each number of the manifest, one more and one less, behind a right checksum of the text.
#[test]
fn notices_every_wrong_number_of_the_manifest() {
    let Built { dir: _dir, folder } = built(IndexChoice::Auto);
    let path = folder.join(folder::MANIFEST);
    let text = fs::read_to_string(&path).unwrap();
    let sound: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut tried = 0;
    for part in ["counts", "measures"] {
        for key in sound[part].as_object().unwrap().keys() {
            // What the input was is not in the folder.
            let Some(number) = sound[part][key]
                .as_i64()
                .filter(|_| key != "polygons_fanned")
            else {
                continue;
            };
            for other in [number + 1, number - 1, i64::MAX] {
                let mut changed = sound.clone();
                changed[part][key] = other.into();
                let Ok(manifest) = serde_json::from_value::<Manifest>(changed) else {
                    continue;
                };
                fs::write(&path, manifest.to_text()).unwrap();
                assert!(!passes(&folder), "{part}.{key} is {other}");
                tried += 1;
            }
        }
    }
    assert!(tried > 60, "{tried}");
}

#[test]
fn notices_random_flipped_bits_of_a_larger_folder() {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, folder) = (dir.path().join("m.off"), dir.path().join("m.ct"));
    let (points, faces) = grid(60);
    let count = (points.lines().count(), faces.lines().count());
    let text = format!("OFF\n{} {} 0\n{points}{faces}", count.0, count.1);
    fs::write(&mesh, text).unwrap();
    let builder = Builder::new(mesh).memory(16 << 20).threads(1);
    builder.build(&folder).unwrap();
    let mut random = crate::meshes::generator(11);
    for path in files(&folder) {
        let sound = fs::read(&path).unwrap();
        for _ in 0..25 {
            let bit = random(8 * sound.len() as u64) as usize;
            let mut bytes = sound.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            fs::write(&path, &bytes).unwrap();
            assert!(!passes(&folder), "bit {bit} of {path:?}");
        }
        fs::write(&path, &sound).unwrap();
    }
    let verdict = check(&folder, 16 << 20, 1, Limits::default()).unwrap();
    assert!(verdict.ok(), "{}", said(&verdict));
}

/// A hilly square of `n` by `n` fields, as the lines of an OFF file.
fn grid(n: u64) -> (String, String) {
    let place = |x: u64, y: u64| y * (n + 1) + x;
    let (mut points, mut faces) = (String::new(), String::new());
    for (x, y) in (0..=n).flat_map(|y| (0..=n).map(move |x| (x, y))) {
        points += &format!("{x} {y} {}\n", x * y % 7);
    }
    for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
        let corners = [
            place(x, y),
            place(x + 1, y),
            place(x + 1, y + 1),
            place(x, y + 1),
        ];
        faces += &format!(
            "4 {} {} {} {}\n",
            corners[0], corners[1], corners[2], corners[3]
        );
    }
    (points, faces)
}
