//! Non-manifold edges, of which some corners may be left out.
//!
//! Why this settles them: what an edge is, is decided by its corners that are taken. One is a
//! border. Two are opposite, and join their components: with parity, from the directions in
//! which they run. Three or more stay cut; whether the corners of a set of components cancel
//! there is found anew, since the set is. All else of a component is as it was.
//!
//! Why corners stay in order: triangles keep theirs, and no two corners of an edge are in one
//! triangle.
//!
//! Memory: 64 bytes a chosen component, 32 for each edge of which two corners are left, and 24 for each
//! corner of the edge that has most. I/O:
//! the lists of non-manifold edges and corners three times; labels and rows of V of their
//! corners that are taken, one by one.

use super::Job;
use super::least::{self, FIRST_LINKS, LINK_BYTES};
use super::sets::Sets;
use super::source::Row;
use super::table::Table;
use crate::build::arrays::OutArray;
use crate::corner::{Index, next_k, prev_k};
use crate::disk::{DataFile, Lease};
use crate::error::{Error, Result};
use crate::folder::{self, EDGE_DESCR, EdgeRow, Orient, npy::DATA_START};
use crate::table::array;
use bytemuck::Zeroable;

/// What is left of the non-manifold edges.
pub(super) struct Edges {
    /// Those that stay non-manifold.
    pub(super) kept: u64,
    /// Their corners.
    pub(super) corners: u64,
    /// Corners that have become opposite, by their ids in the source.
    pub(super) links: Vec<[u64; 2]>,
    /// Sets of chosen components that those join.
    pub(super) sets: Sets,
    /// By set.
    pub(super) changes: Vec<Change>,
    /// Sets when edges that stay non-manifold join too.
    pub(super) joined: u64,
    leases: Vec<Lease>,
}

/// What has become of a set's corners on non-manifold edges.
#[derive(Clone, Copy, Default)]
pub(super) struct Change {
    /// Corners that are border now.
    pub(super) borders: u64,
    /// Edges that are regular now.
    pub(super) links: u64,
    /// True when its corners at some edge that stays do not cancel.
    pub(super) unbalanced: bool,
}

/// Settles the edges.
///
/// # Errors
/// [`Error::Usage`] when two corners are left of an edge and the source keeps the orientation of
/// the input; [`Error::Budget`], [`Error::Input`], [`Error::Io`].
pub(super) fn settle(job: &Job) -> Result<Edges> {
    let components = job.taken.chosen.count;
    let bytes = least::joined_bytes(components);
    let lease = job.ws.budget.lease("joined components", bytes)?;
    let mut edges = Edges {
        kept: 0,
        corners: 0,
        links: Vec::new(),
        sets: Sets::new(components),
        changes: Vec::new(),
        joined: 0,
        leases: vec![lease],
    };
    link(job, &mut edges)?;
    edges.sets.seal();
    edges.changes = vec![Change::default(); edges.sets.count() as usize];
    balance(job, &mut edges)?;
    Ok(edges)
}

/// Joins components where two corners are left.
fn link(job: &Job, edges: &mut Edges) -> Result<()> {
    let keeps = job.folder.manifest().options.orient == Orient::Keep;
    each(job, |edge, corners| {
        let &[a, b] = corners else {
            return Ok(());
        };
        if keeps {
            return Err(refused(job, edge, [a, b]));
        }
        if edges.links.len() == edges.links.capacity() {
            let more = edges.links.len().max(FIRST_LINKS as usize);
            let bytes = LINK_BYTES * more as u64;
            let lease = job.ws.budget.lease("edges that become regular", bytes)?;
            edges.leases.push(lease);
            edges.links.reserve_exact(more);
        }
        edges.links.push([a, b]);
        let (p, q) = (Side::of(job, a)?, Side::of(job, b)?);
        // They agree when they run along the edge in opposite directions.
        edges.sets.join(p.component, q.component, p.down == q.down);
        Ok(())
    })?;
    // What could not be oriented before still cannot.
    let mut new = 0;
    folder::Rows::open(job.folder)?.each(|c, row| {
        if job.taken.chosen.has(c) {
            if row.base.orientable == 0 {
                edges.sets.contradict(new);
            }
            new += 1;
        }
        Ok(())
    })
}

