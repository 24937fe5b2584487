//! The arrays by triangle and by vertex, renumbered.
//!
//! Why inconsistent edges are counted on the way: of two opposite corners the later one comes when
//! the direction of the earlier is known; they disagreed in the input when both ran along their
//! edge the same way. Corners that have become opposite are put in at the end.
//!
//! Memory: a block, and 3 bits a chosen triangle. I/O: V, O, labels and flips read once; V, O,
//! labels, flips and both maps written once.

use super::Job;
use super::least::direction_bytes;
use super::source::Row;
use super::table::Table;
use crate::build::arrays::OutArray;
use crate::corner::{Index, flip_k, next_k, prev_k};
use crate::error::{Result, conserve};
use crate::folder::{self, Counts};

/// Writes V, O, the labels, the flips and the ids that triangles had.
pub(super) fn triangles<I: Index>(
    job: &Job,
    table: &Table,
    links: &[[u64; 2]],
    counts: &mut Counts,
) -> Result<Vec<OutArray>> {
    let (t, id) = (job.triangles, I::BYTES as u64);
    let bits = direction_bytes(t);
    let _lease = job.ws.budget.lease("directions of edges", bits)?;
    let mut down = vec![0u64; (bits / 8) as usize];
    let out = [
        job.array(folder::V, I::DESCR, &[t, 3], 3 * id)?,
        job.array(folder::O, I::DESCR, &[t, 3], 3 * id)?,
        job.array(folder::COMPONENT, I::DESCR, &[t], id)?,
        job.array(folder::MAP_TRIANGLE, "<u8", &[t], 8)?,
        job.array(folder::FLIPPED, "|u1", &[t.div_ceil(8)], 1)?,
    ];
    let (mut v, mut o, mut labels) = (Vec::<I>::new(), Vec::<I>::new(), Vec::<I>::new());
    let mut ids: Vec<u64> = Vec::new();
    // Flips of an unfinished byte wait for the next block.
    let (mut flips, mut byte, mut done) = (Vec::new(), 0u8, 0u64);
    let (chosen, triangles, vertices) =
        (job.taken.chosen, &job.taken.triangles, &job.taken.vertices);
    let mut bytes = 0;
    job.source
        .each("write triangles", true, &job.taken, |rows| {
            v.clear();
            o.clear();
            labels.clear();
            ids.clear();
            flips.clear();
            let first = done;
            for row in rows {
                hold_opposites(job, row)?;
                let own = chosen.rank(row.component);
                let (component, turn) = table.place(own, row.flipped);
                let flipped = row.flipped ^ turn;
                let mut vs = row.v.map(|v| vertices.rank(v));
                let mut os = row.o.map(|o| match o {
                    u64::MAX => u64::MAX,
                    o => {
                        // Opposites lie in one component.
                        let turn = table.place(own, job.taken.flipped(o / 3)).1;
                        3 * triangles.rank(o / 3) + flip_k((o % 3) as usize, turn) as u64
                    }
                });
                if turn {
                    vs.swap(1, 2);
                    os.swap(1, 2);
                }
                for k in 0..3 {
                    let c = 3 * done + k as u64;
                    let is_down = (vs[next_k(k)] > vs[prev_k(k)]) ^ flipped;
                    down[(c / 64) as usize] |= u64::from(is_down) << (c % 64);
                    if os[k] < c {
                        let other = down[(os[k] / 64) as usize] >> (os[k] % 64) & 1 == 1;
                        counts.regular_edges += 1;
                        counts.inconsistent_edges += u64::from(other == is_down);
                    }
                }
                v.extend(vs.map(I::of));
                o.extend(os.map(I::of));
                labels.push(I::of(component));
                ids.push(row.t);
                byte |= u8::from(flipped) << (done % 8);
                done += 1;
                if done % 8 == 0 || done == t {
                    flips.push(std::mem::take(&mut byte));
                }
            }
            let [of_v, of_o, of_labels, of_ids, of_flips] = &out;
            of_v.write(3 * first, &v)?;
            of_o.write(3 * first, &o)?;
            of_labels.write(first, &labels)?;
            of_ids.write(first, &ids)?;
            of_flips.write(bytes, &flips)?;
            bytes += flips.len() as u64;
            Ok(())
        })?;
    conserve("filter: write triangles", "triangles", t, done)?;
    let is_down = |c: u64| down[(c / 64) as usize] >> (c % 64) & 1 == 1;
    for [a, b] in links {
        let (a, b) = (table.corner(job, *a)?, table.corner(job, *b)?);
        out[1].write(a, &[I::of(b)])?;
        out[1].write(b, &[I::of(a)])?;
        counts.regular_edges += 1;
        counts.inconsistent_edges += u64::from(is_down(a) == is_down(b));
    }
    // Whether each corner was met with its opposite is the folder's word.
    let held = 2 * counts.regular_edges + counts.border_edges + counts.nonmanifold_corners;
    if held != 3 * t {
        let expected = format!("opposites that pair {} corners", 3 * t);
        return Err(job
            .source
            .damaged(folder::O, String::new(), expected, held.to_string()));
    }
    Ok(out.into())
}

/// Writes the ids that vertices had.
pub(super) fn vertices(job: &Job) -> Result<OutArray> {
    let array = job.array(folder::MAP_VERTEX, "<u8", &[job.vertices], 8)?;
    let mut ids = Vec::with_capacity(job.step as usize);
    let mut written = 0;
    for v in 0..job.folder.manifest().counts.vertices {
        if job.taken.vertices.has(v) {
            ids.push(v);
        }
        if ids.len() == ids.capacity() {
            array.write(written, &ids)?;
            written += ids.len() as u64;
            ids.clear();
        }
    }
    array.write(written, &ids)?;
    written += ids.len() as u64;
    conserve("filter: write vertices", "vertices", job.vertices, written)?;
    Ok(array)
}

/// Opposites lie in one component, so they are taken too, unless the folder is damaged.
fn hold_opposites(job: &Job, row: &Row) -> Result<()> {
    let known = |&o: &u64| o == u64::MAX || job.taken.triangles.has(o / 3);
    match row.o.iter().find(|o| !known(o)) {
        None => Ok(()),
        Some(o) => {
            let at = format!("triangle {}", row.t);
            let expected = format!("a corner of component {}", row.component);
            Err(job.source.damaged(folder::O, at, expected, o.to_string()))
        }
    }
}
