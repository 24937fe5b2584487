//! The comparison of a mesh folder with the oracle's answer, array by array.

use super::folder::Folder;
use super::mesh::Mesh;
use super::naive::{self, Answer, Orient};
use super::npy::Npy;
use super::stars::Star;
use std::collections::BTreeMap;

/// The oracle's answer for the mesh in `folder`. The folder is asked only for the sign of components
/// too flat for the oracle to tell.
pub fn answer(folder: &Folder, mesh: &Mesh, has_positions: bool, orient: Orient) -> Answer {
    let flips = folder.flips();
    let outward = folder.components.counts("outward");
    let labels = folder.component.ids();
    let choice = |t: usize| (outward[labels[t] as usize] == 1, flips[t]);
    naive::solve(mesh, has_positions, orient, &choice)
}

/// Whatever in the folder is not as the oracle has it; `positions` are the input's, `index` is the
/// type of the ids.
pub fn differences(
    folder: &Folder,
    answer: &Answer,
    positions: Option<&[[f32; 3]]>,
    index: &str,
) -> Vec<String> {
    let mut wrong = Vec::new();
    compare_arrays(folder, answer, index, &mut wrong);
    compare_components(folder, answer, &mut wrong);
    compare_counts(folder, answer, &mut wrong);
    compare_stars(folder, answer, &mut wrong);
    compare_positions(folder, positions, &mut wrong);
    wrong
}

/// Coordinates must be kept to the bit, in the order of the input.
fn compare_positions(folder: &Folder, expected: Option<&[[f32; 3]]>, wrong: &mut Vec<String>) {
    let same = match (&folder.g, expected) {
        (None, None) => true,
        (Some(g), Some(p)) => {
            let coordinates = p.as_flattened().iter();
            let bytes: Vec<u8> = coordinates.flat_map(|x| x.to_le_bytes()).collect();
            g.dtype() == "f4" && g.shape == [p.len(), 3] && g.data == bytes
        }
        _ => false,
    };
    if !same {
        wrong.push("G differs from the input".into());
    }
}

/// Notes `name` when the two differ, with both.
fn same<T: PartialEq + std::fmt::Debug>(
    wrong: &mut Vec<String>,
    name: &str,
    found: T,
    expected: T,
) {
    if found != expected {
        wrong.push(format!(
            "{name}\n  found    {found:?}\n  expected {expected:?}"
        ));
    }
}

