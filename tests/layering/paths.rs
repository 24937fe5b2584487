//! From a Rust source to the paths that it names and the words and texts in it.
//!
//! No parser: comments are passed over, the rest is cut into words, texts and signs, and paths are
//! read from those, `use` trees with their branches included. That is enough as long as nobody
//! hides an import from it on purpose.

use std::collections::BTreeSet;

/// A source, as far as the rules look at it.
pub struct File {
    /// Path below the folder, with `/`.
    pub name: String,
    /// Its module: `["build", "scan"]`; empty for `lib.rs` and `main.rs`.
    pub module: Vec<String>,
    pub paths: Vec<Named>,
    pub tokens: Vec<Token>,
}

/// A path that is named, resolved: from the root of the crate (`["crate", "disk", "Window"]`), or
/// as it stands when it begins with another crate (`["std", "env"]`). A glob ends with `*`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    pub segments: Vec<String>,
    pub line: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An identifier or keyword.
    Word,
    /// What stands between quotes.
    Text,
    /// Any other character.
    Sign,
}

#[derive(Clone, Debug)]
pub struct Token {
    pub kind: Kind,
    pub text: String,
    pub line: usize,
}

impl Token {
    pub fn is(&self, text: &str) -> bool {
        self.kind != Kind::Text && self.text == text
    }
}

/// Reads all sources, given by path and text.
pub fn read(sources: &[(String, String)]) -> Vec<File> {
    let modules: BTreeSet<Vec<String>> = sources.iter().map(|(name, _)| module(name)).collect();
    let one = |(name, text): &(String, String)| {
        let (module, tokens) = (module(name), tokens(text));
        let mut reader = Reader {
            tokens: &tokens,
            modules: &modules,
            at: module.clone(),
            inline: Vec::new(),
            found: Vec::new(),
        };
        reader.read();
        let paths = reader.found;
        File {
            name: name.clone(),
            module,
            paths,
            tokens,
        }
    };
    sources.iter().map(one).collect()
}

fn module(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = name.split('/').map(str::to_owned).collect();
    let last = parts.pop().unwrap_or_default();
    match last.trim_end_matches(".rs") {
        "mod" => {}
        "lib" | "main" if parts.is_empty() => {}
        stem => parts.push(stem.to_owned()),
    }
    parts
}

fn tokens(text: &str) -> Vec<Token> {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut found, mut i, mut line) = (Vec::new(), 0, 1);
    while i < chars.len() {
        let start = i;
        let mut kind = Kind::Sign;
        let mut inside = start..start + 1;
        match at(i) {
            '/' if at(i + 1) == '/' => {
                while i < chars.len() && at(i) != '\n' {
                    i += 1;
                }
                continue;
            }
            '/' if at(i + 1) == '*' => {
                i = after_comment(&chars, i);
                inside = start..start;
            }
            '"' => {
                i = after_quotes(&chars, i + 1, 0, true);
                (kind, inside) = (Kind::Text, start + 1..i - 1);
            }
            // A character, not a lifetime: closed, or begun by a backslash.
            '\'' if at(i + 1) == '\\' || at(i + 2) == '\'' => {
                i += if at(i + 1) == '\\' { 3 } else { 2 };
                while i < chars.len() && at(i) != '\'' {
                    i += 1;
                }
                i += 1;
                inside = start..start;
            }
            c if word(c) => {
                while word(at(i)) {
                    i += 1;
                }
                let prefix: String = chars[start..i].iter().collect();
                let hashes = chars[i..].iter().take_while(|&&c| c == '#').count();
                let raw = matches!(prefix.as_str(), "r" | "br" | "cr");
                if raw && at(i + hashes) == '"' {
                    let open = i + hashes + 1;
                    i = after_quotes(&chars, open, hashes, false);
                    (kind, inside) = (Kind::Text, open..i - hashes - 1);
                } else {
                    (kind, inside) = (Kind::Word, start..i);
                }
            }
            _ => i += 1,
        }
        if !inside.is_empty() || kind == Kind::Text {
            let text: String = chars[inside].iter().collect();
            if !text.trim().is_empty() {
                found.push(Token { kind, text, line });
            }
        }
        line += chars[start..i.min(chars.len())]
            .iter()
            .filter(|&&c| c == '\n')
            .count();
    }
    found
}

fn after_comment(chars: &[char], mut i: usize) -> usize {
    let mut depth = 0;
    while i < chars.len() {
        match chars[i..] {
            ['/', '*', ..] => (depth, i) = (depth + 1, i + 2),
            ['*', '/', ..] => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            break;
        }
    }
    i
}

