//! What only measured folders have: columns, lists, numbers of the whole mesh.

use crate::breaks::{broken, notice};
use crate::naive::{Parts, Soup, parts};
use crate::{check, meshes, said};
use cornermill::folder::{self, ComponentMeasures, Manifest, Measures, Orient, ValenceClass};
use cornermill::verify::{At, Check, Limits, Verdict, least_memory};

/// The verdict at the least memory, in chunks of eight triangles.
fn tight(parts: &Parts) -> Verdict {
    tight_with(parts, |_| {})
}

fn tight_with(parts: &Parts, change: impl FnOnce(&mut Manifest)) -> Verdict {
    let dir = tempfile::tempdir().unwrap();
    parts.write_with(dir.path(), change);
    // For manifests that name a list which a plain folder does not have.
    let copy = dir.path().join(folder::DUPLICATE);
    if !copy.exists() {
        std::fs::copy(dir.path().join(folder::DEGENERATE), copy).unwrap();
    }
    let limits = Limits {
        chunk: 8,
        ..Limits::default()
    };
    check(dir.path(), least_memory(1), 1, limits).unwrap()
}

/// Everything that measures tell apart: two tetrahedra at one vertex, a torus, a strip with
/// holes and a degenerate triangle, a Moebius strip, doubled triangles, a vertex without any.
pub fn medley() -> Soup {
    let mut soup = meshes::two_at_a_vertex();
    for other in [
        meshes::torus(5, 4),
        meshes::strip_with_degenerate(),
        meshes::moebius(8),
        meshes::doubled(),
        meshes::fan(5),
        meshes::wheel(90),
    ] {
        soup = meshes::beside(&soup, &other, [9., 0., 0.]);
    }
    soup
}

/// In both orders, with ids of either width.
fn both_orders(mut each: impl FnMut(&Parts)) {
    for soup in [medley(), meshes::shuffled(&medley(), 7)] {
        let mut parts = parts(&soup, Orient::Outward);
        for wide in [false, true] {
            parts.wide = wide;
            let verdict = tight(&parts);
            assert!(verdict.ok(), "{}", said(&verdict));
            each(&parts);
        }
    }
}

#[test]
fn the_medley_is_one() {
    let whole = parts(&medley(), Orient::Outward).measured.unwrap().whole;
    assert_eq!(whole.nonmanifold_vertices, 1 + 4 + 2);
    assert_eq!(whole.duplicate, 4);
    assert!(whole.border_loops > 5 && whole.smesh_components == 2);
    assert_eq!(whole.largest_valence, 90);
}

