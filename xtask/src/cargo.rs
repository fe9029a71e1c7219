//! Calls of cargo.

use crate::workspace;
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The cargo that runs this program, at the root of the repository.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(workspace::root());
    command
}

/// Builds the server and returns the path of the program.
pub(crate) fn build_server(release: bool) -> Result<PathBuf> {
    build("palmares", release)
}

/// Builds the program of the package of the same name and returns its path, as cargo reports it: the target directory can be
/// set in several ways.
pub(crate) fn build(package: &str, release: bool) -> Result<PathBuf> {
    built(package, "--bin", package, release)
}

/// Builds an example in the release profile, for measurements, and returns its path.
pub(crate) fn build_example(package: &str, example: &str) -> Result<PathBuf> {
    built(package, "--example", example, true)
}

/// Builds the compiled part of the Python package, puts it among its files, and returns its path.
pub(crate) fn build_extension(release: bool) -> Result<PathBuf> {
    let mut build = cargo();
    build.args(["build", "--package", "palmares-native", "--message-format", "json-render-diagnostics"]);
    if release {
        build.arg("--release");
    }
    let output = build.stderr(Stdio::inherit()).output().context("cannot start cargo")?;
    ensure!(output.status.success(), "palmares-native does not build; see the messages above");
    let messages = String::from_utf8_lossy(&output.stdout);
    let library = messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .filter(|message| message["target"]["name"] == "_native")
        .find_map(|message| message["filenames"][0].as_str().map(PathBuf::from))
        .context("cargo did not say where it put the compiled part of the Python package")?;
    let place = workspace::root().join("client-py/src/palmares/_native.abi3.so");
    // The old file is removed first: a process may have it in use.
    let _ = std::fs::remove_file(&place);
    std::fs::copy(&library, &place).with_context(|| format!("{}", place.display()))?;
    Ok(place)
}

fn built(package: &str, kind: &str, name: &str, release: bool) -> Result<PathBuf> {
    let mut build = cargo();
    build.args(["build", "--package", package, kind, name]);
    build.args(["--message-format", "json-render-diagnostics"]);
    if release {
        build.arg("--release");
    }
    let output = build.stderr(Stdio::inherit()).output().context("cannot start cargo")?;
    ensure!(output.status.success(), "{package} does not build; see the messages above");
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<Value>(line).ok())
        .filter(|message| message["target"]["name"] == name)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .with_context(|| format!("cargo did not say where it put the program `{name}`"))
}
