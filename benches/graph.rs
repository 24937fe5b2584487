//! Joining 4M nodes over 6M links, numbered at random like the triangles of a shuffled torus: one
//! by one, in batches, and by contraction, each with the answer that must come out.
//! `cargo bench --bench graph`; with `--test` each runs once.

use cornermill::Result;
use cornermill::build::graph::contract::{Contraction, Size};
use cornermill::build::graph::forest::{Forest, Joined};
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use criterion::{Criterion, Throughput};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

/// Bits of a node's number.
const BITS: u32 = 22;
const NODES: u64 = 1 << BITS;
/// Squares of the torus in a row; each square is two triangles.
const WIDTH: u64 = 1 << 11;
const HEIGHT: u64 = NODES / 2 / WIDTH;

type Link = [u32; 2];

/// A permutation of the numbers below 2^bits that looks random.
fn mixed(x: u64, bits: u32) -> u64 {
    let mask = (1 << bits) - 1;
    let odd = [
        0x9E37_79B9_7F4A_7C15u64,
        0xBF58_476D_1CE4_E5B9,
        0x94D0_49BB_1331_11EB,
    ];
    odd.iter().fold(x & mask, |x, odd| {
        let x = x.wrapping_mul(*odd) & mask;
        x ^ x >> (bits / 2)
    })
}

/// Whether a node is flipped in truth.
fn flipped(node: u64) -> bool {
    mixed(node, BITS) & 1 == 1
}

/// Each link once, in random order: `2 * node + parity`, node.
fn links() -> Vec<Link> {
    let squares = (0..3u64).flat_map(|side| (0..NODES / 2).map(move |x| (side, x)));
    let link = |(side, x): (u64, u64)| {
        let lower = mixed(x ^ (side * 77), BITS - 1);
        let (i, j) = (lower % WIDTH, lower / WIDTH);
        let (i, j) = match side {
            0 => (i, j),
            1 => ((i + WIDTH - 1) % WIDTH, j),
            _ => (i, (j + HEIGHT - 1) % HEIGHT),
        };
        let a = mixed(2 * lower, BITS);
        let b = mixed(2 * (j * WIDTH + i) + 1, BITS);
        let parity = flipped(a) ^ flipped(b);
        [(a << 1) as u32 | u32::from(parity), b as u32]
    };
    squares.map(link).collect()
}

fn get(link: &Link) -> (u64, u64, bool) {
    (
        u64::from(link[0] >> 1),
        u64::from(link[1]),
        link[0] & 1 == 1,
    )
}

/// One set, flips as they are in truth.
fn check(label: impl Fn(u64) -> (u64, bool)) {
    for node in (0..NODES).step_by(997) {
        assert_eq!(label(node), (0, flipped(node) ^ flipped(0)));
    }
}

fn check_forest(mut forest: Forest<u32>) {
    assert_eq!(forest.number(), 1);
    let label = |node: u64| forest.words()[node as usize];
    check(|node| (u64::from(label(node) >> 1), label(node) & 1 == 1));
}

fn contract(dir: &Path, links: &[Link], memory: u64) -> Result<()> {
    let io = Arc::new(Counters::default());
    let ws = Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::new(&[dir.to_owned()], u64::MAX, &io)?,
        io,
        workers: Workers::new(1)?,
        progress: Arc::new(NoProgress),
    };
    let size = Size::within(memory / 8 * 7, NODES, 4);
    let mut graph = Contraction::<u32>::new(&ws, NODES, size)?;
    for link in links {
        let (a, b, parity) = get(link);
        graph.link(a, b, parity)?;
    }
    let (labels, swept) = graph.labels()?;
    assert_eq!((labels.components, swept.sets), (1, 1));
    assert!(swept.resent < 3 * NODES, "{swept:?}");
    let mut block = labels.range(&ws.budget, 1)?;
    for node in (0..NODES).step_by(99_991) {
        block.load(node..node + 1)?;
        assert_eq!(block.get(node), (0, flipped(node) ^ flipped(0)));
    }
    Ok(())
}

fn graph(c: &mut Criterion) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let links = links();
    let mut group = c.benchmark_group("join 4M nodes over 6M links");
    group
        .throughput(Throughput::Elements(links.len() as u64))
        .sample_size(10);
    group.bench_function("one by one", |b| {
        b.iter(|| {
            let mut forest = Forest::<u32>::new(NODES);
            for link in &links {
                let (a, b, parity) = get(link);
                let joined = forest.join(a, b, parity);
                assert!(!matches!(joined, Joined::Conflict(_)));
            }
            check_forest(black_box(forest));
        });
    });
    group.bench_function("in batches", |b| {
        b.iter(|| {
            let mut forest = Forest::<u32>::new(NODES);
            forest.join_all(&links, get, |root| panic!("a conflict at {root}"));
            check_forest(black_box(forest));
        });
    });
    for memory in [2u64, 16, 64] {
        group.bench_function(format!("contraction in {memory} MiB"), |b| {
            b.iter(|| contract(dir.path(), &links, memory << 20).expect("contracted"));
        });
    }
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    graph(&mut criterion);
    criterion.final_summary();
}
