//! The images: base images from a registry, or made by `xtask/offline-docker` where none is reached; and ours.

use super::engine::{Engine, output};
use crate::python::succeeds;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The Dockerfile's own choice, on which the images of the tests are built.
const RUNTIME: &str = "debian:bookworm-slim";
/// The same made here.
const BOOTSTRAPPED: &str = "palmares-test/debian:bookworm";
/// The choice of compose.postgres.yaml.
const POSTGRES: &str = "postgres:17-bookworm";
/// The same made here.
const STAND_IN: &str = "palmares-test/postgres";
/// The Dockerfile's stage of the same name: all but the program.
const WITHOUT_PROGRAM: &str = "palmares-test/runtime";
/// What the tests build.
const IMAGE: &str = "palmares-test/server";

/// Where the program comes from.
pub(super) enum Source<'a> {
    /// Compiled within the image.
    Repository,
    /// Built by cargo here.
    Program(&'a Path),
}

/// Builds the image and returns its name, or says why this machine cannot.
pub(super) fn build(engine: &Engine, source: &Source<'_>) -> Result<Result<String, String>> {
    let runtime = match runtime(engine)? {
        Ok(runtime) => runtime,
        Err(reason) => return Ok(Err(reason)),
    };
    let built = match source {
        Source::Repository => from_source(engine, &runtime),
        Source::Program(program) => around(engine, &runtime, program),
    };
    built.context("the image does not build")?;
    // A program built on a newer system than the image's does not start there.
    let version = engine.docker(&["run", "--rm", IMAGE, "--version"]).output()?;
    let complaint = String::from_utf8_lossy(&version.stderr);
    if complaint.contains("GLIBC_") {
        return Ok(Err(format!(
            "a program built here does not run in {RUNTIME}, whose C library is older; \
             `cargo xtask docker` compiles within the image"
        )));
    }
    ensure!(version.status.success(), "the image does not run: {complaint}");
    Ok(Ok(IMAGE.to_owned()))
}

/// The whole Dockerfile, as users build it.
fn from_source(engine: &Engine, runtime: &str) -> Result<()> {
    let mut build = engine.build(IMAGE, runtime);
    for name in ["RUST_IMAGE", "NODE_IMAGE", "JOBS"] {
        if let Ok(value) = std::env::var(name) {
            build.args(["--build-arg", &format!("{name}={value}")]);
        }
    }
    output(build.arg(workspace::root())).map(drop)
}

/// The Dockerfile's stage with all but the program, and the program in it: nothing is compiled, neither server nor viewer.
fn around(engine: &Engine, runtime: &str, program: &Path) -> Result<()> {
    let dockerfile = File::open(workspace::root().join("Dockerfile")).context("Dockerfile")?;
    let mut stage = engine.build(WITHOUT_PROGRAM, runtime);
    output(stage.args(["--target", "runtime", "-"]).stdin(dockerfile))?;

    let folder = tempfile::tempdir().context("cannot make a folder")?;
    let palmares = folder.path().join("palmares");
    fs::copy(program, &palmares).context("cannot copy the program")?;
    for_everybody(&palmares).context("cannot make the program executable")?;
    let lines = "ARG RUNTIME_IMAGE\nFROM ${RUNTIME_IMAGE}\nCOPY palmares /usr/local/bin/palmares\n";
    fs::write(folder.path().join("Dockerfile"), lines).context("cannot write a Dockerfile")?;
    output(engine.build(IMAGE, WITHOUT_PROGRAM).arg(folder.path())).map(drop)
}

/// Who runs it in the container is not who built it.
#[cfg(unix)]
fn for_everybody(program: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(program, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn for_everybody(_: &Path) -> std::io::Result<()> {
    Ok(())
}

/// An image of Postgres: at hand, from a registry, or made of Debian's packages.
pub(super) fn postgres(engine: &Engine) -> Result<Result<String, String>> {
    if let Some(image) = there(engine, [POSTGRES, STAND_IN]) {
        return Ok(Ok(image));
    }
    let runtime = match runtime(engine)? {
        Ok(runtime) => runtime,
        Err(reason) => return Ok(Err(reason)),
    };
    println!("no image registry is reached; making an image of Debian's package of Postgres");
    let made = output(engine.build(STAND_IN, &runtime).arg(offline("postgres")));
    Ok(made.map(|_| STAND_IN.to_owned()).map_err(|error| format!("no image of Postgres: {error:#}")))
}

/// The image to run in: at hand, from a registry, or made of Debian's packages.
fn runtime(engine: &Engine) -> Result<Result<String, String>> {
    if let Some(image) = there(engine, [RUNTIME, BOOTSTRAPPED]) {
        return Ok(Ok(image));
    }
    println!("no image registry is reached; making an image of Debian's packages");
    let made = output(Command::new("sh").arg(offline("debian.sh")).arg(BOOTSTRAPPED));
    Ok(made.map(|_| BOOTSTRAPPED.to_owned()).map_err(|error| format!("no base image: {error:#}")))
}

/// The image of the registry or the one made here instead: at hand, or fetched now.
fn there(engine: &Engine, [official, made]: [&str; 2]) -> Option<String> {
    let at_hand = |&image: &&str| succeeds(&mut engine.docker(&["image", "inspect", image]));
    let pulled = || succeeds(&mut engine.docker(&["pull", "--quiet", official])).then_some(official);
    [official, made].into_iter().find(at_hand).or_else(pulled).map(str::to_owned)
}

/// A file of the folder that stands in for an image registry.
fn offline(name: &str) -> PathBuf {
    workspace::root().join("xtask/offline-docker").join(name)
}
