//! Assemble: the replies of the cells come back to the triangles, and the arrays are written.
//!
//! Why it works: each triangle that is not degenerate got one reply, which has its label and the
//! opposites that its cell settled; opposites from other cells and from the seams are patches. A
//! window of triangles is assembled in cache and written once, in its final state: an opposite
//! names its corner as the input had it, with the parity of the edge, and the flip of the
//! triangle across is this one's flip xor the parity, so it need not be looked up.
//!
//! Memory: labels and bits by component; for each thread [`WORDS`] words a triangle of a window.
//! I/O: V read once, 5 words of reply a triangle and 2 a patch; V, O, component and flipped
//! written once.

use super::super::Job;
use super::super::arrays::{OutArray, TriangleReader};
use super::super::components::Chosen;
use super::super::finish::Tables;
use super::super::records::Patch;
use super::super::stitch::Labels;
use super::Window;
use super::names::Names;
use super::records::{Called, Reply};
use crate::corner::{Index, flip_k};
use crate::error::{Error, Result};
use crate::folder::Orient;
use crate::shuffle::Buckets;
use std::time::Instant;

/// Words held for each triangle of a window: reply, patches, opposites, what it is called by,
/// rows of V and O, label.
pub const WORDS: u64 = 5 + 6 + 3 + 4 + 3 + 3 + 1;

/// What the cells said and the later passes decided.
pub struct Said<'a, W: Index> {
    /// Answers to the triangles.
    pub replies: &'a Buckets<Reply<W>>,
    /// Opposites that other cells and the seams found.
    pub patches: &'a Buckets<Patch<W>>,
    /// Numbers of the names.
    pub names: &'a Names,
    /// Components of the local components.
    pub labels: &'a Labels<W>,
    /// Orientations.
    pub chosen: &'a Chosen,
    /// Degenerate triangles in each window.
    pub degenerate: &'a [u64],
}

/// Writes the arrays by triangle from window `done` on, until all are written or `until` is past.
/// Returns the first window that was not; all before it were.
///
/// # Errors
/// [`Error::Budget`], [`Error::Io`]; [`Error::Internal`] when a triangle has no reply.
pub fn assemble<I: Index, W: Index>(
    job: &Job,
    windows: &Window,
    said: &Said<W>,
    tables: &Tables,
    (done, until): (u64, Option<Instant>),
) -> Result<u64> {
    let (ws, t) = (job.ws, job.shape.triangles);
    let threads = ws.workers.count() as u64;
    let bytes = windows.bytes::<I, W>();
    let _lease = ws.budget.lease("windows of triangles", threads * bytes)?;
    let before: Vec<u64> = said
        .degenerate
        .iter()
        .scan(0, |sum, &n| Some(std::mem::replace(sum, *sum + n)))
        .collect();
    ws.workers.round(
        done..windows.count,
        until,
        || Ok(Thread::<I, W>::new(job)),
        |thread, window| {
            let first = window << windows.shift;
            let count = (1 << windows.shift).min(t - first);
            thread.gather(said, window, first, count)?;
            thread.turn(job, said, first, count)?;
            thread.write(tables, first, window.is_multiple_of(2))?;
            thread.check(said, tables, window, before[window as usize])?;
            ws.progress.advance(count);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |_| Ok(()),
    )
}

/// Scratch memory of one thread.
struct Thread<'a, I, W> {
    reader: TriangleReader<'a, I>,
    replies: Vec<Reply<W>>,
    patches: Vec<Patch<W>>,
    /// For each triangle its opposites, as replies and patches have them.
    opposites: Vec<[W; 3]>,
    called: Vec<Option<Called>>,
    v: Vec<I>,
    o: Vec<I>,
    component: Vec<I>,
    bits: Vec<u8>,
    degenerate: Vec<I>,
}

impl<'a, I: Index, W: Index> Thread<'a, I, W> {
    fn new(job: &'a Job) -> Self {
        Thread {
            reader: TriangleReader::new(&job.mesh.v),
            replies: Vec::new(),
            patches: Vec::new(),
            opposites: Vec::new(),
            called: Vec::new(),
            v: Vec::new(),
            o: Vec::new(),
            component: Vec::new(),
            bits: Vec::new(),
            degenerate: Vec::new(),
        }
    }

