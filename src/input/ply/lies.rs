//! Where the triangles of a PLY file lie, for a look at some of them.
//!
//! Why that is known: rows of a fixed length before the faces and behind them leave to the faces the
//! bytes between; between rows of other lengths, and in a text, the faces are found by halving
//! ([`extent`]).
//!
//! Memory: the header, and of a text what [`Lines::map`] takes. I/O: the same; of a binary file whose
//! faces have other lists beside them, or are strips, 4 MiB, and 7 MiB where they lie between rows
//! of no fixed length.

use super::{Encoding, Outline, Plan, Step};
use crate::disk::DataFile;
use crate::error::Result;
use crate::input::extent::extent;
use crate::input::lines::{self, Column, Form, Lines};
use crate::input::look::{Corner, Lies, Rows};
use crate::input::polygons::Polygons;
use crate::input::reader::ByteReader;
use crate::input::{Endian, IndexKind};

/// Rows wider than this, in bytes, are not looked at where they lie at a fixed distance: many are
/// read at once.
const WIDEST: u64 = 128;

/// Where the triangles of a file lie, or most of them, where faces and strips have some; `None` where
/// there are none.
///
/// # Errors
/// [`crate::Error::Input`] for a header that promises no mesh; [`crate::Error::Io`].
pub(in crate::input) fn lies(mut reader: ByteReader) -> Result<Option<Lies>> {
    let outline = Outline::read(&mut reader)?;
    let all = all(&reader, &outline)?;
    Ok(all.into_iter().max_by_key(Lies::triangles))
}

/// Where the triangles of each element lie that has some, behind the header that was read.
///
/// # Errors
/// [`crate::Error::Io`].
pub(super) fn all(reader: &ByteReader, outline: &Outline) -> Result<Vec<Lies>> {
    let has_bytes = |plan: &&Plan| plan.rows > 0 && !plan.steps.is_empty();
    let plans: Vec<&Plan> = outline.plans.iter().filter(has_bytes).collect();
    let makes = |step: &Step| matches!(step, Step::Face { .. } | Step::Strip { .. });
    let mut all = Vec::new();
    for (i, plan) in plans.iter().enumerate() {
        if plan.steps.iter().any(makes) {
            let faces = Faces {
                plan,
                columns: columns(plan),
                before: &plans[..i],
                behind: &plans[i + 1..],
            };
            all.extend(faces.lie(reader, outline.header.encoding)?);
        }
    }
    Ok(all)
}

/// An element that triangles are made of, among the others that have rows.
struct Faces<'a> {
    plan: &'a Plan,
    columns: Vec<Column>,
    before: &'a [&'a Plan],
    behind: &'a [&'a Plan],
}

