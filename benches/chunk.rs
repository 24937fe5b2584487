//! The chunk kernels on one chunk of 128K triangles: local ids, pairing, swirl, measures, each
//! with the answer that must come out. `cargo bench --bench chunk`; with `--test` each runs once.
//!
//! The chunk is a sheet of 256 x 256 quads, each cut in two, on the plane x + y + z = 512 and
//! numbered row by row. Every fourth row of quads is flipped, so that parities are not all
//! alike; the vertices of the lowest and the highest row are the seam, as in the midst of a
//! coherent mesh. Everything about it has a closed form.

use cornermill::chunk::grid::{Bounds, Grid};
use cornermill::chunk::ids::LocalIds;
use cornermill::chunk::measure::{Measure, Measurer};
use cornermill::chunk::pair::Pairs;
use cornermill::chunk::swirl::Swirl;
use criterion::{Criterion, Throughput};
use std::hint::black_box;

/// Quads along each side.
const SIDE: u32 = 256;
const TRIANGLES: u64 = 2 * (SIDE as u64) * (SIDE as u64);
const VERTICES: usize = (SIDE as usize + 1) * (SIDE as usize + 1);
/// The mesh's id of the chunk's first vertex.
const FIRST: u32 = 1_000_000;
/// One row of quads in so many is flipped: the last.
const PERIOD: u32 = 4;
const FLIPPED: u64 = TRIANGLES / PERIOD as u64;

/// Local vertex of each corner.
fn corners() -> Vec<u32> {
    let vertex = |i: u32, j: u32| j * (SIDE + 1) + i;
    let mut corners = Vec::new();
    for j in 0..SIDE {
        for i in 0..SIDE {
            let [a, b] = [vertex(i, j), vertex(i + 1, j)];
            let [c, d] = [vertex(i, j + 1), vertex(i + 1, j + 1)];
            for mut triangle in [[a, b, d], [a, d, c]] {
                if j % PERIOD == PERIOD - 1 {
                    triangle.swap(1, 2);
                }
                corners.extend(triangle);
            }
        }
    }
    corners
}

/// Coordinates by local vertex.
fn positions() -> Vec<[f32; 3]> {
    let point = |v: u32| [v % (SIDE + 1), v / (SIDE + 1)];
    (0..VERTICES as u32)
        .map(|v| {
            let [x, y] = point(v);
            [x as f32, y as f32, (2 * SIDE - x - y) as f32]
        })
        .collect()
}

/// Whether each local vertex is a seam vertex.
fn rim() -> Vec<bool> {
    let row = SIDE as usize + 1;
    let last = VERTICES - row;
    (0..VERTICES).map(|v| v < row || v >= last).collect()
}

/// Ids far apart and in no order, all distinct: a bijection of u32.
fn scatter(id: u32) -> u32 {
    let x = (id ^ (id >> 16)).wrapping_mul(0x85EB_CA6B);
    let x = (x ^ (x >> 13)).wrapping_mul(0xC2B2_AE35);
    x ^ (x >> 16)
}

fn ids(c: &mut Criterion) {
    let narrow: Vec<u32> = corners().iter().map(|v| v + FIRST).collect();
    let scattered: Vec<u32> = narrow.iter().map(|&v| scatter(v)).collect();
    let mut group = c.benchmark_group("chunk of 128K triangles: local ids");
    group.throughput(Throughput::Elements(TRIANGLES));
    for (name, v, window) in [
        ("narrow", &narrow, Some(u64::from(FIRST))),
        ("scattered", &scattered, None),
    ] {
        let mut ids = LocalIds::default();
        ids.assign(v);
        assert_eq!((ids.window(), ids.span()), (window, VERTICES));
        let back = ids.local().iter().map(|&l| ids.global(l));
        assert!(back.eq(v.iter().map(|&v| u64::from(v))));
        group.bench_function(name, |b| b.iter(|| ids.assign(black_box(v))));
    }
    group.finish();
}

/// Edges inside the sheet: level, upright, slanting.
const REGULAR: u64 = 2 * (SIDE as u64) * (SIDE as u64 - 1) + (SIDE * SIDE) as u64;
/// Edges between a flipped row of quads and another: two rows of edges each, the last but one.
const INCONSISTENT: u64 = (2 * (SIDE / PERIOD) as u64 - 1) * SIDE as u64;

