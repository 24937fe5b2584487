//! Scan: reads V once, checks every index, and finds the seam vertices.
//!
//! Why it works: each chunk marks each of its distinct ids once in `occurs`, and in `seam`
//! when it was marked before. So a vertex outside `seam` is named by one chunk alone, and all
//! edges at it can be settled there. When the ids outnumber the bits that the budget allows,
//! an id stands for its remainder: two ids that share a bit make one more seam vertex,
//! never one fewer, so no answer changes. Unreferenced vertices are then counted by ranges of
//! ids, one more reading of V for each range.
//!
//! Memory: two bit arrays (N/4 bytes, or less when hashed), and per thread a chunk's ids.
//! I/O: V read once (once more when N is not stated; once for each range when hashed).

use super::Job;
use super::arrays::TriangleReader;
use super::first_read::{first_read, hold, seen};
use crate::chunk::ids::LocalIds;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Lease, Workspace};
use crate::error::Result;
use crate::input::Mesh;
use std::sync::atomic::{AtomicU64, Ordering};

/// Which vertices more than one chunk names.
pub struct Seams {
    words: Vec<AtomicU64>,
    /// Ids are taken modulo this many bits: a power of two, or more than every id.
    bits: u64,
    _lease: Lease,
}

impl Seams {
    /// No marks yet, in so many bits: a multiple of 64 beyond every id, or a power of two.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn new(budget: &Budget, bits: u64, what: &str) -> Result<Seams> {
        Ok(Seams {
            _lease: budget.lease(what, bits / 8)?,
            words: (0..bits / 64).map(|_| AtomicU64::new(0)).collect(),
            bits,
        })
    }

    /// True when another chunk may name the vertex too.
    #[inline]
    pub fn is_seam(&self, id: u64) -> bool {
        let bit = self.bit(id);
        self.words[(bit / 64) as usize].load(Ordering::Relaxed) >> (bit % 64) & 1 == 1
    }

    #[inline]
    fn bit(&self, id: u64) -> u64 {
        if self.bits.is_power_of_two() {
            id & (self.bits - 1)
        } else {
            id
        }
    }

    /// Number of marks: the seam vertices, or fewer when ids share bits.
    pub fn count(&self) -> u64 {
        ones(self)
    }

    /// Seam flags of a chunk's local vertices.
    pub fn flags(&self, ids: &LocalIds, out: &mut Vec<bool>) {
        out.clear();
        match ids.window() {
            Some(first) => out.extend((0..ids.span() as u64).map(|i| self.is_seam(first + i))),
            None => out.extend(ids.table().iter().map(|&id| self.is_seam(id))),
        }
    }
}

impl Keep for Seams {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.number(self.bits)?;
        to.words(&self.words)
    }

    fn restore(from: &mut Reader) -> Result<Seams> {
        let bits = from.number()?;
        Ok(Seams {
            _lease: from.budget.lease("seam marks", bits / 8)?,
            words: from.words()?,
            bits,
        })
    }
}

/// Marks of one thread, before they go to the shared arrays.
#[derive(Default)]
pub struct Marker {
    ids: LocalIds,
    words: Vec<u64>,
}

impl Marker {
    /// Marks the distinct ids of one chunk: in `occurs`, and in `seam` when they were there.
    pub fn mark<I: Index>(&mut self, v: &[I], occurs: &Seams, seam: &Seams) {
        self.ids.assign(v);
        let (Some(first), span) = (self.ids.window(), self.ids.span() as u64) else {
            for &id in self.ids.table() {
                set(
                    occurs,
                    seam,
                    occurs.bit(id) / 64,
                    1 << (occurs.bit(id) % 64),
                );
            }
            return;
        };
        // Local words line up with the shared ones, so that 64 ids are marked at a time.
        let lead = first % 64;
        let words = ((lead + span).div_ceil(64)) as usize;
        self.words.clear();
        self.words.resize(words, 0);
        for &local in self.ids.local() {
            let bit = lead + u64::from(local);
            self.words[(bit / 64) as usize] |= 1 << (bit % 64);
        }
        for (i, &bits) in self.words.iter().enumerate().filter(|(_, b)| **b != 0) {
            let at = occurs.bit((first / 64 + i as u64) * 64) / 64;
            set(occurs, seam, at, bits);
        }
    }
}

