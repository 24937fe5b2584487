//! The rows of a binary PLY, of either byte order.
//!
//! The usual rows are gathered many at a time ([`super::gather`]); a face that is no triangle,
//! and everything less usual, is read step by step.
//!
//! Memory: the reader's and the sink's buffers. I/O: the input once.

use super::gather::{FaceLayout, VertexLayout, gather, gather_triangles};
use super::{Plan, Scalar, Step, TRAILING, negative_index};
use crate::error::{Error, Result};
use crate::input::CoordKind;
use crate::input::cut::Strip;
use crate::input::reader::ByteReader;
use crate::input::sink::MeshSink;

/// Reads the rows of all elements, and that nothing follows.
pub(super) fn read(
    reader: ByteReader,
    big: bool,
    plans: &[Plan],
    sink: &mut MeshSink,
) -> Result<ByteReader> {
    let mut rows = Rows { reader, big, sink };
    for plan in plans {
        rows.element(plan)?;
    }
    let Rows { mut reader, .. } = rows;
    loop {
        let rest = reader.buffer()?;
        if rest.is_empty() {
            return Ok(reader);
        }
        if let Some(at) = rest.iter().position(|b| !b.is_ascii_whitespace()) {
            reader.consume(at);
            let at = format!("byte {}", reader.offset());
            let (what, found) = ("the end of the file", "more bytes");
            return Err(Error::input(reader.path(), at, what, found, TRAILING));
        }
        reader.consume(usize::MAX);
    }
}

struct Rows<'a> {
    reader: ByteReader,
    big: bool,
    sink: &'a mut MeshSink,
}

impl Rows<'_> {
    fn element(&mut self, plan: &Plan) -> Result<()> {
        let vertices = plan
            .is_vertex()
            .then(|| VertexLayout::of(plan, self.sink.kind()));
        let faces = FaceLayout::of(plan);
        let mut row = 0;
        // A row of no property has no byte.
        while row < plan.rows && !plan.steps.is_empty() {
            match (vertices.flatten(), faces) {
                (Some(layout), _) => row += self.gather_vertices(layout, plan, row)?,
                (_, Some(layout)) => {
                    let gathered = self.gather_faces(layout, plan.rows - row)?;
                    row += gathered;
                    if gathered == 0 {
                        self.row(plan, row)?;
                        row += 1;
                    }
                }
                _ => {
                    self.row(plan, row)?;
                    row += 1;
                }
            }
        }
        Ok(())
    }

    /// Gathers the vertices that are in the buffer, one at least; returns how many.
    fn gather_vertices(&mut self, layout: VertexLayout, plan: &Plan, row: u64) -> Result<u64> {
        if self.reader.peek(layout.stride)?.len() < layout.stride {
            return Err(self.reader.cut_short(plan.row(row)));
        }
        let kind = self.sink.kind();
        let input = whole_rows(self.reader.buffered(), layout.stride, plan.rows - row);
        let out = self.sink.vertex_room()?;
        let rows = match (kind, self.big) {
            (CoordKind::F4, false) => gather::<4, false>(input, layout, out),
            (CoordKind::F4, true) => gather::<4, true>(input, layout, out),
            (CoordKind::F8, false) => gather::<8, false>(input, layout, out),
            (CoordKind::F8, true) => gather::<8, true>(input, layout, out),
        };
        self.sink.vertices_put(rows);
        self.reader.consume(rows * layout.stride);
        Ok(rows as u64)
    }

    /// Gathers triangles from the buffer up to the first row that is none; returns how many.
    fn gather_faces(&mut self, layout: FaceLayout, left: u64) -> Result<u64> {
        let stride = layout.stride();
        self.reader.peek(stride)?;
        let input = whole_rows(self.reader.buffered(), stride, left);
        let out = self.sink.triangle_room()?;
        let (rows, largest) = if self.big {
            gather_triangles::<true>(input, layout, out)
        } else {
            gather_triangles::<false>(input, layout, out)
        };
        self.sink.triangles_put(rows, largest.into());
        self.reader.consume(rows * stride);
        Ok(rows as u64)
    }

    /// Reads one row step by step.
    fn row(&mut self, plan: &Plan, row: u64) -> Result<()> {
        let mut at4 = [0f32; 3];
        let mut at8 = [0f64; 3];
        let mut fits_f4 = true;
        for step in &plan.steps {
            match *step {
                Step::Skip(scalar) => self.skip(scalar.bytes() as u64, plan, row)?,
                Step::SkipList { count, item } => {
                    let items = self.count(count, plan, row)?;
                    self.skip(items * item.bytes() as u64, plan, row)?;
                }
                Step::Coord(axis, scalar) => {
                    let value = self.value(scalar, plan, row)?;
                    (at4[axis], at8[axis]) = coordinate(scalar, value);
                    fits_f4 &= scalar.fits_f4();
                }
                Step::Face { count, item } => self.face(count, item, plan, row)?,
                Step::Strip { count, item } => self.strip(count, item, plan, row)?,
            }
        }
        match plan.is_vertex() {
            true if fits_f4 => self.sink.vertex4(at4),
            true => self.sink.vertex8(at8),
            false => Ok(()),
        }
    }

    fn face(&mut self, count: Scalar, item: Scalar, plan: &Plan, row: u64) -> Result<()> {
        let begin = self.reader.offset();
        let corners = self.count(count, plan, row)?;
        self.sink.begin_face();
        self.items(corners, item, plan, row, |sink, v| {
            let Ok(v) = u64::try_from(v) else {
                return Ok(false);
            };
            sink.corner(v)?;
            Ok(true)
        })?;
        let at = || format!("byte {begin}: {}", plan.row(row));
        self.sink.end_face(at)?;
        Ok(())
    }

    fn strip(&mut self, count: Scalar, item: Scalar, plan: &Plan, row: u64) -> Result<()> {
        let corners = self.count(count, plan, row)?;
        let mut strip = Strip::default();
        self.items(corners, item, plan, row, |sink, v| {
            match u64::try_from(v) {
                Ok(v) => {
                    if let Some(triangle) = strip.corner(v) {
                        sink.triangle(triangle)?;
                    }
                }
                Err(_) if v == -1 => strip = Strip::default(),
                Err(_) => return Ok(false),
            }
            Ok(true)
        })
    }

    /// Gives `n` integers to `take`, which says false to an index that cannot be.
    fn items(
        &mut self,
        n: u64,
        item: Scalar,
        plan: &Plan,
        row: u64,
        mut take: impl FnMut(&mut MeshSink, i64) -> Result<bool>,
    ) -> Result<()> {
        let width = item.bytes();
        let mut left = n;
        while left > 0 {
            if self.reader.peek(width)?.len() < width {
                return Err(self.reader.cut_short(plan.row(row)));
            }
            let input = whole_rows(self.reader.buffered(), width, left);
            for (i, bytes) in input.chunks_exact(width).enumerate() {
                let v = integer(item, little(bytes, self.big));
                if !take(self.sink, v)? {
                    let byte = self.reader.offset() + (i * width) as u64;
                    let at = format!("byte {byte}: {}", plan.row(row));
                    return Err(negative_index(self.reader.path(), at, v));
                }
            }
            left -= (input.len() / width) as u64;
            let bytes = input.len();
            self.reader.consume(bytes);
        }
        Ok(())
    }

    /// Reads a scalar: its bytes in little-endian order.
    fn value(&mut self, scalar: Scalar, plan: &Plan, row: u64) -> Result<[u8; 8]> {
        let bytes = self.reader.peek(scalar.bytes())?;
        if bytes.len() < scalar.bytes() {
            return Err(self.reader.cut_short(plan.row(row)));
        }
        let value = little(bytes, self.big);
        self.reader.consume(scalar.bytes());
        Ok(value)
    }

    fn count(&mut self, scalar: Scalar, plan: &Plan, row: u64) -> Result<u64> {
        let count = integer(scalar, self.value(scalar, plan, row)?);
        u64::try_from(count).map_err(|_| {
            let byte = self.reader.offset() - scalar.bytes() as u64;
            Error::input(
                self.reader.path(),
                format!("byte {byte}: {}", plan.row(row)),
                "the length of a list, 0 or more",
                count.to_string(),
                "the file is damaged, or its byte order is not the one in the header",
            )
        })
    }

    fn skip(&mut self, bytes: u64, plan: &Plan, row: u64) -> Result<()> {
        match self.reader.skip(bytes) {
            Err(Error::Input(_)) => Err(self.reader.cut_short(plan.row(row))),
            other => other,
        }
    }
}

