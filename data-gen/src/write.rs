//! Writes a view as PLY, STL, NumPy or raw arrays.
//!
//! Every record of these formats has a fixed width, and every triangle and vertex can be computed from
//! its number alone. So the file is cut into blocks, and each thread takes the next block that nobody
//! has, fills its own buffer and writes it where it belongs: no queue, no order to keep, and the same
//! bytes for any number of threads. Memory: [`BLOCK`] bytes a thread. I/O: the output, once.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use clap::ValueEnum;

use crate::view::View;
use crate::{Error, Truth};

/// Bytes of a thread's write buffer.
pub const BLOCK: usize = 4 << 20;

/// The file formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Binary little-endian PLY: x y z, and faces as uchar + 3 x int (uint beyond 2^31 vertices).
    Ply,
    /// Binary STL, without vertex ids and with zero normals.
    Stl,
    /// `NAME.npy` (V) and `NAME.G.npy` (G).
    Npy,
    /// `NAME` (V) and `NAME.G`: the same arrays without headers, little-endian.
    Raw,
}

/// The width of vertex ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Index {
    /// 4 bytes, unsigned.
    U4,
    /// 8 bytes, unsigned.
    U8,
}

/// The width of coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Coords {
    /// 4-byte floats.
    F4,
    /// 8-byte floats.
    F8,
}

/// How to write.
#[derive(Clone, Debug)]
pub struct Target {
    /// The file that is named to the user; the others are derived from it.
    pub path: PathBuf,
    /// The format.
    pub format: Format,
    /// Width of vertex ids (npy, raw).
    pub index: Index,
    /// Width of coordinates (not STL).
    pub coords: Coords,
    /// Whether G is written (npy, raw).
    pub positions: bool,
    /// Threads, at least 1.
    pub threads: usize,
}

impl Target {
    /// Where G goes: `a.npy` -> `a.G.npy`, `a.raw` -> `a.raw.G`.
    pub fn positions_path(&self) -> PathBuf {
        let mut name = match self.format {
            Format::Npy => self.path.with_extension("G").into_os_string(),
            _ => self.path.clone().into_os_string(),
        };
        name.push(if self.format == Format::Npy {
            ".npy"
        } else {
            ".G"
        });
        name.into()
    }

    /// Where the counts go: `a.npy` -> `a.npy.json`.
    pub fn truth_path(&self) -> PathBuf {
        let mut name = self.path.clone().into_os_string();
        name.push(".json");
        name.into()
    }
}

/// Writes the mesh, and returns its counts with those that only the flips decide.
pub fn write(view: &View, target: &Target) -> Result<Truth, Error> {
    refuse_too_large(view.truth(), target)?;
    forget(&target.truth_path())?;
    let truth = view.truth();
    let (t, n) = (truth.triangles, truth.vertices);
    let index = if target.index == Index::U4 {
        "u4"
    } else {
        "u8"
    };
    let float = if target.coords == Coords::F4 {
        "f4"
    } else {
        "f8"
    };
    match target.format {
        Format::Ply => {
            let file = Output::create(&target.path, &ply_header(t, n, target.coords))?;
            let file = write_positions(view, target, file)?;
            write_triangles(view, target, file)
        }
        Format::Stl => {
            let mut header = [0u8; 84];
            let title = b"binary STL made by data-gen";
            header[..title.len()].copy_from_slice(title);
            header[80..].copy_from_slice(&(t as u32).to_le_bytes());
            write_triangles(view, target, Output::create(&target.path, &header)?)
        }
        Format::Npy | Format::Raw => {
            let npy = target.format == Format::Npy;
            let header = |what, rows| {
                if npy {
                    npy_header(what, rows)
                } else {
                    Vec::new()
                }
            };
            if target.positions {
                let file = Output::create(&target.positions_path(), &header(float, n))?;
                write_positions(view, target, file)?;
            }
            write_triangles(
                view,
                target,
                Output::create(&target.path, &header(index, t))?,
            )
        }
    }
}