/// Looks at what the sets of components have at each edge.
fn balance(job: &Job, edges: &mut Edges) -> Result<()> {
    let keeps = job.folder.manifest().options.orient == Orient::Keep;
    let (sets, changes) = (&edges.sets, &mut edges.changes);
    let mut joined = Sets::new(sets.count());
    let mut sides: Vec<(u64, i64)> = Vec::new();
    let mut lease: Option<Lease> = None;
    let (mut kept, mut all) = (0, 0);
    each(job, |_, corners| {
        if let [one, rest @ ..] = corners
            && rest.len() < 2
        {
            let set = sets.of(Side::of(job, *one)?.component).0;
            match rest {
                [] => changes[set as usize].borders += 1,
                _ => changes[set as usize].links += 1,
            }
        }
        if corners.len() < 3 {
            return Ok(());
        }
        kept += 1;
        all += corners.len() as u64;
        if corners.len() > sides.capacity() {
            lease = None;
            sides = Vec::new();
            let bytes = 16 * corners.len() as u64;
            lease = Some(job.ws.budget.lease("sides of an edge", bytes)?);
            sides.reserve_exact(corners.len());
        }
        sides.clear();
        for &c in corners {
            let side = Side::of(job, c)?;
            let (set, parity) = sets.of(side.component);
            let turn = if keeps || !sets.orientable(set) {
                side.flipped
            } else {
                parity
            };
            sides.push((set, if side.down ^ turn { -1 } else { 1 }));
        }
        sides.sort_unstable();
        for own in sides.chunk_by(|a, b| a.0 == b.0) {
            let set = own[0].0;
            changes[set as usize].unbalanced |= own.iter().map(|side| side.1).sum::<i64>() != 0;
            joined.join(sides[0].0, set, false);
        }
        Ok(())
    })?;
    drop(lease);
    (edges.kept, edges.corners, edges.joined) = (kept, all, joined.count());
    Ok(())
}

/// How a corner that is taken runs along its edge.
struct Side {
    /// Number among the chosen.
    component: u64,
    /// True when from the larger vertex to the smaller, in the source.
    down: bool,
    flipped: bool,
}

impl Side {
    fn of(job: &Job, c: u64) -> Result<Side> {
        let Row {
            v,
            component,
            flipped,
            ..
        } = job.source.one(c / 3)?;
        let k = (c % 3) as usize;
        Ok(Side {
            component: job.taken.chosen.rank(component),
            down: v[next_k(k)] > v[prev_k(k)],
            flipped,
        })
    }
}

fn refused(job: &Job, edge: &EdgeRow, [a, b]: [u64; 2]) -> Error {
    Error::Usage(format!(
        "{}: was built with --orient keep, and the non-manifold edge between vertices {} and {} \
         would keep two of its {} corners, {a} and {b}: whether what they join can be oriented is \
         not known from such a folder; choose all components at that edge or none, or export the \
         selection and build it",
        job.folder.path().display(),
        edge.lo,
        edge.hi,
        edge.corners,
    ))
}

