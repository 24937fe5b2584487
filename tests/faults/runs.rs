//! The commands: what each is given and what it makes, `@` standing for the place.

use crate::common::formats::{self, Order};
use crate::common::mesh::Mesh;
use crate::common::random::Random;
use crate::common::surfaces;
use std::path::Path;

pub struct Case {
    pub name: &'static str,
    /// The arguments; outputs lie in `@/out`.
    pub args: String,
    /// Makes the inputs in a folder.
    pub prepare: fn(&Path),
    /// False for commands that only read.
    pub outputs: bool,
    /// Every how manyth call is made to do less, or finds the disk full; every one fails once.
    pub stride: u64,
}

/// Every so manyth call; every one when `EVERY_CALL` is set, which takes minutes.
pub fn every(stride: u64) -> u64 {
    if std::env::var_os("EVERY_CALL").is_some() {
        1
    } else {
        stride
    }
}

fn mesh() -> Mesh {
    let mut mesh = surfaces::torus(9, 8);
    mesh.shuffle(&mut Random::new(3));
    mesh
}

/// Large enough that writers of shuffles do not keep all that they are given in memory.
fn large(dir: &Path) {
    let mut mesh = surfaces::torus(64, 64);
    mesh.shuffle(&mut Random::new(4));
    std::fs::write(dir.join("l.ply"), formats::ply_binary(&mesh, Order::Big)).expect("a mesh");
}

fn meshes(dir: &Path) {
    let mesh = mesh();
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(dir.join(name), bytes).expect("a mesh");
    write("m.ply", formats::ply_binary(&mesh, Order::Big));
    write("a.ply", formats::ply_ascii(&mesh));
    write("m.stl", formats::stl_binary(&mesh, "x"));
    write("a.stl", formats::stl_ascii(&mesh, "\n", 3));
    write("m.obj", formats::obj(&mesh));
    write("m.off", formats::off(&mesh));
    formats::write_npy(&mesh, dir);
}

fn here(args: &[&str]) {
    let args: Vec<_> = ["cornermill"].iter().chain(args).map(Into::into).collect();
    let (code, said) = cornermill::cli::run_here(&args);
    assert_eq!(code, 0, "{said}");
}

fn folder(dir: &Path) {
    meshes(dir);
    let name = |n: &str| dir.join(n).to_str().expect("a plain name").to_owned();
    here(&[
        "build",
        &name("m.ply"),
        "-o",
        &name("m.ct"),
        "--quiet",
        "--threads=1",
    ]);
    here(&[
        "encode",
        &name("m.ct"),
        "-o",
        &name("m.cmz"),
        "--bits=12",
        "--keep-order",
        "--quiet",
    ]);
}

fn case(name: &'static str, args: &str, prepare: fn(&Path), outputs: bool) -> Case {
    Case {
        name,
        args: args.to_owned(),
        prepare,
        outputs,
        stride: 1,
    }
}

