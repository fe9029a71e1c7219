//! Environment variables. An empty one is as if it were not set: scripts, compose files and manifests clear a variable so.

use clap::{Arg, Command};
use std::ffi::OsString;

/// The value of a variable; None if it is not set, or empty.
pub(crate) fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|value| !value.is_empty())
}

/// The command, whose options do not read empty variables.
pub(crate) fn without_empty_variables(command: Command) -> Command {
    let read = |option: Arg| {
        let value = option.get_env().and_then(std::env::var_os);
        if value.is_some_and(|value| value.is_empty()) { option.env(None::<&str>) } else { option }
    };
    command.mut_args(read).mut_subcommands(without_empty_variables)
}
