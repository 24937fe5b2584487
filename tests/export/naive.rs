//! Selection and renumbering as plain as can be, and the comparison with what was read back.

use crate::by_hand::{Mesh, NONE};
use crate::parse::Parsed;
use cornermill::export::{ExportRequest, Format};
use std::collections::BTreeSet;

/// The triangles that a request chooses, by its words.
fn naive_choice(mesh: &Mesh, request: &ExportRequest) -> Vec<[u64; 3]> {
    let labels = mesh.labels();
    let count = labels
        .iter()
        .filter(|&&l| l != NONE)
        .max()
        .map_or(0, |l| l + 1);
    let size = |c: u64| labels.iter().filter(|&&l| l == c).count() as u64;
    let mut chosen: Vec<u64> = (0..count).collect();
    let selection = &request.selection;
    chosen.retain(|&c| selection.components.as_ref().is_none_or(|list| list.has(c)));
    chosen.retain(|&c| selection.min_triangles.is_none_or(|least| size(c) >= least));
    chosen.sort_by_key(|&c| (u64::MAX - size(c), c));
    chosen.truncate(selection.largest.unwrap_or(u64::MAX) as usize);
    let none = selection.is_empty();
    let wanted = |t: usize| none || chosen.contains(&labels[t]);
    let turned = |t: usize| {
        let [a, b, c] = mesh.v[t];
        if request.input_orientation && mesh.flipped.contains(&(t as u64)) {
            [a, c, b]
        } else {
            [a, b, c]
        }
    };
    (0..mesh.v.len())
        .filter(|&t| wanted(t))
        .map(turned)
        .collect()
}

/// What the exported file must hold.
pub fn naive_export(mesh: &Mesh, request: &ExportRequest) -> (Vec<[f64; 3]>, Vec<[u64; 3]>) {
    let triangles = naive_choice(mesh, request);
    let stored = |v: u64| {
        let spot = mesh.g.as_ref().unwrap()[v as usize];
        let narrow = !mesh.f8 || request.format == Format::Stl;
        spot.map(|x| if narrow { f64::from(x as f32) } else { x })
    };
    if request.format == Format::Stl {
        let points = triangles.iter().flatten().map(|&v| stored(v)).collect();
        let ids = (0..triangles.len() as u64).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        return (points, ids.collect());
    }
    let mut vertices: Vec<u64> = (0..mesh.vertices).collect();
    if !request.selection.is_empty() {
        let named: BTreeSet<u64> = triangles.iter().flatten().copied().collect();
        vertices.retain(|v| named.contains(v));
    }
    let number = |v: u64| vertices.binary_search(&v).unwrap() as u64;
    let triangles = triangles.iter().map(|t| t.map(number)).collect();
    let points = vertices.iter().map(|&v| stored(v)).collect();
    (points, triangles)
}

pub fn assert_same(parsed: &Parsed, mesh: &Mesh, request: &ExportRequest) {
    let (mut points, triangles) = naive_export(mesh, request);
    if mesh.g.is_none() {
        points.clear();
    }
    assert_eq!(parsed.triangles, triangles, "{request:?}");
    // By bits, so that -0 and NaN count; digits of an f4 are read as one.
    let bits = |p: [f64; 3]| p.map(|x| if mesh.f8 { x } else { f64::from(x as f32) }.to_bits());
    assert_eq!(parsed.points.len(), points.len(), "{request:?}");
    for (i, (got, want)) in parsed.points.iter().zip(&points).enumerate() {
        assert_eq!(
            bits(*got),
            bits(*want),
            "{request:?} point {i}: {got:?} {want:?}"
        );
    }
}
