//! Pictures: against a ray caster that shares no code, against stored ones, and against
//! themselves for every budget, number of threads and width of the index.

#[path = "../common/mod.rs"]
mod common;
mod rays;
mod refusals;
mod scenes;
mod stored;

use common::mesh::Mesh;
use cornermill::Error;
use cornermill::build::{Builder, IndexChoice};
use cornermill::disk::{Budget, Counters, NoProgress, Scratch, Workers, Workspace};
use cornermill::folder::{Folder, Orient};
use cornermill::report::picture::{
    Background, ColorBy, PictureCount, PictureRequest, View, draw_to, least_memory,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A mesh folder in a directory of its own.
struct Home {
    dir: tempfile::TempDir,
    path: PathBuf,
}

/// A picture, read back: bytes of the file, and RGBA of each pixel.
struct Shot {
    bytes: Vec<u8>,
    size: [usize; 2],
    pixels: Vec<[u8; 4]>,
    count: PictureCount,
    /// Scratch that was in use at once.
    scratch: u64,
}

impl Home {
    /// Builds a mesh as the input has it: nothing is turned over.
    fn of(mesh: &Mesh) -> Home {
        Home::built(mesh, |builder| builder)
    }

    fn built(mesh: &Mesh, more: impl Fn(Builder) -> Builder) -> Home {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.ct");
        let (v, g) = common::formats::write_npy(mesh, dir.path());
        let builder = Builder::new(v).positions(g).orient(Orient::Keep);
        more(builder.memory(64 << 20)).build(&path).unwrap();
        Home { dir, path }
    }

    fn workspace(&self, memory: u64, threads: usize) -> Workspace {
        let io = Arc::new(Counters::default());
        Workspace {
            budget: Budget::new(memory),
            scratch: Scratch::new(&[self.dir.path().to_owned()], u64::MAX, &io).unwrap(),
            io,
            workers: Workers::new(threads).unwrap(),
            progress: Arc::new(NoProgress),
        }
    }

    fn least(&self, request: &PictureRequest, threads: usize) -> u64 {
        let io = Arc::new(Counters::default());
        least_memory(&Folder::open(&self.path, &io).unwrap(), request, threads)
    }

    fn draw(&self, request: &PictureRequest, memory: u64, threads: usize) -> Result<Shot, Error> {
        let ws = self.workspace(memory, threads);
        let folder = Folder::open(&self.path, &ws.io)?;
        let mut bytes = Vec::new();
        let count = draw_to(&ws, &folder, request, &mut bytes, Path::new("out.png"))?;
        assert_eq!(ws.budget.used(), 0);
        assert!(ws.budget.peak() <= memory);
        assert_eq!(count.bytes, bytes.len() as u64);
        let (size, pixels) = decode(&bytes);
        Ok(Shot {
            bytes,
            size,
            pixels,
            count,
            scratch: ws.scratch.peak(),
        })
    }

    /// With ample memory, on two threads.
    fn shot(&self, request: &PictureRequest) -> Shot {
        self.draw(request, 512 << 20, 2).unwrap()
    }
}

/// Size and RGBA of a PNG.
fn decode(bytes: &[u8]) -> ([usize; 2], Vec<[u8; 4]>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    let pixels = match info.color_type {
        png::ColorType::Rgba => data
            .chunks_exact(4)
            .map(|p| [p[0], p[1], p[2], p[3]])
            .collect(),
        png::ColorType::Rgb => data
            .chunks_exact(3)
            .map(|p| [p[0], p[1], p[2], 255])
            .collect(),
        other => panic!("{other:?}"),
    };
    ([info.width as usize, info.height as usize], pixels)
}

/// A request for a picture of this many pixels each way.
fn request(pixels: u32) -> PictureRequest {
    PictureRequest {
        size: [pixels; 2],
        ..PictureRequest::default()
    }
}

/// Meshes whose pictures must not depend on the way: near in the file, in random order, with
/// borders and non-manifold edges, of several components.
fn meshes() -> Vec<Mesh> {
    let mut random = common::random::Random::new(11);
    let mut apart = common::surfaces::torus(420, 200).plus(&scenes::sphere(60));
    apart.drop_some(&mut random, 3);
    apart.flip_some(&mut random, 30);
    let near = apart.clone();
    apart.shuffle(&mut random);
    let mut cut = common::surfaces::torus(20, 12).plus(&common::surfaces::fan_on_edge(5));
    cut.merge_vertices(&mut random, 12);
    vec![near, apart, cut]
}

#[test]
fn the_picture_is_the_same_for_every_budget_and_number_of_threads() {
    let mut spilled = 0;
    for mesh in meshes() {
        let home = Home::of(&mesh);
        for color in [
            ColorBy::Component,
            ColorBy::Orientation,
            ColorBy::Swirl,
            ColorBy::Plain,
        ] {
            let request = PictureRequest {
                color,
                ..request(90)
            };
            let first = home.shot(&request);
            // The ways differ by color only in what they read besides.
            let few = color != ColorBy::Component;
            for threads in (1..=3).step_by(1 + usize::from(few)) {
                let least = home.least(&request, threads);
                for memory in [least, least + least / 3, 64 << 20] {
                    let other = home.draw(&request, memory, threads).unwrap();
                    let name = format!("{} {color:?} {threads} {memory}", mesh.name);
                    assert!(other.bytes == first.bytes, "{name}");
                    assert_eq!(other.count, first.count, "{name}");
                    spilled += u64::from(other.scratch > 100_000);
                }
            }
        }
    }
    // Some went through the shuffle, and most did not.
    assert!((2..40).contains(&spilled), "{spilled}");
}

#[test]
fn the_width_of_the_index_does_not_show() {
    for mesh in meshes() {
        let narrow = Home::of(&mesh);
        let wide = Home::built(&mesh, |builder| builder.index(IndexChoice::U8));
        let request = request(70);
        assert!(narrow.shot(&request).bytes == wide.shot(&request).bytes);
        let (least, threads) = (wide.least(&request, 2), 2);
        let tight = wide.draw(&request, least, threads).unwrap();
        assert!(narrow.shot(&request).bytes == tight.bytes);
    }
}

#[test]
fn backgrounds_lie_behind() {
    let home = Home::of(&common::surfaces::cube());
    let clear = home.shot(&request(40));
    assert_eq!(clear.pixels[0], [0; 4]);
    for color in [[255; 3], [0; 3], [12, 200, 99]] {
        let request = PictureRequest {
            background: Background::Color(color),
            view: View::Front,
            ..request(40)
        };
        let shot = home.shot(&request);
        assert_eq!(shot.pixels[0][..3], color);
        // In the middle nothing shines through.
        let middle = 20 * 40 + 20;
        let request = PictureRequest {
            background: Background::Transparent,
            ..request
        };
        assert_eq!(shot.pixels[middle], home.shot(&request).pixels[middle]);
    }
}

#[test]
fn sizes_need_not_be_square_and_the_mesh_stays_so() {
    let home = Home::of(&common::surfaces::cube());
    let request = PictureRequest {
        size: [300, 100],
        view: View::Right,
        samples: Some(1),
        ..request(1)
    };
    let shot = home.shot(&request);
    assert_eq!(shot.size, [300, 100]);
    let covered = shot.pixels.iter().filter(|p| p[3] > 0).count();
    // A square of 92 by 92 pixels: 4 percent stay empty at each side.
    assert!(
        (92 * 92 - 190..=92 * 92 + 190).contains(&covered),
        "{covered}"
    );
}