/// The whole rows at the start of `buf`, at most `left`.
fn whole_rows(buf: &[u8], stride: usize, left: u64) -> &[u8] {
    let left = usize::try_from(left).unwrap_or(usize::MAX);
    &buf[..(buf.len() / stride).min(left) * stride]
}

/// A value of up to 8 bytes in little-endian order.
fn little(bytes: &[u8], big: bool) -> [u8; 8] {
    let mut value = [0; 8];
    value[..bytes.len()].copy_from_slice(bytes);
    if big {
        value[..bytes.len()].reverse();
    }
    value
}

fn integer(scalar: Scalar, value: [u8; 8]) -> i64 {
    let bits = u64::from_le_bytes(value);
    match scalar {
        Scalar::I8 => i64::from(bits as i8),
        Scalar::U8 | Scalar::U16 | Scalar::U32 => bits as i64,
        Scalar::I16 => i64::from(bits as i16),
        // The header's check lets no list of a float type come here.
        Scalar::I32 | Scalar::F32 | Scalar::F64 => i64::from(bits as i32),
    }
}

/// A coordinate as f4 and f8; the f4 keeps the bits of a float, NaN included.
fn coordinate(scalar: Scalar, value: [u8; 8]) -> (f32, f64) {
    let bits = u64::from_le_bytes(value);
    match scalar {
        Scalar::F32 => {
            let value = f32::from_bits(bits as u32);
            (value, value.into())
        }
        Scalar::F64 => {
            let value = f64::from_bits(bits);
            (value as f32, value)
        }
        _ => {
            let value = integer(scalar, value);
            (value as f32, value as f64)
        }
    }
}
