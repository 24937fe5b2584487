//! The last passes: the id of each corner's vertex.
//!
//! Why one sweep over a window suffices: a corner is a first use, and its id is the next; or it
//! is the first of its block but not of the mesh, and its id was sent to it; or it says which
//! corner of its block comes before it in the same place, and that one's id is known already.
//!
//! What is sent is the rank of the first use, when bits and counts of all corners are in memory
//! to make an id of it; else [`resolve`] has made ids of ranks window by window before.
//!
//! Memory: for each thread 4 + id bytes for each corner of a window and 16 for every 64; a
//! block, or a sorter. I/O: what was sent read once; 4 bytes a corner read where blocks had
//! repeats, and V written once, sequentially within a window.

use super::bits::Pair;
use super::cut::Cut;
use super::firsts::{Count, FirstUses, WORD, id_in};
use super::windows::{Visit, Windows};
use crate::corner::Index;
use crate::disk::{Lease, ScratchFile, Workspace};
use crate::error::{Result, conserve};
use crate::shuffle::{Buckets, Shuffle, Writer};

/// Ids looked up at a time.
const BATCH: usize = 128;

/// Turns (first use, other) into (other, id).
///
/// # Errors
/// As [`super::begin`].
pub fn resolve<R: Index>(
    ws: &Workspace,
    cut: &Cut,
    others: Buckets<Pair<R>>,
    corners: u64,
    uses: &FirstUses,
) -> Result<Buckets<Pair<R>>> {
    let plan = cut.by_window(corners, size_of::<Pair<R>>(), cut.memory / 8);
    let ids = Shuffle::new(ws, "ids of a weld", 0..corners, plan)?;
    ws.progress
        .begin("weld: resolve", "positions", others.records());
    cut.run(
        ws,
        others.count(),
        || {
            let words = cut.window.div_ceil(WORD);
            let bytes = words * size_of::<Count>() as u64;
            let resolver = Resolver {
                counts: vec![Count::default(); words as usize],
                of: None,
                window: cut.window,
                corners,
                uses,
                to: ids.writer()?,
                _lease: ws.budget.lease("first uses of a window", bytes)?,
            };
            Ok((Windows::new(ws, cut, &others)?, resolver))
        },
        |(windows, resolver), b| {
            windows.read(&others, b, resolver)?;
            ws.progress.advance(others.records_of(b));
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |(_, resolver)| resolver.to.finish(),
    )?;
    ws.progress.end();
    drop(others);
    ids.finish()
}

struct Resolver<'a, R> {
    counts: Vec<Count>,
    /// The window that `counts` is of.
    of: Option<u64>,
    window: u64,
    corners: u64,
    uses: &'a FirstUses,
    to: Writer<'a, Pair<R>>,
    _lease: Lease,
}

impl<R: Index> Visit<Pair<R>> for Resolver<'_, R> {
    fn take(&mut self, window: u64, records: &[Pair<R>]) -> Result<()> {
        let start = window * self.window;
        if self.of != Some(window) {
            let words = self.window.min(self.corners - start).div_ceil(WORD);
            self.uses.get(start, &mut self.counts[..words as usize])?;
            self.of = Some(window);
        }
        for pair in records {
            let id = id_in(&self.counts, start, { pair.key }.wide());
            self.to.push(Pair {
                key: pair.value,
                value: R::of(id),
            })?;
        }
        Ok(())
    }

    fn close(&mut self, _: u64) -> Result<()> {
        Ok(())
    }
}

