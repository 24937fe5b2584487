//! A binary STL file of several blocks, read by one process after the other.

use super::*;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers};
use std::sync::Arc;

/// Each process takes a block or two and stops; then one is killed behind what it wrote down.
#[test]
fn a_long_file_is_gone_on_with_between_blocks() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    for name in ["scratch", "out"] {
        std::fs::create_dir(dir.join(name)).unwrap();
    }
    let path = dir.join("test.stl");
    // Facets of zeros, but for some at the beginning and the end of blocks.
    let facets = 7 * BLOCK / 2 / FACET as u64;
    let file = std::fs::File::create(&path).unwrap();
    file.set_len(HEAD + facets * FACET as u64).unwrap();
    let put = |bytes: &[u8], at| std::os::unix::fs::FileExt::write_all_at(&file, bytes, at);
    put(&(facets as u32).to_le_bytes(), 80).unwrap();
    for (i, block) in (0..7u8).zip((0..).step_by(BLOCK as usize / 2)) {
        let facet = (block / FACET as u64).min(facets - 1);
        put(&[i + 1; 48], HEAD + facet * FACET as u64).unwrap();
    }
    let process = || {
        let io = Arc::new(Counters::default());
        let rooms = [dir.join("scratch")];
        Workspace {
            budget: Budget::new(16 << 20),
            scratch: Scratch::named(&rooms, u64::MAX, &io, &dir.join("state")).unwrap(),
            io,
            workers: Workers::new(2).unwrap(),
            progress: Arc::new(NoProgress),
        }
    };
    let mut request = request(dir, &path);
    request.g_path = dir.join("out/G.npy");
    let begin = |ws: &Workspace| {
        let reader = ByteReader::open(ws, &path).unwrap();
        read(ws, reader, &request).unwrap()
    };
    let whole = begin(&process()).finish(&process(), &request).unwrap();
    let right = (triangles(&whole), bits(&whole), whole.entry.clone());
    std::fs::remove_file(&request.g_path).unwrap();
    let mut ws = process();
    let (mut reading, mut stops) = (begin(&ws), 0);
    while reading.step() == "some facets" {
        let mut pen = Pen::new(&dir.join("state"), &ws.scratch, "test").unwrap();
        reading.keep(&mut pen).unwrap();
        pen.finish().unwrap();
        let lost = reading.on(&ws, &request, None).unwrap();
        std::mem::forget((lost, ws));
        ws = process();
        let room = (&ws.budget, &ws.scratch);
        let (state, out) = (dir.join("state"), dir.join("out"));
        let mut from = Reader::open(&state, room, &ws.io, &out).unwrap();
        reading = Reading::restore(&mut from).unwrap();
        from.finish().unwrap();
        let now = Some(std::time::Instant::now());
        reading = reading.on(&ws, &request, now).unwrap();
        stops += 1;
    }
    assert!(stops >= 2, "{stops} stops");
    let found = reading.finish(&ws, &request).unwrap();
    assert!((triangles(&found), bits(&found), found.entry.clone()) == right);
}
