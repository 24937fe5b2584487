//! What the lines of a text add up to, guessed from a few parts of it.
//!
//! Why parts from all over the file: most programs write all vertices before the first face,
//! so that the beginning of a file shows no face at all, and ids get longer towards its end.
//! [`PARTS`] parts at equal distances, each standing for the stretch of file around it, see
//! both, and where one gives way to the other to a stretch. A text that is not longer than
//! they are is read whole.
//!
//! Memory: at most 1 MiB. I/O: 1 MiB at most.

use crate::disk::{Counters, DataFile};
use crate::error::Result;
use std::path::Path;
use std::sync::Arc;

/// Bytes of a part.
const PART: u64 = 4 << 10;
/// Parts of a file.
const PARTS: u64 = 256;
/// Bytes of the end of a file in which faces are looked at.
const END: u64 = 64 << 10;

/// A text to be looked into.
pub struct Sample {
    file: DataFile,
    length: u64,
}

impl Sample {
    /// Opens the text.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn open(path: &Path) -> Result<Sample> {
        let file = DataFile::open(path, &Arc::new(Counters::default()))?;
        let length = file.len()?;
        Ok(Sample { file, length })
    }

    /// The sums over all lines of the numbers that `count` finds in a line, as the parts tell.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn sums<const N: usize>(&self, count: impl Fn(&[u8]) -> [u64; N]) -> Result<[u64; N]> {
        let whole = self.length <= PART * PARTS;
        let (parts, bytes) = if whole {
            (1, self.length)
        } else {
            (PARTS, PART)
        };
        let stretch = self.length as f64 / parts as f64;
        let mut sums = [0.0; N];
        for i in 0..parts {
            let middle = (i as f64 + 0.5) * stretch;
            let at = (middle - bytes as f64 / 2.0) as u64;
            let mut found = [0u64; N];
            let seen = self.lines(at, bytes, |line| {
                for (sum, n) in found.iter_mut().zip(count(line)) {
                    *sum += n;
                }
            })?;
            for (sum, n) in sums.iter_mut().zip(found) {
                *sum += n as f64 * stretch / seen.max(1) as f64;
            }
        }
        Ok(sums.map(|sum| sum.round() as u64))
    }

    /// Triangles that a face makes when cut into its fan, on average over the faces at the end
    /// of the text: lines that begin with the number of the corners. At least 1.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn last_fans(&self) -> Result<f64> {
        let (mut faces, mut triangles) = (0u64, 0u64);
        self.lines(self.length.saturating_sub(END), END, |line| {
            let mut words = words(line);
            let corners = words.next().and_then(|w| std::str::from_utf8(w).ok());
            let corners = corners.and_then(|w| w.parse::<usize>().ok()).unwrap_or(0);
            if corners > 2 && words.count() >= corners {
                faces += 1;
                triangles += corners as u64 - 2;
            }
        })?;
        Ok(triangles.max(1) as f64 / faces.max(1) as f64)
    }

    /// Hands the whole lines among the `bytes` at `at` to `each`; returns the bytes that they
    /// take. A part without the end of a line is handed on as one line.
    fn lines(&self, at: u64, bytes: u64, mut each: impl FnMut(&[u8])) -> Result<u64> {
        let mut part = vec![0; bytes.min(self.length.saturating_sub(at)) as usize];
        let n = self.file.read_some_at(&mut part, at)?;
        part.truncate(n);
        let is_end = |&b: &u8| b == b'\n' || b == b'\r';
        let first = part.iter().position(is_end).map_or(0, |i| i + 1);
        let from = if at == 0 { 0 } else { first };
        let last = part.iter().rposition(is_end).map_or(n, |i| i + 1);
        let to = if at + n as u64 >= self.length {
            n
        } else {
            last
        };
        let text = &part[from.min(to)..to];
        text.split(is_end)
            .filter(|line| !line.is_empty())
            .for_each(&mut each);
        Ok(text.len() as u64)
    }
}

/// The words of a line.
pub fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write;

    fn sample(text: &str) -> (tempfile::NamedTempFile, Sample) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let sample = Sample::open(file.path()).unwrap();
        (file, sample)
    }

    fn marks(line: &[u8]) -> [u64; 2] {
        [line.starts_with(b"v"), line.starts_with(b"f")].map(u64::from)
    }

    #[test]
    fn short_texts_are_counted_and_long_ones_guessed() {
        for (lines, slack) in [(0, 0), (1, 0), (100, 0), (200_000, 4000)] {
            let mut text = String::new();
            for i in 0..lines {
                let _ = writeln!(text, "v {i} 0 0");
            }
            for i in 0..2 * lines {
                let _ = writeln!(text, "f {i} {i} {i}");
            }
            let (_file, sample) = sample(&text);
            let [v, f] = sample.sums(marks).unwrap();
            assert!(v.abs_diff(lines) <= slack, "{v} of {lines}");
            assert!(f.abs_diff(2 * lines) <= 2 * slack, "{f} of {}", 2 * lines);
        }
    }

    #[test]
    fn texts_without_lines_and_of_one_line_are_no_trouble() {
        let (_file, long) = sample(&"vvv ".repeat(1 << 20));
        // A line a part, for as many bytes as a part has.
        assert!(long.sums(marks).unwrap()[0] <= (4 << 20) / PART);
        assert_eq!(long.last_fans().unwrap(), 1.0);
        let (_file, none) = sample("");
        assert_eq!(none.sums(marks).unwrap(), [0, 0]);
    }

    #[test]
    fn fans_of_the_last_faces() {
        for (row, fans) in [("3 0 1 2\n", 1.0), ("4 0 1 2 3\n", 2.0), ("0.5 0 1\n", 1.0)] {
            let (_file, sample) = sample(&row.repeat(20_000));
            assert_eq!(sample.last_fans().unwrap(), fans);
        }
        let (_file, sample) = sample("1 2 3\n3 0 1 2 255 0 0\r\n4 0 1 2 3\r\n");
        assert_eq!(sample.last_fans().unwrap(), 1.5);
    }
}
