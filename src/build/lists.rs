//! Lists: the culprits, by the ids of the final table.
//!
//! Memory: 1024 rows of each. I/O: each list written once, and what it is made of read once.

use super::Job;
use super::arrays::OutArray;
use super::finish::Found;
use super::records::EdgeCorner;
use super::stars::Starred;
use crate::corner::{Index, flip_k};
use crate::error::Result;
use crate::folder::{self, EDGE_DESCR, EdgeRow};

/// Rows of the lists that are held at a time.
const LISTED: usize = 1 << 10;

/// Writes the lists of culprits, by the ids of the final table.
///
/// # Errors
/// [`crate::Error::Budget`], [`crate::Error::Io`].
pub fn list<I: Index, W: Index>(
    job: &Job,
    found: &Found<W>,
    edges: u64,
    stars: Option<&Starred<W>>,
) -> Result<Vec<OutArray>> {
    let mut lists = Vec::from(list_cuts::<I, W>(job, found, edges)?);
    if let (Some(stars), Some(measured)) = (stars, &found.chosen.stars) {
        lists.push(measured.meetings.list::<I, W>(job)?);
        lists.push(stars.list_duplicates::<I>(job)?);
    }
    Ok(lists)
}

/// Writes the non-manifold edges and their corners, by the ids of the final table.
///
/// # Errors
/// [`crate::Error::Io`].
fn list_cuts<I: Index, W: Index>(job: &Job, found: &Found<W>, edges: u64) -> Result<[OutArray; 2]> {
    let corners = found.chosen.cuts.count::<W>();
    let create = |name, descr: &str, rows, bytes| {
        OutArray::create(job.dir, name, descr, &[rows], bytes, job.ws)
    };
    let edge_file = create(
        folder::NONMANIFOLD_EDGES,
        EDGE_DESCR,
        edges,
        size_of::<EdgeRow>() as u64,
    )?;
    let corner_file = create(
        folder::NONMANIFOLD_CORNERS,
        I::DESCR,
        corners,
        I::BYTES as u64,
    )?;
    let mut rows: Vec<EdgeRow> = Vec::with_capacity(LISTED);
    let mut ids: Vec<I> = Vec::with_capacity(LISTED);
    let (mut rows_done, mut ids_done) = (0, 0);
    found
        .chosen
        .cuts
        .each(job, &mut |corner: &EdgeCorner<W>, label| {
            if ids.len() == LISTED {
                corner_file.write(ids_done, &ids)?;
                ids_done += ids.len() as u64;
                ids.clear();
            }
            let turn = found.turn(job, label);
            let flipped = turn.is_some_and(|turn| turn ^ corner.flipped());
            let place = flip_k(corner.place() as usize, flipped) as u64;
            let id = 3 * corner.triangle() + place;
            ids.push(I::of(id));
            let (lo, hi) = corner.edge();
            match rows.last_mut() {
                Some(row) if (row.lo, row.hi) == (lo, hi) => {
                    row.corners += 1;
                    return Ok(());
                }
                _ => {}
            }
            if rows.len() == LISTED {
                edge_file.write(rows_done, &rows)?;
                rows_done += rows.len() as u64;
                rows.clear();
            }
            rows.push(EdgeRow {
                lo,
                hi,
                corners: 1,
                first_corner: id,
            });
            Ok(())
        })?;
    corner_file.write(ids_done, &ids)?;
    edge_file.write(rows_done, &rows)?;
    if rows_done + rows.len() as u64 != edges {
        let what = format!(
            "{} non-manifold edges listed, {edges} counted",
            rows_done + rows.len() as u64
        );
        return Err(crate::Error::Internal(what));
    }
    Ok([edge_file, corner_file])
}
