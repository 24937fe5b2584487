//! OBJ and OFF: lines of text, vertices first.
//!
//! Memory: none of its own. I/O: none of its own.

use super::job::Job;
use super::number;
use super::sink::Sink;
use crate::error::Result;
use std::io::Write;

/// OBJ: `v x y z`, then `f a b c` counted from 1.
pub(super) fn write_obj(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    points(job, sink, "v")?;
    job.each_face(|t| line(sink, "f", t.map(|v| v + 1)))
}

/// OFF: the counts (of edges a 0, as usual), then `x y z`, then `3 a b c` counted from 0.
pub(super) fn write_off(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    let head = format!("OFF\n{} {} 0\n", job.vertices, job.triangles);
    sink.put(|buf| buf.extend_from_slice(head.as_bytes()))?;
    points(job, sink, "")?;
    faces(job, sink)
}

/// A line for each vertex: the word, and the coordinates.
pub(super) fn points(job: &mut Job<'_>, sink: &mut Sink<'_>, word: &str) -> Result<()> {
    job.each_point(|kind, row| {
        sink.put(|buf| {
            let start = buf.len();
            buf.extend_from_slice(word.as_bytes());
            number::put_row(buf, kind, row);
            if word.is_empty() {
                // The space that parts a coordinate from what is before it.
                buf.remove(start);
            }
            buf.push(b'\n');
        })
    })
}

/// A line for each triangle: `3 a b c` counted from 0.
pub(super) fn faces(job: &mut Job<'_>, sink: &mut Sink<'_>) -> Result<()> {
    job.each_face(|t| line(sink, "3", t))
}

fn line(sink: &mut Sink<'_>, word: &str, [a, b, c]: [u64; 3]) -> Result<()> {
    // Writing to a Vec cannot fail.
    sink.put(|buf| drop(writeln!(buf, "{word} {a} {b} {c}")))
}
