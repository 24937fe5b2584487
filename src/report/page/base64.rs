//! Bytes as base64, written as they come.
//!
//! Memory: two bytes, and what is written at once. I/O: none of its own.

use std::io::{Result, Write};

const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// A stream that writes base64 to another.
pub(super) struct Base64<W> {
    out: W,
    /// Bytes that do not make three yet.
    held: Vec<u8>,
}

impl<W: Write> Base64<W> {
    pub(super) fn new(out: W) -> Base64<W> {
        Base64 {
            out,
            held: Vec::with_capacity(3),
        }
    }

    fn put(&mut self, three: &[u8]) -> Result<()> {
        let at = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        let mut text = [18, 12, 6, 0].map(|shift| DIGITS[(bits >> shift & 63) as usize]);
        text[three.len() + 1..].fill(b'=');
        self.out.write_all(&text)
    }

    /// Writes what is left, and the padding.
    pub(super) fn finish(mut self) -> Result<()> {
        let held = std::mem::take(&mut self.held);
        if held.is_empty() {
            Ok(())
        } else {
            self.put(&held)
        }
    }
}

impl<W: Write> Write for Base64<W> {
    fn write(&mut self, buf: &[u8]) -> Result<usize> {
        for &byte in buf {
            self.held.push(byte);
            if let [a, b, c] = self.held[..] {
                self.held.clear();
                self.put(&[a, b, c])?;
            }
        }
        Ok(buf.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_rfc_4648() {
        let texts = ["", "f", "fo", "foo", "foob", "fooba", "foobar"];
        let expected = [
            "", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy",
        ];
        for (text, expected) in texts.iter().zip(expected) {
            for step in 1..4 {
                let mut out = Vec::new();
                let mut encoder = Base64::new(&mut out);
                for part in text.as_bytes().chunks(step) {
                    encoder.write_all(part).unwrap();
                }
                encoder.finish().unwrap();
                assert_eq!(out, expected.as_bytes());
            }
        }
    }
}
