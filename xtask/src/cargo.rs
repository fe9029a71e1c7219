//! Calls of cargo.

use crate::workspace;
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The cargo that runs this program, at the root of the repository.
pub(crate) fn cargo() -> Command {
    let mut command = Command::new(program());
    command.current_dir(workspace::root());
    without_own_package(&mut command);
    command
}

/// As [`cargo`], with the lowest priority: for what is compiled while tests run.
pub(crate) fn idle_cargo() -> Command {
    let mut command = Command::new("nice");
    command.args(["-n", "19"]).arg(program()).current_dir(workspace::root());
    without_own_package(&mut command);
    command
}

/// Removes the variables in which the cargo that runs this program describes this package. Build scripts that read them, as that of
/// ring, would run again whenever a build is started in another way, and everything that uses their crate would be compiled again.
pub(crate) fn without_own_package(command: &mut Command) {
    for (name, _) in std::env::vars_os() {
        if ["CARGO_PKG_", "CARGO_MANIFEST_"].iter().any(|begin| name.to_string_lossy().starts_with(begin)) {
            command.env_remove(name);
        }
    }
}

fn program() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
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

/// Builds the compiled part of the Python package in the release profile, for measurements, and puts it among its files.
pub(crate) fn build_extension() -> Result<()> {
    let mut build = cargo();
    build.args(["build", "--package", "palmares-native", "--release"]);
    place_extension(&artifacts(&mut build)?)
}

/// Builds all tests, the server and the compiled part of the Python package, which it puts among its files; returns cargo's
/// messages about what it made. One command uses the processors better than three.
pub(crate) fn build_for_tests() -> Result<Vec<Value>> {
    let mut build = cargo();
    build.args(["build", "--workspace", "--lib", "--bins", "--tests", "--examples"]);
    let artifacts = artifacts(&mut build)?;
    place_extension(&artifacts)?;
    Ok(artifacts)
}

fn built(package: &str, kind: &str, name: &str, release: bool) -> Result<PathBuf> {
    let mut build = cargo();
    build.args(["build", "--package", package, kind, name]);
    if release {
        build.arg("--release");
    }
    executable(&artifacts(&mut build)?, name)
}

/// Runs a build and returns cargo's messages about the files that it made.
pub(crate) fn artifacts(build: &mut Command) -> Result<Vec<Value>> {
    build.args(["--message-format", "json-render-diagnostics"]);
    let output = build.stderr(Stdio::inherit()).output().context("cannot start cargo")?;
    ensure!(output.status.success(), "the build failed; see the messages above");
    let messages = String::from_utf8_lossy(&output.stdout);
    Ok(messages.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
}

/// The program or example of this name. Its own unit tests have the same name.
pub(crate) fn executable(artifacts: &[Value], name: &str) -> Result<PathBuf> {
    artifacts
        .iter()
        .filter(|message| message["target"]["name"] == name && message["profile"]["test"] == false)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .with_context(|| format!("cargo did not report the path of the program `{name}`"))
}

/// Puts the compiled part of the Python package among its files.
fn place_extension(artifacts: &[Value]) -> Result<()> {
    let library = artifacts
        .iter()
        .filter(|message| message["target"]["name"] == "_native" && message["profile"]["test"] == false)
        .find_map(|message| message["filenames"][0].as_str().map(PathBuf::from))
        .context("cargo did not report the path of the compiled part of the Python package")?;
    let place = workspace::root().join("client-py/src/palmares/_native.abi3.so");
    // The old file is removed first: a process may have it in use.
    let _ = std::fs::remove_file(&place);
    std::fs::copy(&library, &place).with_context(|| format!("{}", place.display()))?;
    Ok(())
}