fn set(occurs: &Seams, seam: &Seams, word: u64, bits: u64) {
    let before = occurs.words[word as usize].fetch_or(bits, Ordering::Relaxed);
    if before & bits != 0 {
        seam.words[word as usize].fetch_or(before & bits, Ordering::Relaxed);
    }
}

/// The largest id of V plus one: N of a mesh given as V alone.
///
/// # Errors
/// As [`TriangleReader::read`].
pub fn count_ids(ws: &Workspace, mesh: &Mesh) -> Result<u64> {
    let array = &mesh.v;
    const STEP: u64 = 1 << 12;
    let _lease = ws.budget.lease(
        "reading V",
        ws.workers.count() as u64 * STEP * TriangleReader::<u64>::BYTES,
    )?;
    let most = AtomicU64::new(0);
    ws.workers.run(
        array.triangles.div_ceil(STEP),
        || Ok(TriangleReader::<u64>::new(array)),
        |reader, unit| {
            let first = unit * STEP;
            let v = reader.read(first, STEP.min(array.triangles - first))?;
            if let Some(&top) = v.iter().max() {
                most.fetch_max(top.saturating_add(1), Ordering::Relaxed);
            }
            seen(mesh, first, v.len() as u64 / 3)
        },
        |_| Ok(()),
    )?;
    Ok(most.into_inner())
}

/// Finds the seam vertices; also returns how many vertices no triangle names.
///
/// # Errors
/// [`crate::Error::Input`] for the first index out of range, [`crate::Error::Budget`],
/// [`crate::Error::Io`].
pub fn scan<I: Index>(job: &Job) -> Result<(Seams, u64)> {
    let (ws, shape) = (job.ws, &job.shape);
    let (occurs, seam) = (
        Seams::new(&ws.budget, job.plan.bits, "marks of the scan")?,
        Seams::new(&ws.budget, job.plan.bits, "seam marks")?,
    );
    let _lease = job.chunk_lease("chunks of the scan")?;
    ws.workers.run(
        job.plan.chunks(shape.triangles),
        || {
            let reader = TriangleReader::<I>::new(&job.mesh.v);
            Ok((reader, Marker::default()))
        },
        |(reader, marker), chunk| {
            let (first, count) = job.chunk_range(chunk);
            let v = reader.read(first, count)?;
            first_read(job, first, v)?;
            marker.mark(v, &occurs, &seam);
            ws.progress.advance(count);
            Ok(())
        },
        |_| Ok(()),
    )?;
    let referenced = if occurs.bits >= shape.vertices {
        ones(&occurs)
    } else {
        count_by_ranges::<I>(job, &occurs)?
    };
    Ok((seam, shape.vertices - referenced))
}

fn ones(bits: &Seams) -> u64 {
    let count = |w: &AtomicU64| u64::from(w.load(Ordering::Relaxed).count_ones());
    bits.words.iter().map(count).sum()
}

/// Counts referenced vertices exactly, as many ids at a time as there are bits.
fn count_by_ranges<I: Index>(job: &Job, bits: &Seams) -> Result<u64> {
    let mut referenced = 0;
    let mut from = 0;
    // Ranges that no id lies in are skipped, so that ids far apart cost no more passes.
    while from < job.shape.vertices {
        let next = AtomicU64::new(u64::MAX);
        bits.words
            .iter()
            .for_each(|w| w.store(0, Ordering::Relaxed));
        job.ws.workers.run(
            job.plan.chunks(job.shape.triangles),
            || Ok(TriangleReader::<I>::new(&job.mesh.v)),
            |reader, chunk| {
                let (first, count) = job.chunk_range(chunk);
                let v = reader.read(first, count)?;
                hold(job, first, v.iter().max().map(|top| top.wide()))?;
                let mut beyond = u64::MAX;
                for id in v.iter().map(|x| x.wide()) {
                    if id >= from && id - from < bits.bits {
                        let bit = id - from;
                        bits.words[(bit / 64) as usize]
                            .fetch_or(1 << (bit % 64), Ordering::Relaxed);
                    } else if id > from {
                        beyond = beyond.min(id);
                    }
                }
                next.fetch_min(beyond, Ordering::Relaxed);
                Ok(())
            },
            |_| Ok(()),
        )?;
        referenced += ones(bits);
        from = next.into_inner();
    }
    Ok(referenced)
}
