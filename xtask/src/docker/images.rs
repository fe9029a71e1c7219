//! The images: ours, and base images from a registry or, without one, made by `xtask/offline-docker`.

use super::engine::{Engine, output};
use crate::python::succeeds;
use crate::viewer::NODE_WHEEL;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The Dockerfile's own choice, the base of the images of the tests.
const RUNTIME: &str = "debian:bookworm-slim";
/// The same, made here.
const BOOTSTRAPPED: &str = "palmares-test/debian:bookworm";
/// The images with compilers: the Dockerfile's arguments and its own choices.
const COMPILERS: [(&str, &str); 2] =
    [("RUST_IMAGE", "rust:1-slim-bookworm"), ("NODE_IMAGE", "node:22-bookworm-slim")];
/// Both in one, made here.
const MADE_COMPILERS: &str = "palmares-test/compilers";
/// The choice of the compose files, and the same, made here of Debian's package, which is of version 15.
const POSTGRES: [&str; 2] = ["postgres:17-bookworm", "palmares-test/postgres"];
/// The choices of deploy/fleet/compose.yaml for proxy and object store, and the same, made here.
const HAPROXY: [&str; 2] = ["haproxy:2.8-bookworm", "palmares-test/haproxy"];
const STORE: [&str; 2] = ["chrislusf/seaweedfs:latest", "palmares-test/store"];
/// An S3 server in Python.
pub(crate) const MOTO: &str = "moto[server]==5.2.5";
/// The Dockerfile's stage of the same name: all but the program.
const WITHOUT_PROGRAM: &str = "palmares-test/runtime";
/// The image that the tests build.
const IMAGE: &str = "palmares-test/server";

/// The source of the program.
pub(super) enum Source<'a> {
    /// Compiled within the image.
    Repository,
    /// Built by cargo here.
    Program(&'a Path),
}

/// Builds the image and returns its name, or the reason why this machine cannot.
pub(super) fn build(engine: &Engine, source: &Source<'_>) -> Result<Result<String, String>> {
    let runtime = match runtime(engine)? {
        Ok(runtime) => runtime,
        Err(reason) => return Ok(Err(reason)),
    };
    let built = match source {
        Source::Repository => match compilers(engine, &runtime)? {
            Ok(images) => from_source(engine, &runtime, &images),
            Err(reason) => return Ok(Err(reason)),
        },
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
fn from_source(engine: &Engine, runtime: &str, compilers: &[String]) -> Result<()> {
    let mut build = engine.build(IMAGE, runtime);
    for argument in compilers {
        build.args(["--build-arg", argument]);
    }
    if let Ok(jobs) = std::env::var("JOBS") {
        build.args(["--build-arg", &format!("JOBS={jobs}")]);
    }
    output(build.arg(workspace::root())).map(drop)
}

/// The Dockerfile's stage with all but the program, and the program in it. It compiles no server and no
/// viewer.
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

/// Lets every user run it: the container's user is not the one who built it.
#[cfg(unix)]
fn for_everybody(program: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(program, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn for_everybody(_: &Path) -> std::io::Result<()> {
    Ok(())
}

/// An image of Postgres: local, from a registry, or made of Debian's packages.
pub(super) fn postgres(engine: &Engine) -> Result<Result<String, String>> {
    of_package(engine, "Postgres", POSTGRES, |made, runtime| {
        output(engine.build(made, runtime).arg(offline("postgres")))
    })
}

/// An image of HAProxy: local, from a registry, or made of Debian's package.
pub(super) fn haproxy(engine: &Engine) -> Result<Result<String, String>> {
    of_package(engine, "HAProxy", HAPROXY, |made, runtime| {
        output(engine.build(made, runtime).arg(offline("haproxy")))
    })
}

/// An image of an S3 server: local, from a registry, or made here with moto.
pub(super) fn store(engine: &Engine) -> Result<Result<String, String>> {
    of_package(engine, "an S3 server", STORE, |made, runtime| {
        let folder = tempfile::tempdir().context("cannot make a folder")?;
        for name in ["Dockerfile", "weed"] {
            fs::copy(offline("store").join(name), folder.path().join(name)).context(name)?;
        }
        // The certificates that this machine trusts come along, for the package index.
        fs::copy("/etc/ssl/certs/ca-certificates.crt", folder.path().join("trusted.crt"))
            .context("this machine's certificates")?;
        output(engine.build(made, runtime).args(["--build-arg", &format!("MOTO={MOTO}")]).arg(folder.path()))
    })
}

/// The first of two images that is local or comes from a registry, or else the second, made now.
fn of_package(
    engine: &Engine,
    what: &str,
    images: [&str; 2],
    make: impl FnOnce(&str, &str) -> Result<String>,
) -> Result<Result<String, String>> {
    if let Some(image) = there(engine, &images) {
        return Ok(Ok(image));
    }
    let runtime = match runtime(engine)? {
        Ok(runtime) => runtime,
        Err(reason) => return Ok(Err(reason)),
    };
    println!("no image registry is reached; making an image of {what}");
    let made = make(images[1], &runtime);
    Ok(made.map(|_| images[1].to_owned()).map_err(|error| format!("no image of {what}: {error:#}")))
}

/// The image to run in: local, from a registry, or made of Debian's packages.
fn runtime(engine: &Engine) -> Result<Result<String, String>> {
    if let Some(image) = there(engine, &[RUNTIME, BOOTSTRAPPED]) {
        return Ok(Ok(image));
    }
    println!("no image registry is reached; making an image of Debian's packages");
    let made = output(Command::new("sh").arg(offline("debian.sh")).arg(BOOTSTRAPPED));
    Ok(made.map(|_| BOOTSTRAPPED.to_owned()).map_err(|error| format!("no base image: {error:#}")))
}

/// The Dockerfile's arguments that name the images with compilers: those of the environment, the Dockerfile's own, or one
/// made here of this machine's Rust and the Node that `cargo xtask viewer` would take.
fn compilers(engine: &Engine, runtime: &str) -> Result<Result<Vec<String>, String>> {
    let mut arguments = Vec::new();
    let mut made = false;
    for (name, official) in COMPILERS {
        let known = std::env::var(name).ok().or_else(|| there(engine, &[official]));
        // Made each time, from today's Rust; Docker keeps unchanged layers.
        if known.is_none() && !made {
            println!("no image registry is reached; making an image with this machine's Rust, and Node");
            let mut script = Command::new("sh");
            script.arg(offline("compilers.sh")).args([MADE_COMPILERS, runtime, NODE_WHEEL]);
            if let Err(error) = output(script.current_dir(workspace::root()).env("DOCKER_BUILDKIT", "0")) {
                return Ok(Err(format!("no {official}, and {name} names no other image: {error:#}")));
            }
            made = true;
        }
        arguments.push(format!("{name}={}", known.as_deref().unwrap_or(MADE_COMPILERS)));
    }
    Ok(Ok(arguments))
}

/// The first of these images that is local, or else the first of all, fetched now. The registry's own comes first.
fn there(engine: &Engine, images: &[&str]) -> Option<String> {
    let at_hand = |image: &&&str| succeeds(&mut engine.docker(&["image", "inspect", image]));
    let pulled = || images.first().filter(|image| succeeds(&mut engine.docker(&["pull", "--quiet", image])));
    images.iter().find(at_hand).or_else(pulled).map(|image| (*image).to_owned())
}

/// A file of the folder that replaces an image registry.
fn offline(name: &str) -> PathBuf {
    workspace::root().join("xtask/offline-docker").join(name)
}
