//! Non-manifold edges, of which some corners may be left out.
//!
//! Why corners stay in order: triangles keep theirs, and no two corners of an edge are in one
//! triangle.
//!
//! Memory: 16 bytes a chosen component. I/O: the lists of non-manifold edges and corners twice,
//! and the label of each of their corners that is taken.

use super::Job;
use super::table::Table;
use crate::build::arrays::OutArray;
use crate::corner::{Index, flip_k};
use crate::disk::Lease;
use crate::error::{Error, Result};
use crate::folder::{self, EDGE_DESCR, EdgeRow, npy::DATA_START};
use crate::table::array;

/// What is left of the non-manifold edges.
pub(super) struct Edges {
    /// Those that stay non-manifold.
    pub(super) kept: u64,
    /// Their corners.
    pub(super) corners: u64,
    /// By new component: corners that have become border.
    pub(super) lone: Vec<u64>,
    /// Components when edges that stay non-manifold join.
    pub(super) joined: u64,
    _lease: Lease,
}

/// Counts what is left.
///
/// # Errors
/// [`Error::Usage`] naming the first edge of which two corners are left.
pub(super) fn look(job: &Job) -> Result<Edges> {
    let components = job.taken.chosen.count;
    let lease = job.ws.budget.lease("components", 16 * components)?;
    let mut edges = Edges {
        kept: 0,
        corners: 0,
        lone: vec![0; components as usize],
        joined: components,
        _lease: lease,
    };
    let mut parent: Vec<u64> = (0..components).collect();
    each(job, |edge, corners| {
        let component = |c: u64| Ok(job.taken.chosen.rank(job.source.label(c / 3)?));
        match corners {
            [] => {}
            [one] => edges.lone[component(*one)? as usize] += 1,
            [a, b] => return Err(refused(job, edge, [*a, *b])),
            [first, rest @ ..] => {
                edges.kept += 1;
                edges.corners += corners.len() as u64;
                let first = component(*first)?;
                for &c in rest {
                    edges.joined -= u64::from(join(&mut parent, first, component(c)?));
                }
            }
        }
        Ok(())
    })?;
    Ok(edges)
}

/// Joins two sets; true when they were two.
fn join(parent: &mut [u64], a: u64, b: u64) -> bool {
    let mut root = |mut x: u64| {
        while parent[x as usize] != x {
            parent[x as usize] = parent[parent[x as usize] as usize];
            x = parent[x as usize];
        }
        x
    };
    let (a, b) = (root(a), root(b));
    parent[a.max(b) as usize] = a.min(b);
    a != b
}

fn refused(job: &Job, edge: &EdgeRow, [a, b]: [u64; 2]) -> Error {
    Error::Usage(format!(
        "{}: the non-manifold edge between vertices {} and {} would keep two of its {} corners, {a} \
         and {b}, and so become regular and join what is cut there; choose all components at that \
         edge or none, or export the selection and build it",
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
    let (mut row, mut next, mut left) = (None, 0, 0);
    let mut taken = Vec::new();
    let mut lease: Option<Lease> = None;
    job.source.list(folder::NONMANIFOLD_CORNERS, corners, |c| {
        if c >= 3 * counts.triangles {
            let at = format!("corner {c}");
            let expected = format!("a corner below {}", 3 * counts.triangles);
            return Err(job.source.damaged(
                folder::NONMANIFOLD_CORNERS,
                at,
                expected,
                c.to_string(),
            ));
        }
        if left == 0 {
            const ROW: usize = size_of::<EdgeRow>();
            let mut bytes = [0; ROW];
            file.read_at(&mut bytes, DATA_START + next * ROW as u64)?;
            let edge: EdgeRow = bytemuck::pod_read_unaligned(&bytes);
            (row, left, next) = (Some(edge), edge.corners, next + 1);
        }
        if job.taken.triangles.has(c / 3) {
            if taken.len() == taken.capacity() {
                // What an edge holds is drawn before it grows.
                let more = (2 * taken.len()).max(512);
                lease = Some(job.ws.budget.lease("corners of an edge", 8 * more as u64)?);
                taken.reserve_exact(more - taken.len());
            }
            taken.push(c);
        }
        left = left.saturating_sub(1);
        if let (0, Some(edge)) = (left, &row) {
            f(edge, &taken)?;
            taken.clear();
        }
        Ok(())
    })?;
    drop(lease);
    Ok(())
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
        if edge_rows.len() >= least || ids.len() >= 4 * least {
            of_edges.write(written[0], edge_rows)?;
            of_corners.write(written[1], ids)?;
            written[0] += edge_rows.len() as u64;
            written[1] += ids.len() as u64;
            edge_rows.clear();
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
            let flip = table.flips(job.taken.chosen.rank(job.source.label(c / 3)?));
            let k = flip_k((c % 3) as usize, flip) as u64;
            let new = 3 * job.taken.triangles.rank(c / 3) + k;
            first = first.or(Some(new));
            ids.push(I::of(new));
        }
        edge_rows.push(EdgeRow {
            lo: job.taken.vertices.rank(edge.lo),
            hi: job.taken.vertices.rank(edge.hi),
            corners: corners.len() as u64,
            first_corner: first.unwrap_or_default(),
        });
        flush(&mut edge_rows, &mut ids, 1024)
    })?;
    flush(&mut edge_rows, &mut ids, 0)?;
    let degenerate = list(folder::DEGENERATE, 0)?;
    Ok(vec![of_edges, of_corners, degenerate])
}
