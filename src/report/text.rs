//! The report as text for people.

use super::{Component, Report, arrays};
use crate::folder::{Counts, Manifest, Measures, Orient};
use std::fmt::Write;

/// Groups the digits of a count: 1234567 is "1 234 567".
pub(super) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(c);
    }
    text
}

pub(super) fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}

fn orient_name(orient: Orient) -> &'static str {
    match orient {
        Orient::Outward => "outward",
        Orient::Majority => "majority",
        Orient::First => "first",
        Orient::Keep => "keep",
    }
}

/// A line with a name and a count.
pub(super) fn line(out: &mut String, name: &str, count: u64, remark: &str) {
    let remark = if remark.is_empty() {
        String::new()
    } else {
        format!("  {remark}")
    };
    // Writing to a string cannot fail.
    let _ = writeln!(out, "  {name:<26}{:>15}{remark}", grouped(count));
}

fn counts(out: &mut String, c: &Counts) {
    line(out, "triangles", c.triangles, "");
    line(out, "vertices", c.vertices, "");
    line(out, "edges", c.distinct_edges, "");
    line(out, "  regular", c.regular_edges, "");
    line(out, "  border", c.border_edges, "");
    line(out, "  non-manifold", c.nonmanifold_edges, "");
    line(
        out,
        "inconsistent edges",
        c.inconsistent_edges,
        "in the input",
    );
    line(out, "components", c.components, "");
    line(out, "  joined at non-manifold", c.components_joined, "");
    line(out, "  closed", c.closed_components, "");
    line(out, "  watertight", c.watertight_components, "");
    line(out, "  not orientable", c.nonorientable_components, "");
    line(out, "flipped triangles", c.flipped_triangles, "");
    line(
        out,
        "flipped components",
        c.flipped_components,
        "as a whole",
    );
    for (name, count) in [
        ("degenerate triangles", c.degenerate),
        ("unreferenced vertices", c.unreferenced_vertices),
        ("non-finite vertices", c.nonfinite_vertices),
        ("polygons cut into fans", c.polygons_fanned),
    ] {
        line(out, name, count, "");
    }
}

/// What the vertices tell, when the folder was measured.
fn measures(out: &mut String, measures: Option<&Measures>) {
    let Some(m) = measures else {
        return;
    };
    line(out, "non-manifold vertices", m.nonmanifold_vertices, "");
    line(out, "duplicate triangles", m.duplicate, "");
    let loops = format!("Euler characteristic {}", m.euler);
    line(out, "border loops", m.border_loops, &loops);
    line(out, "fans", m.fans, "around vertices");
    line(out, "simple meshes", m.smesh_components, "among components");
    line(
        out,
        "components by vertices",
        m.components_joined_at_vertices,
        "joined at shared vertices",
    );
    let often = m.valences.iter().rev().max_by_key(|class| class.vertices);
    let remark = often.map_or(String::new(), |class| {
        let valence = if class.from == class.to {
            class.from.to_string()
        } else {
            format!("{} to {}", class.from, class.to)
        };
        format!("most often {valence}")
    });
    line(out, "largest valence", m.largest_valence, &remark);
}

/// What the manifest alone says: O(1).
pub fn info(manifest: &Manifest) -> String {
    let mut out = String::new();
    let coords = manifest.coords.as_deref().unwrap_or("none");
    let _ = writeln!(
        out,
        "mesh folder, version {}: from {}, indices {}, coordinates {coords}, orientation {}{}\n",
        manifest.version,
        manifest.input.format,
        manifest.index,
        orient_name(manifest.options.orient),
        if manifest.options.weld {
            ", welded"
        } else {
            ""
        },
    );
    counts(&mut out, &manifest.counts);
    measures(&mut out, manifest.measures.as_ref());
    out.push('\n');
    table_of_arrays(&mut out, &arrays(manifest));
    out
}

pub(super) fn table_of_arrays(out: &mut String, arrays: &[super::Array]) {
    let _ = writeln!(
        out,
        "  array                               bytes  bits/triangle"
    );
    for a in arrays {
        let bits = a
            .bits_per_triangle
            .map_or("-".into(), |b| format!("{b:.2}"));
        let _ = writeln!(out, "  {:<24}{:>17}{bits:>15}", a.name, grouped(a.bytes));
    }
}

/// The whole report.
pub fn render(report: &Report) -> String {
    let mut out = String::new();
    verdict(&mut out, report);
    counts(&mut out, &report.counts);
    measures(&mut out, report.measures.as_ref());
    culprits(&mut out, report);
    components(&mut out, report);
    out.push('\n');
    table_of_arrays(&mut out, &report.arrays);
    if let Some(build) = &report.build {
        let _ = writeln!(
            out,
            "\n  pass             seconds          read       written"
        );
        for p in &build.passes {
            let _ = writeln!(
                out,
                "  {:<14}{:>10.2}{:>14}{:>14}",
                p.name,
                p.seconds,
                megabytes(p.read),
                megabytes(p.written)
            );
        }
        let resident = build.peak_resident.map_or("unknown".into(), megabytes);
        let _ = writeln!(
            out,
            "\n  {:.2} s; peak resident {resident}, {} of the budget drawn, scratch {}",
            build.seconds,
            megabytes(build.peak_budget),
            megabytes(build.peak_scratch)
        );
    }
    out
}

