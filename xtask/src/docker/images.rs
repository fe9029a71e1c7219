//! The images: base images from a registry, or made by `xtask/offline-docker` where none is reached; and ours.

use super::engine::{Engine, output};
use crate::python::succeeds;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::fs;
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
    let mut build = engine.docker(&["build", "--quiet", "--tag", IMAGE]);
    // Plain stages: they build everywhere, also where BuildKit's plugin is missing.
    build.env("DOCKER_BUILDKIT", "0").current_dir(workspace::root());
    build.args(["--build-arg", &format!("RUNTIME_IMAGE={runtime}")]);
    let built = match source {
        Source::Repository => {
            for name in ["RUST_IMAGE", "JOBS"] {
                if let Ok(value) = std::env::var(name) {
                    build.args(["--build-arg", &format!("{name}={value}")]);
                }
            }
            output(build.arg("."))
        }
        Source::Program(program) => {
            let context = BuildContext::with(program)?;
            build.args(["--build-arg", "PREBUILT=palmares", "--build-arg", &format!("RUST_IMAGE={runtime}")]);
            output(build.args(["--file", "Dockerfile"]).arg(&context.0))
        }
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
    let mut build = engine.docker(&["build", "--quiet", "--tag", STAND_IN]);
    build.env("DOCKER_BUILDKIT", "0").args(["--build-arg", &format!("RUNTIME_IMAGE={runtime}")]);
    let made = output(build.arg(offline("postgres")));
    Ok(made.map(|_| STAND_IN.to_owned()).map_err(|error| format!("no image of Postgres: {error:#}")))
}

/// A build context with nothing but the program. Removed when dropped.
struct BuildContext(PathBuf);

impl BuildContext {
    fn with(program: &Path) -> Result<Self> {
        let folder = std::env::temp_dir().join(format!("palmares-image-{}", std::process::id()));
        fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let context = BuildContext(folder);
        fs::copy(program, context.0.join("palmares")).context("cannot copy the program")?;
        Ok(context)
    }
}

impl Drop for BuildContext {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
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