/// Whether vertex ids fit 4 bytes with the all-ones value to spare, which readers use for "none".
pub fn fits_u4(truth: &Truth) -> bool {
    truth.vertices <= u64::from(u32::MAX)
}

fn refuse_too_large(truth: &Truth, target: &Target) -> Result<(), Error> {
    let narrow = target.index == Index::U4;
    let message = match target.format {
        Format::Stl if truth.triangles > u64::from(u32::MAX) => "STL counts triangles in 4 bytes",
        Format::Ply if !fits_u4(truth) => "PLY has no ids wider than 4 bytes: use npy",
        Format::Npy | Format::Raw if narrow && !fits_u4(truth) => {
            "vertex ids need 8 bytes: use --index u8"
        }
        _ => return Ok(()),
    };
    Err(Error::Usage(format!(
        "{} triangles and {} vertices are too many: {message}",
        truth.triangles, truth.vertices
    )))
}

/// Counts of an earlier file of that name must not stand beside one that is half written.
fn forget(path: &Path) -> Result<(), Error> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path)(error)),
        _ => Ok(()),
    }
}

fn ply_header(triangles: u64, vertices: u64, coords: Coords) -> Vec<u8> {
    let float = if coords == Coords::F4 {
        "float"
    } else {
        "double"
    };
    let int = if vertices > 1 << 31 { "uint" } else { "int" };
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by data-gen\nelement vertex {vertices}\n\
         property {float} x\nproperty {float} y\nproperty {float} z\nelement face {triangles}\n\
         property list uchar {int} vertex_indices\nend_header\n"
    )
    .into_bytes()
}

/// A version 1.0 header for rows of three, padded to a multiple of 64 bytes as NumPy does.
fn npy_header(what: &str, rows: u64) -> Vec<u8> {
    let mut text =
        format!("{{'descr': '<{what}', 'fortran_order': False, 'shape': ({rows}, 3), }}");
    let pad = 63 - (10 + text.len()) % 64;
    text.push_str(&" ".repeat(pad));
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend_from_slice(&(text.len() as u16).to_le_bytes());
    header.extend_from_slice(text.as_bytes());
    header
}

fn write_positions(view: &View, target: &Target, file: Output) -> Result<Output, Error> {
    let count = view.truth().vertices;
    match target.coords {
        Coords::F4 => file.records(count, target.threads, |v, out: &mut [u8; 12]| {
            put(out, 0, view.position(v).map(|c| (c as f32).to_le_bytes()));
            Tally::default()
        }),
        Coords::F8 => file.records(count, target.threads, |v, out: &mut [u8; 24]| {
            put(out, 0, view.position(v).map(f64::to_le_bytes));
            Tally::default()
        }),
    }
    .map(|(file, _)| file)
}

fn write_triangles(view: &View, target: &Target, file: Output) -> Result<Truth, Error> {
    let count = view.truth().triangles;
    let flips = view.flips();
    let next = |i| {
        let shown = view.triangle(i);
        let tally = Tally {
            flipped: u64::from(shown.flipped),
            inconsistent: if flips {
                view.inconsistent_edges(&shown)
            } else {
                0
            },
        };
        (shown.corners, tally)
    };
    let (file, tally) = match (target.format, target.index) {
        (Format::Ply, _) => file.records(count, target.threads, |i, out: &mut [u8; 13]| {
            let (corners, tally) = next(i);
            out[0] = 3;
            put(out, 1, corners.map(|v| (v as u32).to_le_bytes()));
            tally
        }),
        (Format::Stl, _) => file.records(count, target.threads, |i, out: &mut [u8; 50]| {
            let (corners, tally) = next(i);
            for (k, v) in corners.into_iter().enumerate() {
                let place = view.position(v).map(|c| (c as f32).to_le_bytes());
                put(out, 12 + 12 * k, place);
            }
            tally
        }),
        (_, Index::U4) => file.records(count, target.threads, |i, out: &mut [u8; 12]| {
            let (corners, tally) = next(i);
            put(out, 0, corners.map(|v| (v as u32).to_le_bytes()));
            tally
        }),
        (_, Index::U8) => file.records(count, target.threads, |i, out: &mut [u8; 24]| {
            let (corners, tally) = next(i);
            put(out, 0, corners.map(u64::to_le_bytes));
            tally
        }),
    }?;
    file.finish()?;
    let base = view.truth().clone();
    Ok(if flips {
        Truth {
            flipped: tally.flipped,
            inconsistent_edges: tally.inconsistent,
            ..base
        }
    } else {
        base
    })
}

