//! A test of what the Python module links: it must build without the server, as on Windows.

use crate::cargo::cargo;
use anyhow::{Context, Result, ensure};
use std::path::Path;

/// Crates that do not build on Windows, or are there for the server only.
const SERVER_ONLY: [&str; 6] = ["palmares-server", "axum", "hyper", "rust-embed", "sqlx", "tokio"];
/// A target for which the Python module is built without the server. Only cargo's lists are read: it need not
/// be installed.
const WITHOUT_SERVER: &str = "x86_64-pc-windows-msvc";

/// Fails where the Python module, built without its feature `server`, links the server, or a crate that it links uses Unix without
/// `#[cfg(unix)]`. It compiles nothing.
pub(crate) fn check_without_server() -> Result<()> {
    let mut tree = cargo();
    tree.args(["tree", "--package", "palmares-native", "--no-default-features", "--target", WITHOUT_SERVER]);
    let output =
        tree.args(["--edges", "normal", "--prefix", "none"]).output().context("cannot start cargo")?;
    ensure!(output.status.success(), "cargo tree: {}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8_lossy(&output.stdout);
    let linked = lines.lines().filter_map(|line| line.split(' ').next());
    let wrong: Vec<&str> = linked.filter(|name| SERVER_ONLY.contains(name)).collect();
    ensure!(
        wrong.is_empty(),
        "the Python module links {} without its feature `server`; `cargo tree --package palmares-native \
         --no-default-features --target {WITHOUT_SERVER} --invert {}` shows through which crate",
        wrong.join(", "),
        wrong[0]
    );
    // `palmares-sim v0.2.0 (/…/sim)`; a crate that was listed before is followed by `(*)`.
    let folders = lines.lines().filter_map(|line| line.split(" (/").nth(1)?.split(')').next());
    let mut folders: Vec<String> = folders.map(|folder| format!("/{folder}/src")).collect();
    folders.sort();
    folders.dedup();
    ensure!(!folders.is_empty(), "cargo tree names no crate of this workspace:\n{lines}");
    let found =
        folders.iter().map(|folder| unguarded(Path::new(folder))).collect::<Result<Vec<_>>>()?.concat();
    ensure!(found.is_empty(), "without #[cfg(unix)] on the line before:\n{}", found.join("\n"));
    Ok(())
}

/// Lines that use Unix without a guard on the line before, in all files of a folder but those of tests.
fn unguarded(folder: &Path) -> Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| format!("{}", folder.display()))? {
        let path = entry?.path();
        if path.file_stem().is_some_and(|name| name == "tests") {
            continue;
        }
        if path.is_dir() {
            found.extend(unguarded(&path)?);
        } else if path.extension().is_some_and(|end| end == "rs") {
            let text = std::fs::read_to_string(&path).with_context(|| format!("{}", path.display()))?;
            found.extend(unguarded_lines(&text).map(|line| format!("{}:{line}", path.display())));
        }
    }
    Ok(found)
}

fn unguarded_lines(text: &str) -> impl Iterator<Item = usize> {
    let before = std::iter::once("").chain(text.lines());
    text.lines().zip(before).enumerate().filter_map(|(at, (line, before))| {
        let unix = line.contains("os::unix") || line.contains("signal::unix") || line.contains("io::unix");
        (unix && before.trim() != "#[cfg(unix)]").then_some(at + 1)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unix_without_a_guard_is_found() {
        let text = "#[cfg(unix)]\nuse std::os::unix::fs::symlink;\n\nuse tokio::signal::unix::signal;\n";
        assert_eq!(unguarded_lines(text).collect::<Vec<_>>(), [4]);
    }

    #[test]
    fn the_python_module_builds_without_the_server() {
        check_without_server().expect("sound");
    }
}
