//! The floor: no program that reads these files and writes those can be faster than this.
//!
//! Plain positioned reads and writes of blocks of 1 MiB through one reused buffer a thread, all
//! reads before all writes, blocks handed out in order of files and offsets. What is written is
//! the last block that the thread read, so it is no run of zeros that a file system might skip.

use crate::{Result, at};
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Bytes of a block and of a thread's buffer.
const BLOCK: u64 = 1 << 20;

/// One run of the floor.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
pub struct Floor {
    /// Wall time of reading and writing, the opening and making of the files included.
    pub seconds: f64,
    /// Wall time of the sync after it.
    pub sync: f64,
}

struct Block<'a> {
    file: &'a File,
    path: &'a Path,
    at: u64,
    bytes: usize,
    write: bool,
}

/// Reads `inputs` and writes files of the sizes of `outputs` into a new folder `dir`, which is
/// removed at the end, both not timed.
pub fn run(
    inputs: &[&Path],
    outputs: &[(String, u64)],
    dir: &Path,
    threads: usize,
) -> Result<Floor> {
    fs::create_dir(dir).map_err(at(dir))?;
    let start = Instant::now();
    let mut files = Vec::new();
    for path in inputs {
        let file = File::open(path).map_err(at(path))?;
        let bytes = file.metadata().map_err(at(path))?.len();
        files.push((file, path.to_path_buf(), bytes, false));
    }
    for (name, bytes) in outputs {
        let path = dir.join(name);
        let file = File::create_new(&path).map_err(at(&path))?;
        files.push((file, path, *bytes, true));
    }
    let mut blocks = Vec::new();
    for (file, path, bytes, write) in &files {
        for at in (0..*bytes).step_by(BLOCK as usize) {
            let bytes = BLOCK.min(bytes - at) as usize;
            let write = *write;
            blocks.push(Block {
                file,
                path,
                at,
                bytes,
                write,
            });
        }
    }
    let next = AtomicUsize::new(0);
    let done: Vec<_> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads)
            .map(|_| scope.spawn(|| take_blocks(&blocks, &next)))
            .collect();
        let own = take_blocks(&blocks, &next);
        let others = others
            .into_iter()
            .map(|t| t.join().unwrap_or_else(|_| Err("a thread panicked".into())));
        std::iter::once(own).chain(others).collect()
    });
    done.into_iter().collect::<std::result::Result<(), _>>()?;
    let seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    for (file, path, _, _) in files.iter().filter(|f| f.3) {
        file.sync_all().map_err(at(path))?;
    }
    let sync = start.elapsed().as_secs_f64();
    fs::remove_dir_all(dir).map_err(at(dir))?;
    Ok(Floor { seconds, sync })
}

/// What one thread does: takes blocks until none is left.
fn take_blocks(blocks: &[Block], next: &AtomicUsize) -> std::result::Result<(), String> {
    let mut buffer = vec![0u8; BLOCK as usize];
    while let Some(block) = blocks.get(next.fetch_add(1, Ordering::Relaxed)) {
        let part = &mut buffer[..block.bytes];
        let done = if block.write {
            block.file.write_all_at(part, block.at)
        } else {
            block.file.read_exact_at(part, block.at)
        };
        done.map_err(at(block.path))?;
    }
    Ok(())
}
