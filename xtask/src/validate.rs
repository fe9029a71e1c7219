//! `cargo xtask validate`: published measurements on real hands, repeated on ours.

use crate::cargo::build;
use crate::workspace;
use anyhow::{Context, Result, ensure};
use clap::Args;
use std::path::PathBuf;
use std::process::Command;

#[derive(Args)]
pub(crate) struct ValidateOptions {
    /// Steps of 2 ms and few placements: half a minute.
    #[arg(long)]
    quick: bool,
    /// End with one line of JSON: every measurement with the published value, mean and range of ours.
    #[arg(long)]
    json: bool,
    /// Folder of the page; docs/validation if not given, target/validation for a quick one.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Only these measurements, by commas; the page then has no others.
    #[arg(long)]
    only: Option<String>,
    /// A recording of a Yale T42; docs/validation has its format.
    #[arg(long)]
    t42: Option<PathBuf>,
}

/// Builds `palmares-compare` and lets it measure.
pub(crate) fn run(options: &ValidateOptions) -> Result<()> {
    eprintln!("== building palmares-compare");
    let program = build("palmares-compare", true)?;
    let default = if options.quick { "target/validation" } else { "docs/validation" };
    let out = options.out.clone().unwrap_or_else(|| workspace::root().join(default));
    let mut validate = Command::new(&program);
    validate.current_dir(workspace::root()).arg("validate").arg("--out").arg(out);
    if let Some(only) = &options.only {
        validate.args(["--only", only]);
    }
    if let Some(recording) = &options.t42 {
        validate.arg("--t42").arg(std::path::absolute(recording)?);
    }
    for (flag, given) in [("--quick", options.quick), ("--json", options.json)] {
        if given {
            validate.arg(flag);
        }
    }
    let status = validate.status().context("cannot start palmares-compare")?;
    ensure!(status.success(), "the validation failed ({status})");
    Ok(())
}
