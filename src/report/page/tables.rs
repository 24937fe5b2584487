//! The tables: culprits with coordinates, components, files, counts, and what a build cost.
//!
//! Memory: a few rows of each. I/O: for each culprit that is named, its row of V and of G.

use super::cost::Cost;
use super::markup::{details, escape, grouped, measure, number, size, table};
use crate::error::{Error, Result};
use crate::folder::{self, Folder, Manifest, npy::DATA_START};
use crate::report::{NAMED, Report, first_ids, length};
use crate::table::array::{self, Coords, Width};

/// Reads single rows of a folder.
struct Places<'a> {
    folder: &'a Folder,
    width: Width,
    kind: Option<Coords>,
}

impl Places<'_> {
    fn new(folder: &Folder) -> Result<Places<'_>> {
        Ok(Places {
            folder,
            width: Width::of(folder)?,
            kind: Coords::of(folder)?,
        })
    }

    /// The coordinates of a vertex, as text.
    fn vertex(&self, v: u64) -> Result<String> {
        let n = self.folder.manifest().counts.vertices;
        let Some(kind) = self.kind.filter(|_| v < n) else {
            return Ok("–".into());
        };
        let file = array::open(self.folder, folder::G, kind.descr(), &[n, 3])?;
        let mut row = vec![0; kind.row_bytes()];
        let at = DATA_START + v * row.len() as u64;
        file.read_at(&mut row, at)?;
        let text = kind.row(&row, 0).map(|x| coordinate(kind, x));
        Ok(text.join(", "))
    }

    /// The vertices of a triangle.
    fn triangle(&self, list: &str, t: u64) -> Result<[u64; 3]> {
        let count = self.folder.manifest().counts.triangles;
        if t >= count {
            return Err(Error::input(
                &self.folder.path().join(list),
                "",
                format!("triangles below {count}"),
                t.to_string(),
                "the folder is damaged; `cornermill verify` says how; build it again",
            ));
        }
        let file = array::open(self.folder, folder::V, self.width.descr(), &[count, 3])?;
        let mut row = vec![0; 3 * self.width.bytes()];
        let at = DATA_START + t * row.len() as u64;
        file.read_at(&mut row, at)?;
        Ok([0, 1, 2].map(|k| self.width.get(&row, k)))
    }
}

/// A coordinate in the fewest digits that give its bits back.
fn coordinate(kind: Coords, x: f64) -> String {
    let plain = x == 0.0 || !x.is_finite() || (1e-6..1e16).contains(&x.abs());
    match (kind, plain) {
        (Coords::F4, true) => (x as f32).to_string(),
        (Coords::F4, false) => format!("{:e}", x as f32),
        (Coords::F8, true) => x.to_string(),
        (Coords::F8, false) => format!("{x:e}"),
    }
}

/// "the first 8 of 1 234", or "all 3".
fn part(shown: usize, all: u64) -> String {
    if shown as u64 == all {
        format!("all {}", grouped(all))
    } else {
        format!("the first {shown} of {}", grouped(all))
    }
}

/// The section of culprits.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Input`] when the folder was changed.
pub(super) fn culprits(folder: &Folder, report: &Report) -> Result<String> {
    let places = Places::new(folder)?;
    let parts = [
        nonmanifold_edges(&places, report)?,
        vertices(&places)?,
        triangles(&places, "Degenerate triangles", folder::DEGENERATE)?,
        triangles(&places, "Duplicate triangles", folder::DUPLICATE)?,
        components(
            "Components that cannot be oriented",
            &report.culprits.nonorientable_components,
        ),
        components(
            "Components that are not watertight, and so oriented by majority",
            &report.culprits.not_watertight_components,
        ),
    ];
    let mut all = parts.concat();
    if all.is_empty() {
        all.push_str("<p>There are none.</p>\n");
    }
    Ok(format!(
        "<section aria-labelledby=\"culprits\"><h2 id=\"culprits\">Culprits</h2>\
         <p class=\"soft\">Ids are those of the final table. The whole lists are in the folder.\
         </p>\n{all}</section>\n"
    ))
}

fn nonmanifold_edges(places: &Places, report: &Report) -> Result<String> {
    let edges = &report.culprits.nonmanifold_edges;
    if edges.is_empty() {
        return Ok(String::new());
    }
    let mut rows = Vec::new();
    for e in edges {
        rows.push([
            format!("{}, {}", number(e.lo), number(e.hi)),
            number(e.corners),
            number(e.first_corner / 3),
            places.vertex(e.lo)?,
            places.vertex(e.hi)?,
        ]);
    }
    let all = part(edges.len(), report.counts.nonmanifold_edges);
    Ok(table(
        &format!("Non-manifold edges: {all}"),
        [
            "Vertices",
            "Corners",
            "First triangle",
            "From x, y, z",
            "To x, y, z",
        ],
        rows,
    ))
}

