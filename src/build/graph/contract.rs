//! Contraction: the sets of a graph of nodes and links with parity, in bounded memory.
//!
//! ```text
//!   links ──> [ stop 0 ][ stop 1 ][ stop 2 ] ...       nodes in runs, taken in ascending order
//!                │   ▲▲
//!                │   ││ links of a group, re-keyed to its parent; its smallest node
//!                │   └┴── the parent is the largest node that the group is linked to
//!                ▼
//!            words of the run, questions to parents  ──>  carried back in descending order
//! ```
//!
//! 1. *Sweep*, ascending: a run of nodes is joined in memory (`Stop`). Each
//!    group that is linked to a node behind the run is merged into the largest of them: its
//!    other links are sent on as links of that parent, parities composed. What agrees with
//!    a link that was sent before is dropped, what contradicts one marks a conflict. The smallest
//!    node of the group, and its conflicts, are told to the parent.
//! 2. A group without such a link is a whole component. They are sorted by their smallest nodes
//!    and numbered.
//! 3. *Carry*, descending: a parent lies behind its children, so its label is known before they
//!    ask. The question waits at the parent's run since the sweep; the answer goes to the run
//!    of the child.
//!
//! Why it is right: merging a group into a neighbour keeps which of the remaining nodes hang
//! together, and with which parity. The order in which links come decides who is whose parent, but
//! not the sets, their smallest nodes, their conflicts, nor flips where there is no conflict.
//!
//! Why it is bounded: a hub's links are read a block at a time, twice, and never held. Memory:
//! [`Size`]. I/O: two words a link, written once and read twice; the same for each link that is
//! sent on (about two a node for a mesh in random order); four words a group; 4 bytes and a
//! word a node.

use super::carry::carry;
use super::labels::Labels;
use super::records::{Back, Said, Sent, Tree};
use super::stop::{Least, Stop};
use crate::corner::Index;
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Plan, Relay, Shuffle, Writer};

/// How the memory of a contraction is divided. Nothing of it shows in the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// A run has 2^shift nodes.
    pub shift: u32,
    /// Bytes of each of the two relays, about.
    pub relay: u64,
    /// Bytes of the writer of whole components, and of their sorter.
    pub trees: u64,
    /// Links that are remembered to drop others like them; a power of two.
    pub recent: u64,
}

/// Runs of so many nodes stay in a core's second-level cache.
const CACHED: u32 = 16;
/// More links than 2 to this are not remembered: looking them up would cost more than it saves.
const RECENT: u32 = 14;
/// A stop of a relay with one level has a block of this many bytes.
const STOP_BLOCK: u64 = 16 << 10;

impl Size {
    /// The least memory for ids of `width` bytes, in bytes.
    pub fn least(width: u64) -> u64 {
        (128 << 10) * width
    }

    /// For so many nodes, with ids of `width` bytes, in `memory` bytes, at least
    /// [`least`](Size::least).
    pub fn within(memory: u64, nodes: u64, width: u64) -> Size {
        let node = 4 + 2 * width;
        let relay = memory / 4;
        // Stops that need no second level, and larger ones when memory is ample.
        let stops = (relay / STOP_BLOCK).max(1);
        let wanted = nodes.div_ceil(stops).max(1).next_power_of_two().ilog2();
        let most = (memory / 4 / node).max(2).ilog2();
        Size {
            shift: wanted.max(CACHED).min(most),
            relay,
            trees: memory / 16,
            recent: 1 << (memory / 16 / (2 * width)).max(2).ilog2().min(RECENT),
        }
    }
}

/// What a contraction did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Swept {
    /// Runs of nodes.
    pub stops: u64,
    /// Links that were given.
    pub links: u64,
    /// Links that were sent on, re-keyed.
    pub resent: u64,
    /// Links that agreed with one sent before.
    pub dropped: u64,
    /// Records that a relay moved from level to level.
    pub poured: u64,
    /// The most records at one stop.
    pub crowd: u64,
    /// Whole components.
    pub sets: u64,
}

/// Links that were sent on lately, by a hash of their ends: a link is not sent twice while it
/// keeps its place.
struct Recent<W>(Vec<[W; 2]>);

