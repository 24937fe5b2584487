//! The oracle: what the arrays of a mesh folder must hold, computed as naively as possible.
//!
//! Opposites come from comparing every corner with every other. The swirl and its orientation
//! recurse, as the original text has them. The opposites of the result are searched again in the
//! oriented table, so that no rule about flipping is shared with the program. Quadratic in time
//! and memory: for meshes of at most a few thousand triangles.

use super::mesh::Mesh;
use super::space::{Sign, Space, is_finite};
use super::stars::Stars;
use super::tables::Tables;
use std::collections::{BTreeMap, BTreeSet};

/// What `--orient` asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orient {
    Outward,
    Majority,
    First,
    Keep,
}

impl Orient {
    pub const ALL: [Orient; 4] = [
        Orient::Outward,
        Orient::Majority,
        Orient::First,
        Orient::Keep,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Orient::Outward => "outward",
            Orient::Majority => "majority",
            Orient::First => "first",
            Orient::Keep => "keep",
        }
    }
}

/// One row of `components.npy`, and how far the sums may differ.
#[derive(Debug, Clone)]
pub struct Component {
    pub members: Vec<usize>,
    pub flipped: u64,
    pub edges: u64,
    pub border_edges: u64,
    pub cut_edges: u64,
    pub orientable: bool,
    pub closed: bool,
    pub watertight: bool,
    /// Oriented by its signed volume.
    pub outward: bool,
    pub six_volume: f64,
    pub volume_slack: f64,
    pub area: f64,
    pub area_slack: f64,
    /// None when a vertex is not finite.
    pub bounds: Option<[[f64; 3]; 2]>,
}

/// A non-manifold edge and all its corners, ascending.
pub type CutEdge = ((u64, u64), Vec<u64>);

/// Everything that the folder must say.
pub struct Answer {
    pub v: Vec<[u64; 3]>,
    pub o: Vec<u64>,
    pub component: Vec<u64>,
    pub flipped: Vec<bool>,
    pub components: Vec<Component>,
    pub nonmanifold_edges: Vec<CutEdge>,
    pub degenerate: Vec<u64>,
    pub counts: BTreeMap<&'static str, u64>,
    pub stars: Stars,
    /// Components where the program's own choice of sign was taken.
    pub unclear: usize,
}

/// The program's choice of a component by first triangle: whether oriented outward, whether the
/// first triangle is flipped. Asked only where the sign is unclear.
pub type Choice<'a> = &'a dyn Fn(usize) -> (bool, bool);

pub fn next(c: usize) -> usize {
    c / 3 * 3 + (c + 1) % 3
}

pub fn previous(c: usize) -> usize {
    c / 3 * 3 + (c + 2) % 3
}

pub fn is_degenerate(t: &[u64; 3]) -> bool {
    t[0] == t[1] || t[1] == t[2] || t[2] == t[0]
}

/// The unordered vertex pair that each corner faces; none in a degenerate triangle.
pub fn faced_edges(v: &[[u64; 3]]) -> Vec<Option<(u64, u64)>> {
    let flat = v.as_flattened();
    let face = |c: usize| {
        let (a, b) = (flat[next(c)], flat[previous(c)]);
        (!is_degenerate(&v[c / 3])).then(|| (a.min(b), a.max(b)))
    };
    (0..flat.len()).map(face).collect()
}

/// For each corner, all corners that face its edge, itself included: the quadratic search.
pub fn incident_corners(v: &[[u64; 3]]) -> Vec<Vec<usize>> {
    let edges = faced_edges(v);
    let same = |c: usize| {
        let others = (0..edges.len()).filter(|&d| edges[c].is_some() && edges[c] == edges[d]);
        others.collect()
    };
    (0..edges.len()).map(same).collect()
}

/// The opposite of each corner: the other one, when there are exactly two.
pub fn opposites(incident: &[Vec<usize>]) -> Vec<Option<usize>> {
    let other = |(c, all): (usize, &Vec<usize>)| match all[..] {
        [a, b] => Some(if a == c { b } else { a }),
        _ => None,
    };
    incident.iter().enumerate().map(other).collect()
}

