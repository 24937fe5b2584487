//! The way back of a contraction: numbers the components and carries the labels from parents to
//! children.
//!
//! Why it works: components come sorted by their smallest nodes, so they are numbered as they come.
//! A parent lies behind the run of its child; runs are taken from the last to the first, so
//! all labels of a run are there when it is opened: those of whole components from the
//! start, those of other groups from their parents.
//!
//! Memory: a run of nodes (4 bytes and a word each), a relay, a sorter; a bit a component. I/O:
//! words and labels of the nodes once, questions and answers once.

use super::bits::Bits;
use super::contract::{Left, Size};
use super::labels::Labels;
use super::records::{Answer, Back, Tree};
use crate::corner::Index;
use crate::disk::{ScratchFile, Workspace};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Relay, Sorter};

/// Labels all nodes.
///
/// # Errors
/// [`Error::Budget`], [`Error::Io`], [`Error::DiskLimit`].
pub(super) fn carry<W: Index>(
    ws: &Workspace,
    nodes: u64,
    size: &Size,
    left: Left<W>,
) -> Result<Labels<W>> {
    let Left {
        words,
        mut back,
        trees,
    } = left;
    let components = trees.records();
    let mut nonorientable = Bits::new(&ws.budget, "non-orientable components", components)?;
    number(&trees, size, &mut back, &mut nonorientable)?;
    drop(trees);
    let run = nodes.min(1 << size.shift);
    let _lease = ws
        .budget
        .lease("labels of a run", run * (4 + W::BYTES as u64))?;
    let file = ws.scratch.file("labels by node")?;
    let mut carrier = Carrier {
        whole: back.stops() << back.shift(),
        nodes,
        words: Vec::new(),
        labels: Vec::new(),
        block: back.block(),
    };
    while let Some(mirrored) = back.advance()? {
        carrier.stop(mirrored.end, &mut back, &words, &file)?;
    }
    Ok(Labels::in_file(file, components, nonorientable))
}

/// Numbers the components, and sends each its label.
fn number<W: Index>(
    trees: &Buckets<Tree<W>>,
    size: &Size,
    back: &mut Relay<Back<W>>,
    nonorientable: &mut Bits,
) -> Result<()> {
    let whole = back.stops() << back.shift();
    let mut sorter = trees.sorter(size.trees.max(Sorter::<Tree<W>>::least()))?;
    let mut component = 0;
    trees.sorted_all(&mut sorter, &mut |batch| {
        for tree in batch {
            let (root, flip, conflict) = tree.get();
            if conflict {
                nonorientable.set(component);
            }
            let label = component << 1 | u64::from(flip);
            back.push(Back::label(whole - 1 - root, label))?;
            component += 1;
        }
        Ok(())
    })
}

/// The run whose labels are known next.
struct Carrier<W: Index> {
    /// Nodes of all runs, as if the last were full.
    whole: u64,
    nodes: u64,
    words: Vec<u32>,
    labels: Vec<W>,
    block: Vec<Back<W>>,
}

impl<W: Index> Carrier<W> {
    /// Labels the run whose first node, mirrored, is `end - 1`, and answers what it is asked.
    fn stop(
        &mut self,
        end: u64,
        back: &mut Relay<Back<W>>,
        words: &ScratchFile,
        file: &ScratchFile,
    ) -> Result<()> {
        let start = self.whole - end;
        let count = (self.nodes - start).min(1 << back.shift()) as usize;
        self.words.resize(count, 0);
        words.read_at(bytemuck::cast_slice_mut(&mut self.words), 4 * start)?;
        self.labels.clear();
        self.labels.resize(count, W::NONE);
        self.told(start, back)?;
        for i in 0..count {
            let word = self.words[i];
            // A root comes before the other nodes of its group.
            let label = self.labels[word as usize >> 1];
            if label == W::NONE {
                let what = format!("node {} has no label", start + i as u64);
                return Err(Error::Internal(what));
            }
            self.labels[i] = W::of(label.wide() ^ u64::from(word & 1));
        }
        file.write_at(bytemuck::cast_slice(&self.labels), start * W::BYTES as u64)?;
        self.answer(start, back)
    }

    /// Takes in the labels of the run's roots.
    fn told(&mut self, start: u64, back: &mut Relay<Back<W>>) -> Result<()> {
        let mut cursor = back.cursor();
        loop {
            let n = back.read(&mut cursor, &mut self.block)?;
            if n == 0 {
                return Ok(());
            }
            for record in &self.block[..n] {
                if let Answer::Label(label) = record.says() {
                    let node = self.whole - 1 - record.node();
                    self.labels[(node - start) as usize] = W::of(label);
                }
            }
        }
    }

    /// Answers the children of the run's nodes.
    fn answer(&mut self, start: u64, back: &mut Relay<Back<W>>) -> Result<()> {
        loop {
            let n = back.take(&mut self.block)?;
            if n == 0 {
                return Ok(());
            }
            for record in &self.block[..n] {
                if let Answer::Ask(child, parity) = record.says() {
                    let parent = self.whole - 1 - record.node();
                    let label = self.labels[(parent - start) as usize].wide();
                    let label = label ^ u64::from(parity);
                    back.push(Back::label(self.whole - 1 - child, label))?;
                }
            }
        }
    }
}
