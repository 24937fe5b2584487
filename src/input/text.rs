//! Words and lines of the text formats.
//!
//! Why lines of any length are safe: a word is taken from the reader's buffer as soon as its
//! end is there, and the rest of a line is passed over without being kept. LF, CR LF and CR
//! all end a line.
//!
//! Memory: none but the reader's buffer. I/O: the reader's.

pub(super) use super::number::{BadNumber, parse_f4};
use super::number::{parse_f8, parse_integer};
use super::reader::ByteReader;
use crate::error::{Error, Result};

/// The longest word that is taken; the longest f8 in full has 767 significant digits.
const MAX_WORD: usize = 1024;

/// What a byte can be; within a word, all up to COMMENT belong to it (`1.#INF`).
const WORD: u8 = 0;
const COMMENT: u8 = 1;
const SPACE: u8 = 2;
const NEWLINE: u8 = 3;
const ESCAPE: u8 = 4;

/// What the lines of a format may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// Words only (PLY, STL).
    Plain,
    /// A word that begins with `#` begins a comment (OFF).
    Comments,
    /// As well, a backslash before the end of a line joins the next one (OBJ).
    Joined,
}

const fn classes(dialect: Dialect) -> [u8; 256] {
    let mut of = [WORD; 256];
    of[b' ' as usize] = SPACE;
    of[b'\t' as usize] = SPACE;
    of[0x0b] = SPACE;
    of[0x0c] = SPACE;
    of[b'\n' as usize] = NEWLINE;
    of[b'\r' as usize] = NEWLINE;
    if !matches!(dialect, Dialect::Plain) {
        of[b'#' as usize] = COMMENT;
    }
    if matches!(dialect, Dialect::Joined) {
        of[b'\\' as usize] = ESCAPE;
    }
    of
}

static PLAIN: [u8; 256] = classes(Dialect::Plain);
static COMMENTS: [u8; 256] = classes(Dialect::Comments);
static JOINED: [u8; 256] = classes(Dialect::Joined);

/// Takes a text apart, word by word and line by line.
#[derive(Debug)]
pub struct Lexer {
    reader: ByteReader,
    class: &'static [u8; 256],
    line: u64,
}

impl Lexer {
    /// Goes on where `reader` stands, which is in line `line` (the first is 1).
    pub fn new(reader: ByteReader, dialect: Dialect, line: u64) -> Lexer {
        let class = match dialect {
            Dialect::Plain => &PLAIN,
            Dialect::Comments => &COMMENTS,
            Dialect::Joined => &JOINED,
        };
        Lexer {
            reader,
            class,
            line,
        }
    }

    /// The line that the next word is in.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// The reader, where the text ends.
    pub fn into_reader(self) -> ByteReader {
        self.reader
    }

    #[inline]
    fn class(&self, byte: u8) -> u8 {
        self.class[usize::from(byte)]
    }

    #[inline]
    fn word_length(&self, text: &[u8]) -> usize {
        let end = text.iter().position(|&b| self.class(b) > COMMENT);
        end.unwrap_or(text.len())
    }

    /// The next word of this line; `None` at its end.
    ///
    /// # Errors
    /// [`Error::Input`] for a word beyond all measure, [`Error::Io`].
    #[inline]
    pub fn word(&mut self) -> Result<Option<&[u8]>> {
        // The usual case: blanks, word and the byte behind it are all in the buffer.
        let buf = self.reader.buffered();
        let blanks = buf.iter().take_while(|&&b| self.class(b) == SPACE);
        let begin = blanks.count();
        let len = self.word_length(&buf[begin..]);
        let end = begin + len;
        let begins = buf.get(begin).is_some_and(|&b| self.class(b) == WORD);
        let ends = buf
            .get(end)
            .is_some_and(|&b| matches!(self.class(b), SPACE | NEWLINE));
        if begins && ends && len <= MAX_WORD {
            self.reader.consume(end);
            return Ok(Some(self.reader.consumed(len)));
        }
        self.word_anywhere()
    }

    fn word_anywhere(&mut self) -> Result<Option<&[u8]>> {
        loop {
            let Some(&byte) = self.reader.buffer()?.first() else {
                return Ok(None);
            };
            match self.class(byte) {
                SPACE => self.reader.consume(1),
                NEWLINE | COMMENT => return Ok(None),
                ESCAPE => match self.join(0)? {
                    Some(bytes) => {
                        self.reader.consume(bytes);
                        self.line += 1;
                    }
                    None => break,
                },
                _ => break,
            }
        }
        let mut len = 0;
        loop {
            let buf = self.reader.buffered();
            let stop = len + self.word_length(&buf[len..]);
            if stop > MAX_WORD {
                return Err(self.endless());
            }
            match buf.get(stop).copied() {
                None if self.reader.more()? => len = stop,
                Some(b) if self.class(b) == ESCAPE && self.join(stop)?.is_none() => len = stop + 1,
                _ => {
                    self.reader.consume(stop);
                    return Ok(Some(self.reader.consumed(stop)));
                }
            }
        }
    }

    /// Length of the backslash and the end of line at `at` in the buffer, if they are that.
    fn join(&mut self, at: usize) -> Result<Option<usize>> {
        let next = self.reader.peek(at + 3)?;
        Ok(match next[at + 1..] {
            [] => Some(1),
            [b'\r', b'\n', ..] => Some(3),
            [b'\r' | b'\n', ..] => Some(2),
            _ => None,
        })
    }