/// True when the triangles across corner `c` disagree in orientation.
pub fn parity(v: &[[u64; 3]], c: usize, opposite: usize) -> bool {
    let flat = v.as_flattened();
    flat[next(c)] != flat[previous(opposite)]
}

struct Swirl<'a> {
    v: &'a [[u64; 3]],
    opposite: &'a [Option<usize>],
    /// Whether a reached triangle must be turned over to agree with the first.
    turned: Vec<Option<bool>>,
    members: Vec<usize>,
    orientable: bool,
}

impl Swirl<'_> {
    fn visit(&mut self, t: usize, turned: bool) {
        self.turned[t] = Some(turned);
        self.members.push(t);
        for c in 3 * t..3 * t + 3 {
            let Some(d) = self.opposite[c] else { continue };
            let wanted = turned ^ parity(self.v, c, d);
            match self.turned[d / 3] {
                None => self.visit(d / 3, wanted),
                Some(found) => self.orientable &= found == wanted,
            }
        }
    }
}

/// The components in the order of their first triangles: members ascending, whether each must be
/// turned over to agree with the first, and whether that is possible at all.
pub fn swirl(v: &[[u64; 3]], opposite: &[Option<usize>]) -> Vec<(Vec<(usize, bool)>, bool)> {
    let turned = vec![None; v.len()];
    let mut swirl = Swirl {
        v,
        opposite,
        turned,
        members: vec![],
        orientable: true,
    };
    let mut components = Vec::new();
    for (t, corners) in v.iter().enumerate() {
        if swirl.turned[t].is_none() && !is_degenerate(corners) {
            (swirl.members, swirl.orientable) = (vec![], true);
            swirl.visit(t, false);
            swirl.members.sort();
            let turned = |&t: &usize| (t, swirl.turned[t] == Some(true));
            components.push((swirl.members.iter().map(turned).collect(), swirl.orientable));
        }
    }
    components
}

/// How many groups of triangles any shared edge joins, however many triangles it has.
pub fn joined_components(v: &[[u64; 3]], incident: &[Vec<usize>]) -> usize {
    let mut label: Vec<usize> = (0..v.len()).collect();
    for all in incident {
        for &c in all {
            let (keep, drop) = (label[all[0] / 3], label[c / 3]);
            label
                .iter_mut()
                .filter(|l| **l == drop)
                .for_each(|l| *l = keep);
        }
    }
    let real = |t: &usize| !is_degenerate(&v[*t]);
    (0..v.len())
        .filter(real)
        .map(|t| label[t])
        .collect::<BTreeSet<_>>()
        .len()
}

/// No border, and at each edge with more than two corners as many of the component's own corners
/// run one way as the other.
pub fn is_watertight(v: &[[u64; 3]], incident: &[Vec<usize>], members: &[usize]) -> bool {
    let flat = v.as_flattened();
    let runs_up = |c: usize| flat[next(c)] < flat[previous(c)];
    members.iter().flat_map(|t| 3 * t..3 * t + 3).all(|c| {
        let own: Vec<_> = incident[c]
            .iter()
            .filter(|d| members.contains(&(*d / 3)))
            .collect();
        let up = own.iter().filter(|d| runs_up(***d)).count();
        match incident[c].len() {
            1 => false,
            2 => true,
            _ => 2 * up == own.len(),
        }
    })
}

/// What is asked, and all that the choice of orientation needs.
struct Question<'a> {
    input: Vec<[u64; 3]>,
    /// Empty when the mesh is given as V alone.
    positions: Vec<[f64; 3]>,
    orient: Orient,
    space: Space,
    choice: Choice<'a>,
}

/// A component oriented: whether to turn over the orientation of its first triangle, none to
/// leave every triangle as it was.
struct Verdict {
    inverted: Option<bool>,
    outward: bool,
    unclear: bool,
}

