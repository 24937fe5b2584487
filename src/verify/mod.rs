//! The independent check of a mesh folder, out of core.
//!
//! It proves from the bytes of the folder alone that the folder is a corner table of *its own
//! V*: that O, the components, the orientation, the lists and every count are what V and G
//! say. It shares nothing with what builds or reads folders but the names and types of the
//! files: the arithmetic of corners, the sort, the union-find and the sums are written anew.
//!
//! What it does, in passes:
//! 1. files: headers, lengths, types, checksums;
//! 2. G once, for the box and the vertices that are not finite;
//! 3. triangles in chunks: ranges, degenerate ones, bits, sums of components, valences; every
//!    corner goes to a sort by the edge that it faces;
//! 4. edges, each with all its corners: O, labels, parities, the lists of non-manifold edges;
//! 5. connectivity and parity over the regular edges: one label is one component, and each
//!    is orientable as it says;
//! 6. in measured folders what corners hang together in: fans and border loops, then the stars
//!    of the vertices, and duplicates;
//! 7. components: every column, the rule of orientation, and the numbers of the manifest.
//!
//! Not provable from the folder, and not checked: that V and G are those of the input
//! (`polygons_fanned`, the digest, the order of welded vertices).
//!
//! Memory: what `ws.budget` has free is shared out between chunks, sort buffers, component
//! sums and connectivity; [`least_memory`] is enough for any size. Beyond it: 16 bytes a
//! merged run, and the text of the manifest.
//! I/O: each file once for its checksum and once or twice for its contents; 24 bytes (ids of
//! 4 bytes; 48 with ids of 8) a corner written to scratch space and read back. Measures: 16
//! bytes for each vertex of a chunk, 16 a fan, about 32 for each link of corners when their
//! graph does not fit in a quarter of the memory, and V and the labels once more.

mod coords;
mod counts;
mod duplicates;
mod edge_record;
mod edges;
mod fans;
mod far;
mod files;
mod links;
mod listing;
mod maps;
mod measured;
mod measures;
mod open;
mod range;
mod read;
mod row;
mod rows;
mod shape;
mod sort;
mod spans;
mod spool;
mod stars;
mod tally;
mod triangles;
mod valences;
mod verdict;

pub use verdict::{At, Check, Checked, Finding, Verdict};

use crate::disk::Workspace;
use crate::error::{Error, Result};
use crate::folder::{ComponentRow, Counts, Manifest, Measures};
use coords::Coords;
use edge_record::{EdgeRecord, Narrow, Wide};
use links::Links;
use measured::{Measured, Told};
use open::Arrays;
use rows::MeasuredRow;
use sort::Sorter;
use spool::Spool;
use std::path::Path;
use tally::{Table, Tally};
use valences::Valences;
use verdict::Findings;

/// How much a check says, and how it cuts its work.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Findings kept of each check; all are counted.
    pub findings: usize,
    /// Most triangles of a chunk; the memory allows less or more. The verdict is the same.
    pub chunk: u64,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            findings: 8,
            chunk: 1 << 19,
        }
    }
}

/// Memory in bytes that is enough to check a folder of any size with this many threads.
pub fn least_memory(threads: usize) -> u64 {
    (1 << 20) + threads as u64 * (640 << 10)
}

/// Checks the folder at `path`; a wrong folder is a verdict with findings, not an error.
///
/// # Errors
/// [`Error::Input`] when there is no readable manifest, [`Error::Io`] when a file cannot be
/// read, [`Error::Budget`] when the budget has less than [`least_memory`] free,
/// [`Error::DiskLimit`] when the sorts do not fit in scratch space.
pub fn verify(ws: &Workspace, path: &Path, limits: Limits) -> Result<Verdict> {
    let least = least_memory(ws.workers.count());
    if ws.budget.free() < least {
        return Err(Error::Budget {
            what: "checking a folder".into(),
            need: ws.budget.used() + least,
            have: ws.budget.limit(),
        });
    }
    let manifest = Manifest::read(path)?;
    let findings = Findings::new(limits.findings);
    let mut checked = Checked::default();
    let mut complete = false;
    if files::check(ws, path, &manifest, &findings, &mut checked)?
        && let Some(arrays) = open::arrays(ws, path, &manifest, &findings)?
    {
        let sound = Contents {
            ws,
            arrays: &arrays,
            manifest: &manifest,
            findings: &findings,
            memory: ws.budget.free(),
            limits,
        };
        if arrays.wide || arrays.vertices > Narrow::VERTICES {
            sound.check::<Wide>(&mut checked)?;
        } else {
            sound.check::<Narrow>(&mut checked)?;
        }
        complete = true;
    }
    let mut verdict = findings.into_verdict();
    verdict.notes = files::notes(path, &manifest)?;
    verdict.checked = checked;
    verdict.complete = complete;
    Ok(verdict)
}

