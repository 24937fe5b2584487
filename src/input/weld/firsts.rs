//! The third pass: which corners are first uses, and G in their order.
//!
//! Why a bit for each corner numbers the vertices: ids follow the order of first use, so the
//! id of a first use is the number of first uses before it. The bits are kept with that number
//! for each word of them, in memory when they fit, else in a scratch file that is read window
//! by window.
//!
//! Memory: for each thread an array of positions and bits of a window; a quarter of a byte a
//! corner for bits and counts in memory. I/O: first uses read once, G written once.

use super::bits::{Bits, First};
use super::cut::Cut;
use super::windows::{Visit, Windows};
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{DataFile, Lease, ScratchFile, Workspace};
use crate::error::{Result, conserve};
use crate::folder::npy::DATA_START;
use crate::shuffle::Buckets;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Corners of a word of bits.
pub const WORD: u64 = 64;
/// Positions written at a time.
const PIECE: usize = 1 << 12;

/// 64 corners: which are first uses, and how many first uses come before them all.
#[derive(Debug, Default)]
struct Word {
    bits: AtomicU64,
    before: AtomicU64,
}

/// The same, as one reads it.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Count {
    /// Bit i: corner i of the word is a first use.
    pub bits: u64,
    /// First uses before the word.
    pub before: u64,
}

impl Count {
    /// The id of the vertex that is first used at corner `rank`, which lies in the word.
    #[inline]
    pub fn id(self, rank: u64) -> u64 {
        let below = self.bits & ((1 << (rank % WORD)) - 1);
        self.before + u64::from(below.count_ones())
    }
}

/// Which corners are first uses.
pub enum FirstUses {
    /// In memory: any corner can be asked about.
    Held(Held),
    /// In a scratch file, 16 bytes for every 64 corners.
    Filed(ScratchFile),
}

/// Bits and counts in memory.
pub struct Held {
    words: Vec<Word>,
    _lease: Lease,
}

impl Held {
    /// Memory for `corners`, in bytes.
    pub fn bytes(corners: u64) -> u64 {
        corners.div_ceil(WORD) * size_of::<Word>() as u64
    }

    /// The word that corner `rank` lies in.
    #[inline]
    pub fn word(&self, rank: u64) -> Count {
        let word = &self.words[(rank / WORD) as usize];
        let (bits, before) = (word.bits.load(Relaxed), word.before.load(Relaxed));
        Count { bits, before }
    }
}

impl FirstUses {
    /// Room for `corners`: held when `held`, else filed.
    fn new(ws: &Workspace, corners: u64, held: bool) -> Result<FirstUses> {
        if !held {
            return Ok(FirstUses::Filed(ws.scratch.file("first uses of a weld")?));
        }
        let lease = ws
            .budget
            .lease("first uses of a weld", Held::bytes(corners))?;
        let words = corners.div_ceil(WORD);
        Ok(FirstUses::Held(Held {
            words: (0..words).map(|_| Word::default()).collect(),
            _lease: lease,
        }))
    }

    /// Sets the words from that of corner `start` on; no other thread sets the same.
    fn set(&self, start: u64, counts: &[Count]) -> Result<()> {
        match self {
            FirstUses::Held(held) => {
                for (word, count) in held.words[(start / WORD) as usize..].iter().zip(counts) {
                    word.bits.store(count.bits, Relaxed);
                    word.before.store(count.before, Relaxed);
                }
                Ok(())
            }
            FirstUses::Filed(file) => {
                let at = start / WORD * size_of::<Count>() as u64;
                file.write_at(bytemuck::cast_slice(counts), at)
            }
        }
    }

    /// Gets the words from that of corner `start` on.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn get(&self, start: u64, counts: &mut [Count]) -> Result<()> {
        match self {
            FirstUses::Held(held) => {
                for (count, word) in counts
                    .iter_mut()
                    .zip(&held.words[(start / WORD) as usize..])
                {
                    let (bits, before) = (word.bits.load(Relaxed), word.before.load(Relaxed));
                    *count = Count { bits, before };
                }
                Ok(())
            }
            FirstUses::Filed(file) => {
                let at = start / WORD * size_of::<Count>() as u64;
                file.read_at(bytemuck::cast_slice_mut(counts), at)
            }
        }
    }
}

