//! `palmares-compare`: plays cases and grasps on other engines and ours, and writes docs/report and docs/validation.

use anyhow::{Result, ensure};
use clap::{Args, Parser, Subcommand};
use palmares_bench::command::CaseOptions;
use palmares_compare::engine::EngineKind;
use palmares_compare::{cameras, child, grasps, mjcf, report, search, validation};
use std::ffi::OsStr;
use std::path::PathBuf;

/// The hand emulator compared with other engines.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Count the grasps that engines keep, over drawn objects and placements and several steps.
    Grasps(grasps::command::GraspOptions),
    /// Time the pictures of cameras, by pixels and objects.
    Cameras(cameras::CameraOptions),
    /// Write a task's scene as a file for MuJoCo, with its commands.
    Mjcf(mjcf::MjcfOptions),
    /// Search the documented options of the peers for sets that solve a scene, and write docs/report/search.
    Search(search::command::SearchOptions),
    /// Run one case on an engine and print its report.
    Case(Case),
    /// Compare the engines over scenes and steps, and write a report with tables, plots and JSON.
    Report {
        /// Peers to compare with, by commas.
        #[arg(long, value_delimiter = ',', default_value = "own,rapier,mujoco,drake")]
        engines: Vec<String>,
        /// Gather outcomes into the file and time nothing, so that the machine may do other work. The report
        /// that follows takes them from there.
        #[arg(long)]
        outcomes_only: bool,
        #[command(flatten)]
        options: report::ComparisonOptions,
    },
    /// Repeat published measurements on real hands, and write a page about them.
    Validate(validation::ValidationOptions),
    /// Write the page of a JSON beside it anew, without running anything; of a report judge the runs again, too.
    Page {
        /// A report.json, grasps.json or search.json.
        file: PathBuf,
    },
    /// Compare the statements of README.md and docs/physics.md about the peers with the committed reports.
    /// Fails if they differ.
    Claims {
        /// Write it anew instead.
        #[arg(long)]
        write: bool,
        /// The repository.
        #[arg(long, default_value = ".")]
        root: PathBuf,
    },
    /// Play the requests of the program that started this one.
    #[command(name = child::COMMAND, hide = true)]
    Child,
    /// Read a report's JSON and fail if a peer is ahead of ours anywhere at an equal or smaller error.
    Check {
        /// The file.
        report: PathBuf,
    },
}

#[derive(Args)]
struct Case {
    #[command(flatten)]
    case: CaseOptions,
    /// Engine that plays it.
    #[arg(long, default_value = "own")]
    engine: String,
    /// Named settings of a peer. The report lists them with their reasons.
    #[arg(long)]
    settings: Option<String>,
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Cameras(options) => cameras::run(&options),
        Command::Search(options) => search::command::run(&options),
        Command::Mjcf(options) => mjcf::run(&options),
        Command::Grasps(options) => grasps::command::run(&options),
        Command::Case(Case { case, engine, settings }) => {
            case.run(EngineKind::from_names(&engine, settings.as_deref())?.factory())
        }
        Command::Report { engines, outcomes_only, mut options } => {
            for name in engines {
                options.engines.extend(EngineKind::with_all_settings(&name)?);
            }
            match outcomes_only {
                true => report::runner::gather(&options),
                false => report::write(&options).map(drop),
            }
        }
        Command::Validate(options) => validation::run(&options),
        Command::Page { file } => match file.file_name().and_then(OsStr::to_str) {
            Some("grasps.json") => grasps::command::rewrite(&file),
            Some("search.json") => search::command::rewrite(&file),
            _ => report::runner::rewrite(&file),
        },
        Command::Claims { write: true, root } => report::claims::write(&root),
        Command::Claims { write: false, root } => {
            let stale = report::claims::stale(&root)?;
            ensure!(
                stale.is_empty(),
                "{}: `palmares-compare claims --write` writes it anew",
                stale.join(", ")
            );
            Ok(())
        }
        Command::Child => child::serve(),
        Command::Check { report } => report::runner::check(&report),
    }
}
