//! Texts against what is in them.

use super::*;
use std::fmt::Write;

fn map(text: &[u8], form: Form) -> Lines {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), text).unwrap();
    Lines::map(file.path(), form, 0).unwrap()
}

fn off(faces: u64) -> Form {
    Form::Rows(Rows {
        columns: vec![Column::Face(0, 0)],
        exactly: false,
        beside: [true, false],
        number: faces,
    })
}

fn read(lines: &Lines, first: u64, count: u64) -> Vec<[u64; 3]> {
    let mut found = Vec::new();
    lines.read(first, count, &mut found).unwrap();
    found
}

/// A text of so many vertices and faces; every face names its own number first.
fn rows(vertices: u64, faces: u64, squares: u64) -> String {
    let mut text = String::new();
    for i in 0..vertices {
        let _ = writeln!(text, "3 {i} 0.5");
    }
    for i in 0..faces {
        let _ = match i < squares {
            true => writeln!(text, "4 {i} 1 2 3"),
            false => writeln!(text, "3 {i} 1 2 255 0 0"),
        };
    }
    text
}

#[test]
fn small_texts_are_counted_and_read() {
    let lines = map(rows(3, 5, 2).as_bytes(), off(5));
    assert_eq!(lines.triangles(), 7);
    let all = [
        [0, 1, 2],
        [0, 2, 3],
        [1, 1, 2],
        [1, 2, 3],
        [2, 1, 2],
        [3, 1, 2],
        [4, 1, 2],
    ];
    assert_eq!(read(&lines, 0, 7), all);
    assert_eq!(read(&lines, 0, 3), all[..3]);
    for text in [
        "",
        "\n\r\n",
        "3 1",
        "-1 2 3 4\n",
        "99999999999999999999 1 2 3\n",
    ] {
        let lines = map(text.as_bytes(), off(5));
        assert_eq!(
            (lines.triangles(), read(&lines, 0, 9)),
            (0, vec![]),
            "{text}"
        );
    }
}

#[test]
fn triangles_of_long_texts_are_found_about_where_they_are() {
    let text = rows(150_000, 400_000, 200_000);
    let lines = map(text.as_bytes(), off(400_000));
    let about = lines.triangles();
    assert!(about.abs_diff(600_000) < 12_000, "{about}");
    // The first face, not a vertex that looks like one.
    let first = read(&lines, 0, 2);
    assert!(first[0][0] < 400, "{first:?}");
    for (triangle, face) in [(100_000, 50_000), (400_000, 200_000), (590_000, 390_000)] {
        let found = read(&lines, triangle, 1000);
        assert_eq!(found.len(), 1000);
        let off = found[0][0].abs_diff(face);
        assert!(off < 8000, "{triangle}: face {}", found[0][0]);
    }
    let last = read(&lines, about - 1, 1000);
    assert!(last.iter().all(|t| t[0] > 390_000), "{last:?}");
}

#[test]
fn strips_are_seen_by_rows_and_by_pieces() {
    let form = |number| {
        Form::Rows(Rows {
            columns: vec![Column::Strip(4, 4)],
            exactly: true,
            beside: [true, true],
            number,
        })
    };
    let lines = map(b"0 0 1\n7 0 1 2 3 -1 4 5\n4 6 7 8 -1\n", form(2));
    assert_eq!(lines.triangles(), 3);
    assert_eq!(read(&lines, 0, 9), [[0, 1, 2], [2, 1, 3], [6, 7, 8]]);
    for length in [20, 5000, 500_000] {
        let rows = 500_000 / length;
        let mut text = "0 0 1\n".repeat(100_000);
        for row in 0..rows {
            let _ = write!(text, "{length}");
            for i in 0..length {
                let _ = write!(text, " {}", row * length + i);
            }
            text.push('\n');
        }
        text += &"5 0 1 2\n".repeat(100_000);
        let lines = map(text.as_bytes(), form(rows));
        let (about, right) = (lines.triangles(), 500_000 - 2 * rows);
        assert!(about.abs_diff(right) < 10_000, "{length}: {about}");
        for first in [0, 200_000, 400_000] {
            let found = read(&lines, first, 1000);
            assert_eq!(found.len(), 1000);
            let off = found[1][0].abs_diff(first * 500_000 / right);
            assert!(off < 8000, "{length}, {first}: {:?}", found[0]);
        }
    }
}

#[test]
fn statements_may_count_back_and_lie_among_others() {
    let text = "v 0 0 0\nvn 1 1 1\nv 0 0 0\r\nv 1 1 1\nf 1/2/3 2//3 3\nv 2 2 2\nf -1 -2 -3 -4\n\
                fo 1 2 4\nf 1 x 2\nl 1 2 3\n";
    let lines = map(text.as_bytes(), Form::Statements);
    assert_eq!((lines.triangles(), lines.vertices), (4, 4));
    let found = read(&lines, 0, 9);
    assert_eq!(found, [[1, 2, 3], [3, 2, 1], [3, 1, 0], [1, 2, 4]]);
}

#[test]
fn facets_are_told_apart_by_their_places() {
    let facet = |a: &str, b: &str| {
        format!(
            "facet normal 0 0 1 outer loop\nVERTEX {a}\n vertex {b} vertex 7 8 9\nendloop EndFacet\n"
        )
    };
    let text = facet("0 0 1", "1 2 3") + &facet("-0 0.0 1e0", "1 2 4") + "endfacet\nvertex 1";
    let lines = map(text.as_bytes(), Form::Facets);
    assert!(lines.by_position());
    // One more ends here, which a part of a file may have begun before.
    assert_eq!(lines.triangles(), 3);
    let [a, b] = read(&lines, 0, 9)[..] else {
        panic!("two facets");
    };
    assert_eq!([a[0], a[2]], [b[0], b[2]]);
    assert!(a[1] != b[1] && a[0] != a[1]);
}

#[test]
fn texts_of_one_line_are_no_trouble() {
    let text = "3 1 2 ".repeat(1 << 20);
    for form in [off(u64::MAX), Form::Statements, Form::Facets] {
        let lines = map(text.as_bytes(), form);
        assert!(read(&lines, lines.triangles() / 2, 100).len() <= 100);
    }
}

#[test]
fn facets_of_long_texts_are_counted() {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 1 0 1\nvertex 0 0.25 1\n\
                 endloop\nendfacet\n";
    let lines = map(facet.repeat(50_000).as_bytes(), Form::Facets);
    assert!(
        lines.triangles().abs_diff(50_000) < 250,
        "{}",
        lines.triangles()
    );
    assert_eq!(read(&lines, 49_000, 900).len(), 900);
}
