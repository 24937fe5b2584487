//! Chunks to bytes, in parallel: what was dealt to each, its positions, the walk, and behind that what
//! is kept besides the mesh: the order of the folder, the components of triangles.
//!
//! Memory: for each thread `least::TRIANGLE_BYTES`, `least::extra_bytes` and a record for each
//! triangle of a chunk, `least::VERTEX_BYTES` for each vertex, with fewer threads when there is less.
//! I/O: the dealt records once; of G and of the labels what the chunks name; the bytes once.

use super::Level;
use super::chunk::{self, Coded, Piece, order};
use super::chunks::Chunks;
use super::deal::{Deal, Dealt};
use super::file::Entry;
use super::gather::Gather;
use super::grid::Grid;
use super::labels;
use super::least;
use super::numbers;
use super::seam::Use;
use crate::chunk::ids::LocalIds;
use crate::corner::Index;
use crate::disk::{DataFile, ScratchFile, Workers, Workspace};
use crate::error::{Error, Result, conserve};
use crate::folder;
use crate::shuffle::{Buckets, Shuffle, Writer};
use crate::table::array::{Coords, Width};
use std::sync::Mutex;

/// The coding of all chunks.
pub(super) struct Job<'a, W> {
    pub ws: &'a Workspace,
    pub g: Option<&'a (Coords, DataFile)>,
    pub grid: Grid,
    pub labels: Option<&'a (Width, DataFile)>,
    pub counts: &'a folder::Counts,
    pub level: Level,
    pub keep_order: bool,
    /// Bytes a triangle of what is kept besides the mesh.
    pub extra: u64,
    pub dealt: &'a Deal<W>,
    pub chunks: &'a Chunks,
    pub bodies: ScratchFile,
    pub done: Mutex<Vec<(Entry, u64)>>,
}

/// What a thread holds.
struct Thread<'a, W: Index> {
    records: Vec<Dealt<W>>,
    interval: u64,
    part: u64,
    ids: LocalIds,
    gather: Gather<'a>,
    uses: Writer<'a, Use>,
}

