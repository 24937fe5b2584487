//! The `cornermill` command: arguments in, exit code out.
fn main() {}
