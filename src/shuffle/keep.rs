//! Shuffles and buckets written down: where the runs lie, and what was kept in memory.
//!
//! Why this is all: between passes every writer is finished, so whatever was pushed is in a run of
//! a file, or among the kept records; and nothing was read yet.
//!
//! Memory: what was leased before. I/O: 16 bytes a run, and the kept records.

use super::Record;
use super::buckets::{Buckets, Held};
use super::layout::Layout;
use super::writer::Shuffle;
use crate::disk::ScratchFile;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::error::Result;
use std::sync::Arc;

/// The parts that a shuffle and its buckets share.
pub(super) struct Parts<R> {
    pub layout: Layout,
    pub files: Vec<Option<Arc<ScratchFile>>>,
    pub held: Vec<Held<R>>,
    pub counts: (u64, u64),
}

impl<R: Record> Parts<R> {
    pub(super) fn restore(from: &mut Reader) -> Result<Parts<R>> {
        let layout = Layout::restore(from)?;
        let file = |from: &mut Reader| match from.number()? {
            0 => Ok(None),
            _ => from.file().map(|file| Some(Arc::new(file))),
        };
        let files = (0..from.number()?)
            .map(|_| file(from))
            .collect::<Result<_>>()?;
        let held = (0..from.number()?)
            .map(|_| Held::restore(from))
            .collect::<Result<_>>()?;
        Ok(Parts {
            layout,
            files,
            held,
            counts: (from.number()?, from.number()?),
        })
    }
}

/// Writes down what [`Parts`] reads back.
pub(super) fn keep<R: Record>(
    to: &mut Pen,
    layout: &Layout,
    files: &[Option<Arc<ScratchFile>>],
    held: &[Held<R>],
    counts: (u64, u64),
) -> Result<()> {
    layout.keep(to)?;
    to.number(files.len() as u64)?;
    for file in files {
        to.number(u64::from(file.is_some()))?;
        file.iter().try_for_each(|file| to.file(file))?;
    }
    to.number(held.len() as u64)?;
    held.iter().try_for_each(|held| held.keep(to))?;
    to.number(counts.0)?;
    to.number(counts.1)
}

impl<R: Record> Keep for Buckets<R> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.write_down(to)
    }

    fn restore(from: &mut Reader) -> Result<Buckets<R>> {
        let parts = Parts::restore(from)?;
        let room = (from.budget.clone(), from.scratch.clone());
        Buckets::new(parts.layout, parts.files, parts.held, parts.counts, room)
    }
}

impl<R: Record> Keep for Shuffle<R> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        self.write_down(to)
    }

    fn restore(from: &mut Reader) -> Result<Shuffle<R>> {
        let (per_buffer, runs) = (from.number()?, from.number()?);
        let parts = Parts::restore(from)?;
        Ok(Shuffle::of(parts, per_buffer as u32, runs, from))
    }
}
