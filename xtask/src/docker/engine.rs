//! Docker and compose, by their command lines.

use crate::python::succeeds;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::process::{Command, Stdio};

/// A Docker engine that answers.
pub(super) struct Engine {
    compose: Vec<&'static str>,
}

impl Engine {
    /// The engine of this machine, or the reason why there is none.
    pub(super) fn find() -> Result<Self, String> {
        if !succeeds(Command::new("docker").arg("--version")) {
            return Err("docker is not installed".into());
        }
        if !succeeds(Command::new("docker").args(["ps", "--quiet"])) {
            return Err("docker is installed, but no engine answers (is dockerd running?)".into());
        }
        let known = [vec!["docker", "compose"], vec!["docker-compose"]];
        let compose = known.into_iter().find(|words| Self::has(words));
        match compose {
            Some(compose) => Ok(Engine { compose }),
            None => Err("docker has no compose (Debian's package docker-compose)".into()),
        }
    }

    /// Whether this compose is installed: `docker compose` or `docker-compose`.
    pub(super) fn has(words: &[&str]) -> bool {
        succeeds(Command::new(words[0]).args(&words[1..]).arg("version"))
    }

    /// A docker command.
    pub(super) fn docker(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new("docker");
        command.args(arguments).stdin(Stdio::null());
        command
    }

    /// A build of an image on top of `runtime`; the caller adds the build context.
    pub(super) fn build(&self, image: &str, runtime: &str) -> Command {
        let mut build = self.docker(&["build", "--quiet", "--tag", image]);
        // Plain stages build everywhere, also without BuildKit's plugin.
        build.env("DOCKER_BUILDKIT", "0").args(["--build-arg", &format!("RUNTIME_IMAGE={runtime}")]);
        build
    }

    /// A compose project of our own from one of our files, with any free port.
    pub(super) fn project(&self, file: &'static str, variables: &[(&'static str, &str)]) -> Project<'_> {
        let name = format!("palmares-test-{}", std::process::id());
        let variables = variables.iter().map(|(name, value)| (*name, (*value).to_owned())).collect();
        Project { engine: self, name, file, variables }
    }
}

/// The output of a command; its error output as the error when it fails.
pub(super) fn output(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| format!("cannot start {command:?}"))?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{command:?} failed: {}", complaint.trim());
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// A compose project. Dropping it takes it down with its volumes.
pub(super) struct Project<'a> {
    engine: &'a Engine,
    name: String,
    file: &'static str,
    variables: Vec<(&'static str, String)>,
}

impl Project<'_> {
    fn compose(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(self.engine.compose[0]);
        command.args(&self.engine.compose[1..]).args(["--project-name", &self.name, "--file", self.file]);
        command.args(arguments).current_dir(workspace::root()).stdin(Stdio::null());
        command.env("PALMARES_PORT", "0").envs(self.variables.iter().map(|(name, value)| (name, value)));
        command
    }

    pub(super) fn up(&self) -> Result<()> {
        output(&mut self.compose(&["up", "--detach", "--no-build"])).map(drop)
    }

    /// Stops it by SIGTERM, within the grace period of compose.yaml.
    pub(super) fn stop(&self) -> Result<()> {
        output(&mut self.compose(&["stop"])).map(drop)
    }

    /// The address of the server from outside: `127.0.0.1:49153`.
    pub(super) fn address(&self) -> Result<String> {
        let bound = output(&mut self.compose(&["port", "palmares", "8080"]))?;
        let port = bound.lines().next().and_then(|line| line.rsplit(':').next());
        Ok(format!("127.0.0.1:{}", port.with_context(|| format!("no port: {bound:?}"))?))
    }

    fn container(&self) -> Result<String> {
        output(&mut self.compose(&["ps", "--quiet", "palmares"]))
    }

    /// The engine's description of the container.
    pub(super) fn state(&self) -> Result<Value> {
        let container = self.container()?;
        let state = output(&mut self.engine.docker(&["inspect", "--format", "{{json .State}}", &container]))?;
        Ok(serde_json::from_str(&state)?)
    }

    /// Runs a command in the container.
    pub(super) fn exec(&self, arguments: &[&str]) -> Result<String> {
        let container = self.container()?;
        output(self.engine.docker(&["exec", &container]).args(arguments))
    }

    /// The log of the server.
    pub(super) fn logs(&self) -> String {
        output(&mut self.compose(&["logs", "--no-color"])).unwrap_or_else(|error| error.to_string())
    }
}

impl Drop for Project<'_> {
    fn drop(&mut self) {
        let down = self.compose(&["down", "--volumes", "--timeout", "5"]).output();
        if !down.is_ok_and(|output| output.status.success()) {
            println!("the compose project {} could not be taken down", self.name);
        }
    }
}
