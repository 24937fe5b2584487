//! What the fuzz targets do with any bytes: one function a target, each of which panics when the
//! program breaks a promise. `targets/` hands them to libFuzzer; `tests/corpus.rs` of the
//! program includes this file and runs them over the kept corpus.
//!
//! A refusal is right when it is an error of the input that says what was expected and what was
//! found, in a line that a terminal can print. What is accepted must be right: indices name
//! vertices, folders pass `verify`, and another way through the program gives the same bytes.

mod packed;
mod place;
mod readers;
mod sealed;
mod whole;

pub use packed::cmz;
pub use readers::{npy, obj, off, ply, stl};
pub use sealed::manifest;
pub use whole::whole;

/// A target: its name and what it does.
pub type Target = (&'static str, fn(&[u8]));

/// All of them.
pub const TARGETS: [Target; 8] = [
    ("ply", ply),
    ("stl", stl),
    ("obj", obj),
    ("off", off),
    ("npy", npy),
    ("manifest", manifest),
    ("whole", whole),
    ("cmz", cmz),
];
