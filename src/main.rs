//! The `cornermill` command: arguments in, exit code out.

use std::process::ExitCode;

fn main() -> ExitCode {
    cornermill::cli::run()
}
