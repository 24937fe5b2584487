//! Deal: reads V once, checks it, and hands each triangle to the cell that settles its edges.
//!
//! Why it works: vertices are ordered by (cell, id). An edge is settled in the cell of its
//! smaller vertex in that order, so all its corners meet there. Of a triangle's three edges two
//! lie at its smallest vertex: the triangle goes to that cell. The third lies at the middle
//! vertex; where that is another cell, the edge alone goes there too. Where cells are patches of
//! surface, few triangles are parted so.
//!
//! Memory: the map; bits for the vertices that occur (N/8 bytes), and for those whose triangles lie in
//! several cells (N/8, held until cells are settled); writers and a piece of V a
//! thread. I/O: V read once; 4 words a triangle written, 3 more for each edge that goes alone.

use super::super::Job;
use super::super::arrays::TriangleReader;
use super::super::first_read::first_read;
use super::map::CellMap;
use super::records::{Dealt, Lone};
use super::{CellPlan, Window};
use crate::corner::{Index, next_k, prev_k};
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Lease};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Shuffle, Writer};
use std::sync::atomic::{AtomicU64, Ordering};

/// What was dealt.
pub struct Hands<W: Index> {
    /// Triangles by cell.
    pub triangles: Buckets<Dealt<W>>,
    /// Edges without their triangles, by cell.
    pub lone: Buckets<Lone<W>>,
    /// Degenerate triangles in each window of triangles; none of them is dealt.
    pub degenerate: Vec<u64>,
    /// Vertices that no triangle names.
    pub unreferenced: u64,
    /// Vertices of triangles that lie in smaller cells than their own, when stars are wanted. All
    /// triangles at any other vertex lie in its cell.
    pub open: Option<VertexBits>,
}

/// One bit a vertex, set by any thread.
pub struct VertexBits {
    words: Vec<AtomicU64>,
    _lease: Lease,
}

impl VertexBits {
    fn new(budget: &Budget, what: &str, vertices: u64) -> Result<VertexBits> {
        let words = vertices.div_ceil(64);
        Ok(VertexBits {
            _lease: budget.lease(what, words * 8)?,
            words: (0..words).map(|_| AtomicU64::new(0)).collect(),
        })
    }

    #[inline]
    fn mark(&self, v: u64) {
        let (word, bit) = (&self.words[(v / 64) as usize], 1 << (v % 64));
        // Most were marked before, and a look is cheaper than a write.
        if word.load(Ordering::Relaxed) & bit == 0 {
            word.fetch_or(bit, Ordering::Relaxed);
        }
    }

    /// The bit of a vertex.
    #[inline]
    pub fn get(&self, v: u64) -> bool {
        self.words[(v / 64) as usize].load(Ordering::Relaxed) >> (v % 64) & 1 == 1
    }

    fn count(&self) -> u64 {
        let ones = |w: &AtomicU64| u64::from(w.load(Ordering::Relaxed).count_ones());
        self.words.iter().map(ones).sum()
    }
}

impl Keep for VertexBits {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        to.words(&self.words)
    }

    fn restore(from: &mut Reader) -> Result<VertexBits> {
        let words = from.words()?;
        Ok(VertexBits {
            _lease: from.budget.lease("open vertices", words.len() as u64 * 8)?,
            words,
        })
    }
}

impl<W: Index> Keep for Hands<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.triangles.keep(to)?;
        self.lone.keep(to)?;
        to.list(&self.degenerate)?;
        to.number(self.unreferenced)?;
        self.open.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Hands<W>> {
        Ok(Hands {
            triangles: Buckets::restore(from)?,
            lone: Buckets::restore(from)?,
            degenerate: from.list()?,
            unreferenced: from.number()?,
            open: Option::restore(from)?,
        })
    }
}

