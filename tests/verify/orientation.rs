//! Bits and orientations that do not follow the option.

use crate::breaks::{broken, notice, strip, torus};
use crate::meshes;
use cornermill::folder::Orient;
use cornermill::verify::{At, Check};

#[test]
fn notices_wrong_bits() {
    notice(&broken(
        "a bit beyond the last triangle",
        strip(),
        |p| p.flipped[0] |= 0x80,
        (Check::FlippedBits, At::Byte(4096)),
        "flipped.npy: byte 4096: 0x80, with bits beyond the last triangle; expected zeros there",
    ));
    notice(&broken(
        "a degenerate triangle turned",
        strip(),
        |p| p.flipped[0] |= 1 << 2,
        (Check::FlippedBits, At::Triangle(2)),
        "flipped.npy: triangle 2: bit 1; expected 0 (the triangle is degenerate)",
    ));
    notice(&broken(
        "a bit too many",
        torus(),
        |p| p.flipped[1] ^= 1,
        (Check::ComponentTable, At::Component(0)),
        "components.npy: component 0: flipped is 6; expected 7",
    ));
    notice(&broken(
        "a bit too many, for the edges",
        torus(),
        |p| p.flipped[1] ^= 1,
        (Check::Counts, At::Key("inconsistent_edges")),
        "manifest.json: inconsistent_edges: the count is 16; expected 17",
    ));
}

#[test]
fn notices_wrong_orientation() {
    let inside_out = || meshes::flip(meshes::tetra(), |_| true);
    notice(&broken(
        "majority given as outward",
        (inside_out(), Orient::Majority),
        |p| p.orient = Orient::Outward,
        (Check::Orientation, At::Component(0)),
        "components.npy: component 0: six_volume is -1e0; \
         expected a positive one (outward)",
    ));
    notice(&broken(
        "outward given as majority",
        (inside_out(), Orient::Outward),
        |p| {
            p.orient = Orient::Majority;
            p.rows[0].outward = 0;
        },
        (Check::Orientation, At::Component(0)),
        "flipped.npy: component 0: 4 of 4 triangles flipped; \
         expected fewer than half, or half without the first triangle",
    ));
    notice(&broken(
        "a tie that leaves the first triangle flipped",
        (meshes::flip(meshes::tetra(), |t| t < 2), Orient::Outward),
        |p| {
            p.orient = Orient::Majority;
            p.rows[0].outward = 0;
        },
        (Check::Orientation, At::Component(0)),
        "flipped.npy: component 0: 2 of 4 triangles flipped; \
         expected fewer than half, or half without the first triangle",
    ));
    notice(&broken(
        "majority given as first",
        (meshes::flip(meshes::tetra(), |t| t == 0), Orient::Majority),
        |p| p.orient = Orient::First,
        (Check::Orientation, At::Component(0)),
        "flipped.npy: component 0: its first triangle 0 is flipped; \
         expected one that is not",
    ));
    notice(&broken(
        "first given as majority",
        (meshes::flip(meshes::tetra(), |t| t == 0), Orient::First),
        |p| p.orient = Orient::Majority,
        (Check::Orientation, At::Component(0)),
        "flipped.npy: component 0: 3 of 4 triangles flipped; \
         expected fewer than half, or half without the first triangle",
    ));
    notice(&broken(
        "turned under keep",
        (inside_out(), Orient::Outward),
        |p| {
            p.orient = Orient::Keep;
            p.rows[0].outward = 0;
        },
        (Check::Orientation, At::Component(0)),
        "flipped.npy: component 0: 4 of 4 triangles flipped; \
         expected 0 (the option keeps the input's orientation)",
    ));
    notice(&broken(
        "left inconsistent",
        (meshes::flip(meshes::tetra(), |t| t == 0), Orient::Keep),
        |p| p.orient = Orient::First,
        (Check::Orientation, At::Corner(0)),
        "V.npy: corner 0: its edge runs the same way in both triangles (3 such edges in component 0); \
         expected opposite ways",
    ));
    notice(&broken(
        "a triangle of a Moebius strip turned",
        (meshes::moebius(7), Orient::Outward),
        |p| {
            p.flipped[0] |= 1 << 3;
            p.rows[0].flipped = 1;
            p.counts.flipped_triangles = 1;
        },
        (Check::Orientation, At::Component(0)),
        "flipped.npy: component 0: 1 of 14 triangles flipped; \
         expected 0 (the component has no consistent orientation)",
    ));
    notice(&broken(
        "a closed surface that claims no sign",
        (meshes::tetra(), Orient::Outward),
        |p| p.rows[0].outward = 0,
        (Check::ComponentTable, At::Component(0)),
        "components.npy: component 0: outward is 0; expected 1",
    ));
}
