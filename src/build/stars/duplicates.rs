//! Duplicates: triangles with the same three vertices as an earlier one.
//!
//! Why it works: chunks and cells tell twins by their opposite corners. All others lie on
//! non-manifold edges, or on edges that are not decided where the triangle is, and so do all their
//! twins: sorted by their vertices and number, all but the first of each set are listed.
//!
//! Memory: a sorter and a writer a thread; a block. I/O: 16 bytes a candidate read; 4 a duplicate
//! written and read (twice that for wide ids), and its row.

use super::super::Job;
use super::super::arrays::OutArray;
use super::records::{Candidate, Twin};
use crate::corner::Index;
use crate::error::Result;
use crate::folder;
use crate::shuffle::{Buckets, Shuffle};

/// Finds the duplicates among the candidates.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
pub fn candidates<W: Index>(
    job: &Job,
    candidates: Buckets<Candidate<W>>,
    twins: &Shuffle<Twin<W>>,
) -> Result<()> {
    let ws = job.ws;
    let memory = job.sort_memory(ws.workers.count() as u64 * job.plan.writer);
    ws.workers.run(
        candidates.count(),
        || Ok((candidates.sorter(memory)?, twins.writer()?)),
        |(sorter, twins), bucket| {
            // Triangles with the same vertices have the same bucket.
            let mut before = None;
            candidates.sorted(bucket, sorter, &mut |batch| {
                for triangle in batch {
                    let vertices = Some(triangle.vertices());
                    if std::mem::replace(&mut before, vertices) == vertices {
                        twins.push(Twin([triangle.triangle()]))?;
                    }
                }
                Ok(())
            })
        },
        |(_, twins)| twins.finish(),
    )
}

/// Ids that are written at a time.
const LISTED: usize = 1 << 10;

/// Writes the list of duplicates.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn list<I: Index, W: Index>(job: &Job, twins: &Buckets<Twin<W>>) -> Result<OutArray> {
    let bytes = I::BYTES as u64;
    let rows = [twins.records()];
    let array = OutArray::create(job.dir, folder::DUPLICATE, I::DESCR, &rows, bytes, job.ws)?;
    let mut sorter = twins.sorter(job.sort_memory(0))?;
    let (mut done, mut ids) = (0, Vec::with_capacity(LISTED));
    twins.sorted_all(&mut sorter, &mut |batch| {
        for some in batch.chunks(LISTED) {
            ids.clear();
            ids.extend(some.iter().map(|Twin([t])| I::of(t.wide())));
            array.write(done, &ids)?;
            done += ids.len() as u64;
        }
        Ok(())
    })?;
    Ok(array)
}
