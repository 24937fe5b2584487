//! The contraction against a walk over the graph that is too simple to be wrong.

use super::contract::{Contraction, Size, Swept};
use super::labels::{Labels, labels_of};
use super::union::Joins;
use crate::corner::Index;
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use crate::shuffle::Plan;
use proptest::prelude::*;
use std::sync::Arc;

type Link = (u64, u64, bool);

/// A graph under test.
#[derive(Clone, Debug)]
struct Graph {
    nodes: u64,
    links: Vec<Link>,
}

/// For each node its set and flip; for each set whether it contradicts itself.
#[derive(Debug, PartialEq)]
struct Answer {
    labels: Vec<(u64, bool)>,
    conflicts: Vec<bool>,
}

/// Walks from each node that no walk reached before, in ascending order.
fn walk(graph: &Graph) -> Answer {
    let mut near = vec![Vec::new(); graph.nodes as usize];
    for &(a, b, parity) in &graph.links {
        near[a as usize].push((b, parity));
        near[b as usize].push((a, parity));
    }
    let mut labels = vec![None; near.len()];
    let mut conflicts = Vec::new();
    for first in 0..near.len() {
        if labels[first].is_some() {
            continue;
        }
        let set = conflicts.len() as u64;
        let mut conflict = false;
        labels[first] = Some((set, false));
        let mut stack = vec![first];
        while let Some(at) = stack.pop() {
            let flip = labels[at].unwrap().1;
            for &(to, parity) in &near[at] {
                match labels[to as usize] {
                    None => {
                        labels[to as usize] = Some((set, flip ^ parity));
                        stack.push(to as usize);
                    }
                    Some((_, have)) => conflict |= have != flip ^ parity,
                }
            }
        }
        conflicts.push(conflict);
    }
    Answer {
        labels: labels.into_iter().map(Option::unwrap).collect(),
        conflicts,
    }
}

fn workspace(dir: &tempfile::TempDir, memory: u64) -> Workspace {
    let io = Arc::new(Counters::default());
    Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.path().to_owned()], u64::MAX, &io).unwrap(),
        io,
        workers: Workers::new(1).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

/// Reads the labels through ranges of some length; in a set with a conflict flips mean nothing.
fn read<W: Index>(ws: &Workspace, labels: &Labels<W>, nodes: u64, step: u64) -> Answer {
    let conflicts: Vec<bool> = (0..labels.components)
        .map(|set| labels.nonorientable.get(set))
        .collect();
    let mut range = labels.range(&ws.budget, step).unwrap();
    let label = |node: u64| {
        let start = node / step * step;
        range.load(start..(start + step).min(nodes)).unwrap();
        range.get(node)
    };
    Answer {
        labels: (0..nodes).map(label).collect(),
        conflicts,
    }
}

fn same(graph: &Graph, found: &Answer, expected: &Answer, what: &str) {
    assert_eq!(found.conflicts, expected.conflicts, "{what}: {graph:?}");
    for (node, (f, e)) in found.labels.iter().zip(&expected.labels).enumerate() {
        let flips_count = !expected.conflicts[e.0 as usize];
        let right = f.0 == e.0 && (f.1 == e.1 || !flips_count);
        assert!(right, "{what}: node {node} is {f:?}, not {e:?}: {graph:?}");
    }
}

/// Contracts in both widths and compares labels, ranges of them, questions in any order, counts.
fn check(graph: &Graph, size: &Size) -> Swept {
    let expected = walk(graph);
    let swept = contract::<u32>(graph, size, &expected);
    let wide = contract::<u64>(graph, size, &expected);
    assert_eq!((swept.sets, swept.links), (wide.sets, wide.links));
    swept
}

