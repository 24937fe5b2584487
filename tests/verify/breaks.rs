//! A folder that is wrong in one way, and what must be said of it.

use crate::naive::{Parts, Soup, parts};
use crate::{check, meshes, said, verdict_of};
use cornermill::folder::Orient;
use cornermill::verify::{At, Check, Limits, least_memory};

/// A way to be wrong: the mesh, what is changed in its folder, and what must be found.
pub struct Break {
    name: &'static str,
    soup: Soup,
    orient: Orient,
    change: fn(&mut Parts),
    check: Check,
    at: At,
    /// The whole finding, as it is printed.
    says: &'static str,
}

pub fn broken(
    name: &'static str,
    (soup, orient): (Soup, Orient),
    change: fn(&mut Parts),
    (check, at): (Check, At),
    says: &'static str,
) -> Break {
    Break {
        name,
        soup,
        orient,
        change,
        check,
        at,
        says,
    }
}

/// Breaks it, and looks for the finding at ample and at least memory, in chunks of any size.
pub fn notice(case: &Break) {
    let sound = parts(&case.soup, case.orient);
    let measured = [Check::NonmanifoldVertices, Check::Duplicate].contains(&case.check);
    for (wide, plain) in [(false, false), (true, false), (true, true)] {
        let mut sound = sound.clone();
        sound.wide = wide;
        if plain && !measured {
            sound.measured = None;
        }
        let before = verdict_of(&sound);
        assert!(before.ok(), "{}: {}", case.name, said(&before));
        let mut parts = sound.clone();
        (case.change)(&mut parts);
        let dir = tempfile::tempdir().unwrap();
        parts.write(dir.path());
        let verdict = check(dir.path(), 64 << 20, 2, Limits::default()).unwrap();
        assert!(!verdict.ok(), "{}: not noticed", case.name);
        let told = verdict
            .findings
            .iter()
            .any(|f| (f.check, f.at, f.to_string().as_str()) == (case.check, case.at, case.says));
        assert!(told, "{}: not told in\n{}", case.name, said(&verdict));
        let limits = Limits {
            chunk: 8,
            ..Limits::default()
        };
        let other = check(dir.path(), least_memory(1), 1, limits).unwrap();
        assert_eq!(said(&other), said(&verdict), "{}", case.name);
    }
}

pub fn torus() -> (Soup, Orient) {
    (
        meshes::flip(meshes::torus(5, 4), |t| t % 7 == 3),
        Orient::Outward,
    )
}

pub fn strip() -> (Soup, Orient) {
    (meshes::strip_with_degenerate(), Orient::Outward)
}

pub fn hinge() -> (Soup, Orient) {
    (meshes::two_on_an_edge(), Orient::Outward)
}

pub fn pair() -> (Soup, Orient) {
    let soup = meshes::beside(&meshes::tetra(), &meshes::tetra(), [2., 0., 0.]);
    (soup, Orient::Outward)
}
