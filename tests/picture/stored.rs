//! Pictures compared with stored ones, which were looked at when they were stored.
//!
//! Tolerance: a channel may differ by 6 of 255, since the mathematical functions of another
//! system may round otherwise, and up to 4 pixels of 9216 may differ by more, where that rounding
//! moved an edge over a sample. `CORNERMILL_STORE=1` writes the pictures anew.

use crate::common::mesh::Mesh;
use crate::common::{random::Random, surfaces};
use crate::{Home, decode, request, scenes};
use cornermill::report::picture::{Background, ColorBy, PictureRequest, View};
use std::path::Path;

fn compare(name: &str, mesh: &Mesh, request: &PictureRequest) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/picture/stored")
        .join(format!("{name}.png"));
    let shot = Home::of(mesh).shot(request);
    if std::env::var_os("CORNERMILL_STORE").is_some() {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &shot.bytes).unwrap();
    }
    let stored = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let (size, pixels) = decode(&stored);
    assert_eq!(shot.size, size, "{name}");
    let apart = |(a, b): &(&[u8; 4], &[u8; 4])| (0..4).any(|k| a[k].abs_diff(b[k]) > 6);
    let differ = shot.pixels.iter().zip(&pixels).filter(apart).count();
    assert!(differ <= 4, "{name}: {differ} pixels differ");
}

#[test]
fn pictures_look_as_they_did() {
    let plain = request(96);
    let white = PictureRequest {
        background: Background::Color([255; 3]),
        ..plain
    };
    compare("sphere", &scenes::sphere(64), &plain);
    compare("torus", &surfaces::torus(48, 32), &white);
    // From where the edge that they share is seen.
    let below = PictureRequest {
        view: View::From([1.5, -0.9, 1.2]),
        ..white
    };
    compare("cubes", &scenes::cubes_on_an_edge(), &below);
    compare("cube", &surfaces::cube(), &plain);
    compare("disk", &surfaces::disk(24), &plain);
    compare("moebius", &surfaces::moebius(40), &white);
    let swirl = PictureRequest {
        color: ColorBy::Swirl,
        view: View::From([1.0, 2.0, 3.0]),
        ..white
    };
    compare("swirl", &surfaces::torus(48, 32), &swirl);
    let mut turned = surfaces::torus(48, 32).plus(&scenes::sphere(32));
    turned.flip_some(&mut Random::new(3), 30);
    turned.shuffle(&mut Random::new(4));
    let sides = PictureRequest {
        color: ColorBy::Orientation,
        up: [0.0, 0.0, 1.0],
        background: Background::Color([20, 22, 28]),
        ..plain
    };
    compare("turned", &turned, &sides);
    let several = (0..9).fold(scenes::sphere(24), |all, i| {
        let at = [(i % 3) as f32 * 2.2, (i / 3) as f32 * 2.2, 0.0];
        all.plus(&scenes::sphere(24).moved(at))
    });
    let front = PictureRequest {
        view: View::Front,
        ..plain
    };
    compare("several", &several, &front);
    let clay = PictureRequest {
        color: ColorBy::Plain,
        samples: Some(1),
        ..white
    };
    compare("plain", &surfaces::torus(16, 8), &clay);
}
