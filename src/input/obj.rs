//! Wavefront OBJ: the vertices and faces of its polygonal statements.
//!
//! Used are `v` (x, y, z; a weight or colours behind them are not) and `f` (also by its old
//! name `fo`), whose corners are `v`, `v/vt`, `v//vn` or `v/vt/vn` with v from 1, or negative
//! to count back from the vertex read last. Faces may precede the vertices that they name by
//! positive numbers. Every other statement is passed over: texture coordinates, normals,
//! groups, materials, and what is no face (points, lines, curves), of which a note tells.
//!
//! A backslash joins the next line to an `f` or `v`; in what is passed over it means nothing,
//! since a path may end in one, and taking the face below for its continuation would lose it.
//!
//! Why lines of any length are safe: corners are taken word by word and fanned as they come.
//!
//! Memory: the reader's and the sink's buffers. I/O: the input once; V and G once.
//! Source: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1, 1992.

use super::number::parse_integer;
use super::reader::ByteReader;
use super::sink::MeshSink;
use super::text::{Dialect, Lexer, shown};
use super::{CoordKind, Mesh, Request};
use crate::disk::Workspace;
use crate::error::{Error, Result};

/// First words of statements, by which an OBJ file is known.
pub const KEYWORDS: [&[u8]; 18] = [
    b"v", b"vt", b"vn", b"vp", b"f", b"fo", b"l", b"p", b"o", b"g", b"s", b"usemtl", b"mtllib",
    b"usemap", b"maplib", b"mg", b"deg", b"cstype",
];

/// A statement, by its first word.
enum Statement {
    Vertex,
    Face,
    /// Part of the shape, but no face.
    Unused,
    Other,
}

/// Decodes an OBJ file.
///
/// # Errors
/// [`Error::Input`] naming the line, [`Error::Io`], [`Error::Budget`], [`Error::DiskLimit`].
pub fn read(ws: &Workspace, reader: ByteReader, request: &Request) -> Result<Mesh> {
    let path = reader.path().to_owned();
    let mut sink = MeshSink::new(ws, request, &path, CoordKind::F4)?;
    let mut lexer = Lexer::new(reader, Dialect::Joined, 1);
    let mut unused = 0u64;
    let mut faces = 0u64;
    loop {
        let statement = match lexer.word()? {
            Some(b"v") => Statement::Vertex,
            Some(b"f" | b"fo") => Statement::Face,
            Some(b"p" | b"l" | b"curv" | b"curv2" | b"surf") => Statement::Unused,
            _ => Statement::Other,
        };
        match statement {
            Statement::Vertex => vertex(&mut lexer, &mut sink)?,
            Statement::Face => {
                face(&mut lexer, &mut sink)?;
                faces += 1;
            }
            Statement::Unused => unused += 1,
            Statement::Other => {}
        }
        if !lexer.next_line()? {
            break;
        }
    }
    if faces == 0 {
        let found = match (sink.vertices(), unused) {
            (0, _) => "no vertices and no faces: no statement `v` or `f`".to_owned(),
            (n, 0) => format!("a point cloud: {n} vertices without a face"),
            (n, m) => format!("{n} vertices, and {m} points, lines or curves, but no face"),
        };
        let help = "make a surface of triangles or polygons of it first";
        return Err(Error::input(
            &path,
            "",
            "a mesh: statements `f`",
            found,
            help,
        ));
    }
    if unused > 0 {
        ws.progress.note(&format!(
            "{}: {unused} points, lines or curves are no faces and were passed over",
            path.display()
        ));
    }
    sink.finish(ws, "obj", lexer.into_reader().finish()?)
}

fn vertex(lexer: &mut Lexer, sink: &mut MeshSink) -> Result<()> {
    let what = "a coordinate of the vertex";
    match sink.kind() {
        CoordKind::F4 => {
            let at = [lexer.f4(what)?, lexer.f4(what)?, lexer.f4(what)?];
            sink.rounded4(at)
        }
        CoordKind::F8 => {
            let at = [lexer.f8(what)?, lexer.f8(what)?, lexer.f8(what)?];
            sink.vertex8(at)
        }
    }
}

