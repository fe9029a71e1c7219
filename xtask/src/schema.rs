//! `cargo xtask schema`: the descriptions of messages and addresses in docs/schema, and the tables of channels in
//! docs/senses.md.

use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What `palmares schema` can print.
const KINDS: [&str; 3] = ["control", "watch", "openapi"];

/// Tables that `palmares schema` can print. In docs/senses.md each is between `<!-- KIND -->` and `<!-- /KIND -->`.
const TABLES: [&str; 2] = ["channels", "images"];

/// Every file with the text that it should have.
fn files(program: &Path) -> Result<Vec<(PathBuf, String)>> {
    let docs = workspace::root().join("docs");
    let mut files = Vec::new();
    for kind in KINDS {
        files.push((docs.join("schema").join(format!("{kind}.json")), printed(program, kind)?));
    }
    let senses = docs.join("senses.md");
    let mut text =
        fs::read_to_string(&senses).with_context(|| format!("cannot read {}", senses.display()))?;
    for kind in TABLES {
        let [begin, end] = [format!("<!-- {kind} -->\n"), format!("<!-- /{kind} -->")];
        let from = text.find(&begin).map(|at| at + begin.len());
        let to = text.find(&end);
        let (Some(from), Some(to)) = (from, to) else {
            anyhow::bail!("{}: no lines {} and {end}", senses.display(), begin.trim_end());
        };
        text.replace_range(from..to, &printed(program, kind)?);
    }
    files.push((senses, text));
    Ok(files)
}

/// The output of `palmares schema KIND`.
fn printed(program: &Path, kind: &str) -> Result<String> {
    let output = Command::new(program).args(["schema", kind]).output();
    let output = output.with_context(|| format!("cannot start {}", program.display()))?;
    ensure!(output.status.success(), "palmares schema {kind}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(String::from_utf8(output.stdout)?)
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

/// Fails when a file is not what the program would write now.
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
