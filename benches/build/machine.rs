//! What the machine is, and what it can do: memory copies, and sequential writes and reads of the
//! disk that the bench works on. Figures to read the others by; none is asserted.

use crate::{Result, at};
use std::fs::{self, File};
use std::hint::black_box;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Barrier;
use std::time::Instant;

/// Bytes that are written or read at once.
const BLOCK: usize = 1 << 20;
/// The file to write and read has so many times the bytes of a buffer to copy.
const FILE: usize = 4;

/// The machine and its figures, in bytes a second.
#[derive(Clone, Debug)]
pub struct Figures {
    /// Model of the processor.
    pub cpu: String,
    /// Processors that this process may use.
    pub cores: usize,
    /// Memory copied by one thread.
    pub copy_one: f64,
    /// Memory copied by all threads together.
    pub copy_all: f64,
    /// Sequential writing into the page cache.
    pub write_cache: f64,
    /// The same with the sync after it.
    pub write_disk: f64,
    /// Sequential reading from the page cache.
    pub read_cache: f64,
    /// Sequential reading past the page cache; none where `dd` cannot.
    pub read_disk: Option<f64>,
}

impl Figures {
    /// Measures with buffers of `bytes`, and a file of four times that in `dir`.
    pub fn measure(dir: &Path, threads: usize, bytes: usize) -> Result<Figures> {
        let path = dir.join("probe");
        let (write_cache, write_disk) = write(&path, bytes * FILE)?;
        let read_cache = read(&path)?;
        let read_disk = read_direct(&path, bytes * FILE);
        fs::remove_file(&path).map_err(at(&path))?;
        Ok(Figures {
            cpu: cpu(),
            cores: std::thread::available_parallelism().map_or(1, |n| n.get()),
            copy_one: copy(1, bytes)?,
            copy_all: copy(threads, bytes)?,
            write_cache,
            write_disk,
            read_cache,
            read_disk,
        })
    }

    /// The machine as part of a file name: `amd-epyc-2-cores`.
    pub fn slug(&self) -> String {
        let text = format!("{} {} cores", self.cpu, self.cores).to_lowercase();
        let words = text.split(|c: char| !c.is_ascii_alphanumeric());
        let words: Vec<_> = words.filter(|w| !w.is_empty()).collect();
        words.join("-")
    }
}

/// The processor's model as the kernel has it, or else its architecture.
fn cpu() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find(|l| l.starts_with("model name"));
    let model = model.and_then(|l| l.split_once(':'));
    model.map_or(std::env::consts::ARCH.to_owned(), |(_, name)| {
        name.trim().to_owned()
    })
}

/// The day as `date +%F` has it.
pub fn date() -> Result<String> {
    said(Command::new("date").arg("+%F")).ok_or_else(|| "`date +%F` failed".into())
}

/// The commit that is checked out, with `-dirty` when files differ from it.
pub fn commit() -> Option<String> {
    let mut git = Command::new("git");
    git.args(["describe", "--always", "--dirty", "--abbrev=10"]);
    said(git.current_dir(env!("CARGO_MANIFEST_DIR")))
}

/// The line that a command prints.
fn said(command: &mut Command) -> Option<String> {
    let done = command.stderr(Stdio::null()).output().ok()?;
    let text = String::from_utf8(done.stdout).ok()?.trim().to_owned();
    (done.status.success() && !text.is_empty()).then_some(text)
}

/// Bytes a second that `threads` copy together, each between two buffers of its own that are
/// already in memory: the median of five turns, summed over the threads.
fn copy(threads: usize, bytes: usize) -> Result<f64> {
    let barrier = Barrier::new(threads);
    let one = || {
        let from = vec![1u8; bytes];
        let mut to = vec![2u8; bytes];
        barrier.wait();
        let mut rates = [0.0; 5];
        for rate in &mut rates {
            let start = Instant::now();
            to.copy_from_slice(black_box(&from));
            black_box(&mut to);
            *rate = bytes as f64 / start.elapsed().as_secs_f64();
        }
        rates.sort_by(f64::total_cmp);
        rates[2]
    };
    std::thread::scope(|scope| {
        let all: Vec<_> = (0..threads).map(|_| scope.spawn(one)).collect();
        let mut sum = 0.0;
        for thread in all {
            sum += thread.join().map_err(|_| "a thread panicked")?;
        }
        Ok(sum)
    })
}

/// Writes a new file: bytes a second without and with the sync.
fn write(path: &Path, bytes: usize) -> Result<(f64, f64)> {
    let block: Vec<u8> = (0..BLOCK).map(|i| ((i * i) >> 7) as u8).collect();
    let start = Instant::now();
    let mut file = File::create(path).map_err(at(path))?;
    for _ in 0..bytes / BLOCK {
        file.write_all(&block).map_err(at(path))?;
    }
    let cache = start.elapsed().as_secs_f64();
    file.sync_all().map_err(at(path))?;
    let disk = start.elapsed().as_secs_f64();
    Ok((bytes as f64 / cache, bytes as f64 / disk))
}

/// Reads a file that is in the page cache.
fn read(path: &Path) -> Result<f64> {
    let mut block = vec![0u8; BLOCK];
    let mut file = File::open(path).map_err(at(path))?;
    let (start, mut bytes) = (Instant::now(), 0);
    loop {
        match file.read(&mut block).map_err(at(path))? {
            0 => return Ok(bytes as f64 / start.elapsed().as_secs_f64()),
            n => bytes += n,
        }
    }
}

/// Reads a file past the page cache, which takes aligned memory: that is left to `dd`.
fn read_direct(path: &Path, bytes: usize) -> Option<f64> {
    let mut input = std::ffi::OsString::from("if=");
    input.push(path);
    let mut dd = Command::new("dd");
    dd.arg(input)
        .args(["of=/dev/null", "bs=4M", "iflag=direct"]);
    let dd = dd.stdout(Stdio::null()).stderr(Stdio::null());
    let start = Instant::now();
    let done = dd.status().is_ok_and(|s| s.success());
    done.then(|| bytes as f64 / start.elapsed().as_secs_f64())
}
