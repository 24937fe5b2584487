//! The label of each node: its set, and its flip against the set's smallest node; in memory, or
//! in a scratch file in the order of the nodes.
//!
//! Why ranges suffice: passes go through the nodes as the file has them, so they load a run of
//! labels at a time. Whoever has nodes in another order asks with [`labels_of`], which sorts the
//! questions by node and the answers back.
//!
//! Memory: a word a node, or what each range leases; two bits a set in any case (one here, one
//! where its orientation is chosen). I/O: in a file, a word a node for each reading.

use super::bits::Bits;
use crate::corner::Index;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Lease, ScratchFile, Workspace};
use crate::error::Result;
use crate::shuffle::{Plan, Record, Shuffle};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Labels of nodes.
pub struct Labels<W> {
    /// `2 * set + flip` for each node: flip is 1 when it must be flipped to agree with the
    /// smallest node of its set.
    store: Store<W>,
    _lease: Option<Lease>,
    /// Number of sets, numbered by their smallest nodes.
    pub components: u64,
    /// The sets that cannot be oriented.
    pub nonorientable: Bits,
}

enum Store<W> {
    Memory(Vec<W>),
    File(ScratchFile),
}

impl<W: Index> Labels<W> {
    /// Labels in memory.
    pub fn in_memory(words: Vec<W>, lease: Lease, components: u64, nonorientable: Bits) -> Self {
        Labels {
            store: Store::Memory(words),
            _lease: Some(lease),
            components,
            nonorientable,
        }
    }

    /// Labels in a file.
    pub fn in_file(file: ScratchFile, components: u64, nonorientable: Bits) -> Self {
        Labels {
            store: Store::File(file),
            _lease: None,
            components,
            nonorientable,
        }
    }

    /// True when labels are in a file, so that they are had by ranges only.
    pub fn are_in_file(&self) -> bool {
        matches!(self.store, Store::File(_))
    }

    fn words(&self) -> &[W] {
        match &self.store {
            Store::Memory(words) => words,
            Store::File(_) => &[],
        }
    }

    /// (set, flip) of a node, while labels are in memory.
    ///
    /// # Panics
    /// When they are in a file: see [`range`](Labels::range).
    #[inline]
    pub fn get(&self, node: u64) -> (u64, bool) {
        split(self.words()[node as usize])
    }

    /// Bytes of a [`range`](Labels::range).
    pub fn range_bytes(&self, most: u64) -> u64 {
        if self.are_in_file() {
            most * W::BYTES as u64
        } else {
            0
        }
    }

    /// A reader of up to `most` consecutive labels at a time, leased when they are in a file.
    ///
    /// # Errors
    /// [`crate::Error::Budget`].
    pub fn range(&self, budget: &Budget, most: u64) -> Result<LabelRange<'_, W>> {
        let bytes = self.range_bytes(most);
        Ok(LabelRange {
            labels: self,
            first: 0,
            held: Vec::new(),
            most,
            _lease: budget.lease("a range of labels", bytes)?,
        })
    }
}

impl<W: Index> Keep for Labels<W> {
    fn keep(&self, to: &mut Pen) -> Result<()> {
        match &self.store {
            Store::Memory(words) => {
                to.number(self._lease.as_ref().map_or(0, Lease::bytes))?;
                to.list(words)?;
            }
            Store::File(file) => {
                to.number(u64::MAX)?;
                to.file(file)?;
            }
        }
        to.number(self.components)?;
        self.nonorientable.keep(to)
    }

    fn restore(from: &mut Reader) -> Result<Labels<W>> {
        let (store, lease) = match from.number()? {
            u64::MAX => (Store::File(from.file()?), None),
            bytes => {
                let lease = from.budget.lease("labels", bytes)?;
                (Store::Memory(from.list()?), Some(lease))
            }
        };
        Ok(Labels {
            store,
            _lease: lease,
            components: from.number()?,
            nonorientable: Bits::restore(from)?,
        })
    }
}

/// (set, flip) of a label.
#[inline]
pub fn split<W: Index>(word: W) -> (u64, bool) {
    (word.wide() >> 1, word.wide() & 1 == 1)
}

/// Some consecutive labels; all of them when they are in memory.
pub struct LabelRange<'a, W> {
    labels: &'a Labels<W>,
    first: u64,
    held: Vec<W>,
    most: u64,
    _lease: Lease,
}

