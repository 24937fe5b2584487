//! Pure kernels on one chunk of consecutive triangles. Slices in, slices out, no I/O.
//!
//! A kernel works on chunk-local ids (u32), so its tables are dense and small whatever the
//! width of the ids on disk. Corners are chunk-local too, as the input has them: `3t + k`.
//!
//! Memory: the caller's; each kernel's working set is stated with it, in bytes per triangle.

mod chains;
pub mod grid;
pub mod ids;
pub mod measure;
pub mod pair;
pub mod star;
#[cfg(test)]
mod star_tests;
pub mod swirl;
