//! How many vertices and triangles a PLY file has, from its header and its length.
//!
//! Why that is often exact: in a binary file whose only list holds the corners of the faces,
//! everything else has a known size, so the length tells the number of all corners together;
//! and faces of c corners are cut into c - 2 triangles each, so that the sum needs none of the
//! single counts. In a text, and where faces have other lists beside them, faces from all over the
//! file are looked at, and taken for the usual ones.
//!
//! Memory: the header, and a part of the file. I/O: the header, and 1 MiB.

use super::lies::{by_some, lines};
use super::{Encoding, Outline, Plan, Scalar, Step};
use crate::error::Result;
use crate::input::Endian;
use crate::input::reader::ByteReader;
use crate::input::sample::{Sample, words};
use crate::input::survey::{Counted, refuse_beyond};

/// Counts the mesh that the reader is at the beginning of, in a file of `length` bytes.
///
/// # Errors
/// [`crate::Error::Input`] for a header that promises no mesh, or more than the file can hold;
/// [`crate::Error::Io`].
pub fn count(mut reader: ByteReader, length: u64) -> Result<Counted> {
    let outline = Outline::read(&mut reader)?;
    let (plans, data) = (&outline.plans, length.saturating_sub(reader.offset()));
    let ascii = outline.header.encoding == Encoding::Ascii;
    let least = plans.iter().fold(0u64, |sum, plan| {
        let row = plan.steps.iter().map(|step| least_bytes(step, ascii));
        sum.saturating_add(plan.rows.saturating_mul(row.sum()))
    });
    // The last value of a text may end without a blank.
    let least_data = least.saturating_sub(u64::from(ascii));
    refuse_beyond(reader.path(), least_data, data)?;
    let rows = |wanted: fn(&Step) -> bool| -> u64 {
        let some = plans.iter().filter(|p| p.steps.iter().any(wanted));
        some.map(|p| p.rows).sum()
    };
    let faces = rows(|s| matches!(s, Step::Face { .. }));
    let strips = rows(|s| matches!(s, Step::Strip { .. }));
    let (triangles, exact) = if ascii {
        (in_text(&reader, plans, [faces, strips])?, false)
    } else {
        match in_bytes(plans, faces, data - least) {
            (guess, false) => {
                let endian = match outline.header.encoding {
                    Encoding::Big => Endian::Big,
                    _ => Endian::Little,
                };
                (by_some(&reader, plans, endian)?.unwrap_or(guess), false)
            }
            exact => exact,
        }
    };
    let vertices = rows(|s| matches!(s, Step::Coord(..)));
    Ok(Counted {
        triangles,
        vertices,
        coords: outline.kind,
        exact,
        // A face makes a triangle at least.
        least: [if exact { triangles } else { faces }, vertices],
    })
}

/// Bytes that a value takes at least; in a text a digit and a blank.
fn least_bytes(step: &Step, ascii: bool) -> u64 {
    match step {
        _ if ascii => 2,
        Step::Skip(one) | Step::Coord(_, one) => one.bytes() as u64,
        Step::SkipList { count, .. } | Step::Face { count, .. } | Step::Strip { count, .. } => {
            count.bytes() as u64
        }
    }
}

/// Triangles when the items of all lists take `items` bytes; true when that is exact.
pub(super) fn in_bytes(plans: &[Plan], faces: u64, items: u64) -> (u64, bool) {
    let lists = |plan: &Plan| -> Vec<(bool, Scalar, u64)> {
        let list = |step: &Step| match *step {
            Step::SkipList { item, .. } | Step::Strip { item, .. } => Some((false, item)),
            Step::Face { item, .. } => Some((true, item)),
            _ => None,
        };
        let lists = plan.steps.iter().filter_map(list);
        lists.map(|(face, item)| (face, item, plan.rows)).collect()
    };
    let with_rows = plans.iter().filter(|p| p.rows > 0);
    match with_rows.flat_map(lists).collect::<Vec<_>>()[..] {
        [(face, item, rows)] => {
            let bytes = item.bytes() as u64;
            let triangles = (items / bytes).saturating_sub(2 * rows);
            (triangles, face && items.is_multiple_of(bytes))
        }
        [] => (0, true),
        // Lists share the bytes, nobody knows how; mostly faces are triangles.
        _ => (faces, false),
    }
}

/// Triangles of a text.
fn in_text(reader: &ByteReader, plans: &[Plan], [faces, strips]: [u64; 2]) -> Result<u64> {
    if faces > 0 {
        // At the end, as nearly all programs write them.
        return Ok(lines(reader, plans)?.map_or(faces, |lines| lines.triangles()));
    }
    if strips == 0 {
        return Ok(0);
    }
    // The words that are no other values.
    let values = |plan: &Plan| plan.rows.saturating_mul(plan.steps.len() as u64);
    let others = plans.iter().map(values).fold(0, u64::saturating_add);
    let sample = Sample::open(reader.path())?;
    let [all] = sample.sums(|line| [words(line).count() as u64])?;
    Ok(all.saturating_sub(others))
}