impl<W: Index> Recent<W> {
    /// What was sent before between these nodes: its parity.
    #[inline]
    fn exchange(&mut self, a: u64, b: u64, parity: bool) -> Option<bool> {
        let hash = (a.rotate_left(32) ^ b).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
        let mask = self.0.len() as u64 - 1;
        let slot = &mut self.0[(hash & mask) as usize];
        let have = slot.map(W::wide);
        if (have[0], have[1] >> 1) == (a, b) {
            return Some(have[1] & 1 == 1);
        }
        *slot = [W::of(a), W::of(b << 1 | u64::from(parity))];
        None
    }
}

/// What the sweep leaves to be carried back.
pub(super) struct Left<W> {
    /// `2 * root + flip` of each node, counted within its run.
    pub words: ScratchFile,
    /// Questions to parents.
    pub back: Relay<Back<W>>,
    /// Whole components.
    pub trees: Buckets<Tree<W>>,
}

/// A graph whose sets are wanted; links are given first.
pub struct Contraction<'a, W: Index> {
    ws: &'a Workspace,
    nodes: u64,
    size: Size,
    sent: Relay<Sent<W>>,
    links: u64,
}

impl<'a, W: Index> Contraction<'a, W> {
    /// A graph of so many nodes, and no links yet.
    ///
    /// # Errors
    /// [`Error::Budget`]; [`Error::Internal`] when `W` is too narrow for the nodes.
    pub fn new(ws: &'a Workspace, nodes: u64, size: Size) -> Result<Self> {
        if W::BYTES == 4 && nodes > u64::from(u32::MAX >> 3) {
            let what = format!("{nodes} nodes do not fit words of {} bytes", W::BYTES);
            return Err(Error::Internal(what));
        }
        let sent = Relay::new(ws, "links by node", 0..nodes, size.shift, size.relay)?;
        Ok(Contraction {
            ws,
            nodes,
            size,
            sent,
            links: 0,
        })
    }

    /// Links two nodes: parity is true when one must be flipped to agree with the other. A node
    /// linked to itself so shows that its component cannot be oriented.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::DiskLimit`]; [`Error::Internal`] for a node that is not there.
    #[inline]
    pub fn link(&mut self, a: u64, b: u64, parity: bool) -> Result<()> {
        self.links += 1;
        if a == b && !parity {
            return Ok(());
        }
        self.sent.push(Sent::link(a.min(b), a.max(b), parity))
    }

    /// The number of sets.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`], [`Error::DiskLimit`].
    pub fn count(self) -> Result<u64> {
        let mut sweep = Sweep::new(self, None)?;
        sweep.run()?;
        Ok(sweep.swept.sets)
    }

    /// The label of every node, in a file, and what it took.
    ///
    /// # Errors
    /// [`Error::Budget`], [`Error::Io`], [`Error::DiskLimit`].
    pub fn labels(self) -> Result<(Labels<W>, Swept)> {
        let (ws, nodes, size) = (self.ws, self.nodes, self.size);
        let whole = self.sent.stops() << size.shift;
        let back = Relay::new(ws, "labels to carry back", 0..whole, size.shift, size.relay)?;
        let record = size_of::<Tree<W>>();
        let plan = Plan::within(size.trees, 1, record, nodes / 8, size.trees);
        let trees = Shuffle::new(ws, "whole components", 0..nodes.max(1), plan)?;
        let keep = Keep {
            words: ws.scratch.file("words of nodes")?,
            back,
            trees: trees.writer()?,
        };
        let mut sweep = Sweep::new(self, Some(keep))?;
        sweep.run()?;
        let swept = sweep.swept;
        let keep = sweep.keep.take();
        drop(sweep);
        let Some(Keep {
            words,
            back,
            trees: writer,
        }) = keep
        else {
            return Err(Error::Internal("a sweep lost what it kept".into()));
        };
        writer.finish()?;
        let trees = trees.finish()?;
        let labels = carry(ws, nodes, &size, Left { words, back, trees })?;
        Ok((labels, swept))
    }
}

