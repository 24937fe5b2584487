//! Gather: brings the parts of each open vertex together and joins them, in parallel over vertices.
//!
//! Why it works: all corners of a vertex that is open were handed out, and the shuffle brings the
//! parts with the same vertex together; see [`group`](super::group).
//!
//! Memory: a sorter, five blocks and a group a thread. A vertex with more parts than a group holds
//! is passed on as a *hub*. I/O: 32 bytes a part read; 4 written for each ring, 12 for each open
//! fan, 8 for each fan of a vertex with several (twice that for wide ids).

use super::super::appender::{Appender, BLOCK};
use super::super::nodes::Nodes;
use super::super::{Job, scratch_items};
use super::Valences;
use super::group::Group;
use super::records::{Fan, Open, Part, Shared};
use crate::corner::Index;
use crate::disk::{ScratchFile, Workspace};
use crate::error::Result;
use crate::shuffle::Buckets;
use std::sync::Mutex;

/// What the parts became. Numbers are those of local components.
pub struct Gathered {
    /// Numbers of rings.
    pub rings: ScratchFile,
    /// Numbers of loops.
    pub loops: ScratchFile,
    /// [`Open`] fans.
    pub opens: ScratchFile,
    /// [`Shared`] fans.
    pub shared: ScratchFile,
    /// Parts of vertices with too many.
    pub hubs: ScratchFile,
    /// Vertices by valence.
    pub valences: Valences,
}

impl Gathered {
    /// Nothing yet, but for the vertices that were decided before.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn new(ws: &Workspace, valences: Valences) -> Result<Gathered> {
        let file = |what: &str| ws.scratch.file(what);
        Ok(Gathered {
            rings: file("rings")?,
            loops: file("loops of borders")?,
            opens: file("open fans")?,
            shared: file("fans that share vertices")?,
            hubs: file("parts of fans of hubs")?,
            valences,
        })
    }

    /// Takes in the fans of vertices with several that were decided before.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
    pub fn take_early<W: Index>(
        &self,
        job: &Job,
        nodes: &Nodes,
        early: &ScratchFile,
    ) -> Result<()> {
        let _lease = job
            .ws
            .budget
            .lease("fans that share vertices", BLOCK as u64)?;
        let mut shared = Appender::new(&self.shared);
        scratch_items(job.ws, early, 0, early.len(), &mut |fans: &[Fan<W>]| {
            for Fan([v, t, called]) in fans {
                let number = nodes.of_triangle(t.wide(), called.wide());
                shared.push(Shared([*v, W::of(number)]))?;
            }
            Ok(())
        })?;
        shared.flush()
    }
}

/// Blocks of a thread.
const BLOCKS: u64 = 5;
/// Parts of a group, at most: beyond them a vertex is a hub.
const MOST_PARTS: u64 = 32 << 10;

/// One thread's outputs, and the vertex whose parts are arriving.
struct Thread<'a, W: Index> {
    nodes: &'a Nodes<'a>,
    out: Out<'a, W>,
    parts: Vec<Part<W>>,
    most: usize,
    /// The vertex is a hub.
    hub: bool,
    corners: u64,
    group: Group,
    valences: Valences,
}

/// Where whole fans go.
pub struct Out<'a, W: Index> {
    rings: Appender<'a, W>,
    loops: Appender<'a, W>,
    opens: Appender<'a, Open<W>>,
    shared: Appender<'a, Shared<W>>,
    hubs: Appender<'a, Part<W>>,
}

impl<'a, W: Index> Out<'a, W> {
    /// Bytes that it holds.
    pub const BYTES: u64 = BLOCKS * BLOCK as u64;

    /// Nothing yet.
    pub fn new(to: &'a Gathered) -> Self {
        Out {
            rings: Appender::new(&to.rings),
            loops: Appender::new(&to.loops),
            opens: Appender::new(&to.opens),
            shared: Appender::new(&to.shared),
            hubs: Appender::new(&to.hubs),
        }
    }

