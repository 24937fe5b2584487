//! Changes of lines and words.

use proptest::prelude::*;
use proptest::sample::Index;

/// Words that are no number, or one that is easily taken wrong.
const WORDS: [&str; 30] = [
    "0",
    "-1",
    "1",
    "2",
    "3",
    "4",
    "255",
    "256",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775809",
    "nan",
    "-inf",
    "1e39",
    "1e400",
    "1e-400",
    "-0",
    "1.5",
    "0x10",
    "1e",
    "float",
    "double",
    "list",
    "\u{663}",
    "",
];

/// A change of lines.
#[derive(Clone, Debug)]
pub enum Edit {
    /// Another word: at which line, which word, which of [`WORDS`].
    Word(Index, Index, Index),
    /// A whole number that is one more or less.
    Next(Index, Index, bool),
    DropWord(Index, Index),
    Drop(Index),
    Repeat(Index),
    Swap(Index, Index),
    /// Without its end.
    Join(Index),
    /// From here on as the other file is from there on.
    Splice(Index, Index),
    Cut(Index),
}

fn edit() -> impl Strategy<Value = Edit> {
    let i = any::<Index>;
    prop_oneof![
        6 => (i(), i(), i()).prop_map(|(l, w, x)| Edit::Word(l, w, x)),
        3 => (i(), i(), any::<bool>()).prop_map(|(l, w, up)| Edit::Next(l, w, up)),
        2 => (i(), i()).prop_map(|(l, w)| Edit::DropWord(l, w)),
        2 => i().prop_map(Edit::Drop),
        2 => i().prop_map(Edit::Repeat),
        2 => (i(), i()).prop_map(|(a, b)| Edit::Swap(a, b)),
        1 => i().prop_map(Edit::Join),
        1 => (i(), i()).prop_map(|(a, b)| Edit::Splice(a, b)),
        1 => i().prop_map(Edit::Cut),
    ]
}

/// Some changes.
pub fn edits() -> impl Strategy<Value = Vec<Edit>> {
    prop::collection::vec(edit(), 1..4)
}

/// Some, or none.
pub fn few_edits() -> impl Strategy<Value = Vec<Edit>> {
    prop::collection::vec(edit(), 0..2)
}

/// The text with all changes made, one after the other.
pub fn changed(text: &str, other: &str, edits: &[Edit]) -> String {
    let own = |text: &str| -> Vec<String> { text.split_inclusive('\n').map(Into::into).collect() };
    let (mut lines, other) = (own(text), own(other));
    for edit in edits {
        if !lines.is_empty() {
            change(&mut lines, &other, edit);
        }
    }
    lines.concat()
}

fn change(lines: &mut Vec<String>, other: &[String], edit: &Edit) {
    let count = lines.len();
    match edit {
        Edit::Word(line, word, new) => {
            let new = WORDS[new.index(WORDS.len())];
            word_of(&mut lines[line.index(count)], word, |_| new.to_owned());
        }
        Edit::Next(line, word, up) => word_of(&mut lines[line.index(count)], word, |old| {
            let digits: String = old.chars().filter(char::is_ascii_digit).collect();
            let number = digits.parse::<u64>().unwrap_or(7);
            let next = if *up {
                number.saturating_add(1)
            } else {
                number.saturating_sub(1)
            };
            old.replacen(&digits, &next.to_string(), 1)
        }),
        Edit::DropWord(line, word) => {
            word_of(&mut lines[line.index(count)], word, |_| String::new());
        }
        Edit::Drop(line) => drop(lines.remove(line.index(count))),
        Edit::Repeat(line) => {
            let line = line.index(count);
            lines.insert(line, lines[line].clone());
        }
        Edit::Swap(a, b) => lines.swap(a.index(count), b.index(count)),
        Edit::Join(line) => {
            let line = &mut lines[line.index(count)];
            line.truncate(line.trim_end().len());
        }
        Edit::Splice(here, there) => {
            lines.truncate(here.index(count));
            lines.extend_from_slice(&other[there.index(other.len())..]);
        }
        Edit::Cut(line) => lines.truncate(line.index(count)),
    }
}

/// Replaces a word of a line by what `new` makes of it.
fn word_of(line: &mut String, word: &Index, new: impl FnOnce(&str) -> String) {
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.is_empty() {
        return;
    }
    let old = words[word.index(words.len())];
    let at = old.as_ptr() as usize - line.as_ptr() as usize;
    let (end, new) = (at + old.len(), new(old));
    line.replace_range(at..end, &new);
}

/// JSON with one of its tokens (a string, a number, a word) replaced by one of [`TOKENS`], by another
/// of its own, dropped, or repeated.
pub fn changed_token(text: &str, token: &Index, other: &Index, how: &Index) -> String {
    let tokens = tokens(text);
    if tokens.is_empty() {
        return text.to_owned();
    }
    let at = tokens[token.index(tokens.len())].clone();
    let mut out = text.to_owned();
    match how.index(5) {
        0 | 1 => out.replace_range(at, TOKENS[other.index(TOKENS.len())]),
        2 => out.replace_range(at, &text[tokens[other.index(tokens.len())].clone()]),
        3 => out.replace_range(at, ""),
        _ => out.insert_str(at.end, &format!(", {}", &text[at.clone()])),
    }
    out
}

const TOKENS: [&str; 16] = [
    "0",
    "1",
    "-1",
    "2",
    "1.5",
    "1e30",
    "4294967295",
    "18446744073709551615",
    "18446744073709551616",
    "null",
    "true",
    "\"\"",
    "\"../V.npy\"",
    "\"u8\"",
    "[]",
    "{}",
];

/// Where the strings, numbers and words of JSON are.
fn tokens(text: &str) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        let from = at;
        at += 1;
        if bytes[from] == b'"' {
            while at < bytes.len() && bytes[at] != b'"' {
                at += 1 + usize::from(bytes[at] == b'\\');
            }
            at = (at + 1).min(bytes.len());
        } else if bytes[from].is_ascii_alphanumeric() || bytes[from] == b'-' {
            while at < bytes.len()
                && (bytes[at].is_ascii_alphanumeric() || b".+-".contains(&bytes[at]))
            {
                at += 1;
            }
        } else {
            continue;
        }
        if text.is_char_boundary(from) && text.is_char_boundary(at) {
            found.push(from..at);
        }
    }
    found
}
