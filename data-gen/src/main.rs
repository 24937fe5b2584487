//! `data-gen`: writes a test mesh and, beside it, what it holds.

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match data_gen::args::run(&data_gen::Args::parse()) {
        Ok(summary) => {
            println!("{summary}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("data-gen: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
