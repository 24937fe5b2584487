//! Streams test meshes (placeholder entry point).
fn main() {}
