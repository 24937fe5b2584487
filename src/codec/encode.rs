//! A mesh folder to a compressed file.
//!
//! 1. `deal`: triangles to chunks by place.
//! 2. Each chunk is coded, in parallel; its bytes go to scratch. Of vertices that other chunks may
//!    have too, chunk and number are noted.
//! 3. [`seam`]: each shared vertex becomes the first chunk's, and a reference elsewhere.
//! 4. The chunks are written one behind the other, and the index behind them.
//!
//! Why the bytes are always the same: what is in a chunk, and in which order, depends on the folder
//! alone, and chunks are numbered by interval, not by when they are done.
//!
//! Memory: for each thread `least::TRIANGLE_BYTES` and a record for each triangle
//! of a chunk, `least::VERTEX_BYTES` for each vertex, with fewer threads when there
//! is less; what the dealing and the sorts state. I/O: theirs, G once more by chunk, the file twice.

use super::Level;
use super::chunk::{self, Coded, Piece, order};
use super::chunks::Chunks;
use super::deal::{Deal, Dealt, deal};
use super::file::{Entry, Head, MOST_TRIANGLES, ending};
use super::gather::Gather;
use super::grid::{Grid, Precision};
use super::least;
use super::out::Out;
use super::seam::{self, Span, Use};
use crate::chunk::ids::LocalIds;
use crate::corner::Index;
use crate::disk::{DataFile, Target, Workers, Workspace};
use crate::error::{Error, Result, conserve};
use crate::folder::{self, Folder};
use crate::shuffle::{Shuffle, Writer};
use crate::table::array::{self, Coords};
use std::path::PathBuf;
use std::sync::Mutex;
use xxhash_rust::xxh3::Xxh3;

/// What to encode, and where to.
#[derive(Clone, Debug)]
pub struct EncodeRequest {
    /// The file to write.
    pub target: PathBuf,
    /// How exact coordinates are kept.
    pub precision: Precision,
    /// How much is spent on smallness.
    pub level: Level,
    /// Replace a file that exists.
    pub force: bool,
    /// For tests: the most triangles of a chunk, at most [`MOST_TRIANGLES`].
    #[doc(hidden)]
    pub most: u64,
}

