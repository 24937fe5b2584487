//! The numbers of the whole mesh in the manifest, against the recount.
//!
//! Memory, I/O: none.

use super::verdict::{At, Check, Findings};
use crate::folder::{Counts, MANIFEST, Measures, ValenceClass};

/// Compares fields of the same name; the compiler tells which fields are neither compared nor
/// left out.
macro_rules! each {
    ($equal:ident, $said:ident, $own:ident, $type:ident { $($field:ident),* } without $($out:ident),*) => {
        let $type { $($field,)* $($out: _),* } = $own;
        $($equal(stringify!($field), $said.$field.into(), (*$field).into());)*
    };
}

/// Compares every count of the manifest with the recount.
pub(super) fn check(findings: &Findings, said: &Counts, own: &Counts) {
    let equal = |key: &'static str, found: u64, expected: u64| {
        let at = At::Key(key);
        findings.equal(Check::Counts, MANIFEST, at, "the count", found, expected);
    };
    each!(equal, said, own, Counts {
        triangles, vertices, unreferenced_vertices, nonfinite_vertices, degenerate,
        distinct_edges, regular_edges, border_edges, nonmanifold_edges, nonmanifold_corners,
        inconsistent_edges, components, components_joined, nonorientable_components,
        closed_components, watertight_components, flipped_triangles, flipped_components
    } without polygons_fanned);
    // How many there were is not in the folder; but each has left two triangles at least.
    let (fanned, most) = (said.polygons_fanned, own.triangles / 2);
    if fanned > most {
        let at = At::Key("polygons_fanned");
        findings.add(Check::Counts, MANIFEST, at, || {
            let expected = format!("at most {most}, half the number of triangles");
            (format!("the count is {fanned}"), expected)
        });
    }
}

/// Compares every measure of the manifest with the recount.
pub(super) fn measures(findings: &Findings, said: &Measures, own: &Measures) {
    let equal = |key: &'static str, found: i128, expected: i128| {
        let (at, what) = (At::Key(key), "the measure");
        findings.equal(Check::Measures, MANIFEST, at, what, found, expected);
    };
    each!(equal, said, own, Measures {
        fans, border_loops, euler, nonmanifold_vertices, duplicate,
        components_joined_at_vertices, smesh_components, largest_valence
    } without valences);
    if said.valences == own.valences {
        return;
    }
    let classes = said.valences.iter().zip(&own.valences);
    let alike = classes.take_while(|(a, b)| a == b).count();
    let words = |class: Option<&ValenceClass>| match class {
        Some(class) => format!(
            "{} vertices of valence {} to {}",
            class.vertices, class.from, class.to
        ),
        None => "no more".into(),
    };
    findings.add(Check::Measures, MANIFEST, At::Key("valences"), || {
        let found = words(said.valences.get(alike));
        (
            format!("class {alike} is {found}"),
            words(own.valences.get(alike)),
        )
    });
}
