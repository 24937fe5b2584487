//! Sums of the vertices that more than one chunk names.
//!
//! Why it works: cross products come sorted by vertex, and by triangle at each, so that they are
//! added in ascending order of triangles whoever sent them. A triangle has a vertex once (it is
//! not degenerate), so no two records are equal in both keys.
//!
//! Memory: a sorter and a block of rows a thread. I/O: 32 bytes a corner (40 in large meshes) to
//! scratch and back; the blocks of N in which such vertices lie, read and written.

use super::Job;
use super::cross::{add, unit};
use super::rows::{HELD, Patch};
use crate::corner::Index;
use crate::error::Result;
use crate::shuffle::{Buckets, Record};
use bytemuck::{Pod, Zeroable};
use std::sync::atomic::Ordering;

/// A triangle's cross product on its way to a vertex.
#[repr(C, packed)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Part<S> {
    vertex: S,
    triangle: S,
    cross: [f64; 3],
}

impl<S: Index> Part<S> {
    /// For vertex v, from triangle t.
    #[inline]
    pub(super) fn new(v: u64, t: u64, cross: [f64; 3]) -> Self {
        Part {
            vertex: S::of(v),
            triangle: S::of(t),
            cross,
        }
    }
}

impl<S: Index> Record for Part<S> {
    const LEVELS: usize = 2;
    #[inline]
    fn key(&self, level: usize) -> u64 {
        if level == 0 {
            { self.vertex }.wide()
        } else {
            { self.triangle }.wide()
        }
    }
}

/// Sums the cross products by vertex, and puts the normals among those that are written.
pub(super) fn sum<S: Index>(job: &Job, parts: Buckets<Part<S>>) -> Result<()> {
    let (ws, threads) = (job.ws, job.ws.workers.count() as u64);
    if parts.records() == 0 {
        return Ok(());
    }
    let _lease = ws.budget.lease("rows of normals", threads * HELD)?;
    let memory = job.sort_memory(0);
    ws.progress
        .begin("sums of normals", "corners", parts.records());
    ws.workers.run(
        parts.count(),
        || Ok((parts.sorter(memory)?, Patch::new(&job.out))),
        |(sorter, patch), bucket| {
            patch.begin(parts.range(bucket))?;
            let mut star = Star::default();
            parts.sorted(bucket, sorter, &mut |batch| {
                ws.progress.advance(batch.len() as u64);
                for part in batch {
                    let v = { part.vertex }.wide();
                    if v != star.vertex {
                        star.hand_out(job, patch)?;
                        star = Star {
                            vertex: v,
                            sum: [0.0; 3],
                        };
                    }
                    add(&mut star.sum, part.cross);
                }
                Ok(())
            })?;
            star.hand_out(job, patch)
        },
        |(_, mut patch)| patch.flush(),
    )?;
    ws.progress.end();
    Ok(())
}

/// The vertex at hand.
#[derive(Default)]
struct Star {
    vertex: u64,
    sum: [f64; 3],
}

impl Star {
    fn hand_out(&self, job: &Job, patch: &mut Patch) -> Result<()> {
        if self.sum == [0.0; 3] {
            return Ok(());
        }
        job.nonzero.fetch_add(1, Ordering::Relaxed);
        patch.put(self.vertex, unit(self.sum))
    }
}