impl Question<'_> {
    /// `members` come with whether they must be turned over to agree with the first.
    fn orient(&self, members: &[(usize, bool)], orientable: bool) -> Verdict {
        let by = |inverted, outward| Verdict {
            inverted,
            outward,
            unclear: false,
        };
        let majority = members.iter().filter(|m| m.1).count() * 2 > members.len();
        match self.orient {
            Orient::Keep => by(None, false),
            _ if !orientable => by(None, false),
            Orient::First => by(Some(false), false),
            Orient::Majority => by(Some(majority), false),
            Orient::Outward => match self.sign(members) {
                Sign::Zero => by(Some(majority), false),
                Sign::Positive => by(Some(false), true),
                Sign::Negative => by(Some(true), true),
                Sign::Unclear => {
                    let (outward, first_flipped) = (self.choice)(members[0].0);
                    Verdict {
                        inverted: Some(first_flipped),
                        outward,
                        unclear: true,
                    }
                }
            },
        }
    }

    /// The sign of the volume in the orientation of the first triangle; zero where none counts.
    fn sign(&self, members: &[(usize, bool)]) -> Sign {
        let mut coherent = self.input.clone();
        members
            .iter()
            .filter(|m| m.1)
            .for_each(|&(t, _)| coherent[t].swap(1, 2));
        let ids: Vec<usize> = members.iter().map(|m| m.0).collect();
        if self.positions.is_empty()
            || !is_watertight(&coherent, &incident_corners(&coherent), &ids)
        {
            return Sign::Zero;
        }
        let corners = corner_positions(&coherent, &ids, &self.positions);
        match corners.as_flattened().iter().all(is_finite) {
            true => self.space.sign(&corners),
            false => Sign::Zero,
        }
    }
}

/// The whole answer. A mesh given without its positions, as V alone, has the vertices up to the
/// largest id, and nothing in it can be oriented outward.
pub fn solve(mesh: &Mesh, has_positions: bool, orient: Orient, choice: Choice) -> Answer {
    let input: Vec<[u64; 3]> = mesh.triangles.iter().map(|t| t.map(u64::from)).collect();
    let positions: Vec<[f64; 3]> = match has_positions {
        true => mesh.positions.iter().map(|p| p.map(f64::from)).collect(),
        false => vec![],
    };
    let vertices = match has_positions {
        true => positions.len() as u64,
        false => input.as_flattened().iter().max().map_or(0, |v| v + 1),
    };
    let opposite = opposites(&incident_corners(&input));
    let found = swirl(&input, &opposite);
    let inconsistent = inconsistent_edges(&input, &opposite);

    let space = Space::of(&positions);
    let question = Question {
        input,
        positions,
        orient,
        space,
        choice,
    };
    let verdict = |(members, orientable): &(Vec<_>, bool)| question.orient(members, *orientable);
    let verdicts: Vec<Verdict> = found.iter().map(verdict).collect();

    let Question {
        input: mut v,
        positions,
        space,
        ..
    } = question;
    let mut flipped = vec![false; v.len()];
    for ((members, _), verdict) in found.iter().zip(&verdicts) {
        if let Some(inverted) = verdict.inverted {
            members
                .iter()
                .for_each(|&(t, turned)| flipped[t] = turned ^ inverted);
        }
    }
    (0..v.len())
        .filter(|&t| flipped[t])
        .for_each(|t| v[t].swap(1, 2));
    let outward = verdicts.iter().map(|v| v.outward).collect();
    let tables = Tables {
        v,
        flipped,
        found,
        outward,
        positions,
        vertices,
        space,
    };
    let mut answer = tables.describe();
    answer.counts.insert("inconsistent_edges", inconsistent);
    answer.unclear = verdicts.iter().filter(|v| v.unclear).count();
    answer
}

/// Regular edges whose two triangles disagree, each counted once.
fn inconsistent_edges(v: &[[u64; 3]], opposite: &[Option<usize>]) -> u64 {
    let odd = |(c, d): (usize, &Option<usize>)| d.is_some_and(|d| c < d && parity(v, c, d));
    opposite
        .iter()
        .enumerate()
        .filter(|pair| odd(*pair))
        .count() as u64
}

pub fn corner_positions(
    v: &[[u64; 3]],
    members: &[usize],
    positions: &[[f64; 3]],
) -> Vec<[[f64; 3]; 3]> {
    members
        .iter()
        .map(|&t| v[t].map(|id| positions[id as usize]))
        .collect()
}
