//! The compressed file.

pub mod border;
pub mod chunk;
mod deal;
pub mod decode;
pub mod encode;
pub mod file;
mod gather;
pub mod grid;
pub mod lattice;
pub mod mix;
pub mod model;
pub mod place;
pub mod predict;
pub mod range;
pub mod seam;
pub mod spread;
pub mod truth;
pub mod turned;
pub mod vec;
pub mod walk;

/// No corner, no edge, no vertex.
pub const NONE: u32 = u32::MAX;

/// What a decoder was told that no encoder says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damaged(pub &'static str);

/// How much is spent on smallness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// One context a bit.
    #[default]
    Fast,
    /// Several contexts a bit, mixed.
    Strong,
}
