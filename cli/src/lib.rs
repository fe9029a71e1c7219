//! The command line.
//!
//! | part | content |
//! |---|---|
//! | `cli/src/command.rs` | the commands, and their options |
//! | `cli/src/admin/` | `palmares admin`, which calls a running server |
//! | `cli/src/task/` | `palmares task`: checks of a task of your own |
//! | `cli/src/verify/` | `palmares verify`: one replay, or all of a season |
//! | `cli/src/render/` | `palmares render`: films and pictures of runs |
//! | `cli/src/http/` | requests over HTTP and TLS |

mod admin;
mod command;
mod environment;
mod health;
mod http;
mod keys;
mod list;
mod progress;
mod render;
mod replay;
mod schema;
mod server;
mod task;
mod verify;
mod version;

pub use version::version;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Runs the command of these arguments, the first of which is the program's name. Prints errors; ends the process if the arguments are
/// not valid.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    match command::Cli::read(arguments).run() {
        Ok(code) => code,
        Err(error) => {
            // The reader of the output, such as `head`, has closed it: no failure, and nothing to print.
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
