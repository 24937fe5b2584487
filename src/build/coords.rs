//! Coordinates: brings G to its place in the new folder, and finds its bounding box.
//!
//! Memory: 32 Ki vertices a thread. I/O: G read once; written once unless it lies there.

use super::arrays::{CoordReader, OutArray};
use crate::chunk::grid::Bounds;
use crate::chunk::measure::Coord;
use crate::disk::{Counters, DataFile, Workspace};
use crate::error::Result;
use crate::folder::{self, WarmSums, npy::DATA_START};
use crate::input::{CoordArray, CoordKind, Endian, Source};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Vertices at a time.
const STEP: u64 = 32 << 10;

/// G in the new folder.
pub struct Placed {
    /// The file, for the manifest.
    pub file: OutArray,
    /// The same, for reading.
    pub array: CoordArray,
    /// Bounding box of the finite vertices.
    pub bounds: Bounds,
}

/// Copies (and converts) G to the folder, or only reads it when it lies there. `input` takes the
/// sums of the file that it comes from.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`], [`crate::Error::Input`] when it is cut short.
pub fn place<X: Coord>(
    ws: &Workspace,
    dir: &Path,
    g: &CoordArray,
    input: Option<&WarmSums>,
) -> Result<Placed> {
    let row = 3 * X::BYTES as u64;
    let shape = [g.vertices, 3];
    let file = OutArray::create(dir, folder::G, X::DESCR, &shape, row, ws)?;
    let threads = ws.workers.count() as u64;
    // At small budgets smaller steps do as well.
    let share = ws.budget.free() / 2 / threads / CoordReader::<X>::BYTES;
    let step = STEP.min(share).max(1024);
    let _lease = ws
        .budget
        .lease("vertices", threads * step * CoordReader::<X>::BYTES)?;
    let bounds = Mutex::new(Bounds::default());
    ws.workers.run(
        g.vertices.div_ceil(step),
        || Ok((CoordReader::<X>::new(g), Bounds::default())),
        |(reader, bounds), unit| {
            let first = unit * step;
            let rows = reader.read(first, step.min(g.vertices - first))?;
            rows.iter().for_each(|p| bounds.add(p.map(Coord::wide)));
            if g.placed {
                file.seen(first, rows)?;
            } else {
                file.write(first, rows)?;
            }
            if let Some(input) = input {
                let row = 3 * g.kind.bytes();
                let (at, bytes) = (g.at + first * row, rows.len() as u64 * row);
                input.seen(g.source.data(), at, bytes)?;
            }
            ws.progress.advance(rows.len() as u64);
            Ok(())
        },
        |(_, part)| {
            bounds
                .lock()
                .unwrap_or_else(|e| e.into_inner())
                .merge(&part);
            Ok(())
        },
    )?;
    let kind = if X::BYTES == 4 {
        CoordKind::F4
    } else {
        CoordKind::F8
    };
    Ok(Placed {
        array: array_of(&file, kind, &ws.io)?,
        file,
        bounds: bounds.into_inner().unwrap_or_else(|e| e.into_inner()),
    })
}

/// G as the folder has it.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn array_of(file: &OutArray, kind: CoordKind, io: &Arc<Counters>) -> Result<CoordArray> {
    Ok(CoordArray {
        source: Source::Named(DataFile::open(file.file.path(), io)?),
        at: DATA_START,
        kind,
        endian: Endian::Little,
        vertices: file.shape[0],
        placed: true,
    })
}