impl EncodeRequest {
    /// A request for the fast level that replaces nothing.
    pub fn new(target: impl Into<PathBuf>, precision: Precision) -> EncodeRequest {
        EncodeRequest {
            target: target.into(),
            precision,
            level: Level::Fast,
            force: false,
            most: MOST_TRIANGLES,
        }
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EncodeCount {
    /// Triangles.
    pub triangles: u64,
    /// Vertices.
    pub vertices: u64,
    /// Chunks.
    pub chunks: u64,
    /// References to vertices of earlier chunks.
    pub references: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of connectivity, references included.
    pub connectivity: u64,
    /// Bytes of positions.
    pub positions: u64,
}

/// Encodes a folder.
///
/// # Errors
/// [`Error::Usage`] when the target exists or lies in the folder, or precision and coordinates do not go together;
/// [`Error::Input`] for a damaged folder; [`Error::Budget`], [`Error::Io`], [`Error::DiskLimit`].
pub fn encode(ws: &Workspace, folder: &Folder, request: &EncodeRequest) -> Result<EncodeCount> {
    let target = Target::create(folder.path(), &request.target, request.force)?;
    let counts = &folder.manifest().counts;
    // Numbers of triangles and of loose vertices behind them.
    let all = counts.triangles.saturating_add(counts.vertices);
    if all < u64::from(u32::MAX) {
        encode_as::<u32>(ws, folder, request, target)
    } else {
        encode_as::<u64>(ws, folder, request, target)
    }
}

fn encode_as<W: Index>(
    ws: &Workspace,
    folder: &Folder,
    request: &EncodeRequest,
    target: Target,
) -> Result<EncodeCount> {
    let counts = &folder.manifest().counts;
    let g = match Coords::of(folder)? {
        Some(kind) => {
            let shape = [counts.vertices, 3];
            Some((kind, array::open(folder, folder::G, kind.descr(), &shape)?))
        }
        None => None,
    };
    least::check::<W>(&ws.budget, counts, request.most)?;
    let grid = Grid::find(ws, g.as_ref(), counts.vertices, request.precision)?;
    let dealt = deal::<W>(ws, folder, g.as_ref(), grid, request.most)?;
    let chunks = Chunks::new(&dealt.counts, request.most);
    let table = least::table_bytes(chunks.total());
    let _table = ws.budget.lease("the table of chunks", table)?;
    let job = Job {
        ws,
        g: g.as_ref(),
        grid,
        vertices: counts.vertices,
        level: request.level,
        dealt: &dealt,
        chunks: &chunks,
        bodies: ws.scratch.file("coded chunks")?,
        done: Mutex::new(vec![(Entry::default(), 0); chunks.total() as usize]),
    };
    let uses = job.run()?;
    let mut spans = vec![Span::default(); chunks.total() as usize];
    let references = ws.scratch.file("coded references")?;
    seam::resolve(ws, uses, &mut spans, &references)?;
    let Job { bodies, done, .. } = job;
    let done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    hold(&done, &spans, counts)?;
    let wide = g.as_ref().is_some_and(|(kind, _)| *kind == Coords::F8);
    let head = Head::new(request.level, grid, wide, counts.triangles, counts.vertices);
    let mut out = Out::new(ws, target);
    out.put(bytemuck::bytes_of(&head))?;
    let mut entries = Vec::with_capacity(done.len());
    for ((mut entry, at), span) in done.into_iter().zip(spans) {
        out.summed = Xxh3::new();
        entry.at = out.written;
        out.copy(&bodies, at, entry.bytes)?;
        out.copy(&references, span.at, span.bytes)?;
        (entry.reference_bytes, entry.references) = (span.bytes, span.count);
        entry.sum = out.summed.digest();
        entries.push(entry);
    }
    out.put(&ending(&entries, out.written))?;
    let bytes = out.finish()?;
    let sum = |of: fn(&Entry) -> u64| entries.iter().map(of).sum::<u64>();
    Ok(EncodeCount {
        triangles: counts.triangles,
        vertices: counts.vertices,
        chunks: entries.len() as u64,
        references: sum(|e| e.references),
        bytes,
        connectivity: sum(|e| e.connectivity + e.reference_bytes),
        positions: sum(|e| e.bytes - e.connectivity),
    })
}

/// Every triangle is in one chunk, and every vertex is one chunk's own.
fn hold(done: &[(Entry, u64)], spans: &[Span], counts: &folder::Counts) -> Result<()> {
    let triangles = done.iter().map(|(entry, _)| entry.all_triangles()).sum();
    conserve("code chunks", "triangles", counts.triangles, triangles)?;
    let all: u64 = done.iter().map(|(entry, _)| entry.vertices).sum();
    let references: u64 = spans.iter().map(|span| span.count).sum();
    let own = all.saturating_sub(references);
    conserve("shared vertices", "vertices", counts.vertices, own)
}

/// The coding of all chunks.
struct Job<'a, W> {
    ws: &'a Workspace,
    g: Option<&'a (Coords, DataFile)>,
    grid: Grid,
    vertices: u64,
    level: Level,
    dealt: &'a Deal<W>,
    chunks: &'a Chunks,
    bodies: crate::disk::ScratchFile,
    done: Mutex<Vec<(Entry, u64)>>,
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
    fn run(&self) -> Result<crate::shuffle::Buckets<Use>> {
        let (ws, budget) = (self.ws, &self.ws.budget);
        let intervals = 0..self.dealt.counts.len() as u64;
        let largest = intervals.map(|i| self.chunks.largest(i)).max().unwrap_or(0);
        let records = size_of::<Dealt<W>>() as u64;
        let uses = least::uses(self.dealt.buckets.records());
        let sorter = (2 * largest * records).clamp(least::SORTER, 64 << 20);
        let chunk = self.chunks.bytes(&self.dealt.vertices, records);
        let own = least::thread_bytes(chunk, &uses);
        least::check_chunk(budget, own, self.uses_at_most())?;
        let threads = (budget.free() / (own + sorter)).clamp(1, ws.workers.count() as u64);
        // Some is left for what shuffles note of more than they expected.
        let sorter = (budget.free() / threads / 16 * 15)
            .saturating_sub(own)
            .clamp(least::SORTER, sorter);
        let few = Workers::new(threads as usize)?;
        let vertices = self.vertices.max(1);
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
                    gather: Gather::new(self.g, self.grid),
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
        for (number, &local) in order.iter().enumerate() {
            let v = thread.ids.global(local);
            if !whole || self.dealt.shared.has(v) {
                thread.uses.push(Use([v, chunk, number as u64]))?;
            }
        }
        let entry = entry_of(&coded, &piece, &order);
        let at = self.bodies.append(&coded.bytes)?;
        let mut done = self.done.lock().unwrap_or_else(|e| e.into_inner());
        done[chunk as usize] = (entry, at);
        Ok(())
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_and_vertices_that_are_lost_are_missed() {
        let entry = |triangles, vertices| {
            let entry = Entry {
                triangles,
                vertices,
                ..Entry::default()
            };
            (entry, 0)
        };
        let span = |count| Span {
            count,
            ..Span::default()
        };
        let counts = folder::Counts {
            triangles: 7,
            vertices: 6,
            ..folder::Counts::default()
        };
        let done = [entry(3, 4), entry(4, 5)];
        let held =
            |done: &[_], spans: &[Span]| hold(done, spans, &counts).map_err(|e| e.to_string());
        held(&done, &[span(0), span(3)]).unwrap();
        let said = held(&[entry(3, 4), entry(3, 5)], &[span(0), span(3)]).unwrap_err();
        assert!(
            said.contains("'code chunks' was given 7 triangles, and accounts for 6"),
            "{said}"
        );
        let said = held(&done, &[span(0), span(2)]).unwrap_err();
        assert!(
            said.contains("'shared vertices' was given 6 vertices, and accounts for 7"),
            "{said}"
        );
    }
}
