//! Long listings to standard output, piece by piece: text, or one JSON object with a long array.
//!
//! Why it is JSON: the object is opened with its short keys, then the array's key, an item a
//! line, and the closing keys; nothing of the array is kept.
//!
//! Memory: 64 KiB and an item. I/O: each byte once.

use super::{print, to_json};
use crate::error::{Error, Result};
use serde_json::Value;

/// Bytes that are gathered before they are printed.
const FULL: usize = 64 << 10;

/// A listing under way.
pub(super) struct Pieces {
    text: String,
    items: u64,
}

impl Pieces {
    pub(super) fn new() -> Pieces {
        Pieces {
            text: String::new(),
            items: 0,
        }
    }

    /// Plain text.
    pub(super) fn text(&mut self, text: &str) -> Result<()> {
        self.text.push_str(text);
        if self.text.len() >= FULL {
            print(&self.text)?;
            self.text.clear();
        }
        Ok(())
    }

    /// Prints what is left.
    pub(super) fn done(self) -> Result<()> {
        print(&self.text)
    }

    /// Opens an object with these keys, and its array under `key`.
    pub(super) fn begin(&mut self, head: &Value, key: &str) -> Result<()> {
        let head = to_json(head)?;
        let open = head.trim_end().trim_end_matches('}').trim_end();
        self.text(&format!("{open},\n  \"{key}\": ["))
    }

    /// The next item of the array.
    pub(super) fn item(&mut self, item: &Value) -> Result<()> {
        let item = serde_json::to_string(item)
            .map_err(|e| Error::Internal(format!("an item that is no JSON: {e}")))?;
        let comma = if self.items > 0 { "," } else { "" };
        self.items += 1;
        self.text(&format!("{comma}\n    {item}"))
    }

    /// Closes the array, and the object with these keys.
    pub(super) fn end(mut self, tail: &Value) -> Result<()> {
        self.text(if self.items > 0 { "\n  ]" } else { "]" })?;
        let tail = to_json(tail)?;
        let inside = tail
            .trim_start_matches('{')
            .trim_end()
            .trim_end_matches('}');
        if inside.trim().is_empty() {
            self.text("\n}\n")?;
        } else {
            self.text(&format!(",{}\n}}\n", inside.trim_end()))?;
        }
        self.done()
    }
}
