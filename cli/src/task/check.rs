//! `palmares task check`.

use super::describe::{bodies, describe};
use super::load::{load_hand, load_task, scene_error};
use super::model::Needs;
use clap::Args;
use palmares_models::builtin::builtin_hands;
use palmares_models::error::LoadWarning;
use palmares_models::hand::Hand;
use palmares_tasks::build::build;
use palmares_tasks::{Action, Reason, Run, Seed, Task, inspect};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::ExitCode;
use std::sync::Arc;

/// Exit code of `--strict` with warnings.
const WARNED: u8 = 2;
/// Duration of the run without actions, s.
const IDLE_S: f64 = 1.0;

/// Options of `palmares task check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// A folder with a task.toml, that file, or the name of a built-in task
    task: String,
    /// Number of scenes to build, with the seeds from 1 on
    #[arg(long, alias = "seeds", value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    scenes: u64,
    /// A hand that will play it, by name or path [default: the built-in hands]
    #[arg(long = "hand", value_name = "HAND")]
    hands: Vec<String>,
    /// Sweep the first hand that fits through the scene, and print its parts, the work of a step, and the laws that act
    #[arg(long)]
    model: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
    /// Exit with 2 if there are warnings
    #[arg(long)]
    strict: bool,
}

/// The output of `--json`.
#[derive(Debug, Default, Serialize)]
struct Report {
    /// `usable` or `unusable`.
    verdict: &'static str,
    /// Name of the task, if it can be read.
    task: Option<String>,
    /// SHA-256 of the task's content.
    hash: Option<String>,
    /// Reason why the task is unusable.
    errors: Vec<String>,
    warnings: Vec<String>,
    /// Number of scenes that were built.
    scenes: u64,
    /// Hands that touch nothing where they start.
    hands: Vec<String>,
    /// With `--model`: what the scene needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    model: Option<Needs>,
}

/// Checks the task and prints a report.
pub(super) fn check(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let hands = match args.hands.as_slice() {
        [] => builtin_hands().to_vec(),
        names => names.iter().map(|name| load_hand(name)).collect::<anyhow::Result<_>>()?,
    };
    let (mut report, mut text) = (Report::default(), String::new());
    match load_task(&args.task) {
        Err(error) => report.errors.push(format!("{error:#}").trim_end().to_owned()),
        Ok((task, warnings)) => {
            report.task = Some(task.name.clone());
            report.hash = Some(task.content_hash().to_owned());
            report.warnings = warnings.iter().map(ToString::to_string).collect();
            text += &describe(&task);
            build_scenes(&task, &warnings, args.scenes, &mut report, &mut text);
            if report.errors.is_empty() {
                play(&task, &hands, &mut report);
            }
            if args.model && report.errors.is_empty() {
                sweep(&task, &hands, &mut report);
            }
        }
    }
    report.verdict = if report.errors.is_empty() { "usable" } else { "unusable" };
    let code = match report.errors.is_empty() {
        false => ExitCode::FAILURE,
        true if args.strict && !report.warnings.is_empty() => ExitCode::from(WARNED),
        true => ExitCode::SUCCESS,
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        write!(out, "{text}{}", verdict(&args.task, &report))?;
    }
    Ok(code)
}

/// Builds scenes with several seeds.
fn build_scenes(task: &Task, warnings: &[LoadWarning], scenes: u64, report: &mut Report, text: &mut String) {
    for number in 1..=scenes {
        match build(task, None, Seed::from_u64(number)) {
            Ok(built) if number == 1 => {
                let _ = write!(text, "\nScene of seed 1\n{}", bodies(&built.scene));
            }
            Ok(_) => {}
            Err(error) => {
                report.errors.push(format!("seed {number}: {}", scene_error(&error, warnings)));
                return;
            }
        }
        report.scenes = number;
    }
}

/// Checks which hands fit where they start, and plays the first of them without actions.
fn play(task: &Arc<Task>, hands: &[Arc<Hand>], report: &mut Report) {
    for hand in hands {
        let in_the_way = inspect::in_the_way(hand, std::slice::from_ref(task));
        if in_the_way.is_empty() {
            report.hands.push(hand.name.clone());
        } else {
            let overlaps = inspect::join_reasons(&in_the_way);
            report.warnings.push(format!("hand `{}` does not fit where it starts: {overlaps}", hand.name));
        }
    }
    let Some(hand) = hands.iter().find(|hand| report.hands.contains(&hand.name)) else {
        report.errors.push("no hand fits where it starts: see hand.position and hand.quat_xyzw".to_owned());
        return;
    };
    let mut run = match Run::new(task.clone(), hand.clone(), Seed::from_u64(1)) {
        Ok(run) => run,
        Err(error) => return report.errors.push(error.to_string()),
    };
    for _ in 0..(IDLE_S / task.tick_s).ceil() as u64 {
        if run.over().is_some() || run.step(&Action::default()).is_err() {
            break;
        }
    }
    let outcome = run.finish(Reason::Stopped);
    if outcome.score != 0.0 {
        let name = &hand.name;
        report
            .warnings
            .push(format!("`{name}` scores {} points without any action in {IDLE_S} s", outcome.score));
    }
    if outcome.reason == Reason::WorldFault {
        report.errors.push("the simulation of this task fails".to_owned());
    }
}

/// Sweeps the first hand that fits through the scene.
fn sweep(task: &Arc<Task>, hands: &[Arc<Hand>], report: &mut Report) {
    let Some(hand) = hands.iter().find(|hand| report.hands.contains(&hand.name)) else { return };
    match Needs::of(task, hand) {
        Ok(needs) => report.model = Some(needs),
        Err(error) => report.errors.push(format!("{error:#}")),
    }
}

fn verdict(name: &str, report: &Report) -> String {
    let mut out = String::new();
    if report.errors.is_empty() {
        let _ =
            writeln!(out, "\n{} scenes built; hands that fit: {}", report.scenes, report.hands.join(", "));
    }
    out += &report.model.as_ref().map_or(String::new(), Needs::text);
    if !report.warnings.is_empty() {
        let _ = writeln!(out, "\nWarnings: {}", report.warnings.len());
        report.warnings.iter().for_each(|warning| out += &format!("  {warning}\n"));
    }
    report.errors.iter().for_each(|error| out += &format!("\n{error}\n"));
    let _ = match report.errors.is_empty() {
        true => writeln!(out, "\n{name}: usable"),
        false => writeln!(out, "\n{name}: not usable"),
    };
    out
}
