//! A mesh folder to a compressed file.
//!
//! 1. `deal`: triangles to chunks by place.
//! 2. `code`: each chunk is coded, in parallel; its bytes go to scratch. Of vertices
//!    that other chunks may have too, chunk and number are noted.
//! 3. [`seam`]: each shared vertex becomes the first chunk's, and a reference elsewhere.
//! 4. The chunks are written one behind the other, and the index behind them.
//!
//! Why the bytes are always the same: what is in a chunk, and in which order, depends on the folder
//! alone, and chunks are numbered by interval, not by when they are done.
//!
//! Memory: what the dealing, the coding and the sorts state. I/O: theirs, the file twice.

use super::Level;
use super::chunks::Chunks;
use super::code::Job;
use super::deal::deal;
use super::file::{Entry, Head, MOST_TRIANGLES, ending};
use super::grid::{Grid, Precision};
use super::least;
use super::out::Out;
use super::seam::{self, Span};
use crate::corner::Index;
use crate::disk::{Target, Workspace};
use crate::error::{Result, conserve};
use crate::folder::{self, Folder, Outputs};
use crate::table::array::{self, Coords, Width};
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
    /// Keep the numbers of triangles and vertices, and the first corner of each triangle.
    pub keep_order: bool,
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
            keep_order: false,
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
    /// Bytes that say which component each triangle is of.
    pub components: u64,
    /// Bytes of the order, when it is kept.
    pub order: u64,
}

/// Encodes a folder.
///
/// # Errors
/// [`crate::Error::Usage`] when the target is refused (see [`Outputs::file`]), or precision and coordinates do not go together;
/// [`crate::Error::Input`] for a damaged folder; [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::DiskLimit`].
pub fn encode(ws: &Workspace, folder: &Folder, request: &EncodeRequest) -> Result<EncodeCount> {
    let target = Outputs::new(&[folder.path()], request.force).create(&request.target)?;
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
    let labels = match counts.components {
        0 | 1 => None,
        _ => {
            let width = Width::of(folder)?;
            let shape = [counts.triangles];
            let file = array::open(folder, folder::COMPONENT, width.descr(), &shape)?;
            Some((width, file))
        }
    };
    let extra = least::extra_bytes(labels.is_some(), request.keep_order);
    least::check::<W>(&ws.budget, counts, request.most, extra)?;
    let grid = Grid::find(ws, g.as_ref(), counts.vertices, request.precision)?;
    let dealt = deal::<W>(ws, folder, g.as_ref(), grid, request.most)?;
    let chunks = Chunks::new(&dealt.counts, request.most);
    let table = least::table_bytes(chunks.total());
    let _table = ws.budget.lease("the table of chunks", table)?;
    let job = Job {
        ws,
        g: g.as_ref(),
        grid,
        labels: labels.as_ref(),
        counts,
        level: request.level,
        keep_order: request.keep_order,
        extra,
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
    let head = Head::new(
        request.level,
        grid,
        (wide, request.keep_order),
        counts.triangles,
        counts.vertices,
    );
    let mut out = Out::new(ws, target);
    out.put(bytemuck::bytes_of(&head))?;
    let mut entries = Vec::with_capacity(done.len());
    for ((mut entry, at), span) in done.into_iter().zip(spans) {
        out.summed = Xxh3::new();
        entry.at = out.written;
        out.copy(&bodies, at, entry.bytes)?;
        out.copy(&references, span.at, span.bytes)?;
        (entry.reference_bytes, entry.references) = (span.bytes, span.count);
        let numbers_at = at + entry.bytes;
        out.copy(&bodies, numbers_at, entry.number_bytes)?;
        entry.sum = out.summed.digest();
        out.summed = Xxh3::new();
        let labels_at = numbers_at + entry.number_bytes;
        out.copy(&bodies, labels_at, entry.label_bytes)?;
        entry.label_sum = out.summed.digest();
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
        components: sum(|e| e.label_bytes),
        order: sum(|e| e.number_bytes),
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
