//! What the oracle's oriented table says about itself: opposites, components, counts, all searched
//! and counted anew from its V.

use super::folder::NONE;
use super::naive::{Answer, Component, CutEdge, corner_positions, faced_edges, incident_corners};
use super::naive::{is_degenerate, is_watertight, joined_components, opposites};
use super::space::{Space, area, is_finite};
use super::stars::stars;
use std::collections::{BTreeMap, BTreeSet};

/// The oriented table, from which all the rest is counted anew.
pub struct Tables {
    pub v: Vec<[u64; 3]>,
    pub flipped: Vec<bool>,
    pub found: Vec<(Vec<(usize, bool)>, bool)>,
    pub outward: Vec<bool>,
    pub positions: Vec<[f64; 3]>,
    pub vertices: u64,
    pub space: Space,
}

impl Tables {
    pub fn describe(self) -> Answer {
        let incident = incident_corners(&self.v);
        let opposite = opposites(&incident);
        let o = opposite
            .iter()
            .map(|d| d.map_or(NONE, |d| d as u64))
            .collect();
        let mut component = vec![NONE; self.v.len()];
        let mut components = Vec::new();
        for (label, (members, orientable)) in self.found.iter().enumerate() {
            let ids: Vec<usize> = members.iter().map(|m| m.0).collect();
            ids.iter().for_each(|&t| component[t] = label as u64);
            components.push(self.component(&incident, ids, *orientable, self.outward[label]));
        }
        let degenerate = (0..self.v.len()).filter(|&t| is_degenerate(&self.v[t]));
        let degenerate: Vec<u64> = degenerate.map(|t| t as u64).collect();
        let nonmanifold_edges = nonmanifold_edges(&self.v, &incident);
        let mut counts = self.counts(&components, &incident);
        counts.insert("degenerate", degenerate.len() as u64);
        let stars = stars(&self.v, &opposite, &components, self.vertices);
        Answer {
            stars,
            v: self.v,
            o,
            component,
            flipped: self.flipped,
            components,
            nonmanifold_edges,
            degenerate,
            counts,
            unclear: 0,
        }
    }

    fn component(
        &self,
        incident: &[Vec<usize>],
        ids: Vec<usize>,
        orientable: bool,
        outward: bool,
    ) -> Component {
        let with = |n: fn(usize) -> bool| {
            let corners = ids.iter().flat_map(|t| 3 * t..3 * t + 3);
            corners.filter(|&c| n(incident[c].len())).count() as u64
        };
        let (border_edges, paired, cut_edges) =
            (with(|n| n == 1), with(|n| n == 2), with(|n| n > 2));
        let closed = border_edges + cut_edges == 0;
        let corners = match self.positions.is_empty() {
            true => vec![],
            false => corner_positions(&self.v, &ids, &self.positions),
        };
        let points = corners.as_flattened();
        let finite = !points.is_empty() && points.iter().all(is_finite);
        let (six_volume, volume_slack) = self.space.six_volume(&corners);
        let area = corners.iter().map(area).sum::<f64>();
        let pick = |f: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|i| points.iter().map(|p| p[i]).reduce(f).unwrap_or(f64::NAN))
        };
        Component {
            flipped: ids.iter().filter(|&&t| self.flipped[t]).count() as u64,
            edges: paired / 2 + border_edges + cut_edges,
            border_edges,
            cut_edges,
            orientable,
            closed,
            watertight: closed || is_watertight(&self.v, incident, &ids),
            outward,
            six_volume: if finite { six_volume } else { f64::NAN },
            volume_slack,
            area: if finite { area } else { f64::NAN },
            area_slack: ids.len() as f64 * self.space.extent.powi(2) * 4e-9 + area * 1e-9,
            bounds: finite.then(|| [pick(f64::min), pick(f64::max)]),
            members: ids,
        }
    }

    fn counts(
        &self,
        components: &[Component],
        incident: &[Vec<usize>],
    ) -> BTreeMap<&'static str, u64> {
        let faced = faced_edges(&self.v);
        let edges: BTreeMap<_, _> = (0..incident.len())
            .filter_map(|c| faced[c].map(|edge| (edge, incident[c].len())))
            .collect();
        let of_size = |n: fn(usize) -> bool| edges.values().filter(|k| n(**k)).count() as u64;
        let that = |f: fn(&Component) -> bool| components.iter().filter(|c| f(c)).count() as u64;
        let used: BTreeSet<_> = self.v.as_flattened().iter().collect();
        let wholly = |c: &Component| c.flipped == c.members.len() as u64;
        BTreeMap::from([
            ("triangles", self.v.len() as u64),
            ("vertices", self.vertices),
            ("unreferenced_vertices", self.vertices - used.len() as u64),
            ("distinct_edges", edges.len() as u64),
            ("regular_edges", of_size(|n| n == 2)),
            ("border_edges", of_size(|n| n == 1)),
            ("nonmanifold_edges", of_size(|n| n > 2)),
            (
                "nonmanifold_corners",
                incident.iter().filter(|all| all.len() > 2).count() as u64,
            ),
            ("components", components.len() as u64),
            (
                "components_joined",
                joined_components(&self.v, incident) as u64,
            ),
            ("nonorientable_components", that(|c| !c.orientable)),
            ("closed_components", that(|c| c.closed)),
            ("watertight_components", that(|c| c.watertight)),
            (
                "flipped_triangles",
                self.flipped.iter().filter(|f| **f).count() as u64,
            ),
            ("flipped_components", that(wholly)),
            (
                "nonfinite_vertices",
                self.positions.iter().filter(|p| !is_finite(p)).count() as u64,
            ),
            ("polygons_fanned", 0),
        ])
    }
}

fn nonmanifold_edges(v: &[[u64; 3]], incident: &[Vec<usize>]) -> Vec<CutEdge> {
    let edges = faced_edges(v);
    let mut cut = BTreeMap::new();
    for (c, all) in incident.iter().enumerate().filter(|(_, all)| all.len() > 2) {
        let corners = all.iter().map(|&c| c as u64).collect();
        cut.insert(
            edges[c].expect("a corner among three faces an edge"),
            corners,
        );
    }
    cut.into_iter().collect()
}