/// What the passes over the contents share.
struct Contents<'a> {
    ws: &'a Workspace,
    arrays: &'a Arrays,
    manifest: &'a Manifest,
    findings: &'a Findings,
    memory: u64,
    limits: Limits,
}

impl Contents<'_> {
    fn check<E: EdgeRecord>(&self, checked: &mut Checked) -> Result<()> {
        let (ws, arrays, memory) = (self.ws, self.arrays, self.memory);
        let coords = Coords::scan(ws, arrays)?;
        // Each thread's share: 6/16 for its chunk, 5/16 for corners by edge, the rest below.
        let lane = memory / 8 * 7 / ws.workers.count() as u64;
        let edges = Sorter::<E>::new(ws, "corners by edge", lane / 16 * 5)?;
        let tallies = Sorter::new(ws, "sums by component", lane / 32)?;
        let spans = Sorter::new(ws, "spans of vertices", lane / 32)?;
        let wanted = Sorter::new(ws, "corners by vertex", lane / 8)?;
        let seen = match &arrays.measured {
            Some(_) => Some(Sorter::new(ws, "triangles at vertices", lane / 32)?),
            None => None,
        };
        let chunk = (lane / 16 * 6 / triangles::BYTES).min(self.limits.chunk.min(1 << 20));
        let outlets = triangles::Outlets {
            edges: &edges,
            tallies: &tallies,
            spans: &spans,
            wanted: &wanted,
            seen: seen.as_ref(),
            chunk: (chunk / 8 * 8).max(8),
            table: lane / 16,
        };
        let counted = triangles::run(ws, arrays, coords.as_ref(), self.findings, &outlets)?;
        let referenced = spans::referenced(ws, spans, memory / 2)?;
        let valences = seen.map(|seen| valences::run(ws, seen, arrays.vertices, memory / 2));
        let valences = valences.transpose()?;
        if let Some(coords) = &coords {
            checked.far_corners = far::measure(ws, arrays, coords, wanted, &tallies, memory / 2)?;
        }
        checked.edge_runs = edges.runs();
        let (paired, joined, told) = self.edges(edges, &tallies, checked)?;
        let frame = coords.as_ref().map(|c| &c.frame);
        let rows = match &arrays.measured {
            Some(_) => rows::run::<MeasuredRow>,
            None => rows::run::<ComponentRow>,
        };
        let kinds = rows(ws, arrays, frame, self.findings, tallies, memory / 2)?;
        checked.triangles = arrays.triangles;
        checked.vertices = arrays.vertices;
        checked.components = arrays.components;
        checked.edges = paired.regular + paired.border + paired.nonmanifold;
        let counts = Counts {
            triangles: arrays.triangles,
            vertices: arrays.vertices,
            unreferenced_vertices: arrays.vertices.saturating_sub(referenced),
            nonfinite_vertices: frame.map_or(0, |f| f.nonfinite),
            degenerate: counted.degenerate,
            distinct_edges: checked.edges,
            regular_edges: paired.regular,
            border_edges: paired.border,
            nonmanifold_edges: paired.nonmanifold,
            nonmanifold_corners: paired.nonmanifold_corners,
            inconsistent_edges: paired.inconsistent,
            components: arrays.components,
            components_joined: joined,
            nonorientable_components: kinds.nonorientable,
            closed_components: kinds.closed,
            watertight_components: kinds.watertight,
            flipped_triangles: counted.flipped,
            flipped_components: kinds.flipped,
            polygons_fanned: self.manifest.counts.polygons_fanned,
        };
        counts::check(self.findings, &self.manifest.counts, &counts);
        maps::check(ws, arrays, self.findings)?;
        if let Some((told, valences)) = told.zip(valences) {
            self.measures(&counts, &told, valences, kinds.smesh);
        }
        Ok(())
    }

    /// Compares the measures of the whole mesh.
    fn measures(&self, counts: &Counts, told: &Told, valences: Valences, smesh: u64) {
        let Some(said) = &self.manifest.measures else {
            return;
        };
        let edges = counts.regular_edges + counts.border_edges + counts.nonmanifold_corners;
        let triangles = counts.triangles - counts.degenerate;
        let own = Measures {
            fans: told.stars.fans,
            border_loops: told.loops,
            euler: told.stars.fans as i64 - edges as i64 + triangles as i64,
            nonmanifold_vertices: told.stars.nonmanifold,
            duplicate: told.duplicates,
            components_joined_at_vertices: told.stars.joined,
            smesh_components: smesh,
            largest_valence: valences.largest,
            valences: valences.classes,
        };
        counts::measures(self.findings, said, &own);
    }

    /// Passes 4 to 6; also the number of components when non-manifold edges join, and what a
    /// measured folder should tell.
    fn edges<E: EdgeRecord>(
        &self,
        edges: Sorter<E>,
        tallies: &Sorter<Tally>,
        checked: &mut Checked,
    ) -> Result<(edges::Counted, u64, Option<Told>)> {
        let (ws, arrays, memory) = (self.ws, self.arrays, self.memory);
        let measured = Measured::new(ws, arrays, self.findings, memory)?;
        // In sixteenths; with measures the graph of corners takes four.
        let (merging, linking) = if measured.is_some() { (5, 3) } else { (6, 5) };
        let merge = edges.merge(ws, memory / 16 * merging)?;
        let mut links = Links::new(ws, arrays.triangles, memory / 16 * linking)?;
        let mut star_links = measured.as_ref().map(|m| m.corners()).transpose()?;
        checked.link_ranges = links.ranges();
        checked.corner_ranges = star_links.as_ref().map_or(0, Links::ranges);
        let sides = Sorter::new(ws, "sides of non-manifold edges", memory / 32)?;
        let mut meetings = Spool::new(32 << 10);
        let table = || Table::new(ws, tallies, arrays.components, memory / 16);
        let lease = ws.budget.lease("components that meet", 32 << 10)?;
        let corners = &arrays.nonmanifold_corners;
        let feed = measured.as_ref().zip(star_links.as_mut());
        let pass = edges::Pass {
            ws,
            arrays,
            findings: self.findings,
            table: table()?,
            links: &mut links,
            sides: sides.filler(ws)?,
            meetings: &mut meetings,
            feed: feed.map(|(m, corners)| m.feed(corners)).transpose()?,
            rows: read::Rows::new(ws, &arrays.edge_rows, arrays.edges, 16 << 10)?,
            corners: read::IdReader::new(ws, corners, 16 << 10)?,
            place: 0,
            counted: edges::Counted::default(),
        };
        let counted = pass.run(merge)?;
        ws.progress
            .begin("verify: connectivity", "triangles", arrays.triangles);
        self.pieces(links, table()?)?;
        ws.progress.end();
        let loops = measured.as_ref().zip(star_links);
        let loops = loops.map(|(m, corners)| m.loops(corners, tallies));
        let loops = loops.transpose()?;
        edges::cancel(ws, sides, table()?, memory / 4)?;
        drop(lease);
        let joined = self.joined(&meetings)?;
        let told = measured
            .zip(loops)
            .map(|(m, loops)| m.finish(loops, tallies));
        Ok((counted, joined, told.transpose()?))
    }

    /// Gives each component the pieces that its label has.
    fn pieces(&self, links: Links, mut table: Table) -> Result<()> {
        let labels = &self.arrays.component;
        let mut labels = read::IdReader::new(self.ws, labels, 64 << 10)?;
        links.finish(|triangle, odd| {
            // No label: degenerate, or a finding already.
            let label = labels.get(triangle)?;
            if let Some(label) = label.filter(|&l| l < self.arrays.components) {
                let tally = table.of(label)?;
                tally.pieces += 1;
                tally.last_piece = tally.last_piece.max(triangle);
                tally.odd += u64::from(odd);
            }
            Ok(())
        })?;
        table.finish()
    }

    /// Number of components when those that meet at a non-manifold edge are one.
    fn joined(&self, meetings: &Spool<edges::Meeting>) -> Result<u64> {
        let _lease = self.ws.budget.lease("components that meet", 64 << 10)?;
        let mut links = Links::new(self.ws, self.arrays.components, self.memory / 2)?;
        meetings.read(|[a, b]| links.push(a, b, false))?;
        let mut joined = 0;
        links.finish(|_, _| {
            joined += 1;
            Ok(())
        })?;
        Ok(joined)
    }
}

#[cfg(test)]
mod testing {
    use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
    use std::sync::Arc;

    /// A workspace with scratch space in a folder of its own.
    pub(super) fn workspace(memory: u64, threads: usize) -> (Workspace, tempfile::TempDir) {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let io = Arc::new(Counters::default());
        let ws = Workspace {
            budget: Budget::new(memory),
            scratch: Scratch::new(&[dir.path().to_owned()], u64::MAX, &io).expect("scratch"),
            io,
            workers: Workers::new(threads).expect("threads"),
            progress: Arc::new(NoProgress),
        };
        (ws, dir)
    }
}
