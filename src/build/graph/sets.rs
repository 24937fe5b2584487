//! Joins the nodes of a graph whose links lie in a file, in memory or by contraction.
//!
//! Memory: an index and a bit for each node, a bit for each set; or that of the contraction. I/O:
//! links read once, sequentially; for a contraction, see there.

use super::bits::Bits;
use super::contract::{Contraction, Size};
use super::forest::Forest;
use super::labels::Labels;
use crate::build::records::Link;
use crate::build::scratch_items;
use crate::corner::Index;
use crate::disk::{ScratchFile, Workspace};
use crate::error::Result;

/// What there is to join.
pub struct Graph<'a, N> {
    /// Number of nodes.
    pub nodes: u64,
    /// The number of what a link calls so.
    pub number: N,
    /// [`Link`]s.
    pub links: &'a ScratchFile,
    /// Hands the numbers of nodes that contradict themselves to its argument.
    pub conflicts: &'a Conflicts<'a>,
}

/// See [`Graph`].
pub type Conflicts<'a> = dyn Fn(&mut dyn FnMut(u64) -> Result<()>) -> Result<()> + 'a;

impl<N: Fn(u64) -> u64> Graph<'_, N> {
    /// Joins the nodes: in memory, or, when a size is given, by contraction.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
    pub fn labels<W: Index>(&self, ws: &Workspace, contract: Option<Size>) -> Result<Labels<W>> {
        match contract {
            None => self.join(ws),
            Some(size) => self.contract(ws, size),
        }
    }

    /// Numbers of a link's nodes, and its parity.
    #[inline]
    fn ends<W: Index>(&self, link: &Link<W>) -> (u64, u64, bool) {
        let (a, b, parity) = link.get();
        ((self.number)(a), (self.number)(b), parity)
    }

    fn join<W: Index>(&self, ws: &Workspace) -> Result<Labels<W>> {
        let (nodes, links) = (self.nodes, self.links);
        let what = format!("a union-find of {nodes} nodes");
        let lease = ws.budget.lease(&what, nodes * W::BYTES as u64)?;
        let mut forest = Forest::<W>::new(nodes);
        let mut conflicts = Bits::new(&ws.budget, "parity conflicts", nodes)?;
        scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
            forest.join_all(links, |link| self.ends(link), |root| conflicts.set(root));
            ws.progress.advance(links.len() as u64);
            Ok(())
        })?;
        (self.conflicts)(&mut |node| {
            conflicts.set(node);
            Ok(())
        })?;
        let components = forest.number();
        let mut nonorientable = Bits::new(&ws.budget, "sets that cannot be oriented", components)?;
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

    fn contract<W: Index>(&self, ws: &Workspace, size: Size) -> Result<Labels<W>> {
        let links = self.links;
        let mut graph = Contraction::new(ws, self.nodes, size)?;
        scratch_items(ws, links, 0, links.len(), &mut |links: &[Link<W>]| {
            ws.progress.advance(links.len() as u64);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            links.iter().try_for_each(|link| {
                let (a, b, parity) = self.ends(link);
                graph.link(a, b, parity)
            })
        })?;
        (self.conflicts)(&mut |node| graph.link(node, node, true))?;
        Ok(graph.labels()?.0)
    }
}