/// A column by name, and what it must hold for a row of the oracle.
type Column<Row> = (&'static str, fn(&Row) -> u64);

fn compare_arrays(folder: &Folder, answer: &Answer, index: &str, wrong: &mut Vec<String>) {
    let triangles = answer.v.len();
    same(wrong, "V", folder.v.ids(), answer.v.concat());
    same(wrong, "O", folder.o.ids(), answer.o.clone());
    same(
        wrong,
        "component",
        folder.component.ids(),
        answer.component.clone(),
    );
    same(wrong, "flipped", folder.flips(), answer.flipped.clone());
    same(
        wrong,
        "degenerate",
        folder.degenerate.ids(),
        answer.degenerate.clone(),
    );
    let corners = answer
        .nonmanifold_edges
        .iter()
        .flat_map(|e| e.1.clone())
        .collect();
    same(
        wrong,
        "nonmanifold_corners",
        folder.nonmanifold_corners.ids(),
        corners,
    );
    let columns: [Column<naive::CutEdge>; 4] = [
        ("lo", |e| e.0.0),
        ("hi", |e| e.0.1),
        ("corners", |e| e.1.len() as u64),
        ("first_corner", |e| e.1[0]),
    ];
    for (name, value) in columns {
        let expected = answer.nonmanifold_edges.iter().map(value).collect();
        same(wrong, name, folder.nonmanifold_edges.counts(name), expected);
    }
    same(
        wrong,
        "shape of V",
        folder.v.shape.clone(),
        vec![triangles, 3],
    );
    same(
        wrong,
        "shape of O",
        folder.o.shape.clone(),
        vec![triangles, 3],
    );
    for (name, array) in [
        ("V", &folder.v),
        ("O", &folder.o),
        ("component", &folder.component),
        ("nonmanifold_corners", &folder.nonmanifold_corners),
        ("degenerate", &folder.degenerate),
    ] {
        same(
            wrong,
            &format!("type of {name}"),
            array.dtype(),
            index.into(),
        );
    }
}

fn compare_components(folder: &Folder, answer: &Answer, wrong: &mut Vec<String>) {
    let columns: [Column<naive::Component>; 10] = [
        ("first_triangle", |c| c.members[0] as u64),
        ("triangles", |c| c.members.len() as u64),
        ("flipped", |c| c.flipped),
        ("edges", |c| c.edges),
        ("border_edges", |c| c.border_edges),
        ("cut_edges", |c| c.cut_edges),
        ("orientable", |c| c.orientable.into()),
        ("closed", |c| c.closed.into()),
        ("watertight", |c| c.watertight.into()),
        ("outward", |c| c.outward.into()),
    ];
    let table = &folder.components;
    for (name, value) in columns {
        let expected: Vec<u64> = answer.components.iter().map(value).collect();
        same(
            wrong,
            &format!("components.{name}"),
            table.counts(name),
            expected,
        );
    }
    let (volume, area) = (table.floats("six_volume"), table.floats("area"));
    let (low, high) = (table.floats("bbox_min"), table.floats("bbox_max"));
    let rows = answer
        .components
        .iter()
        .enumerate()
        .filter(|(i, _)| *i < volume.len());
    for (i, c) in rows {
        let close = |found: f64, expected: f64, slack: f64| {
            (found.is_nan() && expected.is_nan()) || (found - expected).abs() <= slack
        };
        if !close(volume[i][0], c.six_volume, c.volume_slack) {
            wrong.push(format!(
                "six_volume of {i}: {:?}, expected {}",
                volume[i], c.six_volume
            ));
        }
        if !close(area[i][0], c.area, c.area_slack) {
            wrong.push(format!("area of {i}: {:?}, expected {}", area[i], c.area));
        }
        if let Some([a, b]) = c.bounds {
            same(
                wrong,
                &format!("bbox of {i}"),
                (&low[i][..], &high[i][..]),
                (&a[..], &b[..]),
            );
        }
    }
}

fn compare_counts(folder: &Folder, answer: &Answer, wrong: &mut Vec<String>) {
    for (&name, &expected) in &answer.counts {
        match folder.count(name) {
            // A number that not every build computes.
            None if name == "components_joined" => {}
            found => same(wrong, name, found, Some(expected)),
        }
    }
}

fn compare_stars(folder: &Folder, answer: &Answer, wrong: &mut Vec<String>) {
    let stars = &answer.stars;
    let columns: [Column<Star>; 6] = [
        ("vertices", |s| s.vertices),
        ("fans", |s| s.fans),
        ("border_loops", |s| s.border_loops),
        ("euler", |s| s.euler as u64),
        ("genus", |s| s.genus as u64),
        ("is_smesh", |s| s.is_smesh.into()),
    ];
    for (name, value) in columns {
        let expected: Vec<u64> = stars.components.iter().map(value).collect();
        let what = format!("components.{name}");
        same(wrong, &what, folder.components.counts(name), expected);
    }
    let list = |name: &str| Npy::read(&folder.path.join(name)).ids();
    for (name, expected) in [
        ("nonmanifold_vertices.npy", &stars.nonmanifold_vertices),
        ("duplicate.npy", &stars.duplicate),
    ] {
        same(wrong, name, &list(name), expected);
    }
    let measures = &folder.manifest["measures"];
    for (&name, &expected) in &stars.measures {
        let what = format!("measures.{name}");
        same(wrong, &what, measures[name].as_i64(), Some(expected));
    }
    let class = |c: &serde_json::Value| ["from", "to", "vertices"].map(|key| c[key].as_u64());
    let found: Vec<_> = measures["valences"]
        .as_array()
        .map_or(vec![], |all| all.iter().map(class).collect());
    let mut classes = BTreeMap::new();
    for (&valence, &vertices) in &stars.valences {
        let power = 1 << valence.max(1).ilog2();
        let class = if valence < 64 {
            (valence, valence)
        } else {
            (power, 2 * power - 1)
        };
        *classes.entry(class).or_insert(0) += vertices;
    }
    let expected = classes
        .into_iter()
        .map(|((from, to), n)| [from, to, n].map(Some));
    same(wrong, "measures.valences", found, expected.collect());
}
