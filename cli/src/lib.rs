//! The command line.

mod admin;
mod command;
mod health;
mod list;
mod replay;
mod schema;
mod task;
mod verify;

use clap::Parser;
use std::ffi::OsString;
use std::process::ExitCode;

/// Does what these arguments ask, the first of which names the program. Prints errors, and ends the process where they
/// cannot be read.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    match command::Cli::parse_from(arguments).run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("palmares: {error:#}");
            ExitCode::FAILURE
        }
    }
}
