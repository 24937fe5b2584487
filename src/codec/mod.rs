//! The compressed file `MESH.cmz`: smaller than Draco's, written and read in bounded memory.
//!
//! ```text
//!   folder ──deal──> chunks by place ──┬──code, in parallel──> bytes ─────────┐
//!                                      └──> uses of shared vertices           ▼
//!                                              └──seam──> references ──> MESH.cmz, index behind
//! ```
//!
//! A chunk is walked triangle by triangle ([`walk`]): what lies behind each gate of the cut border,
//! and where each new vertex lies ([`place`]: predicted by weights that learn, coded by the spread
//! that is expected of it), is told to a binary range coder ([`range`]) with the probability that
//! a model ([`model`], [`mix`]) gives it. Encoder and decoder run the same walk: the one tells the
//! coder, the other is told, and what only the encoder knows sits behind one trait ([`truth`]).
//!
//! Why it is exact: positions are integers, and each triangle's tip is named outright. Why it is
//! the same on every machine: all that a decoder repeats is integer arithmetic.
//!
//! Memory: a chunk has at most 2^20 triangles, so each thread holds a bounded piece; fewer threads
//! run when the budget has no room for all. `docs/format.md` specifies the file.

pub mod around;
pub mod border;
pub mod chunk;
mod chunks;
mod code;
mod cut;
mod deal;
pub mod decode;
pub mod encode;
pub mod file;
mod gather;
pub mod grid;
mod labels;
pub mod lattice;
mod least;
pub mod mix;
pub mod model;
pub mod numbers;
mod out;
pub mod packed;
pub mod part;
pub mod place;
pub mod predict;
pub mod range;
mod reorder;
mod rows;
pub mod seam;
pub mod spread;
mod step;
#[cfg(test)]
mod tests;
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
