//! `cargo xtask report`: speed against error, compared with rapier, MuJoCo and Drake.

use crate::cargo::build;
use crate::python;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[derive(Args)]
pub(crate) struct ReportOptions {
    /// Few cases and steps, coarse references: under three minutes.
    #[arg(long)]
    quick: bool,
    /// Folder of the report; docs/report if not given, target/report for a quick one.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Engines, by commas.
    #[arg(long, default_value = "own,rapier,mujoco,drake")]
    engines: String,
    /// Cases, by commas; all if not given.
    #[arg(long)]
    cases: Option<String>,
    /// Steps, ms, by commas; 0.25 to 16 ms if not given.
    #[arg(long)]
    steps_ms: Option<String>,
    /// Timing runs, of which the median counts.
    #[arg(long, default_value_t = 5)]
    repeats: usize,
    /// Number of outcomes that are gathered at once; the number of threads of the machine if not given.
    #[arg(long)]
    jobs: Option<usize>,
    /// CPU time of a peer's run, and of its reference, s; beyond it the run is listed as not finished.
    #[arg(long, default_value_t = 60.0)]
    run_limit_s: f64,
    /// Gather outcomes without timing, on a machine with other work. The next report takes them from target/report.jsonl.
    #[arg(long)]
    outcomes_only: bool,
    /// Play all runs of peers, also those that the report in the repository has.
    #[arg(long)]
    peers_anew: bool,
    /// Keep the outcomes of peers and time their runs again.
    #[arg(long)]
    times_anew: bool,
    /// Search the documented options of the other engines instead, and write docs/report/search. Hours; goes on where it was
    /// stopped, from the plays of its page.
    #[arg(long)]
    search: bool,
    /// A report's JSON from which runs of peers are taken, with their times; that in the folder of the report if not given.
    #[arg(long)]
    keep: Option<PathBuf>,
}

/// Builds `palmares-compare`, prepares MuJoCo and Drake if it can, runs the comparison and shows its progress.
pub(crate) fn run(options: &ReportOptions) -> Result<()> {
    eprintln!("== building palmares-compare");
    let program = build("palmares-compare", true)?;
    if options.search {
        return search(options, &program);
    }
    let default = if options.quick { "target/report" } else { "docs/report" };
    let out = options.out.clone().unwrap_or_else(|| workspace::root().join(default));
    let mut report = Command::new(&program);
    report.current_dir(workspace::root()).arg("report").arg("--out").arg(out);
    report.args(["--engines", &options.engines, "--repeats", &options.repeats.to_string()]);
    report.args(["--run-limit-s", &options.run_limit_s.to_string()]);
    for (flag, value) in [("--cases", &options.cases), ("--steps-ms", &options.steps_ms)] {
        if let Some(value) = value {
            report.args([flag, value]);
        }
    }
    if let Some(keep) = &options.keep {
        report.arg("--keep").arg(keep);
    }
    if let Some(jobs) = options.jobs {
        report.args(["--jobs", &jobs.to_string()]);
    }
    for (flag, given) in [
        ("--quick", options.quick),
        ("--outcomes-only", options.outcomes_only),
        ("--peers-anew", options.peers_anew),
        ("--times-anew", options.times_anew),
    ] {
        if given {
            report.arg(flag);
        }
    }
    for package in [MUJOCO, DRAKE] {
        if options.engines.contains(package.module) {
            eprintln!("== preparing {}", package.engine);
            package.tell_if_it_can(&program, &mut report);
        }
    }
    let status = report.status().context("cannot start palmares-compare")?;
    ensure!(status.success(), "the report failed ({status})");
    Ok(())
}

/// Searches the options of the other engines.
fn search(options: &ReportOptions, program: &Path) -> Result<()> {
    let engines: Vec<&str> = options.engines.split(',').filter(|engine| *engine != "own").collect();
    let mut search = Command::new(program);
    search.current_dir(workspace::root()).args(["search", "--engines", &engines.join(",")]);
    search.args(["--run-limit-s", &options.run_limit_s.to_string()]);
    for (flag, value) in [("--cases", &options.cases), ("--steps-ms", &options.steps_ms)] {
        if let Some(value) = value {
            search.args([flag, value]);
        }
    }
    if let Some(jobs) = options.jobs {
        search.args(["--jobs", &jobs.to_string()]);
    }
    if engines.contains(&"mujoco") {
        search.env(MUJOCO.variable, MUJOCO.python(program).context("MuJoCo cannot be installed")?);
    }
    let status = search.status().context("cannot start palmares-compare")?;
    ensure!(status.success(), "the search failed ({status})");
    Ok(())
}

/// The Python package of an engine.
pub(crate) struct Package {
    /// The engine, as its authors write it.
    engine: &'static str,
    /// The environment variable that names an interpreter with it.
    pub variable: &'static str,
    /// Its name, and that of its environment in the target directory.
    module: &'static str,
    /// What it imports.
    imports: &'static str,
    /// What pip installs.
    needs: &'static [&'static str],
}

pub(crate) const MUJOCO: Package = Package {
    engine: "MuJoCo",
    variable: "PALMARES_MUJOCO_PYTHON",
    module: "mujoco",
    imports: "import mujoco, numpy",
    needs: &["mujoco>=4,<5", "numpy"],
};

/// There are wheels for Linux and for macOS on Arm alone.
pub(crate) const DRAKE: Package = Package {
    engine: "Drake",
    variable: "PALMARES_DRAKE_PYTHON",
    module: "drake",
    imports: "import pydrake.multibody.plant, numpy",
    needs: &["drake>=1.51,<2"],
};

impl Package {
    /// An interpreter that has it, in an environment in the target directory; made once.
    pub(crate) fn python(&self, program: &Path) -> Result<PathBuf> {
        if let Some(named) = std::env::var_os(self.variable) {
            return Ok(named.into());
        }
        let target = program.parent().and_then(Path::parent).context("the target directory")?;
        let venv = target.join(self.module);
        let python = venv.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
        let works = |python: &Path| python::succeeds(Command::new(python).args(["-c", self.imports]));
        if works(&python) {
            return Ok(python);
        }
        fs::create_dir_all(&venv)?;
        python::create(&python::interpreter()?, &venv)?;
        let mut pip = Command::new(&python);
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(self.needs);
        let installed = pip.stdout(Stdio::null()).status().context("cannot start pip")?;
        ensure!(installed.success() && works(&python), "pip could not install the package `{}`", self.module);
        Ok(python)
    }

    /// Tells a command the interpreter. Without one it goes on without this engine, and says so.
    pub(crate) fn tell_if_it_can(&self, program: &Path, command: &mut Command) {
        match self.python(program) {
            Ok(python) => {
                command.env(self.variable, python);
            }
            Err(error) => {
                let engine = self.engine;
                eprintln!("{engine} cannot be installed ({error:#}); the report goes on without it");
            }
        }
    }
}
