//! A compressed file that keeps the order of its folder, to V and G in that order.
//!
//! Triangles and rows of G are decoded chunk by chunk, in parallel, and each goes to its place
//! through a shuffle. A file is held to having each of them once.
//!
//! Memory: for each thread a chunk, and its part of what two shuffles take. I/O: the file once;
//! 16 bytes a triangle and a vertex through scratch (32 when ids are wide, or of f8); V and G once.

use super::decode::{hold, most_bytes, whole, workers};
use super::packed::{Packed, Unpacked};
use super::rows::Rows;
use crate::disk::{Workers, Workspace};
use crate::error::{Error, Result};
use crate::shuffle::{Buckets, Plan, Record, Shuffle, Sorter, Writer};
use bytemuck::{Pod, Zeroable};

/// Memory of the writers of one shuffle, at least.
const LEAST_WRITERS: u64 = 128 << 10;
/// What shuffles note of more than they expected, and buffers of rows on their way out.
const SLACK: u64 = 1 << 20;
/// Rows that are written at a time.
const ROWS: usize = 1 << 13;

/// A row of three words and its number.
trait Row: Record {
    fn new(number: u64, words: [u64; 3]) -> Self;
    fn words(&self) -> [u64; 3];
}

/// Numbers and words of 4 bytes.
#[repr(transparent)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Narrow([u32; 4]);

/// Numbers and words of 8.
#[repr(transparent)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Wide([u64; 4]);

impl Record for Narrow {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0[0].into()
    }
}

impl Record for Wide {
    const LEVELS: usize = 1;
    fn key(&self, _: usize) -> u64 {
        self.0[0]
    }
}

impl Row for Narrow {
    fn new(number: u64, [a, b, c]: [u64; 3]) -> Narrow {
        Narrow([number, a, b, c].map(|x| x as u32))
    }
    fn words(&self) -> [u64; 3] {
        [1, 2, 3].map(|k| self.0[k].into())
    }
}

impl Row for Wide {
    fn new(number: u64, [a, b, c]: [u64; 3]) -> Wide {
        Wide([number, a, b, c])
    }
    fn words(&self) -> [u64; 3] {
        [1, 2, 3].map(|k| self.0[k])
    }
}

/// Decodes all chunks into the order that the file keeps.
///
/// # Errors
/// [`Error::Input`] for a damaged file; [`Error::Budget`], [`Error::Io`], [`Error::DiskLimit`].
pub(super) fn reorder(ws: &Workspace, packed: &Packed, rows: &Rows) -> Result<()> {
    match (rows.narrow, packed.head.coords) {
        (true, 8) => reorder_as::<Narrow, Wide>(ws, packed, rows),
        (true, _) => reorder_as::<Narrow, Narrow>(ws, packed, rows),
        (false, _) => reorder_as::<Wide, Wide>(ws, packed, rows),
    }
}

fn reorder_as<V: Row, G: Row>(ws: &Workspace, packed: &Packed, rows: &Rows) -> Result<()> {
    let head = &packed.head;
    let most = most_bytes(packed);
    let free = ws.budget.free();
    if most + 2 * LEAST_WRITERS + SLACK > free {
        let what = "decoding into the order of the folder";
        ws.budget.check(what, most + 2 * LEAST_WRITERS + SLACK)?;
    }
    let spare = (free - SLACK - most) / 2;
    let writers = (free / 8).min(spare).clamp(LEAST_WRITERS, 32 << 20);
    let few = workers(ws, packed, free - SLACK - 2 * writers)?;
    let plan = |record, count| Plan::within(writers, few.count(), record, count, writers);
    let plan_v = plan(size_of::<V>(), head.triangles);
    let plan_g = plan(size_of::<G>(), head.vertices);
    let triangles = Shuffle::<V>::new(ws, "triangles in order", 0..head.triangles.max(1), plan_v)?;
    let points = Shuffle::<G>::new(ws, "vertices in order", 0..head.vertices.max(1), plan_g)?;
    ws.progress.begin("decode", "triangles", head.triangles);
    few.run(
        packed.entries.len() as u64,
        || {
            let lease = ws.budget.lease("a chunk", most)?;
            Ok((triangles.writer()?, points.writer()?, lease))
        },
        |(triangles, points, _), chunk| {
            let chunk = chunk as usize;
            let unpacked = whole(packed, chunk)?;
            send(packed, chunk, &unpacked, triangles, points)?;
            ws.progress.advance(packed.entries[chunk].all_triangles());
            Ok(())
        },
        |(triangles, points, _)| {
            triangles.finish()?;
            points.finish()
        },
    )?;
    ws.progress.end();
    let (triangles, points) = (triangles.finish()?, points.finish()?);
    in_order(
        ws,
        packed,
        ("triangle", head.triangles),
        triangles,
        |first, found| rows.triangles(first, found.iter().flat_map(Row::words)),
    )?;
    let bytes = usize::from(head.coords);
    in_order(
        ws,
        packed,
        ("vertex", head.vertices),
        points,
        |first, found| {
            let words = found.iter().flat_map(Row::words);
            let all: Vec<u8> = words
                .flat_map(|w| w.to_le_bytes().into_iter().take(bytes))
                .collect();
            rows.points(first, &all)
        },
    )
}

