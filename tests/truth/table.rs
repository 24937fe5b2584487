//! What must become of every mesh file that `TRUTH.json` does not name: read, with which result,
//! or refused, with which words. Where that is a matter of opinion, the row says why.

/// How a build of the file must end.
pub enum End {
    /// Exit 0, V and G as the naive reader finds them.
    Reads,
    /// Exit 0 and a folder of no triangle.
    Empty,
    /// Exit 3; the message has one of the words, whatever their case.
    Refused(&'static [&'static str]),
}

use End::{Empty, Reads, Refused};

/// A message about a file without faces says so, or what the file is instead.
const NO_FACES: End = Refused(&["no face", "point cloud", "no triangle", "expected a mesh"]);
/// A format that the program does not read.
const UNKNOWN: End = Refused(&["format"]);
const EMPTY_FILE: End = Refused(&["empty", "0 bytes"]);
/// A polygon of fewer than three corners.
const FEW_CORNERS: End = Refused(&["corner", "at least 3", "vertices", "indices"]);
const NO_SUCH_VERTEX: End = Refused(&["vertex", "vertices"]);

pub const TABLE: &[(&str, End)] = &[
    // Elevation grids: no mesh, and no format that the program knows.
    ("dem_publicdomain/SainteHelens.dem", UNKNOWN),
    ("dem_publicdomain/etopo20.cdf", UNKNOWN),
    ("geometrycentral_MIT/fan3.obj", Reads),
    ("geometrycentral_MIT/hourglass_ico.obj", Reads),
    ("geometrycentral_MIT/moebius.obj", Reads),
    ("geometrycentral_MIT/triple_vierbein.obj", Reads),
    ("hostile_assimp_BSD3/2CylinderEngine.glb", UNKNOWN),
    // Claims 353 billion vertices in 309 bytes: refused without reserving for them, either for the
    // claim itself, or where the eighth vertex is followed by a face.
    (
        "hostile_assimp_BSD3/OutOfMemory.off",
        Refused(&["353535235358", "line 11"]),
    ),
    ("hostile_assimp_BSD3/box.obj", Reads),
    // OBJ is ASCII; decoding UTF-16 would be guessing, so the message must name the encoding.
    (
        "hostile_assimp_BSD3/box_UTF16BE.obj",
        Refused(&["utf-16", "utf16", "not text", "encoding"]),
    ),
    // A polygon of some hundred corners on one line, that runs over four vertices again and again:
    // odd but well-formed; the degenerate triangles of its fan are listed.
    ("hostile_assimp_BSD3/box_longline.obj", Reads),
    ("hostile_assimp_BSD3/box_mat_with_spaces.obj", Reads),
    ("hostile_assimp_BSD3/box_without_lineending.obj", Reads),
    // Fanned like any polygon; that a fan of a concave one overlaps is no matter of topology.
    ("hostile_assimp_BSD3/concave_polygon.obj", Reads),
    (
        "hostile_assimp_BSD3/crash-30d6d0f7c529b3b66b4131700b7a4580cd7082df.ply",
        Refused(&["property", "header"]),
    ),
    // No byte at all: a failed export, not a mesh without triangles.
    ("hostile_assimp_BSD3/empty.obj", EMPTY_FILE),
    ("hostile_assimp_BSD3/empty.off", EMPTY_FILE),
    ("hostile_assimp_BSD3/empty.ply", EMPTY_FILE),
    // Four faces announced, of which the first has no corner and the rest is missing.
    (
        "hostile_assimp_BSD3/invalid.off",
        Refused(&["face", "corner", "expected", "end"]),
    ),
    // The line `element face` is lost: the list belongs to the vertices, and there is no face.
    (
        "hostile_assimp_BSD3/issue623.ply",
        Refused(&["face", "list", "point cloud"]),
    ),
    // Indices 12 and 0 among 8 vertices. A vertex may follow the face that names it, so 0, though
    // it stands later, may be seen first.
    (
        "hostile_assimp_BSD3/malformed.obj",
        Refused(&["12", "from 1"]),
    ),
    ("hostile_assimp_BSD3/malformed2.obj", FEW_CORNERS),
    ("hostile_assimp_BSD3/multiple_spaces.obj", Reads),
    // `3.1+e2` is no number in any language. Taking it for 3.1, as some readers do, would be a
    // silent repair.
    (
        "hostile_assimp_BSD3/number_formats.obj",
        Refused(&["3.1+e2"]),
    ),
    ("hostile_assimp_BSD3/only_a_part_of_vertexcolors.obj", Reads),
    // Two elements of the same name, a format line without a version, lists of garbage.
    (
        "hostile_assimp_BSD3/payload_JVN42386607",
        Refused(&["format", "element", "header"]),
    ),
    ("hostile_assimp_BSD3/point_cloud.obj", NO_FACES),
    ("hostile_assimp_BSD3/points.ply", Refused(&["point cloud"])),
    ("hostile_assimp_BSD3/pond.0.ply", Refused(&["point cloud"])),
    ("hostile_assimp_BSD3/regr01.obj", Reads),
    ("hostile_assimp_BSD3/spider.obj", Reads),
    ("hostile_assimp_BSD3/testline.obj", NO_FACES),
    ("hostile_assimp_BSD3/testmixed.obj", Reads),
    ("hostile_assimp_BSD3/testpoints.obj", NO_FACES),
    // Faces stand before vertices in the first; any order of elements is legal.
    ("hostile_happly_MIT/platonic_shelf.ply", Reads),
    ("hostile_happly_MIT/platonic_shelf_big_endian.ply", Reads),
    // Well-formed PLY of other things than meshes.
    ("hostile_plyrs_MIT/all_atomic_types_ok_ascii.ply", NO_FACES),
    // Faces are declared, and there are none, nor vertices: a mesh without triangles, such as an
    // empty tile. With vertices it would be a point cloud.
    ("hostile_plyrs_MIT/empty_2_ok_ascii.ply", Empty),
    ("hostile_plyrs_MIT/empty_2_ok_little_endian.ply", Empty),
    ("hostile_plyrs_MIT/empty_ok_ascii.ply", Empty),
    ("hostile_plyrs_MIT/exponent_values_ok_ascii.ply", NO_FACES),
    // No element at all is no mesh, unlike an element `face` of count 0.
    ("hostile_plyrs_MIT/header_min_ok_ascii.ply", NO_FACES),
    ("hostile_plyrs_MIT/leading_spaces_ok_ascii.ply", NO_FACES),
    ("hostile_plyrs_MIT/single_elements_err_ascii.ply", NO_FACES),
    ("hostile_plyrs_MIT/single_elements_ok_ascii.ply", NO_FACES),
    ("hostile_tinyobj_MIT/afl.tar.gz", UNKNOWN),
    ("hostile_tinyobj_MIT/catmark_torus_creases0.obj", Reads),
    ("hostile_tinyobj_MIT/colorspace-issue-184.obj", Reads),
    ("hostile_tinyobj_MIT/cornell_box.obj", Reads),
    ("hostile_tinyobj_MIT/cornell_box_multimaterial.obj", Reads),
    ("hostile_tinyobj_MIT/cube-vertex-w-component.obj", Reads),
    ("hostile_tinyobj_MIT/cube-vertexcol.obj", Reads),
    ("hostile_tinyobj_MIT/cube.obj", Reads),
    (
        "hostile_tinyobj_MIT/invalid-face-definition.obj",
        FEW_CORNERS,
    ),
    (
        "hostile_tinyobj_MIT/invalid-relative-texture-index.obj",
        NO_SUCH_VERTEX,
    ),
    (
        "hostile_tinyobj_MIT/invalid-relative-vertex-index.obj",
        NO_SUCH_VERTEX,
    ),
    ("hostile_tinyobj_MIT/issue-138.obj", Reads),
    // OBJ counts from 1: 0 is refused, not taken for the first.
    (
        "hostile_tinyobj_MIT/issue-140-zero-face-idx.obj",
        Refused(&["from 1", "at 1"]),
    ),
    ("hostile_tinyobj_MIT/issue-161-inconsistent-f.obj", Reads),
    ("hostile_tinyobj_MIT/issue-162-smoothing-group.obj", Reads),
    ("hostile_tinyobj_MIT/issue-177.obj", Reads),
    ("hostile_tinyobj_MIT/issue-235-usemtl-then-o.obj", Reads),
    ("hostile_tinyobj_MIT/issue-244-mtl-searchpaths.obj", Reads),
    ("hostile_tinyobj_MIT/issue-246-usemtl-whitespace.obj", Reads),
    ("hostile_tinyobj_MIT/issue-248-texres-texopt.obj", Reads),
    (
        "hostile_tinyobj_MIT/issue-295-trianguation-failure.obj",
        Reads,
    ),
    ("hostile_tinyobj_MIT/issue-319-002.obj", Reads),
    ("hostile_tinyobj_MIT/issue-319-003.obj", Reads),
    ("hostile_tinyobj_MIT/issue-330.obj", Reads),
    (
        "hostile_tinyobj_MIT/issue-356-leading-spaces-newmtl.obj",
        NO_FACES,
    ),
    ("hostile_tinyobj_MIT/issue-92.obj", Reads),
    ("hostile_tinyobj_MIT/issue-95-2.obj", Reads),
    ("hostile_tinyobj_MIT/issue-95.obj", Reads),
    (
        "hostile_tinyobj_MIT/leading-decimal-dot-issue-201.obj",
        Reads,
    ),
    (
        "hostile_tinyobj_MIT/leading-zero-in-exponent-notation-issue-210.obj",
        Reads,
    ),
    ("hostile_tinyobj_MIT/line-prim.obj", NO_FACES),
    ("hostile_tinyobj_MIT/map-bump.obj", Reads),
    ("hostile_tinyobj_MIT/missing_material_file.obj", Reads),
    (
        "hostile_tinyobj_MIT/mtl filename with whitespace issue46.obj",
        Reads,
    ),
    (
        "hostile_tinyobj_MIT/mtllib-multiple-files-issue-112.obj",
        Reads,
    ),
    ("hostile_tinyobj_MIT/no_material.obj", Reads),
    ("hostile_tinyobj_MIT/norm-texopt.obj", Reads),
    ("hostile_tinyobj_MIT/pbr-mat-ext.obj", Reads),
    ("hostile_tinyobj_MIT/points-prim.obj", NO_FACES),
    ("hostile_tinyobj_MIT/refl.obj", Reads),
    ("hostile_tinyobj_MIT/skin-weight.obj", Reads),
    // Faces name normals that are commented out; normals are skipped, and so are their indices.
    ("hostile_tinyobj_MIT/smoothing-group-two-squares.obj", Reads),
    ("hostile_tinyobj_MIT/smoothing-normal.obj", Reads),
    // `nan` and `inf` are coordinates, if odd ones. `1.#IND` is how one C library of the past
    // printed NaN: no number by the format, so refused with its line rather than guessed.
    ("hostile_tinyobj_MIT/test-nan.obj", Refused(&["1.#IND"])),
    (
        "hostile_tinyobj_MIT/texture-filename-with-whitespace.obj",
        Reads,
    ),
    ("hostile_tinyobj_MIT/texture-options-issue-85.obj", Reads),
    ("hostile_tinyobj_MIT/tr-and-d-issue-43.obj", Reads),
    ("hostile_tinyobj_MIT/usemtl-issue-104.obj", Reads),
    ("hostile_tinyobj_MIT/usemtl-issue-68.obj", Reads),
    ("manifold_Apache2/Cray_left.obj", Reads),
    ("manifold_Apache2/hull-mask.obj", Reads),
    ("manifold_Apache2/openscad-nonmanifold-crash.obj", Reads),
    ("manifold_Apache2/self_intersectA.obj", Reads),
    ("trimesh_MIT/joined_tetrahedra.obj", Reads),
    ("trimesh_MIT/negative_indices.obj", Reads),
    ("trimesh_MIT/notenoughindices.obj", FEW_CORNERS),
    // `1//` has empty fields where a texture and a normal may stand: the vertex is there, and no
    // more is needed.
    ("trimesh_MIT/polygonfaces.obj", Reads),
];

