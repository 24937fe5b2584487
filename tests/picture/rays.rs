//! A ray through the middle of each pixel, against every triangle, in plain floating point: what
//! it meets first is what the picture shows.
//!
//! It knows of the program only what is documented: where the viewer stands, that the mesh fills
//! the picture but for 4 percent at each side, that fronts are blue and backs are orange. Pixels
//! where the ray passes too near to an edge, or where two triangles lie too near to each other, are
//! left out; the test counts that few are.

use crate::common::mesh::Mesh;
use crate::{Home, request, scenes};
use cornermill::report::picture::{ColorBy, PictureRequest, View};

/// Right, up and towards the viewer, of a position; +Y is up.
type Camera = fn([f64; 3]) -> [f64; 3];

const CAMERAS: [(View, Camera); 6] = [
    (View::Front, |[x, y, z]| [x, y, z]),
    (View::Back, |[x, y, z]| [-x, y, -z]),
    (View::Right, |[x, y, z]| [-z, y, x]),
    (View::Left, |[x, y, z]| [z, y, -x]),
    (View::Top, |[x, y, z]| [x, -z, y]),
    (View::Bottom, |[x, y, z]| [x, z, -y]),
];

/// What a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seen {
    Nothing,
    Front,
    Back,
    Unsure,
}

struct Caster {
    /// Corners in pixels, right and down, and towards the viewer.
    triangles: Vec<[[f64; 3]; 3]>,
}

impl Caster {
    fn new(mesh: &Mesh, camera: Camera, pixels: f64) -> Caster {
        let seen = |v: u32| camera(mesh.positions[v as usize].map(f64::from));
        let turned: Vec<[[f64; 3]; 3]> = mesh.triangles.iter().map(|t| t.map(seen)).collect();
        let all = || turned.iter().flatten();
        let most = |k: usize| all().map(|p| p[k]).fold(f64::MIN, f64::max);
        let least = |k: usize| all().map(|p| p[k]).fold(f64::MAX, f64::min);
        let scale = 0.92 * pixels / (most(0) - least(0)).max(most(1) - least(1));
        let middle = [0, 1].map(|k| (most(k) + least(k)) / 2.0);
        let place = |[x, y, z]: [f64; 3]| {
            [
                pixels / 2.0 + (x - middle[0]) * scale,
                pixels / 2.0 - (y - middle[1]) * scale,
                z * scale,
            ]
        };
        Caster {
            triangles: turned.iter().map(|t| t.map(place)).collect(),
        }
    }

    fn cast(&self, x: f64, y: f64) -> Seen {
        let mut seen = Seen::Nothing;
        let mut nearest = f64::MIN;
        for [a, b, c] in &self.triangles {
            // Twice the areas of the parts that the ray cuts the triangle into.
            let part =
                |p: &[f64; 3], q: &[f64; 3]| (p[0] - x) * (q[1] - y) - (p[1] - y) * (q[0] - x);
            let parts = [part(b, c), part(c, a), part(a, b)];
            let sides = [(b, c), (c, a), (a, b)];
            let whole: f64 = parts.iter().sum();
            let beside = (0..3).any(|k| {
                let (p, q) = sides[k];
                let length = (p[0] - q[0]).hypot(p[1] - q[1]);
                let (low, high) = (p[0].min(q[0]) - 0.01, p[0].max(q[0]) + 0.01);
                let (top, end) = (p[1].min(q[1]) - 0.01, p[1].max(q[1]) + 0.01);
                let within = low <= x && x <= high && top <= y && y <= end;
                within && parts[k].abs() <= 0.002 * length
            });
            let inside = parts.iter().all(|p| *p > 0.0) || parts.iter().all(|p| *p < 0.0);
            if !inside && !beside {
                continue;
            }
            let depth = (parts[0] * a[2] + parts[1] * b[2] + parts[2] * c[2]) / whole;
            // As the viewer sees it, down being positive: counterclockwise is negative.
            let side = if whole < 0.0 { Seen::Front } else { Seen::Back };
            if beside || !depth.is_finite() {
                return Seen::Unsure;
            }
            if (depth - nearest).abs() < 0.01 && side != seen {
                return Seen::Unsure;
            }
            if depth > nearest {
                (nearest, seen) = (depth, side);
            }
        }
        seen
    }
}

/// What a pixel of one sample says.
fn shown([r, _, b, a]: [u8; 4]) -> Seen {
    match a {
        0 => Seen::Nothing,
        _ if b > r => Seen::Front,
        _ => Seen::Back,
    }
}

fn compare(mesh: &Mesh, pixels: u32, most_unsure: usize) {
    let home = Home::of(mesh);
    for (view, camera) in CAMERAS {
        let request = PictureRequest {
            view,
            color: ColorBy::Orientation,
            samples: Some(1),
            marks: false,
            ..request(pixels)
        };
        let shot = home.shot(&request);
        let caster = Caster::new(mesh, camera, f64::from(pixels));
        let mut unsure = 0;
        for y in 0..pixels {
            for x in 0..pixels {
                let expected = caster.cast(f64::from(x) + 0.5, f64::from(y) + 0.5);
                if expected == Seen::Unsure {
                    unsure += 1;
                    continue;
                }
                let found = shown(shot.pixels[(y * pixels + x) as usize]);
                assert_eq!(found, expected, "{} {view:?}: pixel {x}, {y}", mesh.name);
            }
        }
        assert!(
            unsure <= most_unsure,
            "{} {view:?}: {unsure} unsure",
            mesh.name
        );
    }
}

#[test]
fn rays_meet_what_the_picture_shows() {
    for (seed, count) in [(1, 1), (2, 5), (3, 40), (4, 300), (5, 900)] {
        compare(&scenes::random_triangles(seed, count), 64, 700);
    }
    compare(&crate::common::surfaces::octahedron(), 64, 200);
}

#[test]
fn no_ray_slips_between_triangles_far_smaller_than_a_pixel() {
    // Some 60 triangles a pixel, of which nearly all cover none.
    let mut torus = crate::common::surfaces::torus(300, 200);
    let mut random = crate::common::random::Random::new(7);
    torus.rotate_corners(&mut random);
    let home = Home::of(&torus);
    for (view, _) in CAMERAS {
        let request = PictureRequest {
            view,
            color: ColorBy::Orientation,
            samples: Some(1),
            ..request(64)
        };
        let fine = home.shot(&request);
        let coarse = Home::of(&crate::common::surfaces::torus(150, 100)).shot(&request);
        // The outlines differ a little; within, both cover all and show one side.
        let differ = (0..64 * 64)
            .filter(|&i| shown(fine.pixels[i]) != shown(coarse.pixels[i]))
            .count();
        assert!(differ < 24, "{view:?}: {differ}");
    }
}
