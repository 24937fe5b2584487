//! PLY: ascii and binary of both byte orders, decoded in one pass.
//!
//! The header says which elements follow, in any order, and what each row of them holds. A
//! [`Plan`] keeps of each element what the mesh needs and what has to be passed over; the
//! rows are then read by it, from text or from bytes. Counts only say when to stop.
//!
//! - `vertex` with x, y, z; `face` with a list `vertex_indices` or `vertex_index`, each list a
//!   polygon that is cut into its fan; `tristrips` with such a list, in which -1 starts the
//!   strip anew and every other triangle is turned, as strips are. Triangles of a strip are
//!   kept as they come, degenerate ones too; fewer than three corners make none.
//! - Coordinates are stored as f4, in a binary file as f8 when one of x, y, z is double or an
//!   integer of 4 bytes, which f4 does not hold.
//! - Range grids, and vertices without faces, are refused: they are no surfaces.
//! - Behind the last element nothing but white space may follow: more means that the counts of
//!   the header are wrong, and that faces would be lost.
//!
//! Memory: the header, the reader's and the sink's buffers. I/O: the input once; V and G once.
//! Source: Greg Turk, "The PLY Polygon File Format", 1994.

mod ascii;
mod binary;
mod count;
mod gather;
mod header;
mod lies;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_bad;

use super::reader::ByteReader;
use super::sink::MeshSink;
use super::{CoordKind, Mesh, Request};
use crate::disk::Workspace;
use crate::error::{Error, Result};
pub use count::count;
use header::{Element, Encoding, Header, Scalar, Shape};
pub(super) use lies::lies;
use std::path::Path;

/// Names of the list of a face's vertices.
const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// What to do with a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// Pass over a value.
    Skip(Scalar),
    /// Pass over a list.
    SkipList { count: Scalar, item: Scalar },
    /// Coordinate 0, 1 or 2.
    Coord(usize, Scalar),
    /// Corners of a polygon.
    Face { count: Scalar, item: Scalar },
    /// Corners of triangle strips.
    Strip { count: Scalar, item: Scalar },
}

/// What to do with the rows of an element.
#[derive(Debug)]
struct Plan {
    name: String,
    rows: u64,
    steps: Vec<Step>,
}

impl Plan {
    /// True when its rows are vertices.
    fn is_vertex(&self) -> bool {
        self.steps.iter().any(|s| matches!(s, Step::Coord(..)))
    }

    /// How a row is called in messages.
    fn row(&self, row: u64) -> String {
        format!("{} {row} of {}", self.name, self.rows)
    }
}

/// A header that was read and found to promise a mesh.
struct Outline {
    header: Header,
    plans: Vec<Plan>,
    /// The type that coordinates are stored as.
    kind: CoordKind,
}

impl Outline {
    fn read(reader: &mut ByteReader) -> Result<Outline> {
        let header = Header::read(reader)?;
        refuse_no_surface(reader.path(), &header.elements)?;
        let plans = header
            .elements
            .iter()
            .map(|e| plan(reader.path(), e))
            .collect::<Result<Vec<Plan>>>()?;
        let kind = match header.encoding {
            Encoding::Ascii => CoordKind::F4,
            _ => stored_kind(&plans),
        };
        Ok(Outline {
            header,
            plans,
            kind,
        })
    }
}

/// Decodes a PLY file.
///
/// # Errors
/// [`Error::Input`] naming line or byte, [`Error::Io`], [`Error::Budget`],
/// [`Error::DiskLimit`].
pub fn read(ws: &Workspace, mut reader: ByteReader, request: &Request) -> Result<Mesh> {
    let Outline {
        header,
        plans,
        kind,
    } = Outline::read(&mut reader)?;
    for (line, text) in &header.skipped {
        ws.progress.note(&format!(
            "{}: line {line} of the header is not understood and passed over: {text}",
            reader.path().display()
        ));
    }
    let mut sink = MeshSink::new(ws, request, reader.path(), kind)?;
    let reader = match header.encoding {
        Encoding::Ascii => ascii::read(ws, reader, header.next_line, &plans, &mut sink)?,
        Encoding::Little => binary::read(reader, false, &plans, &mut sink)?,
        Encoding::Big => binary::read(reader, true, &plans, &mut sink)?,
    };
    sink.finish(ws, "ply", reader.finish()?)
}