/// Hands each non-manifold edge of the source, with its corners that are taken, to `f`.
fn each(job: &Job, mut f: impl FnMut(&EdgeRow, &[u64]) -> Result<()>) -> Result<()> {
    let counts = &job.folder.manifest().counts;
    let (edges, corners) = (counts.nonmanifold_edges, counts.nonmanifold_corners);
    let file = array::open(job.folder, folder::NONMANIFOLD_EDGES, EDGE_DESCR, &[edges])?;
    let (mut edge, mut next, mut left) = (EdgeRow::zeroed(), 0, 0);
    let mut taken = Vec::new();
    let mut lease: Option<Lease> = None;
    let uneven = |found: String| {
        let expected = format!("edges of {corners} corners in all, each of 3 or more");
        let name = folder::NONMANIFOLD_EDGES;
        Err(job.source.damaged(name, String::new(), expected, found))
    };
    let mut before = 0;
    job.source.list(folder::NONMANIFOLD_CORNERS, corners, |c| {
        if c >= 3 * counts.triangles {
            let at = format!("corner {c}");
            let expected = format!("a corner below {}", 3 * counts.triangles);
            let name = folder::NONMANIFOLD_CORNERS;
            return Err(job.source.damaged(name, at, expected, c.to_string()));
        }
        if left == 0 {
            if next == edges {
                return uneven(format!("{edges} edges of {before} corners"));
            }
            edge = read_edge(job, &file, next)?;
            before = edge.corners.saturating_add(before);
            if edge.corners < 3 || before > corners {
                return uneven(format!("one of {} corners in row {next}", edge.corners));
            }
            (left, next) = (edge.corners, next + 1);
            if edge.corners > taken.capacity() as u64 {
                (lease, taken) = (None, Vec::new());
                let bytes = 8 * edge.corners;
                lease = Some(job.ws.budget.lease("corners of an edge", bytes)?);
                taken.reserve_exact(edge.corners as usize);
            }
        }
        if job.taken.triangles.has(c / 3) {
            taken.push(c);
        }
        left -= 1;
        if left == 0 {
            f(&edge, &taken)?;
            taken.clear();
        }
        Ok(())
    })?;
    drop(lease);
    if left != 0 || next != edges {
        return uneven(format!("{edges} edges, of which {next} have {corners}"));
    }
    Ok(())
}

/// A row of the list of edges.
fn read_edge(job: &Job, file: &DataFile, row: u64) -> Result<EdgeRow> {
    let mut edge = EdgeRow::zeroed();
    let bytes = bytemuck::bytes_of_mut(&mut edge);
    file.read_at(bytes, DATA_START + row * bytes.len() as u64)?;
    let (name, end) = (
        folder::NONMANIFOLD_EDGES,
        job.folder.manifest().counts.vertices,
    );
    job.source.bound(name, row, edge.lo.max(edge.hi), end)?;
    Ok(edge)
}

/// Writes the lists of the edges that stay non-manifold, and the empty list of degenerate
/// triangles.
pub(super) fn write<I: Index>(job: &Job, table: &Table, edges: &Edges) -> Result<Vec<OutArray>> {
    let id = I::BYTES as u64;
    let row = size_of::<EdgeRow>() as u64;
    let of_edges = job.array(folder::NONMANIFOLD_EDGES, EDGE_DESCR, &[edges.kept], row)?;
    let list = |name, len| job.array(name, I::DESCR, &[len], id);
    let of_corners = list(folder::NONMANIFOLD_CORNERS, edges.corners)?;
    let (mut edge_rows, mut ids) = (Vec::new(), Vec::<I>::new());
    let mut written = [0, 0];
    let mut flush = |edge_rows: &mut Vec<EdgeRow>, ids: &mut Vec<I>, least: usize| {
        if edge_rows.len() >= least {
            of_edges.write(written[0], edge_rows)?;
            written[0] += edge_rows.len() as u64;
            edge_rows.clear();
        }
        if ids.len() >= least {
            of_corners.write(written[1], ids)?;
            written[1] += ids.len() as u64;
            ids.clear();
        }
        Ok(())
    };
    each(job, |edge, corners| {
        if corners.len() < 3 {
            return Ok(());
        }
        let mut first = None;
        for &c in corners {
            let new = table.corner(job, c)?;
            first = first.or(Some(new));
            ids.push(I::of(new));
            flush(&mut edge_rows, &mut ids, 4096)?;
        }
        edge_rows.push(EdgeRow {
            lo: job.taken.vertices.rank(edge.lo),
            hi: job.taken.vertices.rank(edge.hi),
            corners: corners.len() as u64,
            first_corner: first.unwrap_or_default(),
        });
        Ok(())
    })?;
    flush(&mut edge_rows, &mut ids, 0)?;
    let degenerate = list(folder::DEGENERATE, 0)?;
    Ok(vec![of_edges, of_corners, degenerate])
}
