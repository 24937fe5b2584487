//! Graphs of nodes and links with parity: which nodes hang together, how they must be flipped to
//! agree, and which sets cannot. Knows no triangles.
//!
//! [`forest`] joins them in memory; [`contract`] does in any memory what `carry` then carries
//! back. Both give [`labels`]: sets numbered by their smallest nodes. [`sets`] chooses.

pub mod bits;
mod carry;
pub mod contract;
pub mod forest;
pub mod labels;
mod records;
pub mod sets;
mod stop;
#[cfg(test)]
mod tests;
pub mod union;
