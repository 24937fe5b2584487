//! The triangles of a text that was not read yet: about how many there are, and a look at some.
//!
//! Why parts from all over the file: faces of other numbers of corners, and longer ids, come later
//! than the first. [`PARTS`](super::sample) parts at equal distances, each standing for the
//! stretch of file around it, see them all, and so does the map that they give, from the number of a
//! triangle to about where it lies. Rows of faces are found between others ([`extent`](super::extent)):
//! a part of the file shows which they are. Nothing is checked here, and what is no face is passed
//! over: what is wrong is told when it is read.
//!
//! Memory: 1 MiB, a number a part, the triangles asked for. I/O: 1 MiB for the map, 4 KiB for each
//! glance at rows; for a look what the triangles take, and a bound on what lies between them.

use super::cut::{RESTART, fan, strips};
use super::extent::extent;
use super::number::{parse_f4, parse_integer};
use super::sample::{PART, Sample, is_end, words};
use crate::error::Result;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// Bytes that are read at a time.
const STEP: u64 = 256 << 10;
/// Bytes for each triangle of a look, after which no more are looked for.
pub(super) const MOST_ROW: u64 = 512;
/// Numbers in a row that are corners of a strip where they are no row: others have fewer.
const PIECE: usize = 64;

/// What a row of faces has in a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// A value of so many bytes, in a binary file.
    One(u64),
    /// A list: bytes of its length, and of an item.
    List(u64, u64),
    /// The list of the corners.
    Face(u64, u64),
    /// The list of the corners of strips.
    Strip(u64, u64),
}

/// How a text spells its faces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A row a line.
    Rows(Rows),
    /// OBJ: statements `f`, between those of vertices.
    Statements,
    /// STL: three times the word `vertex` and its place, until the word `endfacet`.
    Facets,
}

/// How rows of faces are spelled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Rows {
    pub columns: Vec<Column>,
    /// Nothing may stand behind the last column.
    pub exactly: bool,
    /// Other rows lie before and behind them.
    pub beside: [bool; 2],
    /// How many there are.
    pub number: u64,
}

impl Rows {
    /// True when they are strips.
    fn strips(&self) -> bool {
        let mut columns = self.columns.iter();
        columns.any(|c| matches!(c, Column::Strip(..)))
    }
}

/// The triangles of a text.
#[derive(Debug)]
pub(super) struct Lines {
    sample: Sample,
    form: Form,
    /// Byte of the first part, and from one to the next.
    from: f64,
    stretch: f64,
    /// Triangles before each part, and of all.
    before: Vec<f64>,
    /// Vertices that statements give.
    pub vertices: u64,
}

impl Lines {
    /// Maps a text whose faces lie behind byte `from`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn map(path: &Path, form: Form, from: u64) -> Result<Lines> {
        let sample = Sample::open(path)?;
        let mut within = from..sample.length().max(from);
        if let Form::Rows(rows) = &form {
            within = extent(within, rows.beside, |at| mostly_faces(&sample, &form, at))?;
        }
        let from = within.start;
        let (mut stretch, mut found) = (0.0, Vec::new());
        sample.parts(within, |begin, length, text| {
            let mut seen = Seen::new(begin);
            let (mut triangles, mut faces) = (Vec::new(), 0u64);
            for line in text.split(is_end) {
                let had = triangles.len();
                seen.line(&form, line, &mut triangles);
                faces += u64::from(triangles.len() > had);
            }
            let by = length / text.len().max(1) as f64;
            // A facet that began before the part ends in it as well.
            let triangles = match form {
                Form::Facets => seen.facets,
                _ => triangles.len() as u64,
            };
            let counts = [triangles, faces, seen.vertices];
            stretch = length;
            found.push(counts.map(|n| n as f64 * by));
        })?;
        let [seen, vertices] = [1, 2].map(|k| found.iter().map(|f| f[k]).sum::<f64>());
        // As many triangles a face as the parts have on average.
        let by = match &form {
            // Of long strips pieces are seen, not rows.
            Form::Rows(rows) if seen > 0.0 && !rows.strips() => rows.number as f64 / seen,
            _ => 1.0,
        };
        let mut sum = 0.0;
        let mut before = vec![0.0];
        before.extend(found.iter().map(|[triangles, ..]| {
            sum += triangles * by;
            sum
        }));
        Ok(Lines {
            sample,
            form,
            from: from as f64,
            stretch,
            before,
            vertices: vertices.round() as u64,
        })
    }

    /// About how many triangles there are.
    pub fn triangles(&self) -> u64 {
        self.before.last().map_or(0, |sum| sum.round() as u64)
    }

    /// True when corners are told apart by their positions.
    pub fn by_position(&self) -> bool {
        self.form == Form::Facets
    }

    /// About where a triangle lies.
    fn place(&self, triangle: u64) -> u64 {
        let triangle = triangle as f64;
        let part = self.before.partition_point(|&n| n <= triangle);
        let part = part
            .saturating_sub(1)
            .min(self.before.len().saturating_sub(2));
        let [low, high] = [0, 1].map(|i| self.before.get(part + i).copied().unwrap_or(0.0));
        let share = match high > low {
            true => ((triangle - low) / (high - low)).clamp(0.0, 1.0),
            false => 0.0,
        };
        (self.from + (part as f64 + share) * self.stretch) as u64
    }

    /// Fills `into` with the corners of `count` triangles from about `first`, or fewer.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn read(&self, first: u64, count: u64, into: &mut Vec<[u64; 3]>) -> Result<()> {
        into.clear();
        let begin = self.place(first);
        let mut seen = Seen::new(begin);
        let most = count.saturating_mul(MOST_ROW);
        // Unless it begins with the first face, a look begins within a line. A part of a strip is one.
        let strips = matches!(&self.form, Form::Rows(rows) if rows.strips());
        let mut whole = first == 0 || strips;
        self.sample.stream(begin, most.max(STEP), STEP, |line| {
            if std::mem::replace(&mut whole, true) {
                seen.line(&self.form, line, into);
            }
            (into.len() as u64) < count
        })?;
        into.truncate(count as usize);
        Ok(())
    }
}