/// Sends the triangles of a chunk, and the vertices that are its own, to their places.
fn send<V: Row, G: Row>(
    packed: &Packed,
    chunk: usize,
    unpacked: &Unpacked,
    triangles: &mut Writer<'_, V>,
    points: &mut Writer<'_, G>,
) -> Result<()> {
    let numbers = &unpacked.numbers;
    let bytes = usize::from(packed.head.coords);
    let mut own = Vec::new();
    unpacked.each_vertex(|number, at, reference| {
        if reference.is_none() {
            own.push((number, at));
        }
    });
    hold(&packed.entries[chunk], unpacked, own.len() as u64)?;
    let mut row = Vec::with_capacity(24);
    for (number, at) in own {
        row.clear();
        packed.restore(at, &mut row);
        let word = |k: usize| {
            let word = row.get(k * bytes..(k + 1) * bytes).unwrap_or_default();
            word.iter().rev().fold(0, |w, &b| w << 8 | u64::from(b))
        };
        points.push(G::new(numbers.vertices[number], [0, 1, 2].map(word)))?;
    }
    for (triangle, &corner) in unpacked.piece.triangles.iter().zip(&numbers.corners) {
        let mut words = triangle.map(|v| numbers.vertices[v as usize]);
        words.rotate_right((corner % 3) as usize);
        triangles.push(V::new(corner / 3, words))?;
    }
    Ok(())
}

/// Hands out all rows in order, and the number of the first of each piece; each must be there once.
fn in_order<R: Row>(
    ws: &Workspace,
    packed: &Packed,
    (what, count): (&str, u64),
    rows: Buckets<R>,
    write: impl Fn(u64, &[R]) -> Result<()> + Sync,
) -> Result<()> {
    let memory = (ws.budget.free() / ws.workers.count() as u64 / 2).min(32 << 20);
    let memory = memory.max(Sorter::<R>::least());
    let threads = (ws.budget.free() / memory).clamp(1, ws.workers.count() as u64);
    let few = Workers::new(threads as usize)?;
    let wrong = |number: u64| {
        Error::input(
            packed.path(),
            "the order that it keeps",
            format!("each {what} once"),
            format!("{what} {number} twice or never"),
            "the file is damaged; get it anew, or encode the mesh again",
        )
    };
    few.run(
        rows.count(),
        || rows.sorter(memory),
        |sorter, bucket| {
            let range = rows.range(bucket);
            let mut next = range.start;
            rows.sorted(bucket, sorter, &mut |found| {
                found.chunks(ROWS).try_for_each(|found| {
                    let first = next;
                    for row in found {
                        if row.key(0) != next {
                            return Err(wrong(next.min(row.key(0))));
                        }
                        next += 1;
                    }
                    write(first, found)
                })
            })?;
            match next < range.end.min(count) {
                true => Err(wrong(next)),
                false => Ok(()),
            }
        },
        |_| Ok(()),
    )
}
