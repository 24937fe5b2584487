//! The pass over the triangles: ranges, degenerate triangles, flipped bits, and everything
//! that a triangle says about itself; its corners go to the sort by edge.
//!
//! Why one pass in any order: what is checked of a triangle here needs only its own rows of
//! V, O, `component.npy` and `flipped.npy`. `degenerate.npy` is ascending, so a chunk finds
//! its part by bisection. Vertices that occur leave [`spans`](super::spans), and in
//! measured folders counts of their triangles (see [`valences`](super::valences)).
//!
//! Memory: [`BYTES`] a triangle of a chunk, and the buffers of the sorts, each thread its own.
//! I/O: V, O, labels and bits once; see [`coords`](super::coords) for G.

use super::coords::{Block, Coords};
use super::edge_record::{EdgeRecord, Facing};
use super::far::Wanted;
use super::open::Arrays;
use super::read::IdReader;
use super::row::Row;
use super::sort::{Filler, Sorter};
use super::spans::Span;
use super::tally::{Table, Tally};
use super::valences::Seen;
use super::verdict::{At, Check, Findings, id};
use crate::disk::{Lease, Workspace};
use crate::error::Result;
use crate::folder::npy::DATA_START;
use crate::folder::{DEGENERATE, FLIPPED};
use std::sync::Mutex;

/// Bytes of a triangle in a chunk: V, O, raw ids, label, bit, vertices in order, points.
pub(super) const BYTES: u64 = 24 + 24 + 24 + 8 + 1 + 48 + 72 + 7;

/// Where the pass sends records, and how much memory a thread gives to what.
pub(super) struct Outlets<'a, E> {
    pub(super) edges: &'a Sorter<E>,
    pub(super) tallies: &'a Sorter<Tally>,
    pub(super) spans: &'a Sorter<Span>,
    pub(super) wanted: &'a Sorter<Wanted>,
    /// In measured folders.
    pub(super) seen: Option<&'a Sorter<Seen>>,
    /// Triangles of a chunk, a multiple of 8.
    pub(super) chunk: u64,
    /// Bytes of a thread's table of component sums.
    pub(super) table: u64,
}

/// What the pass counts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counted {
    pub(super) degenerate: u64,
    pub(super) flipped: u64,
}

/// Runs the pass.
pub(super) fn run<E: EdgeRecord>(
    ws: &Workspace,
    arrays: &Arrays,
    coords: Option<&Coords>,
    findings: &Findings,
    outlets: &Outlets<E>,
) -> Result<Counted> {
    ws.progress
        .begin("verify: triangles", "triangles", arrays.triangles);
    ascending(ws, arrays, findings)?;
    let total = Mutex::new(Counted::default());
    ws.workers.run(
        arrays.triangles.div_ceil(outlets.chunk),
        || Lane::new(ws, arrays, coords, findings, outlets),
        |lane, unit| {
            let first = unit * outlets.chunk;
            let n = outlets.chunk.min(arrays.triangles - first);
            lane.chunk(first, n as usize)?;
            ws.progress.advance(n);
            ws.progress.usage(ws.budget.used(), ws.scratch.used());
            Ok(())
        },
        |lane| {
            let mut total = total.lock().unwrap_or_else(|e| e.into_inner());
            total.degenerate += lane.counted.degenerate;
            total.flipped += lane.counted.flipped;
            lane.finish()
        },
    )?;
    padding(arrays, findings)?;
    ws.progress.end();
    Ok(total.into_inner().unwrap_or_else(|e| e.into_inner()))
}

/// Checks that `degenerate.npy` ascends, on which the chunks rely to find their part.
fn ascending(ws: &Workspace, arrays: &Arrays, findings: &Findings) -> Result<()> {
    let list = &arrays.degenerate;
    let mut reader = IdReader::new(ws, list, 64 << 10)?;
    let mut before = None;
    for row in 0..list.len {
        let now = reader.get(row)?;
        if now <= before || now.is_some_and(|t| t >= arrays.triangles) {
            findings.add(Check::Degenerate, DEGENERATE, At::Row(row), || {
                let found = format!("triangle {}", id(now.unwrap_or(u64::MAX)));
                let least = before.map_or("one".into(), |t| format!("one above {}", id(t)));
                (found, format!("{least}, below {}", arrays.triangles))
            });
        }
        before = now;
    }
    Ok(())
}

