//! The whole build: every refusal is one, and every folder passes `verify` and is the same
//! by another way.

use super::place::{Place, files, sane};
use cornermill::build::{Builder, IndexChoice, Strategy};
use cornermill::folder::Orient;
use cornermill::verify::{Limits, verify};
use std::cell::OnceCell;
use std::path::Path;

/// Bytes of budget of a build.
const MEMORY: u64 = 16 << 20;
/// How files begin that are built as they are.
const STARTS: [&[u8]; 7] = [b"ply", b"OFF", b"solid", b"v ", b"#", b"f ", b"o "];

thread_local! {
    static PLACE: OnceCell<Place> = const { OnceCell::new() };
}

/// A mesh file when the bytes begin like one. Else four bytes that choose the way, and three bytes
/// a triangle, the vertices.
pub fn whole(data: &[u8]) {
    if STARTS.iter().any(|s| data.starts_with(s)) {
        return build_with("mesh", data, None, |builder| builder);
    }
    let Some((&[turns, chunk, size, shape], triangles)) = data.split_first_chunk() else {
        return;
    };
    let vertices = u64::from(size) + 1;
    let id = |&b: &u8| (u64::from(b) % vertices) as u32;
    let corners = triangles.as_chunks::<3>().0.as_flattened().iter();
    let v: Vec<u8> = corners.flat_map(|b| id(b).to_le_bytes()).collect();
    let g: Vec<u8> = (0..vertices)
        .flat_map(|i| point(i, shape))
        .flat_map(f32::to_le_bytes)
        .collect();
    let rows = v.len() as u64 / 12;
    let v = [array("<u4", rows), v].concat();
    let g = [array("<f4", vertices), g].concat();
    let g = Some(&g[..]).filter(|_| shape % 8 != 7);
    build_with("V.npy", &v, g, |builder| {
        let orients = [
            Orient::Outward,
            Orient::Majority,
            Orient::First,
            Orient::Keep,
        ];
        let builder = match turns >> 2 & 3 {
            0 => builder,
            1 => builder.strategy(Strategy::ByPlace),
            2 => builder.strategy(Strategy::ById),
            _ => builder.strategy(Strategy::Contract),
        };
        let builder = builder.orient(orients[usize::from(turns & 3)]);
        let builder = builder.measures(turns & 16 == 0);
        let builder = if turns & 32 == 0 {
            builder
        } else {
            builder.index(IndexChoice::U8)
        };
        builder
            .vertices(vertices)
            .chunk_triangles(u64::from(chunk) + 1)
    });
}

/// A point of vertex `i`: on a lattice, in one plane, all one, or not finite here and there.
fn point(i: u64, shape: u8) -> [f32; 3] {
    let h = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let at = |k: u32| (h >> (8 * k) & 15) as f32;
    match shape % 8 {
        0..4 => [at(1), at(2), at(3)],
        4 => [at(1), at(2), 0.0],
        5 => [1.0; 3],
        _ if i % 5 == 2 => [f32::NAN, f32::INFINITY, 0.0],
        _ => [at(1) * 1e30, at(2) * 1e-30, at(3)],
    }
}

fn array(descr: &str, rows: u64) -> Vec<u8> {
    cornermill::folder::npy::header_bytes(descr, &[rows, 3])
}

/// Builds a file, as `change` has it, and once more in the usual way.
pub fn build_with(name: &str, v: &[u8], g: Option<&[u8]>, change: impl Fn(Builder) -> Builder) {
    PLACE.with(|place| {
        let place = place.get_or_init(|| Place::new(MEMORY));
        let input = place.put(name, v);
        let positions = g.map(|g| place.put("positions.npy", g));
        let builder = |memory: u64, threads: usize| {
            let builder = Builder::new(&input).memory(memory).threads(threads);
            change(match &positions {
                Some(path) => builder.positions(path),
                None => builder,
            })
        };
        let (one, two) = (place.path("one.ct"), place.path("two.ct"));
        let plain = |b: Builder| b.strategy(Strategy::Auto).chunk_triangles(1 << 16);
        let first = builder(MEMORY, 1).build(&one);
        let second = plain(builder(2 * MEMORY, 2)).build(&two);
        for error in [&first, &second]
            .into_iter()
            .filter_map(|r| r.as_ref().err())
        {
            sane(error);
        }
        for (built, folder) in [(&first, &one), (&second, &two)] {
            assert_eq!(built.is_ok(), folder.exists(), "half a folder");
        }
        if second.is_ok() {
            right(place, &two);
        }
        if first.is_ok() {
            assert!(second.is_ok(), "refused with twice the memory");
            assert!(files(&one) == files(&two), "another way, another folder");
        }
        for name in ["one.ct", "two.ct", name, "positions.npy"] {
            place.clear(name);
        }
        place.settled();
    });
}

/// The folder passes `verify`.
fn right(place: &Place, folder: &Path) {
    let verdict = verify(&place.ws, folder, Limits::default()).expect("a verdict");
    let said: Vec<String> = verdict.findings.iter().map(|f| f.to_string()).collect();
    assert!(verdict.ok(), "{said:?}");
}
