//! `palmares hand`: look at a hand of one's own before anybody else does.

use crate::check::{self, CheckArgs};
use crate::decompose::{self, DecomposeArgs, MeshOwner};
use crate::figures::trials as trial_table;
use crate::load::{LimitsOf, hint, load_hand};
use crate::show::{self, ShowArgs};
use crate::trial::trials;
use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use palmares_models::hand::Hand;
use palmares_tasks::Task;
use std::io::Write as _;
use std::process::ExitCode;
use std::sync::Arc;

const CHECK_HELP: &str = "\
Exit code: 0 when the hand is usable, 1 when it is not, 2 with --strict when there are warnings.

Examples:
  palmares hand check my-hand/            a folder with hand.urdf, hand.toml and meshes
  palmares hand check my-hand.zip         the same folder, packed
  palmares hand check my-hand/hand.urdf
  palmares hand check softhand --json     a hand that comes with the program, for programs
  palmares hand check my-hand/ --config competition.toml --output sides.png";
const TRY_HELP: &str = "\
Exit code: 0 when the hand could be played to the end in every task, 1 when it does not fit, its world fails or needs too
much computing.

Examples:
  palmares hand try softhand
  palmares hand try my-hand.zip --only shelf";

const SHOW_HELP: &str = "\
Exit code: 1 when the hand cannot be simulated until it rests, 0 otherwise. What was simulated is drawn all the same.

Examples:
  palmares hand show softhand                     what it consists of, as text
  palmares hand show softhand --output softhand.svg
  palmares hand show my-hand/ --sigma 0.4 --output my-hand.png
  palmares hand show softhand --sigma 0.5 --push index_distal:-1,0,-0.5 --output pushed.png";
const DECOMPOSE_HELP: &str = "\
Examples:
  palmares hand decompose my-hand/meshes/palm.stl           writes my-hand/meshes/palm_pieces/palm_01.stl and so on
  palmares hand decompose my-hand/meshes/palm.stl --pieces 12 --resolution 128 --force";

/// What to do with a hand.
#[derive(Debug, Subcommand)]
pub enum HandCommand {
    /// Load a hand, report what it is and what is odd about it, and close it in the air
    ///
    /// Prints tree, coordinates, R, E, motors, masses and warnings, each with file and element. Then the hand alone
    /// closes in the simulation at several σ, and the place where it comes to rest is held against the closed form
    /// of adaptive synergies.
    #[command(after_help = CHECK_HELP)]
    Check(CheckArgs),
    /// Play a hand in each task by a script that knows nothing of the task
    ///
    /// Once the hand does nothing, once it reaches out, closes, lifts and sweeps. What scores under it scores by its
    /// build: organizers look at the same numbers before they approve a hand.
    #[command(name = "try", after_help = TRY_HELP)]
    Try(TryArgs),
    /// Print what a hand consists of; with --output, draw it, open and closed, and its closure
    ///
    /// The picture shows the hand's shapes, and joints and tensions over time with where the closed form says they end.
    #[command(after_help = SHOW_HELP)]
    Show(ShowArgs),
    /// Write a mesh of a hand as convex pieces, and what to put into the URDF in its place
    ///
    /// A mesh is played as its convex hull: holes and hollows are filled. This command cuts it into convex pieces (V-HACD),
    /// writes them as STL files beside it, and prints how much their volume differs from the mesh's and how far their surface
    /// lies from its own. The pieces are what is played and hashed; nothing is cut when a hand is loaded.
    #[command(after_help = DECOMPOSE_HELP)]
    Decompose(DecomposeArgs),
}

impl HandCommand {
    /// Does it. `limits_of` reads the file of --config.
    ///
    /// # Errors
    /// The hand or the file cannot be read, or nothing can be written.
    pub fn run(&self, limits_of: LimitsOf<'_>) -> anyhow::Result<ExitCode> {
        match self {
            HandCommand::Check(args) => check::check(args, limits_of),
            HandCommand::Try(args) => attempt(args),
            HandCommand::Show(args) => show::show(args),
            HandCommand::Decompose(args) => decompose::run(args, MeshOwner::Hand),
        }
    }
}

/// Which hand is played in which tasks.
#[derive(Debug, Args)]
pub struct TryArgs {
    /// A URDF file, a folder or .zip with one, or the name of a hand that comes with the program
    hand: String,
    /// Play only this task; may be given several times
    #[arg(long, alias = "task", value_name = "TASK")]
    only: Vec<String>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

fn attempt(args: &TryArgs) -> anyhow::Result<ExitCode> {
    let found = load_hand(&args.hand);
    let hand = found.with_context(|| hint(&args.hand).unwrap_or_else(|| args.hand.clone()))?.hand;
    let mut tasks = Task::builtin();
    if let Some(wrong) = args.only.iter().find(|name| tasks.iter().all(|task| task.name != **name)) {
        let names: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
        bail!("no task `{wrong}`; there are {}", names.join(", "));
    }
    tasks.retain(|task| args.only.is_empty() || args.only.contains(&task.name));
    let all_played = print_trials(&tasks, &hand, "", args.json)?;
    Ok(if all_played { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Plays the hand in these tasks and prints what came of it, below `head` or as JSON. Says whether it could be played in all, to
/// the end.
///
/// # Errors
/// Nothing can be written.
pub fn print_trials(tasks: &[Arc<Task>], hand: &Arc<Hand>, head: &str, json: bool) -> anyhow::Result<bool> {
    let (played, refused) = trials(tasks, hand);
    let mut out = std::io::stdout().lock();
    if json {
        let report = serde_json::json!({"played": played, "refused": refused});
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        write!(out, "{head}{}", trial_table(&played, &refused))?;
    }
    Ok(refused.is_empty() && played.iter().all(|trial| !trial.fault && !trial.ended_early))
}