/// Checks the bits of `flipped.npy` beyond the last triangle.
fn padding(arrays: &Arrays, findings: &Findings) -> Result<()> {
    let used = arrays.triangles % 8;
    if used == 0 {
        return Ok(());
    }
    let at = DATA_START + arrays.triangles / 8;
    let mut byte = [0];
    arrays.flipped.read_at(&mut byte, at)?;
    if byte[0] >> used != 0 {
        findings.add(Check::FlippedBits, FLIPPED, At::Byte(at), || {
            let found = format!("{:#04x}, with bits beyond the last triangle", byte[0]);
            (found, "zeros there".into())
        });
    }
    Ok(())
}

/// A thread of the pass.
struct Lane<'a, E: EdgeRecord> {
    arrays: &'a Arrays,
    coords: Option<&'a Coords<'a>>,
    findings: &'a Findings,
    v: Vec<u64>,
    o: Vec<u64>,
    label: Vec<u64>,
    bits: Vec<u8>,
    raw: Vec<u8>,
    /// (vertex, place in the chunk), in order.
    order: Vec<(u64, u32)>,
    points: Vec<[f64; 3]>,
    block: Block,
    edges: Filler<'a, E>,
    table: Table<'a>,
    spans: Filler<'a, Span>,
    wanted: Filler<'a, Wanted>,
    seen: Option<Filler<'a, Seen>>,
    /// The list of degenerate triangles.
    listed: IdReader<'a>,
    counted: Counted,
    _lease: Lease,
}

