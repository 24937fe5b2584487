//! What one wants to know first: closed? oriented? manifold? how many pieces? Each with its figure
//! and, when it is not as one hopes, where to look.
//!
//! Memory: the text. I/O: none; all of it is in the manifest.

use super::markup::{count, escape, number};
use crate::folder::{Counts, Manifest, Orient};
use crate::report::Report;

/// How a verdict stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stand {
    Good,
    Bad,
    /// Neither good nor bad.
    Note,
}

/// A question, the word that answers it, and what is behind.
struct Verdict {
    /// What programs call it.
    key: &'static str,
    question: &'static str,
    stand: Stand,
    word: String,
    figure: String,
}

impl Verdict {
    fn new(key: &'static str, question: &'static str, good: bool, figure: String) -> Verdict {
        Verdict {
            key,
            question,
            stand: if good { Stand::Good } else { Stand::Bad },
            word: if good { "✓ yes" } else { "✗ no" }.into(),
            figure,
        }
    }

    /// The same, or that it is not known.
    fn unless_unknown(self, unknown: bool) -> Verdict {
        if !unknown {
            return self;
        }
        Verdict {
            stand: Stand::Note,
            word: "not measured".into(),
            ..self
        }
    }

    fn html(&self) -> String {
        let class = match self.stand {
            Stand::Good => "good",
            Stand::Bad => "bad",
            Stand::Note => "note",
        };
        format!(
            "<li class=\"{class}\" id=\"verdict-{}\"><h3>{} <span class=\"word\">{}</span></h3>\
             <p>{}</p></li>\n",
            self.key,
            escape(self.question),
            self.word,
            self.figure
        )
    }
}

fn of(n: u64, all: u64) -> String {
    format!("{} of {}", number(n), count(all, "component", "components"))
}

/// The section.
pub(super) fn section(manifest: &Manifest, report: &Report) -> String {
    let all = [
        closed(&manifest.counts, report),
        oriented(&manifest.counts, report),
        manifold(manifest),
        watertight(&manifest.counts, report),
        pieces(manifest),
        clean(manifest),
        shape(manifest),
    ];
    let cards: String = all.iter().flatten().map(Verdict::html).collect();
    format!(
        "<section aria-labelledby=\"verdicts\"><h2 id=\"verdicts\">Verdicts</h2>\
         <ul class=\"cards\">\n{cards}</ul></section>\n"
    )
}

/// Links to the first components that a list names.
fn first(list: &[u64]) -> String {
    match list {
        [] => String::new(),
        _ => " <a href=\"#culprits\">Where?</a>".into(),
    }
}

fn closed(c: &Counts, report: &Report) -> Option<Verdict> {
    let good = c.closed_components == c.components;
    let open = report.largest.iter().any(|x| !x.closed);
    let place = if open {
        " <a href=\"#components\">Where?</a>"
    } else {
        ""
    };
    let figure = if good {
        "Every corner has an opposite: no border, no cut.".into()
    } else {
        format!(
            "{} closed; {} and {}.{place}",
            of(c.closed_components, c.components),
            count(c.border_edges, "border edge", "border edges"),
            count(
                c.nonmanifold_edges,
                "non-manifold edge",
                "non-manifold edges"
            ),
        )
    };
    (c.components > 0).then(|| Verdict::new("closed", "Closed?", good, figure))
}

fn oriented(c: &Counts, report: &Report) -> Option<Verdict> {
    let kept = report.options.orient == Orient::Keep && c.inconsistent_edges > 0;
    let good = c.nonorientable_components == 0 && !kept;
    let figure = if kept {
        format!(
            "Built with --orient keep: at {} the triangles disagree.",
            count(c.inconsistent_edges, "edge", "edges")
        )
    } else if good {
        format!(
            "Neighbours agree everywhere, or can be made to; {} disagreed in the input, and {} \
             turned over.",
            count(c.inconsistent_edges, "edge", "edges"),
            count(c.flipped_triangles, "triangle was", "triangles were"),
        )
    } else {
        format!(
            "{} cannot be oriented.{}",
            of(c.nonorientable_components, c.components),
            first(&report.culprits.nonorientable_components)
        )
    };
    (c.components > 0).then(|| Verdict::new("oriented", "Oriented?", good, figure))
}

