//! Developer commands: `cargo xtask demo`, `docker`, `fleet`, `fuzz`, `generate`, `pages`, `pages-of-record`, `release`, `report`, `test`,
//! `validate`, `viewer` and `wheel`.
//!
//! | part | content |
//! |---|---|
//! | `xtask/src/check/` | `cargo xtask test`: `mod.rs` lists the checks in lanes, `verdicts.rs` keeps those of `--quick` |
//! | `xtask/src/generate/` | schema and types from the Rust types of messages |
//! | `xtask/src/pages_of_record/` | every page of measured results |
//! | `xtask/src/docker/` | the container and the fleet of `deploy/fleet`, as users start them |
//! | `xtask/src/release/` | a version, from its number to the files that are published |
//! | `xtask/fleet/`, `xtask/src/fleet.rs` | several hosts under faults, the ranking of a large event, a long load |

mod apt;
mod cargo;
mod check;
mod demo;
#[cfg(test)]
mod dependencies;
mod docker;
mod fleet;
mod fuzz;
mod generate;
mod http;
mod instructions;
mod licences;
mod pages;
mod pages_of_record;
mod python;
mod release;
mod report;
mod tools;
mod validate;
mod viewer;
mod wheel;
mod workspace;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

#[derive(Parser)]
#[command(bin_name = "cargo xtask", about = "Developer commands of Palmares")]
struct Cli {
    #[command(subcommand)]
    command: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build the server, let the example controller play one run, print the score and the leaderboard.
    Demo(demo::DemoOptions),
    /// Build the container image from source, start it with compose, play on it, stop and start it again.
    Docker(docker::DockerOptions),
    /// Several hosts with Postgres, an object store and a proxy on this machine, under faults and load; Linux, as root.
    Fleet(fleet::FleetOptions),
    /// Run libFuzzer on the readers of bytes from outside, and add to fuzz/executions.json.
    Fuzz(fuzz::FuzzOptions),
    /// Write docs/schema and the types of Python and TypeScript from the Rust types of messages and HTTP bodies.
    Generate,
    /// Run the pages in a browser: take the pictures of README and docs again, or measure the load of the pages.
    Pages {
        /// Pictures or measurements.
        #[arg(value_enum)]
        wanted: pages::Wanted,
    },
    /// Measure and write anew every page of measured results; continues where it stopped.
    PagesOfRecord(pages_of_record::RecordPagesOptions),
    /// Compare speed and error with rapier, MuJoCo and Drake over all scenes; write docs/report.
    Report(report::ReportOptions),
    /// Make a version: change its number, build and check the files that are published.
    Release(release::ReleaseOptions),
    /// Run every test: Rust, Python and the viewer, formatting and lints.
    Test(check::TestOptions),
    /// Repeat published measurements on real hands; write docs/validation.
    Validate(validate::ValidateOptions),
    /// Build the pages' scripts, which the next build of the server includes.
    Viewer,
    /// Build the Python package with the engine, the program and its pages, into target/wheels.
    Wheel(wheel::WheelOptions),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Task::Demo(options) => demo::run(&options).map(|()| true),
        Task::Docker(options) => docker::run(&options).map(|()| true),
        Task::Fleet(options) => fleet::run(&options),
        Task::Fuzz(options) => fuzz::run(&options),
        Task::Generate => {
            cargo::build_server(false).and_then(|program| generate::run(&program)).map(|()| true)
        }
        Task::Pages { wanted } => pages::run(wanted, None).map(|()| true),
        Task::PagesOfRecord(options) => pages_of_record::run(&options).map(|()| true),
        Task::Release(options) => release::run(&options).map(|()| true),
        Task::Report(options) => report::run(&options).map(|()| true),
        Task::Test(options) => check::run(&options),
        Task::Validate(options) => validate::run(&options).map(|()| true),
        Task::Viewer => viewer::run().map(|()| true),
        Task::Wheel(options) => wheel::run(&options).map(|()| true),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
