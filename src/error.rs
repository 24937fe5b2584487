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
            at: at.into(),
            expected: expected.into(),
            found: found.into(),
            help: help.into(),
        }))
    }

    /// A file operation that the system refused.
    pub fn io(path: &Path, action: impl Into<String>, source: std::io::Error) -> Error {
        Error::Io {
            path: path.to_owned(),
            action: action.into(),
            source,
        }
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
            } => write!(f, "{}: cannot {action}: {source}", path.display()),
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