/// Writes V, of ids of type I, to `v`.
///
/// # Errors
/// As [`super::begin`].
pub fn corners<R: Index, I: Index>(
    ws: &Workspace,
    cut: &Cut,
    others: Buckets<Pair<R>>,
    corners: u64,
    uses: &FirstUses,
    (backs, v): (&ScratchFile, &ScratchFile),
) -> Result<()> {
    ws.progress.begin("weld: corners", "corners", corners);
    // As long as it is now: it grows when it is V too.
    let told = backs.len() / 4;
    cut.run(
        ws,
        others.count(),
        || {
            let window = cut.window as usize;
            let words = window.div_ceil(WORD as usize);
            let bytes = window * (4 + size_of::<I>()) + words * size_of::<Count>();
            let sweep = Sweep {
                back: vec![0; if told == 0 { 0 } else { window }],
                ids: vec![I::of(0); window],
                counts: vec![Count::default(); words],
                window: cut.window,
                corners,
                uses,
                backs,
                told,
                sent: 0,
                v,
                _lease: ws.budget.lease("corners of a window", bytes as u64)?,
            };
            Ok((Windows::new(ws, cut, &others)?, sweep))
        },
        |(windows, sweep), b| {
            windows.read(&others, b, sweep)?;
            let range = others.range(b);
            ws.progress.advance(range.end - range.start);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |_| Ok(()),
    )?;
    ws.progress.end();
    Ok(())
}

/// Finds the ids of a window's corners.
struct Sweep<'a, I> {
    back: Vec<u32>,
    ids: Vec<I>,
    counts: Vec<Count>,
    window: u64,
    corners: u64,
    uses: &'a FirstUses,
    backs: &'a ScratchFile,
    /// Corners that `backs` covers.
    told: u64,
    /// Corners of the window that were sent their ids.
    sent: u64,
    v: &'a ScratchFile,
    _lease: Lease,
}

impl<R: Index, I: Index> Visit<Pair<R>> for Sweep<'_, I> {
    fn take(&mut self, window: u64, records: &[Pair<R>]) -> Result<()> {
        let start = window * self.window;
        self.sent += records.len() as u64;
        let mut put = |pair: &Pair<R>, id| {
            self.ids[({ pair.key }.wide() - start) as usize] = I::of(id);
        };
        let FirstUses::Held(held) = self.uses else {
            for pair in records {
                put(pair, { pair.value }.wide());
            }
            return Ok(());
        };
        // Words first, so that many of them are on their way from memory at once.
        let mut words = [Count::default(); BATCH];
        for batch in records.chunks(BATCH) {
            for (word, pair) in words.iter_mut().zip(batch) {
                *word = held.word({ pair.value }.wide());
            }
            for (word, pair) in words.iter().zip(batch) {
                put(pair, word.id({ pair.value }.wide()));
            }
        }
        Ok(())
    }

    fn close(&mut self, window: u64) -> Result<()> {
        let start = window * self.window;
        let n = self.window.min(self.corners - start) as usize;
        let words = n.div_ceil(WORD as usize);
        self.uses.get(start, &mut self.counts[..words])?;
        // Behind its end, as in its holes, `backs` says that nothing was repeated.
        let told = self.told.saturating_sub(start).min(n as u64) as usize;
        let firsts = self.counts[..words].iter();
        let firsts: u64 = firsts.map(|count| u64::from(count.bits.count_ones())).sum();
        let mut repeats = 0;
        if told > 0 {
            let back = &mut self.back[..n];
            self.backs
                .read_at(bytemuck::cast_slice_mut(&mut back[..told]), 4 * start)?;
            back[told..].fill(0);
            repeats = back.iter().filter(|&&back| back > 0).count() as u64;
            sweep(&mut self.ids[..n], back, &self.counts[..words]);
        } else {
            number(&mut self.ids[..n], &self.counts[..words]);
        }
        // A corner that was not told what it is would have what the window before left.
        let known = firsts + repeats + std::mem::take(&mut self.sent);
        conserve("weld: corners", "corners", n as u64, known)?;
        let at = start * size_of::<I>() as u64;
        self.v.write_at(bytemuck::cast_slice(&self.ids[..n]), at)
    }
}

/// Gives first uses their ids, and repeats those of the corners that they name.
fn sweep<I: Index>(ids: &mut [I], back: &[u32], counts: &[Count]) {
    for (w, count) in counts.iter().enumerate() {
        let from = w * WORD as usize;
        let end = (from + WORD as usize).min(ids.len());
        let mut next = count.before;
        for i in from..end {
            if back[i] > 0 {
                ids[i] = ids[i - back[i] as usize];
            } else if count.bits >> (i - from) & 1 == 1 {
                ids[i] = I::of(next);
                next += 1;
            }
        }
    }
}

/// Gives first uses their ids.
fn number<I: Index>(ids: &mut [I], counts: &[Count]) {
    for (w, count) in counts.iter().enumerate() {
        let (mut bits, mut next) = (count.bits, count.before);
        while bits != 0 {
            let i = w * WORD as usize + bits.trailing_zeros() as usize;
            ids[i] = I::of(next);
            next += 1;
            bits &= bits - 1;
        }
    }
}