fn manifold(manifest: &Manifest) -> Option<Verdict> {
    let c = &manifest.counts;
    let vertices = manifest.measures.as_ref().map(|m| m.nonmanifold_vertices);
    let good = c.nonmanifold_edges == 0 && vertices.unwrap_or(0) == 0;
    let edges = count(
        c.nonmanifold_edges,
        "non-manifold edge",
        "non-manifold edges",
    );
    let at = match vertices {
        Some(n) => count(n, "non-manifold vertex", "non-manifold vertices"),
        None => "vertices were not measured".into(),
    };
    let place = if good {
        ""
    } else {
        " <a href=\"#culprits\">Where?</a>"
    };
    let figure = format!("{edges}; {at}.{place}");
    let verdict = Verdict::new("manifold", "Manifold?", good, figure);
    Some(verdict.unless_unknown(good && vertices.is_none()))
}

fn watertight(c: &Counts, report: &Report) -> Option<Verdict> {
    let good = c.watertight_components == c.components;
    let figure = format!(
        "{} watertight: where orientable, their volume is a volume.{}",
        of(c.watertight_components, c.components),
        first(&report.culprits.not_watertight_components)
    );
    (c.components > 0).then(|| Verdict::new("watertight", "Watertight?", good, figure))
}

fn pieces(manifest: &Manifest) -> Option<Verdict> {
    let c = &manifest.counts;
    let mut figure = format!(
        "Joined across regular edges. Across non-manifold edges too: {}.",
        number(c.components_joined)
    );
    if let Some(m) = &manifest.measures {
        let joined = number(m.components_joined_at_vertices);
        figure.push_str(&format!(" At shared vertices: {joined}."));
    }
    Some(Verdict {
        key: "pieces",
        question: "How many pieces?",
        stand: if c.components == 1 {
            Stand::Good
        } else {
            Stand::Note
        },
        word: number(c.components),
        figure,
    })
}

fn clean(manifest: &Manifest) -> Option<Verdict> {
    let c = &manifest.counts;
    let duplicate = manifest.measures.as_ref().map(|m| m.duplicate);
    let bad = c.degenerate + c.nonfinite_vertices + duplicate.unwrap_or(0);
    let mut figure = format!(
        "{}, {}, {}",
        count(c.degenerate, "degenerate triangle", "degenerate triangles"),
        count(
            c.nonfinite_vertices,
            "vertex not finite",
            "vertices not finite"
        ),
        count(c.unreferenced_vertices, "unused vertex", "unused vertices"),
    );
    figure.push_str(", ");
    figure.push_str(&match duplicate {
        Some(n) => count(n, "duplicate triangle", "duplicate triangles"),
        None => "duplicates were not looked for".into(),
    });
    let place = if c.degenerate + duplicate.unwrap_or(0) > 0 {
        ". <a href=\"#culprits\">Where?</a>"
    } else {
        "."
    };
    figure.push_str(place);
    let verdict = Verdict::new("clean", "Free of flawed triangles?", bad == 0, figure);
    Some(verdict.unless_unknown(bad == 0 && duplicate.is_none()))
}

fn shape(manifest: &Manifest) -> Option<Verdict> {
    let m = manifest.measures.as_ref()?;
    Some(Verdict {
        key: "shape",
        question: "Holes",
        stand: if m.border_loops == 0 {
            Stand::Good
        } else {
            Stand::Note
        },
        word: count(m.border_loops, "loop", "loops"),
        figure: format!(
            "Loops of edges without an opposite. Euler characteristic {}; {} simple (closed, \
             orientable, manifold, of genus 0).",
            m.euler,
            of(m.smesh_components, manifest.counts.components)
        ),
    })
}
