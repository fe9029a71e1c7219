//! `cargo xtask fleet`: several hosts under faults, the ranking of a large event, and a long load. The commands are in `xtask/fleet`, in Python.

use crate::cargo::build_server;
use crate::docker::MOTO;
use crate::python::{Environment, interpreter, succeeds};
use crate::{apt, workspace};
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::path::PathBuf;
use std::process::Command;

#[derive(Args)]
pub(crate) struct FleetOptions {
    /// Take this program instead of building one.
    #[arg(long)]
    program: Option<PathBuf>,
    /// Build without optimisation of the server.
    #[arg(long)]
    debug: bool,
    /// chaos, upgrade, partition, board or soak, with its options; `chaos --help` lists them.
    #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
    command: Vec<String>,
}

/// Builds, prepares Python, Postgres, the proxy and the object store, and runs the command. False if it does not hold.
pub(crate) fn run(options: &FleetOptions) -> Result<bool> {
    let program = match &options.program {
        Some(program) => program.clone(),
        None => build_server(!options.debug)?,
    };
    let environment = Environment::prepare()?;
    ensure!(apt::postgres(), "Postgres is not installed (Debian: apt-get install postgresql)");
    for (name, package) in [("haproxy", "haproxy"), ("nft", "nftables"), ("ip", "iproute2")] {
        let there = || succeeds(Command::new(name).arg("-V")) || succeeds(Command::new(name).arg("-v"));
        ensure!(
            there() || (apt::install(package) && there()),
            "{name} is missing (Debian: apt-get install {package})"
        );
    }
    let mut fleet = environment.python();
    fleet.current_dir(workspace::root().join("xtask")).args(["-m", "fleet", "--program"]).arg(&program);
    fleet.arg("--moto").arg(moto()?).args(&options.command);
    Ok(fleet.status().context("cannot start Python")?.success())
}

/// The program of the object store, in an environment of its own.
fn moto() -> Result<PathBuf> {
    let folder = workspace::root().join("target/fleet-python");
    let program = folder.join("bin/moto_server");
    if !program.exists() {
        let mut venv = Command::new(interpreter()?);
        ensure!(succeeds(venv.args(["-m", "venv"]).arg(&folder)), "cannot make {}", folder.display());
        let mut pip = Command::new(folder.join("bin/python"));
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", MOTO];
        ensure!(succeeds(pip.args(install)), "pip could not install {MOTO}");
    }
    Ok(program)
}
