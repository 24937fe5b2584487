//! How many vertices and triangles a PLY file has, from its header and its length.
//!
//! Why that is often exact: in a binary file whose only list holds the corners of the faces,
//! everything else has a known size, so the length tells the number of all corners together;
//! and faces of c corners are cut into c - 2 triangles each, so that the sum needs none of the
//! single counts. In a text, in strips, and where there are other lists, rows from all over the file
//! are looked at, and taken for the usual ones.
//!
//! Memory, I/O: those of [`all`].

use super::lies::all;
use super::{Encoding, Outline, Step};
use crate::error::Result;
use crate::input::reader::ByteReader;
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
    let (mut triangles, mut exact) = (0u64, true);
    for lies in all(&reader, &outline)? {
        triangles = triangles.saturating_add(lies.triangles());
        exact &= lies.exact();
    }
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