/// One line that says how the mesh is.
fn verdict(out: &mut String, report: &Report) {
    let c = &report.counts;
    let pieces = match c.components {
        1 => "one component".to_owned(),
        n => format!("{} components", grouped(n)),
    };
    let closed = if c.components > 0 && c.closed_components == c.components {
        "closed"
    } else if c.components > 0 && c.watertight_components == c.components {
        "watertight"
    } else {
        "not closed"
    };
    let vertices = report.measures.as_ref().map(|m| m.nonmanifold_vertices);
    let manifold = match (c.nonmanifold_edges, vertices) {
        (0, None) => "no non-manifold edge",
        (0, Some(0)) => "manifold",
        (0, Some(_)) => "non-manifold vertices",
        _ => "non-manifold edges",
    };
    let oriented = match (report.options.orient, c.nonorientable_components) {
        (Orient::Keep, _) => "orientation kept",
        (_, 0) => "consistently oriented",
        _ => "not orientable in part",
    };
    let _ = writeln!(out, "{pieces}, {closed}, {manifold}, {oriented}\n");
}

/// The first culprits, and where the whole list is.
fn culprits(out: &mut String, report: &Report) {
    let c = &report.culprits;
    let ids = |list: &[u64]| -> String {
        let ids: Vec<String> = list.iter().map(u64::to_string).collect();
        ids.join(" ")
    };
    let edges: Vec<String> = c
        .nonmanifold_edges
        .iter()
        .map(|e| {
            format!(
                "{}-{} ({} corners, first {})",
                e.lo, e.hi, e.corners, e.first_corner
            )
        })
        .collect();
    let rows = [
        (
            "non-manifold edges",
            edges.join(", "),
            "nonmanifold_edges.npy",
        ),
        (
            "non-manifold vertices",
            ids(&c.nonmanifold_vertices),
            "nonmanifold_vertices.npy",
        ),
        ("degenerate triangles", ids(&c.degenerate), "degenerate.npy"),
        ("duplicate triangles", ids(&c.duplicate), "duplicate.npy"),
        (
            "components not orientable",
            ids(&c.nonorientable_components),
            "components.npy, orientable",
        ),
        (
            "components not watertight, by majority",
            ids(&c.not_watertight_components),
            "components.npy, watertight",
        ),
    ];
    if rows.iter().any(|(_, list, _)| !list.is_empty()) {
        out.push('\n');
    }
    for (name, list, file) in rows.iter().filter(|(_, list, _)| !list.is_empty()) {
        let _ = writeln!(out, "  first {name}: {list} (all in {file})");
    }
}

fn components(out: &mut String, report: &Report) {
    if report.counts.components < 2 {
        if let [only] = &report.largest[..] {
            out.push('\n');
            component(out, only);
        }
        return;
    }
    let _ = writeln!(out, "\n  largest components");
    report.largest.iter().for_each(|c| component(out, c));
    let _ = writeln!(
        out,
        "\n  triangles in a component         components      triangles"
    );
    for s in &report.sizes {
        let class = format!("{} to {}", grouped(s.from), grouped(s.to));
        let (components, triangles) = (grouped(s.components), grouped(s.triangles));
        let _ = writeln!(out, "  {class:<28}{components:>15}{triangles:>15}");
    }
}

fn component(out: &mut String, c: &Component) {
    let closed = if c.closed {
        "closed".to_owned()
    } else {
        format!("{} border edges", grouped(c.border_edges))
    };
    let number = |x: Option<f64>| x.map_or("unknown".into(), |x| format!("{x:.6e}"));
    let oriented = if c.orientable { "" } else { ", not orientable" };
    let _ = writeln!(
        out,
        "  {:>10}: {} triangles, {closed}{oriented}, volume {}, area {}",
        c.component,
        grouped(c.triangles),
        number(c.volume),
        number(c.area)
    );
    if let Some(m) = &c.measures {
        let smesh = if m.is_smesh { ", a simple mesh" } else { "" };
        let _ = writeln!(
            out,
            "              {} vertices, {} fans, {} border loops, genus {}{smesh}",
            grouped(m.vertices),
            grouped(m.fans),
            grouped(m.border_loops),
            m.genus
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped() {
        let shown: Vec<String> = [0, 999, 1000, 1234567].map(grouped).to_vec();
        assert_eq!(shown, ["0", "999", "1 000", "1 234 567"]);
    }
}
