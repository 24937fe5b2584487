//! PLY: binary little-endian, or ascii.
//!
//! Memory: none of its own. I/O: none of its own.
//! Source: G. Turk, "The PLY Polygon File Format", 1994.

use super::job::Job;
use super::plain;
use super::sink::Sink;
use crate::error::{Error, Result};
use crate::table::array::Coords;

pub(super) fn write(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    let head = header(job, sink)?;
    sink.put(|buf| buf.extend_from_slice(head.as_bytes()))?;
    if job.request.ascii {
        plain::points(job, sink, "")?;
        return plain::faces(job, sink);
    }
    job.each_point(|_, row| sink.put(|buf| buf.extend_from_slice(row)))?;
    job.each_face(|t| {
        sink.put(|buf| {
            buf.push(3);
            // The header's type was chosen so that every id fits; int and uint agree there.
            t.iter()
                .for_each(|&v| buf.extend_from_slice(&(v as u32).to_le_bytes()));
        })
    })
}

fn header(job: &Job<'_>, sink: &Sink<'_>) -> Result<String> {
    let index = index_type(job.vertices).ok_or_else(|| {
        Error::Usage(format!(
            "{}: the indices of a PLY file have 32 bits, and {} vertices need more; \
             export to npy, or choose components",
            sink.path().display(),
            job.vertices
        ))
    })?;
    let encoding = if job.request.ascii {
        "ascii"
    } else {
        "binary_little_endian"
    };
    let real = match job.g {
        Some((Coords::F8, _)) => "double",
        _ => "float",
    };
    Ok(format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty {real} x\nproperty {real} y\n\
         property {real} z\nelement face {}\nproperty list uchar {index} vertex_indices\n\
         end_header\n",
        job.vertices, job.triangles
    ))
}

/// `int`, which every reader knows, while it holds all ids; else `uint`, while that does.
fn index_type(vertices: u64) -> Option<&'static str> {
    if vertices <= 1 << 31 {
        Some("int")
    } else if vertices <= 1 << 32 {
        Some("uint")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_id_decides_the_type() {
        let ids_to = |largest: u64| index_type(largest + 1);
        assert_eq!(ids_to(i32::MAX as u64), Some("int"));
        assert_eq!(ids_to(i32::MAX as u64 + 1), Some("uint"));
        assert_eq!(ids_to(u64::from(u32::MAX)), Some("uint"));
        assert_eq!(ids_to(u64::from(u32::MAX) + 1), None);
        assert_eq!(index_type(0), Some("int"));
    }
}
