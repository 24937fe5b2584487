//! What can go wrong, said so that a person can act on it: file, offset or id,
//! what was expected, what was found, what to do. Every fallible function of the
//! crate returns [`Result`]; the exit code of each kind is decided in `main.rs`.

use std::fmt;
use std::path::{Path, PathBuf};

/// Result of every fallible function of the crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error of any layer.
#[derive(Debug)]
pub enum Error {
    /// The request makes no sense: an option is missing, unknown or contradicts another.
    Usage(String),
    /// A file (mesh or folder) does not say what its format demands.
    Input(Box<BadInput>),
    /// The operating system refused a read, write or other file operation.
    Io {
        /// The file or folder concerned.
        path: PathBuf,
        /// What was tried, as a verb phrase ("read 64 bytes at byte 12").
        action: String,
        /// What the system said.
        source: std::io::Error,
        /// For a full disk, bytes that are wanted still, at least; 0 when that is not known.
        more: u64,
    },
    /// Scratch space would pass the limit that the user set.
    DiskLimit {
        /// Bytes that would have been in use.
        need: u64,
        /// Bytes allowed by `--max-disk`.
        limit: u64,
    },
    /// The memory budget cannot hold what a pass needs.
    Budget {
        /// The pass or structure that asked.
        what: String,
        /// The least total budget, in bytes, that would do.
        need: u64,
        /// The budget in force, in bytes.
        have: u64,
    },
    /// A signal asked the process to stop.
    Interrupted {
        /// Its number.
        signal: i32,
    },
    /// A count or relation that must hold does not: a fault of this program.
    Internal(String),
}

/// The particulars of a [`Error::Input`].
#[derive(Debug)]
pub struct BadInput {
    /// The file.
    pub path: PathBuf,
    /// Where in it: "byte 120", "line 7", "triangle 31"; empty for the file as a whole.
    pub at: String,
    /// What was expected there.
    pub expected: String,
    /// What was found instead.
    pub found: String,
    /// What the user can do; empty when nothing better than the message is known.
    pub help: String,
}

/// The most characters of a part of a message.
const PART: usize = 320;

/// Text that may hold words of a file, as a line that a terminal can print: control characters,
/// which could move its cursor or hide what was said, are spelled, and what is too long is cut.
pub(crate) fn printable(text: String) -> String {
    if text.len() <= PART && !text.contains(char::is_control) {
        return text;
    }
    let cut = text
        .char_indices()
        .nth(PART)
        .map_or(text.len(), |(at, _)| at);
    let mut plain = String::with_capacity(cut);
    for c in text[..cut].chars() {
        if c.is_control() {
            plain.extend(c.escape_default());
        } else {
            plain.push(c);
        }
    }
    if cut < text.len() {
        plain.push_str("...");
    }
    plain
}

impl Error {
    /// A file that does not hold what it must; `at` says where ("byte 120", "line 7").
    pub fn input(
        path: &Path,
        at: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        Error::Input(Box::new(BadInput {
            path: path.to_owned(),
            at: printable(at.into()),
            expected: printable(expected.into()),
            found: Some(printable(found.into()))
                .filter(|found| !found.trim().is_empty())
                .unwrap_or("nothing".into()),
            help: printable(help.into()),
        }))
    }

    /// A file operation that the system refused.
    pub fn io(path: &Path, action: impl Into<String>, source: std::io::Error) -> Error {
        Error::Io {
            path: path.to_owned(),
            action: action.into(),
            source,
            more: 0,
        }
    }

    /// True when the system has no room for what is to be written.
    pub fn is_no_space(&self) -> bool {
        use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        let full = [StorageFull, QuotaExceeded, FileTooLarge];
        matches!(self, Error::Io { source, .. } if full.contains(&source.kind()))
    }

    /// True when there is no room on disk, or none that may be taken.
    pub fn is_no_room(&self) -> bool {
        self.is_no_space() || matches!(self, Error::DiskLimit { .. })
    }