impl<'a, E: EdgeRecord> Lane<'a, E> {
    fn new(
        ws: &Workspace,
        arrays: &'a Arrays,
        coords: Option<&'a Coords<'a>>,
        findings: &'a Findings,
        outlets: &Outlets<'a, E>,
    ) -> Result<Lane<'a, E>> {
        let bytes = outlets.chunk * BYTES + Block::BYTES;
        Ok(Lane {
            _lease: ws.budget.lease("a chunk of triangles", bytes)?,
            arrays,
            coords,
            findings,
            v: Vec::new(),
            o: Vec::new(),
            label: Vec::new(),
            bits: Vec::new(),
            raw: Vec::new(),
            order: Vec::new(),
            points: Vec::new(),
            block: Block::new(),
            edges: outlets.edges.filler(ws)?,
            table: Table::new(ws, outlets.tallies, arrays.components, outlets.table)?,
            spans: outlets.spans.filler(ws)?,
            wanted: outlets.wanted.filler(ws)?,
            seen: outlets.seen.map(|seen| seen.filler(ws)).transpose()?,
            listed: IdReader::new(ws, &arrays.degenerate, 4 << 10)?,
            counted: Counted::default(),
        })
    }

    fn finish(self) -> Result<()> {
        self.edges.finish()?;
        self.table.finish()?;
        self.spans.finish()?;
        self.seen.map_or(Ok(()), Filler::finish)?;
        self.wanted.finish()
    }

    fn chunk(&mut self, first: u64, n: usize) -> Result<()> {
        let arrays = self.arrays;
        for array in [&mut self.v, &mut self.o] {
            array.clear();
            array.reserve_exact(3 * n);
            array.resize(3 * n, 0);
        }
        self.label.clear();
        self.label.reserve_exact(n);
        self.label.resize(n, 0);
        self.raw.reserve_exact(24 * n);
        self.bits.resize(n.div_ceil(8), 0);
        arrays.v.read(3 * first, &mut self.v, &mut self.raw)?;
        arrays.o.read(3 * first, &mut self.o, &mut self.raw)?;
        arrays
            .component
            .read(first, &mut self.label, &mut self.raw)?;
        let at = DATA_START + first / 8;
        arrays.flipped.read_at(&mut self.bits, at)?;
        let mut place = arrays.degenerate.lower_bound(first)?;
        // A list in disorder must not make every chunk read all of it.
        let most = place + n as u64;
        let before = self.counted.degenerate;
        for i in 0..n {
            let row = self.row(first, i);
            row.ranges(arrays, self.findings);
            self.counted.flipped += u64::from(row.flipped);
            while place < most && self.listed.get(place)?.is_some_and(|t| t < row.t) {
                place += 1;
            }
            let listed = self.listed.get(place)? == Some(row.t);
            if row.is_degenerate() {
                self.counted.degenerate += 1;
                row.degenerate(self.findings);
                if !listed {
                    row.unlisted(self.findings);
                }
            } else {
                if listed {
                    row.wrongly_listed(self.findings);
                }
                self.sound(&row)?;
            }
        }
        self.sort_vertices();
        self.spans()?;
        self.valences(before != self.counted.degenerate)?;
        self.measure(first)
    }

    fn row(&self, first: u64, i: usize) -> Row {
        let three = |of: &[u64]| [of[3 * i], of[3 * i + 1], of[3 * i + 2]];
        Row {
            t: first + i as u64,
            v: three(&self.v),
            o: three(&self.o),
            label: self.label[i],
            flipped: self.bits[i / 8] >> (i % 8) & 1 != 0,
        }
    }

    /// A triangle with three vertices: its label, its sums, its three corners by edge.
    fn sound(&mut self, row: &Row) -> Result<()> {
        let labelled = row.label < self.arrays.components;
        if labelled {
            let tally = self.table.of(row.label)?;
            tally.triangles += 1;
            tally.flipped += u64::from(row.flipped);
            tally.first = tally.first.min(row.t << 1 | u64::from(row.flipped));
        } else {
            row.unlabelled(self.arrays.components, self.findings);
        }
        for k in 0..3 {
            let (next, prev) = (row.v[(k + 1) % 3], row.v[(k + 2) % 3]);
            let hi = next.max(prev);
            let apex = Some(row.v[k]).filter(|&v| hi < v && v < self.arrays.vertices);
            self.edges.push(E::pack(&Facing {
                lo: next.min(prev),
                hi,
                corner: 3 * row.t + k as u64,
                opposite: row.o[k],
                label: if labelled { row.label } else { u64::MAX },
                apex: apex.unwrap_or(u64::MAX),
                upward: next < prev,
                flipped: row.flipped,
            }))?;
        }
        Ok(())
    }

    fn sort_vertices(&mut self) {
        self.order.clear();
        self.order.reserve_exact(self.v.len());
        let known = self.arrays.vertices;
        let all = self.v.iter().enumerate();
        self.order.extend(
            all.filter(|(_, v)| **v < known)
                .map(|(i, &v)| (v, i as u32)),
        );
        self.order.sort_unstable();
    }

    /// The vertices that occur, as spans.
    fn spans(&mut self) -> Result<()> {
        let mut span: Option<Span> = None;
        for &(v, _) in &self.order {
            match &mut span {
                Some(span) if v < span.to => {}
                Some(span) if v == span.to => span.to = v + 1,
                _ => {
                    if let Some(span) = span {
                        self.spans.push(span)?;
                    }
                    span = Some(Span { from: v, to: v + 1 });
                }
            }
        }
        span.map_or(Ok(()), |span| self.spans.push(span))
    }

    /// The triangles at each vertex that occurs; `some` says that some are degenerate.
    fn valences(&mut self, some: bool) -> Result<()> {
        let Some(seen) = &mut self.seen else {
            return Ok(());
        };
        let v = &self.v;
        let whole = |place: u32| {
            let first = place as usize / 3 * 3;
            let (a, b, c) = (v[first], v[first + 1], v[first + 2]);
            a != b && b != c && c != a
        };
        for corners in self.order.chunk_by(|a, b| a.0 == b.0) {
            let times = match some {
                true => corners.iter().filter(|(_, place)| whole(*place)).count(),
                false => corners.len(),
            } as u64;
            if times > 0 {
                let vertex = corners[0].0;
                seen.push(Seen { vertex, times })?;
            }
        }
        Ok(())
    }

    /// Measures the triangles of the chunk, or leaves them to the sorts.
    fn measure(&mut self, first: u64) -> Result<()> {
        let Some(coords) = self.coords else {
            return Ok(());
        };
        let near = coords.near(self.order.iter().map(|(v, _)| *v));
        if near {
            self.points.clear();
            self.points.reserve_exact(self.v.len());
            self.points.resize(self.v.len(), [f64::NAN; 3]);
            for &(v, place) in &self.order {
                self.points[place as usize] = self.block.point(coords, v)?;
            }
        }
        for i in 0..self.label.len() {
            let row = self.row(first, i);
            if row.is_degenerate() || row.label >= self.arrays.components {
                continue;
            }
            if row.v.iter().any(|&v| v >= self.arrays.vertices) {
                self.table.of(row.label)?.unmeasured += 1;
                continue;
            }
            if near {
                let points = [0, 1, 2].map(|k| self.points[3 * i + k]);
                coords.frame.measure(self.table.of(row.label)?, points);
                continue;
            }
            for (corner, vertex) in (3 * row.t..).zip(row.v) {
                self.wanted.push(Wanted { vertex, corner })?;
            }
        }
        Ok(())
    }
}
