//! Welds that are written down behind every pass, and gone on with by another process.

use super::*;
use crate::disk::journal::{Keep, Pen, Reader};
use crate::disk::{Budget, Counters, NoProgress, Scratch, Workers};
use std::path::Path;
use std::sync::Arc;

/// The workspace of a process whose scratch files have names.
fn process(dir: &Path, memory: u64, limit: u64) -> Workspace {
    let io = Arc::new(Counters::default());
    let rooms = [dir.join("scratch")];
    Workspace {
        budget: Budget::new(memory),
        scratch: Scratch::named(&rooms, limit, &io, &dir.join("state")).unwrap(),
        io,
        workers: Workers::new(2).unwrap(),
        progress: Arc::new(NoProgress),
    }
}

fn write_down(ws: &Workspace, dir: &Path, weld: &Welding) {
    let mut pen = Pen::new(&dir.join("state"), &ws.scratch, "test").unwrap();
    weld.keep(&mut pen).unwrap();
    pen.finish().unwrap();
}

fn read_back(ws: &Workspace, dir: &Path) -> Welding {
    let room = (&ws.budget, &ws.scratch);
    let out = dir.join("out");
    let mut reader = Reader::open(&dir.join("state"), room, &ws.io, &out).unwrap();
    let weld = Welding::restore(&mut reader).unwrap();
    reader.finish().unwrap();
    weld
}

fn begun(ws: &Workspace, corners: &[[u64; 3]], kind: CoordKind, tuning: Tuning) -> Welding {
    let triangles = corners.len() as u64 / 3;
    let expected = Expected {
        triangles,
        most: Some(triangles),
    };
    match kind {
        CoordKind::F4 => {
            let all: Vec<_> = corners.iter().map(|at| at.map(|c| c as u32)).collect();
            soup_tuned::<u32, ()>(ws, expected, |soup| soup.corners(&all), tuning)
        }
        CoordKind::F8 => soup_tuned::<u64, ()>(ws, expected, |soup| soup.corners(corners), tuning),
    }
    .unwrap()
    .1
}

/// Each process runs one pass twice: it is killed behind the first time, as far as files go.
#[test]
fn a_weld_is_gone_on_with_behind_every_pass() {
    for kind in [CoordKind::F4, CoordKind::F8] {
        for (n, filed, wide) in [
            (0, false, false),
            (3000, false, false),
            (60_000, true, false),
            (60_000, false, true),
        ] {
            let corners = random(n, 60, kind, 9);
            let dir = tempfile::tempdir().unwrap();
            let dir = dir.path();
            for name in ["scratch", "out"] {
                std::fs::create_dir(dir.join(name)).unwrap();
            }
            let mut request = request(dir, dir);
            request.g_path = dir.join("out/G.npy");
            let tuning = Tuning {
                filed,
                wide,
                ..Tuning::default()
            };
            let ws = process(dir, 4 << 20, u64::MAX);
            let weld = begun(&ws, &corners, kind, tuning);
            write_down(&ws, dir, &weld);
            let mut steps = vec![weld.step()];
            std::mem::forget((weld, ws));
            let (ws, (v, g)) = loop {
                let lost = process(dir, 4 << 20, u64::MAX);
                std::mem::forget(read_back(&lost, dir).on(&lost, &request).unwrap());
                let ws = process(dir, 4 << 20, u64::MAX);
                match read_back(&ws, dir).on(&ws, &request).unwrap() {
                    Next::Going(weld) => {
                        steps.push(weld.step());
                        write_down(&ws, dir, &weld);
                        std::mem::forget((weld, ws));
                    }
                    Next::Done(welded) => break (ws, welded),
                }
            };
            assert_eq!(steps, STEPS);
            let vertices = Some(g.vertices);
            let mesh = Mesh {
                vertices,
                ..mesh(v, Some(g))
            };
            let found = (triangles(&mesh), bits_of(&mesh));
            assert!(
                found == naive(&corners, kind),
                "{kind:?} {n} {filed} {wide}"
            );
            assert_eq!(ws.budget.used(), 0);
        }
    }
}

/// V has a file of its own only where there is room for it; else nothing is kept any longer.
#[test]
fn without_room_the_ways_back_are_kept_no_longer() {
    let corners = random(60_000, 60, CoordKind::F4, 9);
    for (limit, kept) in [(u64::MAX, true), (300_000, false)] {
        let dir = tempfile::tempdir().unwrap();
        let dir = dir.path();
        for name in ["scratch", "out"] {
            std::fs::create_dir(dir.join(name)).unwrap();
        }
        let mut request = request(dir, dir);
        request.g_path = dir.join("out/G.npy");
        let ws = process(dir, 4 << 20, limit);
        let mut weld = begun(&ws, &corners, CoordKind::F4, Tuning::default());
        let (v, g) = loop {
            write_down(&ws, dir, &weld);
            match weld.on(&ws, &request).unwrap() {
                Next::Going(next) => weld = next,
                Next::Done(welded) => break welded,
            }
        };
        assert_eq!(dir.join("state").is_file(), kept);
        let found = mesh(v, Some(g));
        assert!((triangles(&found), bits_of(&found)) == naive(&corners, CoordKind::F4));
    }
}
