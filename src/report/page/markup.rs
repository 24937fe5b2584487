//! Text as HTML: escaping, numbers, tables.
//!
//! Why nothing in a page can be taken for markup that is not: all that comes from outside (names,
//! paths, types) goes through [`escape`]; all else is written in this module's callers.
//!
//! Memory: the text. I/O: none.

use std::fmt::Write;

/// The text with the five characters that mean something in HTML replaced.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            // A control character is no text, and not allowed in a page.
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// A whole number, its digits in groups of three.
pub(super) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// A whole number that programs can read too.
pub(super) fn number(n: u64) -> String {
    format!("<data value=\"{n}\">{}</data>", grouped(n))
}

/// So many of a thing: "1 border edge", "2 border edges".
pub(super) fn count(n: u64, one: &str, many: &str) -> String {
    format!("{} {}", number(n), if n == 1 { one } else { many })
}

/// A measured number to six digits; a dash where it is not known.
pub(super) fn measure(x: Option<f64>) -> String {
    match x {
        None => "–".into(),
        Some(0.0) => "0".into(),
        Some(x) if (1e-3..1e7).contains(&x.abs()) => {
            let before = x.abs().max(1.0).log10() as usize;
            format!("{x:.*}", 5usize.saturating_sub(before))
        }
        Some(x) => format!("{x:.5e}"),
    }
}

/// Bytes in the largest unit that leaves one or more.
pub(super) fn size(bytes: u64) -> String {
    const UNITS: [&str; 5] = ["KiB", "MiB", "GiB", "TiB", "PiB"];
    if bytes < 1024 {
        return format!("<data value=\"{bytes}\">{bytes} B</data>");
    }
    let mut at = bytes as f64 / 1024.0;
    let mut unit = 0;
    while at >= 1024.0 && unit + 1 < UNITS.len() {
        at /= 1024.0;
        unit += 1;
    }
    format!("<data value=\"{bytes}\">{at:.1} {}</data>", UNITS[unit])
}

/// A table whose cells are HTML already, in a region that scrolls by itself and by keyboard.
pub(super) fn table<const N: usize>(
    caption: &str,
    heads: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut out = format!(
        "<div class=\"wide\" role=\"region\" aria-label=\"{0}\" tabindex=\"0\">\
         <table><caption>{0}</caption><thead><tr>",
        escape(caption)
    );
    // Writing to a string cannot fail.
    for head in heads {
        let _ = write!(out, "<th scope=\"col\">{}</th>", escape(head));
    }
    out.push_str("</tr></thead><tbody>");
    for row in rows {
        out.push_str("<tr>");
        for (i, cell) in row.iter().enumerate() {
            let _ = match i {
                0 => write!(out, "<th scope=\"row\">{cell}</th>"),
                _ => write!(out, "<td>{cell}</td>"),
            };
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div>\n");
    out
}

/// What a reader may open.
pub(super) fn details(summary: &str, inside: &str) -> String {
    format!(
        "<details><summary>{}</summary>{inside}</details>\n",
        escape(summary)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_text() {
        assert_eq!(
            escape("<b a=\"1\">&'\u{7}é"),
            "&lt;b a=&quot;1&quot;&gt;&amp;&#39;\u{fffd}é"
        );
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1_234_567), "1\u{202f}234\u{202f}567");
        assert_eq!(number(1000), "<data value=\"1000\">1\u{202f}000</data>");
        assert!(size(1 << 40).contains("1.0 TiB"));
        assert_eq!(measure(Some(-0.123456789)), "-0.12346");
        assert_eq!(measure(Some(123456.789)), "123457");
        assert_eq!(measure(Some(1e-9)), "1.00000e-9");
        assert_eq!(measure(None), "–");
    }
}