    /// Takes a whole fan of a local component.
    ///
    /// # Errors
    /// Those of the files.
    pub fn take(&mut self, ends: Option<[u64; 2]>, number: u64) -> Result<()> {
        let number = W::of(number);
        match ends {
            None => self.rings.push(number),
            // The only vertex where its chain is not joined.
            Some([a, b]) if a == b => self.loops.push(number),
            Some([a, b]) => self.opens.push(Open([W::of(a), W::of(b), number])),
        }
    }

    /// Takes a fan of a vertex that has, or may have, several.
    ///
    /// # Errors
    /// Those of the file.
    pub fn share(&mut self, vertex: u64, number: u64) -> Result<()> {
        self.shared.push(Shared([W::of(vertex), W::of(number)]))
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// Those of the files.
    pub fn flush(&mut self) -> Result<()> {
        self.rings.flush()?;
        self.loops.flush()?;
        self.opens.flush()?;
        self.shared.flush()?;
        self.hubs.flush()
    }
}

/// Joins all parts.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::DiskLimit`], [`crate::Error::Io`].
pub fn gather<W: Index>(
    job: &Job,
    nodes: &Nodes,
    parts: &Buckets<Part<W>>,
    to: &mut Gathered,
) -> Result<()> {
    let ws = job.ws;
    let threads = ws.workers.count() as u64;
    let most = (ws.budget.free() / 16 / threads / Group::BYTES).clamp(64, MOST_PARTS);
    let held = Out::<W>::BYTES + most * Group::BYTES;
    let _lease = ws.budget.lease("parts of fans", threads * held)?;
    let memory = job.sort_memory(0);
    let valences = Mutex::new(Valences::default());
    let whole = &*to;
    ws.workers.run(
        parts.count(),
        || {
            let thread = Thread {
                nodes,
                out: Out::new(whole),
                parts: Vec::with_capacity(most as usize),
                most: most as usize,
                hub: false,
                corners: 0,
                group: Group::new(most as usize),
                valences: Valences::default(),
            };
            Ok((parts.sorter(memory)?, thread))
        },
        |(sorter, thread), bucket| {
            parts.sorted(bucket, sorter, &mut |batch| {
                ws.progress.advance(batch.len() as u64);
                ws.progress.usage(ws.budget.used(), ws.scratch.used());
                batch.iter().try_for_each(|part| thread.arrive(part))
            })?;
            // A vertex never goes on in the next bucket.
            thread.close()
        },
        |(_, mut thread)| {
            thread.out.flush()?;
            let mut all = valences.lock().unwrap_or_else(|e| e.into_inner());
            all.merge(&thread.valences);
            Ok(())
        },
    )?;
    to.valences
        .merge(&valences.into_inner().unwrap_or_else(|e| e.into_inner()));
    Ok(())
}

impl<W: Index> Thread<'_, W> {
    fn arrive(&mut self, part: &Part<W>) -> Result<()> {
        if self
            .parts
            .last()
            .is_some_and(|p| p.vertex() != part.vertex())
        {
            self.close()?;
        }
        if self.parts.len() == self.most {
            self.hub = true;
            self.pass_on()?;
        }
        self.corners += part.corners();
        self.parts.push(*part);
        Ok(())
    }

    fn pass_on(&mut self) -> Result<()> {
        let mut parts = self.parts.drain(..);
        parts.try_for_each(|part| self.out.hubs.push(part))
    }

    /// All parts of the vertex are there.
    fn close(&mut self) -> Result<()> {
        if self.parts.is_empty() {
            return Ok(());
        }
        self.valences.add(std::mem::take(&mut self.corners));
        if std::mem::take(&mut self.hub) {
            return self.pass_on();
        }
        self.group.join(&self.parts);
        let several = self.group.fans.len() > 1;
        for fan in &self.group.fans {
            let part = &self.parts[fan.part];
            let (t, called) = part.at();
            let number = self.nodes.of_triangle(t, called);
            self.out.take(fan.ends, number)?;
            if several {
                self.out.share(part.vertex(), number)?;
            }
        }
        self.parts.clear();
        Ok(())
    }
}
