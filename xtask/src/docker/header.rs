//! The commands in the head of a deployment file: comment lines that are indented by three spaces.

use anyhow::{Context, Result, ensure};
use std::path::Path;

/// The commands, in their order.
pub(super) fn commands(file: &Path) -> Result<Vec<String>> {
    let text = std::fs::read_to_string(file).with_context(|| format!("{}", file.display()))?;
    let head = text.lines().take_while(|line| line.starts_with('#'));
    let commands: Vec<String> =
        head.filter_map(|line| line.strip_prefix("#   ")).map(str::to_owned).collect();
    ensure!(!commands.is_empty(), "{}: no commands in its head", file.display());
    Ok(commands)
}
