//! Writers of meshes in the formats that the program reads.

use super::mesh::Mesh;
use super::npy;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The byte orders of binary files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    Little,
    Big,
}

impl Order {
    pub fn name(self) -> &'static str {
        match self {
            Order::Little => "little",
            Order::Big => "big",
        }
    }

    /// `bytes` are little-endian.
    fn put<const N: usize>(self, mut bytes: [u8; N]) -> Vec<u8> {
        if self == Order::Big {
            bytes.reverse();
        }
        bytes.into()
    }
}

/// Writes `V.npy` and `G.npy` (u4, f4) into `dir` and gives their paths.
pub fn write_npy(mesh: &Mesh, dir: &Path) -> (PathBuf, PathBuf) {
    let (v, g) = (dir.join("V.npy"), dir.join("G.npy"));
    write_npy_v(mesh, &v, "u4");
    let coordinates = coordinates(mesh, Order::Little);
    npy::write(&g, "<f4", mesh.positions.len(), 3, &coordinates);
    (v, g)
}

/// Writes the triangles alone, as `u4`, `u8`, `i4` or `i8`.
pub fn write_npy_v(mesh: &Mesh, path: &Path, index: &str) {
    let data = indices(mesh, index, Order::Little);
    npy::write(path, &format!("<{index}"), mesh.triangles.len(), 3, &data);
}

/// The triangles' indices in a row; the ids are small, so signed ones have the same bytes.
pub fn indices(mesh: &Mesh, index: &str, order: Order) -> Vec<u8> {
    let ids = mesh.triangles.as_flattened().iter();
    match index {
        "u4" | "i4" => ids.flat_map(|&i| order.put(i.to_le_bytes())).collect(),
        "u8" | "i8" => ids
            .flat_map(|&i| order.put(u64::from(i).to_le_bytes()))
            .collect(),
        other => panic!("no index type {other}"),
    }
}

/// The coordinates in a row, as f4.
pub fn coordinates(mesh: &Mesh, order: Order) -> Vec<u8> {
    mesh.positions
        .as_flattened()
        .iter()
        .flat_map(|&x| order.put(x.to_le_bytes()))
        .collect()
}

fn ply_header(mesh: &Mesh, format: &str) -> String {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    format!(
        "ply\nformat {format} 1.0\ncomment a test\nelement vertex {vertices}\n\
         property float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

/// PLY in text. `{}` prints the shortest text that reads back to the same f32.
pub fn ply_ascii(mesh: &Mesh) -> Vec<u8> {
    let mut text = ply_header(mesh, "ascii");
    for [x, y, z] in &mesh.positions {
        writeln!(text, "{x} {y} {z}").expect("a String takes all");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c}").expect("a String takes all");
    }
    text.into_bytes()
}

pub fn ply_binary(mesh: &Mesh, order: Order) -> Vec<u8> {
    let format = format!("binary_{}_endian", order.name());
    let mut file = ply_header(mesh, &format).into_bytes();
    file.extend(coordinates(mesh, order));
    for triangle in &mesh.triangles {
        file.push(3);
        file.extend(triangle.iter().flat_map(|i| order.put(i.to_le_bytes())));
    }
    file
}

pub fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("# a test\no mesh\n");
    for [x, y, z] in &mesh.positions {
        writeln!(text, "v {x} {y} {z}").expect("a String takes all");
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| v + 1);
        writeln!(text, "f {a} {b} {c}").expect("a String takes all");
    }
    text.into_bytes()
}

pub fn off(mesh: &Mesh) -> Vec<u8> {
    let mut text = format!("OFF\n{} {} 0\n", mesh.positions.len(), mesh.triangles.len());
    for [x, y, z] in &mesh.positions {
        writeln!(text, "{x} {y} {z}").expect("a String takes all");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c}").expect("a String takes all");
    }
    text.into_bytes()
}

/// Binary STL; the header begins with `header`, the normals are zero.
pub fn stl_binary(mesh: &Mesh, header: &str) -> Vec<u8> {
    let mut file = header.as_bytes().to_vec();
    file.resize(80, b' ');
    file.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in &mesh.triangles {
        file.extend([0; 12]);
        let points = t.map(|v| mesh.positions[v as usize]);
        file.extend(points.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        file.extend([0; 2]);
    }
    file
}

/// STL in text with the given ends of lines, the triangles spread over `solids` solids.
pub fn stl_ascii(mesh: &Mesh, end: &str, solids: usize) -> Vec<u8> {
    let mut text = String::new();
    let size = mesh.triangles.len().div_ceil(solids).max(1);
    for (i, solid) in mesh.triangles.chunks(size).enumerate() {
        write!(text, "solid s{i}{end}").expect("a String takes all");
        for t in solid {
            write!(text, "facet normal 0 0 0{end}  outer loop{end}").expect("a String takes all");
            for [x, y, z] in t.map(|v| mesh.positions[v as usize]) {
                write!(text, "    vertex {x} {y} {z}{end}").expect("a String takes all");
            }
            write!(text, "  endloop{end}endfacet{end}").expect("a String takes all");
        }
        write!(text, "endsolid s{i}{end}").expect("a String takes all");
    }
    text.into_bytes()
}
