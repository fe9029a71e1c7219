//! The command line.

mod admin;
mod command;
mod health;
mod list;
mod replay;
mod schema;
mod server;
mod task;
mod verify;

use clap::Parser;
use palmares_protocol::reply::ServerInfo;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// The version and commit of this program, as a server tells its clients.
pub fn version() -> ServerInfo {
    server::version()
}

/// Does what these arguments ask, the first of which names the program. Prints errors, and ends the process where they
/// cannot be read.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    match command::Cli::parse_from(arguments).run() {
        Ok(code) => code,
        Err(error) => {
            // Whoever read the output, `head` for one, may be gone: that is no failure, and there is nobody to be told.
            if let Some(error) = error.downcast_ref::<std::io::Error>()
                && error.kind() == std::io::ErrorKind::BrokenPipe
            {
                return ExitCode::SUCCESS;
            }
            let _ = writeln!(std::io::stderr(), "palmares: {error:#}");
            ExitCode::FAILURE
        }
    }
}