impl<W: Index> LabelRange<'_, W> {
    /// Makes the labels of `nodes` those that [`get`](LabelRange::get) gives.
    ///
    /// # Errors
    /// [`crate::Error::Io`]; [`crate::Error::Internal`] when there are more than was leased for.
    pub fn load(&mut self, nodes: Range<u64>) -> Result<()> {
        let Store::File(file) = &self.labels.store else {
            return Ok(());
        };
        let held = self.first..self.first + self.held.len() as u64;
        if held.start <= nodes.start && nodes.end <= held.end {
            return Ok(());
        }
        let count = nodes.end - nodes.start;
        if count > self.most {
            let what = format!("{count} labels asked for at once, {} at most", self.most);
            return Err(crate::Error::Internal(what));
        }
        self.held.resize(count as usize, W::NONE);
        self.first = nodes.start;
        file.read_at(
            bytemuck::cast_slice_mut(&mut self.held),
            nodes.start * W::BYTES as u64,
        )
    }

    /// (set, flip) of a node among those loaded.
    #[inline]
    pub fn get(&self, node: u64) -> (u64, bool) {
        split(self.word(node))
    }

    #[inline]
    fn word(&self, node: u64) -> W {
        let words = match &self.labels.store {
            Store::Memory(words) => words,
            Store::File(_) => &self.held,
        };
        words[(node - self.first) as usize]
    }
}

/// A number that is sorted by, and one that travels along.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Pair<W>([W; 2]);

impl<W: Index> Record for Pair<W> {
    const LEVELS: usize = 1;
    #[inline]
    fn key(&self, _: usize) -> u64 {
        self.0[0].wide()
    }
}

/// Words that are held at a time while files of them are read.
const BLOCK: u64 = 8 << 10;

/// Hands the words of a file to `each`, some at a time.
fn words_of<W: Index>(
    ws: &Workspace,
    file: &ScratchFile,
    each: &mut dyn FnMut(&[W]) -> Result<()>,
) -> Result<()> {
    let count = file.len() / W::BYTES as u64;
    let _lease = ws
        .budget
        .lease("a block of words", BLOCK * W::BYTES as u64)?;
    let mut block = vec![W::NONE; BLOCK.min(count) as usize];
    for at in (0..count).step_by(BLOCK as usize) {
        let block = &mut block[..BLOCK.min(count - at) as usize];
        file.read_at(bytemuck::cast_slice_mut(block), at * W::BYTES as u64)?;
        each(block)?;
    }
    Ok(())
}

/// The labels of the nodes that a file lists in any order, as a file in that order.
///
/// With labels in memory each is looked up. Else (node, place) is sorted by node, labels are read
/// in ascending ranges, and (place, label) is sorted back. `plan` and `sort` are the size of such
/// a shuffle, of records of two words, and of its sorter.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn labels_of<W: Index>(
    ws: &Workspace,
    labels: &Labels<W>,
    nodes: (&ScratchFile, u64),
    plan: Plan,
    sort: u64,
) -> Result<ScratchFile> {
    let (list, count) = nodes;
    let answers = ws.scratch.file("labels in the order of questions")?;
    if !labels.are_in_file() {
        let mut block = Vec::new();
        words_of(ws, list, &mut |nodes: &[W]| {
            block.clear();
            block.extend(
                nodes
                    .iter()
                    .map(|node| labels.words()[node.wide() as usize]),
            );
            answers.append(bytemuck::cast_slice(&block))?;
            Ok(())
        })?;
        return Ok(answers);
    }
    let places = list.len() / W::BYTES as u64;
    let asked = Shuffle::<Pair<W>>::new(ws, "questions for labels", 0..count.max(1), plan)?;
    let mut writer = asked.writer()?;
    let mut place = 0;
    words_of(ws, list, &mut |nodes: &[W]| {
        for &node in nodes {
            writer.push(Pair([node, W::of(place)]))?;
            place += 1;
        }
        Ok(())
    })?;
    writer.finish()?;
    let asked = asked.finish()?;
    let told = Shuffle::<Pair<W>>::new(ws, "labels for questions", 0..places.max(1), plan)?;
    let mut writer = told.writer()?;
    let mut range = labels.range(&ws.budget, BLOCK)?;
    let mut sorter = asked.sorter(sort)?;
    asked.sorted_all(&mut sorter, &mut |batch| {
        batch.iter().try_for_each(|&Pair([node, place])| {
            let first = node.wide() / BLOCK * BLOCK;
            range.load(first..(first + BLOCK).min(count))?;
            writer.push(Pair([place, range.word(node.wide())]))
        })
    })?;
    drop((sorter, range, asked));
    writer.finish()?;
    let told = told.finish()?;
    let mut sorter = told.sorter(sort)?;
    let mut block: Vec<W> = Vec::with_capacity(BLOCK as usize);
    told.sorted_all(&mut sorter, &mut |batch| {
        for some in batch.chunks(BLOCK as usize) {
            block.clear();
            block.extend(some.iter().map(|pair| pair.0[1]));
            answers.append(bytemuck::cast_slice(&block))?;
        }
        Ok(())
    })?;
    Ok(answers)
}
