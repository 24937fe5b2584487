//! Columns of the table of components, and counts of the manifest.

use crate::breaks::pair;
use crate::naive::{Soup, parts};
use crate::{meshes, said, verdict_of};
use cornermill::folder::{self, Orient};
use cornermill::verify::Check;

/// Changes a column of the second of two components.
type Column = (&'static str, fn(&mut folder::ComponentRow));

#[test]
fn notices_every_column_of_the_table() {
    let columns: [Column; 18] = [
        ("first_triangle is 5", |r| r.first_triangle += 1),
        ("triangles is 5", |r| r.triangles += 1),
        ("flipped is 1", |r| r.flipped += 1),
        ("edges is 7", |r| r.edges += 1),
        ("border_edges is 1", |r| r.border_edges += 1),
        ("cut_edges is 1", |r| r.cut_edges += 1),
        ("orientable is 0", |r| r.orientable = 0),
        ("orientable is 255", |r| r.orientable = 255),
        ("closed is 0", |r| r.closed = 0),
        ("watertight is 0", |r| r.watertight = 0),
        ("outward is 0", |r| r.outward = 0),
        ("six_volume is 1.00001e0", |r| r.six_volume = 1.00001),
        ("six_volume is NaN", |r| r.six_volume = f64::NAN),
        ("six_volume is inf", |r| r.six_volume = f64::INFINITY),
        ("area is", |r| r.area *= 0.999_999),
        ("area is NaN", |r| r.area = f64::NAN),
        ("bbox_min[1] is 1e-9", |r| r.bbox_min[1] = 1e-9),
        ("bbox_max[0] is NaN", |r| r.bbox_max[0] = f64::NAN),
    ];
    for (says, change) in columns {
        let (soup, orient) = pair();
        let mut parts = parts(&soup, orient);
        change(&mut parts.rows[1]);
        let verdict = verdict_of(&parts);
        let found = said(&verdict);
        assert!(
            found.contains(&format!("components.npy: component 1: {says}")),
            "{says}:\n{found}"
        );
        assert!(verdict.count(Check::ComponentTable) > 0);
        assert!(!found.contains("component 0"), "{says}:\n{found}");
    }
}

#[test]
fn notices_wrong_measures_of_odd_meshes() {
    let row = |soup: Soup, change: fn(&mut folder::ComponentRow)| {
        let mut parts = parts(&soup, Orient::Outward);
        change(&mut parts.rows[0]);
        said(&verdict_of(&parts))
    };
    let mut bare = meshes::tetra();
    bare.g = None;
    let found = row(bare.clone(), |r| r.six_volume = 0.0);
    assert!(
        found.contains("six_volume is 0e0; expected NaN (there are no"),
        "{found}"
    );
    let found = row(bare, |r| r.bbox_min[2] = 0.0);
    assert!(
        found.contains("bbox_min[2] is 0e0; expected NaN"),
        "{found}"
    );
    let mut infinite = meshes::tetra();
    infinite.g.as_mut().unwrap()[2][2] = f64::INFINITY;
    let found = row(infinite, |r| r.area = 1.0);
    assert!(
        found.contains("area is 1e0; expected NaN (a vertex is not"),
        "{found}"
    );
    let found = row(meshes::moebius(9), |r| r.orientable = 1);
    assert!(found.contains("orientable is 1; expected 0"), "{found}");
    let found = row(meshes::fan(4), |r| r.watertight = 1);
    assert!(found.contains("watertight is 1; expected 0"), "{found}");
    let found = row(meshes::two_on_an_edge(), |r| r.watertight = 0);
    assert!(found.contains("watertight is 0; expected 1"), "{found}");
    // Coordinates that change nothing but the measures.
    let mut parts = parts(&meshes::torus(5, 4), Orient::Outward);
    parts.g.as_mut().unwrap()[3][1] += 0.125;
    let found = said(&verdict_of(&parts));
    assert!(
        found.contains("six_volume") && found.contains("area"),
        "{found}"
    );
}

#[test]
fn measures_hold_at_any_scale() {
    for scale in [1e-38, 1e-12, 1.0, 1e30] {
        for shift in [0.0, 1.0, 1e3] {
            let mut soup = meshes::flip(meshes::torus(8, 9), |t| t % 3 == 0);
            for p in soup.g.iter_mut().flatten() {
                *p = p.map(|x| f64::from((x + shift) as f32) * scale);
            }
            let verdict = verdict_of(&parts(&soup, Orient::Outward));
            assert!(verdict.ok(), "{scale} {shift}: {}", said(&verdict));
        }
    }
}

#[test]
fn notices_every_count() {
    let (soup, orient) = pair();
    let sound = parts(&soup, orient);
    let counts = serde_json::to_value(&sound.counts).unwrap();
    for key in counts.as_object().unwrap().keys() {
        if key == "polygons_fanned" {
            // The folder does not tell but their most.
            continue;
        }
        let mut wrong = counts.clone();
        let value = wrong[key].as_u64().unwrap();
        wrong[key] = (value + 1).into();
        let mut parts = sound.clone();
        parts.counts = serde_json::from_value(wrong).unwrap();
        let verdict = verdict_of(&parts);
        assert_eq!(
            said(&verdict),
            format!(
                "[counts] manifest.json: {key}: the count is {}; expected {value}\n",
                value + 1
            )
        );
    }
}

/// Each polygon left two triangles at least.
#[test]
fn notices_more_polygons_than_triangles_can_come_from() {
    let (soup, orient) = pair();
    let mut parts = parts(&soup, orient);
    let most = parts.counts.triangles / 2;
    parts.counts.polygons_fanned = most;
    assert!(verdict_of(&parts).ok());
    for wrong in [most + 1, u64::MAX] {
        parts.counts.polygons_fanned = wrong;
        assert_eq!(
            said(&verdict_of(&parts)),
            format!(
                "[counts] manifest.json: polygons_fanned: the count is {wrong}; expected at \
                 most {most}, half the number of triangles\n"
            )
        );
    }
}
