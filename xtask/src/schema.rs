//! `cargo xtask schema`: the descriptions of messages and addresses in docs/schema.

use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The schemas that `palmares schema` prints.
const KINDS: [&str; 3] = ["control", "watch", "openapi"];

/// Every file with its expected text.
fn files(program: &Path) -> Result<Vec<(PathBuf, String)>> {
    let write = |kind: &str| {
        let output = Command::new(program).args(["schema", kind]).output();
        let output = output.with_context(|| format!("cannot start {}", program.display()))?;
        ensure!(
            output.status.success(),
            "palmares schema {kind}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        let path = workspace::root().join("docs/schema").join(format!("{kind}.json"));
        Ok((path, String::from_utf8(output.stdout)?))
    };
    KINDS.into_iter().map(write).collect()
}

/// Writes the files.
pub(crate) fn run(program: &Path) -> Result<()> {
    for (path, text) in files(program)? {
        fs::create_dir_all(path.parent().context("a folder")?)?;
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}

/// Fails when a file differs from the output of the program.
pub(crate) fn check(program: &Path) -> Result<()> {
    for (path, text) in files(program)? {
        let there = fs::read_to_string(&path).unwrap_or_default();
        let line = there.lines().zip(text.lines()).position(|(a, b)| a != b);
        let line = line.unwrap_or_else(|| there.lines().count().min(text.lines().count())) + 1;
        ensure!(
            there == text,
            "{}:{line} is not what the program says now; `cargo xtask schema` writes it anew",
            path.display()
        );
    }
    Ok(())
}
