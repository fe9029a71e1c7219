//! `cargo xtask wheel`: the Python package with client, engine, program and pages in one file.

use crate::cargo::without_own_package;
use crate::licences;
use crate::python::{Environment, create, interpreter, project};
use crate::viewer;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

#[derive(Args)]
pub(crate) struct WheelOptions {
    /// Build the source distribution, too.
    #[arg(long)]
    sdist: bool,
    /// Then install the wheel into an empty environment, play a first run, and print how long that took.
    #[arg(long)]
    r#try: bool,
}

/// Builds the wheel for this machine, and the source distribution if wanted. On Windows the wheel has no server and no pages.
pub(crate) fn run(options: &WheelOptions) -> Result<()> {
    if !cfg!(windows) {
        eprintln!("== building the viewer");
        viewer::run()?;
    }
    eprintln!("== building the wheel");
    let environment = Environment::prepare()?;
    let folder = workspace::root().join("target/wheels");
    write_licences()?;
    if options.sdist {
        maturin(&environment, &["sdist"], &folder)?;
    }
    // maturin names the oldest glibc that the wheel runs with, and refuses libraries that are not on every Linux.
    let build = ["build", "--release", "--locked", "--auditwheel", "check"];
    let features: &[&str] = if cfg!(windows) { &["--no-default-features"] } else { &[] };
    maturin(&environment, &[&build, features].concat(), &folder)?;
    let mut found: Vec<_> = fs::read_dir(&folder)?.filter_map(Result::ok).map(|entry| entry.path()).collect();
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

/// Runs maturin on the Python package; what it makes goes into `folder`.
pub(crate) fn maturin(environment: &Environment, arguments: &[&str], folder: &Path) -> Result<()> {
    let mut maturin = environment.python();
    maturin.args(["-m", "maturin"]).args(arguments).arg("--out").arg(folder);
    // With `--zig` it starts `python3 -m ziglang` of the path.
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::iter::once(environment.folder().to_owned()).chain(std::env::split_paths(&path));
    maturin.env("PATH", std::env::join_paths(path)?);
    without_own_package(&mut maturin);
    let status = maturin.stdout(Stdio::null()).status().context("cannot start maturin")?;
    ensure!(status.success(), "maturin {} failed; see above", arguments.join(" "));
    Ok(())
}

/// Writes the licences into the folder that `license-files` of pyproject.toml names.
pub(crate) fn write_licences() -> Result<()> {
    let folder = project().join(LICENCES);
    fs::create_dir_all(&folder).with_context(|| format!("{}", folder.display()))?;
    for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
        fs::copy(workspace::root().join(name), folder.join(name)).with_context(|| name.to_owned())?;
    }
    fs::write(folder.join("THIRD-PARTY"), licences::third_party()?)?;
    Ok(())
}

/// Licences of the package, within `client-py`.
pub(crate) const LICENCES: &str = "licences";

/// Installs the wheel into an empty environment and plays a first run with it, from an empty folder.
pub(crate) fn try_it(wheel: &Path) -> Result<()> {
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
    // Without the server there is no demo, but a world in the process.
    let (name, arguments): (_, &[_]) = if cfg!(windows) {
        (
            "python",
            &["-c", "import palmares.sim as s; w = s.World('balls', 'softhand', 1); w.step(repeat=100)"],
        )
    } else {
        ("palmares", &["demo"])
    };
    eprintln!("== {name} {}", arguments.join(" "));
    let first_s = took(name, Command::new(bin.join(name)).args(arguments))?;
    println!("pip install {install_s:.1} s, first run after {first_s:.1} s more");
    Ok(())
}
