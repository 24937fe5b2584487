//! A few parts of a text, which tell what its lines add up to.
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
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Bytes of a part.
pub(super) const PART: u64 = 4 << 10;
/// Parts of a file.
const PARTS: u64 = 256;

/// A text to be looked into.
#[derive(Debug)]
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

    /// Its length in bytes.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Hands the whole lines of each part `within` the text to `each`, with where they were looked
    /// for, and the length of the stretch of file that they stand for.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn parts(&self, within: Range<u64>, mut each: impl FnMut(u64, f64, &[u8])) -> Result<()> {
        let Range { start: from, end } = within;
        let length = end.saturating_sub(from);
        let (parts, bytes) = if length <= PART * PARTS {
            (1, length)
        } else {
            (PARTS, PART)
        };
        let stretch = length as f64 / parts as f64;
        let mut part = Vec::new();
        for i in 0..parts {
            let middle = from as f64 + (i as f64 + 0.5) * stretch;
            let at = (middle - bytes as f64 / 2.0) as u64;
            let text = self.whole(at, bytes, at <= from, &mut part)?;
            each(at, stretch, text);
        }
        Ok(())
    }

    /// Hands lines from byte `at` on to `each`, the first from there, until it has enough, `most`
    /// bytes were read, or the text ends. A line of more than `step` bytes comes in pieces.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn stream(
        &self,
        at: u64,
        most: u64,
        step: u64,
        mut each: impl FnMut(&[u8]) -> bool,
    ) -> Result<()> {
        let (mut block, mut held, mut read) = (vec![0; step as usize], 0, 0);
        while read < most {
            let n = self.file.read_some_at(&mut block[held..], at + read)?;
            read += n as u64;
            let text = &block[..held + n];
            let ended = n == 0;
            let to = match text.iter().rposition(is_end) {
                Some(end) if !ended => end + 1,
                // The last line, or one that is too long.
                _ if ended || text.len() == block.len() => text.len(),
                _ => 0,
            };
            let lines = text[..to].split(is_end).filter(|line| !line.is_empty());
            for line in lines {
                if !each(line) {
                    return Ok(());
                }
            }
            if ended {
                break;
            }
            held = text.len() - to;
            block.copy_within(to..to + held, 0);
        }
        Ok(())
    }

    /// Hands the whole lines among the `bytes` at `at` to `each`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn lines(&self, at: u64, bytes: u64, each: impl FnMut(&[u8])) -> Result<()> {
        let mut part = Vec::new();
        let text = self.whole(at, bytes, at == 0, &mut part)?;
        let lines = text.split(is_end).filter(|line| !line.is_empty());
        lines.for_each(each);
        Ok(())
    }

    /// The whole lines among the `bytes` at `at`, where a line may begin, or does. Of a part without
    /// a whole line it is the longest piece of one.
    fn whole<'p>(
        &self,
        at: u64,
        bytes: u64,
        begins: bool,
        part: &'p mut Vec<u8>,
    ) -> Result<&'p [u8]> {
        part.resize(bytes.min(self.length.saturating_sub(at)) as usize, 0);
        let n = self.file.read_some_at(part, at)?;
        part.truncate(n);
        let first = part.iter().position(is_end).map_or(0, |i| i + 1);
        let from = if begins { 0 } else { first };
        let last = part.iter().rposition(is_end).map_or(n, |i| i + 1);
        let to = if at + n as u64 >= self.length {
            n
        } else {
            last
        };
        if from < to {
            return Ok(&part[from..to]);
        }
        let pieces = part.split(is_end).max_by_key(|piece| piece.len());
        Ok(pieces.unwrap_or_default())
    }
}

/// True for a byte that ends a line.
pub fn is_end(byte: &u8) -> bool {
    matches!(byte, b'\n' | b'\r')
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

    /// About how many lines begin with v and f.
    fn sums(sample: &Sample) -> [u64; 2] {
        let mut sums = [0.0; 2];
        let parts = sample.parts(0..sample.length(), |_, stretch, text| {
            for line in text.split(is_end) {
                for (sum, mark) in sums.iter_mut().zip([b"v", b"f"]) {
                    if line.starts_with(mark) {
                        *sum += stretch / text.len() as f64;
                    }
                }
            }
        });
        parts.unwrap();
        sums.map(|sum| sum.round() as u64)
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
            let [v, f] = sums(&sample);
            assert!(v.abs_diff(lines) <= slack, "{v} of {lines}");
            assert!(f.abs_diff(2 * lines) <= 2 * slack, "{f} of {}", 2 * lines);
        }
    }

    #[test]
    fn texts_without_lines_and_of_one_line_are_no_trouble() {
        let (_file, long) = sample(&"vvv ".repeat(1 << 20));
        // A line a part, for as many bytes as a part has.
        assert!(sums(&long)[0] <= (4 << 20) / PART);
        let (_file, none) = sample("");
        assert_eq!(sums(&none), [0, 0]);
    }

    #[test]
    fn of_lines_longer_than_a_part_pieces_are_seen() {
        let line = "5".repeat(PART as usize) + "\n";
        let (_file, sample) = sample(&line.repeat(2 * PARTS as usize));
        let mut seen = 0;
        let parts = sample.parts(0..sample.length(), |_, _, text| {
            seen += 1;
            assert!(text.len() as u64 >= PART / 2 - 1, "{}", text.len());
        });
        parts.unwrap();
        assert_eq!(seen, PARTS);
    }
}