/// Deals all triangles.
///
/// # Errors
/// [`crate::Error::Input`] for the first index out of range, [`crate::Error::Budget`],
/// [`crate::Error::DiskLimit`], [`crate::Error::Io`].
pub fn deal<I: Index, W: Index>(
    job: &Job,
    plan: &CellPlan,
    windows: &Window,
    map: &CellMap,
) -> Result<Hands<W>> {
    let (ws, t, n) = (job.ws, job.shape.triangles, job.shape.vertices);
    let keys = 0..map.cells;
    let triangles = Shuffle::<Dealt<W>>::new(ws, "triangles by cell", keys.clone(), plan.dealt)?;
    let lone = Shuffle::<Lone<W>>::new(ws, "edges by cell", keys, plan.lone)?;
    let open = job
        .shape
        .measures
        .then(|| VertexBits::new(&ws.budget, "open vertices", n))
        .transpose()?;
    let occurs = VertexBits::new(&ws.budget, "marks of vertices", n)?;
    let threads = ws.workers.count() as u64;
    let reading = threads * plan.step * TriangleReader::<I>::BYTES;
    let _lease = ws.budget.lease("triangles to deal", reading)?;
    let degenerate: Vec<AtomicU64> = (0..windows.count).map(|_| AtomicU64::new(0)).collect();
    ws.workers.run(
        t.div_ceil(plan.step),
        || {
            let dealer = Dealer {
                map,
                occurs: &occurs,
                open: open.as_ref(),
                triangles: triangles.writer()?,
                lone: lone.writer()?,
            };
            Ok((TriangleReader::<I>::new(&job.mesh.v), dealer))
        },
        |(reader, dealer), unit| {
            let first = unit * plan.step;
            let count = plan.step.min(t - first);
            let v = reader.read(first, count)?;
            first_read(job, first, v)?;
            for (t, row) in (first..).zip(v.as_chunks::<3>().0) {
                if !dealer.deal(t, row.map(Index::wide))? {
                    degenerate[windows.of(t)].fetch_add(1, Ordering::Relaxed);
                }
            }
            ws.progress.advance(count);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |(_, dealer)| {
            dealer.triangles.finish()?;
            dealer.lone.finish()
        },
    )?;
    let triangles = triangles.finish()?;
    let degenerate: Vec<u64> = degenerate.into_iter().map(AtomicU64::into_inner).collect();
    let dealt = triangles.records() + degenerate.iter().sum::<u64>();
    conserve("deal", "triangles", t, dealt)?;
    Ok(Hands {
        triangles,
        lone: lone.finish()?,
        degenerate,
        unreferenced: n - occurs.count(),
        open,
    })
}

/// One thread's hands.
struct Dealer<'a, W: Index> {
    map: &'a CellMap,
    occurs: &'a VertexBits,
    open: Option<&'a VertexBits>,
    triangles: Writer<'a, Dealt<W>>,
    lone: Writer<'a, Lone<W>>,
}

impl<W: Index> Dealer<'_, W> {
    /// Deals one triangle; false when it is degenerate.
    #[inline]
    fn deal(&mut self, t: u64, v: [u64; 3]) -> Result<bool> {
        v.iter().for_each(|&v| self.occurs.mark(v));
        if v[0] == v[1] || v[1] == v[2] || v[2] == v[0] {
            return Ok(false);
        }
        let cells = v.map(|v| self.map.of(v));
        if cells[0] == cells[1] && cells[1] == cells[2] {
            let whole = Dealt::new(v.map(W::of), t, 0);
            self.triangles.push_at(u64::from(cells[0]), whole)?;
            return Ok(true);
        }
        // Only cells matter here: vertices of one cell are settled together anyway.
        let k = (0..3).min_by_key(|&k| cells[k]).unwrap_or(0);
        let (n, p) = (next_k(k), prev_k(k));
        if let Some(open) = self.open {
            let larger = (0..3).filter(|&other| cells[other] > cells[k]);
            larger.for_each(|other| open.mark(v[other]));
        }
        let middle = cells[n].min(cells[p]);
        let parted = middle != cells[k];
        let aside = if parted { k as u8 + 1 } else { 0 };
        let dealt = Dealt::new(v.map(W::of), t, aside);
        self.triangles.push_at(u64::from(cells[k]), dealt)?;
        if parted {
            let edge = Lone::new((v[n], v[p]), t, k);
            self.lone.push_at(u64::from(middle), edge)?;
        }
        Ok(true)
    }
}