/// Lays three numbers side by side.
fn put<const B: usize>(out: &mut [u8], at: usize, numbers: [[u8; B]; 3]) {
    out[at..at + 3 * B].copy_from_slice(numbers.as_flattened());
}

/// Counts that only the writing of all triangles gives.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    flipped: u64,
    inconsistent: u64,
}

/// A file that grows by arrays of records.
struct Output {
    path: PathBuf,
    file: File,
    end: u64,
}

impl Output {
    fn create(path: &Path, header: &[u8]) -> Result<Output, Error> {
        let mut file = File::create(path).map_err(Error::io(path))?;
        file.write_all(header).map_err(Error::io(path))?;
        Ok(Output {
            path: path.to_path_buf(),
            file,
            end: header.len() as u64,
        })
    }

    /// Appends `count` records of `R` bytes, each as `fill` makes it from its number.
    fn records<const R: usize>(
        mut self,
        count: u64,
        threads: usize,
        fill: impl Fn(u64, &mut [u8; R]) -> Tally + Sync,
    ) -> Result<(Output, Tally), Error> {
        let next = AtomicU64::new(0);
        let work = || self.take_blocks(count, &next, &fill);
        let tallies: Vec<Result<Tally, Error>> = std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            let mut tallies = vec![work()];
            for other in others {
                match other.join() {
                    Ok(tally) => tallies.push(tally),
                    Err(panic) => std::panic::resume_unwind(panic),
                }
            }
            tallies
        });
        let mut sum = Tally::default();
        for tally in tallies {
            let tally = tally?;
            sum.flipped += tally.flipped;
            sum.inconsistent += tally.inconsistent;
        }
        self.end += count * R as u64;
        Ok((self, sum))
    }

    /// What one thread does: takes blocks until none is left.
    fn take_blocks<const R: usize>(
        &self,
        count: u64,
        next: &AtomicU64,
        fill: &impl Fn(u64, &mut [u8; R]) -> Tally,
    ) -> Result<Tally, Error> {
        // A file handle of its own, since a handle has one place to write at.
        let mut file = File::options()
            .write(true)
            .open(&self.path)
            .map_err(Error::io(&self.path))?;
        let per_block = (BLOCK / R) as u64;
        let mut buffer = vec![[0u8; R]; per_block.min(count) as usize];
        let mut sum = Tally::default();
        loop {
            let first = next.fetch_add(per_block, Ordering::Relaxed);
            if first >= count {
                return Ok(sum);
            }
            let records = &mut buffer[..per_block.min(count - first) as usize];
            for (i, record) in (first..).zip(records.iter_mut()) {
                let tally = fill(i, record);
                sum.flipped += tally.flipped;
                sum.inconsistent += tally.inconsistent;
            }
            let at = self.end + first * R as u64;
            file.seek(SeekFrom::Start(at))
                .and_then(|_| file.write_all(records.as_flattened()))
                .map_err(Error::io(&self.path))?;
        }
    }

    /// Checks that the file is as long as its records say.
    fn finish(self) -> Result<(), Error> {
        let length = self.file.metadata().map_err(Error::io(&self.path))?.len();
        if length == self.end {
            return Ok(());
        }
        let text = format!("{length} bytes written, {} expected", self.end);
        Err(Error::Io(self.path, std::io::Error::other(text)))
    }
}
