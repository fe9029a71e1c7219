//! `palmares hand export`: a hand as URDF or MJCF, with the `hand.toml` that says what the format cannot.

use crate::import::said;
use clap::{Args, ValueEnum};
use palmares_hand_import::decision::DecisionKind;
use palmares_hand_import::export::{ExportTarget, export};
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Arguments of `hand export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The name of a built-in hand, or a folder, .zip or file with one
    hand: String,
    /// Format to write
    #[arg(long, value_enum)]
    format: ExportFormat,
    /// Folder for the files
    #[arg(long, short, alias = "output", value_name = "FOLDER")]
    out: PathBuf,
    /// Write into an existing folder; files of the same name are replaced
    #[arg(long)]
    force: bool,
}

/// A format to write.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum ExportFormat {
    /// hand.urdf
    Urdf,
    /// hand.xml, for MuJoCo
    Mjcf,
}

/// Exports the hand and prints what the format cannot say.
///
/// # Errors
/// There is no such hand, or nothing can be written.
pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let target = match args.format {
        ExportFormat::Urdf => ExportTarget::Urdf,
        ExportFormat::Mjcf => ExportTarget::Mjcf,
    };
    let hand = export(&args.hand, target).map_err(said)?;
    hand.write(&args.out, args.force).map_err(said)?;
    let mut out = std::io::stdout().lock();
    for decision in hand.decisions.iter().filter(|decision| decision.kind != DecisionKind::Taken) {
        writeln!(out, "{}: {}: {}", decision.element, decision.kind.word(), decision.text)?;
    }
    let files: Vec<String> = hand.files.keys().map(|path| path.display().to_string()).collect();
    writeln!(out, "Written to {}: {}", args.out.display(), files.join(", "))?;
    Ok(ExitCode::SUCCESS)
}