    /// The same error, with the bytes that are wanted still, at least.
    pub fn with_more(mut self, bytes: u64) -> Error {
        if let Error::Io { more, .. } = &mut self {
            *more = bytes;
        }
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Usage(what) => f.write_str(what),
            Error::Input(bad) => bad.fmt(f),
            Error::Io {
                path,
                action,
                source,
                more,
            } => {
                write!(f, "{}: cannot {action}: {source}", path.display())?;
                if *more > 0 {
                    write!(f, "; at least {more} bytes more are needed")?;
                }
                f.write_str(advice(source.kind()))
            }
            Error::DiskLimit { need, limit } => write!(
                f,
                "scratch space would reach {need} bytes, beyond --max-disk {limit}; \
                 allow more, or give a larger --memory so that less is spilled"
            ),
            Error::Budget { what, need, have } => write!(
                f,
                "the memory budget of {have} bytes is too small for {what}; \
                 the least that would do is --memory {}KiB",
                need.div_ceil(1024)
            ),
            Error::Interrupted { signal: 2 } => f.write_str("interrupted"),
            Error::Interrupted { signal } => write!(f, "asked to stop by signal {signal}"),
            Error::Internal(what) => write!(
                f,
                "internal error: {what}; the output was not written; please report this"
            ),
        }
    }
}

/// What to do about a file operation that the system refused; empty when there is no advice.
fn advice(kind: std::io::ErrorKind) -> &'static str {
    use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, ReadOnlyFilesystem, StorageFull};
    match kind {
        StorageFull | QuotaExceeded => {
            "; make room there, put scratch files elsewhere with --tmp, spill less with a larger \
             --memory, or choose another place with -o"
        }
        FileTooLarge => "; allow larger files (ulimit -f), or choose another place",
        ReadOnlyFilesystem => "; choose a place that can be written with -o or --tmp",
        _ => "",
    }
}

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.path.display())?;
        if !self.at.is_empty() {
            write!(f, "{}: ", self.at)?;
        }
        write!(f, "expected {}, found {}", self.expected, self.found)?;
        if !self.help.is_empty() {
            write!(f, "; {}", self.help)?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

/// Holds a pass to what it was given: nothing is lost on the way, and nothing comes twice.
///
/// # Errors
/// [`Error::Internal`] that names the pass.
pub fn conserve(pass: &str, what: &str, given: u64, found: u64) -> Result<()> {
    if given == found {
        return Ok(());
    }
    Err(Error::Internal(format!(
        "the pass '{pass}' was given {given} {what}, and accounts for {found}"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Found by changed files: an array with an empty header was told as "found ;".
    #[test]
    fn what_was_found_is_never_blank() {
        let error = Error::input(Path::new("V.npy"), "byte 10", "a header", " ", "");
        assert_eq!(
            error.to_string(),
            "V.npy: byte 10: expected a header, found nothing"
        );
    }

    #[test]
    fn a_pass_that_loses_something_is_named() {
        assert!(conserve("seams", "corners", 7, 7).is_ok());
        let lost = conserve("seams", "corners", 7, 6).map_err(|e| e.to_string());
        let said = lost.expect_err("one is missing");
        assert!(
            said.contains("'seams' was given 7 corners, and accounts for 6"),
            "{said}"
        );
    }

    /// Found by fuzzing: words of a file came out as they were, a terminal's commands included.
    #[test]
    fn words_of_a_file_cannot_reach_the_terminal_as_commands() {
        let long = format!("\u{1b}[2J\u{7}{}", "x".repeat(1 << 20));
        let error = Error::input(Path::new("m.ply"), "line 2", "a word", long, "");
        let text = error.to_string();
        assert!(text.contains("found \\u{1b}[2J\\u{7}xxx"), "{text}");
        assert!(text.ends_with("xxx...") && text.len() < 400, "{text}");
        let umlauts = printable("\u{e4}".repeat(1000));
        assert_eq!(umlauts.chars().count(), PART + 3);
    }
}
