//! The same verdict when next to nothing fits in memory.

use crate::naive::{NONE, Parts, Soup, parts};
use crate::{check, meshes, said};
use cornermill::folder::Orient;
use cornermill::verify::{Check, Limits, least_memory};

/// A mesh for which the least memory does not hold what the checks look at.
fn large() -> Soup {
    let mut soup = meshes::torus(330, 220);
    for i in 0..80 {
        let shift = [f64::from(i % 50) * 2.0, f64::from(i / 50) * 2.0, 10.0];
        soup = match i {
            0..60 => meshes::beside(&soup, &meshes::tetra(), shift),
            _ => meshes::beside(&soup, &meshes::moebius(20), shift),
        };
    }
    meshes::shuffled(&meshes::flip(soup, |t| t % 11 < 3), 5)
}

#[test]
fn finds_the_same_out_of_memory() {
    let mut parts = parts(&large(), Orient::Outward);
    let dir = tempfile::tempdir().unwrap();
    let verdicts = |parts: &Parts| {
        parts.write(dir.path());
        let small = check(dir.path(), least_memory(1), 1, Limits::default()).unwrap();
        let ample = check(dir.path(), 1 << 30, 2, Limits::default()).unwrap();
        assert_eq!(said(&small), said(&ample));
        (small, ample)
    };
    let (small, ample) = verdicts(&parts);
    assert!(small.ok(), "{}", said(&small));
    let spilt = small.checked;
    assert!(
        spilt.edge_runs > 10
            && spilt.link_ranges > 1
            && spilt.corner_ranges > spilt.link_ranges
            && spilt.far_corners > 0,
        "{spilt:?}"
    );
    let held = ample.checked;
    let ranges = (held.link_ranges, held.corner_ranges);
    assert!(ranges == (1, 1) && held.far_corners == 0, "{held:?}");
    // A triangle under the label of another component, and one opposite far away.
    let stray = parts.label.iter().rposition(|&l| l == 40).unwrap();
    parts.label[stray] = 0;
    let corner = parts.o.iter().rposition(|&o| o != NONE).unwrap();
    parts.o[corner] = 0;
    let (small, _) = verdicts(&parts);
    assert!(small.count(Check::Label) > 0 && small.count(Check::Opposite) == 1);
    assert!(said(&small).contains(&format!("component.npy: triangle {stray}: label 0")));
    assert!(said(&small).contains(&format!("O.npy: corner {corner}: O[{corner}] is 0")));
    // Two components under one label.
    parts
        .label
        .iter_mut()
        .filter(|l| **l == 50)
        .for_each(|l| *l = 3);
    let first = parts.label.iter().position(|&l| l == 3);
    let (small, _) = verdicts(&parts);
    assert_eq!(small.count(Check::Connected), 1);
    assert!(said(&small).contains(&format!(
        "label 3, but no path over regular edges leads to triangle {}",
        first.unwrap()
    )));
}
