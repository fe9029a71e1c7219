//! `palmares hand`: check, try, show, analyse, decompose, import, draft, copy and export a hand.

use crate::analyse::{self, AnalyseArgs};
use crate::check::{self, CheckArgs};
use crate::copy::{self, CopyArgs};
use crate::decompose::{self, DecomposeArgs, MeshOwner};
use crate::export::{self, ExportArgs};
use crate::figures::trials as trial_table;
use crate::import::{self, ImportArgs, NewArgs};
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
Exit code: 0 if the hand is usable, 1 if it is not, 2 with --strict if there are
warnings.

Examples:
  palmares hand check my-hand/        a folder: hand.urdf, hand.toml, meshes
  palmares hand check my-hand.zip     the same folder, packed
  palmares hand check my-hand/hand.urdf
  palmares hand check softhand --json a built-in hand, output for programs
  palmares hand check my-hand/ --config competition.toml --output sides.png";
const TRY_HELP: &str = "\
Exit code: 0 if the hand was played to the end in every task, 1 if it does not
fit, its world fails or needs too much computing.

Examples:
  palmares hand try softhand
  palmares hand try my-hand.zip --only shelf";

const SHOW_HELP: &str = "\
Exit code: 1 if the hand could not be simulated until it rests (the simulated
part is drawn), 0 otherwise.

Examples:
  palmares hand show softhand            links, joints, motors, sensors
  palmares hand show softhand --output softhand.svg
  palmares hand show my-hand/ --sigma 0.4 --output my-hand.png
  palmares hand show softhand --sigma 0.5 --push index_distal:-1,0,-0.5 \\
      --output pushed.png";
const ANALYSE_HELP: &str = "\
Examples:
  palmares hand analyse softhand       synergies, compliance, order of closing
  palmares hand analyse pinch --sigma 0.3,0.35 --json
  palmares hand analyse pinch --contact left_distal:0,-0.006,0.02:0,-1,0 \\
      --contact right_distal:0,0.006,0.02:0,1,0 \\
      --model soft-finger --friction 0.8 --figure pinch.svg";
const DECOMPOSE_HELP: &str = "\
Examples:
  palmares hand decompose my-hand/meshes/palm.stl     writes
      my-hand/meshes/palm_pieces/palm_01.stl and so on
  palmares hand decompose my-hand/meshes/palm.stl --pieces 12 \\
      --resolution 128 --force";

const IMPORT_HELP: &str = "\
Exit code: 0 if the hand is written without problems, 2 if it is written with
problems, 1 if nothing is written.

Examples:
  palmares hand import robotiq.urdf --out my-hand/
                                      a file; its ROS package has the meshes
  palmares hand import some_description/ --robot left --out my-hand/
  palmares hand import hand.zip --visual-as-collision --out my-hand/
  palmares hand import arm.urdf --root palm_link --out my-hand/
                                      the hand of an arm
  palmares hand check my-hand/";

const NEW_HELP: &str = "\
Exit code: as of `palmares hand import`.

Examples:
  palmares hand new claw --from claw.urdf    writes claw/hand.urdf and
                                             claw/hand.toml; edit it, then
  palmares hand check claw/";
const COPY_HELP: &str = "\
Examples:
  palmares hand copy pinch                   writes my-pinch/hand.urdf and
                                             my-pinch/hand.toml; edit them, then
  palmares hand check my-pinch/
  palmares hand copy softhand --out soft3/ --name soft3";
const EXPORT_HELP: &str = "\
Examples:
  palmares hand export softhand --format mjcf --out softhand-mjcf/
                                      hand.xml, meshes and hand.toml
  palmares hand export my-hand/ --format urdf --out my-hand-urdf/";

