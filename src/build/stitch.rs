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
use super::graph::bits::Bits;
use super::graph::contract::Contraction;
use super::graph::forest::Forest;
pub use super::graph::labels::Labels;
use super::nodes::Nodes;
use super::plan::Strategy;
use super::records::Link;
use super::{contraction_size, scratch_items};
use crate::corner::Index;
use crate::disk::ScratchFile;
use crate::error::Result;

/// What there is to join.
pub struct Linked<'a> {
    /// Numbers of the local components.
    pub nodes: Nodes<'a>,
    /// [`Link`]s.
    pub links: &'a ScratchFile,
    /// Hands the numbers of local components that contradict themselves to its argument.
    pub conflicts: &'a Conflicts<'a>,
}

/// See [`Linked`].
pub type Conflicts<'a> = dyn Fn(&mut dyn FnMut(u64) -> Result<()>) -> Result<()> + 'a;

/// Joins the local components; in memory when `fits` says that later passes have room beside
/// their labels.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn stitch<W: Index>(job: &Job, linked: &Linked, fits: bool) -> Result<Labels<W>> {
    let in_memory = match job.strategy {
        Strategy::Auto => fits,
        Strategy::Contract => false,
        Strategy::Memory | Strategy::ByPlace | Strategy::ById => true,
    };
    if in_memory {
        join(job, linked)
    } else {
        contract(job, linked)
    }
}

impl Linked<'_> {
    /// Numbers of a link's local components, and its parity.
    #[inline]
    fn ends<W: Index>(&self, link: &Link<W>) -> (u64, u64, bool) {
        let (a, b, parity) = link.get();
        (self.nodes.number(a), self.nodes.number(b), parity)
    }
}

/// Joins them in memory.
fn join<W: Index>(job: &Job, linked: &Linked) -> Result<Labels<W>> {
    let (ws, nodes, links) = (job.ws, linked.nodes.count(), linked.links);
    let what = format!("{nodes} local components in the union-find");
    let lease = ws.budget.lease(&what, nodes * W::BYTES as u64)?;
    let mut forest = Forest::<W>::new(nodes);
    let mut conflicts = Bits::new(&ws.budget, "parity conflicts", nodes)?;
    scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
        forest.join_all(links, |link| linked.ends(link), |root| conflicts.set(root));
        ws.progress.advance(links.len() as u64);
        Ok(())
    })?;
    (linked.conflicts)(&mut |node| {
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
fn contract<W: Index>(job: &Job, linked: &Linked) -> Result<Labels<W>> {
    let (ws, nodes, links) = (job.ws, linked.nodes.count(), linked.links);
    let mut graph = Contraction::new(ws, nodes, contraction_size::<W>(job, nodes))?;
    scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
        ws.progress.advance(links.len() as u64);
        ws.progress.usage(ws.budget.used(), ws.scratch.used());
        links.iter().try_for_each(|link| {
            let (a, b, parity) = linked.ends(link);
            graph.link(a, b, parity)
        })
    })?;
    (linked.conflicts)(&mut |node| graph.link(node, node, true))?;
    Ok(graph.labels()?.0)
}
