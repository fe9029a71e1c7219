//! `palmares hand import` and `hand new`: a published hand becomes a folder with hand.urdf, hand.toml and meshes.

use clap::Args;
use palmares_hand_import::decision::Decision;
use palmares_hand_import::error::ImportError;
use palmares_hand_import::{Format, ImportOptions, Imported, import};
use palmares_protocol::text::printable;
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use crate::decisions::listed;
use crate::table::json;

/// Exit code of a hand that was written with problems.
const WITH_PROBLEMS: u8 = 2;

/// Decisions of a kind in the text, unless --all is given; problems are all shown.
const SHOWN: usize = 8;

/// Arguments of `hand import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// A description of a hand, a folder or .zip with one, such as a ROS package
    source: PathBuf,
    /// Folder for hand.urdf, hand.toml and meshes
    #[arg(long, short, alias = "output", value_name = "FOLDER")]
    out: PathBuf,
    /// The robot of a source with several: its file, or the file's name without extension
    #[arg(long, value_name = "ROBOT")]
    robot: Option<String>,
    /// Name of the hand, instead of the robot's
    #[arg(long)]
    name: Option<String>,
    /// Argument of a xacro file; can be given several times
    #[arg(long, value_name = "NAME:=VALUE")]
    arg: Vec<String>,
    #[command(flatten)]
    how: How,
}

/// Arguments of `hand new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// The hand's name
    name: String,
    /// A URDF, or another description that `hand import` reads
    #[arg(long, value_name = "FILE")]
    from: PathBuf,
    /// Folder for the files [default: the hand's name]
    #[arg(long, short, alias = "output", value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    how: How,
}

/// Common arguments.
#[derive(Debug, Args)]
struct How {
    /// Import only this link and what it carries, such as the hand of an arm
    #[arg(long, value_name = "LINK")]
    root: Option<String>,
    /// Links without a collision shape touch with the shapes of their pictures
    #[arg(long)]
    visual_as_collision: bool,
    /// Write into an existing folder; files of the same name are replaced
    #[arg(long)]
    force: bool,
    /// Print all decisions, not only the first of each kind
    #[arg(long)]
    all: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Report<'a> {
    name: &'a str,
    format: &'static str,
    description: String,
    folder: String,
    files: Vec<String>,
    decisions: &'a [Decision],
    warnings: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tendon_lines: Option<&'a str>,
}

/// The command in its help.
pub(crate) fn about() -> String {
    let formats = Format::names();
    format!(
        "Import a published hand: write hand.urdf, hand.toml and meshes\n\n\
         Reads {formats}; URDF and xacro with the files of their ROS package, meshes in STL, OBJ, COLLADA and .glb. \
         The format is recognised by content. All that was taken in other words, guessed or dropped, and all problems, \
         are comments in the written files. The guide: docs/hands.md."
    )
}

/// Imports the hand, writes it and prints the decisions.
///
/// # Errors
/// The source gives no hand, or nothing can be written.
pub(crate) fn run(args: &ImportArgs) -> anyhow::Result<ExitCode> {
    let options = ImportOptions {
        robot: args.robot.clone(),
        name: args.name.clone(),
        xacro_arguments: args.arg.clone(),
        ..ImportOptions::default()
    };
    written(&args.source, &args.out, options, &args.how)
}

/// Drafts a hand from a URDF.
///
/// # Errors
/// As [`run`].
pub(crate) fn draft(args: &NewArgs) -> anyhow::Result<ExitCode> {
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(&args.name));
    let options = ImportOptions { name: Some(args.name.clone()), template: true, ..ImportOptions::default() };
    written(&args.from, &out, options, &args.how)
}

/// The error in its own words, which have those of its cause already.
pub(crate) fn said(error: ImportError) -> anyhow::Error {
    anyhow::anyhow!("{error}")
}

fn written(source: &Path, folder: &Path, options: ImportOptions, how: &How) -> anyhow::Result<ExitCode> {
    let (root, visual_as_collision) = (how.root.clone(), how.visual_as_collision);
    let hand = import(source, &ImportOptions { root, visual_as_collision, ..options }).map_err(said)?;
    hand.write(folder, how.force).map_err(said)?;
    let mut out = std::io::stdout().lock();
    if how.json {
        let report = Report {
            name: &hand.name,
            format: hand.format.name(),
            description: hand.description.display().to_string(),
            folder: folder.display().to_string(),
            files: hand.files.keys().map(|path| path.display().to_string()).collect(),
            decisions: &hand.decisions,
            warnings: hand.warnings.iter().map(ToString::to_string).collect(),
            tendon_lines: hand.tendon_lines.as_deref(),
        };
        writeln!(out, "{}", json(&serde_json::to_value(&report)?))?;
    } else {
        write!(out, "{}", text(&hand, folder, how.all))?;
    }
    let problems = hand.problems().count();
    Ok(if problems == 0 { ExitCode::SUCCESS } else { ExitCode::from(WITH_PROBLEMS) })
}

fn text(hand: &Imported, folder: &Path, all: bool) -> String {
    let mut out = String::new();
    let (settings, folder) = (folder.join("hand.toml"), folder.display());
    let description = hand.description.display().to_string();
    let _ = writeln!(out, "{}: {} of {}", hand.name, hand.format.name(), printable(&description));
    let most = if all { usize::MAX } else { SHOWN };
    out += &listed(&hand.decisions, most, &folder.to_string());
    if let Some(lines) = &hand.tendon_lines {
        let _ = writeln!(
            out,
            "\nTendons: the format has none, so that each joint has a servo. These lines put a tendon over each finger.\nThey are \
             comments in {}: they replace all from '# Servos of the fingers' on.\n",
            settings.display()
        );
        for line in lines.lines() {
            let _ = writeln!(out, "{}", format!("  {}", printable(line)).trim_end());
        }
    }
    let meshes = hand.files.keys().filter(|path| path.starts_with("meshes")).count();
    let _ = writeln!(out, "\nWritten to {folder}: hand.urdf, hand.toml, {meshes} meshes");
    let problems = hand.problems().count();
    let next = if problems == 0 { "Next" } else { "With problems. Next" };
    let _ = writeln!(out, "{next}: palmares hand check {folder}");
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_hand_import::export::{ExportTarget, export};

    #[test]
    fn the_lines_of_tendons_are_printed_as_they_replace_others() {
        let mut hand = export("pinch", ExportTarget::Urdf).expect("exported");
        assert!(!text(&hand, Path::new("my-hand/"), false).contains("Tendons:"));
        hand.tendon_lines = Some("[motors]\nfinger_1 = 1\n\n# E\n".to_owned());
        let printed = text(&hand, Path::new("my-hand/"), false);
        let place =
            "They are comments in my-hand/hand.toml: they replace all from '# Servos of the fingers' on.\n";
        assert!(printed.contains(&format!("{place}\n  [motors]\n  finger_1 = 1\n\n  # E\n")), "{printed}");
    }
}
