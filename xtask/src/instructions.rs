//! The regression gate on instruction counts: valgrind and gungraun's runner, installed where they are missing.

use crate::apt;
use crate::cargo::idle_cargo;
use crate::python::succeeds;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::{Command, Stdio};

/// The benchmark, compiled, or the reason why this machine cannot run it. It compiles and runs with the lowest priority.
pub(crate) fn counter() -> Result<Result<Command, String>> {
    let there = answers("valgrind") || (apt::install("valgrind") && answers("valgrind"));
    if !there {
        return Ok(Err("valgrind is not installed (Debian's package `valgrind`), and could not be".into()));
    }
    let version = runner_version()?;
    let tools = workspace::root().join("target/tools");
    let runner = tools.join("bin/gungraun-runner");
    if !has_version(&runner, &version) {
        println!("installing gungraun-runner {version} in {}", tools.display());
        let mut install = idle_cargo();
        install.args(["install", "--quiet", "--debug", "--version", &version, "--root"]).arg(&tools);
        let status = install.arg("gungraun-runner").status().context("cannot start cargo")?;
        ensure!(status.success(), "gungraun-runner {version} does not install; see the messages above");
    }
    let named = ["bench", "--package", "palmares-sim", "--bench", "instructions"];
    let built =
        idle_cargo().args(named).args(["--no-run", "--quiet"]).status().context("cannot start cargo")?;
    ensure!(built.success(), "the benchmark does not compile; see the messages above");
    let mut bench = idle_cargo();
    bench.args(named).env("GUNGRAUN_RUNNER", runner);
    Ok(Ok(bench))
}

fn answers(program: &str) -> bool {
    succeeds(Command::new(program).arg("--version"))
}

/// The library's version in Cargo.lock: the runner's must be the same.
fn runner_version() -> Result<String> {
    let lock =
        std::fs::read_to_string(workspace::root().join("Cargo.lock")).context("cannot read Cargo.lock")?;
    lock.split("[[package]]")
        .find(|package| package.contains("\nname = \"gungraun\"\n"))
        .and_then(|package| package.split("\nversion = \"").nth(1)?.split('"').next())
        .map(str::to_owned)
        .context("Cargo.lock knows no package gungraun")
}

fn has_version(runner: &Path, version: &str) -> bool {
    Command::new(runner)
        .arg("--version")
        .stderr(Stdio::null())
        .output()
        .is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains(version))
}