fn pair(c: &mut Criterion) {
    let local = corners();
    let side = u64::from(SIDE);
    let mut group = c.benchmark_group("chunk of 128K triangles: pair");
    group.throughput(Throughput::Elements(TRIANGLES));
    let none = vec![false; VERTICES];
    let all = vec![true; VERTICES];
    for (name, seam, regular, borders, spilled) in [
        ("all settled", none, REGULAR, 4 * side, 0),
        ("seam at the rim", rim(), REGULAR, 2 * side, 2 * side),
        ("all seam", all, 0, 0, 3 * TRIANGLES),
    ] {
        let mut pairs = Pairs::default();
        pairs.pair(&local, &seam);
        assert_eq!((pairs.regular, pairs.borders), (regular, borders));
        assert_eq!(pairs.seams.len() as u64, spilled);
        assert_eq!((pairs.nonmanifold, pairs.degenerate), (0, 0));
        let inconsistent = if regular > 0 { INCONSISTENT } else { 0 };
        assert_eq!(pairs.inconsistent, inconsistent);
        group.bench_function(name, |b| {
            b.iter(|| pairs.pair(black_box(&local), black_box(&seam)));
        });
    }
    group.finish();
}

/// The chunk paired, its seam at the rim.
fn paired() -> Pairs {
    let mut pairs = Pairs::default();
    pairs.pair(&corners(), &rim());
    pairs
}

fn swirl(c: &mut Criterion) {
    let pairs = paired();
    let mut swirl = Swirl::default();
    swirl.walk(&pairs.opposite);
    assert_eq!(swirl.components.len(), 1);
    let found = swirl.components[0];
    assert_eq!((found.first, found.conflict), (0, false));
    assert_eq!(u64::from(found.triangles), TRIANGLES);
    assert_eq!(u64::from(found.flipped), FLIPPED);
    assert_eq!(found.borders, 2 * SIDE);
    let mut group = c.benchmark_group("chunk of 128K triangles: swirl");
    group.throughput(Throughput::Elements(TRIANGLES));
    group.bench_function("walk", |b| {
        b.iter(|| swirl.walk(black_box(&pairs.opposite)));
    });
    group.finish();
}

fn measures(c: &mut Criterion) {
    let (local, positions) = (corners(), positions());
    let mut bounds = Bounds::default();
    positions.iter().for_each(|p| bounds.add(p.map(f64::from)));
    let grid = Grid::new(&bounds);
    let mut swirl = Swirl::default();
    swirl.walk(&paired().opposite);
    let mut measurer = Measurer::default();
    let mut out = [Measure::default()];
    measurer.measure(&grid, &local, &swirl.label, &positions, &[], &mut out);
    // From the corner of the box, the origin, every triangle spans the same: the determinant of
    // (i, j, k), i + j + k = 512, with the steps (1, 0, -1) and (1, 1, -2).
    let one = f64::from(2 * SIDE);
    let six = |sum| grid.six_volume(sum);
    assert_eq!(six(out[0].six_oriented), one * TRIANGLES as f64);
    assert_eq!(
        six(out[0].six_input),
        one * (TRIANGLES - 2 * FLIPPED) as f64
    );
    let area = 3f64.sqrt() / 2.0 * TRIANGLES as f64;
    assert!((grid.area(out[0].area) / area - 1.0).abs() < 1e-9);
    assert_eq!((out[0].min, out[0].max), ([0.0; 3], [256.0, 256.0, 512.0]));
    let mut group = c.benchmark_group("chunk of 128K triangles: measure");
    group.throughput(Throughput::Elements(TRIANGLES));
    group.bench_function("one component", |b| {
        b.iter(|| {
            let mut out = [Measure::default()];
            measurer.measure(
                &grid,
                black_box(&local),
                &swirl.label,
                &positions,
                &[],
                &mut out,
            );
            out
        });
    });
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    ids(&mut criterion);
    pair(&mut criterion);
    swirl(&mut criterion);
    measures(&mut criterion);
    criterion.final_summary();
}