/// Files too large to keep beside the tests; tried when `CORNERMILL_MESHES` names a folder that has
/// them.
pub const LARGE: &[&str] = &[
    "dem_publicdomain/SainteHelens.dem",
    "dem_publicdomain/etopo20.cdf",
    "hostile_assimp_BSD3/2CylinderEngine.glb",
    "hostile_assimp_BSD3/pond.0.ply",
    "manifold_Apache2/hull-mask.obj",
    "manifold_Apache2/self_intersectA.obj",
    "trimesh_MIT/cycloidal.ply",
];

/// Counts in which `TRUTH.json` speaks of another mesh than the file. The reader behind it splits
/// vertices by the texture coordinates that these faces carry (664 vertices, cut at the seams of
/// the texture). Their headers say 502, and V and G are those of the file: texture is skipped.
pub const CORRECTED: &[(&str, &[(&str, u64)])] = &[
    ("trimesh_MIT/fuze.ply", FUZE),
    // Has more values on its face lines than its header declares: read line by line, as PLY in text
    // is meant, the declared ones come first.
    ("trimesh_MIT/fuze_ascii.ply", FUZE),
];

const FUZE: &[(&str, u64)] = &[
    ("border_edges", 0),
    ("border_loops", 0),
    ("nonmanifold_vertices", 0),
    ("components", 1),
    ("distinct_edges", 1500),
    ("vertices", 502),
];