fn vertices(places: &Places) -> Result<String> {
    let name = folder::NONMANIFOLD_VERTICES;
    let (ids, all) = (first_ids(places.folder, name)?, length(places.folder, name));
    if ids.is_empty() {
        return Ok(String::new());
    }
    let mut rows = Vec::new();
    for &v in &ids {
        rows.push([number(v), places.vertex(v)?]);
    }
    let caption = format!("Non-manifold vertices: {}", part(ids.len(), all));
    Ok(table(&caption, ["Vertex", "x, y, z"], rows))
}

fn triangles(places: &Places, what: &str, name: &str) -> Result<String> {
    let (ids, all) = (first_ids(places.folder, name)?, length(places.folder, name));
    if ids.is_empty() {
        return Ok(String::new());
    }
    let mut rows = Vec::new();
    for &t in &ids {
        let vertices = places.triangle(name, t)?;
        rows.push([
            number(t),
            vertices.map(number).join(", "),
            places.vertex(vertices[0])?,
        ]);
    }
    let caption = format!("{what}: {}", part(ids.len(), all));
    Ok(table(
        &caption,
        ["Triangle", "Vertices", "First at x, y, z"],
        rows,
    ))
}

fn components(what: &str, list: &[u64]) -> String {
    if list.is_empty() {
        return String::new();
    }
    let names: Vec<String> = list.iter().map(|&c| number(c)).collect();
    let part = if list.len() < NAMED {
        "all"
    } else {
        "the first"
    };
    format!(
        "<h3>{}: {part} {}</h3><p>{}</p>\n",
        escape(what),
        list.len(),
        names.join(", ")
    )
}

/// The section of the largest components.
pub(super) fn largest(report: &Report) -> String {
    let yes = |is: bool| if is { "yes" } else { "no" }.to_owned();
    let rows = report.largest.iter().map(|c| {
        [
            number(c.component),
            number(c.triangles),
            number(c.border_edges),
            yes(c.closed),
            yes(c.orientable),
            measure(c.volume),
            measure(c.area),
        ]
    });
    let heads = [
        "Component",
        "Triangles",
        "Border edges",
        "Closed",
        "Orientable",
        "Volume",
        "Area",
    ];
    let shown = part(report.largest.len(), report.counts.components);
    let caption = format!("By number of triangles: {shown}");
    format!(
        "<section aria-labelledby=\"components\"><h2 id=\"components\">Largest components</h2>\
         <p class=\"soft\">In input units. The volume of a component that is not watertight \
         depends on where it lies.</p>{}</section>\n",
        table(&caption, heads, rows)
    )
}

/// The section of files.
pub(super) fn files(report: &Report) -> String {
    let rows = report.arrays.iter().map(|a| {
        let shape: Vec<String> = a.shape.iter().map(|&n| grouped(n)).collect();
        let kind = if a.dtype.len() > 8 {
            "columns"
        } else {
            &a.dtype
        };
        [
            escape(&a.name),
            escape(kind),
            shape.join(" × "),
            size(a.bytes),
            a.bits_per_triangle
                .map_or("–".into(), |b| format!("{b:.2}")),
        ]
    });
    let heads = ["File", "Type", "Shape", "Size", "Bits per triangle"];
    format!(
        "<section aria-labelledby=\"files\"><h2 id=\"files\">Files</h2>{}</section>\n",
        table("The arrays of the folder", heads, rows)
    )
}

/// All counts of the manifest, behind a summary.
pub(super) fn counts(manifest: &Manifest) -> String {
    let value = serde_json::to_value(&manifest.counts).unwrap_or_default();
    let all = value.as_object().into_iter().flatten();
    let rows = all.map(|(key, n)| {
        let name = key.replace('_', " ");
        [escape(&name), number(n.as_u64().unwrap_or(0))]
    });
    details(
        "All counts",
        &table("Counts of the whole mesh", ["What", "How many"], rows),
    )
}

/// The section of what the build cost.
pub(super) fn cost(cost: &Cost) -> String {
    let rows = cost.passes.iter().map(|p| {
        [
            escape(&p.name),
            format!("{:.2}", p.seconds),
            size(p.read),
            size(p.written),
        ]
    });
    let resident = cost.peak_resident.map_or("–".into(), size);
    format!(
        "<section aria-labelledby=\"cost\"><h2 id=\"cost\">What the build cost</h2>\
         <p>{:.2} seconds in all; at most {resident} resident, {} of the budget and {} of \
         scratch space in use at once.</p>{}</section>\n",
        cost.seconds,
        size(cost.peak_budget),
        size(cost.peak_scratch),
        table("By pass", ["Pass", "Seconds", "Read", "Written"], rows)
    )
}