    #[cold]
    fn endless(&self) -> Error {
        Error::input(
            self.reader.path(),
            format!("line {}", self.line),
            format!("a word of at most {MAX_WORD} bytes"),
            "a longer one",
            "the file is no text, or it is damaged",
        )
    }

    /// Passes over the rest of this line and its end; false at the end of the input.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn next_line(&mut self) -> Result<bool> {
        loop {
            let buf = self.reader.buffer()?;
            if buf.is_empty() {
                return Ok(false);
            }
            let stop = buf.iter().position(|&b| b == b'\n' || b == b'\r');
            self.reader.consume(stop.unwrap_or(usize::MAX));
            if stop.is_some() {
                let pair = self.reader.peek(2)? == b"\r\n";
                self.reader.consume(1 + usize::from(pair));
                self.line += 1;
                return Ok(true);
            }
        }
    }

    /// Goes to the next line that has a word (this one, when it has); false when none has.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn seek_word(&mut self) -> Result<bool> {
        loop {
            let Some(&byte) = self.reader.buffer()?.first() else {
                return Ok(false);
            };
            match self.class(byte) {
                SPACE => self.reader.consume(1),
                NEWLINE | COMMENT => {
                    self.next_line()?;
                }
                _ => return Ok(true),
            }
        }
    }

    /// True when `word` stands here.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn peek_word(&mut self, word: &[u8]) -> Result<bool> {
        let next = self.reader.peek(word.len() + 1)?;
        let rest = next.strip_prefix(word);
        Ok(rest.is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace)))
    }

    /// The next word of this line, of which `what` is expected.
    ///
    /// # Errors
    /// [`Error::Input`] at the end of the line, [`Error::Io`].
    #[inline]
    pub fn need(&mut self, what: &str) -> Result<&[u8]> {
        // Asked twice, since a borrow that is returned on one path only is held on both.
        if self.line_ended()? {
            return Err(self.missing(what));
        }
        Ok(self.word()?.unwrap_or_default())
    }

    /// True when this line has no further word.
    ///
    /// # Errors
    /// [`Error::Input`], [`Error::Io`].
    #[inline]
    pub fn line_ended(&mut self) -> Result<bool> {
        loop {
            let buf = self.reader.buffered();
            let blanks = buf.iter().take_while(|&&b| self.class(b) == SPACE).count();
            let Some(&byte) = buf.get(blanks) else {
                self.reader.consume(blanks);
                if self.reader.buffer()?.is_empty() {
                    return Ok(true);
                }
                continue;
            };
            match self.class(byte) {
                ESCAPE => {
                    self.reader.consume(blanks);
                    let Some(bytes) = self.join(0)? else {
                        return Ok(false);
                    };
                    self.reader.consume(bytes);
                    self.line += 1;
                }
                class => return Ok(class != WORD),
            }
        }
    }

    #[cold]
    fn missing(&mut self, what: &str) -> Error {
        let ended = matches!(self.reader.buffer(), Ok(b) if b.is_empty());
        let found = if ended {
            "the end of the input"
        } else {
            "the end of the line"
        };
        self.error(what, found, "")
    }

    /// The error of this line.
    #[cold]
    pub fn error(
        &self,
        expected: impl Into<String>,
        found: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        let at = format!("line {}", self.line);
        Error::input(self.reader.path(), at, expected, found, help)
    }

    /// The next word as an f4.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and word, [`Error::Io`].
    #[inline]
    pub fn f4(&mut self, what: &str) -> Result<f32> {
        let word = self.need(what)?;
        match parse_f4(word) {
            Ok(value) => Ok(value),
            Err(bad) => {
                let found = shown(word);
                Err(self.bad_number(bad, what, found, "4 bytes; store 8: --coords f8"))
            }
        }
    }

    /// The next word as an f8.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and word, [`Error::Io`].
    #[inline]
    pub fn f8(&mut self, what: &str) -> Result<f64> {
        let word = self.need(what)?;
        match parse_f8(word) {
            Ok(value) => Ok(value),
            Err(bad) => {
                let found = shown(word);
                Err(self.bad_number(bad, what, found, "8 bytes; scale the mesh down"))
            }
        }
    }

    #[cold]
    fn bad_number(&self, bad: BadNumber, what: &str, found: String, large: &str) -> Error {
        match bad {
            BadNumber::Garbage => self.error(what, found, "correct the number"),
            BadNumber::Large => self.error(
                what,
                format!("{found}, which is too large"),
                format!("it is beyond what fits in {large}"),
            ),
        }
    }

    /// The next word as an integer.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and word, [`Error::Io`].
    #[inline]
    pub fn integer(&mut self, what: &str) -> Result<i64> {
        let word = self.need(what)?;
        match parse_integer(word) {
            Some(value) => Ok(value),
            None => {
                let found = shown(word);
                Err(self.error(what, found, "correct the number"))
            }
        }
    }

    /// The next word as an integer that is not negative.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and word, [`Error::Io`].
    #[inline]
    pub fn count(&mut self, what: &str) -> Result<u64> {
        let value = self.integer(what)?;
        u64::try_from(value).map_err(|_| {
            let expected = format!("{what}, not negative");
            self.error(expected, format!("`{value}`"), "correct the number")
        })
    }
}

/// A word as messages show it.
pub fn shown(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(&word[..word.len().min(160)]);
    let mut short: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().count() > 40 {
        short.push_str("...");
    }
    format!("`{short}`")
}
