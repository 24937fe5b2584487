//! Corners that ask for their places in the image, since their vertices lie far apart in G.
//!
//! Why it works: places come to the corners through two shuffles, so that G is read in
//! ascending windows and never at random: a corner asks by vertex, and is answered by triangle.
//! The answer is the place itself, worked out from the coordinates as everywhere else, so
//! nothing depends on the way it came.
//!
//! Memory: a sorter, a writer and a window of G a thread. I/O: a question and an answer for each
//! corner to scratch and back, 8 and 16 bytes (16 and 24 for meshes of 2^28 triangles or 2^32
//! vertices); G once.

use super::pass::{Pass, Tones};
use super::source::{Rows, Triangle};
use super::view::{NOWHERE, Spot};
use crate::disk::Workspace;
use crate::error::Result;
use crate::shuffle::{Buckets, Plan, Record, Shuffle, Sorter, Writer};
use bytemuck::{Pod, Zeroable};

/// A corner asks: its vertex, and a word to be given back: `16 t + 4 k + mark`.
pub(super) trait Question: Record {
    type Answer: Answer;
    fn new(vertex: u64, word: u64) -> Self;
    fn vertex(&self) -> u64;
    fn answered(&self, spot: Spot) -> Self::Answer;
}

/// A place on its way to the corner.
pub(super) trait Answer: Record {
    fn word(&self) -> u64;
    fn spot(&self) -> Spot;
}

/// For meshes of fewer than 2^28 triangles and 2^32 vertices.
#[repr(transparent)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Narrow([u32; 2]);

/// The answer to [`Narrow`].
#[repr(transparent)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct NarrowAnswer([u32; 4]);

/// For all others.
#[repr(transparent)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct Wide([u64; 2]);

/// The answer to [`Wide`].
#[repr(transparent)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(super) struct WideAnswer([u64; 3]);

/// True when [`Narrow`] questions number the mesh.
pub(super) fn fits_narrow(triangles: u64, vertices: u64) -> bool {
    triangles <= 1 << 28 && vertices <= 1 << 32
}

/// The triangle, then the place in it: so a triangle's answers stay together.
fn key_of(word: u64, level: usize) -> u64 {
    if level == 0 { word >> 4 } else { word >> 2 & 3 }
}

impl Record for Narrow {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        u64::from(self.0[0])
    }
}

impl Record for Wide {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0[0]
    }
}

impl Record for NarrowAnswer {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        key_of(self.word(), level)
    }
}

impl Record for WideAnswer {
    const LEVELS: usize = 2;
    fn key(&self, level: usize) -> u64 {
        key_of(self.word(), level)
    }
}

impl Question for Narrow {
    type Answer = NarrowAnswer;
    fn new(vertex: u64, word: u64) -> Narrow {
        Narrow([vertex as u32, word as u32])
    }
    fn vertex(&self) -> u64 {
        u64::from(self.0[0])
    }
    fn answered(&self, [x, y, z]: Spot) -> NarrowAnswer {
        NarrowAnswer([self.0[1], x as u32, y as u32, z as u32])
    }
}

impl Question for Wide {
    type Answer = WideAnswer;
    fn new(vertex: u64, word: u64) -> Wide {
        Wide([vertex, word])
    }
    fn vertex(&self) -> u64 {
        self.0[0]
    }
    fn answered(&self, [x, y, z]: Spot) -> WideAnswer {
        let low = |x: i32| u64::from(x as u32);
        WideAnswer([self.0[1], low(x) << 32 | low(y), low(z)])
    }
}

impl Answer for NarrowAnswer {
    fn word(&self) -> u64 {
        u64::from(self.0[0])
    }
    fn spot(&self) -> Spot {
        [self.0[1] as i32, self.0[2] as i32, self.0[3] as i32]
    }
}

impl Answer for WideAnswer {
    fn word(&self) -> u64 {
        self.0[0]
    }
    fn spot(&self) -> Spot {
        let [_, xy, z] = self.0;
        [(xy >> 32) as i32, xy as i32, z as i32]
    }
}

/// Vertices of G in one window.
const WINDOW: u64 = 4 << 10;

/// Memory with which one thread can ask and be answered.
pub(super) fn least() -> u64 {
    let sorter = Sorter::<WideAnswer>::least().max(Sorter::<Wide>::least());
    3 * sorter + Rows::bytes(WINDOW) + Tones::bytes(WINDOW)
}

/// Memory of each thread's writer, and of its sorter.
fn shares(ws: &Workspace) -> [u64; 2] {
    let each = ws.budget.free() / ws.workers.count() as u64;
    // Two writers are alive at times, and some of the records that they keep.
    [
        each / 5,
        (each / 5).clamp(Sorter::<WideAnswer>::least(), 64 << 20),
    ]
}

