//! A histogram as inline SVG: a bar for each class, its count beside it, logarithmic.
//!
//! Why logarithmic: the classes of a mesh differ by factors of thousands; a single culprit among
//! millions must show. The caption says so, and the table behind has the numbers.
//!
//! Memory: the text, for at most [`MOST_BARS`] bars. I/O: none.

use super::markup::{details, escape, grouped, number, table};
use std::fmt::Write;

/// A class: its name and how many are in it.
pub(super) struct Class {
    pub(super) name: String,
    pub(super) count: u64,
}

/// Most bars of a chart. More classes than that show in the table alone.
pub(super) const MOST_BARS: usize = 40;
const ROW: usize = 22;
/// Where bars begin and end, and how wide the chart is.
const LEFT: f64 = 100.0;
const RIGHT: f64 = 270.0;
const WIDTH: f64 = 360.0;

/// The chart and the table of the same numbers. `id` names its parts.
pub(super) fn histogram(id: &str, title: &str, heads: [&str; 2], classes: &[Class]) -> String {
    let shown = &classes[..classes.len().min(MOST_BARS)];
    let most = shown.iter().map(|c| c.count).max().unwrap_or(0);
    let height = ROW * shown.len() + 4;
    let mut out = format!(
        "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" \
         aria-labelledby=\"{id}-title {id}-desc\"><title id=\"{id}-title\">{}</title>\
         <desc id=\"{id}-desc\">{} classes; the fullest has {}. \
         The length of a bar is the logarithm of its count. The numbers are in the table below.\
         </desc>",
        escape(title),
        classes.len(),
        grouped(most)
    );
    // A count of 1 is to be seen too.
    let length = |count: u64| match count {
        0 => 0.0,
        n => (n as f64 * 2.0).ln() / (most as f64 * 2.0).ln() * (RIGHT - LEFT),
    };
    for (i, class) in shown.iter().enumerate() {
        let (y, bar) = (ROW * i + 3, length(class.count));
        let _ = write!(
            out,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\
             <rect x=\"{LEFT}\" y=\"{y}\" width=\"{bar:.1}\" height=\"{}\" rx=\"2\"/>\
             <text x=\"{:.1}\" y=\"{}\">{}</text>",
            LEFT - 6.0,
            y + 13,
            escape(&class.name),
            ROW - 5,
            LEFT + bar + 6.0,
            y + 13,
            grouped(class.count)
        );
    }
    out.push_str("</svg>\n");
    let rows = classes.iter().map(|c| [escape(&c.name), number(c.count)]);
    out.push_str(&details(
        &format!("{title}: the numbers"),
        &table(title, heads, rows),
    ));
    out
}

/// The name of a class from one number to another.
pub(super) fn range(from: u64, to: u64) -> String {
    if from == to {
        grouped(from)
    } else {
        format!("{}–{}", grouped(from), grouped(to))
    }
}
