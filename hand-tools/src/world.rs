//! `palmares task import`: a Klamp't world becomes a folder with task.toml, meshes and URDFs.

use clap::Args;
use palmares_hand_import::decision::Decision;
use palmares_hand_import::{ImportedWorld, import_world};
use palmares_protocol::text::printable;
use palmares_tasks::Task;
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use crate::decisions::listed;
use crate::import::said;
use crate::table::json;

/// Exit code of a task that was written with problems.
const WITH_PROBLEMS: u8 = 2;

/// Arguments of `task import`.
#[derive(Debug, Args)]
pub struct WorldArgs {
    /// A Klamp't world (XML with the root element <world>), a folder or .zip with one
    source: PathBuf,
    /// Folder for task.toml, meshes and URDFs
    #[arg(long, short, alias = "output", value_name = "FOLDER")]
    out: PathBuf,
    /// The world of a source with several: its file, or the file's name without extension
    #[arg(long, value_name = "WORLD")]
    world: Option<String>,
    /// The task's name [default: the folder's name]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Write into an existing folder; files of the same name are replaced
    #[arg(long)]
    force: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Report<'a> {
    name: &'a str,
    description: String,
    folder: String,
    files: Vec<String>,
    decisions: &'a [Decision],
}

/// Makes the task, writes it and prints every decision.
///
/// # Errors
/// There is no world, none of its objects can be an object of a task, or nothing can be written.
pub fn run(args: &WorldArgs) -> anyhow::Result<ExitCode> {
    let folder = args.out.file_name().and_then(|name| name.to_str());
    let Some(name) = args.name.as_deref().or(folder) else {
        anyhow::bail!("{}: name the task with --name NAME", args.out.display());
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if !((1..=64).contains(&name.len()) && name.chars().all(plain) && !name.starts_with('.')) {
        let valid = "1 to 64 letters, digits, '_', '-' and '.', the first no '.'";
        anyhow::bail!("the task's name is '{}'; valid: {valid}; --name NAME states it", name.escape_debug());
    }
    if Task::builtin_toml(name).is_some() {
        anyhow::bail!("`{name}` is a built-in task; choose another --name");
    }
    let world = import_world(&args.source, args.world.as_deref(), name).map_err(said)?;
    world.write(&args.out, args.force).map_err(said)?;
    let mut out = std::io::stdout().lock();
    if args.json {
        let report = Report {
            name: &world.name,
            description: world.description.display().to_string(),
            folder: args.out.display().to_string(),
            files: world.files.keys().map(|path| path.display().to_string()).collect(),
            decisions: &world.decisions,
        };
        writeln!(out, "{}", json(&serde_json::to_value(&report)?))?;
    } else {
        write!(out, "{}", text(&world, &args.out.display().to_string()))?;
    }
    // What no reader of a world can see, such as a mesh whose hull fills a hollow, is said by the task's own reader.
    let loaded = Task::load(&args.out);
    if let (Err(error), false) = (&loaded, args.json) {
        writeln!(out, "It does not load yet: {error}")?;
    }
    let problems = world.problems().count() + usize::from(loaded.is_err());
    Ok(if problems == 0 { ExitCode::SUCCESS } else { ExitCode::from(WITH_PROBLEMS) })
}

fn text(world: &ImportedWorld, folder: &str) -> String {
    let mut out = String::new();
    let file = world.description.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    let _ = writeln!(out, "{}: Klamp't world {}", world.name, printable(&file));
    out += &listed(&world.decisions, usize::MAX, folder);
    let _ = writeln!(
        out,
        "\nWritten to {folder}: {} files; the lines above are comments in task.toml",
        world.files.len()
    );
    let next = if world.problems().next().is_none() { "Next" } else { "With problems. Next" };
    let _ = writeln!(out, "{next}: palmares task check {folder}");
    out
}