fn face(lexer: &mut Lexer, sink: &mut MeshSink) -> Result<()> {
    let line = lexer.line();
    sink.begin_face();
    while let Some(word) = lexer.word()? {
        let v = match corner(word, sink.vertices()) {
            Ok(v) => v,
            Err(expected) => {
                let found = shown(word);
                let help = "correct the index, or the order of the statements";
                return Err(lexer.error(expected, found, help));
            }
        };
        sink.corner(v)?;
    }
    sink.end_face(|| format!("line {line}"))?;
    Ok(())
}

/// The vertex that a corner names when `vertices` were read; else what was expected of it.
#[inline]
fn corner(word: &[u8], vertices: u64) -> Result<u64, String> {
    let end = word.iter().position(|&b| b == b'/').unwrap_or(word.len());
    match parse_integer(&word[..end]) {
        Some(v) if v > 0 => Ok(v as u64 - 1),
        Some(0) => Err("an index from 1, or from -1 back".into()),
        Some(v) => vertices
            .checked_sub(v.unsigned_abs())
            .ok_or_else(|| format!("an index of one of the {vertices} vertices so far")),
        None => Err("a corner: v, v/vt, v//vn or v/vt/vn".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::{Decoded, decode, refused};

    fn good(text: &str) -> Decoded {
        let whole = decode(read, text.as_bytes(), usize::MAX, None).unwrap();
        assert_eq!(decode(read, text.as_bytes(), 1, None).unwrap(), whole);
        whole
    }

    fn f4(coords: &[f32]) -> Vec<u64> {
        coords.iter().map(|c| c.to_bits().into()).collect()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn corners_in_every_form() {
        for face in [
            "f 1 2 3 4",
            "f 1/1 2/2 3/3 4/4",
            "f 1//1 2//2 3//1 4//9",
            "f 1/5/1 2/-2/1 3/1/1 4/1/1",
            "f 1// 2/ 3 4/1",
            "f -4 -3 -2 -1",
            "f -4/-1/-1 2 -2//3 4",
            "  f\t1   2 3 4  ",
            "fo 1 2 3 4",
            "f 1 2 \\\n3 4",
            "f 1 2\\\r\n3\\\r4",
            "\\\nf 1 2 3 4 # a square",
            "f 1 2 3 4\\",
        ] {
            for end in ["\n", "\r\n", "\r", ""] {
                let mesh = good(&format!("{SQUARE}{face}{end}"));
                assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{face}");
                assert_eq!(mesh.fanned, 1);
            }
        }
    }

    #[test]
    fn everything_else_is_passed_over() {
        let long = format!("# {}\nmtllib C:\\dir\\\n", "x ".repeat(100_000));
        let text = format!(
            "\u{b}\n{long}f 3 1 2\no v\ng f 1 2 3\nv 1 2 3 0.5\nvn 0 0 1\nvt 1\nvp 0\n\
             v 1 2 3 255 0 0\nl 1 2\np 1\ncurv 0 1 \\\n 2 3\ns off\nf -1 1 2\nv 4 5 6 #c\nunknown\n"
        );
        let mesh = good(&text);
        assert_eq!(mesh.triangles, [[2, 0, 1], [1, 0, 1]]);
        assert_eq!(mesh.bits, f4(&[1., 2., 3., 1., 2., 3., 4., 5., 6.]));
    }

    #[test]
    fn numbers_in_every_form() {
        let words = [
            (".8e-001", 0.08),
            ("-.7e+2", -70.),
            ("+3.", 3.),
            ("1E5", 1e5),
            ("-0", -0.),
            ("16777217", 16777216.),
            // Rounded by way of f8 it would be 1 (a tie there).
            ("1.00000005960464477540", 1.0000001),
            ("1e-60", 0.),
            ("inf", f32::INFINITY),
            ("-Infinity", f32::NEG_INFINITY),
        ];
        for (word, value) in words {
            let mesh = good(&format!("v {word} 0 0\nf 1 1 1\n"));
            assert_eq!(mesh.bits[0], f4(&[value])[0], "{word}");
        }
        for word in ["nan", "-NaN"] {
            let mesh = good(&format!("v {word} 0 0\nf 1 1 1\n"));
            assert!(f32::from_bits(mesh.bits[0] as u32).is_nan(), "{word}");
            assert_eq!(mesh.bits[0] >> 31 == 1, word.starts_with('-'));
        }
        for word in [
            "3.1+e2", "1,5", "0x10", "1.#IND", ".", "-", "1e", "\u{ff}", "1_0", "1/2",
        ] {
            refused(
                read,
                format!("\nv 0 {word} 0\nf 1 1 1\n").as_bytes(),
                &["line 2", &format!("`{}`", word.escape_debug())],
            );
        }
        let large = b"v 0 0 1e39\nf 1 1 1\n";
        refused(read, large, &["line 1", "`1e39`", "--coords f8"]);
        let wide = decode(read, large, 1, Some(CoordKind::F8)).unwrap();
        assert_eq!(wide.bits, [0., 0., 1e39].map(f64::to_bits));
        refused(
            read,
            b"v 0 0\nf 1 1 1\n",
            &["line 1", "the end of the line"],
        );
        refused(read, b"v 0 0", &["line 1", "the end of the input"]);
    }

    #[test]
    fn faces_that_cannot_be() {
        for (face, parts) in [
            ("f 0 1 2", &["from 1", "`0`"][..]),
            ("f 0/0/0 1 2", &["from 1"]),
            ("f 1 2 -5", &["one of the 4 vertices", "`-5`"]),
            ("f 1 2 -9223372036854775808", &["one of the 4"]),
            ("f 1 2 9999999999999999999", &["a corner"]),
            ("f 1 2 x", &["a corner", "`x`"]),
            ("f 1 2 3.0", &["a corner", "`3.0`"]),
            ("f 1 2 /3", &["a corner"]),
            ("f", &["at least 3", "0 corners"]),
            ("f 1", &["at least 3", "1 corner"]),
            ("f 8 7", &["at least 3", "2 corners"]),
        ] {
            let parts = [&["line 5"], parts].concat();
            refused(read, format!("{SQUARE}{face}\n").as_bytes(), &parts);
            refused(read, format!("{SQUARE}{face}").as_bytes(), &parts);
        }
        let endless = format!("f {}\n", "1".repeat(5000));
        refused(read, endless.as_bytes(), &["line 1", "at most 1024 bytes"]);
    }

    #[test]
    fn one_line_with_a_million_corners() {
        let text = format!(
            "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2{}\n",
            " 3".repeat(1_000_000)
        );
        let mesh = decode(read, text.as_bytes(), usize::MAX, None).unwrap();
        assert_eq!(mesh.triangles.len(), 1_000_000);
        assert_eq!(mesh.triangles[999_999], [0, 2, 2]);
    }

    #[test]
    fn what_has_no_face() {
        refused(read, b"v 0 0 0\nv 1 0 0\n", &["a point cloud: 2 vertices"]);
        refused(
            read,
            b"v 0 0 0\np 1\nl 1 1\n",
            &["2 points, lines or curves"],
        );
        refused(read, b"mtllib x\n", &["no statement `v` or `f`"]);
    }

    #[test]
    fn truncation_at_every_byte() {
        let text = format!("{SQUARE}f 1 2 3\nf 1 2 3 4\n");
        // From the first whole face on a shorter file is another mesh; nothing may panic.
        let whole = good(&text);
        for len in 0..text.len() {
            if let Ok(mesh) = decode(read, &text.as_bytes()[..len], 5, None) {
                assert!(whole.triangles.starts_with(&mesh.triangles), "{len}");
                assert!(len >= SQUARE.len() + 7);
            }
        }
    }
}
