//! `cargo xtask demo`: builds the program and runs `palmares demo`.

use crate::cargo::build_server;
use crate::python::Environment;
use crate::viewer;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::path::Path;
use std::{env, process};

#[derive(Args)]
pub(crate) struct DemoOptions {
    /// Print the outcome as one JSON object on the last line.
    #[arg(long)]
    json: bool,
    /// Task: balls, shelf, grasp, pan or peg.
    #[arg(long, default_value = "balls")]
    task: String,
    /// Seed of the scene.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Leave the server running, to look at its pages.
    #[arg(long)]
    stay: bool,
    /// Keep the server's database and log, and print their folder.
    #[arg(long)]
    keep: bool,
}

/// Builds, plays one run and prints its result.
pub(crate) fn run(options: &DemoOptions) -> Result<()> {
    eprintln!("== building the viewer");
    if let Err(error) = viewer::run() {
        eprintln!("the server is built without its viewer: {error:#}");
    }
    eprintln!("== building the server");
    let program = build_server(true)?;
    eprintln!("== preparing the Python environment");
    let environment = Environment::prepare()?;

    // Next to the program, in the target directory.
    let target =
        program.parent().and_then(Path::parent).context("the program lies in no target directory")?;
    let folder = target.join("demo");
    let mut demo = environment.python();
    demo.args(["-m", "palmares", "demo", "--task", &options.task, "--seed", &options.seed.to_string()]);
    demo.arg("--program").arg(&program).arg("--replay").arg(&folder);
    if options.json {
        demo.arg("--json");
    }
    if options.stay {
        demo.arg("--stay");
    }
    if options.keep {
        let data = env::temp_dir().join(format!("palmares-demo-{}", process::id()));
        eprintln!("== the server's files: {}", data.display());
        demo.arg("--data-dir").arg(data);
    }
    let status = demo.status().context("cannot start Python")?;
    ensure!(status.success(), "the demonstration failed; see the messages above");
    Ok(())
}
