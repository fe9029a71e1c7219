//! `cargo xtask wheel`: the Python package with client, engine, program and pages in one file.

use crate::python::{Environment, project};
use crate::viewer;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::process::Stdio;

/// Builds it, and the source distribution when that is wanted too.
pub(crate) fn run(sdist: bool) -> Result<()> {
    eprintln!("== building the viewer");
    viewer::run()?;
    eprintln!("== building the wheel");
    let environment = Environment::prepare()?;
    let folder = workspace::root().join("target/wheels");
    // maturin names the oldest glibc that the wheel runs with, and refuses libraries that are not on every Linux.
    let mut maturin = environment.python();
    maturin
        .args(["-m", "maturin", "build", "--release", "--locked", "--auditwheel", "check", "--out"])
        .arg(&folder);
    if sdist {
        maturin.arg("--sdist");
    }
    let status =
        maturin.current_dir(project()).stdout(Stdio::null()).status().context("cannot start maturin")?;
    ensure!(status.success(), "the wheel could not be built; see above");
    let mut found: Vec<_> =
        std::fs::read_dir(&folder)?.filter_map(Result::ok).map(|entry| entry.path()).collect();
    found.sort();
    for file in found {
        println!("{}", file.display());
    }
    Ok(())
}
