//! Vertex stars, border loops and duplicates as naive as can be, from V and O.

use std::collections::{BTreeMap, BTreeSet};

const NONE: u64 = u64::MAX;

pub struct Stars {
    /// The fan of each corner, by its smallest corner; none in a degenerate triangle.
    pub fan: Vec<Option<usize>>,
    /// Vertices with more than one fan.
    pub nonmanifold: Vec<u64>,
    /// Triangles with the vertices of an earlier one.
    pub duplicate: Vec<u64>,
    /// Border loops.
    pub loops: usize,
    /// The loop of each corner without opposite, by a fan on it.
    pub loop_of: BTreeMap<usize, usize>,
}

/// Merges until nothing changes.
fn merged(mut label: Vec<usize>, pairs: &[(usize, usize)]) -> Vec<usize> {
    loop {
        let before = label.clone();
        for &(a, b) in pairs {
            let low = label[a].min(label[b]);
            (label[a], label[b]) = (low, low);
        }
        if label == before {
            return label;
        }
    }
}

fn beside(c: usize) -> [usize; 2] {
    [1, 2].map(|k| c / 3 * 3 + (c + k) % 3)
}

impl Stars {
    pub fn of(v: &[u64], o: &[u64]) -> Stars {
        let degenerate = |t: usize| {
            let t = &v[3 * t..3 * t + 3];
            t[0] == t[1] || t[1] == t[2] || t[2] == t[0]
        };
        let mut linked = Vec::new();
        for c in (0..v.len()).filter(|&c| o[c] != NONE) {
            for a in beside(c) {
                let same = beside(o[c] as usize).into_iter().filter(|&b| v[a] == v[b]);
                linked.extend(same.map(|b| (a, b)));
            }
        }
        let fans = merged((0..v.len()).collect(), &linked);
        let fan: Vec<Option<usize>> = (0..v.len())
            .map(|c| (!degenerate(c / 3)).then_some(fans[c]))
            .collect();
        let mut at: BTreeMap<u64, BTreeSet<usize>> = BTreeMap::new();
        for c in 0..v.len() {
            at.entry(v[c]).or_default().extend(fan[c]);
        }
        let several = at.iter().filter(|(_, fans)| fans.len() > 1);
        let nonmanifold = several.map(|(&v, _)| v).collect();
        // Loops: fans joined by the edges without opposite.
        let open = (0..v.len()).filter(|&c| o[c] == NONE && !degenerate(c / 3));
        let open: Vec<usize> = open.collect();
        let ends: Vec<_> = open
            .iter()
            .map(|&c| beside(c).map(|x| fans[x]).into())
            .collect();
        let around = merged((0..v.len()).collect(), &ends);
        let loop_of: BTreeMap<usize, usize> = open
            .iter()
            .zip(&ends)
            .map(|(&c, end)| (c, around[end.0]))
            .collect();
        let loops = loop_of.values().collect::<BTreeSet<_>>().len();
        let (mut seen, mut duplicate) = (BTreeSet::new(), Vec::new());
        for t in (0..v.len() / 3).filter(|&t| !degenerate(t)) {
            let mut key = v[3 * t..3 * t + 3].to_vec();
            key.sort();
            if !seen.insert(key) {
                duplicate.push(t as u64);
            }
        }
        Stars {
            fan,
            nonmanifold,
            duplicate,
            loops,
            loop_of,
        }
    }
}
