//! `build` against the naive oracle, on the zoo and on hundreds of random meshes, in every mode of
//! orientation; then `verify` must accept each folder.
//!
//! The oracle (`common/naive.rs`) has tests of its own in `oracle_itself.rs`.

mod common;

use common::compare;
use common::folder::Folder;
use common::formats::write_npy;
use common::mesh::Mesh;
use common::naive::Orient;
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
        let answer = compare::answer(&folder, self.mesh, self.has_positions, self.orient);
        let positions = self.has_positions.then_some(&self.mesh.positions[..]);
        let mut wrong = compare::differences(&folder, &answer, positions, "u4");
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
