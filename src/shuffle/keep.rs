//! Shuffles and buckets written down: where the runs lie, and what was kept in memory.
//!
//! Why this is all: they are written down while every writer is finished, so whatever was pushed is
//! in a run of a file, or among the kept records. What is pushed later lies behind the runs as they
//! are noted, or behind the end of the file as it was: neither is looked at when the build goes on
//! from here. A bucket was read, or it was not; its file stays as long as one of its buckets was not.
//!
//! Memory: what was leased before. I/O: 16 bytes a run, and the kept records.

use super::Record;
use super::buckets::Buckets;
use super::held::Held;
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
        let taken = from.list::<u8>()?;
        let parts = Parts::restore(from)?;
        Buckets::of(parts, &taken, from)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
    use crate::shuffle::Plan;
    use std::path::Path;

    #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
    #[repr(transparent)]
    struct Number(u64);

    impl Record for Number {
        const LEVELS: usize = 1;
        fn key(&self, _level: usize) -> u64 {
            self.0
        }
    }

    const KEYS: u64 = 1 << 20;

    fn workspace(dir: &Path) -> Workspace {
        let io = Arc::new(Counters::default());
        let journal = dir.join("state");
        let rooms = [dir.join("scratch")];
        Workspace {
            budget: Budget::new(16 << 20),
            scratch: Scratch::named(&rooms, u64::MAX, &io, &journal).unwrap(),
            io,
            workers: Workers::new(1).unwrap(),
            progress: Arc::new(NoProgress),
        }
    }

    fn write(ws: &Workspace, dir: &Path, state: &impl Keep) {
        let mut pen = Pen::new(&dir.join("state"), &ws.scratch, "test").unwrap();
        state.keep(&mut pen).unwrap();
        pen.finish().unwrap();
    }

    fn read<T: Keep>(dir: &Path) -> (Workspace, T) {
        let ws = workspace(dir);
        let room = (&ws.budget, &ws.scratch);
        let state = dir.join("state");
        let mut reader = Reader::open(&state, room, &ws.io, &dir.join("out")).unwrap();
        let state = T::restore(&mut reader).unwrap();
        reader.finish().unwrap();
        (ws, state)
    }

    fn push(shuffle: &Shuffle<Number>, numbers: std::ops::Range<u64>) {
        let mut writer = shuffle.writer().unwrap();
        for i in numbers {
            writer.push(Number(i * 7919 % KEYS)).unwrap();
        }
        writer.finish().unwrap();
    }

    /// What was pushed, and what was read, before the state was written down is there and gone;
    /// what came later is as if it had never been.
    #[test]
    fn what_is_kept_is_gone_on_with() {
        for (count, spills) in [(20_000u64, true), (200, false)] {
            let dir = tempfile::tempdir().unwrap();
            let dir = dir.path();
            for name in ["scratch", "out"] {
                std::fs::create_dir(dir.join(name)).unwrap();
            }
            let ws = workspace(dir);
            let plan = Plan::of(32, 32 << 10, size_of::<Number>(), 1000);
            let shuffle = Shuffle::<Number>::new(&ws, "test", 0..KEYS, plan).unwrap();
            push(&shuffle, 0..count);
            write(&ws, dir, &shuffle);
            // The process is killed while it goes on, twice.
            push(&shuffle, 5 * count..7 * count);
            for _ in 0..2 {
                let (_ws, shuffle) = read::<Shuffle<Number>>(dir);
                push(&shuffle, 9 * count..10 * count);
                std::mem::forget(shuffle);
            }
            std::mem::forget(shuffle);
            let (ws, shuffle) = read::<Shuffle<Number>>(dir);
            push(&shuffle, count..2 * count);
            let buckets = shuffle.finish().unwrap();
            assert_eq!(buckets.records(), 2 * count);
            assert_eq!(buckets.spilled_bytes() > 0, spills);
            let mut sorted = Vec::new();
            let take = |buckets: &Buckets<Number>, b: std::ops::Range<u64>, to: &mut Vec<u64>| {
                let mut sorter = buckets.sorter(64 << 10).unwrap();
                b.into_iter().for_each(|b| {
                    let sink = &mut |numbers: &[Number]| {
                        to.extend(numbers.iter().map(|number| number.0));
                        Ok(())
                    };
                    buckets.sorted(b, &mut sorter, sink).unwrap();
                });
            };
            let (half, all) = (buckets.count() / 2 + 1, buckets.count());
            take(&buckets, 0..half, &mut sorted);
            write(&ws, dir, &buckets);
            take(&buckets, half..all, &mut Vec::new());
            std::mem::forget(buckets);
            let (ws, buckets) = read::<Buckets<Number>>(dir);
            assert!(buckets.unsorted(half - 1, &mut Vec::new()).is_err());
            take(&buckets, half..all, &mut sorted);
            let mut expected: Vec<u64> = (0..2 * count).map(|i| i * 7919 % KEYS).collect();
            expected.sort_unstable();
            assert!(sorted == expected);
            drop(buckets);
            assert_eq!(ws.budget.used(), 0);
        }
    }

    /// However often writers are finished and made again, what they hold stays within bounds.
    #[test]
    fn stops_without_number_hold_no_more() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("scratch")).unwrap();
        let ws = workspace(dir.path());
        let plan = Plan::of(32, 32 << 10, size_of::<Number>(), 1 << 20);
        let shuffle = Shuffle::<Number>::new(&ws, "test", 0..KEYS, plan).unwrap();
        for round in 0..500 {
            push(&shuffle, round * 2000..(round + 1) * 2000);
            assert!(ws.budget.used() < plan.writer_bytes());
        }
        let buckets = shuffle.finish().unwrap();
        assert_eq!(buckets.records(), 1_000_000);
    }
}