    /// Brings replies and patches to their triangles.
    fn gather(&mut self, said: &Said<W>, window: u64, first: u64, count: u64) -> Result<()> {
        said.replies.unsorted(window, &mut self.replies)?;
        said.patches.unsorted(window, &mut self.patches)?;
        self.opposites.clear();
        self.opposites.resize(count as usize, [W::NONE; 3]);
        self.called.clear();
        self.called.resize(count as usize, None);
        for reply in &self.replies {
            let i = (reply.t() - first) as usize;
            self.opposites[i] = reply.opposites();
            self.called[i] = Some(reply.called());
        }
        for patch in &self.patches {
            let (t, k) = patch.at();
            self.opposites[(t - first) as usize][k] = patch.opposite();
        }
        Ok(())
    }

    /// Turns the rows of the window as was decided.
    fn turn(&mut self, job: &Job, said: &Said<W>, first: u64, count: u64) -> Result<()> {
        self.v.clear();
        self.o.clear();
        self.component.clear();
        self.bits.clear();
        self.bits.resize(count.div_ceil(8) as usize, 0);
        self.degenerate.clear();
        let rows = self.reader.read(first, count)?.as_chunks::<3>().0;
        for (i, &[a, b, c]) in rows.iter().enumerate() {
            let Some(called) = self.called[i] else {
                self.v.extend([a, b, c]);
                self.o.extend([I::NONE; 3]);
                self.component.push(I::NONE);
                if a != b && b != c && c != a {
                    let what = format!("triangle {} has no reply", first + i as u64);
                    return Err(Error::Internal(what));
                }
                self.degenerate.push(I::of(first + i as u64));
                continue;
            };
            let (component, flip) = said.labels.get(said.names.number(called.name));
            let keeps = job.orient == Orient::Keep || said.labels.nonorientable.get(component);
            let flip = !keeps && flip ^ called.flip ^ said.chosen.flip.get(component);
            self.bits[i / 8] |= u8::from(flip) << (i % 8);
            self.component.push(I::of(component));
            let mut o = self.opposites[i].map(|word| match word.wide() {
                u64::MAX => I::NONE,
                word => {
                    let other = !keeps && flip ^ (word & 1 == 1);
                    let k = flip_k((word >> 1 & 3) as usize, other);
                    I::of(3 * (word >> 3) + k as u64)
                }
            });
            let mut v = [a, b, c];
            if flip {
                v.swap(1, 2);
                o.swap(1, 2);
            }
            self.v.extend(v);
            self.o.extend(o);
        }
        Ok(())
    }

    /// Writes the rows, those of V first or those of O: a file takes one writer at a time, so
    /// that neighbours should begin with different ones.
    fn write(&self, tables: &Tables, first: u64, v_first: bool) -> Result<()> {
        let mut rows = [(tables.v, &self.v), (tables.o, &self.o)];
        if !v_first {
            rows.reverse();
        }
        for (table, rows) in rows {
            table.write(3 * first, rows)?;
        }
        tables.component.write(first, &self.component)?;
        if self.bits.iter().any(|&b| b != 0) {
            tables.flipped.write(first / 8, &self.bits)?;
        }
        Ok(())
    }

    /// Every triangle has one reply, or is one of the degenerate ones that were counted.
    fn check(&self, said: &Said<W>, tables: &Tables, window: u64, before: u64) -> Result<()> {
        let (found, counted) = (self.degenerate.len(), said.degenerate[window as usize]);
        let replied = self.called.iter().flatten().count();
        if found as u64 != counted || replied != self.replies.len() {
            return Err(Error::Internal(format!(
                "window {window}: {} replies to {replied} triangles; {found} degenerate ones \
                 where {counted} were counted",
                self.replies.len()
            )));
        }
        list(tables.degenerate, before, &self.degenerate)
    }
}

fn list<I: Index>(to: &OutArray, at: u64, ids: &[I]) -> Result<()> {
    if ids.is_empty() {
        return Ok(());
    }
    to.write(at, ids)
}
