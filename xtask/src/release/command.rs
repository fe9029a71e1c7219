//! Output of commands.

use crate::workspace;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::Command;

/// Output of git.
pub(super) fn git(arguments: &[&str]) -> Result<String> {
    output(Command::new("git").args(arguments), &workspace::root())
}

/// Output of a command in `folder`; its error output as the error if it fails.
pub(super) fn output(command: &mut Command, folder: &Path) -> Result<String> {
    let output = command.current_dir(folder).output().with_context(|| format!("cannot start {command:?}"))?;
    if !output.status.success() {
        bail!("{command:?} failed:\n{}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}
