//! Parsers of mesh files, as plain as can be: of the files that the program writes, no more.

use cornermill::export::Format;

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parsed {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u64; 3]>,
    /// STL: the normals.
    pub normals: Vec<[f32; 3]>,
    /// Types of coordinates and indices, as the file names them.
    pub types: Vec<String>,
}

/// Parses a whole file of the format (for `.npy`: V, then `g`).
pub fn parse(format: Format, bytes: &[u8], g: Option<&[u8]>) -> Parsed {
    match format {
        Format::Ply => ply(bytes),
        Format::Stl => stl(bytes),
        Format::Obj => obj(bytes),
        Format::Off => off(bytes),
        Format::Npy => npy(bytes, g),
    }
}

fn numbers<T: std::str::FromStr>(words: &str) -> Vec<T> {
    let parse = |w: &str| w.parse().ok().unwrap_or_else(|| panic!("no number: {w}"));
    words.split(' ').map(parse).collect()
}

fn triple<T: Copy>(of: &[T]) -> [T; 3] {
    assert_eq!(of.len(), 3);
    [of[0], of[1], of[2]]
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("text")
}

fn ply(bytes: &[u8]) -> Parsed {
    let mark = b"end_header\n";
    let end = bytes.windows(mark.len()).position(|w| w == mark).unwrap() + mark.len();
    let head: Vec<&str> = text(&bytes[..end]).lines().collect();
    assert_eq!(head[0], "ply");
    let count =
        |line: &str, what: &str| -> usize { line.strip_prefix(what).unwrap().parse().unwrap() };
    let points = count(head[2], "element vertex ");
    let real = head[3].strip_prefix("property ").unwrap();
    let real = real.strip_suffix(" x").unwrap();
    let triangles = count(head[6], "element face ");
    let index = head[7].strip_prefix("property list uchar ").unwrap();
    let index = index.strip_suffix(" vertex_indices").unwrap();
    let types = vec![real.to_owned(), index.to_owned()];
    let body = &bytes[end..];
    if head[1] == "format ascii 1.0" {
        let lines: Vec<&str> = text(body).lines().collect();
        assert_eq!(lines.len(), points + triangles);
        return Parsed {
            types,
            ..lines_of(&lines, points)
        };
    }
    assert_eq!(head[1], "format binary_little_endian 1.0");
    let size = if real == "double" { 8 } else { 4 };
    let (points, faces) = body.split_at(points * 3 * size);
    assert_eq!(faces.len(), triangles * 13);
    let faces = faces.chunks(13).map(|f| {
        assert_eq!(f[0], 3);
        triple(&integers(&f[1..], 4))
    });
    Parsed {
        points: reals(points, size),
        triangles: faces.collect(),
        types,
        normals: vec![],
    }
}

/// Vertices `x y z`, then triangles `3 a b c`.
fn lines_of(lines: &[&str], points: usize) -> Parsed {
    let face = |l: &&str| triple(&numbers(l.strip_prefix("3 ").unwrap()));
    Parsed {
        points: lines[..points]
            .iter()
            .map(|l| triple(&numbers(l)))
            .collect(),
        triangles: lines[points..].iter().map(face).collect(),
        ..Parsed::default()
    }
}

fn off(bytes: &[u8]) -> Parsed {
    let lines: Vec<&str> = text(bytes).lines().collect();
    assert_eq!(lines[0], "OFF");
    let [points, triangles, edges] = triple(&numbers::<usize>(lines[1]));
    assert_eq!((lines.len(), edges), (2 + points + triangles, 0));
    lines_of(&lines[2..], points)
}

fn obj(bytes: &[u8]) -> Parsed {
    let mut parsed = Parsed::default();
    for line in text(bytes).lines() {
        if let Some(v) = line.strip_prefix("v ") {
            parsed.points.push(triple(&numbers(v)));
        } else {
            let f: [u64; 3] = triple(&numbers(line.strip_prefix("f ").unwrap()));
            parsed.triangles.push(f.map(|v| v - 1));
        }
    }
    parsed
}

/// Every corner is a point of its own.
fn stl(bytes: &[u8]) -> Parsed {
    assert!(!bytes.starts_with(b"solid"));
    let triangles = integers(&bytes[80..84], 4)[0];
    let body = &bytes[84..];
    assert_eq!(body.len() as u64, 50 * triangles);
    let mut parsed = Parsed::default();
    for (t, record) in (0..).zip(body.chunks(50)) {
        let spots = reals(&record[..48], 4);
        parsed.normals.push(spots[0].map(|x| x as f32));
        parsed.points.extend_from_slice(&spots[1..]);
        parsed.triangles.push([3 * t, 3 * t + 1, 3 * t + 2]);
        assert_eq!(&record[48..], [0, 0]);
    }
    parsed
}

fn npy(v: &[u8], g: Option<&[u8]>) -> Parsed {
    let (descr, rows, data) = array(v);
    let ids = integers(data, if descr == "<u8" { 8 } else { 4 });
    assert_eq!(ids.len(), 3 * rows);
    let mut parsed = Parsed {
        triangles: ids.chunks(3).map(triple).collect(),
        types: vec![descr],
        ..Parsed::default()
    };
    if let Some(g) = g {
        let (descr, rows, data) = array(g);
        parsed.points = reals(data, if descr == "<f8" { 8 } else { 4 });
        assert_eq!(parsed.points.len(), rows);
        parsed.types.push(descr);
    }
    parsed
}

/// Type, rows and data of a two-dimensional array of three columns.
fn array(bytes: &[u8]) -> (String, usize, &[u8]) {
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let words: Vec<&str> = text(&bytes[10..start])
        .split(['\'', '(', ',', ')'])
        .collect();
    let after = |key: &str| words.iter().position(|&w| w == key).unwrap();
    let descr = words[after("descr") + 2].to_owned();
    let rows = words[after("shape") + 2].parse().unwrap();
    assert_eq!(words[after("shape") + 3], " 3");
    (descr, rows, &bytes[start..])
}

fn reals(bytes: &[u8], size: usize) -> Vec<[f64; 3]> {
    let real = |b: &[u8]| match *b {
        [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => f64::from_le_bytes(b.try_into().unwrap()),
    };
    let all: Vec<f64> = bytes.chunks(size).map(real).collect();
    all.chunks(3).map(triple).collect()
}

fn integers(bytes: &[u8], size: usize) -> Vec<u64> {
    let number = |b: &[u8]| b.iter().rev().fold(0, |n, &x| n << 8 | u64::from(x));
    bytes.chunks(size).map(number).collect()
}
