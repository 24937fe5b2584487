//! Stitch: joins local components over the links, with parity, and numbers the results.
//!
//! Why it works: local components are nodes, numbered by their first triangles, so the smallest
//! node of a set is the local component with the component's first triangle, and sets numbered by
//! their smallest nodes are components numbered by their first triangles. Both ways to find the
//! sets say so: a union-find in memory ([`Forest`]), while a label for each node fits beside
//! what later passes need, and else a contraction in what memory there is
//! ([`Contraction`]).
//!
//! Memory: an index (4 or 8 bytes) and a bit for each local component, or what is free; a bit for
//! each component. I/O: links read once, sequentially; 16 bytes for each local component of chunks
//! that contradict themselves; for a contraction, see there.

use super::Job;
use super::chunks::Chunked;
use super::graph::bits::Bits;
use super::graph::contract::Contraction;
use super::graph::forest::Forest;
pub use super::graph::labels::Labels;
use super::plan::Strategy;
use super::records::{Link, LocalCount};
use super::{contraction_size, scratch_items};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::Result;

/// Joins the local components.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn stitch<W: Index>(job: &Job, chunked: &Chunked, links: &ScratchFile) -> Result<Labels<W>> {
    let nodes = chunked.locals();
    let table = chunked.table_bytes();
    let fits = job
        .shape
        .fits_labels(&job.plan, nodes, W::BYTES as u64, table);
    let in_memory = match job.strategy {
        Strategy::Auto => fits <= job.ws.budget.limit(),
        Strategy::Memory => true,
        Strategy::Contract => false,
    };
    if in_memory {
        join(job, chunked, links)
    } else {
        contract(job, chunked, links)
    }
}

/// Joins them in memory.
fn join<W: Index>(job: &Job, chunked: &Chunked, links: &ScratchFile) -> Result<Labels<W>> {
    let (ws, nodes) = (job.ws, chunked.locals());
    let what = format!("{nodes} local components in the union-find");
    let lease = ws.budget.lease(&what, nodes * W::BYTES as u64)?;
    let mut forest = Forest::<W>::new(nodes);
    let mut conflicts = Bits::new(&ws.budget, "parity conflicts", nodes)?;
    scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
        forest.join_all(links, Link::get, |root| conflicts.set(root));
        ws.progress.advance(links.len() as u64);
        Ok(())
    })?;
    local_conflicts(job, chunked, &mut |node| {
        conflicts.set(node);
        Ok(())
    })?;
    let components = forest.number();
    let mut nonorientable = Bits::new(&ws.budget, "non-orientable components", components)?;
    if conflicts.any() {
        for (i, word) in forest.words().iter().enumerate() {
            if conflicts.get(i as u64) {
                nonorientable.set(word.wide() >> 1);
            }
        }
    }
    Ok(Labels::in_memory(
        forest.into_words(),
        lease,
        components,
        nonorientable,
    ))
}

/// Joins them through scratch files.
fn contract<W: Index>(job: &Job, chunked: &Chunked, links: &ScratchFile) -> Result<Labels<W>> {
    let (ws, nodes) = (job.ws, chunked.locals());
    let mut graph = Contraction::new(ws, nodes, contraction_size::<W>(job, nodes))?;
    scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
        ws.progress.advance(links.len() as u64);
        ws.progress.usage(ws.budget.used(), ws.scratch.used());
        links.iter().try_for_each(|link| {
            let (a, b, parity) = link.get();
            graph.link(a, b, parity)
        })
    })?;
    local_conflicts(job, chunked, &mut |node| graph.link(node, node, true))?;
    Ok(graph.labels()?.0)
}

/// Tells the local components that contradict themselves, as the chunks found.
fn local_conflicts(
    job: &Job,
    chunked: &Chunked,
    each: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<()> {
    let chunks = chunked.infos.iter().zip(&chunked.base);
    for (info, &base) in chunks.filter(|(info, _)| info.conflicts) {
        let bytes = u64::from(info.locals) * size_of::<LocalCount>() as u64;
        let (file, mut at) = (&chunked.counts, base);
        scratch_items(job.ws, file, info.counts_at, bytes, &mut |counts| {
            for count in counts as &[LocalCount] {
                if count.borders & LocalCount::CONFLICT != 0 {
                    each(at)?;
                }
                at += 1;
            }
            Ok(())
        })?;
    }
    Ok(())
}