#[test]
fn notices_every_measured_column() {
    type Column = (&'static str, fn(&mut ComponentMeasures));
    let columns: [Column; 11] = [
        ("vertices is ", |m| m.vertices += 1),
        ("fans is ", |m| m.fans -= 1),
        ("fans is 18446744073709551615", |m| m.fans = u64::MAX),
        ("border_loops is ", |m| m.border_loops += 1),
        ("euler is ", |m| m.euler -= 2),
        ("euler is -9223372036854775808", |m| m.euler = i64::MIN),
        ("euler is 9223372036854775807", |m| m.euler = i64::MAX),
        ("genus is ", |m| m.genus += 1),
        ("genus is 18446744073709551615", |m| m.genus = u64::MAX),
        ("is_smesh is ", |m| m.is_smesh = 1 - m.is_smesh),
        ("is_smesh is 255", |m| m.is_smesh = 255),
    ];
    both_orders(|sound| {
        for component in [0, 2, sound.rows.len() - 1] {
            for (says, change) in columns {
                let mut parts = sound.clone();
                change(&mut parts.measures().rows[component]);
                let verdict = tight(&parts);
                let found = said(&verdict);
                let says = format!("components.npy: component {component}: {says}");
                assert!(found.contains(&says), "{says}:\n{found}");
                let total = verdict.totals.as_slice();
                assert_eq!(total, [(Check::ComponentTable, 1)], "{says}:\n{found}");
            }
        }
    });
}

#[test]
fn notices_every_measure_of_the_mesh() {
    both_orders(|sound| {
        let whole = sound.measured.as_ref().unwrap().whole.clone();
        let whole = serde_json::to_value(&whole).unwrap();
        for key in whole.as_object().unwrap().keys() {
            if key == "valences" {
                continue;
            }
            let mut wrong = whole.clone();
            let value = wrong[key].as_i64().unwrap();
            wrong[key] = (value + 1).into();
            let mut parts = sound.clone();
            parts.measures().whole = serde_json::from_value(wrong).unwrap();
            let says = format!(
                "[measures] manifest.json: {key}: the measure is {}; expected {value}\n",
                value + 1
            );
            assert_eq!(said(&tight(&parts)), says);
        }
    });
}

#[test]
fn notices_every_change_of_the_valences() {
    type Change = (&'static str, fn(&mut Vec<ValenceClass>));
    let changes: [Change; 6] = [
        ("class 1 is ", |v| v[1].vertices += 1),
        ("class 0 is 1 vertices of valence 0 to 1;", |v| v[0].to = 1),
        ("class 0 is ", |v| *v = v[1..].to_vec()),
        (
            "is no more; expected 1 vertices of valence 64 to 127\n",
            |v| v.truncate(v.len() - 1),
        ),
        ("class 0 is ", |v| v.swap(0, 1)),
        ("expected no more\n", |v| {
            v.push(ValenceClass {
                from: 128,
                to: 255,
                vertices: 0,
            });
        }),
    ];
    both_orders(|sound| {
        for (says, change) in changes {
            let mut parts = sound.clone();
            change(&mut parts.measures().whole.valences);
            let verdict = tight(&parts);
            let found = said(&verdict);
            let start = "[measures] manifest.json: valences: class ";
            assert!(
                found.starts_with(start) && found.contains(says),
                "{says}:\n{found}"
            );
            assert_eq!(verdict.totals, [(Check::Measures, 1)]);
        }
    });
}

#[test]
fn notices_every_change_of_the_lists() {
    type Pick = (Check, &'static str, fn(&mut Parts) -> &mut Vec<u64>);
    let lists: [Pick; 2] = [
        (
            Check::NonmanifoldVertices,
            "nonmanifold_vertices.npy",
            |p| &mut p.measures().vertices,
        ),
        (Check::Duplicate, "duplicate.npy", |p| {
            &mut p.measures().duplicate
        }),
    ];
    type Change = (&'static str, fn(&mut Vec<u64>));
    let changes: [Change; 7] = [
        ("first left out", |l| *l = l[1..].to_vec()),
        ("last left out", |l| l.truncate(l.len() - 1)),
        ("all left out", |l| l.clear()),
        ("one more", |l| l.push(l[l.len() - 1] + 1)),
        ("far beyond", |l| l.push(5_000)),
        ("twice", |l| l.insert(1, l[0])),
        ("in disorder", |l| l.swap(0, 1)),
    ];
    both_orders(|sound| {
        for (check, file, list) in lists {
            for (name, change) in changes {
                let mut parts = sound.clone();
                change(list(&mut parts));
                let verdict = tight(&parts);
                let found = said(&verdict);
                assert!(
                    verdict.totals.len() == 1 && verdict.count(check) > 0,
                    "{file}, {name}:\n{found}"
                );
                assert!(found.contains(&format!("] {file}: ")), "{found}");
            }
        }
    });
}

#[test]
fn tells_what_is_wrong_with_a_list() {
    let two = || (meshes::two_at_a_vertex(), Orient::Outward);
    let doubled = || (meshes::doubled(), Orient::Outward);
    notice(&broken(
        "a vertex of two fans not listed",
        two(),
        |p| p.measures().vertices.clear(),
        (Check::NonmanifoldVertices, At::Vertex(0)),
        "nonmanifold_vertices.npy: vertex 0: not listed (it has 2 fans); \
         expected all vertices with more than one fan, ascending",
    ));
    notice(&broken(
        "a vertex of one fan listed",
        two(),
        |p| p.measures().vertices.push(3),
        (Check::NonmanifoldVertices, At::Row(1)),
        "nonmanifold_vertices.npy: row 1: vertex 3; \
         expected only vertices with more than one fan, ascending",
    ));
    notice(&broken(
        "a duplicate not listed",
        doubled(),
        |p| p.measures().duplicate.retain(|&t| t != 5),
        (Check::Duplicate, At::Triangle(5)),
        "duplicate.npy: triangle 5: not listed (an earlier one has its vertices); \
         expected all triangles with the three vertices of an earlier one, ascending",
    ));
    notice(&broken(
        "the earlier one listed",
        doubled(),
        |p| p.measures().duplicate[0] = 0,
        (Check::Duplicate, At::Row(0)),
        "duplicate.npy: row 0: triangle 0; \
         expected only triangles with the three vertices of an earlier one, ascending",
    ));
}

#[test]
fn notices_folders_that_are_half_measured() {
    let sound = parts(&medley(), Orient::Outward);
    let mut plain = sound.clone();
    plain.measured = None;
    for (name, verdict) in [
        (
            "no measures",
            tight_with(&sound, |manifest| manifest.measures = None),
        ),
        (
            "measures alone",
            tight_with(&plain, |manifest| {
                manifest.measures = Some(Measures::default());
            }),
        ),
        (
            "no list of duplicates",
            tight_with(&sound, |manifest| {
                manifest.files.retain(|f| f.name != folder::DUPLICATE);
            }),
        ),
        (
            "no list of vertices",
            tight_with(&sound, |manifest| {
                let list = folder::NONMANIFOLD_VERTICES;
                manifest.files.retain(|f| f.name != list);
            }),
        ),
        (
            "a list in a plain folder",
            tight_with(&plain, |manifest| {
                let list = manifest.files.iter().find(|f| f.name == folder::DEGENERATE);
                let mut list = list.unwrap().clone();
                list.name = folder::DUPLICATE.into();
                manifest.files.push(list);
            }),
        ),
        (
            "another type of ids",
            tight_with(&sound, |manifest| {
                let list = manifest.files.iter_mut();
                let list = list.filter(|f| f.name == folder::DUPLICATE);
                list.for_each(|f| f.dtype = "<u8".into());
            }),
        ),
    ] {
        assert!(!verdict.ok() && !verdict.complete, "{name}");
        assert!(
            verdict.count(Check::Manifest) > 0,
            "{name}:\n{}",
            said(&verdict)
        );
    }
}

#[test]
fn accepts_any_random_mesh() {
    for seed in 0..400 {
        let mut random = meshes::generator(seed + 1);
        let (triangles, vertices) = (1 + random(120) as usize, 3 + random(60));
        let mut parts = parts(&meshes::random(seed, triangles, vertices), Orient::Outward);
        parts.wide = seed % 2 == 0;
        let verdict = tight(&parts);
        assert!(verdict.ok(), "seed {seed}:\n{}", said(&verdict));
    }
}

/// A vertex with more triangles than the least memory has room for.
#[test]
fn a_hub_needs_no_more_memory() {
    for soup in [
        meshes::wheel(60_000),
        meshes::shuffled(&meshes::wheel(60_000), 3),
    ] {
        let mut parts = parts(&soup, Orient::Outward);
        let verdict = tight(&parts);
        assert!(verdict.ok(), "{}", said(&verdict));
        assert!(verdict.checked.corner_ranges > 2);
        parts.measures().whole.largest_valence += 1;
        parts.measures().rows[0].fans += 1;
        let verdict = tight(&parts);
        assert_eq!(
            verdict.totals,
            [(Check::ComponentTable, 1), (Check::Measures, 1)]
        );
    }
}

/// An edge with thousands of triangles, each a component, each there twice.
#[test]
fn a_book_of_twins() {
    for soup in [meshes::book(1500), meshes::shuffled(&meshes::book(1500), 5)] {
        let mut parts = parts(&soup, Orient::Outward);
        let verdict = tight(&parts);
        assert!(verdict.ok(), "{}", said(&verdict));
        let measured = parts.measures();
        assert_eq!(measured.duplicate.len(), 1500);
        measured.duplicate.remove(700);
        measured.vertices.clear();
        let verdict = tight(&parts);
        assert_eq!(verdict.count(Check::Duplicate), 1);
        assert!(verdict.count(Check::NonmanifoldVertices) > 1);
    }
}

/// So many vertices that an id does not fit beside the bits of a narrow record.
#[test]
fn ids_of_four_bytes_beyond_two_to_the_thirtieth() {
    for most in [(1 << 30) - 1, 1 << 30, (1 << 30) + 9] {
        let mut soup = meshes::doubled();
        soup.g = None;
        soup.n = most;
        for v in &mut soup.v {
            *v = v.map(|v| most - 1 - v);
        }
        let mut parts = parts(&soup, Orient::Outward);
        let verdict = tight(&parts);
        assert!(verdict.ok(), "{}", said(&verdict));
        parts.measures().duplicate.remove(2);
        assert_eq!(tight(&parts).totals, [(Check::Duplicate, 1)]);
    }
}