/// What a sweep keeps for labels.
struct Keep<'t, W: Index> {
    words: ScratchFile,
    back: Relay<Back<W>>,
    trees: Writer<'t, Tree<W>>,
}

/// The sweep and its state.
struct Sweep<'t, W: Index> {
    sent: Relay<Sent<W>>,
    stop: Stop<W>,
    recent: Recent<W>,
    keep: Option<Keep<'t, W>>,
    swept: Swept,
    _lease: Lease,
}

impl<'t, W: Index> Sweep<'t, W> {
    fn new(given: Contraction<W>, keep: Option<Keep<'t, W>>) -> Result<Self> {
        let size = &given.size;
        let run = given.nodes.min(1 << size.shift) * Stop::<W>::node_bytes();
        let recent = size.recent * 2 * W::BYTES as u64;
        let lease = given.ws.budget.lease("a run of nodes", run + recent)?;
        Ok(Sweep {
            stop: Stop::new(),
            recent: Recent(vec![[W::of(0); 2]; size.recent as usize]),
            swept: Swept {
                stops: given.sent.stops(),
                links: given.links,
                ..Swept::default()
            },
            sent: given.sent,
            keep,
            _lease: lease,
        })
    }

    fn run(&mut self) -> Result<()> {
        let mut block = self.sent.block();
        while let Some(nodes) = self.sent.advance()? {
            self.stop.reset(nodes.start, nodes.end - nodes.start);
            self.gather(&mut block)?;
            self.stop.flatten();
            self.send_on(&mut block)?;
            self.leave()?;
        }
        self.swept.poured = self.sent.poured();
        if let Some(keep) = &self.keep {
            self.swept.poured += keep.back.poured();
        }
        Ok(())
    }

    /// Joins what hangs together in the run, and finds the parents.
    fn gather(&mut self, block: &mut [Sent<W>]) -> Result<()> {
        let (mut cursor, mut crowd) = (self.sent.cursor(), 0);
        loop {
            let n = self.sent.read(&mut cursor, block)?;
            if n == 0 {
                break;
            }
            crowd += n as u64;
            for sent in &block[..n] {
                match sent.said() {
                    Said::Link(a, b, parity) => self.stop.link(a, b, parity),
                    Said::Told(at, least) => self.stop.told(at, least),
                }
            }
        }
        self.swept.crowd = self.swept.crowd.max(crowd);
        Ok(())
    }

    /// Sends the links that lead out of the run on, as links of the parents.
    fn send_on(&mut self, block: &mut [Sent<W>]) -> Result<()> {
        loop {
            let n = self.sent.take(block)?;
            if n == 0 {
                return Ok(());
            }
            for sent in &block[..n] {
                let Said::Link(a, b, parity) = sent.said() else {
                    continue;
                };
                let Some((b, parent, parity)) = self.stop.rekeyed(a, b, parity) else {
                    continue;
                };
                match self.recent.exchange(b, parent, parity) {
                    None => {
                        self.swept.resent += 1;
                        self.sent.push(Sent::link(b, parent, parity))?;
                    }
                    Some(before) => {
                        self.swept.dropped += 1;
                        if before != parity {
                            self.stop.contradict(a);
                        }
                    }
                }
            }
        }
    }

    /// Tells the parents, and keeps what the labels need.
    fn leave(&mut self) -> Result<()> {
        for group in self.stop.groups() {
            let least = group.least;
            match group.parent {
                Some((parent, flip)) => {
                    let least = Least {
                        flip: least.flip ^ flip,
                        ..least
                    };
                    self.sent.push(Sent::told(parent, least))?;
                    if let Some(keep) = &mut self.keep {
                        let mirrored = (keep.back.stops() << keep.back.shift()) - 1 - parent;
                        keep.back.push(Back::ask(mirrored, group.root, flip))?;
                    }
                }
                None => {
                    self.swept.sets += 1;
                    if let Some(keep) = &mut self.keep {
                        keep.trees.push(Tree::new(group.root, least))?;
                    }
                }
            }
        }
        if let Some(keep) = &mut self.keep {
            keep.words.append(bytemuck::cast_slice(self.stop.words()))?;
        }
        Ok(())
    }
}