impl Keep for FirstUses {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        match self {
            FirstUses::Filed(file) => {
                to.number(0)?;
                to.file(file)
            }
            FirstUses::Held(held) => {
                to.number(1)?;
                to.number(held.words.len() as u64)?;
                held.words.iter().try_for_each(|word| {
                    to.number(word.bits.load(Relaxed))?;
                    to.number(word.before.load(Relaxed))
                })
            }
        }
    }

    fn restore(from: &mut Reader) -> Result<FirstUses> {
        if from.number()? == 0 {
            return Ok(FirstUses::Filed(from.file()?));
        }
        let count = from.number()?;
        let bytes = count * size_of::<Word>() as u64;
        let lease = from.budget.lease("first uses of a weld", bytes)?;
        let mut words = Vec::with_capacity(count as usize);
        for _ in 0..count {
            words.push(Word {
                bits: from.number()?.into(),
                before: from.number()?.into(),
            });
        }
        Ok(FirstUses::Held(Held {
            words,
            _lease: lease,
        }))
    }
}

/// The id of the first use `rank`, from the counts of the window that begins at `start`.
#[inline]
pub fn id_in(counts: &[Count], start: u64, rank: u64) -> u64 {
    counts[((rank - start) / WORD) as usize].id(rank)
}

/// Numbers the first uses and writes their positions to `g` in that order.
///
/// # Errors
/// As [`super::begin`].
pub fn place<B: Bits, R: Index>(
    ws: &Workspace,
    cut: &Cut,
    firsts: Buckets<First<B, R>>,
    corners: u64,
    held: bool,
    g: &DataFile,
) -> Result<FirstUses> {
    let uses = FirstUses::new(ws, corners, held)?;
    let _starts = ws
        .budget
        .lease("first uses of a weld", 8 * firsts.count())?;
    // First uses before each bucket.
    let mut starts = Vec::with_capacity(firsts.count() as usize);
    let mut before = 0;
    for b in 0..firsts.count() {
        starts.push(before);
        before += firsts.records_of(b);
    }
    ws.progress
        .begin("weld: place", "vertices", firsts.records());
    cut.run(
        ws,
        firsts.count(),
        || {
            let window = cut.window as usize;
            let bytes = window * size_of::<[B; 3]>()
                + window.div_ceil(WORD as usize) * size_of::<Count>()
                + PIECE.min(window) * size_of::<[B; 3]>();
            let lease = ws.budget.lease("positions of a window", bytes as u64)?;
            Ok((
                Windows::new(ws, cut, &firsts)?,
                Placer {
                    at: vec![[B::from_f4(0); 3]; window],
                    counts: vec![Count::default(); window.div_ceil(WORD as usize)],
                    piece: Vec::with_capacity(PIECE.min(window)),
                    before: 0,
                    window: cut.window,
                    corners,
                    uses: &uses,
                    g,
                    _lease: lease,
                },
            ))
        },
        |(windows, placer), b| {
            placer.before = starts[b as usize];
            windows.read(&firsts, b, placer)?;
            let (given, placed) = (firsts.records_of(b), placer.before - starts[b as usize]);
            conserve("weld: place", "vertices", given, placed)?;
            ws.progress.advance(given);
            Ok(())
        },
        |_| Ok(()),
    )?;
    ws.progress.end();
    Ok(uses)
}

/// Places the first uses of a window.
struct Placer<'a, B> {
    at: Vec<[B; 3]>,
    counts: Vec<Count>,
    piece: Vec<[B; 3]>,
    /// First uses before the window.
    before: u64,
    window: u64,
    corners: u64,
    uses: &'a FirstUses,
    g: &'a DataFile,
    _lease: Lease,
}

impl<B: Bits> Placer<'_, B> {
    fn flush(&mut self) -> Result<()> {
        let at = DATA_START + self.before * size_of::<[B; 3]>() as u64;
        self.g.write_at(bytemuck::cast_slice(&self.piece), at)?;
        self.before += self.piece.len() as u64;
        self.piece.clear();
        Ok(())
    }
}

impl<B: Bits, R: Index> Visit<First<B, R>> for Placer<'_, B> {
    fn take(&mut self, window: u64, records: &[First<B, R>]) -> Result<()> {
        let start = window * self.window;
        for first in records {
            let i = ({ first.rank }.wide() - start) as usize;
            self.at[i] = first.at;
            self.counts[i / WORD as usize].bits |= 1 << (i as u64 % WORD);
        }
        Ok(())
    }

    fn close(&mut self, window: u64) -> Result<()> {
        let start = window * self.window;
        let corners = self.window.min(self.corners - start);
        let words = corners.div_ceil(WORD) as usize;
        let mut before = self.before;
        for w in 0..words {
            self.counts[w].before = before;
            let mut bits = self.counts[w].bits;
            before += u64::from(bits.count_ones());
            while bits != 0 {
                if self.piece.len() == self.piece.capacity() {
                    self.flush()?;
                }
                let i = w * WORD as usize + bits.trailing_zeros() as usize;
                self.piece.push(self.at[i]);
                bits &= bits - 1;
            }
        }
        self.flush()?;
        self.uses.set(start, &self.counts[..words])?;
        self.counts.fill(Count::default());
        Ok(())
    }
}
