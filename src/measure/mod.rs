//! What a finished folder tells besides what is in it: one file or directory a measure.
//!
//! Nothing here changes a folder: what is computed goes to files beside it.

pub mod normals;