impl<W: Index> Job<'_, W> {
    /// Codes all chunks with as many threads as there is memory for.
    pub fn run(&self) -> Result<Buckets<Use>> {
        let (ws, budget) = (self.ws, &self.ws.budget);
        let intervals = 0..self.dealt.counts.len() as u64;
        let largest = intervals.map(|i| self.chunks.largest(i)).max().unwrap_or(0);
        let records = size_of::<Dealt<W>>() as u64;
        let uses = least::uses(self.dealt.buckets.records());
        let sorter = (2 * largest * records).clamp(least::SORTER, 64 << 20);
        let chunk = self
            .chunks
            .bytes(&self.dealt.vertices, records + self.extra);
        let own = least::thread_bytes(chunk, &uses);
        least::check_chunk(budget, own, self.uses_at_most())?;
        let threads = (budget.free() / (own + sorter)).clamp(1, ws.workers.count() as u64);
        // Some is left for what shuffles note of more than they expected.
        let sorter = (budget.free() / threads / 16 * 15)
            .saturating_sub(own)
            .clamp(least::SORTER, sorter);
        let few = Workers::new(threads as usize)?;
        let vertices = self.counts.vertices.max(1);
        let shuffle = Shuffle::new(ws, "uses of shared vertices", 0..vertices, uses)?;
        let progress = &ws.progress;
        progress.begin("code chunks", "triangles", self.dealt.buckets.records());
        few.run(
            self.dealt.buckets.count(),
            || {
                let lease = budget.lease("a chunk", own - uses.writer_bytes())?;
                let thread = Thread {
                    records: Vec::new(),
                    interval: 0,
                    part: 0,
                    ids: LocalIds::default(),
                    gather: Gather::new(self.g, self.grid, self.labels),
                    uses: shuffle.writer()?,
                };
                Ok((thread, self.dealt.buckets.sorter(sorter)?, lease))
            },
            |(thread, sorter, _), bucket| {
                self.dealt.buckets.sorted(bucket, sorter, &mut |records| {
                    records.iter().try_for_each(|&r| self.take(thread, r))
                })?;
                let left = thread.records.len() as u64;
                conserve("code chunks", "records of no chunk", 0, left)
            },
            |(thread, _, _)| thread.uses.finish(),
        )?;
        progress.end();
        shuffle.finish()
    }

    /// No more vertices than these are noted of all chunks.
    fn uses_at_most(&self) -> u64 {
        match self.chunks.total() {
            0 | 1 => 0,
            _ => 3 * self.dealt.buckets.records(),
        }
    }

    /// Takes a record; a chunk that is full is coded.
    fn take(&self, thread: &mut Thread<W>, record: Dealt<W>) -> Result<()> {
        if thread.records.is_empty() && thread.interval != record.interval() {
            (thread.interval, thread.part) = (record.interval(), 0);
        }
        thread.records.push(record);
        let (interval, part) = (thread.interval, thread.part);
        let size = self.chunks.before(interval, part + 1) - self.chunks.before(interval, part);
        if thread.records.len() as u64 == size {
            let chunk = self.chunks.first[interval as usize] + part;
            self.code(thread, chunk)?;
            self.ws.progress.advance(size);
            thread.records.clear();
            thread.part += 1;
        }
        Ok(())
    }

    /// Codes the components of the chunk's triangles with these corners, in their order.
    fn label(&self, thread: &mut Thread<W>, corners: &[u32], entry: &mut Entry) -> Result<Vec<u8>> {
        let Some((_, file)) = self.labels else {
            // All that there are have the same.
            entry.end_component = u64::from(!corners.is_empty());
            return Ok(Vec::new());
        };
        let named = |r: &&Dealt<W>| r.vertices()[1] != W::NONE;
        // Triangles lie ahead of loose vertices, in the order of their numbers.
        let records = thread.records.iter().take_while(named);
        let triangles: Vec<u64> = records.map(Dealt::number).collect();
        let found = thread.gather.labels(&triangles)?;
        let components = self.counts.components;
        let label = |&c: &u32| match found[c as usize / 3] {
            label if label < components => Ok(label),
            label => Err(Error::input(
                file.path(),
                format!("triangle {}", triangles[c as usize / 3]),
                format!("a component below {components}"),
                label.to_string(),
                "the folder is damaged; `cornermill verify` says how; build it again",
            )),
        };
        let labels = corners.iter().map(label).collect::<Result<Vec<_>>>()?;
        Ok(code_labels(entry, &labels))
    }

    /// Codes a chunk.
    fn code(&self, thread: &mut Thread<W>, chunk: u64) -> Result<()> {
        let whole = self.chunks.of(thread.interval) == 1;
        let flat: Vec<W> = thread
            .records
            .iter()
            .flat_map(|r| match r.vertices() {
                [v, b, _] if b == W::NONE => [v; 3],
                all => all,
            })
            .collect();
        thread.ids.assign(&flat);
        drop(flat);
        let mut piece = Piece::default();
        let locals = thread.ids.local().as_chunks::<3>().0;
        for (record, local) in thread.records.iter().zip(locals) {
            if record.vertices()[1] == W::NONE {
                piece.loose.push(local[0]);
            } else {
                piece.triangles.push(*local);
            }
        }
        piece.positions = thread.gather.positions(&thread.ids)?;
        let coded = chunk::encode(&piece, self.level)
            .map_err(|e| Error::Internal(format!("chunk {chunk} cannot be coded: {}", e.0)))?;
        let order = order(&coded.numbers);
        for (place, &number) in coded.places.iter().enumerate() {
            let v = thread.ids.global(order[number as usize]);
            if !whole || self.dealt.shared.has(v) {
                thread.uses.push(Use([v, chunk, place as u64]))?;
            }
        }
        let mut entry = entry_of(&coded, &piece, &order);
        let mut bytes = coded.bytes;
        if self.keep_order {
            let corners = coded.corners.iter().map(|&c| {
                let triangle = thread.records[c as usize / 3].number();
                3 * triangle + u64::from(c % 3)
            });
            let vertices = order.iter().map(|&local| thread.ids.global(local));
            let numbers = numbers::encode(corners, vertices);
            entry.number_bytes = numbers.len() as u64;
            bytes.extend(numbers);
        }
        let surface = &coded.corners[..coded.extent.triangles];
        bytes.extend(self.label(thread, surface, &mut entry)?);
        let at = self.bodies.append(&bytes)?;
        let mut done = self.done.lock().unwrap_or_else(|e| e.into_inner());
        done[chunk as usize] = (entry, at);
        Ok(())
    }
}

/// Codes the components of a chunk's triangles; no bytes when all have the same.
fn code_labels(entry: &mut Entry, labels: &[u64]) -> Vec<u8> {
    let [first, end] = match (labels.iter().min(), labels.iter().max()) {
        (Some(first), Some(last)) => [*first, last + 1],
        _ => [0; 2],
    };
    (entry.first_component, entry.end_component) = (first, end);
    if end - first < 2 {
        return Vec::new();
    }
    let bytes = labels::encode(labels.iter().copied(), first);
    entry.label_bytes = bytes.len() as u64;
    bytes
}

/// What the index says of a chunk, as far as it is known yet.
fn entry_of(coded: &Coded, piece: &Piece, order: &[u32]) -> Entry {
    let mut entry = Entry {
        bytes: coded.bytes.len() as u64,
        triangles: coded.extent.triangles as u64,
        degenerate: coded.extent.degenerate as u64,
        vertices: coded.extent.vertices as u64,
        loose: coded.extent.loose as u64,
        turns: u64::from(coded.extent.turns),
        connectivity: coded.split[0].min(coded.bytes.len() as u64),
        ..Entry::default()
    };
    let points = || order.iter().map(|&local| piece.positions[local as usize]);
    let extreme = |most: fn(i32, i32) -> i32| {
        let of = |p: [i32; 3], q: [i32; 3]| std::array::from_fn(|k| most(p[k], q[k]));
        points().reduce(of).unwrap_or([0; 3])
    };
    (entry.low, entry.high) = (extreme(i32::min), extreme(i32::max));
    entry
}
