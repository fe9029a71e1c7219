//! `palmares hand`: look at a hand of one's own before anybody else does.

mod check;
mod closure;
mod describe;
mod draw;
mod figure;
mod figures;
mod fingers;
mod outline;
mod predict;
mod push;
mod show;
mod trial;
mod view;
mod views;

pub(crate) use figures::{figures, trials as trial_table};
pub(crate) use trial::trials;

use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use palmares_models::builtin::builtin_hands;
use palmares_models::error::{LoadWarning, ModelError};
use palmares_models::hand::Hand;
use palmares_models::measure::Sources;
use palmares_models::read::{self, LoadOptions, Loaded};
use palmares_tasks::Task;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

const CHECK_HELP: &str = "\
Exit code: 0 when the hand is usable, 1 when it is not, 2 with --strict when there are warnings.

Examples:
  palmares hand check my-hand/            a folder with hand.urdf, hand.toml and meshes
  palmares hand check my-hand.zip         the same folder, packed
  palmares hand check my-hand/hand.urdf
  palmares hand check softhand --json     a hand that comes with the program, for programs
  palmares hand check my-hand/ --config competition.toml --out sides.png";
const TRY_HELP: &str = "\
Examples:
  palmares hand try softhand
  palmares hand try my-hand.zip --task shelf";

const SHOW_HELP: &str = "\
Examples:
  palmares hand show softhand                     what it consists of, as text
  palmares hand show softhand --out softhand.svg
  palmares hand show my-hand/ --sigma 0.4 --out my-hand.png
  palmares hand show softhand --sigma 0.5 --push index_distal:-1,0,-0.5 --out pushed.png";

/// What to do with a hand.
#[derive(Debug, Subcommand)]
pub(crate) enum HandCommand {
    /// Load a hand, report what it is and what is odd about it, and close it in the air
    ///
    /// Prints tree, coordinates, R, E, motors, masses and warnings, each with file and element. Then the hand alone
    /// closes in the simulation at several σ, and the place where it comes to rest is held against the closed form
    /// of adaptive synergies.
    #[command(after_help = CHECK_HELP)]
    Check(check::CheckArgs),
    /// Play a hand in each task by a script that knows nothing of the task
    ///
    /// Once the hand does nothing, once it reaches out, closes, lifts and sweeps. What scores under it scores by its
    /// build: organizers look at the same numbers before they approve a hand.
    #[command(name = "try", after_help = TRY_HELP)]
    Try(TryArgs),
    /// Print what a hand consists of; with --out, draw it, open and closed, and its closure
    ///
    /// The picture shows the hand's shapes, and joints and tensions over time with where the closed form says they end.
    #[command(after_help = SHOW_HELP)]
    Show(show::ShowArgs),
}

impl HandCommand {
    /// Does it.
    pub(crate) fn run(&self) -> anyhow::Result<ExitCode> {
        match self {
            HandCommand::Check(args) => check::check(args),
            HandCommand::Try(args) => attempt(args),
            HandCommand::Show(args) => show::show(args),
        }
    }
}

/// Which hand is played in which tasks.
#[derive(Debug, Args)]
pub(crate) struct TryArgs {
    /// A URDF file, a folder or .zip with one, or the name of a hand that comes with the program
    hand: String,
    /// Only this task; may be given several times
    #[arg(long)]
    task: Vec<String>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

fn attempt(args: &TryArgs) -> anyhow::Result<ExitCode> {
    let found = load_hand(&args.hand);
    let hand = found.with_context(|| hint(&args.hand).unwrap_or_else(|| args.hand.clone()))?.hand;
    let mut tasks = Task::builtin();
    if let Some(wrong) = args.task.iter().find(|name| tasks.iter().all(|task| task.name != **name)) {
        let names: Vec<&str> = tasks.iter().map(|task| task.name.as_str()).collect();
        bail!("no task `{wrong}`; there are {}", names.join(", "));
    }
    tasks.retain(|task| args.task.is_empty() || args.task.contains(&task.name));
    let (played, refused) = trials(&tasks, &hand);
    let mut out = std::io::stdout().lock();
    if args.json {
        let report = serde_json::json!({"played": played, "refused": refused});
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        write!(out, "{}", trial_table(&played, &refused))?;
    }
    Ok(if refused.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Draws a hand from three sides; the file's name decides what is written.
pub(crate) fn draw(hand: &Hand, file: &Path) -> anyhow::Result<()> {
    draw::draw(&views::Views::of(hand), file)
}

/// A hand that was found.
struct Found {
    hand: Arc<Hand>,
    /// Where its numbers come from.
    sources: Sources,
    warnings: Vec<LoadWarning>,
}

/// A hand from a file, a folder, an archive, or, where there is none of that name, from the program itself.
fn load_hand(name: &str) -> Result<Found, ModelError> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(hand) = Hand::builtin(name)
    {
        return Ok(Found { hand, sources: Sources::of_urdf(path), warnings: Vec::new() });
    }
    let Loaded { hand, sources, warnings } = read::hand(path, &LoadOptions::default())?;
    Ok(Found { hand: Arc::new(hand), sources, warnings })
}

/// What to try when a name is neither a file nor a hand.
fn hint(name: &str) -> Option<String> {
    let names: Vec<&str> = builtin_hands().iter().map(|hand| hand.name.as_str()).collect();
    (!Path::new(name).exists()).then(|| format!("hands that come with the program: {}", names.join(", ")))
}

/// Reads `0.2,0.5,1`: numbers from 0 to 1.
fn parse_sigma(text: &str) -> anyhow::Result<f64> {
    let sigma: f64 = text.trim().parse().with_context(|| format!("`{text}` is not a number"))?;
    if !(0.0..=1.0).contains(&sigma) {
        bail!("σ = {sigma} is out of range; valid: 0 (open) to 1 (closed)");
    }
    Ok(sigma)
}