/// Commands for a hand.
#[derive(Debug, Subcommand)]
pub enum HandCommand {
    /// Load a hand, describe it, print warnings, and simulate its closing
    ///
    /// Prints tree, coordinates, R, E, motors, masses and warnings, each with file and element. Then the hand closes in
    /// simulation at several σ without objects, and its rest pose is compared with the closed form of adaptive
    /// synergies.
    #[command(after_help = CHECK_HELP)]
    Check(CheckArgs),
    /// Play a hand in each task by a script that ignores the task
    ///
    /// In one run the hand does nothing; in the other it reaches out, closes, lifts and sweeps. A hand that scores in these
    /// runs scores by its build: organizers see the same numbers before they approve a hand.
    #[command(name = "try", after_help = TRY_HELP)]
    Try(TryArgs),
    /// Describe a hand as text; with --output, simulate its closing and draw it
    ///
    /// The image shows the hand's shapes, open and closed, and joints and tensions over time with their predicted end values.
    #[command(after_help = SHOW_HELP)]
    Show(ShowArgs),
    /// Compute synergies, stiffness and the order of closing of a hand; with contacts, of a grasp
    ///
    /// The hand is at its equilibrium at σ, its base in the world's frame. With virtual contacts the command adds grasp matrix,
    /// hand Jacobian, stiffness of the object, controlled motions and forces, closure and quality. docs/analysis.md has the equations.
    #[command(after_help = ANALYSE_HELP)]
    Analyse(AnalyseArgs),
    /// Cut a mesh of a hand into convex pieces, and print the URDF elements that replace it
    ///
    /// The simulation uses a mesh's convex hull, which fills holes and hollows. This command cuts it into convex pieces (V-HACD),
    /// writes them as STL files next to it, and prints how their volume and surface differ from the mesh's. The pieces are
    /// simulated and hashed as files; nothing is cut when a hand is loaded.
    #[command(after_help = DECOMPOSE_HELP)]
    Decompose(DecomposeArgs),
    /// Import a published hand: write hand.urdf, hand.toml and meshes
    #[command(long_about = import::about(), after_help = IMPORT_HELP)]
    Import(ImportArgs),
    /// Draft the hand.toml of a URDF: its motors, tendons, coordinates and links, with comments
    ///
    /// As `import`, but a hand.toml beside the URDF is not taken, and every coordinate and link has a commented table to
    /// fill in.
    #[command(after_help = NEW_HELP)]
    New(NewArgs),
    /// Start a hand of your own from a built-in one
    #[command(after_help = COPY_HELP)]
    Copy(CopyArgs),
    /// Write a hand for other programs: as URDF, or as MJCF for MuJoCo
    ///
    /// hand.toml goes along: it says what the format cannot. `hand import` reads both again. The export prints what the format cannot say.
    #[command(after_help = EXPORT_HELP)]
    Export(ExportArgs),
}

impl HandCommand {
    /// Runs the command. `limits_of` reads the file of --config.
    ///
    /// # Errors
    /// The hand or the file cannot be read, or nothing can be written.
    pub fn run(&self, limits_of: LimitsOf<'_>) -> anyhow::Result<ExitCode> {
        match self {
            HandCommand::Check(args) => check::check(args, limits_of),
            HandCommand::Try(args) => attempt(args),
            HandCommand::Show(args) => show::show(args),
            HandCommand::Analyse(args) => analyse::analyse(args),
            HandCommand::Decompose(args) => decompose::run(args, MeshOwner::Hand),
            HandCommand::Import(args) => import::run(args),
            HandCommand::New(args) => import::draft(args),
            HandCommand::Copy(args) => copy::run(args),
            HandCommand::Export(args) => export::run(args),
        }
    }
}

/// Arguments of `hand try`.
#[derive(Debug, Args)]
pub struct TryArgs {
    /// A URDF file, a folder or .zip with one, or the name of a built-in hand
    hand: String,
    /// Only this task; can be given several times
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

/// Plays the hand in these tasks and prints the results, below `head` or as JSON. Returns whether all runs reached their
/// end.
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
