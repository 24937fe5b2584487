//! The triangles of a text that was not read yet: about how many there are, and a look at some.
//!
//! Why parts from all over the file: faces of other numbers of corners, and longer ids, come later
//! than the first. [`PARTS`](super::sample) parts at equal distances, each standing for the
//! stretch of file around it, see them all, and so does the map that they give, from the number of a
//! triangle to about where it lies. Where rows of vertices come first, the first face is found by
//! halving: a part of the file shows which of the two it is in. Nothing is checked here, and what
//! is no face is passed over: what is wrong is told when it is read.
//!
//! Memory: 1 MiB, a number a part, the triangles asked for. I/O: 1 MiB for the map, 4 KiB for each
//! halving; for a look what the triangles take, and a bound on what lies between them.

use super::number::{parse_f4, parse_integer};
use super::sample::{PART, Sample, is_end, words};
use crate::error::Result;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

/// Bytes that are read at a time.
const STEP: u64 = 256 << 10;
/// Bytes for each triangle of a look, after which no more are looked for.
const MOST_ROW: u64 = 512;

/// What a row of faces has in a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// A value of so many bytes, in a binary file.
    One(u64),
    /// A list: bytes of its length, and of an item.
    List(u64, u64),
    /// The list of the corners.
    Face(u64, u64),
}

/// How a text spells its faces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A row a line; true when nothing may stand behind it.
    Rows(Vec<Column>, bool),
    /// OBJ: statements `f`, between those of vertices.
    Statements,
    /// STL: three times the word `vertex` and its place, until the word `endfacet`.
    Facets,
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
    /// Maps a text whose faces lie behind byte `from`; there are so many of them, when that is known.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn map(path: &Path, form: Form, from: u64, faces: Option<u64>) -> Result<Lines> {
        let sample = Sample::open(path)?;
        let from = match form {
            Form::Rows(..) => first_face(&sample, &form, from)?,
            _ => from,
        };
        let (mut stretch, mut found) = (0.0, Vec::new());
        sample.parts(from, |begin, length, text| {
            let mut seen = Seen::new(begin);
            let (mut triangles, mut faces) = (Vec::new(), 0u64);
            for line in text.split(is_end) {
                let had = triangles.len();
                seen.line(&form, line, &mut triangles);
                faces += u64::from(triangles.len() > had);
            }
            let by = length / text.len().max(1) as f64;
            let counts = [triangles.len() as u64, faces, seen.vertices];
            stretch = length;
            found.push(counts.map(|n| n as f64 * by));
        })?;
        let [seen, vertices] = [1, 2].map(|k| found.iter().map(|f| f[k]).sum::<f64>());
        // As many triangles a face as the parts have on average.
        let by = match faces {
            Some(faces) if seen > 0.0 => faces as f64 / seen,
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
        // Unless it begins with the first face, a look begins within a line.
        let mut whole = first == 0;
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

/// Where rows of faces begin, at most a part too early; they go to the end.
fn first_face(sample: &Sample, form: &Form, from: u64) -> Result<u64> {
    let (mut low, mut high) = (from, sample.length());
    while high.saturating_sub(low) > 2 * PART {
        let middle = low + (high - low) / 2;
        let (mut faces, mut others) = (0, 0);
        let mut triangles = Vec::new();
        sample.lines(middle, PART, |line| {
            triangles.clear();
            Seen::new(0).line(form, line, &mut triangles);
            *(if triangles.is_empty() {
                &mut others
            } else {
                &mut faces
            }) += 1;
        })?;
        if faces > others {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(low)
}

/// What was seen of a text so far.
struct Seen {
    /// From where on vertices are counted: more than there are before.
    begin: u64,
    vertices: u64,
    /// Corners of a facet.
    facet: Vec<u64>,
    corners: Vec<u64>,
}

impl Seen {
    fn new(begin: u64) -> Seen {
        Seen {
            begin,
            vertices: 0,
            facet: Vec::new(),
            corners: Vec::new(),
        }
    }

    /// Takes a line; appends the triangles that it completes.
    fn line(&mut self, form: &Form, line: &[u8], into: &mut Vec<[u64; 3]>) {
        match form {
            Form::Rows(columns, exactly) => {
                if self.row(columns, *exactly, line).is_some() {
                    fan(&self.corners, into);
                }
            }
            Form::Statements => self.statement(line, into),
            Form::Facets => self.facets(line, into),
        }
    }

    /// The corners of a row, when it is one.
    fn row(&mut self, columns: &[Column], exactly: bool, line: &[u8]) -> Option<()> {
        let mut words = words(line);
        self.corners.clear();
        for column in columns {
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
                        let corner = parse_integer(words.next()?)?;
                        self.corners.push(u64::try_from(corner).ok()?);
                    }
                }
            }
        }
        (!exactly || words.next().is_none()).then_some(())
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

    fn facets(&mut self, line: &[u8], into: &mut Vec<[u64; 3]>) {
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
            }
        }
    }
}