pub fn cases() -> Vec<Case> {
    let build = |name, args: &str| {
        let args = format!("build {args} -o @/out/m.ct --memory=64MiB");
        case(name, &args, meshes, true)
    };
    let write = |name, args: &str| case(name, args, folder, true);
    let read = |name, args: &str| case(name, args, folder, false);
    let small = "--chunk-triangles=20 --buckets=4";
    let spilled = |name, strategy: &str| {
        let args = format!(
            "build @/in/l.ply -o @/out/m.ct --memory=3MiB --chunk-triangles=1000 --strategy={strategy}"
        );
        Case {
            stride: 7,
            ..case(name, &args, large, true)
        }
    };
    vec![
        spilled("in order, spilled", "memory"),
        spilled("contract, spilled", "contract"),
        spilled("by place, spilled", "by-place"),
        spilled("by id, spilled", "by-id"),
        build("build ply", "@/in/m.ply"),
        build("build ascii ply", "@/in/a.ply"),
        build("build stl", "@/in/m.stl"),
        build("build ascii stl", "@/in/a.stl"),
        build("build obj", "@/in/m.obj"),
        build("build off", "@/in/m.off"),
        build("in order", &format!("@/in/m.ply --strategy=memory {small}")),
        build(
            "contract",
            &format!("@/in/m.ply --strategy=contract {small}"),
        ),
        build(
            "by place",
            &format!("@/in/m.ply --strategy=by-place {small}"),
        ),
        build("by id", &format!("@/in/m.ply --strategy=by-id {small}")),
        build("weld", "@/in/m.ply --weld"),
        read("check", "check @/in/m.ct --require=closed"),
        read("info", "info @/in/m.ct"),
        read("verify", "verify @/in/m.ct"),
        read("path", "path @/in/m.ct --from=0 --to=100"),
        read("swirl", "swirl @/in/m.ct --from=0"),
        write(
            "path to a file",
            "path @/in/m.ct --from=0 --to=100 -o @/out/p.ply",
        ),
        write(
            "encode",
            "encode @/in/m.ct -o @/out/m.cmz --bits=12 --keep-order",
        ),
        write("decode to a folder", "decode @/in/m.cmz -o @/out/m.ct"),
        write("decode to a file", "decode @/in/m.cmz -o @/out/m.obj"),
        write(
            "decode a component",
            "decode @/in/m.cmz -o @/out/m.ply --component=0",
        ),
        write("export ply", "export @/in/m.ct -o @/out/m.ply"),
        write("export stl", "export @/in/m.ct -o @/out/m.stl"),
        write("export npy", "export @/in/m.ct -o @/out/m.npy"),
        write("filter", "filter @/in/m.ct -o @/out/f.ct --component=0"),
        write("normals", "normals @/in/m.ct -o @/out/n.npy"),
        write("picture", "picture @/in/m.ct -o @/out/p.png --size=32x32"),
        write("report", "report @/in/m.ct -o @/out/r.html --size=32"),
    ]
}

/// Builds that write down every step, with steps that each can be gone on with behind.
pub fn stepwise() -> Vec<(Case, Vec<&'static str>)> {
    let build = |name, args: &str, steps: &[&'static str], stride| {
        let args = format!("build {args} -o @/out/m.ct --memory=64MiB --checkpoint=0");
        let case = Case {
            stride,
            ..case(name, &args, meshes, true)
        };
        (case, steps.to_vec())
    };
    let small = "--chunk-triangles=20 --buckets=4";
    let way = |strategy| format!("@/in/m.ply {small} --strategy={strategy}");
    let begun = ["read", "coordinates"];
    let ended = ["stars", "stitch", "components", "finish"];
    let by_place = [
        "stars by place",
        "stitch by place",
        "components by place",
        "assemble by place",
    ];
    let by_id = ["components by id", "assemble by id"];
    let weld = ["weld: read", "weld: group", "weld: place", "weld"];
    vec![
        build(
            "steps in order",
            &way("memory"),
            &[&begun[..], &["chunks"], &ended].concat(),
            5,
        ),
        build("steps, contract", &way("contract"), &["stitch"], 31),
        build(
            "steps by place",
            &way("by-place"),
            &[&["settle by place"], &by_place[..]].concat(),
            9,
        ),
        build(
            "steps by id",
            &way("by-id"),
            &[&["settle by id"], &by_id[..]].concat(),
            9,
        ),
        build("steps of STL", "@/in/m.stl --strategy=memory", &weld, 13),
        build(
            "steps of STL as text",
            "@/in/a.stl --strategy=memory",
            &weld[..1],
            17,
        ),
        build("steps of OBJ", "@/in/m.obj --strategy=memory", &begun, 17),
        build(
            "steps of welds",
            "@/in/m.ply --weld --strategy=memory --index=u8",
            &["read", "weld: group", "weld"],
            13,
        ),
    ]
}
