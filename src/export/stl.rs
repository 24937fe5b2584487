//! STL, binary: for each triangle a normal and three positions, all f4.
//!
//! The normal is that of the positions as written, by the right hand rule; of a triangle
//! without area, or with a position that is not finite, it is zero.
//!
//! Memory: what [`super::gather`] takes. I/O: none of its own.

use super::gather::Gather;
use super::job::Job;
use super::sink::Sink;
use crate::error::{Error, Result};
use glam::DVec3;

/// 80 bytes, not beginning with "solid", which would look like text.
const HEAD: &[u8] = b"binary STL by cornermill";

pub(super) fn write(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    let Ok(triangles) = u32::try_from(job.triangles) else {
        return Err(Error::Usage(format!(
            "{}: an STL file counts its triangles with 32 bits, and {} need more; \
             export to ply or npy, or choose components",
            sink.path().display(),
            job.triangles
        )));
    };
    let mut head = [0; 84];
    head[..HEAD.len()].copy_from_slice(HEAD);
    head[80..].copy_from_slice(&triangles.to_le_bytes());
    sink.put(|buf| buf.extend_from_slice(&head))?;
    // G is checked to be there before an export begins.
    let Some((kind, g)) = job.g.take() else {
        return Ok(());
    };
    let mut gather = Gather::new(kind, job.step);
    let done = job.each_block("write triangles", |block| {
        let spots = gather.read(&g, block)?;
        let (spots, _) = spots.as_chunks::<3>();
        for (ids, spots) in block.iter().zip(spots) {
            let narrow = [0, 1, 2].map(|k| spots[k].map(|x| x as f32));
            for k in 0..3 {
                fits(sink, ids[k], spots[k], narrow[k])?;
            }
            sink.put(|buf| put(buf, narrow))?;
        }
        Ok(())
    });
    job.g = Some((kind, g));
    done
}

/// A finite coordinate must not become infinite.
fn fits(sink: &Sink<'_>, vertex: u64, wide: [f64; 3], narrow: [f32; 3]) -> Result<()> {
    let lost = |k: &usize| wide[*k].is_finite() && !narrow[*k].is_finite();
    match (0..3).find(lost) {
        None => Ok(()),
        Some(k) => Err(Error::Usage(format!(
            "{}: the coordinates of an STL file are f4, and vertex {vertex} has {:e}; \
             export to ply",
            sink.path().display(),
            wide[k]
        ))),
    }
}

fn put(buf: &mut Vec<u8>, spots: [[f32; 3]; 3]) {
    let [a, b, c] = spots.map(|s| DVec3::from_array(s.map(f64::from)));
    let normal = (b - a).cross(c - a);
    let normal = normal.try_normalize().unwrap_or(DVec3::ZERO);
    for x in normal.to_array().map(|x| x as f32) {
        buf.extend_from_slice(&x.to_le_bytes());
    }
    for x in spots.as_flattened() {
        buf.extend_from_slice(&x.to_le_bytes());
    }
    buf.extend_from_slice(&[0, 0]);
}
