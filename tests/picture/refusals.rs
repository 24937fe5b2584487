//! What has nothing to draw, or does not fit, is refused with what to do; what can be drawn in
//! part is, and the rest is counted.

use crate::common::mesh::Mesh;
use crate::common::run::cornermill;
use crate::common::surfaces;
use crate::{Home, request};
use cornermill::Error;
use cornermill::report::picture::{ColorBy, PictureRequest, View};
use std::path::Path;

fn usage(done: Result<crate::Shot, Error>, says: &str) {
    match done {
        Err(Error::Usage(text)) => assert!(text.contains(says), "{text}"),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("drawn, instead of: {says}"),
    }
}

#[test]
fn the_least_memory_is_just_that() {
    for (mesh, color) in [
        (surfaces::torus(30, 20), ColorBy::Component),
        (surfaces::moebius(50), ColorBy::Plain),
        (surfaces::fan_on_edge(7), ColorBy::Swirl),
    ] {
        let home = Home::of(&mesh);
        let request = PictureRequest {
            color,
            ..request(33)
        };
        for threads in [1, 3] {
            let least = home.least(&request, threads);
            home.draw(&request, least, threads).unwrap();
            match home.draw(&request, least - 1, threads) {
                Err(Error::Budget { need, have, .. }) => {
                    assert_eq!((need, have), (least, least - 1))
                }
                Err(other) => panic!("{other}"),
                Ok(_) => panic!("drawn in less than the least"),
            }
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let empty = Home::of(&Mesh::new("empty", vec![], vec![]));
    usage(
        empty.draw(&request(9), 64 << 20, 1),
        "nothing to draw: of 0 triangles",
    );
    let line = Mesh::new("line", vec![[0, 1, 1]], vec![[0.0; 3], [1.0; 3]]);
    usage(
        Home::of(&line).draw(&request(9), 64 << 20, 1),
        "of 1 triangles 1 are degenerate",
    );
    let cube = Home::of(&surfaces::cube());
    for size in [[0, 5], [5, 0], [8193, 5]] {
        let request = PictureRequest { size, ..request(1) };
        usage(cube.draw(&request, 64 << 20, 1), "from 1 to 8192");
    }
    let request = PictureRequest {
        samples: Some(5),
        ..request(9)
    };
    usage(cube.draw(&request, 64 << 20, 1), "1 to 4");
    let from = PictureRequest {
        view: View::From([0.0; 3]),
        samples: None,
        ..request
    };
    usage(cube.draw(&from, 64 << 20, 1), "not all 0");
}

#[test]
fn triangles_without_a_place_are_left_out_and_counted() {
    let mut mesh = surfaces::cube().plus(&surfaces::octahedron().moved([3.0, 0.0, 0.0]));
    mesh.positions[8][1] = f32::NAN;
    mesh.positions[9][0] = f32::INFINITY;
    mesh.triangles.push([0, 0, 1]);
    let home = Home::of(&mesh);
    for view in [View::Front, View::Iso] {
        let request = PictureRequest {
            view,
            ..request(50)
        };
        let count = home.shot(&request).count;
        assert_eq!(
            (count.triangles, count.nonfinite, count.degenerate),
            (12, 8, 1)
        );
    }
}

#[test]
fn a_single_point_of_a_mesh_is_drawn_as_nothing() {
    let spot = Mesh::new("a spot", vec![[0, 1, 2]], vec![[5.0; 3]; 3]);
    let shot = Home::of(&spot).shot(&PictureRequest {
        marks: false,
        ..request(20)
    });
    assert!(shot.pixels.iter().all(|p| p[3] == 0));
    assert_eq!(shot.count.triangles, 1);
}

#[test]
fn the_command_says_what_it_drew_and_refuses_what_it_must() {
    let home = Home::of(&surfaces::moebius(30));
    let png = home.dir.path().join("p.png");
    let run = |more: &[&str]| {
        let fixed = [
            "picture".as_ref(),
            home.path.as_os_str(),
            "-o".as_ref(),
            png.as_os_str(),
        ];
        cornermill(fixed.into_iter().chain(more.iter().map(|s| s.as_ref())))
    };
    let first = run(&["--size", "80x60", "--view", "-1,2,0.5", "--up", "0,0,-1"]).expect(0);
    assert!(
        first
            .stdout
            .contains("80 x 60, 60 triangles drawn, 0 left out"),
        "{first}"
    );
    let bytes = std::fs::read(&png).unwrap();
    assert_eq!(crate::decode(&bytes).0, [80, 60]);
    let refused = run(&[]).expect(2);
    assert!(refused.stderr.contains("--force"), "{refused}");
    assert_eq!(std::fs::read(&png).unwrap(), bytes);
    let forced = run(&["--force", "--quiet", "--no-marks", "--color", "orientation"]).expect(0);
    assert!(forced.stdout.is_empty());
    assert_eq!(crate::decode(&std::fs::read(&png).unwrap()).0, [1024, 1024]);
    for bad in [["--view", "up"], ["--up", "0,0,0"], ["--background", "red"]] {
        run(&[&["--force"], &bad[..]].concat()).expect(2);
    }
    let small = run(&["--force", "--memory", "1MiB"]).expect(5);
    assert!(small.stderr.contains("--memory"), "{small}");
    let inside = home.path.join("p.png");
    let refused = cornermill([
        "picture".as_ref(),
        home.path.as_os_str(),
        "-o".as_ref(),
        inside.as_os_str(),
    ]);
    refused.expect(2);
    assert!(!Path::new(&inside).exists());
}

#[test]
fn a_mesh_of_vertices_alone_has_no_picture() {
    let dir = tempfile::tempdir().unwrap();
    let (v, _) = crate::common::formats::write_npy(&surfaces::cube(), dir.path());
    let out = dir.path().join("m.ct");
    cornermill([
        "build".as_ref(),
        v.as_os_str(),
        "-o".as_ref(),
        out.as_os_str(),
    ])
    .expect(0);
    let png = dir.path().join("p.png");
    let run = cornermill([
        "picture".as_ref(),
        out.as_os_str(),
        "-o".as_ref(),
        png.as_os_str(),
    ]);
    let run = run.expect(2);
    assert!(run.stderr.contains("no coordinates"), "{run}");
    assert!(!png.exists());
}

#[test]
fn a_damaged_table_is_not_walked() {
    let home = Home::of(&surfaces::cube());
    let path = home.path.join("O.npy");
    let mut o = std::fs::read(&path).unwrap();
    o[4096..4100].copy_from_slice(&512u32.to_le_bytes());
    std::fs::write(&path, o).unwrap();
    let request = PictureRequest {
        color: ColorBy::Swirl,
        ..request(9)
    };
    match home.draw(&request, 64 << 20, 1) {
        Err(Error::Input(bad)) => assert!(bad.path.ends_with("O.npy"), "{bad}"),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("a damaged table was drawn"),
    }
}
