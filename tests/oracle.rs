//! `build` against the naive oracle, on the zoo and on hundreds of random meshes, in every mode of
//! orientation; then `verify` must accept each folder.
//!
//! The oracle (`common/naive.rs`) has tests of its own in `oracle_itself.rs`.

mod common;

use common::folder::Folder;
use common::formats::write_npy;
use common::mesh::Mesh;
use common::naive::{self, Answer, Orient};
use common::run::cornermill;
use common::{random::Random, zoo};
use std::path::Path;

/// How one case is run: what must not change the answer, and what does.
struct Case<'a> {
    mesh: &'a Mesh,
    has_positions: bool,
    orient: Orient,
    /// Options that must not show in the folder.
    indifferent: Vec<String>,
}

impl Case<'_> {
    /// Builds, compares every array with the oracle's, verifies. Gives how many components were
    /// too flat for the oracle to tell their sign.
    fn check(&self) -> usize {
        let dir = tempfile::tempdir().expect("a temporary directory");
        let out = dir.path().join("OUT.ct");
        self.build(dir.path(), &out);
        let folder = Folder::read(&out);
        let flips = folder.flips();
        let outward = folder.components.counts("outward");
        let labels = folder.component.ids();
        let choice = |t: usize| (outward[labels[t] as usize] == 1, flips[t]);
        let answer = naive::solve(self.mesh, self.has_positions, self.orient, &choice);
        let mut wrong = Vec::new();
        compare_arrays(&folder, &answer, &mut wrong);
        compare_components(&folder, &answer, &mut wrong);
        compare_counts(&folder, &answer, &mut wrong);
        self.compare_positions(&folder, &mut wrong);
        let verified = cornermill(["verify".as_ref(), out.as_os_str()]);
        if verified.code != 0 {
            wrong.push(format!("verify refuses: {verified}"));
        }
        let (how, triangles) = (self.orient.name(), &self.mesh.triangles);
        let name = format!("{} ({how}, {:?})", self.mesh.name, self.indifferent);
        assert!(
            wrong.is_empty(),
            "{name}:\n{}\nV = {triangles:?}",
            wrong.join("\n")
        );
        answer.unclear
    }

    fn build(&self, dir: &Path, out: &Path) {
        let (v, g) = write_npy(self.mesh, dir);
        let mut args = vec!["build".into(), v.into_os_string(), "-o".into(), out.into()];
        args.extend(
            [
                "--orient",
                self.orient.name(),
                "--quiet",
                "--memory",
                "64MiB",
            ]
            .map(Into::into),
        );
        if self.has_positions {
            args.extend(["--positions".into(), g.into_os_string()]);
        }
        args.extend(self.indifferent.iter().map(Into::into));
        cornermill(args).expect(0);
    }

    /// Coordinates must be kept to the bit, in the order of the input.
    fn compare_positions(&self, folder: &Folder, wrong: &mut Vec<String>) {
        let expected = self.has_positions.then_some(&self.mesh.positions);
        let same = match (&folder.g, expected) {
            (None, None) => true,
            (Some(g), Some(p)) => {
                let bytes: Vec<u8> = p
                    .as_flattened()
                    .iter()
                    .flat_map(|x| x.to_le_bytes())
                    .collect();
                g.dtype() == "f4" && g.shape == [p.len(), 3] && g.data == bytes
            }
            _ => false,
        };
        if !same {
            wrong.push("G differs from the input".into());
        }
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

fn compare_arrays(folder: &Folder, answer: &Answer, wrong: &mut Vec<String>) {
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
            "u4".into(),
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

/// Chunks and buckets of every size, every strategy: the answer must not show them.
fn indifferent(random: &mut Random) -> Vec<String> {
    let mut options = Vec::new();
    if random.chance(80) {
        let chunk = random.pick(&["1", "2", "3", "7", "16", "64"]);
        options.extend(["--chunk-triangles".into(), chunk.to_string()]);
    }
    if random.chance(50) {
        let buckets = random.pick(&["1", "2", "5", "64"]);
        options.extend(["--buckets".into(), buckets.to_string()]);
    }
    if random.chance(50) {
        let strategy = random.pick(&["memory", "contract", "contract"]);
        options.extend(["--strategy".into(), strategy.to_string()]);
    }
    options.extend([
        "--threads".into(),
        random.pick(&["1", "2", "3"]).to_string(),
    ]);
    options
}

/// The whole zoo in one mode: as it is, which the default mode alone does, and with some triangles
/// turned over, corners turned and all shuffled.
fn zoo_in(orient: Orient) {
    let mut random = Random::new(orient as u64);
    for mesh in zoo::all() {
        let mut disturbed = mesh.clone().renamed(&format!("{}, disturbed", mesh.name));
        disturbed.flip_some(&mut random, 40);
        disturbed.rotate_corners(&mut random);
        disturbed.shuffle(&mut random);
        let tame = (orient == Orient::Outward).then_some(&mesh);
        for mesh in tame.into_iter().chain([&disturbed]) {
            let indifferent = indifferent(&mut random);
            Case {
                mesh,
                has_positions: true,
                orient,
                indifferent,
            }
            .check();
        }
    }
}

#[test]
fn the_zoo_outward() {
    zoo_in(Orient::Outward);
}

#[test]
fn the_zoo_by_majority() {
    zoo_in(Orient::Majority);
}

#[test]
fn the_zoo_by_first_triangle() {
    zoo_in(Orient::First);
}

#[test]
fn the_zoo_kept_as_it_is() {
    zoo_in(Orient::Keep);
}

/// Random meshes of the seeds from `first`, each in the default mode or another.
fn random_meshes(first: u64, count: u64) {
    let mut unclear = 0;
    for seed in first..first + count {
        let mesh = &zoo::random(seed);
        let mut random = Random::new(!seed);
        let orient = match random.chance(60) {
            true => Orient::Outward,
            false => *random.pick(&Orient::ALL),
        };
        let (has_positions, indifferent) = (random.chance(85), indifferent(&mut random));
        unclear += Case {
            mesh,
            has_positions,
            orient,
            indifferent,
        }
        .check();
    }
    // Else the outward sign would go untested.
    assert!(
        unclear < count as usize / 4,
        "{unclear} signs that the oracle cannot tell"
    );
}

#[test]
fn random_meshes_from_0() {
    random_meshes(0, 100);
}

#[test]
fn random_meshes_from_1000() {
    random_meshes(1000, 100);
}

#[test]
fn random_meshes_from_2000() {
    random_meshes(2000, 100);
}
