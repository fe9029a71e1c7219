//! `cargo xtask wheel`: the Python package with client, engine, program and pages in one file.

use crate::python::{Environment, create, interpreter, project};
use crate::viewer;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

#[derive(Args)]
pub(crate) struct Options {
    /// Build the source distribution as well.
    #[arg(long)]
    sdist: bool,
    /// Then install it into an empty environment, as a user does, play a first run and print the time.
    #[arg(long)]
    r#try: bool,
}

/// Builds the wheel and, if `--sdist` is given, the source distribution.
pub(crate) fn run(options: &Options) -> Result<()> {
    eprintln!("== building the viewer");
    viewer::run()?;
    eprintln!("== building the wheel");
    let environment = Environment::prepare()?;
    let folder = workspace::root().join("target/wheels");
    let maturin = |arguments: &[&str]| -> Result<()> {
        let mut maturin = environment.python();
        maturin.args(["-m", "maturin"]).args(arguments).arg("--out").arg(&folder);
        let status =
            maturin.current_dir(project()).stdout(Stdio::null()).status().context("cannot start maturin")?;
        ensure!(status.success(), "the package could not be built; see above");
        Ok(())
    };
    if options.sdist {
        // Without a wheel made of it: it has fewer crates than the lock file, which would have to change.
        maturin(&["sdist"])?;
    }
    // maturin names the oldest glibc that the wheel runs with, and refuses libraries that are not on every Linux.
    maturin(&["build", "--release", "--locked", "--auditwheel", "check"])?;
    let mut found: Vec<_> =
        std::fs::read_dir(&folder)?.filter_map(Result::ok).map(|entry| entry.path()).collect();
    found.sort();
    for file in &found {
        println!("{}", file.display());
    }
    if options.r#try {
        let wheel = found.iter().find(|file| file.extension().is_some_and(|end| end == "whl"));
        try_it(wheel.context("no wheel was made")?)?;
    }
    Ok(())
}

/// Installs the wheel into an empty environment and plays a first run with its program, from an empty folder.
fn try_it(wheel: &Path) -> Result<()> {
    let folder = tempfile::tempdir().context("cannot make a folder")?;
    let venv = folder.path().join("venv");
    let bin = venv.join(if cfg!(windows) { "Scripts" } else { "bin" });
    create(&interpreter()?, &venv)?;
    let took = |what: &str, command: &mut Command| -> Result<f64> {
        let begun = Instant::now();
        let status =
            command.current_dir(folder.path()).status().with_context(|| format!("cannot start {what}"))?;
        ensure!(status.success(), "{what} failed ({status}); see above");
        Ok(begun.elapsed().as_secs_f64())
    };
    eprintln!("== installing the wheel into an empty environment");
    let mut pip = Command::new(bin.join("pip"));
    pip.args(["install", "--quiet", "--disable-pip-version-check"]).arg(wheel);
    let install_s = took("pip install", &mut pip)?;
    eprintln!("== palmares demo");
    let demo_s = took("palmares demo", Command::new(bin.join("palmares")).arg("demo"))?;
    println!("pip install {install_s:.1} s, first score after {demo_s:.1} s more");
    Ok(())
}