fn contract<W: Index>(graph: &Graph, size: &Size, expected: &Answer) -> Swept {
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 4 << 20);
    let feed = |contraction: &mut Contraction<W>| {
        for &(a, b, parity) in &graph.links {
            contraction.link(a, b, parity).unwrap();
        }
    };
    let mut contraction = Contraction::<W>::new(&ws, graph.nodes, *size).unwrap();
    feed(&mut contraction);
    let (labels, swept) = contraction.labels().unwrap();
    assert_eq!(labels.components, expected.conflicts.len() as u64);
    let found = read(&ws, &labels, graph.nodes, 13);
    same(graph, &found, expected, "labels");
    let asked: Vec<W> = (0..graph.nodes)
        .flat_map(|i| [i, (i * 7919 + 5) % graph.nodes])
        .map(W::of)
        .collect();
    let list = ws.scratch.file("nodes").unwrap();
    list.append(bytemuck::cast_slice(&asked)).unwrap();
    let plan = Plan {
        buckets: 3,
        buffer_bytes: 64,
        volume: size_of_val(&asked[..]) as u64,
    };
    let told = labels_of(&ws, &labels, (&list, graph.nodes), plan, 64 << 10).unwrap();
    let mut words = vec![W::NONE; asked.len()];
    told.read_at(bytemuck::cast_slice_mut(&mut words), 0)
        .unwrap();
    for (node, word) in asked.iter().zip(words) {
        let label = found.labels[node.wide() as usize];
        assert_eq!(word.wide(), label.0 << 1 | u64::from(label.1));
    }
    drop((labels, told, list));
    let mut joins = [None, Some(*size)].map(|s| Joins::<W>::new(&ws, graph.nodes, s).unwrap());
    for joins in &mut joins {
        for &(a, b, _) in &graph.links {
            joins.join(a, b).unwrap();
        }
    }
    let sets = joins.map(|joins| joins.sets().unwrap());
    assert_eq!(sets, [expected.conflicts.len() as u64; 2]);
    assert_eq!((ws.budget.used(), ws.scratch.used()), (0, 0));
    swept
}

/// The least of everything: runs of 2^shift nodes, relays of many levels.
fn tiny(shift: u32) -> Size {
    Size {
        shift,
        relay: 0,
        trees: 64 << 10,
        recent: 4,
    }
}