/// True when most rows at a byte are faces.
fn mostly_faces(sample: &Sample, form: &Form, at: u64) -> Result<bool> {
    let (mut faces, mut others) = (0u64, 0u64);
    let mut triangles = Vec::new();
    sample.lines(at, PART, |line| {
        triangles.clear();
        Seen::new(0).line(form, line, &mut triangles);
        *(if triangles.is_empty() {
            &mut others
        } else {
            &mut faces
        }) += 1;
    })?;
    Ok(faces > others)
}

/// What was seen of a text so far.
struct Seen {
    /// From where on vertices are counted: more than there are before.
    begin: u64,
    vertices: u64,
    /// Facets that ended, and the corners of the next.
    facets: u64,
    facet: Vec<u64>,
    corners: Vec<u64>,
}

impl Seen {
    fn new(begin: u64) -> Seen {
        Seen {
            begin,
            vertices: 0,
            facets: 0,
            facet: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Takes a line; appends the triangles that it completes.
    fn line(&mut self, form: &Form, line: &[u8], into: &mut Vec<[u64; 3]>) {
        match form {
            Form::Rows(rows) => {
                let row = self.row(rows, line).is_some();
                if !rows.strips() {
                    if row {
                        fan(&self.corners, into);
                    }
                } else if row || self.piece(line).is_some() {
                    strips(&self.corners, into);
                }
            }
            Form::Statements => self.statement(line, into),
            Form::Facets => self.places(line, into),
        }
    }

    /// The corners of a row, when it is one.
    fn row(&mut self, rows: &Rows, line: &[u8]) -> Option<()> {
        let mut words = words(line);
        self.corners.clear();
        for column in &rows.columns {
            let mut length = || usize::try_from(parse_integer(words.next()?)?).ok();
            match column {
                Column::One(_) => _ = words.next()?,
                Column::List(..) => {
                    for _ in 0..length()? {
                        words.next()?;
                    }
                }
                Column::Face(..) => {
                    for _ in 0..length()? {
                        let v = corner(words.next()?)?;
                        self.corners.push(Some(v).filter(|&v| v != RESTART)?);
                    }
                }
                Column::Strip(..) => {
                    for _ in 0..length()? {
                        self.corners.push(corner(words.next()?)?);
                    }
                }
            }
        }
        (!rows.exactly || words.next().is_none()).then_some(())
    }

    /// The corners of a piece of a long row, when it is one. The first and the last may be cut.
    fn piece(&mut self, line: &[u8]) -> Option<()> {
        let mut words = words(line).skip(1).peekable();
        self.corners.clear();
        while let Some(word) = words.next() {
            if words.peek().is_some() {
                self.corners.push(corner(word)?);
            }
        }
        (self.corners.len() >= PIECE).then_some(())
    }

    fn statement(&mut self, line: &[u8], into: &mut Vec<[u64; 3]>) {
        let mut words = words(line);
        match words.next() {
            Some(b"v") => self.vertices += 1,
            Some(b"f" | b"fo") => {
                self.corners.clear();
                for word in words {
                    let id = word.split(|&b| b == b'/').next().and_then(parse_integer);
                    // Those that count back lie behind all that others name here.
                    let id = match id {
                        Some(id) if id > 0 => id as u64,
                        Some(id) => (self.begin + self.vertices).saturating_sub(id.unsigned_abs()),
                        None => break,
                    };
                    self.corners.push(id);
                }
                fan(&self.corners, into);
            }
            _ => {}
        }
    }

    fn places(&mut self, line: &[u8], into: &mut Vec<[u64; 3]>) {
        let mut words = words(line);
        while let Some(word) = words.next() {
            if word.eq_ignore_ascii_case(b"vertex") {
                let mut place = [0; 12];
                for bytes in place.as_chunks_mut::<4>().0 {
                    let x = words.next().and_then(|word| parse_f4(word).ok());
                    // Both zeros are one.
                    *bytes = (x.unwrap_or(f32::NAN) + 0.0).to_le_bytes();
                }
                self.facet.push(xxh3_64(&place));
            } else if word.eq_ignore_ascii_case(b"endfacet") {
                if let [a, b, c] = self.facet[..] {
                    into.push([a, b, c]);
                }
                self.facet.clear();
                self.facets += 1;
            }
        }
    }
}

/// A corner of a face or a strip.
fn corner(word: &[u8]) -> Option<u64> {
    match parse_integer(word)? {
        -1 => Some(RESTART),
        v => u64::try_from(v).ok(),
    }
}

#[cfg(test)]
#[path = "lines_tests.rs"]
mod tests;
