//! Where the triangles of a PLY file lie, for a look at some of them.
//!
//! Memory: the header, and of a text what [`Lines::map`] takes. I/O: the same.

use super::count::in_bytes;
use super::{Encoding, Outline, Plan, Step};
use crate::disk::DataFile;
use crate::error::Result;
use crate::input::lines::{Column, Form, Lines};
use crate::input::look::{Corner, Lies, Rows};
use crate::input::polygons::Polygons;
use crate::input::reader::ByteReader;
use crate::input::{Endian, IndexKind};

/// Rows wider than this, in bytes, are not looked at where they lie at a fixed distance: many are
/// read at once.
const WIDEST: u64 = 128;

/// Where the triangles of a file lie; `None` where they are strips, or rows that differ in length
/// come before the faces, or anything behind them that does not lie at a fixed distance.
///
/// # Errors
/// [`crate::Error::Input`] for a header that promises no mesh; [`crate::Error::Io`].
pub(in crate::input) fn lies(mut reader: ByteReader) -> Result<Option<Lies>> {
    let outline = Outline::read(&mut reader)?;
    let plans = &outline.plans;
    let endian = match outline.header.encoding {
        Encoding::Ascii => return Ok(lines(&reader, plans)?.map(Lies::Lines)),
        Encoding::Big => Endian::Big,
        Encoding::Little => Endian::Little,
    };
    match polygons(&reader, plans, endian) {
        Some(polygons) => Ok(Some(match rows(&reader, plans, &polygons) {
            Some(rows) => Lies::Rows(rows),
            None => Lies::Polygons(polygons),
        })),
        None => Ok(None),
    }
}

/// The triangles of a text whose last rows are faces.
///
/// # Errors
/// [`crate::Error::Io`].
pub(super) fn lines(reader: &ByteReader, plans: &[Plan]) -> Result<Option<Lines>> {
    let Some((plan, columns)) = last_faces(plans) else {
        return Ok(None);
    };
    // Too many values are passed over behind those that are not used anyway.
    let exactly = matches!(columns.last(), Some(Column::Face(..)));
    let form = Form::Rows(columns, exactly);
    Lines::map(reader.path(), form, reader.offset(), Some(plan.rows)).map(Some)
}

/// Triangles of a binary file whose last rows are faces with other lists beside them, by some of its
/// rows.
///
/// # Errors
/// [`crate::Error::Io`].
pub(super) fn by_some(reader: &ByteReader, plans: &[Plan], endian: Endian) -> Result<Option<u64>> {
    let Some(polygons) = polygons(reader, plans, endian) else {
        return Ok(None);
    };
    let file = DataFile::open(reader.path(), &Default::default())?;
    let rows = last_faces(plans).map_or(0, |(plan, _)| plan.rows);
    let fans = polygons.fans(&file)?;
    Ok(fans.map(|fans| (rows as f64 * fans).round() as u64))
}

/// The last rows, when they are faces, and what they hold.
fn last_faces(plans: &[Plan]) -> Option<(&Plan, Vec<Column>)> {
    let plan = plans.iter().rfind(|plan| plan.rows > 0)?;
    let columns = columns(plan)?;
    let face = |column: &&Column| matches!(column, Column::Face(..));
    (columns.iter().filter(face).count() == 1).then_some((plan, columns))
}

/// What a row holds; `None` for strips.
fn columns(plan: &Plan) -> Option<Vec<Column>> {
    let bytes = |scalar: super::Scalar| scalar.bytes() as u64;
    let column = |step: &Step| match *step {
        Step::Skip(one) | Step::Coord(_, one) => Some(Column::One(bytes(one))),
        Step::SkipList { count, item } => Some(Column::List(bytes(count), bytes(item))),
        Step::Face { count, item } => Some(Column::Face(bytes(count), bytes(item))),
        Step::Strip { .. } => None,
    };
    plan.steps.iter().map(column).collect()
}

/// Bytes of a row with so many corners; `None` with other lists.
fn row_bytes(columns: &[Column], corners: u64) -> Option<u64> {
    columns.iter().try_fold(0, |sum, column| match *column {
        Column::One(bytes) => Some(sum + bytes),
        Column::Face(count, item) => Some(sum + count + corners * item),
        Column::List(..) => None,
    })
}

/// The polygons that the file ends with, behind rows of a fixed length.
fn polygons(reader: &ByteReader, plans: &[Plan], endian: Endian) -> Option<Polygons> {
    let (faces, columns_of_faces) = last_faces(plans)?;
    let mut at = reader.offset();
    let mut vertices = 0u64;
    for plan in plans.iter().filter(|plan| plan.rows > 0) {
        if std::ptr::eq(plan, faces) {
            break;
        }
        let columns = columns(plan)?;
        let none = columns.iter().all(|c| matches!(c, Column::One(_)));
        let row = row_bytes(&columns, 0).filter(|_| none)?;
        at = at.checked_add(plan.rows.checked_mul(row)?)?;
        vertices += if plan.is_vertex() { plan.rows } else { 0 };
    }
    let end = reader.length().filter(|&end| end > at)?;
    let least = row_bytes(&columns_of_faces, 0).unwrap_or(0);
    let items = (end - at).saturating_sub(faces.rows.saturating_mul(least));
    Some(Polygons {
        at,
        end,
        columns: columns_of_faces,
        endian,
        vertices,
        triangles: in_bytes(plans, faces.rows, items).0,
    })
}

/// The same, when they are all triangles.
fn rows(reader: &ByteReader, plans: &[Plan], polygons: &Polygons) -> Option<Rows> {
    let (faces, _) = last_faces(plans)?;
    let row = row_bytes(&polygons.columns, 3)?;
    // Polygons would make the file longer.
    let end = polygons.at.checked_add(faces.rows.checked_mul(row)?)?;
    if row > WIDEST || reader.length() != Some(end) {
        return None;
    }
    let mut before = 0;
    for column in &polygons.columns {
        match *column {
            Column::Face(count, item) => {
                let kind = match item {
                    4 => IndexKind::U4,
                    8 => IndexKind::U8,
                    _ => return None,
                };
                return Some(Rows {
                    at: polygons.at,
                    row,
                    before: before + count,
                    triangles: faces.rows,
                    corner: Corner::Id(kind, polygons.endian),
                });
            }
            Column::One(bytes) => before += bytes,
            Column::List(..) => return None,
        }
    }
    None
}
