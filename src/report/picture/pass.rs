//! The pass over the triangles: each is drawn once, with the spots of its vertices.
//!
//! ```text
//!   V ──block──> runs of triangles whose vertices lie close ──window of G──> draw
//!                triangles whose vertices lie apart ──> all of G mapped ───> draw   (G small)
//!                                                  └──> questions ──> answers ──> draw
//! ```
//!
//! Why the picture does not depend on the way: a vertex has the same spot on each, worked out
//! from its coordinates alone, and the canvas does not care for order.
//!
//! Memory: t × a block and a window, at most a quarter of what is free; then all of G when it
//! is small, else writers and sorters. I/O: V once; O and the labels once when
//! they are needed; of G, where triangles near in the file are near in G, little more than all
//! of it once; else as [`asked`](super::asked) says.

use super::asked::{self, Question};
use super::canvas::Canvas;
use super::colour::{Mark, Paint, component_tone};
use super::facet::{Facet, Line};
use super::source::{Block, Mapped, Rows, Source};
use super::view::{NOWHERE, Projection, Spot};
use crate::disk::{DataFile, Lease, Workspace};
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::shuffle::Writer;
use crate::table::array::Width;
use std::sync::Mutex;
use std::sync::PoisonError;

/// Fewest triangles in a block.
const MIN_STEP: u64 = 1 << 10;
/// Most of them: beyond that nothing is gained.
const MAX_STEP: u64 = 32 << 10;
/// Vertices in a window, for each triangle of a block. A coherent mesh has half a vertex a
/// triangle; the rest is room for ids that lie farther apart.
const WINDOW_PER_TRIANGLE: u64 = 4;
/// A run of fewer triangles is not worth a reading of G.
const MIN_RUN: usize = 256;

/// Where tones come from.
pub(super) enum ToneSource {
    /// All have the same.
    One,
    /// The labels, `component.npy`, and their width.
    Labels(DataFile, Width),
    /// A tone for each triangle.
    Each { tones: Vec<u16>, _lease: Lease },
}

/// What was drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tally {
    /// Triangles that are not degenerate.
    pub(super) triangles: u64,
    /// Of these, those with a vertex that is not finite.
    pub(super) skipped: u64,
}

/// What all threads share.
pub(super) struct Pass<'a> {
    pub(super) ws: &'a Workspace,
    pub(super) source: &'a Source<'a>,
    pub(super) way: Projection,
    pub(super) canvas: Canvas,
    pub(super) tones: ToneSource,
    /// Half the width of marks, in samples.
    pub(super) mark_radius: f64,
    pub(super) total: Mutex<Tally>,
}

/// Memory for a thread's block of `step` triangles, its window and its tones.
fn step_bytes(step: u64) -> u64 {
    Block::bytes(step) + Rows::bytes(WINDOW_PER_TRIANGLE * step) + Tones::bytes(step)
}

/// The least memory for this pass besides the canvas and the tones.
pub(super) fn least(threads: u64) -> u64 {
    threads * (step_bytes(MIN_STEP) + asked::least()) + asked::least()
}

impl Pass<'_> {
    /// Draws all triangles, asking with questions of type Q where it must.
    ///
    /// # Errors
    /// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`], and
    /// [`crate::Error::Input`] when the folder is damaged.
    pub(super) fn run<Q: Question>(&self) -> Result<()> {
        let (ws, source) = (self.ws, self.source);
        let threads = ws.workers.count() as u64;
        let share = ws.budget.free() / 4 / threads;
        let mut step = MIN_STEP;
        while step < MAX_STEP && step < source.triangles && step_bytes(2 * step) <= share {
            step *= 2;
        }
        // Held while the rest is shared out; each thread then draws its part of it.
        let hold = ws
            .budget
            .lease("blocks of triangles", threads * step_bytes(step))?;
        let mapped = source.mapped(ws)?;
        let asks = asked::questions::<Q>(ws, 3 * source.triangles, source.vertices)?;
        drop(hold);
        ws.progress
            .begin("draw triangles", "triangles", source.triangles);
        ws.workers.run(
            source.triangles.div_ceil(step),
            || {
                Ok(Near {
                    pass: self,
                    block: source.block(ws, step)?,
                    rows: source.rows(ws, WINDOW_PER_TRIANGLE * step)?,
                    tones: self.tones(step)?,
                    mapped: mapped.as_ref(),
                    asks: match &mapped {
                        Some(_) => None,
                        None => Some(asks.writer()?),
                    },
                    tally: Tally::default(),
                })
            },
            |near, unit| {
                let first = unit * step;
                let count = step.min(source.triangles - first);
                near.draw(first, count)?;
                ws.progress.advance(count);
                Ok(())
            },
            |near: Near<Q>| {
                self.add(near.tally);
                near.asks.map_or(Ok(()), Writer::finish)
            },
        )?;
        ws.progress.end();
        drop(mapped);
        asked::draw(self, asks.finish()?)
    }

    /// A reader of tones, by windows of up to `most` triangles.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub(super) fn tones(&self, most: u64) -> Result<Tones<'_>> {
        let lease = self
            .ws
            .budget
            .lease("a window of labels", Tones::bytes(most))?;
        let room = match &self.tones {
            ToneSource::Labels(_, width) => most as usize * width.bytes(),
            _ => 0,
        };
        Ok(Tones {
            from: &self.tones,
            triangles: self.source.triangles,
            bytes: vec![0; room],
            first: 0,
            count: 0,
            most,
            _lease: lease,
        })
    }

    /// An empty tally.
    pub(super) fn tally(&self) -> Tally {
        Tally::default()
    }

    /// Adds what a thread counted.
    pub(super) fn add(&self, tally: Tally) {
        let mut total = self.total.lock().unwrap_or_else(PoisonError::into_inner);
        total.triangles += tally.triangles;
        total.skipped += tally.skipped;
    }

    /// Draws one triangle, and those of its edges that are marked.
    #[inline]
    pub(super) fn draw(
        &self,
        id: u64,
        spots: [Spot; 3],
        marks: [Mark; 3],
        tone: u32,
        tally: &mut Tally,
    ) {
        tally.triangles += 1;
        if spots.contains(&NOWHERE) {
            tally.skipped += 1;
            return;
        }
        let canvas = &self.canvas;
        if let Some(facet) = Facet::new(spots, canvas.width, canvas.height) {
            let unit = self.way.depth_unit;
            canvas.draw(&facet, id, || {
                Paint::surface(tone, facet.front, facet.shade(unit))
            });
        }
        if marks != [Mark::None; 3] {
            self.draw_marks(id, spots, marks);
        }
    }

    fn draw_marks(&self, id: u64, spots: [Spot; 3], marks: [Mark; 3]) {
        let canvas = &self.canvas;
        for k in 0..3 {
            // A line stands out from the surface that it runs along, and non-manifold edges
            // from borders.
            let nearer = match marks[k] {
                Mark::None => continue,
                Mark::Border => 3.0,
                Mark::NonManifold => 4.0,
            };
            let unit = f64::from(1 << super::view::FRACTION) / self.way.depth_unit;
            let nearer = nearer * self.mark_radius * unit;
            let ends = [spots[(k + 1) % 3], spots[(k + 2) % 3]];
            let size = (canvas.width, canvas.height);
            if let Some(line) = Line::new(ends, (self.mark_radius, nearer), size.0, size.1) {
                canvas.draw(&line, id, || Paint::mark(marks[k]));
            }
        }
    }
}