impl Faces<'_> {
    fn lie(&self, reader: &ByteReader, encoding: Encoding) -> Result<Option<Lies>> {
        let endian = match encoding {
            Encoding::Ascii => return self.lines(reader).map(|lines| Some(Lies::Lines(lines))),
            Encoding::Big => Endian::Big,
            Encoding::Little => Endian::Little,
        };
        let Some((polygons, beside)) = self.polygons(reader, endian) else {
            return Ok(None);
        };
        if let Some(rows) = self.rows(&polygons, beside) {
            return Ok(Some(Lies::Rows(rows)));
        }
        let found = self.found(reader, polygons, beside)?;
        Ok(Some(Lies::Polygons(found)))
    }

    fn lines(&self, reader: &ByteReader) -> Result<Lines> {
        let rows = lines::Rows {
            // Too many values are passed over behind those that are not used anyway.
            exactly: matches!(
                self.columns.last(),
                Some(Column::Face(..) | Column::Strip(..))
            ),
            columns: self.columns.clone(),
            beside: [!self.before.is_empty(), !self.behind.is_empty()],
            number: self.plan.rows,
        };
        Lines::map(reader.path(), Form::Rows(rows), reader.offset())
    }

    /// The rows of a binary file, as far as rows of a fixed length bound them; whether others are
    /// before and behind.
    fn polygons(&self, reader: &ByteReader, endian: Endian) -> Option<(Polygons, [bool; 2])> {
        let (before, any_before) = bytes_of(self.before.iter());
        let (behind, any_behind) = bytes_of(self.behind.iter().rev());
        let at = reader.offset().saturating_add(before);
        let end = reader.length()?.saturating_sub(behind);
        let others = self.before.iter().chain(self.behind);
        let vertices = others.filter(|plan| plan.is_vertex()).map(|plan| plan.rows);
        let polygons = Polygons {
            at,
            end,
            rows: self.plan.rows,
            columns: self.columns.clone(),
            endian,
            vertices: vertices.sum(),
            triangles: self.plan.rows,
            exact: false,
        };
        (end > at).then_some((polygons, [any_before, any_behind]))
    }

    /// The same, when they are all triangles.
    fn rows(&self, polygons: &Polygons, beside: [bool; 2]) -> Option<Rows> {
        let row = row_bytes(&self.columns, 3).filter(|&row| row <= WIDEST)?;
        // Polygons would make the file longer.
        let end = polygons.at.checked_add(self.plan.rows.checked_mul(row)?)?;
        if beside != [false; 2] || end != polygons.end {
            return None;
        }
        let mut before = 0;
        for column in &self.columns {
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
                        triangles: self.plan.rows,
                        corner: Corner::Id(kind, polygons.endian),
                    });
                }
                Column::One(bytes) => before += bytes,
                Column::List(..) | Column::Strip(..) => return None,
            }
        }
        None
    }

    /// Triangles of polygons without other lists: as many as they have corners, but for two each.
    fn by_length(&self, polygons: &Polygons, beside: [bool; 2]) -> Option<u64> {
        let [none, one] = [0, 1].map(|corners| row_bytes(&self.columns, corners));
        let item = one? - none?;
        let rows = polygons.rows.checked_mul(none?)?;
        let items = (polygons.end - polygons.at).checked_sub(rows)?;
        let known = beside == [false; 2] && items.is_multiple_of(item);
        known.then(|| (items / item).saturating_sub(2 * polygons.rows))
    }

    /// The same between rows of no fixed length, with the triangles that they make.
    fn found(
        &self,
        reader: &ByteReader,
        mut polygons: Polygons,
        beside: [bool; 2],
    ) -> Result<Polygons> {
        if let Some(triangles) = self.by_length(&polygons, beside) {
            (polygons.triangles, polygons.exact) = (triangles, true);
            return Ok(polygons);
        }
        let file = DataFile::open(reader.path(), &Default::default())?;
        let within = polygons.at..polygons.end;
        let found = extent(within, beside, |at| polygons.are_at(&file, at))?;
        (polygons.at, polygons.end) = (found.start, found.end);
        if let Some(triangles) = polygons.guess(&file)? {
            polygons.triangles = triangles;
        }
        Ok(polygons)
    }
}

/// What a row holds.
fn columns(plan: &Plan) -> Vec<Column> {
    let bytes = |scalar: super::Scalar| scalar.bytes() as u64;
    let column = |step: &Step| match *step {
        Step::Skip(one) | Step::Coord(_, one) => Column::One(bytes(one)),
        Step::SkipList { count, item } => Column::List(bytes(count), bytes(item)),
        Step::Face { count, item } => Column::Face(bytes(count), bytes(item)),
        Step::Strip { count, item } => Column::Strip(bytes(count), bytes(item)),
    };
    plan.steps.iter().map(column).collect()
}

/// Bytes of a row with so many corners; `None` with other lists.
fn row_bytes(columns: &[Column], corners: u64) -> Option<u64> {
    columns.iter().try_fold(0, |sum, column| match *column {
        Column::One(bytes) => Some(sum + bytes),
        Column::Face(count, item) => Some(sum + count + corners * item),
        Column::List(..) | Column::Strip(..) => None,
    })
}

/// Bytes of the rows of elements up to the first whose rows differ in length, and whether one does.
fn bytes_of<'a>(plans: impl Iterator<Item = &'a &'a Plan>) -> (u64, bool) {
    let mut bytes = 0u64;
    for plan in plans {
        match row_bytes(&columns(plan), 0) {
            Some(row) => bytes = bytes.saturating_add(plan.rows.saturating_mul(row)),
            None => return (bytes, true),
        }
    }
    (bytes, false)
}