/// A number that looks random; the same for the same arguments.
fn hash(seed: u64, i: u64) -> u64 {
    let x = (seed ^ i.wrapping_mul(0x9E37_79B9_7F4A_7C15)).wrapping_mul(0xD134_2543_DE82_EF95);
    (x ^ x >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 20
}

/// The numbers below n in an order that looks random.
fn order(n: u64, seed: u64) -> Vec<u64> {
    let mut order: Vec<u64> = (0..n).collect();
    order.sort_by_key(|&i| hash(seed, i));
    order
}

const KINDS: [&str; 11] = [
    "nothing",
    "path",
    "star",
    "grid",
    "cubic",
    "clique",
    "pairs",
    "two of each",
    "bipartite",
    "comb",
    "random",
];

/// Links of a kind between about n nodes, numbered in order.
fn links(kind: &str, n: u64, seed: u64) -> Vec<(u64, u64)> {
    let side = n.isqrt().max(1);
    let all = |i: u64| (0..i).map(move |j| (j, i));
    match kind {
        "path" => (1..n).map(|i| (i - 1, i)).collect(),
        "star" => (1..n).map(|i| (0, i)).collect(),
        "grid" => (0..n)
            .flat_map(|i| [(i, i + 1), (i, i + side)])
            .filter(|&(i, j)| j < n && (j != i + 1 || j % side != 0))
            .collect(),
        "cubic" => (0..3)
            .flat_map(|round| {
                let order = order(n, seed + round);
                let pairs = order.chunks_exact(2).map(|p| (p[0], p[1]));
                pairs.collect::<Vec<_>>()
            })
            .collect(),
        "clique" => (0..side + 20).take(n as usize).flat_map(all).collect(),
        "pairs" => (0..n / 2).map(|i| (i, n - 1 - i)).collect(),
        "two of each" => (1..n).flat_map(|i| [(i / 2, i); 2]).collect(),
        "bipartite" => (0..side.min(n / 2))
            .flat_map(|i| (0..side.min(n / 2)).map(move |j| (i, n - 1 - j)))
            .collect(),
        "comb" => (1..n)
            .map(|i| (if i % 2 == 1 { i - 1 } else { i - 2 }, i))
            .collect(),
        "random" => (0..n)
            .map(|i| (hash(seed, i) % n, hash(!seed, i) % n))
            .collect(),
        _ => Vec::new(),
    }
}

/// A graph of a kind; nodes in order, reversed or renumbered at random. `wrong` links of a
/// thousand have the wrong parity, and as many nodes are linked to themselves with parity 1.
fn graph(kind: &str, n: u64, numbered: u8, wrong: u64, seed: u64) -> Graph {
    let names = match numbered {
        0 => (0..n).collect(),
        1 => (0..n).rev().collect(),
        2 => (0..n).map(|i| (i + n / 2) % n).collect(),
        _ => order(n, seed),
    };
    let flip = |i: u64| hash(seed, i) & 1 == 1;
    let mut found: Vec<Link> = links(kind, n, seed)
        .into_iter()
        .map(|(a, b)| {
            let wrong = hash(!seed, a ^ b << 20) % 1000 < wrong;
            let (x, y) = (names[a as usize], names[b as usize]);
            let parity = a != b && flip(x) ^ flip(y) ^ wrong;
            if hash(seed, a + b) & 1 == 0 {
                (x, y, parity)
            } else {
                (y, x, parity)
            }
        })
        .collect();
    let selves = (0..n).filter(|&i| hash(seed + 1, i) % 4000 < wrong);
    found.extend(selves.map(|i| (i, i, true)));
    found.sort_by_key(|&(a, b, _)| hash(seed, a << 32 | b));
    Graph {
        nodes: n,
        links: found,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn equals_a_walk(
        kind in prop::sample::select(&KINDS[..]),
        n in 1u64..700,
        numbered in 0u8..4,
        wrong in prop::sample::select(&[0u64, 0, 3, 100][..]),
        seed in any::<u32>(),
        shift in 0u32..8,
        recent in 0u32..8,
    ) {
        let size = Size { recent: 1 << recent, ..tiny(shift) };
        check(&graph(kind, n, numbered, wrong, seed.into()), &size);
    }

    #[test]
    fn equals_a_walk_for_any_links(
        nodes in 1u64..40,
        links in prop::collection::vec((any::<u64>(), any::<u64>(), any::<bool>()), 0..80),
        shift in 0u32..4,
    ) {
        let links = links.iter().map(|&(a, b, p)| (a % nodes, b % nodes, p)).collect();
        check(&Graph { nodes, links }, &tiny(shift));
    }

    #[test]
    fn sizes_fit_their_memory(
        wide in any::<bool>(),
        memory in 0u32..24,
        more in 0u64..1000,
        nodes in 0u64..1 << 40,
        small in 0u32..40,
    ) {
        let (width, nodes) = (if wide { 8 } else { 4 }, nodes >> small);
        let memory = (Size::least(width) << memory.min(14)) * (1000 + more) / 1000;
        let size = Size::within(memory, nodes, width);
        let run = (4 + 2 * width) << size.shift;
        let held = run + 2 * size.relay + size.trees + size.recent * 2 * width;
        prop_assert!(held <= memory, "{size:?} for {memory}");
    }
}

#[test]
fn nothing_is_no_set() {
    let graph = Graph {
        nodes: 0,
        links: Vec::new(),
    };
    let dir = tempfile::tempdir().unwrap();
    let ws = workspace(&dir, 4 << 20);
    let contraction = Contraction::<u32>::new(&ws, graph.nodes, tiny(3)).unwrap();
    let (labels, swept) = contraction.labels().unwrap();
    assert_eq!((labels.components, swept.stops), (0, 0));
}

/// A hub with more links than a run and all blocks of it hold, at each end and in the middle.
#[test]
fn hubs_are_streamed() {
    for numbered in 0..4 {
        let swept = check(&graph("star", 8_000, numbered, 0, 9), &tiny(4));
        assert_eq!((swept.stops, swept.sets), (500, 1));
        assert!(swept.poured > 8_000, "one level: {swept:?}");
        // The least hub's links wait at one stop; the largest takes each where it is.
        let crowded = if numbered == 0 { 7_900 } else { 500 };
        assert!(swept.crowd >= crowded, "{swept:?}");
    }
}

/// Each kind goes through many runs and levels, and sends few links on.
#[test]
fn large_graphs_of_every_kind() {
    for kind in KINDS {
        for numbered in [0, 1, 3] {
            for wrong in [0, 1] {
                let graph = graph(kind, 8_000, numbered, wrong, 4);
                let size = Size {
                    relay: 32 << 10,
                    recent: 256,
                    ..tiny(6)
                };
                let swept = check(&graph, &size);
                assert_eq!(swept.stops, 125);
                let most = 20 * graph.links.len() as u64;
                assert!(swept.resent <= most, "{kind} {numbered}: {swept:?}");
                if kind == "two of each" && numbered == 3 {
                    assert!(swept.dropped > 400, "{swept:?}");
                }
            }
        }
    }
}

/// One wrong link among twenty thousand is found wherever it is.
#[test]
fn one_conflict_is_found() {
    for at in [0, 1, 6_666, 19_998, 19_999] {
        for numbered in 0..4 {
            let mut graph = graph("grid", 20_000, numbered, 0, 4);
            let expected = walk(&graph);
            assert_eq!(expected.conflicts, [false]);
            graph.links.push((at, at, true));
            check(&graph, &tiny(7));
            graph.links.pop();
            let flip = expected.labels[at as usize].1 ^ expected.labels[7_000].1;
            graph.links.push((at, 7_000, !flip));
            assert_eq!(walk(&graph).conflicts, [true]);
            check(&graph, &tiny(7));
        }
    }
}
