//! Programs that measure, built when a part needs them.

use crate::cargo::{build, build_extension};
use crate::python::{Environment, succeeds};
use crate::report::{DRAKE, MUJOCO};
use crate::workspace;
use anyhow::{Context, Result, ensure};
use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What is done again of the runs of other engines.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Anew {
    /// A few are played, to see whether the kept ones are of this machine.
    Sentinels,
    /// All are timed.
    Times,
    /// All are played and timed.
    Peers,
}

impl Anew {
    /// The option of `palmares-compare`.
    pub(super) fn flag(self) -> Option<&'static str> {
        match self {
            Anew::Sentinels => None,
            Anew::Times => Some("--times-anew"),
            Anew::Peers => Some("--peers-anew"),
        }
    }
}

pub(super) struct Tools {
    /// Shortest forms, away from the docs.
    pub quick: bool,
    /// What is done again of the runs of other engines that the pages have.
    pub anew: Anew,
    /// Folder of the files that stay between two calls.
    pub folder: PathBuf,
    bench: PathBuf,
    compare: OnceCell<PathBuf>,
    python: OnceCell<Environment>,
}

impl Tools {
    pub(super) fn new(quick: bool, anew: Anew) -> Result<Self> {
        let bench = build("palmares-bench", false)?;
        let target = bench.parent().and_then(Path::parent).context("the target directory")?;
        let folder = target.join("pages-of-record");
        fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        Ok(Tools { quick, anew, folder, bench, compare: OnceCell::new(), python: OnceCell::new() })
    }

    /// Where a page or its folder goes; the folder around it exists.
    pub(super) fn place(&self, page: &str) -> Result<PathBuf> {
        let place = if self.quick { self.folder.join(page) } else { workspace::root().join(page) };
        let around = place.parent().context("a page in a folder")?;
        fs::create_dir_all(around).with_context(|| format!("cannot create {}", around.display()))?;
        Ok(place)
    }

    pub(super) fn bench(&self) -> Command {
        at_root(&self.bench)
    }

    /// A hash of everything that the pages of a part depend on.
    pub(super) fn fingerprint(&self, part: &str) -> Result<String> {
        self.output(self.bench().args(["record", part, "--fingerprint"]))
    }

    /// The line of a page of a part.
    pub(super) fn record(&self, part: &str) -> Result<String> {
        self.output(self.bench().args(["record", part]))
    }

    /// Writes docs/pages-of-record.md.
    pub(super) fn write_list(&self) -> Result<()> {
        played(self.bench().args(["pages", "--write"]))
    }

    /// `palmares-compare`, with a Python that has MuJoCo.
    pub(super) fn compare(&self) -> Result<Command> {
        if self.compare.get().is_none() {
            let _ = self.compare.set(build("palmares-compare", true)?);
        }
        let program = self.compare.get().context("palmares-compare")?;
        let mut compare = at_root(program);
        let python = MUJOCO.python(program).context("MuJoCo, which the pages are beside")?;
        compare.env(MUJOCO.variable, python);
        Ok(compare)
    }

    /// The same with a Python that has Drake, where there is one.
    pub(super) fn compare_with_drake(&self) -> Result<Command> {
        let mut compare = self.compare()?;
        DRAKE.tell_if_it_can(self.compare.get().context("palmares-compare")?, &mut compare);
        Ok(compare)
    }

    /// A script of client-py/benchmarks, with the engine in a release build. `needed` has the modules that it imports beside
    /// those of the tests, and the packages that have them.
    pub(super) fn benchmark(&self, script: &str, needed: &[(&str, &str)]) -> Result<Command> {
        let environment = self.environment()?;
        for (module, package) in needed {
            let import = format!("import {module}");
            let there = || succeeds(environment.python().args(["-c", &import]));
            if !there() {
                let mut pip = environment.python();
                pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", package]);
                ensure!(
                    succeeds(&mut pip) && there(),
                    "{script} needs {package}, which pip cannot install: `{} -m pip install '{package}'`",
                    environment.interpreter().display()
                );
            }
        }
        let mut python = environment.python();
        python.arg(format!("benchmarks/{script}"));
        Ok(python)
    }

    /// The client's environment, with the engine in a release build.
    pub(super) fn environment(&self) -> Result<&Environment> {
        if self.python.get().is_none() {
            let environment = Environment::prepare()?;
            build_extension()?;
            let _ = self.python.set(environment);
        }
        self.python.get().context("the client's Python environment")
    }

    /// The output of a command.
    pub(super) fn output(&self, command: &mut Command) -> Result<String> {
        let output =
            command.stderr(Stdio::inherit()).output().with_context(|| format!("cannot start {command:?}"))?;
        ensure!(output.status.success(), "{command:?} failed ({})", output.status);
        Ok(String::from_utf8(output.stdout)?.trim().to_owned())
    }
}

/// Runs a command to its end.
pub(super) fn played(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot start {command:?}"))?;
    ensure!(status.success(), "{command:?} failed ({status}); see above");
    Ok(())
}

fn at_root(program: &Path) -> Command {
    let mut command = Command::new(program);
    command.current_dir(workspace::root());
    command
}