/// Behind the quotes that close a text whose inside begins at `i`.
fn after_quotes(chars: &[char], mut i: usize, hashes: usize, escapes: bool) -> usize {
    while i < chars.len() {
        let closes = chars[i + 1..].iter().take_while(|&&c| c == '#').count() >= hashes;
        match chars[i] {
            '\\' if escapes => i += 2,
            '"' if closes => return i + 1 + hashes,
            _ => i += 1,
        }
    }
    i
}

/// Reads the paths of one source.
struct Reader<'a> {
    tokens: &'a [Token],
    modules: &'a BTreeSet<Vec<String>>,
    /// The module that the tokens at hand belong to.
    at: Vec<String>,
    /// Depths of braces at which inline modules end.
    inline: Vec<usize>,
    found: Vec<Named>,
}

impl Reader<'_> {
    fn read(&mut self) {
        let (mut i, mut depth) = (0, 0);
        while i < self.tokens.len() {
            let token = &self.tokens[i];
            if token.is("{") {
                depth += 1;
                if i >= 2 && self.is(i - 2, "mod") {
                    self.at.push(self.tokens[i - 1].text.clone());
                    self.inline.push(depth);
                }
            } else if token.is("}") {
                if self.inline.last() == Some(&depth) {
                    self.inline.pop();
                    self.at.pop();
                }
                depth -= 1;
            } else if token.is("use") {
                i = self.tree(i + 1, &[], true);
                continue;
            } else if token.kind == Kind::Word && self.joined(i + 1) && !self.behind_join(i) {
                let first = token.text.as_str();
                if ["crate", "self", "super", "cornermill", "std"].contains(&first) {
                    i = self.tree(i, &[], false);
                    continue;
                }
            }
            i += 1;
        }
    }

    fn is(&self, i: usize, text: &str) -> bool {
        self.tokens.get(i).is_some_and(|t| t.is(text))
    }

    /// True when `::` stands at i.
    fn joined(&self, i: usize) -> bool {
        self.is(i, ":") && self.is(i + 1, ":")
    }

    fn behind_join(&self, i: usize) -> bool {
        i >= 2 && self.joined(i - 2)
    }

    /// Reads a path from token i on, behind `before`; in a `use` it may branch. Returns the token
    /// behind it.
    fn tree(&mut self, mut i: usize, before: &[String], branches: bool) -> usize {
        let mut path = before.to_vec();
        // A leading `::` says that another crate follows.
        if self.joined(i) {
            i += 2;
        }
        while let Some(token) = self.tokens.get(i) {
            if branches && token.is("{") {
                i += 1;
                while i < self.tokens.len() && !self.is(i, "}") {
                    i = self.tree(i, &path, true);
                    if self.is(i, ",") {
                        i += 1;
                    }
                }
                return i + 1;
            }
            let glob = branches && token.is("*");
            if token.kind != Kind::Word && !glob {
                break;
            }
            path.push(token.text.clone());
            i += 1;
            if !self.joined(i) {
                break;
            }
            i += 2;
        }
        let line = self.tokens.get(i.saturating_sub(1)).map_or(0, |t| t.line);
        if branches && self.is(i, "as") {
            i += 2;
        }
        if let Some(segments) = self.resolve(path, branches) {
            self.found.push(Named { segments, line });
        }
        // At least one token further, whatever stands there.
        if i < self.tokens.len() && self.tokens[i].kind == Kind::Sign && branches {
            return if self.is(i, ",") || self.is(i, "}") {
                i
            } else {
                i + 1
            };
        }
        i
    }

    /// From the root, when the path is one of this crate.
    fn resolve(&self, path: Vec<String>, branches: bool) -> Option<Vec<String>> {
        let mut base = self.at.clone();
        let mut rest = path.as_slice();
        match rest.first()?.as_str() {
            "crate" => (base, rest) = (Vec::new(), &rest[1..]),
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first().is_some_and(|s| s == "super") {
                    base.pop();
                    rest = &rest[1..];
                }
            }
            first => {
                base.push(first.to_owned());
                if !branches || !self.modules.contains(&base) {
                    return Some(path);
                }
                rest = &rest[1..];
            }
        }
        // `use crate::folder::{self}` names the module itself.
        let rest = rest.iter().filter(|s| *s != "self");
        let mut segments = vec!["crate".to_owned()];
        segments.extend(base.into_iter().chain(rest.cloned()));
        Some(segments)
    }
}