/// Cuts a polygon into its fan.
pub(super) fn fan(corners: &[u64], into: &mut Vec<[u64; 3]>) {
    let pairs = corners.windows(2).skip(1);
    into.extend(pairs.map(|pair| [corners[0], pair[0], pair[1]]));
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    fn map(text: &[u8], form: Form, from: u64, faces: Option<u64>) -> Lines {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Lines::map(file.path(), form, from, faces).unwrap()
    }

    fn off() -> Form {
        Form::Rows(vec![Column::Face(0, 0)], false)
    }

    fn read(lines: &Lines, first: u64, count: u64) -> Vec<[u64; 3]> {
        let mut found = Vec::new();
        lines.read(first, count, &mut found).unwrap();
        found
    }

    /// A text of so many vertices and faces; every face names its own number first.
    fn rows(vertices: u64, faces: u64, squares: u64) -> String {
        let mut text = String::new();
        for i in 0..vertices {
            let _ = writeln!(text, "3 {i} 0.5");
        }
        for i in 0..faces {
            let _ = match i < squares {
                true => writeln!(text, "4 {i} 1 2 3"),
                false => writeln!(text, "3 {i} 1 2 255 0 0"),
            };
        }
        text
    }

    #[test]
    fn small_texts_are_counted_and_read() {
        let lines = map(rows(3, 5, 2).as_bytes(), off(), 0, Some(5));
        assert_eq!(lines.triangles(), 7);
        let all = [
            [0, 1, 2],
            [0, 2, 3],
            [1, 1, 2],
            [1, 2, 3],
            [2, 1, 2],
            [3, 1, 2],
            [4, 1, 2],
        ];
        assert_eq!(read(&lines, 0, 7), all);
        assert_eq!(read(&lines, 0, 3), all[..3]);
        for text in [
            "",
            "\n\r\n",
            "3 1",
            "-1 2 3 4\n",
            "99999999999999999999 1 2 3\n",
        ] {
            let lines = map(text.as_bytes(), off(), 0, Some(5));
            assert_eq!(
                (lines.triangles(), read(&lines, 0, 9)),
                (0, vec![]),
                "{text}"
            );
        }
    }

    #[test]
    fn triangles_of_long_texts_are_found_about_where_they_are() {
        let text = rows(150_000, 400_000, 200_000);
        let lines = map(text.as_bytes(), off(), 0, Some(400_000));
        let about = lines.triangles();
        assert!(about.abs_diff(600_000) < 12_000, "{about}");
        // The first face, not a vertex that looks like one.
        let first = read(&lines, 0, 2);
        assert!(first[0][0] < 400, "{first:?}");
        for (triangle, face) in [(100_000, 50_000), (400_000, 200_000), (590_000, 390_000)] {
            let found = read(&lines, triangle, 1000);
            assert_eq!(found.len(), 1000);
            let off = found[0][0].abs_diff(face);
            assert!(off < 8000, "{triangle}: face {}", found[0][0]);
        }
        let last = read(&lines, about - 1, 1000);
        assert!(last.iter().all(|t| t[0] > 390_000), "{last:?}");
    }

    #[test]
    fn statements_may_count_back_and_lie_among_others() {
        let text = "v 0 0 0\nvn 1 1 1\nv 0 0 0\r\nv 1 1 1\nf 1/2/3 2//3 3\nv 2 2 2\nf -1 -2 -3 -4\n\
                    fo 1 2 4\nf 1 x 2\nl 1 2 3\n";
        let lines = map(text.as_bytes(), Form::Statements, 0, None);
        assert_eq!((lines.triangles(), lines.vertices), (4, 4));
        let found = read(&lines, 0, 9);
        assert_eq!(found, [[1, 2, 3], [3, 2, 1], [3, 1, 0], [1, 2, 4]]);
    }

    #[test]
    fn facets_are_told_apart_by_their_places() {
        let facet = |a: &str, b: &str| {
            format!(
                "facet normal 0 0 1 outer loop\nVERTEX {a}\n vertex {b} vertex 7 8 9\nendloop EndFacet\n"
            )
        };
        let text = facet("0 0 1", "1 2 3") + &facet("-0 0.0 1e0", "1 2 4") + "endfacet\nvertex 1";
        let lines = map(text.as_bytes(), Form::Facets, 0, None);
        assert!(lines.by_position());
        assert_eq!(lines.triangles(), 2);
        let [a, b] = read(&lines, 0, 9)[..] else {
            panic!("two facets");
        };
        assert_eq!([a[0], a[2]], [b[0], b[2]]);
        assert!(a[1] != b[1] && a[0] != a[1]);
    }

    #[test]
    fn texts_of_one_line_are_no_trouble() {
        let text = "3 1 2 ".repeat(1 << 20);
        for form in [off(), Form::Statements, Form::Facets] {
            let lines = map(text.as_bytes(), form, 0, Some(u64::MAX));
            assert!(read(&lines, lines.triangles() / 2, 100).len() <= 100);
        }
    }
}