/// Tones of triangles, by windows of labels.
pub(super) struct Tones<'a> {
    from: &'a ToneSource,
    triangles: u64,
    bytes: Vec<u8>,
    first: u64,
    count: u64,
    most: u64,
    _lease: Lease,
}

impl Tones<'_> {
    /// Bytes for a window of so many triangles.
    pub(super) fn bytes(most: u64) -> u64 {
        8 * most
    }

    /// The tone of a triangle.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    #[inline]
    pub(super) fn of(&mut self, t: u64) -> Result<u32> {
        match self.from {
            ToneSource::One => Ok(0),
            ToneSource::Each { tones, .. } => Ok(u32::from(tones[t as usize])),
            ToneSource::Labels(file, width) => {
                if t < self.first || t - self.first >= self.count {
                    self.first = t;
                    self.count = self.most.min(self.triangles - t);
                    let bytes = &mut self.bytes[..self.count as usize * width.bytes()];
                    file.read_at(bytes, DATA_START + t * width.bytes() as u64)?;
                }
                Ok(component_tone(
                    width.get(&self.bytes, (t - self.first) as usize),
                ))
            }
        }
    }
}

/// One thread, drawing blocks.
struct Near<'a, Q> {
    pass: &'a Pass<'a>,
    block: Block,
    rows: Rows<'a>,
    tones: Tones<'a>,
    mapped: Option<&'a Mapped>,
    asks: Option<Writer<'a, Q>>,
    tally: Tally,
}

impl<Q: Question> Near<'_, Q> {
    fn draw(&mut self, first: u64, count: u64) -> Result<()> {
        self.block.read(self.pass.source, first, count)?;
        let mut from = 0;
        while from < self.block.triangles.len() {
            let (to, low, high) = self.run(from);
            if to - from >= MIN_RUN.min(self.block.triangles.len()) && high - low < self.rows.most {
                self.draw_run(from, to, low, high)?;
            } else {
                self.draw_apart(from, to)?;
            }
            from = to;
        }
        Ok(())
    }

    /// The end of the run of triangles from `from` whose vertices fit in a window, at least one
    /// triangle, and their least and greatest vertex.
    fn run(&self, from: usize) -> (usize, u64, u64) {
        let (mut low, mut high) = (u64::MAX, 0);
        for (i, triangle) in self.block.triangles[from..].iter().enumerate() {
            let [a, b, c] = triangle.vertices;
            let (l, h) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
            if h - l >= self.rows.most {
                return if i == 0 {
                    (from + 1, l, h)
                } else {
                    (from + i, low, high)
                };
            }
            (low, high) = (l, h);
        }
        (self.block.triangles.len(), low, high)
    }

    fn draw_run(&mut self, from: usize, to: usize, low: u64, high: u64) -> Result<()> {
        let pass = self.pass;
        self.rows.read_to(low, high + 1, &pass.way)?;
        for triangle in &self.block.triangles[from..to] {
            let spots = triangle.vertices.map(|v| self.rows.spot(v));
            let tone = self.tones.of(triangle.id)?;
            pass.draw(triangle.id, spots, triangle.marks, tone, &mut self.tally);
        }
        Ok(())
    }

    fn draw_apart(&mut self, from: usize, to: usize) -> Result<()> {
        let pass = self.pass;
        for triangle in &self.block.triangles[from..to] {
            if let Some(mapped) = self.mapped {
                let spots = triangle.vertices.map(|v| mapped.spot(v, &pass.way));
                let tone = self.tones.of(triangle.id)?;
                pass.draw(triangle.id, spots, triangle.marks, tone, &mut self.tally);
            } else if let Some(asks) = &mut self.asks {
                asked::ask(asks, triangle)?;
            }
        }
        Ok(())
    }
}
