//! `palmares hand`: look at a hand of one's own before anybody else does.

mod advice;
mod check;
mod closure;
mod describe;
mod draw;
mod figure;
mod predict;
mod push;
mod show;
mod view;

use anyhow::{Context, bail};
use clap::Subcommand;
use palmares_models::builtin::builtin_hands;
use palmares_models::error::{LoadWarning, ModelError};
use palmares_models::hand::Hand;
use palmares_models::load::{self, LoadOptions, Loaded};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

const CHECK_HELP: &str = "\
Exit code: 0 when the hand is usable, 1 when it is not, 2 with --strict when there are warnings.

Examples:
  palmares hand check my-hand/            a folder with hand.urdf, hand.toml and meshes
  palmares hand check my-hand.zip         the same folder, packed
  palmares hand check my-hand/hand.urdf
  palmares hand check softhand --json     a hand that comes with the program, for programs";

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
            HandCommand::Show(args) => show::show(args),
        }
    }
}

/// A hand that was found.
struct Found {
    hand: Arc<Hand>,
    /// Its URDF.
    file: PathBuf,
    warnings: Vec<LoadWarning>,
}

/// A hand from a file, a folder, an archive, or, where there is none of that name, from the program itself.
fn load_hand(name: &str) -> Result<Found, ModelError> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(hand) = Hand::builtin(name)
    {
        return Ok(Found { hand, file: PathBuf::from(name), warnings: Vec::new() });
    }
    let Loaded { hand, file, warnings } = load::hand(path, &LoadOptions::default())?;
    Ok(Found { hand: Arc::new(hand), file, warnings })
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
