//! Readers of mesh files, as naive as possible and only for well-formed files: what V and G should
//! be, found without the program.

use super::mesh::Mesh;
use std::collections::HashMap;
use std::path::Path;

/// Reads a file by its extension: OBJ, OFF, PLY of any kind, STL (welded).
pub fn read(path: &Path) -> Mesh {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default();
    let name = path.display().to_string();
    match extension.to_lowercase().as_str() {
        "obj" => obj(&String::from_utf8_lossy(&bytes)),
        "off" => off(&String::from_utf8_lossy(&bytes)),
        "ply" => ply(&bytes),
        "stl" => stl(&bytes),
        other => panic!("{name}: no naive reader for {other:?}"),
    }
    .renamed(&name)
}

/// Fans a polygon around its first corner.
fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend(corners.windows(2).skip(1).map(|w| [corners[0], w[0], w[1]]));
}

fn point<'a>(mut words: impl Iterator<Item = &'a str>) -> [f32; 3] {
    let mut coordinate = || words.next().and_then(|w| w.parse().ok());
    [0; 3].map(|_| coordinate().expect("three coordinates"))
}

fn obj(text: &str) -> Mesh {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for line in text.replace("\\\n", " ").replace("\\\r\n", " ").lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => positions.push(point(words)),
            Some("f") => {
                let index = |word: &str| {
                    let index: i64 = word.split('/').next().unwrap().parse().expect("an index");
                    let before = positions.len() as i64;
                    u32::try_from(if index < 0 { before + index } else { index - 1 }).unwrap()
                };
                fan(&words.map(index).collect::<Vec<_>>(), &mut triangles);
            }
            _ => {}
        }
    }
    Mesh::new("", triangles, positions)
}

fn off(text: &str) -> Mesh {
    let mut lines = text
        .lines()
        .skip(1)
        .filter(|l| !l.is_empty() && !l.starts_with('#'));
    let mut words = || lines.next().expect("a line").split_whitespace();
    let counts: Vec<usize> = words().map(|w| w.parse().expect("a count")).collect();
    let positions = (0..counts[0]).map(|_| point(words())).collect();
    let mut triangles = vec![];
    for _ in 0..counts[1] {
        let row: Vec<u32> = words().map_while(|w| w.parse().ok()).collect();
        fan(&row[1..1 + row[0] as usize], &mut triangles);
    }
    Mesh::new("", triangles, positions)
}

/// Welds by position: -0 equals +0, NaN by its bits, ids in order of first use.
pub fn weld(corners: &[[f32; 3]]) -> Mesh {
    let mut ids = HashMap::new();
    let mut positions = vec![];
    let mut id = |p: &[f32; 3]| {
        let key = p.map(|x| if x == 0.0 { 0 } else { x.to_bits() });
        *ids.entry(key).or_insert_with(|| {
            positions.push(*p);
            positions.len() as u32 - 1
        })
    };
    let triangles = corners
        .chunks_exact(3)
        .map(|t| [id(&t[0]), id(&t[1]), id(&t[2])])
        .collect();
    Mesh::new("", triangles, positions)
}

fn stl(bytes: &[u8]) -> Mesh {
    let count = bytes
        .get(80..84)
        .map(|b| u32::from_le_bytes(b.try_into().unwrap()) as usize);
    if count.is_some_and(|n| bytes.len() == 84 + 50 * n) {
        let float = |b: &[u8]| f32::from_le_bytes(b.try_into().unwrap());
        let record =
            |r: &[u8]| [12, 24, 36].map(|at| [0, 4, 8].map(|i| float(&r[at + i..at + i + 4])));
        let corners: Vec<_> = bytes[84..].chunks_exact(50).flat_map(record).collect();
        return weld(&corners);
    }
    let text = String::from_utf8_lossy(bytes);
    let mut words = text.split_whitespace();
    let mut corners = vec![];
    while let Some(word) = words.next() {
        if word == "vertex" {
            corners.push(point(&mut words));
        }
    }
    weld(&corners)
}

/// Takes one scalar after another from the body of a PLY file, as f64.
struct Scalars<'a> {
    format: String,
    body: &'a [u8],
    /// What is left of the line, in text: each element stands on a line of its own, and one of the
    /// files has more values on it than its header declares.
    line: Vec<&'a str>,
}

impl Scalars<'_> {
    fn start_element(&mut self) {
        while self.format == "ascii" {
            let end = self
                .body
                .iter()
                .position(|&b| b == b'\n')
                .unwrap_or(self.body.len());
            let (line, rest) = self.body.split_at(end);
            self.body = rest.get(1..).unwrap_or_default();
            self.line = std::str::from_utf8(line)
                .expect("text")
                .split_whitespace()
                .rev()
                .collect();
            if !self.line.is_empty() {
                break;
            }
        }
    }

    fn take(&mut self, kind: &str) -> f64 {
        if self.format == "ascii" {
            let word = self.line.pop().expect("one more value on the line");
            // Rounded to the type at once, as a reader of that type would.
            return match kind {
                "float" | "float32" => f64::from(word.parse::<f32>().unwrap()),
                _ => word.parse().unwrap(),
            };
        }
        let size = match kind {
            "char" | "uchar" | "int8" | "uint8" => 1,
            "short" | "ushort" | "int16" | "uint16" => 2,
            "double" | "float64" => 8,
            _ => 4,
        };
        let (value, rest) = self.body.split_at(size);
        self.body = rest;
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(value);
        if self.format == "binary_big_endian" {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        match kind {
            "float" | "float32" => f64::from(f32::from_bits(bits as u32)),
            "double" | "float64" => f64::from_bits(bits),
            _ => bits as f64,
        }
    }
}

/// Coordinates beyond f4 are rounded to it.
fn ply(bytes: &[u8]) -> Mesh {
    let end = bytes
        .windows(10)
        .position(|w| w == b"end_header")
        .expect("end_header")
        + 10;
    let end = end
        + 1
        + bytes[end..]
            .iter()
            .position(|&b| b == b'\n')
            .expect("a newline");
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let lines = || {
        header
            .lines()
            .map(|l| l.split_whitespace().collect::<Vec<_>>())
    };
    let format = lines().find(|w| w[0] == "format").expect("a format")[1].to_string();
    let mut scalars = Scalars {
        format,
        body: &bytes[end..],
        line: vec![],
    };
    // An element with its count, then the words of its properties.
    let mut elements: Vec<(String, usize, Vec<Vec<&str>>)> = vec![];
    for words in lines() {
        match words[0] {
            "element" => elements.push((words[1].into(), words[2].parse().unwrap(), vec![])),
            "property" => elements.last_mut().expect("an element").2.push(words),
            _ => {}
        }
    }
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (name, count, properties) in &elements {
        for _ in 0..*count {
            scalars.start_element();
            let mut at = [0.0; 3];
            for words in properties {
                if words[1] == "list" {
                    let length = scalars.take(words[2]) as usize;
                    let row: Vec<u32> =
                        (0..length).map(|_| scalars.take(words[3]) as u32).collect();
                    if name == "face" && words[4].starts_with("vertex_ind") {
                        fan(&row, &mut triangles);
                    }
                    continue;
                }
                let value = scalars.take(words[1]);
                if let Some(axis) = ["x", "y", "z"].iter().position(|x| *x == words[2]) {
                    at[axis] = value as f32;
                }
            }
            if name == "vertex" {
                positions.push(at);
            }
        }
    }
    Mesh::new("", triangles, positions)
}