/// The type that holds every coordinate exactly.
fn stored_kind(plans: &[Plan]) -> CoordKind {
    let mut steps = plans.iter().flat_map(|p| &p.steps);
    let wide = steps.any(|s| matches!(s, Step::Coord(_, scalar) if !scalar.fits_f4()));
    if wide { CoordKind::F8 } else { CoordKind::F4 }
}

/// Refuses what is no triangle mesh, saying what it is.
fn refuse_no_surface(path: &Path, elements: &[Element]) -> Result<()> {
    let has = |name: &str| elements.iter().any(|e| e.name == name);
    let bad = |found: &str, help: &str| {
        let expected = "a mesh: an element `vertex` and an element `face` or `tristrips`";
        Err(Error::input(path, "", expected, found, help))
    };
    if has("range_grid") {
        return bad(
            "a range grid (the depths that a scanner saw from one place, without faces)",
            "make a mesh of it with the scanner's software first",
        );
    }
    let names: Vec<String> = elements
        .iter()
        .map(|e| format!("{}: {}", e.name, e.count))
        .collect();
    let listed = match names.len() {
        0 => "no element at all".to_owned(),
        _ => names.join(", "),
    };
    let faces = has("face") || has("tristrips");
    if !has("vertex") {
        let what = if faces {
            "no vertices"
        } else {
            "no vertices and no faces"
        };
        return bad(&format!("{what} ({listed})"), "");
    }
    let count = |names: &[&str]| -> u128 {
        let of = elements.iter().filter(|e| names.contains(&e.name.as_str()));
        of.map(|e| u128::from(e.count)).sum()
    };
    // Point clouds are often written with an empty face element; an empty mesh has neither.
    if !faces || (count(&["face", "tristrips"]) == 0 && count(&["vertex"]) > 0) {
        return bad(
            &format!("a point cloud: vertices without faces ({listed})"),
            "make a surface of it first (Poisson or ball pivoting, for example)",
        );
    }
    Ok(())
}

fn plan(path: &Path, element: &Element) -> Result<Plan> {
    let bad = |expected: &str, found: &str| {
        let at = format!("element {}", element.name);
        let help = "the header is wrong or of a kind not known here";
        Error::input(path, at, expected, found, help)
    };
    let mut steps: Vec<Step> = Vec::with_capacity(element.properties.len());
    let mut wanted = Vec::new();
    for property in &element.properties {
        let role = match (element.name.as_str(), property.name.as_str()) {
            ("vertex", name) => ["x", "y", "z"].iter().position(|&c| c == name),
            ("face" | "tristrips", name) => INDICES.contains(&name).then_some(0),
            _ => None,
        };
        let step = match (role, property.shape) {
            (None, Shape::One(scalar)) => Step::Skip(scalar),
            (None, Shape::List { count, item }) => Step::SkipList { count, item },
            (Some(axis), Shape::One(scalar)) if element.name == "vertex" => {
                Step::Coord(axis, scalar)
            }
            (Some(_), Shape::List { count, item })
                if element.name != "vertex" && item.is_integer() =>
            {
                match element.name.as_str() {
                    "face" => Step::Face { count, item },
                    _ => Step::Strip { count, item },
                }
            }
            _ => {
                let found = format!("`{}` of type {}", property.name, property.shape);
                let what = "x, y, z that are no lists, vertex indices that are a list of integers";
                return Err(bad(what, &found));
            }
        };
        if let Some(role) = role {
            if wanted.contains(&role) {
                let found = format!("`{}` again", property.name);
                return Err(bad("each property once", &found));
            }
            wanted.push(role);
        }
        steps.push(step);
    }
    match (element.name.as_str(), wanted.len()) {
        ("vertex", 3) | ("face" | "tristrips", 1) => {}
        ("vertex", _) => return Err(bad("properties x, y and z", "not all of them")),
        ("face" | "tristrips", _) => {
            let what = "a list vertex_indices or vertex_index";
            return Err(bad(what, "no such property"));
        }
        _ => {}
    }
    Ok(Plan {
        name: element.name.clone(),
        rows: element.count,
        steps,
    })
}

/// The error of a vertex index below zero.
#[cold]
fn negative_index(path: &Path, at: String, found: i64) -> Error {
    let what = "an index of a vertex, 0 or more";
    let help = "the file is damaged, or made by a faulty program";
    Error::input(path, at, what, format!("{found}"), help)
}

/// What trailing bytes mean.
const TRAILING: &str =
    "the counts in the header do not agree with the data; correct them, or cut the rest off";