/// A shuffle for the questions of so many corners.
///
/// # Errors
/// [`crate::Error::Internal`] for a plan beyond what a writer numbers.
pub(super) fn questions<Q: Question>(
    ws: &Workspace,
    corners: u64,
    vertices: u64,
) -> Result<Shuffle<Q>> {
    let ([writer, sorter], threads) = (shares(ws), ws.workers.count());
    let memory = writer * threads as u64;
    let plan = Plan::within(memory, threads, size_of::<Q>(), corners, sorter);
    Shuffle::new(ws, "questions for coordinates", 0..vertices.max(1), plan)
}

/// Asks for the places of a triangle's corners.
pub(super) fn ask<Q: Question>(writer: &mut Writer<'_, Q>, triangle: &Triangle) -> Result<()> {
    for (k, &v) in (0..).zip(&triangle.vertices) {
        let word = triangle.id << 4 | k << 2 | triangle.marks[k as usize].bits();
        writer.push(Q::new(v, word))?;
    }
    Ok(())
}

/// Answers the questions, and draws the triangles that asked.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub(super) fn draw<Q: Question>(pass: &Pass, asks: Buckets<Q>) -> Result<()> {
    if asks.records() == 0 {
        return Ok(());
    }
    let ws = pass.ws;
    let answers = fetch(pass, asks)?;
    let [_, sorter] = shares(ws);
    ws.progress
        .begin("draw what lay apart", "corners", answers.records());
    ws.workers.run(
        answers.count(),
        || Ok((answers.sorter(sorter)?, pass.tones(WINDOW)?, pass.tally())),
        |(sorter, tones, tally), bucket| {
            let mut spots = [NOWHERE; 3];
            let mut marks = [super::colour::Mark::None; 3];
            answers.sorted(bucket, sorter, &mut |batch| {
                for answer in batch {
                    let (t, k) = (answer.word() >> 4, (answer.word() >> 2 & 3) as usize);
                    spots[k] = answer.spot();
                    marks[k] = super::colour::Mark::of(answer.word());
                    // Places come in order, so the third completes the triangle.
                    if k == 2 {
                        pass.draw(t, spots, marks, tones.of(t)?, tally);
                    }
                }
                ws.progress.advance(batch.len() as u64);
                Ok(())
            })
        },
        |(_, _, tally)| {
            pass.add(tally);
            Ok(())
        },
    )?;
    ws.progress.end();
    Ok(())
}

/// Answers from ascending windows of G.
fn fetch<Q: Question>(pass: &Pass, asks: Buckets<Q>) -> Result<Buckets<Q::Answer>> {
    let (ws, threads) = (pass.ws, pass.ws.workers.count());
    let [writer, sorter] = shares(ws);
    let record = size_of::<Q::Answer>();
    let plan = Plan::within(
        writer * threads as u64,
        threads,
        record,
        asks.records(),
        sorter,
    );
    let answers = Shuffle::new(ws, "places", 0..pass.source.triangles.max(1), plan)?;
    ws.progress
        .begin("fetch coordinates", "corners", asks.records());
    ws.workers.run(
        asks.count(),
        || {
            Ok((
                asks.sorter(sorter)?,
                answers.writer()?,
                pass.source.rows(ws, WINDOW)?,
            ))
        },
        |(sorter, writer, rows), bucket| {
            asks.sorted(bucket, sorter, &mut |batch| {
                for ask in batch {
                    if !rows.has(ask.vertex()) {
                        rows.read(ask.vertex(), &pass.way)?;
                    }
                    writer.push(ask.answered(rows.spot(ask.vertex())))?;
                }
                ws.progress.advance(batch.len() as u64);
                Ok(())
            })
        },
        |(_, writer, _)| writer.finish(),
    )?;
    ws.progress.end();
    drop(asks);
    answers.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_places_survive_both_widths() {
        let spot = [-5, i32::MIN, 1 << 29];
        let word = 12345 << 4 | 2 << 2 | 1;
        let narrow = Narrow::new(u64::from(u32::MAX), word);
        assert_eq!(
            (narrow.vertex(), narrow.answered(spot).word()),
            (u64::from(u32::MAX), word)
        );
        assert_eq!(narrow.answered(spot).spot(), spot);
        let wide = Wide::new(1 << 40, word << 20);
        assert_eq!(
            (wide.vertex(), wide.answered(spot).word()),
            (1 << 40, word << 20)
        );
        assert_eq!(wide.answered(spot).spot(), spot);
        let answer = wide.answered(spot);
        assert_eq!((answer.key(0), answer.key(1)), (word << 16, 0));
    }
}
